"""The figure for those who have none: added beside what is there, and good for the two clicks."""

import json

import bmesh
import bpy
import numpy as np
import pytest
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector

from softground_addon.blender.ground import baked_steps
from softground_addon.blender.setup import sample_scene
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


def add_cube(scene, place, size=2.0):
    mesh = bpy.data.meshes.new("Cube")
    solid = bmesh.new()
    bmesh.ops.create_cube(solid, size=size)
    solid.to_mesh(mesh)
    solid.free()
    cube = bpy.data.objects.new("Cube", mesh)
    cube.location = place
    scene.collection.objects.link(cube)
    bpy.context.view_layer.update()
    return cube


def test_it_comes_to_the_cursor_where_nothing_is_in_the_way(scene):
    add_cube(scene, (3.0, 1.0, -1.0))  # a floor
    scene.cursor.location = (3.0, 1.0, 0.0)
    bpy.ops.softground.add_sample_scene()
    assert tuple(bpy.context.object.location) == (3.0, 1.0, 0.0)
    assert [scene.frame_start, scene.frame_end] == [1, 250]


def test_it_stands_beside_what_is_there(scene):
    add_cube(scene, (0.0, 0.0, 0.0))
    bpy.ops.softground.add_sample_scene()
    first = bpy.context.object.location.copy()
    assert tuple(first) == (2.5, 0.0, 0.0)  # as far beside it as the walk is wide
    bpy.context.view_layer.update()
    bpy.ops.softground.add_sample_scene()
    assert bpy.context.object.location.x > first.x + 1.5


def test_it_is_in_colour_in_renders_too(scene):
    bpy.ops.softground.add_sample_scene()
    for material in bpy.context.object.children[0].data.materials:
        shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
        assert tuple(shader.inputs["Base Color"].default_value) == tuple(material.diffuse_color)
        assert len(set(material.diffuse_color[:3])) == 3


@pytest.mark.slow
def test_its_camera_sees_the_last_prints_in_a_low_sun(scene):
    bpy.ops.softground.add_sample_scene()
    (sun,) = [obj for obj in scene.objects if obj.type == "LIGHT"]
    assert 0 > (sun.rotation_euler.to_matrix() @ Vector((0.0, 0.0, -1.0))).z > -0.4
    bpy.ops.softground.add_character()
    bpy.ops.softground.bake()
    seen = [
        [world_to_camera_view(scene, scene.camera, corner) for corner in map(Vector, step.outline())]
        for step in baked_steps.of(scene.softground.ground)[-4:]
    ]
    for corners in seen:
        across, up, away = np.transpose(corners)
        assert (away > 0).all()
        assert 0.02 < across.min() < across.max() < 0.98
        assert 0.02 < up.min() < up.max() < 0.98
        assert np.ptp(across) > 0.025  # some 50 px of a picture


def test_the_camera_of_a_saved_shot_stays(scene, tmp_path):
    mine = bpy.data.objects.new("Mine", bpy.data.cameras.new("Mine"))
    scene.collection.objects.link(mine)
    scene.camera = mine
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    bpy.ops.softground.add_sample_scene()
    assert bpy.context.scene.camera == bpy.data.objects["Mine"]
    bpy.ops.softground.add_sample_scene()
    assert len([obj for obj in bpy.context.scene.objects if obj.type == "LIGHT"]) == 1


def test_the_file_is_small():
    assert sample_scene.FILE.stat().st_size < 150e3
    assert set(json.loads(sample_scene.FILE.read_text(encoding="utf-8"))) >= {"bones", "vertices", "curves"}
