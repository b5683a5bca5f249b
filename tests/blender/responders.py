"""Characters that respond, and what their rigs really do: read from the user's scene, frame by frame."""

from __future__ import annotations

import bpy
import numpy as np

from sample_scenes.body import BONES
from softground_addon.blender import jobs
from softground_addon.blender.baking import bake_job
from softground_addon.blender.compat import action_curves
from softground_addon.blender.jobs import run
from softground_addon.blender.sampling.rig_sampling import sample_character
from softground_addon.blender.sampling.take import Take
from softground_addon.blender.settings import character_of
from softground_addon.core.legs.foot_placement import lowest_clearance, posed_points
from softground_addon.core.legs.grounding import leg_soles
from softground_addon.core.legs.legs import Leg
from softground_addon.core.motion.sole_motion import SoleMotion
from softground_addon.core.record.ground_history import GroundHistory
from softground_addon.core.response.leaving import leaving_early
from softground_addon.core.rig.mapping import RigMapping
from tests.blender import rigs, shots

_MIXAMO = {
    "hips": "Hips",
    "spine": "Spine",
    "chest": "Spine1",
    "neck": "Neck",
    "head": "Head",
    "shoulder": "Shoulder",
    "upper_arm": "Arm",
    "forearm": "ForeArm",
    "hand": "Hand",
    "thigh": "UpLeg",
    "shin": "Leg",
    "foot": "Foot",
    "toe": "ToeBase",
}


def mapping_of(character):
    """The joints and soles of a character as the user left them."""
    mapped = character_of(character)
    return RigMapping(mapped.joints, mapped.soles, "settings")


def bake(scene, *, tilt=True, grounding=True, **values):
    """Bake with a response."""
    scene.softground.tilt.use, scene.softground.grounding.use = tilt, grounding
    for name, value in values.items():
        setattr(scene.softground, name, value)
    return jobs.run(bake_job.bake(scene))


def as_mixamo(armature):
    """The project's walker under Mixamo's names."""
    for bone in BONES:
        word, _, side = bone.partition(".")
        name = _MIXAMO.get(word)
        if name:
            armature.data.bones[bone].name = f"mixamorig:{ {'L': 'Left', 'R': 'Right'}.get(side, '') }{name}"
    return armature


def in_centimetres(armature):
    """The same character in another unit: bones and keys a hundred times as large, under a scale of 0.01."""
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    ends = {bone.name: (bone.head * 100, bone.tail * 100) for bone in armature.data.edit_bones}
    for bone in armature.data.edit_bones:  # connected bones share their ends
        bone.head, bone.tail = ends[bone.name]
    bpy.ops.object.mode_set(mode="OBJECT")
    for curve in action_curves(armature.animation_data.action):
        if curve.data_path.endswith("location"):
            scale_keys(curve, 100.0)
    for child in armature.children:
        child.data.transform(child.matrix_local.Scale(100.0, 4))
    armature.scale = (0.01, 0.01, 0.01)
    bpy.context.view_layer.update()
    return armature


def scale_keys(curve, factor, add=0.0):
    """Keys times a factor, plus what is added per frame."""
    keys = np.empty(len(curve.keyframe_points) * 2, dtype=np.float32)
    curve.keyframe_points.foreach_get("co", keys)
    keys[1::2] = keys[1::2] * factor + add * keys[::2]
    curve.keyframe_points.foreach_set("co", keys)
    curve.update()


def moved_by_its_object(armature):
    """The same walk, its progress keyed on the armature object instead of the hips."""
    curves = {
        c.array_index: c for c in action_curves(armature.animation_data.action) if c.data_path.endswith("location")
    }
    rest = np.array(armature.data.bones["hips"].matrix_local)[:3, :3]
    speed = -0.05  # along world Y, per frame
    for index, curve in curves.items():
        scale_keys(curve, 1.0, add=-float(rest[1, index]) * speed)
    for frame in (1, 72):
        armature.location = (0.0, speed * frame, 0.0)
        armature.keyframe_insert("location", frame=frame)
    for curve in action_curves(armature.animation_data.action):
        if curve.data_path == "location":
            for key in curve.keyframe_points:
                key.interpolation = "LINEAR"
    return armature


