"""Several soft grounds in one shot: a floor, a crate and stairs, each with prints of its own."""

import bpy
import pytest

from softground_addon.blender.ground import baked_ground
from tests.blender import shots
from tests.blender.ground.test_hard_ground import below, box, lift
from tests.blender.grounds import bake, plane


def over_a_crate(scene, height=0.2):
    rig = shots.walker(scene, frames=84)
    bpy.ops.softground.add_character()
    options = scene.softground
    options.ground, options.cell_size = plane(scene, size=9.0, vertices=200), 0.02
    box(scene, "Crate", height)
    lift(rig, height)
    bpy.context.view_layer.update()


@pytest.fixture
def crate(opened_as):
    opened_as(over_a_crate)
    return bpy.data.objects["Crate"]


def also(*objects):
    for obj in objects:
        bpy.context.scene.softground.grounds.add().object = obj


def prints_on(ground):
    return baked_ground.record_of(ground).footprints


def test_each_step_prints_on_the_ground_under_it(crate):
    scene = bpy.context.scene
    also(crate)
    result = bake(scene)
    floor = scene.softground.ground
    assert result.report["warnings"] == []
    on = {
        ground.name: [row for row in result.report["steps"] if row["ground"] == ground.name]
        for ground in (floor, crate)
    }
    assert len(on["Crate"]) >= 2
    assert len(on["Field"]) >= 4
    print(on["Crate"])
    assert all(abs(row["position"][2] - 0.2) < 0.05 for row in on["Crate"])
    assert all(row["position"][2] < 0.05 for row in on["Field"])
    assert len(prints_on(crate)) == len(on["Crate"])
    assert len(prints_on(floor)) == len(on["Field"])
    assert not below(prints_on(floor))
