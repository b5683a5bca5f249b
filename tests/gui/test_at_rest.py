"""Once the artist pauses, nothing of the add-on runs; and what it reads when a character is added can be left."""

import pytest

pytestmark = [pytest.mark.gui, pytest.mark.timeout(1500)]


@pytest.fixture
def facts(tell):
    return tell("at_rest")


@pytest.mark.parametrize("after", ["add", "bake", "edit", "undo", "overlay and key", "open", "live"])
def test_nothing_runs_any_more_once_blender_has_settled(facts, after):
    assert facts["copies"] == ["Plane Trail"]
    assert facts["running"][after] == {}


def test_reading_the_animation_of_a_character_can_be_left(facts):
    assert facts["reading"]
    assert facts["left: characters"] == 0
    assert facts["left: scenes"] == 1
    assert facts["characters"] == ["Walker"]


def test_a_moved_ground_is_told_of_and_one_that_was_only_opened_is_not(facts):
    assert "'Plane' has changed" in facts["outdated"]
    assert facts["outdated as opened"].splitlines() == ["The animation of 'Walker' has changed"]


def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]  # as in the lines of a traceback
