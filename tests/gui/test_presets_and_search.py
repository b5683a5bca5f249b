"""Presets by clicks, operators by the search, and a command to paste into a terminal, in a real Blender."""

import shlex

import pytest

pytestmark = [pytest.mark.gui, pytest.mark.timeout(1500)]


@pytest.fixture
def facts(tell):
    return tell("presets_and_search")


def test_a_preset_is_added_and_removed_by_clicks(facts):
    assert facts["saved"] == ["my_ground.json"]
    assert facts["chosen"] == "My Ground"
    assert facts["removed"] == []
    assert facts["kept stiffness"] == pytest.approx(0.123)


def test_the_panel_says_when_values_are_no_longer_the_presets(facts):
    assert facts["modified"] == "My Ground (modified)"
    assert facts["as saved"] == "My Ground"


def test_the_search_finds_the_operators(facts):
    assert facts["found"] == {name: name for name in facts["found"]}
    assert len(facts["found"]) >= 5


def test_the_bake_command_is_on_the_clipboard_of_a_saved_file_only(facts):
    assert not facts["unsaved: may copy"]
    baked = facts["shot"].replace(".blend", "-baked.blend")
    bake = ["--command", "softground", "bake", f"--save={baked}"]
    assert shlex.split(facts["copied"]) == [facts["program"], "--background", facts["shot"], *bake]
    assert not facts["changed: may copy"]


def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]  # as in the lines of a traceback
    assert "Error:" not in facts["printed"].replace("ModuleNotFoundError: No module named 'cattrs'", "")  # Debian's own
