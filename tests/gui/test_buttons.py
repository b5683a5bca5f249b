"""Buttons that start a job do so in a window, also where the job is done at once."""

import pytest

from tests.gui.stories.buttons import BAKING, EDITING, ON_THE_SPOT, READING

pytestmark = [pytest.mark.gui, pytest.mark.timeout(1500)]


@pytest.fixture
def facts(tell):
    return tell("buttons")


def test_all_buttons_with_a_job_are_pressed(facts):
    by_others = ("add_step", "change_step", "drop_steps", "live")  # each has a story
    assert facts["all"] == sorted((*ON_THE_SPOT, *READING, *BAKING, *EDITING, *by_others, "root_motion"))
    assert {name: ends for name, ends in facts["pressed"].items() if any(ends)} == {}


def test_steps_that_were_edited_and_reset_are_as_they_were(facts):
    assert facts["edited"] == 0


def test_walk_ahead_right_after_add_character_lets_the_walk_travel(facts):
    before, after, by_root_motion = facts["travel"]
    assert before < 0.1
    assert after > 2.0
    assert by_root_motion > 2.0


def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]  # as in the lines of a traceback
