"""Layers lie on a rig by constraints: they add up, follow renames and copies, and leave the user's keys to the user."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from softground_addon.blender import handlers
from softground_addon.blender.animation_layer.constraint_layer import (
    LayerKind,
    has_layer,
    put_layer,
    remove_layer,
    set_strength,
    without_layers,
)
from softground_addon.blender.animation_layer.layer_curves import LayerCurve, path_of_bone
from softground_addon.blender.baking import bake_report
from softground_addon.blender.compat import action_curves
from softground_addon.blender.response import response_job
from softground_addon.core.numerics.orientation import rotation_matrices
from tests.blender import fingerprints, responders, shots

FRAMES = np.array([1.0, 25.0, 48.0])
BONES = ("hips", "thigh.L", "shin.L", "foot.L", "thigh.R", "shin.R", "foot.R")


@pytest.fixture
def walker(scene):
    armature = shots.walker(scene, frames=48)
    bpy.ops.softground.add_character()
    scene.softground.frame_end = 48
    scene.softground.relief = "OFF"
    scene.softground.sink_feet = True
    return armature


def random_layer(bones, seed=0):
    """Curves of some bones at `FRAMES`, and the change of each bone there, (F, B, 4, 4)."""
    rng = np.random.default_rng(seed)
    changes, curves = np.tile(np.eye(4), (len(FRAMES), len(bones), 1, 1)), []
    for place, bone in enumerate(bones):
        turns = rng.normal((1, 0, 0, 0), 0.1, (len(FRAMES), 4))
        turns /= np.linalg.norm(turns, axis=1, keepdims=True)
        moves = rng.normal(0, 0.05, (len(FRAMES), 3))
        changes[:, place, :3, :3], changes[:, place, :3, 3] = rotation_matrices(turns), moves
        if bone.startswith(("shin", "foot")):  # which are connected: nothing moves them off their parents
            moves[:] = changes[:, place, :3, 3] = 0.0
        for channel, values in (("location", moves), ("rotation_quaternion", turns)):
            path = path_of_bone(bone, channel)
            curves += [LayerCurve(path, i, bone, FRAMES, column) for i, column in enumerate(values.T)]
    return curves, changes


def local_poses(scene, armature, bones=BONES):
    """Poses of bones relative to their parents' frames, (F, B, 4, 4)."""
    result = np.empty((len(FRAMES), len(bones), 4, 4))
    for sample, frame in enumerate(FRAMES):
        scene.frame_set(int(frame))
        evaluated = armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
        for place, bone in enumerate(bones):
            pose = evaluated.pose.bones[bone]
            parent = pose.parent.matrix @ pose.parent.bone.matrix_local.inverted() if pose.parent else Matrix()
            result[sample, place] = (parent @ pose.bone.matrix_local).inverted() @ pose.matrix
    return result


def shown(scene, armature, frames=range(1, 49, 4)):
    return responders.world_matrices(scene, armature, [bone.name for bone in armature.pose.bones], frames)


def test_a_layer_multiplies_each_pose_by_its_keys(scene, walker):
    before = local_poses(scene, walker)
    curves, changes = random_layer(BONES)
    put_layer(walker, LayerKind.RESPONSE, curves, {})
    assert local_poses(scene, walker) == pytest.approx(before @ changes, abs=3e-6)
    with without_layers(walker):
        assert np.array_equal(local_poses(scene, walker), before)


@pytest.mark.slow
def test_layers_add_up_in_their_order_whichever_was_put_on_first(scene, walker):
    before = local_poses(scene, walker)
    sunk, sinking = random_layer(BONES, seed=1)
    clean, cleaning = random_layer(BONES, seed=2)
    put_layer(walker, LayerKind.RESPONSE, sunk, {})
    put_layer(walker, LayerKind.CLEAN_FEET, clean, {})
    assert local_poses(scene, walker) == pytest.approx(before @ cleaning @ sinking, abs=3e-6)
    with without_layers(walker):
        assert local_poses(scene, walker) == pytest.approx(before @ cleaning, abs=3e-6)
    with without_layers(walker, LayerKind.CLEAN_FEET):
        assert np.array_equal(local_poses(scene, walker), before)
    remove_layer(walker, LayerKind.CLEAN_FEET)
    assert local_poses(scene, walker) == pytest.approx(before @ sinking, abs=3e-6)


