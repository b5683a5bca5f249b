"""The tread of shoes: marked on the mesh for the render material, taken off with the bake, absent unless asked for."""

import bpy
import numpy as np
import pytest

from softground_addon.blender.ground import ground_mesh, own_data
from tests.blender import shots
from tests.blender.grounds import bake


@pytest.fixture
def ground(scene):
    shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.02
    scene.softground.detail = "NEVER"
    scene.softground.tread = 0.002
    bake(scene)
    return scene.softground.ground


def vectors(mesh, name):
    values = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.attributes[name].data.foreach_get("vector", values)
    return values.reshape(-1, 3)


def numbers(mesh, name):
    values = np.empty(len(mesh.vertices), np.float32)
    mesh.attributes[name].data.foreach_get("value", values)
    return values


def test_prints_carry_the_place_under_the_sole_and_the_depth_of_the_tread(ground):
    mesh = ground.data
    marks, touched = vectors(mesh, own_data.SOLE), numbers(mesh, ground_mesh.AGE) >= 0
    assert marks[:, 2].max() == pytest.approx(0.002, rel=1e-6)
    assert (marks[~touched, 2] < 0.002).all()
    inside = marks[marks[:, 2] > 0.0019]
    assert np.abs(inside[:, 0]).max() < 0.30  # the length of the shoe
    assert np.ptp(inside[:, 0]) > 1.5 * np.ptp(inside[:, 1])


def test_the_tread_goes_with_the_bake_and_where_it_is_not_asked_for(ground, scene):
    scene.softground.tread = 0.0
    bake(scene)
    assert own_data.SOLE not in ground.data.attributes
    scene.softground.tread = 0.002
    bake(scene)
    bpy.ops.softground.clear_bake()
    assert own_data.SOLE not in ground.data.attributes
