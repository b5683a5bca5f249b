"""What is sampled is what the rig does, and reading it changes nothing."""

import csv
import itertools

import bpy
import numpy as np
import pytest

from softground_addon.blender.jobs import run
from softground_addon.blender.rigs.rig_mapping import map_rig
from softground_addon.blender.sampling.rig_sampling import sample_character
from softground_addon.blender.sampling.take import Take
from softground_addon.core.errors import InputError
from softground_addon.core.rig.mapping import RigMapping, SoleSource
from tests.blender import fingerprints, rigs, shots
from tests.blender.bvh import Bvh, file_to_world

BLENDER = rigs.FAMILIES["blender"]


def sample(scene, armature, mapping=None, *, end=20, step=1):
    mapping = mapping or map_rig(armature)
    return run(sample_character(Take.about(armature, scene, range(1, end + 1, step)), armature, mapping, mass=70.0))


def moving_human(**options):
    """The standing figure with keys on hips, thigh and foot."""
    armature = rigs.human(BLENDER, **options)
    rigs.key(armature, "location", {1: (0, 0, 0), 20: (0.3, 0.1, 0.5)}, bone="hips")
    rigs.key(armature, "rotation_euler", {1: (0, 0, 0), 20: (0.6, 0.1, 0.2)}, bone="thigh.L")
    rigs.key(armature, "rotation_euler", {1: (0.1, 0, 0), 20: (-0.4, 0.2, 0)}, bone="foot.L")
    return armature


def let_blender_evaluate(armature):
    """Something that does nothing, but is more than keys."""
    armature.constraints.new("LIMIT_LOCATION")


@pytest.mark.slow
@pytest.mark.parametrize("name", shots.MOTION_FILES)
def test_joints_equal_independent_forward_kinematics_of_the_motion_file(scene, name):
    armature = shots.import_motion(name)
    motion_file = shots.MOTION_FILES[name]
    truth = Bvh(shots.SHARED / motion_file.path).positions()
    count = len(next(iter(truth.values())))
    mapping = map_rig(armature)
    motion = sample(scene, armature, mapping, end=count)
    to_world = file_to_world(motion_file)
    checked = 0
    for joint, (bone, end) in mapping.joints.items():
        if end == "head":
            np.testing.assert_allclose(motion.joints[joint], truth[bone] @ to_world.T, atol=1e-4, err_msg=joint)
            checked += 1
    assert checked >= 18


@pytest.mark.parametrize("name", ["walk", "run"])
def test_joints_of_a_measured_gait_follow_the_measured_joint_centres(scene, name):
    armature = shots.import_motion(name)
    path = (shots.SHARED / shots.MOTION_FILES[name].path).with_suffix(".csv")
    with path.open() as stream:
        rows = list(csv.DictReader(stream))
    motion = sample(scene, armature, end=len(rows))
    for joint in ("knee_l", "knee_r", "ankle_l", "ankle_r", "ball_l", "ball_r"):
        measured = np.array([[float(row[f"{joint}_{axis}"]) for axis in "xyz"] for row in rows])
        # the file looks along -Z in its own axes, so that X forward becomes Blender's X
        gap = np.linalg.norm(motion.joints[joint] - measured, axis=1)
        assert np.sqrt(np.mean(gap**2)) < 0.03, joint


@pytest.mark.parametrize("name", ["walk", "run"])
def test_soles_of_a_measured_gait_lie_flat_in_mid_stance(scene, name):
    armature = shots.import_motion(name)
    path = (shots.SHARED / shots.MOTION_FILES[name].path).with_suffix(".csv")
    with path.open() as stream:
        rows = list(csv.DictReader(stream))
    motion = sample(scene, armature, end=len(rows))
    for sole, side in zip(motion.soles, "lr", strict=True):
        load = np.array([float(row[f"grf_{side}_z"]) for row in rows])
        ball, ankle = motion.joints[f"ball_{side}"], motion.joints[f"ankle_{side}"]
        speed = np.linalg.norm(np.gradient(ball, axis=0), axis=1) + np.linalg.norm(np.gradient(ankle, axis=0), axis=1)
        flat = np.argsort(np.where(load > 300, speed, np.inf))[:5]
        tilt = np.degrees(np.arccos(sole.transforms[flat, 0, 2, 2]))
        assert np.median(tilt) < 6.0, sole.sole.name
        heights = sole.landmark_positions()[flat][..., 2]
        assert np.median(np.ptp(heights, axis=1)) < 0.025


