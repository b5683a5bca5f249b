"""A bake lasts as long as the animation that the scene shows: loops, strips and curves that go on."""

import bpy
import numpy as np
import pytest

from softground_addon.blender.compat import action_curves
from softground_addon.blender.panels.panels import _apart_from_scene
from softground_addon.blender.rigs.frame_ranges import animated_frames, held_range
from softground_addon.blender.settings import timeline_of
from tests.blender import shots
from tests.blender.grounds import bake
from tests.blender.interface.test_selection import controlled

KEYS = (1, 48)


@pytest.fixture
def walker(scene):
    scene.frame_start, scene.frame_end = 0, 200
    return shots.walker(scene, frames=48)


def curves_of(armature):
    return action_curves(armature.animation_data.action)


def loop(armature, count=0, before="NONE", after="REPEAT_OFFSET"):
    for curve in curves_of(armature):
        cycles = curve.modifiers.new("CYCLES")
        cycles.mode_before, cycles.mode_after, cycles.cycles_after = before, after, count


def frames(scene, armature):
    bpy.context.view_layer.update()
    return animated_frames(timeline_of(scene), armature)


def test_keys_alone_last_from_the_first_to_the_last(scene, walker):
    assert frames(scene, walker) == KEYS


def test_a_loop_lasts_to_the_end_of_the_scene_or_as_often_as_it_repeats(scene, walker):
    loop(walker)
    assert frames(scene, walker) == (1, 200)
    for curve in curves_of(walker):
        curve.modifiers[0].mode_before = "REPEAT"
    assert frames(scene, walker) == (0, 200)
    scene.frame_start, scene.frame_end = 100, 120
    assert frames(scene, walker) == (100, 120)
    for curve in curves_of(walker):
        curve.modifiers[0].mode_before, curve.modifiers[0].cycles_after = "NONE", 2
    assert frames(scene, walker) == (1, 48 + 2 * 47)
    for curve in curves_of(walker):
        curve.modifiers[0].mute = True
    assert frames(scene, walker) == KEYS


def test_a_modifier_lasts_no_longer_than_its_own_range(scene, walker):
    loop(walker)
    for curve in curves_of(walker):
        curve.modifiers[0].use_restricted_range = True
        curve.modifiers[0].frame_start, curve.modifiers[0].frame_end = 1, 120
    assert frames(scene, walker) == (1, 120)


def test_curves_that_go_straight_on_last_as_long_as_the_scene_and_level_ones_do_not(scene, walker):
    walker.keyframe_insert("delta_location", index=1, frame=10)
    curve = next(each for each in curves_of(walker) if each.data_path == "delta_location")
    walker.delta_location.y = 1.0
    walker.keyframe_insert("delta_location", index=1, frame=20)
    curve.extrapolation = "LINEAR"
    for key in curve.keyframe_points:
        key.interpolation = "LINEAR"
    assert frames(scene, walker) == (0, 200)
    curve.keyframe_points[1].co.y = 0.0
    curve.update()
    assert frames(scene, walker) == KEYS


def test_strips_last_as_they_lie_and_only_those_that_play(scene, walker):
    data = walker.animation_data
    action, data.action = data.action, None
    first, second = data.nla_tracks.new(), data.nla_tracks.new()
    strip = first.strips.new("Walk", 10, action)
    strip.repeat = 3.0
    second.strips.new("Again", 300, action)
    assert frames(scene, walker) == (10, 347)
    first.is_solo = True
    assert frames(scene, walker) == (10, 10 + 3 * 47)
    first.is_solo, second.mute = False, True
    assert frames(scene, walker) == (10, 10 + 3 * 47)


def test_a_rig_that_follows_a_loop_lasts_as_long(scene):
    scene.frame_end = 90
    control, deform = controlled(scene)
    loop(control)
    assert frames(scene, deform) == (1, 90)


def test_the_scene_is_counted_in_frames_of_its_remapped_time(scene, walker):
    loop(walker)
    scene.render.frame_map_old, scene.render.frame_map_new = 100, 200
    assert frames(scene, walker) == (1, 100)
    bpy.ops.softground.add_character()
    assert scene.softground.frame_end == 200


def test_a_looped_walk_prints_to_the_end_of_the_scene(scene, walker):
    scene.frame_end = 140
    loop(walker)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.02
    assert (scene.softground.frame_start, scene.softground.frame_end) == (1, 140)
    steps = bake(scene).report["steps"]
    starts = np.array([step["frame_start"] for step in steps])
    assert (starts > 48).sum() >= 4
    assert max(step["frame_end"] for step in steps) > 135
    ahead = np.array([step["position"] for step in steps])
    assert np.linalg.norm(ahead[-1] - ahead[0]) > 3.0


def test_the_panel_says_why_the_bake_and_the_scene_differ(scene, walker):
    assert not _apart_from_scene(scene)
    bpy.ops.softground.add_character()
    assert _apart_from_scene(scene) == "Animation 1-48, scene 0-200"
    scene.softground.frame_end = 100
    assert _apart_from_scene(scene) == "Bake 1-100, scene 0-200"
    scene.softground.frame_start, scene.softground.frame_end = 0, 200
    assert not _apart_from_scene(scene)


def posed(walker, frame):
    walker.animation_data_clear()
    for bone in walker.pose.bones:
        bone.matrix_basis.identity()
        bone.keyframe_insert("location", frame=frame)


def as_strip(_scene, walker):
    data = walker.animation_data
    data.nla_tracks.new().strips.new("Pose", 1, data.action)
    data.action = None


def slowed_down(scene, _walker):
    scene.render.frame_map_old, scene.render.frame_map_new = 50, 100


@pytest.mark.parametrize("change", [as_strip, slowed_down])
def test_a_pose_of_one_frame_is_held_as_a_strip_and_between_frames(scene, walker, change):
    posed(walker, 11)
    change(scene, walker)
    bpy.ops.softground.add_character()
    assert scene.softground.frame_end - scene.softground.frame_start >= scene.render.fps


def test_a_pose_of_one_frame_is_held_and_prints_both_feet(scene, walker):
    posed(walker, 1)
    scene.frame_start = scene.frame_end = 1
    assert frames(scene, walker) == (1, 1)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.02
    assert (scene.softground.frame_start, scene.softground.frame_end) == (1, 1 + scene.render.fps)
    steps = bake(scene).report["steps"]
    assert sorted(step["contact"] for step in steps) == ["foot.L", "foot.R"]
    weight = scene.softground.characters[0].mass * 9.81
    assert sum(step["peak_force_n"] for step in steps) == pytest.approx(weight, rel=0.02)


@pytest.mark.parametrize(
    ("extrapolation", "held"),
    [("HOLD", (1.5, 48.5)), ("HOLD_FORWARD", (-np.inf, 48.5)), ("NOTHING", (-np.inf, np.inf))],
)
def test_poses_are_held_beyond_a_strip_only_as_it_says(scene, walker, extrapolation, held):
    """Beyond other ends the rig is at rest, and no step may be drawn on from there."""
    data = walker.animation_data
    strip = data.nla_tracks.new().strips.new("walk", 1, data.action)
    data.action = None
    strip.frame_start, strip.frame_end = 1.5, 48.5
    strip.extrapolation = extrapolation
    assert held_range(timeline_of(scene), walker) == held
    assert frames(scene, walker) == (1, 49)
