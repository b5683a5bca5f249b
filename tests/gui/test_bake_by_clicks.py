"""Two clicks from an animated rig to prints, in a real Blender."""

import pytest

pytestmark = [pytest.mark.gui, pytest.mark.timeout(1500)]


@pytest.fixture
def facts(tell):
    return tell("bake_by_clicks")


def test_the_first_click_finds_the_feet(facts):
    assert facts["characters"] == ["Walker"]
    assert facts["soles"] == ["foot.L", "foot.R"]


def test_the_second_click_leaves_prints(facts):
    assert facts["prints"]["steps"] >= 15
    assert 0.01 < facts["prints"]["max_depth_m"] < 0.1
    assert facts["deepest vertex"] < -0.01


@pytest.mark.parametrize("way_out", ["escape", "cancel"])
def test_leaving_a_bake_midway_changes_nothing(facts, way_out):
    assert facts[f"{way_out}: baking"]
    assert facts[f"{way_out}: as before"]


def test_one_undo_takes_the_bake_back_byte_for_byte(facts):
    assert facts["undo: as before"]
    assert facts["redo: differs in"] == []
    assert facts["redo: prints"] == facts["prints"]


def test_prints_survive_saving_and_opening(facts):
    assert facts["reload: prints"] == facts["prints"]
    assert facts["reload: deepest vertex"] == facts["deepest vertex"]


def test_clearing_a_reopened_bake_flattens_the_ground(facts):
    assert facts["cleared: deepest vertex"] == 0.0


def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]  # as in the lines of a traceback
    assert "Error:" not in facts["printed"].replace("ModuleNotFoundError: No module named 'cattrs'", "")  # Debian's own