def test_samples_follow_object_motion_and_parents(scene):
    armature = moving_human()
    cart = bpy.data.objects.new("Cart", None)
    scene.collection.objects.link(cart)
    rigs.key(cart, "location", {1: (0, 0, 0), 20: (4, 2, 1)})
    rigs.key(armature, "rotation_euler", {1: (0, 0, 0), 20: (0, 0, 1.5)})
    armature.parent = cart
    assert_samples_equal_the_users_scene(scene, armature)


def test_samples_follow_constraints_to_objects_outside_drivers_and_nla(scene):
    armature = moving_human()
    target = bpy.data.objects.new("Target", None)
    scene.collection.objects.link(target)
    rigs.key(target, "location", {1: (0.1, 0, 0.1), 20: (0.1, -0.6, 0.4)})
    ik = armature.pose.bones["shin.L"].constraints.new("IK")
    ik.target, ik.chain_count = target, 2
    driver = armature.pose.bones["foot.R"].driver_add("rotation_quaternion", 1).driver
    driver.expression = "sin(frame / 5) + v"
    variable = driver.variables.new()
    variable.name, variable.type = "v", "TRANSFORMS"
    variable.targets[0].id, variable.targets[0].transform_type = target, "LOC_Z"
    animation = armature.animation_data
    strip = animation.nla_tracks.new().strips.new("Strip", 3, animation.action)
    strip.scale = 0.7
    animation.action = None
    assert_samples_equal_the_users_scene(scene, armature)


def assert_samples_equal_the_users_scene(scene, armature, frames=(1, 2, 7, 13, 20)):
    """Compare with stepping the user's own scene."""
    mapping = map_rig(armature)
    motion = sample(scene, armature, mapping)
    moved = 0.0
    for frame in frames:
        scene.frame_set(frame)
        for joint, (bone, end) in mapping.joints.items():
            truth = armature.matrix_world @ getattr(armature.pose.bones[bone], end)
            np.testing.assert_allclose(motion.joints[joint][frame - 1], truth, atol=1e-5, err_msg=joint)
    for path in motion.joints.values():
        moved = max(moved, float(np.ptp(path, axis=0).max()))
    assert moved > 0.2


@pytest.mark.slow
def test_samples_of_a_rigify_human_follow_its_ik_controls(rigify_file):
    armature = rigs.open_rigify(rigify_file, "Generated")
    rigs.key(armature, "location", {1: (0, 0, 0), 20: (0.1, 0.3, 0.5)}, bone="foot_ik.L")
    rigs.key(armature, "location", {1: (0, 0, 0), 20: (0.05, -0.1, -0.1)}, bone="torso")
    assert_samples_equal_the_users_scene(bpy.context.scene, armature)


@pytest.mark.parametrize("reading", ["keys", "evaluated"])
@pytest.mark.parametrize("action", ["finish", "close", "fail"])
def test_sampling_leaves_the_file_as_it_was(scene, action, reading):
    armature = moving_human()
    if reading == "evaluated":
        let_blender_evaluate(armature)
    mesh = bpy.data.meshes.new("Body")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    body = bpy.data.objects.new("Body", mesh)
    scene.collection.objects.link(body)
    body.parent = armature
    scene.frame_set(7)
    armature.pose.bones["hips"].location = (1, 2, 3)  # not keyed: the next frame change would lose it
    scene.view_layers[0].update()
    handler_calls = []

    def on_frame(*_arguments):
        handler_calls.append(1)

    bpy.app.handlers.frame_change_post.append(on_frame)
    try:
        before = state(scene, armature)
        sampling = sample_character(Take.about(armature, scene, range(1, 31)), armature, map_rig(armature), mass=70.0)
        next(sampling)
        if action == "finish":
            for _ in sampling:
                pass
        elif action == "close":
            sampling.close()
        else:
            with pytest.raises(ZeroDivisionError):
                sampling.throw(ZeroDivisionError)
        assert state(scene, armature) == before
        assert bpy.app.handlers.frame_change_post[-1] is on_frame
        assert not handler_calls
    finally:
        bpy.app.handlers.frame_change_post.remove(on_frame)