def with_feet_on_a_root(armature, frames=72):
    """The same walk as game rigs have it whose IK was baked: feet hang on a root bone, and are keyed to their legs."""
    feet, scene = ("foot.L", "foot.R"), bpy.context.scene
    poses = np.linalg.inv(armature.matrix_world) @ world_matrices(scene, armature, feet, range(1, frames + 1))
    bpy.ops.object.mode_set(mode="EDIT")
    edit = armature.data.edit_bones
    root = edit.new("root")
    root.tail = (0.0, 0.2, 0.0)
    for bone in ("hips", *feet):
        edit[bone].use_connect = False
        edit[bone].parent = root
    bpy.ops.object.mode_set(mode="OBJECT")
    for frame, matrices in enumerate(poses, start=1):
        for foot, matrix in zip(feet, matrices, strict=True):
            bone = armature.pose.bones[foot]
            bone.matrix_basis = bone.bone.matrix_local.inverted() @ bone.matrix_basis.__class__(matrix)
            for path in ("location", "rotation_quaternion"):
                bone.keyframe_insert(path, frame=frame)
    return armature


def linked_walker(folder):
    """The walking figure and its mesh, linked from a file into a new scene, and active."""
    shots.walker(bpy.context.scene)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "asset.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(folder / "asset.blend"), link=True) as (_, wanted):
        wanted.objects = ["Walker", "Walker Figure"]
    scene = bpy.context.scene
    for obj in wanted.objects:
        scene.collection.objects.link(obj)
    scene.render.fps = 24
    bpy.context.view_layer.objects.active = bpy.data.objects["Walker"]
    return bpy.data.objects["Walker"]


def key_steps(armature, body, feet, frames=72, stride=0.5, period=24, lift=0.10):
    """A plain walk along -Y on the controls of a rig, one key per frame: feet that lift, swing and stand."""
    half = period // 2
    for side, foot in enumerate(feet):
        for frame in range(1, frames + 1):
            cycle, phase = divmod(frame - 1 + half * side, period)
            swing = np.clip((phase - half) / half, 0.0, 1.0)
            along = stride * (cycle + swing - 0.5 * side)
            up = lift * np.sin(np.pi * swing)
            _key_offset(armature, foot, (0.0, -along, up), frame)
    for frame in range(1, frames + 1):
        _key_offset(armature, body, (0.0, -stride * (frame - 1) / period, -0.04), frame)


def _key_offset(armature, bone, offset, frame):
    rest = np.array(armature.data.bones[bone].matrix_local)[:3, :3]
    armature.pose.bones[bone].location = rest.T @ offset
    armature.pose.bones[bone].keyframe_insert("location", frame=frame)


def with_ik(family=rigs.FAMILIES["rigify metarig"]):
    """The standing figure with IK legs: a control at each foot that turns it too, and a pole before each knee."""
    armature = rigs.human(family, name="Puppet")
    bpy.ops.object.mode_set(mode="EDIT")
    edit = armature.data.edit_bones
    for side in (0, 1):
        foot, shin = edit[family.name("foot", side)], edit[family.name("shin", side)]
        control, pole = edit.new(f"ctrl_foot.{'LR'[side]}"), edit.new(f"pole_knee.{'LR'[side]}")
        control.head, control.tail, control.roll = foot.head, foot.tail, foot.roll
        pole.head = shin.head + shin.head.__class__((0.0, -0.5, 0.0))
        pole.tail = pole.head + shin.head.__class__((0.0, -0.1, 0.0))
        control.use_deform = pole.use_deform = False
    bpy.ops.object.mode_set(mode="OBJECT")
    for side in (0, 1):
        letter = "LR"[side]
        ik = armature.pose.bones[family.name("shin", side)].constraints.new("IK")
        ik.target, ik.subtarget, ik.chain_count = armature, f"ctrl_foot.{letter}", 2
        ik.pole_target, ik.pole_subtarget, ik.pole_angle = armature, f"pole_knee.{letter}", -np.pi / 2
        ik.iterations = 500
        turn = armature.pose.bones[family.name("foot", side)].constraints.new("COPY_ROTATION")
        turn.target, turn.subtarget = armature, f"ctrl_foot.{letter}"
    key_steps(armature, family.name("hips"), ["ctrl_foot.L", "ctrl_foot.R"])
    return armature