def test_twice_the_strength_moves_twice_as_far(scene, walker):
    before = local_poses(scene, walker)
    curves, changes = random_layer(["hips"])
    put_layer(walker, LayerKind.RESPONSE, [curve for curve in curves if "location" in curve.path], {})
    for strength in (0.0, 0.5, 1.0, 1.5, 2.0, 1.0):
        set_strength(walker, LayerKind.RESPONSE, strength)
        moved = local_poses(scene, walker, ["hips"])[:, 0, :3, 3] - before[:, 0, :3, 3]
        whole = (before[:, 0] @ changes[:, 0])[:, :3, 3] - before[:, 0, :3, 3]
        assert moved == pytest.approx(strength * whole, abs=3e-6)


def test_it_lies_above_constraints_of_the_user_and_keeps_the_active_one(scene, walker):
    limit = walker.pose.bones["thigh.L"].constraints.new("LIMIT_ROTATION")
    limit.use_limit_x = limit.use_limit_y = limit.use_limit_z = True
    limit.owner_space = "LOCAL"
    before = local_poses(scene, walker)
    fingerprint = fingerprints.of_file()
    curves, changes = random_layer(BONES)
    put_layer(walker, LayerKind.RESPONSE, curves, {})
    assert walker.pose.bones["thigh.L"].constraints.active == limit
    assert local_poses(scene, walker) == pytest.approx(before @ changes, abs=3e-6)
    remove_layer(walker)
    local_poses(scene, walker)
    assert fingerprints.of_file() == fingerprint


@pytest.mark.slow
def test_a_key_set_after_a_bake_acts_at_once_and_is_the_users(scene, walker, tmp_path):
    action = walker.animation_data.action
    bpy.ops.softground.bake()
    assert bake_report.stale_reasons(scene) == ()
    scene.frame_set(12)
    before = shown(scene, walker, [12])
    scene.frame_set(12)
    bone = walker.pose.bones["upper_arm.L"]
    bone.rotation_mode = "XYZ"
    bone.rotation_euler.x += 0.5
    bone.keyframe_insert("rotation_euler", frame=12)
    assert walker.animation_data.action == action
    assert np.abs(shown(scene, walker, [12]) - before).max() > 0.05
    assert bake_report.stale_reasons(scene)
    bpy.ops.softground.bake()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "keyed.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "keyed.blend"))
    armature = bpy.data.objects["Walker"]
    paths = {curve.data_path for curve in action_curves(armature.animation_data.action)}
    assert 'pose.bones["upper_arm.L"].rotation_euler' in paths
    assert has_layer(armature)


@pytest.mark.slow
def test_cleaned_feet_also_sink_and_an_earlier_bake_is_outdated_by_the_cleaning(scene, walker):
    bpy.ops.softground.bake()
    assert bpy.ops.softground.clean_feet() == {"FINISHED"}
    assert has_layer(walker)
    assert has_layer(walker, LayerKind.CLEAN_FEET)
    assert bake_report.stale_reasons(scene)
    cleaned = shown(scene, walker)
    bpy.ops.softground.bake()
    assert has_layer(walker, LayerKind.CLEAN_FEET), "a bake keeps the cleaning"
    assert bake_report.stale_reasons(scene) == ()
    assert 0.02 < np.abs(shown(scene, walker) - cleaned).max() < 0.1, "cleaned feet sink"
    bpy.ops.softground.remove_clean_feet()
    assert not has_layer(walker, LayerKind.CLEAN_FEET)
    assert has_layer(walker)
    assert bake_report.stale_reasons(scene)


