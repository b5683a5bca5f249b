"""Feet that float above their prints, let down by one click in a real Blender."""

import pytest

pytestmark = [pytest.mark.gui, pytest.mark.timeout(900)]


@pytest.fixture
def facts(tell):
    return tell("sink_feet")


def test_its_switch_is_beside_bake_and_on_in_new_scenes(facts):
    assert facts["on by default"]
    assert facts["below Bake"] == pytest.approx(0.0, abs=12)  # px
    assert facts["switched off"]


def test_the_button_lets_the_feet_down(facts):
    assert facts["floating"] > 10.0
    assert facts["left"] < 2.0
    assert facts["grounding"]
    assert "SoftGround Response" in facts["layers"]


def test_the_prints_are_up_to_date_with_it(facts):
    assert facts["stale"] == ""


def test_one_undo_takes_it_back(facts):
    floating, grounding = facts["undone"]
    assert floating == pytest.approx(facts["floating"])
    assert not grounding


def test_depth_and_overlay_go_on_after_the_file_was_saved_and_opened_again(facts):
    predicted, baked, stale = facts["reopened"]
    assert predicted == pytest.approx(baked, rel=0.02)
    assert stale == ""


def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]  # as in the lines of a traceback
