"""Poses worked out from F-curves are those that Blender evaluates, and rigs that anything else moves are known."""

import bpy
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softground_addon.blender.compat import action_curves, slot_of
from softground_addon.blender.sampling.keyed_poses import is_moved_by_keys_alone, keyed_pose, keyed_world, with_parents
from tests.blender import rigs

MODES = ["QUATERNION", "AXIS_ANGLE", "XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"]
WIDTHS = {"location": 3, "rotation_quaternion": 4, "rotation_axis_angle": 4, "rotation_euler": 3, "scale": 3}
TIMES = [-3.0, 1.0, 2.5, 7.0, 12.25, 20.0, 31.0]


def random_rig(rng):
    """A tree of seven bones that point anywhere, some hanging from the tail of their parent, with names to escape."""
    names = ["hips", 'odd "name"', "back\\slash", "größe", "a", "b", "c"]
    parents = {name: names[rng.integers(place)] for place, name in enumerate(names) if place and rng.random() < 0.85}
    heads = rng.uniform(-1, 1, (len(names), 3))
    bones = {name: (head, head + rng.uniform(-1, 1, 3) + 0.1) for name, head in zip(names, heads.tolist(), strict=True)}
    armature = rigs.build("Random", {name: tuple(map(tuple, ends)) for name, ends in bones.items()}, parents)
    bpy.ops.object.mode_set(mode="EDIT")
    for bone in armature.data.edit_bones:
        bone.roll = rng.uniform(-3, 3)
        bone.use_connect = bone.parent is not None and rng.random() < 0.5
    bpy.ops.object.mode_set(mode="OBJECT")
    for bone in armature.pose.bones:
        animate(bone, rng)
    animate(armature, rng)
    return armature


def animate(thing, rng):
    """Some channels of an object or a bone are keyed, some stand anywhere; some curves are muted, some repeat."""
    thing.rotation_mode = MODES[rng.integers(len(MODES))]
    for name, width in WIDTHS.items():
        setattr(thing, name, rng.uniform(0.3, 2, width))
        if rng.random() < 0.5:
            for frame in rng.permutation(np.arange(1, 30))[: rng.choice([4, 29])].tolist():
                setattr(thing, name, rng.uniform(-2, 2, width))
                thing.keyframe_insert(name, frame=frame)
    animation = thing.id_data.animation_data
    curves = action_curves(animation.action, slot_of(animation)) if animation and animation.action else []
    for curve in curves:
        curve.extrapolation = ["CONSTANT", "LINEAR"][rng.integers(2)]
        for key in curve.keyframe_points:
            key.interpolation = ["CONSTANT", "LINEAR", "BEZIER", "ELASTIC"][rng.integers(4)]
        if rng.random() < 0.1:
            curve.mute = True
        if rng.random() < 0.1 and not curve.modifiers:
            curve.modifiers.new("CYCLES")


def assert_poses_equal_evaluated_ones(scene, armature):
    bones = [bone.name for bone in armature.pose.bones][::-1]
    assert is_moved_by_keys_alone(armature, bones)
    times = np.array(TIMES)
    world, poses = keyed_world(armature, times), {}
    for name in with_parents(armature, bones):
        above = armature.data.bones[name].parent
        poses[name] = keyed_pose(armature, name, times, poses[above.name] if above else times)
    for place, time in enumerate(TIMES):
        scene.frame_set(int(np.floor(time)), subframe=time % 1)
        evaluated = armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
        np.testing.assert_allclose(world[place], evaluated.matrix_world, rtol=1e-5, atol=1e-5)
        for bone in bones:
            truth = np.array(evaluated.pose.bones[bone].matrix)
            np.testing.assert_allclose(
                poses[bone][place], truth, rtol=1e-4, atol=1e-5 * np.abs(truth).max(), err_msg=f"{bone} at {time}"
            )


@pytest.mark.slow
@settings(max_examples=15)
@given(st.integers(0, 2**32 - 1))
def test_poses_of_random_rigs_are_those_that_blender_evaluates(addon, seed):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert_poses_equal_evaluated_ones(bpy.context.scene, random_rig(np.random.default_rng(seed)))


