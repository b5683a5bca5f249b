"""The figure for those who have none: added beside what is there, and good for the two clicks."""

import json

import bpy

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