def test_a_layer_that_an_undo_of_blender_swaps_for_the_rig_is_put_back(scene, walker):
    for seed, kind in enumerate(LayerKind):
        put_layer(walker, kind, random_layer(BONES, seed)[0], {})
    set_strength(walker, LayerKind.RESPONSE, 1.5)
    poses = local_poses(scene, walker)
    before = fingerprints.of_file()
    for kind in LayerKind:  # as undo leaves it where the rig is read into the memory of a layer that was removed
        for owner in (walker, *walker.pose.bones):
            for constraint in owner.constraints:
                if constraint.target is not None and constraint.name.startswith(kind.value):
                    constraint.target = walker
        walker[kind.value] = walker
    handlers.after_undo()
    assert np.array_equal(local_poses(scene, walker), poses)
    assert not fingerprints.differences(before, fingerprints.of_file())


@pytest.mark.slow
def test_the_copy_of_a_rig_keeps_its_layer_when_that_of_the_rig_is_cleared(scene, walker):
    bpy.ops.softground.bake()
    copy = walker.copy()
    scene.collection.objects.link(copy)
    poses = shown(scene, copy)
    bpy.ops.softground.bake()
    assert np.array_equal(shown(scene, copy), poses)
    bpy.ops.softground.clear_bake()
    assert not has_layer(copy), "Clear Bake removes the layers of all rigs of the scene"
    bpy.data.objects.remove(copy)
    assert LayerKind.RESPONSE.value not in bpy.data.objects


def test_a_rig_that_shares_a_layer_keeps_it_when_the_other_is_removed(scene, walker):
    curves, _ = random_layer(BONES)
    put_layer(walker, LayerKind.RESPONSE, curves, {})
    copy = walker.copy()
    scene.collection.objects.link(copy)
    poses = shown(scene, copy)
    remove_layer(walker)
    assert np.array_equal(shown(scene, copy), poses)
    put_layer(walker, LayerKind.RESPONSE, random_layer(BONES, seed=5)[0], {})
    assert np.array_equal(shown(scene, copy), poses)


def test_the_scene_is_evaluated_anew_only_where_a_layer_was_taken_off(scene, walker):
    evaluated = []

    def note(*_):
        evaluated.append(1)

    bpy.app.handlers.depsgraph_update_post.append(note)
    try:
        walker.update_tag()
        response_job.remove_layers(scene, *LayerKind)
        assert not evaluated
        put_layer(walker, LayerKind.RESPONSE, random_layer(BONES)[0], {})
        evaluated.clear()
        response_job.remove_layers(scene, *LayerKind)
        assert evaluated == [1]
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(note)


def test_without_its_helper_the_walk_is_as_it_was_and_clear_takes_the_rest_away(scene, walker):
    before = shown(scene, walker)
    scene.frame_set(1)
    bytes_before = fingerprints.of_object(walker)
    bpy.ops.softground.bake()
    assert np.abs(shown(scene, walker) - before).max() > 0.01
    bpy.data.objects.remove(bpy.data.objects[LayerKind.RESPONSE.value])
    assert np.array_equal(shown(scene, walker), before)
    bpy.ops.softground.clear_bake()
    shown(scene, walker)
    scene.frame_set(1)
    assert fingerprints.of_object(walker) == bytes_before


@pytest.mark.slow
def test_renamed_rigs_bones_and_actions_play_on_and_clear(scene, walker):
    bpy.ops.softground.bake()
    poses = shown(scene, walker)
    walker.name, walker.animation_data.action.name = "Hero", "Take 7"
    walker.data.bones["foot.L"].name = "Fuß"
    assert np.array_equal(shown(scene, walker), poses)
    bpy.ops.softground.clear_bake()
    assert not any(bone.constraints for bone in walker.pose.bones)


@pytest.mark.slow
@pytest.mark.parametrize("link", [False, True], ids=["appended", "linked"])
def test_a_layer_comes_along_without_the_add_on(scene, walker, tmp_path, link):
    bpy.ops.softground.bake()
    poses = shown(scene, walker)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "baked.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "baked.blend"), link=link) as (_, wanted):
        wanted.objects = ["Walker"]
    bpy.context.scene.collection.objects.link(bpy.data.objects["Walker"])
    bpy.context.scene.render.fps = 24
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    assert np.array_equal(shown(bpy.context.scene, bpy.data.objects["Walker"]), poses)