def world_matrices(scene, armature, bones, frames):
    """What the user's scene shows: (F, B, 4, 4) [m]."""
    result = np.empty((len(frames), len(bones), 4, 4))
    for k, frame in enumerate(frames):
        scene.frame_set(int(frame))
        evaluated = armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
        for b, bone in enumerate(bones):
            result[k, b] = np.array(evaluated.matrix_world @ evaluated.pose.bones[bone].matrix)
    return result


def source_motion(scene, character=None):
    """The character without its layer."""
    character = character or scene.softground.characters[0]
    options = scene.softground
    take = Take.about(character.armature, scene, range(options.frame_start, options.frame_end + 1))
    return run(sample_character(take, character.armature, mapping_of(character), mass=character.mass))


def gaps_on_the_rig(scene, result, terrain, character=None):
    """Distance of the standing soles from the pressed ground [m], as the rig in the user's scene stands now."""
    character = character or scene.softground.characters[0]
    armature, mapping = character.armature, mapping_of(character)
    motion = source_motion(scene, character)
    frames = motion.frames.astype(int)
    bones = [source.bone for source in mapping.soles]
    now = world_matrices(scene, armature, bones, frames)
    strength = character.response_strength
    character.response_strength = 0.0
    before = world_matrices(scene, armature, bones, frames)
    character.response_strength = strength
    history = GroundHistory(terrain, result.footprints)
    touching = np.zeros((len(frames), len(motion.soles)), bool)
    for index, sole in enumerate(motion.soles):
        for step in result.report["steps"]:
            if step["contact"] == sole.sole.name and step["character"] == armature.name:
                during = (frames >= step["frame_start"]) & (frames <= step["frame_end"] - 0.5)  # then it is leaving
                touching[:, index] |= during
    measured = []
    for index, stands in enumerate(leaving_early(motion, touching, result.footprints).T):
        sole, carry = motion.soles[index], now[:, index] @ np.linalg.inv(before[:, index])
        carried = SoleMotion(sole.sole, carry[:, None] @ sole.transforms)
        measured.append(lowest_clearance(posed_points(carried)[stands], history, motion.frames[stands]))
    return np.concatenate(measured)


def legs(scene, character=None):
    """Both legs over time as the user's scene shows them [m]: a list of `Leg`."""
    character = character or scene.softground.characters[0]
    joints = dict(mapping_of(character).joints)
    frames = range(scene.softground.frame_start, scene.softground.frame_end + 1)
    motion = source_motion(scene, character)
    measured = []
    for side, sole in leg_soles(motion).items():
        bones = [joints[f"{joint}_{side}"][0] for joint in ("hip", "knee", "ankle")]
        hip, knee, ankle = np.moveaxis(world_matrices(scene, character.armature, bones, frames)[..., :3, 3], 1, 0)
        measured.append(Leg(hip, knee, ankle, motion.soles[sole].transforms[:, 0, :3, 0]))
    return measured


def knee_turn(legs, rate):
    """The most that any knee turns within a frame at 30 fps [degrees]."""
    window = max(1, round(rate / 30))
    scale = rate / window / 30
    angles = np.degrees([leg.flexion for leg in legs])
    return scale * np.abs(angles[:, window:] - angles[:, :-window]).max()


def knee_direction(leg):
    """Where the knee lies off the line from hip to ankle, (F, 3) [m]."""
    axis = (leg.ankle - leg.hip) / np.linalg.norm(leg.ankle - leg.hip, axis=1, keepdims=True)
    offset = leg.knee - leg.hip
    return offset - np.sum(offset * axis, axis=1, keepdims=True) * axis


def knee_angles(scene, character=None):
    """Flexion of each knee over time [degrees], (F, sides), in the user's scene."""
    return np.degrees(np.stack([leg.flexion for leg in legs(scene, character)], axis=1))
