"""The figure for those who have none: added beside what is there, and good for the two clicks."""

import json

import bpy
import pytest

from softground_addon.blender.ground import display_key
from softground_addon.blender.interface import sample_scene
from tests.blender import fingerprints


def test_two_clicks_after_it_there_are_prints(scene):
    before = fingerprints.of_file()
    assert bpy.ops.softground.add_sample_scene() == {"FINISHED"}
    added = fingerprints.of_file()
    assert {name: added["meshes"].get(name) for name in before["meshes"]} == before["meshes"]
    assert bpy.context.object.name == "Walking Figure"
    bpy.ops.softground.add_character()
    character = scene.softground.characters[0]
    assert len(character.soles) == 2
    assert 60 < character.mass < 100
    bpy.ops.softground.bake()
    summary = scene.softground.ground.data["softground_summary"]
    assert summary["steps"] >= 6
    assert 0.02 < summary["typical_depth_m"] < 0.1
    assert summary["floating_mm"] < 10


def test_it_comes_to_the_cursor_beside_what_is_there(scene):
    cube = bpy.data.objects.new("Cube", bpy.data.meshes.new("Cube"))
    scene.collection.objects.link(cube)
    scene.cursor.location = (3.0, 1.0, 0.0)
    bpy.ops.softground.add_sample_scene()
    bpy.ops.softground.add_sample_scene()
    assert tuple(bpy.context.object.location) == (3.0, 1.0, 0.0)
    assert cube.name == "Cube"
    assert [scene.frame_start, scene.frame_end] == [1, 250]


def test_the_file_is_small():
    assert sample_scene.FILE.stat().st_size < 150e3
    assert set(json.loads(sample_scene.FILE.read_text(encoding="utf-8"))) >= {"bones", "vertices", "curves"}


@pytest.mark.parametrize("choice", ["AUTO", "ALWAYS", "NEVER"])
def test_small_grounds_keep_shape_keys_of_themselves_and_large_ones_do_not(choice, monkeypatch):
    mesh = bpy.data.meshes.new("Ground")
    mesh.vertices.add(100)
    ground = bpy.data.objects.new("Ground", mesh)
    for most, expected in ((100, choice != "NEVER"), (99, choice == "ALWAYS")):
        monkeypatch.setattr(display_key, "MOST_VERTICES", most)
        assert display_key.is_wanted(choice, ground) == expected


def test_scripts_say_yes_or_no_to_shape_keys_as_before(scene):
    options = scene.softground
    assert (options.keep_shape_keys, options.shape_keys) == ("AUTO", True)
    options.shape_keys = False
    assert options.keep_shape_keys == "NEVER"
    options.shape_keys = True
    assert options.keep_shape_keys == "ALWAYS"