def by_argument(armature):
    return lambda scene, *_: pose_at(armature, scene.frame_current)


def by_context(armature):
    return lambda _scene: pose_at(armature, bpy.context.scene.frame_current)


def pose_at(armature, frame):
    armature.location.x = 0.05 * frame
    armature.pose.bones["thigh.R"].rotation_mode = "XYZ"
    armature.pose.bones["thigh.R"].rotation_euler.x = 0.02 * frame


@pytest.mark.parametrize("called", ["frame_change_pre", "frame_change_post"])
@pytest.mark.parametrize("handler_of", [by_argument, by_context])
def test_a_rig_that_a_frame_handler_moves_is_read_as_it_is_seen_and_left_as_it_was(scene, handler_of, called):
    armature = moving_human()
    handlers, handler = getattr(bpy.app.handlers, called), handler_of(armature)
    handlers.append(handler)
    try:
        scene.frame_set(7)
        armature.pose.bones["spine"].location = (1, 2, 3)  # not keyed: the next frame change would lose it
        scene.view_layers[0].update()
        before = state(scene, armature)
        sample(scene, armature)
        assert state(scene, armature) == before
        assert_samples_equal_the_users_scene(scene, armature)
    finally:
        handlers.remove(handler)


def state(scene, armature):
    return (
        fingerprints.of_file(),
        [tuple(value) for bone in armature.pose.bones for row in bone.matrix for value in [row]],
        {
            kind: [(block.name, block.users) for block in getattr(bpy.data, kind)]
            for kind in ("objects", "actions", "scenes", "armatures", "collections", "meshes")
        },
        bpy.context.scene.name,
        bpy.context.view_layer.objects.active.name,
        [thing.name for thing in bpy.context.selected_objects],
        armature.mode,
        [
            list(getattr(bpy.app.handlers, name))
            for name in ("frame_change_pre", "frame_change_post", "depsgraph_update_post")
        ],
    )


def test_evaluating_takes_one_step_per_frame(scene):
    armature = moving_human()
    let_blender_evaluate(armature)
    sampling = sample_character(Take.about(armature, scene, range(1, 10)), armature, map_rig(armature), mass=70.0)
    steps = list(sampling)
    assert steps[:9] == list(range(1, 10))
    assert set(steps[9:]) <= {9}  # the soles are read in steps of their own


def test_reading_keys_takes_one_step_for_each_bone(scene):
    armature = moving_human()
    sampling = sample_character(Take.about(armature, scene, range(1, 101)), armature, map_rig(armature), mass=70.0)
    steps = list(sampling)
    assert steps == sorted(steps)
    assert len(set(steps)) > 10
    assert steps[-1] == 100


def with_nothing_more(_armature):
    pass


def with_object_motion(armature):
    rigs.key(armature, "rotation_euler", {1: (0, 0, 0), 20: (0, 0, 1.5)})
    armature.location = (5, 1, 0)


def with_remapped_time(_armature):
    bpy.context.scene.render.frame_map_old, bpy.context.scene.render.frame_map_new = 100, 170


@pytest.mark.parametrize("change", [with_nothing_more, with_object_motion, with_remapped_time])
def test_keys_read_are_poses_evaluated(scene, change):
    armature = moving_human()
    change(armature)
    read = sample(scene, armature)
    let_blender_evaluate(armature)
    evaluated = sample(scene, armature)
    for joint, path in evaluated.joints.items():
        np.testing.assert_allclose(read.joints[joint], path, atol=2e-6)
    for a, b in zip(read.soles, evaluated.soles, strict=True):
        np.testing.assert_allclose(a.transforms, b.transforms, atol=2e-6)


