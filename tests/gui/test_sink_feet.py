"""Feet that float above their prints, let down by one click in a real Blender."""

import pytest

pytestmark = [pytest.mark.gui, pytest.mark.timeout(900)]


@pytest.fixture
def facts(tell):
    return tell("sink_feet")


def test_the_button_lets_the_feet_down(facts):
    assert facts["floating"] > 10.0
    assert facts["left"] < 2.0
    assert facts["grounding"]
    assert "SoftGround Response" in facts["tracks"]


def test_the_prints_are_up_to_date_with_it(facts):
    assert facts["stale"] == ""


def test_one_undo_takes_it_back(facts):
    floating, grounding = facts["undone"]
    assert floating == pytest.approx(facts["floating"])
    assert not grounding


def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]  # as in the lines of a traceback
