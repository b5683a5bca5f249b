"""Tuning while it plays, in a real Blender."""

import pytest

pytestmark = [pytest.mark.gui, pytest.mark.timeout(1500)]


@pytest.fixture
def facts(tell):
    return tell("tune_live")


def test_a_preset_is_chosen_in_the_menu(facts):
    assert facts["preset"] == "Soft Mud"  # the first of them, by its letter


def test_playing_presses_prints(facts):
    assert facts["live"]
    assert facts["played to"] > 40
    assert facts["played: deepest"] < -0.01


def test_scrubbing_back_and_forth_restores_the_ground_exactly(facts):
    at_10, at_25, at_1 = facts["scrubbed back"]
    assert facts["played: deepest"] <= at_25 <= at_10 <= at_1 == 0.0
    assert facts["first frame: as before"]
    assert facts["forth again: as before"]


def test_live_prints_are_kept_or_discarded(facts):
    assert facts["kept"]
    assert facts["no longer live"]
    assert facts["cleared: as before"]
    assert facts["discarded: as before"]


def test_the_overlay_is_switched_on_in_its_header(facts):
    assert facts["overlay"]


def test_opening_a_file_and_disabling_the_add_on_end_live_mode(facts):
    assert facts["reloaded: not live"]
    assert facts["disabled: no handlers"]


def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]  # as in the lines of a traceback
    assert "Error:" not in facts["printed"].replace("ModuleNotFoundError: No module named 'cattrs'", "")  # Debian's own