def test_lengths_are_metres_in_any_unit_and_at_any_object_scale(scene):
    armature = moving_human()
    reference = sample(scene, armature)
    scene.unit_settings.scale_length = 0.01
    armature.scale = (100.0,) * 3
    centimetres = sample(scene, armature)
    scene.unit_settings.scale_length = 1.0
    for other in (centimetres,):
        assert other.leg_length == pytest.approx(reference.leg_length, rel=1e-5)
        for joint, path in reference.joints.items():
            np.testing.assert_allclose(other.joints[joint], path, atol=1e-5)
        for a, b in zip(reference.soles, other.soles, strict=True):
            np.testing.assert_allclose(b.transforms, a.transforms, atol=1e-5)
            np.testing.assert_allclose(b.sole.outline, a.sole.outline, atol=1e-6)


def test_a_centimetre_rig_at_scale_001_equals_the_metre_rig(scene):
    reference = sample(scene, moving_human())
    scaled = rigs.human(BLENDER, name="Scaled")
    bpy.ops.object.select_all(action="DESELECT")
    scaled.select_set(True)
    bpy.context.view_layer.objects.active = scaled
    scaled.scale = (100.0,) * 3
    bpy.ops.object.transform_apply(scale=True)
    scaled.scale = (0.01,) * 3
    rigs.key(scaled, "location", {1: (0, 0, 0), 20: (30, 10, 50)}, bone="hips")
    rigs.key(scaled, "rotation_euler", {1: (0, 0, 0), 20: (0.6, 0.1, 0.2)}, bone="thigh.L")
    rigs.key(scaled, "rotation_euler", {1: (0.1, 0, 0), 20: (-0.4, 0.2, 0)}, bone="foot.L")
    motion = sample(scene, scaled)
    for a, b in zip(reference.soles, motion.soles, strict=True):
        np.testing.assert_allclose(b.transforms, a.transforms, atol=1e-5)
        assert b.sole.area == pytest.approx(a.sole.area, rel=1e-4)


def test_frame_rate_and_step_give_times_in_seconds(scene):
    armature = moving_human()
    scene.render.fps, scene.render.fps_base = 30, 1.001
    motion = sample(scene, armature, step=3)
    np.testing.assert_array_equal(motion.frames, np.arange(1, 21, 3))
    assert motion.frame_rate == pytest.approx(29.97, rel=1e-4)
    assert motion.time_step == pytest.approx(3 * 1.001 / 30)
    every = sample(scene, armature)
    np.testing.assert_allclose(motion.joints["knee_l"], every.joints["knee_l"][::3])


def test_a_hidden_rig_still_moves(scene):
    armature = moving_human()
    visible = sample(scene, armature)
    armature.hide_viewport = armature.hide_render = True
    hidden = sample(scene, armature)
    np.testing.assert_allclose(hidden.joints["knee_l"], visible.joints["knee_l"], atol=1e-6)


def test_linked_and_overridden_rigs_are_read(scene, tmp_path):
    reference = sample(scene, moving_human())
    path = tmp_path / "human.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(path), link=True) as (_, wanted):
        wanted.objects = ["Human"]
    scene = bpy.context.scene
    linked = bpy.data.objects["Human"]
    scene.collection.objects.link(linked)
    motion = sample(scene, linked)
    np.testing.assert_allclose(motion.joints["knee_l"], reference.joints["knee_l"], atol=1e-6)
    override = linked.override_create(remap_local_usages=True)
    motion = sample(scene, override)
    np.testing.assert_allclose(motion.joints["knee_l"], reference.joints["knee_l"], atol=1e-6)


