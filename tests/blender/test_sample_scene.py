"""The figure for those who have none: added beside what is there, and good for the two clicks."""

import json

import bpy
import pytest

from sample_scenes import moving_picture, production
from softground_addon.blender import settings
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


class BakeAskedError(Exception):
    """What a bake would have been done with."""


def test_two_clicks_bake_the_ground_of_the_readme_s_picture(scene, monkeypatch):
    def ask(scene, write):
        raise BakeAskedError(settings.snapshot(scene).inputs())

    bpy.ops.softground.add_sample_scene()
    bpy.ops.softground.add_character()
    clicked = settings.snapshot(scene).inputs()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    monkeypatch.setattr(production.bake_job, "bake", ask)
    with pytest.raises(BakeAskedError) as asked:
        moving_picture.build(bpy.context.scene)
    (shown,) = asked.value.args
    assert shown["cell_size_m"] == pytest.approx(clicked["cell_size_m"], rel=0.1)  # it fits the soles of each
    of_the_shot = {"file", "scene", "ground", "characters", "frames", "cell_size_m"}
    differ = {key for key in shown if shown[key] != clicked[key]} - of_the_shot
    assert differ == {"relief", "relief_vertices", "shape_keys"}  # how fine the picture is; the ground is the same
