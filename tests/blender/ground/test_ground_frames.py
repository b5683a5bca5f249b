"""Ground far from the origin, and turned ground under turned gravity, are baked as level ground at the origin is."""

from math import pi

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix, Vector

from softground_addon.blender import settings
from softground_addon.blender.debris import debris_object
from softground_addon.blender.ground import baked_ground
from softground_addon.blender.reading import staleness
from tests.blender.grounds import bake, field

MAP = (548000.0, 5932000.0, 0.0)
WHERE = {
    "on_a_map": Matrix.Translation(MAP),
    "on_a_wall": Matrix.Rotation(pi / 2, 4, "X"),
    "askew_on_a_map": Matrix.Translation(MAP) @ Euler((1.0, -2.0, 0.5)).to_matrix().to_4x4(),
}


def moved(scene, matrix):
    """Move a scene as a whole, and turn its gravity with it."""
    for obj in scene.objects:
        if obj.parent is None:
            obj.matrix_basis = matrix @ obj.matrix_basis
    scene.gravity = matrix.to_3x3() @ scene.gravity
    bpy.context.view_layer.update()


def hung_up(scene):
    """An empty from which a whole scene hangs."""
    place = bpy.data.objects.new("Place", None)
    for obj in scene.objects:
        if obj.parent is None:
            obj.parent = place
    scene.collection.objects.link(place)
    bpy.context.view_layer.update()


def posed(scene):
    """Heads of the bones in the armature's space over the walk, (F, B, 3)."""
    rig, heads = scene.softground.characters[0].armature, []
    for frame in range(1, 31, 4):
        scene.frame_set(frame)
        shown = rig.evaluated_get(bpy.context.evaluated_depsgraph_get())
        heads.append([bone.head[:] for bone in shown.pose.bones])
    return np.array(heads)


@pytest.mark.parametrize("parented", [False, True])
@pytest.mark.parametrize("where", WHERE)
def test_a_bake_is_the_same_wherever_the_shot_is(short_walk, where, parented):
    scene = short_walk
    field(scene)
    if parented:
        hung_up(scene)
    before = bake(scene).footprints
    bpy.ops.softground.clear_bake()
    moved(scene, WHERE[where])
    now = bake(scene).footprints
    assert len(now) == len(before) == 3
    for here, there in zip(now, before, strict=True):
        assert here.position == pytest.approx(there.position, abs=1e-5)
        assert here.max_depth_m == pytest.approx(there.max_depth_m, abs=1e-5)
    assert staleness.reasons(scene, settings.snapshot(scene)) == ()


def test_feet_are_let_down_into_prints_on_a_wall_as_on_level_ground(short_walk):
    field(short_walk)
    bake(short_walk, sink_feet=True)
    feet = posed(short_walk)
    bpy.ops.softground.clear_bake()
    assert np.abs(posed(short_walk) - feet).max() > 0.02
    moved(short_walk, WHERE["on_a_wall"])
    bake(short_walk)
    assert posed(short_walk) == pytest.approx(feet, abs=2e-4)


def test_feet_stay_as_they_are_where_blender_would_round_their_layer(short_walk):
    field(short_walk)
    moved(short_walk, WHERE["on_a_map"])
    report = bake(short_walk, sink_feet=True).report
    assert any("Feet were not lowered" in text and "0.5 units" in text for text in report["warnings"])


def test_steps_events_and_what_is_thrown_are_told_where_they_are_in_the_world(short_walk):
    ground = field(short_walk)
    short_walk.softground.debris = True
    before, wall = bake(short_walk), WHERE["on_a_wall"]
    bpy.context.view_layer.update()
    pieces = debris_object.of(ground)
    middle = pieces.matrix_world @ Vector(pieces.data.vertices[0].co)
    bpy.ops.softground.clear_bake()
    moved(short_walk, wall)
    now = bake(short_walk)
    bpy.context.view_layer.update()
    for table in ("steps", "events"):
        for here, there in zip(now.report[table], before.report[table], strict=True):
            assert here["position"] == pytest.approx(wall @ Vector(there["position"]), abs=2e-5)
    assert baked_ground.events_of(ground)[0]["normal"] == pytest.approx(wall @ Vector((0, 0, 1)), abs=1e-4)
    pieces = debris_object.of(ground)
    assert (pieces.matrix_world @ Vector(pieces.data.vertices[0].co))[:] == pytest.approx((wall @ middle)[:], abs=1e-4)


def test_a_ground_is_created_under_a_walk_on_a_wall_that_is_far_away(short_walk):
    before = bake(short_walk)
    deepest = before.report["totals"]["max_depth_m"]
    ground = short_walk.softground.ground
    bpy.data.objects.remove(ground)
    moved(short_walk, Matrix.Translation(MAP) @ WHERE["on_a_wall"])
    now = bake(short_walk)
    assert now.report["totals"]["max_depth_m"] == pytest.approx(deepest, rel=1e-2)
    assert short_walk.softground.ground.matrix_world.col[2][:3] == pytest.approx((0, -1, 0), abs=1e-6)