def test_an_animated_object_prints_with_its_own_mesh(scene):
    armature = moving_human()
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    cube = bpy.context.active_object
    cube.scale = (0.4, 0.2, 0.1)
    rigs.key(cube, "location", {1: (1, 0, 0.05), 20: (2, 0, 1)})
    mapping = RigMapping(joints={}, soles=(SoleSource("box", object="Cube"),))
    motion = sample(scene, armature, mapping)
    (box,) = motion.soles
    assert box.sole.area == pytest.approx(0.08, rel=0.02)
    lowest = box.landmark_positions()[..., 2].min(axis=1)
    np.testing.assert_allclose(lowest[[0, -1]], [0.0, 0.95], atol=1e-5)


def flattened(armature):
    armature.scale = (1, 1, 2)


def vanished(armature):
    armature.scale = (0, 0, 0)


def sheared(armature):
    bpy.context.scene.collection.objects.link(parent := bpy.data.objects.new("Parent", None))
    parent.scale = (1, 3, 1)
    armature.parent = parent
    armature.rotation_euler = (0, 0, 0.7)


def in_edit_mode(armature):
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")


def at_rest(armature):
    armature.data.pose_position = "REST"


def with_broken_keys(armature):
    armature.animation_data_clear()
    rigs.key(armature, "location", {1: (0, 0, 0), 20: (float("inf"), 0, 0)}, bone="hips")


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (flattened, r"'Human' is stretched or sheared .*apply it"),
        (sheared, r"'Human' is stretched or sheared"),
        (vanished, r"'Human' has a scale of zero"),
        (in_edit_mode, r"'Human' is in Edit Mode"),
        (at_rest, r"'Human' shows its rest position"),
        (with_broken_keys, r"'Human' has no finite pose at frame \d+"),
        (lambda armature: armature.animation_data_clear(), r"'Human' has no animation"),
        (lambda armature: armature.data.bones.__getitem__("foot.L").__setattr__("name", "fin"), r"no bone 'foot.L'"),
    ],
)
def test_what_cannot_be_used_is_refused_with_object_and_remedy(scene, spoil, message):
    armature = moving_human()
    mapping = map_rig(armature)
    spoil(armature)
    names = [scene.name for scene in bpy.data.scenes]
    with pytest.raises(InputError, match=message):
        sample(scene, armature, mapping)
    assert [scene.name for scene in bpy.data.scenes] == names


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mass": 0.0}, "positive mass"),
        ({"mass": float("nan")}, "positive mass"),
        ({"frames": range(1, 1)}, "frame range 1 to 0"),
        ({"frames": range(9, 1, -1)}, "start before the end"),
        ({"mapping": RigMapping()}, "nothing else to print with"),
        ({"mapping": RigMapping(soles=(SoleSource("foot"),))}, "neither a bone nor an object"),
        ({"mapping": RigMapping(soles=(SoleSource("foot", object="Gone"),))}, "'Gone' was deleted"),
    ],
)
def test_settings_that_cannot_be_used_are_refused(scene, change, message):
    armature = moving_human()
    settings = {"mapping": map_rig(armature), "mass": 70.0, "frames": range(1, 6), **change}
    take = Take.about(armature, scene, settings["frames"])
    with pytest.raises(InputError, match=message):
        run(sample_character(take, armature, settings["mapping"], mass=settings["mass"]))


def test_left_and_right_are_not_swapped_whatever_way_the_rig_faces(scene):
    for turn, mirror in itertools.product((0.0, 2.0), (1.0, -1.0)):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        armature = moving_human(turn=turn)
        armature.scale = (mirror, 1.0, 1.0)
        motion = sample(scene, armature)
        for sole in motion.soles:
            pose = sole.transforms[0, 0]
            assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)
            other = next(o for o in motion.soles if o is not sole).transforms[0, 0, :3, 3]
            to_other = pose[:3, :3].T @ (other - pose[:3, 3])
            # the big toe is on the side of the other foot
            tip = sole.sole.outline[sole.sole.outline[:, 0].argmax()]
            assert np.sign(tip[1]) == np.sign(to_other[1])
            # and the toes are ahead of the ankle
            ahead = motion.joints[f"toe_{sole.sole.side.lower()}"] - motion.joints[f"ankle_{sole.sole.side.lower()}"]
            assert ahead[0] @ pose[:3, 0] > 0.15
