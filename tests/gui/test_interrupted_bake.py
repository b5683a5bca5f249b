"""Bakes in a real Blender whose rig, ground, scene, file, add-on or Blender itself goes away; and bakes and renders."""

import hashlib
from pathlib import Path

import pytest

pytestmark = [pytest.mark.gui, pytest.mark.timeout(1500)]


@pytest.fixture
def facts(tell):
    return tell("interrupted_bake")


def test_another_scene_is_not_baked(facts):
    assert facts["other scene: objects"] == []
    assert facts["other scene: as before"]


@pytest.mark.parametrize("thing", ["rig", "ground"])
def test_renaming_what_is_baked_changes_nothing(facts, thing):
    assert facts[f"renamed {thing}: as before"]


@pytest.mark.parametrize("thing", ["rig at 0.1", "rig at 0.62", "ground at 0.62", "scene at 0.1"])
def test_deleting_what_is_baked_ends_the_bake_and_leaves_the_rest(facts, thing):
    assert facts[f"deleted {thing}: changed"] == []


def test_opening_a_file_midway_leaves_the_file_as_it_was(facts):
    assert not facts["reopened: baking"]
    assert facts["reopened: file as before"]


def test_disabling_the_add_on_midway_leaves_the_scene_as_it_was(facts):
    assert not facts["disabled: baking"]
    assert facts["disabled: changed"] == []


def test_a_bake_waits_for_a_render(facts):
    assert not facts["F12: renders"]
    assert facts["render: runs"]
    assert facts["render: bake waits"]
    assert facts["render: status"] == "Waiting for the render"
    assert facts["render ended: steps"] >= 15


def test_nothing_begins_while_a_render_runs(facts):
    assert facts["rendering: runs"]
    assert not facts["rendering: may bake"]
    assert not facts["rendering: may go live"]
    assert facts["rendered: changed"] == []


def test_quitting_midway_leaves_the_file_as_it_was(facts):
    assert facts["quit: baking"]
    assert hashlib.sha256(Path(facts["quit: file"]).read_bytes()).hexdigest() == facts["quit: checksum"]
    assert "crash" not in facts["printed"].lower()


def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]  # as in the lines of a traceback
    assert "Error:" not in facts["printed"].replace("ModuleNotFoundError: No module named 'cattrs'", "")  # Debian's own