@pytest.fixture
def rig(scene):
    armature = rigs.human(rigs.FAMILIES["blender"])
    rigs.key(armature, "location", {1: (0, 0, 0), 20: (0.3, 0.1, 0.5)}, bone="hips")
    rigs.key(armature, "rotation_euler", {1: (0.1, 0, 0), 20: (-0.4, 0.2, 0)}, bone="foot.L")
    return armature


def test_quaternions_without_length_turn_as_in_blender(scene, rig):
    rig.pose.bones["thigh.L"].rotation_mode = "QUATERNION"
    rig.pose.bones["thigh.L"].rotation_quaternion = (0, 0, 0, 0)
    assert_poses_equal_evaluated_ones(scene, rig)


def test_an_action_without_its_slot_moves_nothing(scene, rig):
    if not hasattr(rig.animation_data, "action_slot"):
        pytest.skip("no slots in this Blender")
    rig.animation_data.action_slot = None
    assert_poses_equal_evaluated_ones(scene, rig)


def parented(rig):
    rig.parent = bpy.data.objects.new("Parent", None)


def constrained(rig):
    rig.constraints.new("COPY_LOCATION")


def with_a_constrained_bone(rig):
    rig.pose.bones["hand.R"].constraints.new("IK")


def driven(rig):
    rig.pose.bones["foot.R"].driver_add("location", 0)


def with_a_strip(rig):
    animation = rig.animation_data
    animation.nla_tracks.new().strips.new("Strip", 3, animation.action)


def soloed(rig):
    animation = rig.animation_data
    track = animation.nla_tracks.new()
    track.strips.new("Strip", 3, animation.action)
    track.mute = True
    track.is_solo = True


def half_in_effect(rig):
    rig.animation_data.action_influence = 0.5


def added_up(rig):
    rig.animation_data.action_blend_type = "ADD"


def over_when_its_keys_are(rig):
    rig.animation_data.action_extrapolation = "NOTHING"


def with_animated_data(rig):
    rig.data.keyframe_insert("display_type", frame=3)


def with_a_keyed_mode(rig):
    rig.pose.bones["foot.R"].keyframe_insert("rotation_mode", frame=3)


def with_its_own_mode_keyed(rig):
    rig.keyframe_insert("rotation_mode", frame=3)


def with_a_muted_group(rig):
    rig.pose.bones["hips"].keyframe_insert("scale", frame=1, group="Odd")
    animation = rig.animation_data
    groups = [curve.group for curve in action_curves(animation.action, slot_of(animation)) if curve.group]
    next(group for group in groups if group.name == "Odd").mute = True


def shifted(rig):
    rig.delta_location = (0, 0, 1)


def with_a_keyed_shift(rig):
    rig.keyframe_insert("delta_scale", frame=3)


def without_its_parents_turn(rig):
    rig.data.bones["foot.L"].use_inherit_rotation = False


def without_its_parents_scale(rig):
    rig.data.bones["shin.L"].inherit_scale = "NONE"


def moved_in_the_rigs_axes(rig):
    rig.data.bones["hips"].use_local_location = False


def without_animation(rig):
    rig.animation_data_clear()


@pytest.mark.parametrize(
    "change",
    [
        parented,
        constrained,
        with_a_constrained_bone,
        driven,
        with_a_strip,
        soloed,
        half_in_effect,
        added_up,
        over_when_its_keys_are,
        with_animated_data,
        with_a_keyed_mode,
        with_its_own_mode_keyed,
        with_a_muted_group,
        shifted,
        with_a_keyed_shift,
        without_its_parents_turn,
        without_its_parents_scale,
        moved_in_the_rigs_axes,
        without_animation,
    ],
)
def test_what_moves_a_rig_beside_its_keys_is_seen(rig, change):
    assert is_moved_by_keys_alone(rig, ["foot.L", "foot.R"])
    change(rig)
    assert not is_moved_by_keys_alone(rig, ["foot.L", "foot.R"])


def test_what_is_above_other_bones_only_does_not_matter(rig):
    rig.data.bones["forearm.L"].use_inherit_rotation = False
    assert is_moved_by_keys_alone(rig, ["foot.L", "foot.R"])


def test_a_muted_strip_leaves_the_action_alone(scene, rig):
    animation = rig.animation_data
    track = animation.nla_tracks.new()
    track.strips.new("Strip", 3, animation.action)
    track.mute = True
    assert_poses_equal_evaluated_ones(scene, rig)