@pytest.mark.slow
def test_an_override_keeps_its_layer_through_save_and_load(scene, tmp_path):
    responders.linked_walker(tmp_path)
    scene, armature = bpy.context.scene, bpy.data.objects["Walker"].override_create()
    scene.collection.objects.unlink(bpy.data.objects["Walker Figure"].id_data)
    scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.softground.add_character()
    responders.bake(scene)
    poses = shown(scene, armature)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    scene = bpy.context.scene
    armature = scene.softground.characters[0].armature
    assert has_layer(armature)
    assert np.abs(shown(scene, armature) - poses).max() < 1e-5


@pytest.mark.slow
def test_two_characters_on_one_action_each_have_their_response(scene, walker):
    other = walker.copy()
    other.location.x = 3.0
    scene.collection.objects.link(other)
    for child in walker.children:
        mesh = child.copy()
        mesh.parent = other
        mesh.modifiers[0].object = other
        scene.collection.objects.link(mesh)
    for obj in scene.objects:
        obj.select_set(obj == other)
    bpy.context.view_layer.objects.active = other
    bpy.ops.softground.add_character()
    scene.softground.characters[1].mass *= 3
    action = fingerprints.of_action(walker.animation_data.action)
    bpy.ops.softground.bake()
    deep = [shown(scene, rig)[..., 2, 3].min() for rig in (walker, other)]
    assert deep[1] < deep[0] - 0.01, "the heavy one sinks deeper"
    assert fingerprints.of_action(walker.animation_data.action) == action


def test_a_rig_without_an_action_responds(scene, walker):
    """Its bones copy those of another rig."""
    puppet = walker.copy()
    puppet.animation_data_clear()
    scene.collection.objects.link(puppet)
    for bone in puppet.pose.bones:
        follow = bone.constraints.new("COPY_TRANSFORMS")
        follow.target, follow.subtarget = walker, bone.name
    for child in walker.children:
        child.parent = puppet
        child.modifiers[0].object = puppet
    scene.softground.characters[0].armature = puppet
    before = shown(scene, puppet)
    result = responders.bake(scene)
    assert len(result.report["steps"]) >= 3
    assert (before - shown(scene, puppet))[..., 2, 3].max() > 0.01
    assert puppet.animation_data is None or puppet.animation_data.action is None
    bpy.ops.softground.clear_bake()
    assert np.array_equal(shown(scene, puppet), before)


def posed_as(armature, mode):
    """The same poses by another rotation mode of all bones."""
    scene = bpy.context.scene
    for frame in range(1, 49):
        scene.frame_set(frame)
        for bone in armature.pose.bones:
            basis = Matrix(bone.matrix_basis)
            bone.rotation_mode = mode
            bone.matrix_basis = basis
            bone.keyframe_insert(f"rotation_{'axis_angle' if mode == 'AXIS_ANGLE' else 'euler'}", frame=frame)
            bone.rotation_mode = "QUATERNION"
    for bone in armature.pose.bones:
        bone.rotation_mode = mode


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["QUATERNION", "XYZ", "ZXY", "AXIS_ANGLE"])
def test_made_keys_show_what_the_layers_showed_and_keep_the_users_action(scene, walker, mode):
    if mode != "QUATERNION":
        posed_as(walker, mode)
    action = walker.animation_data.action
    before = fingerprints.of_action(action)
    bpy.ops.softground.bake()
    poses = shown(scene, walker)
    assert bpy.ops.softground.make_keys() == {"FINISHED"}
    assert shown(scene, walker) == pytest.approx(poses, abs=1.5e-3)
    assert not any(bone.constraints for bone in walker.pose.bones)
    assert LayerKind.RESPONSE.value not in bpy.data.objects
    assert walker.animation_data.action != action
    assert action.use_fake_user
    assert fingerprints.of_action(action)[:2] == before[:2]
    assert bake_report.stale_reasons(scene) == (), "feet stand in the prints, now by keys"
    result = responders.bake(scene)
    assert "response_in_keys" in {finding["code"] for finding in result.report["self_check"]}


