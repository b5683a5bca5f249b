"""Live mode in a real Blender, whatever happens to the scene meanwhile."""

import pytest

pytestmark = [pytest.mark.gui, pytest.mark.timeout(1500)]


@pytest.fixture
def facts(tell):
    return tell("disturbed_live")


def test_it_goes_on_when_rig_and_ground_are_renamed_and_duplicated(facts):
    assert facts["pressed: deepest"] < -0.01
    assert facts["renamed: goes on"]
    assert facts["renamed: live"]


def test_another_scene_leaves_it_alone(facts):
    assert facts["other scene: as it was"]


def test_it_goes_on_after_undo_and_redo(facts):
    assert facts["undone: live"]
    assert facts["undone: goes on"]
    assert facts["redone: goes on"]


@pytest.mark.parametrize("thing", ["rig", "ground"])
def test_it_ends_without_its_rig_and_without_its_ground(facts, thing):
    assert not facts[f"deleted {thing}: live"]


def test_disabling_the_add_on_takes_its_prints_away_and_enabling_it_begins_anew(facts):
    assert facts["disabled: flat"]
    assert facts["disabled: shape keys"] == "None"
    assert facts["enabled: flat"]
    assert not facts["enabled: live"]
    assert facts["live again: as before"]
    assert facts["discarded: flat"]


def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]  # as in the lines of a traceback
    assert "Error:" not in facts["printed"].replace("ModuleNotFoundError: No module named 'cattrs'", "")  # Debian's own
