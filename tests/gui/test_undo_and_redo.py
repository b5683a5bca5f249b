"""Undo and redo in a real Blender, through random sessions: each step back and forth is, byte for byte, what was."""

import pytest

pytestmark = [pytest.mark.gui, pytest.mark.timeout(1500)]


@pytest.fixture
def facts(tell):
    return tell("undo_and_redo")


@pytest.mark.parametrize("direction", ["undone", "redone"])
def test_each_step_is_as_it_was(facts, direction):
    for session in facts["sessions"]:
        assert len(session["deeds"]) == len(session[direction]) > 0
        assert {step: changed for step, changed in session[direction].items() if changed} == {}, session["deeds"]


def test_bakes_are_among_the_steps(facts):
    deeds = {deed for session in facts["sessions"] for deed in session["deeds"]}
    assert deeds & {"bake", "bake by button", "bake again"}


def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]  # as in the lines of a traceback