@pytest.mark.parametrize("goes_on", ["not", "parent", "cycles", "further keys"])
def test_made_keys_last_as_long_as_the_walk_and_the_bake(scene, walker, goes_on):
    """A clip with a tail that stands still is no walk; what is seen after the bake stays."""
    scene.frame_end, last = 250, {"cycles": 250, "further keys": 60}.get(goes_on, 48)
    if goes_on == "parent":  # as Walk Ahead makes one
        walker.parent = bpy.data.objects.new("Travel", None)
        scene.collection.objects.link(walker.parent)
        for frame in (1, 48):
            walker.parent.location.x = frame / 1000
            walker.parent.keyframe_insert("location", frame=frame)
    of_walk = action_curves(walker.animation_data.action)
    of_parent = action_curves(walker.parent.animation_data.action) if walker.parent else []
    for curve in of_parent:
        curve.extrapolation = "LINEAR"
    if goes_on == "cycles":
        for curve in of_walk:
            curve.modifiers.new("CYCLES")
        walker.animation_data.action.update_tag()
    if goes_on == "further keys":
        walker.pose.bones["hips"].location.z += 0.01
        walker.pose.bones["hips"].keyframe_insert("location", frame=last)
    bpy.ops.softground.bake()
    watched = (1, 20, 48, last)
    poses = shown(scene, walker, watched)
    bpy.ops.softground.make_keys()
    assert tuple(walker.animation_data.action.frame_range) == (1, last)
    assert shown(scene, walker, watched) == pytest.approx(poses, abs=1.5e-3)


@pytest.mark.slow
def test_made_keys_of_ik_controls_and_of_the_object_that_travels(scene):
    responders.with_ik()
    armature = bpy.context.view_layer.objects.active
    bpy.ops.softground.add_character()
    responders.bake(scene)
    curves = [LayerCurve("location", i, "Object Transforms", FRAMES, FRAMES * (i + 1) / 100) for i in range(3)]
    armature.rotation_euler.z = 0.7
    put_layer(armature, LayerKind.ROOT_MOTION, curves, {})
    poses = shown(scene, armature)
    bpy.ops.softground.make_keys()
    assert shown(scene, armature) == pytest.approx(poses, abs=1.5e-3)
    assert LayerKind.ROOT_MOTION.value not in bpy.data.objects


def test_bones_that_keys_cannot_pose_keep_their_layer(scene, walker):
    limit = walker.pose.bones["foot.L"].constraints.new("LIMIT_SCALE")
    bpy.ops.softground.bake()
    poses = shown(scene, walker)
    bpy.ops.softground.make_keys()
    assert shown(scene, walker) == pytest.approx(poses, abs=1.5e-3)
    constraints = {
        bone.name: [constraint.name for constraint in bone.constraints]
        for bone in walker.pose.bones
        if bone.constraints
    }
    assert constraints == {"foot.L": [limit.name, LayerKind.RESPONSE.value]}


@pytest.mark.parametrize("trouble", ["nothing", "tweak mode", "solo"])
def test_keys_that_would_not_show_are_refused_and_nothing_changes(scene, walker, trouble):
    if trouble != "nothing":
        bpy.ops.softground.bake()
        animation = walker.animation_data
        track = animation.nla_tracks.new()
        track.strips.new("mine", 1, animation.action)
        track.is_solo = trouble == "solo"
        if trouble == "tweak mode":
            animation.action = None
            track.select = track.strips[0].select = True
            animation.nla_tracks.active = track
            animation.use_tweak_mode = True
            if not animation.use_tweak_mode:
                pytest.skip("this Blender enters tweak mode from its editor only")
    before = fingerprints.of_file()
    with pytest.raises(RuntimeError, match={"nothing": "Sink Feet"}.get(trouble, trouble)):
        bpy.ops.softground.make_keys()
    assert fingerprints.of_file() == before
