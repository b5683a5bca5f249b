"""Sliders in live mode, in a real Blender: the prints follow, and nobody waits."""

import pytest

from tests.pace import at_pace

pytestmark = [pytest.mark.timeout(1500), pytest.mark.alone]  # by the time of the processor

LONGEST_WAIT = 1.5
"""From letting go of a slider at frame 150 until all prints are as the settings say [s]."""
PAUSE = 0.005
"""Between two parts of an answer [s]."""
LONGEST_PART = 0.1
"""Of the processor, between two events [s]."""


@pytest.fixture
def facts(tell):
    return tell("live_answers")


@pytest.mark.gui
def test_the_newest_steps_follow_while_the_slider_is_dragged(facts):
    assert facts["depth"][1] > 1.3 * facts["depth"][0]
    newest = [seen[0] for seen in facts["while dragged"]]
    assert len(set(newest)) > 2
    assert min(newest) < 1.2 * facts["before"][0]


@pytest.mark.benchmark
def test_all_prints_are_there_soon_after(facts):
    assert facts["seconds after letting go"] < LONGEST_WAIT


@pytest.mark.gui
def test_all_prints_are_there_soon_after_on_a_screen_that_is_drawn_sixty_times_a_second(facts):
    """As a graphics card draws it, by the processor's time: the drawing is by software here, and takes far longer."""
    parts = facts["parts after letting go"]
    assert sum(parts) + len(parts) * (PAUSE + 1 / 60) < at_pace(LONGEST_WAIT)


@pytest.mark.gui
def test_all_prints_are_there_after_it(facts):
    assert facts["after"][1] < 1.2 * facts["before"][1]


@pytest.mark.gui
def test_nobody_waits_for_it(facts):
    assert facts["number of parts"] > 10
    assert facts["parts"][0] < at_pace(LONGEST_PART)


@pytest.mark.gui
def test_what_is_kept_is_what_a_bake_gives_with_these_settings(facts):
    assert facts["kept"]
    assert facts["outdated"] == ""
    assert facts["baked again: differs by"] < 1e-6


@pytest.mark.gui
def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]  # as in the lines of a traceback
