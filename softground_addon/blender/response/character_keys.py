"""A response as keys: a layer above the user's animation, never in it."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.motion.motion import CharacterMotion
from ...core.numerics.key_reduction import kept_samples
from ...core.numerics.orientation import euler_angles, quaternions, rotation_matrices
from ...core.numerics.rigid import carried, rotation, unit
from ...core.response.grounding import Response
from ...core.rig.mapping import RigMapping
from ...core.settings import ObjectName
from ..animation_layer.layer_curves import LayerCurve
from ..characters.control_poses import BonePoses, RigPoses
from ..settings import found
from .rig_controls import BODY, Control, find_controls

Array = NDArray[np.float64]

ANGLE_TOLERANCE = np.radians(0.04)
"""A key is left out where its neighbours give the angle to this [rad]: a leg has four joints whose errors add."""
LENGTH_TOLERANCE = 2e-4
"""The same for places [m]."""


@dataclass(frozen=True)
class ReadRig:
    """A rig as it was read: the bones that a response is keyed on, and how they stand by the user's animation alone."""

    controls: list[Control]
    poses: RigPoses


def response_curves(
    armature: ObjectName,
    rig: ReadRig,
    motion: CharacterMotion,
    response: Response,
    *,
    metre: float,
    stretch: float,
    accuracy: float = 1.0,
) -> Generator[int, None, list[LayerCurve]]:
    """The keys that make a rig respond.

    Parameters
    ----------
    armature : ObjectName
    rig : ReadRig
    motion : CharacterMotion
        The source that the response belongs to.
    response : Response
    metre : float
        Blender unit [m].
    stretch : float
        Frames of the animation per frame of the scene.
    accuracy : float
        Part of `ANGLE_TOLERANCE` and `LENGTH_TOLERANCE` that keys may be off by.

    Yields
    ------
    int
        Number of bones done.
    """
    moved = _parts_in_armature(response, motion, rig.poses, metre)
    curves: list[LayerCurve] = []
    for done, control in enumerate(rig.controls):
        if control.part in moved and (not control.carried_by or control.carried_by in moved):
            curves += _bone_curves(found(armature), control, rig.poses, moved, motion.frames * stretch, metre, accuracy)
        yield done + 1
    return curves


def controls_of(scene: bpy.types.Scene, armature: bpy.types.Object, mapping: RigMapping) -> list[Control]:
    """The bones of a rig that a response is keyed on.

    Raises
    ------
    InputError
        If it has no bone that carries the body.
    """
    depsgraph = scene.view_layers[0].depsgraph
    assert depsgraph is not None
    return find_controls(armature, armature.evaluated_get(depsgraph), mapping)


def _parts_in_armature(response: Response, motion: CharacterMotion, poses: RigPoses, metre: float) -> dict[str, Array]:
    """Displacement of each part in the armature's frame [Blender units], (F, 4, 4)."""
    parts = {BODY: response.body}
    for side, leg in response.legs.items():
        knee = motion.joints[f"knee_{side}"]
        parts |= {
            f"thigh_{side}": leg.thigh,
            f"shank_{side}": leg.shank,
            f"foot_{side}": leg.foot,
            f"knee_{side}": _translation_at(leg.thigh, knee),
        }
    parts |= {f"arm_{side}": response.body @ arm for side, arm in response.arms.items()}
    to_world = poses.world
    from_world = np.linalg.inv(to_world)
    result = {}
    for part, displacement in parts.items():
        units = displacement.copy()
        units[:, :3, 3] /= metre
        result[part] = from_world @ units @ to_world
    return result


def _bone_curves(
    armature: bpy.types.Object,
    control: Control,
    poses: RigPoses,
    moved: dict[str, Array],
    frames: Array,
    metre: float,
    accuracy: float,
) -> list[LayerCurve]:
    bone, pose = armature.pose.bones[control.bone], poses.bones[control.bone]
    basis = _basis(bone.rotation_mode, pose)
    root_control = moved.get(control.carried_by)
    if root_control is None:
        root_control = np.broadcast_to(np.eye(4), pose.matrix.shape)
    elif not bone.bone.use_inherit_rotation:
        root_control = _translation_at(root_control, pose.matrix[:, :3, 3])
    # The parent's frame T satisfies matrix = T·basis and moves with the root control, whatever the bone inherits.
    new = basis @ np.linalg.inv(pose.matrix) @ np.linalg.inv(root_control) @ moved[control.part] @ pose.matrix
    size = float(np.linalg.norm(poses.world[0, :3, 0])) * metre
    path = f'pose.bones["{bpy.utils.escape_identifier(control.bone)}"].'
    curves = []
    if control.moves:
        offset = new[:, :3, 3] - pose.location
        curves += _curves(
            path + "location", control.bone, frames, offset, accuracy * LENGTH_TOLERANCE / max(size, 1e-12)
        )
    name, values, tolerance = _rotation_layer(bone.rotation_mode, pose, _pure_rotation(new))
    return curves + _curves(path + name, control.bone, frames, values, accuracy * tolerance)


def _curves(path: str, bone: str, frames: Array, values: Array, tolerance: float) -> list[LayerCurve]:
    kept = kept_samples(values, tolerance)
    return [LayerCurve(path, index, bone, frames[kept], values[kept, index]) for index in range(values.shape[1])]


def _basis(mode: str, pose: BonePoses) -> Array:
    """What a bone's channels make of it, (F, 4, 4)."""
    basis = np.zeros_like(pose.matrix)
    basis[:, :3, :3] = _channel_rotation(mode, pose) * pose.scale[:, None, :]
    basis[:, :3, 3] = pose.location
    basis[:, 3, 3] = 1.0
    return basis


def _channel_rotation(mode: str, pose: BonePoses) -> Array:
    if mode == "QUATERNION":
        return rotation_matrices(pose.rotation_quaternion)
    if mode == "AXIS_ANGLE":
        axis = unit(pose.rotation_axis_angle[:, 1:])
        axis[~axis.any(axis=1)] = (0.0, 1.0, 0.0)
        return rotation(pose.rotation_axis_angle[:, :1] * axis)
    turns = {axis: rotation(pose.rotation_euler * about) for axis, about in zip("XYZ", np.eye(3), strict=True)}
    return turns[mode[2]] @ turns[mode[1]] @ turns[mode[0]]


def _rotation_layer(mode: str, pose: BonePoses, new: Array) -> tuple[str, Array, float]:
    """Channel, values to combine with the source's, and the tolerance of its keys."""
    if mode == "QUATERNION":
        source = rotation_matrices(pose.rotation_quaternion)
        return "rotation_quaternion", quaternions(np.swapaxes(source, -1, -2) @ new), ANGLE_TOLERANCE / 2
    if mode == "AXIS_ANGLE":
        target = quaternions(new)
        angle = 2 * np.arccos(np.clip(target[:, :1], -1, 1))
        sine = np.sin(angle / 2)
        axis = np.where(sine > 1e-9, target[:, 1:] / np.maximum(sine, 1e-9), (0.0, 1.0, 0.0))
        flip = np.where(np.sum(axis * pose.rotation_axis_angle[:, 1:], axis=1, keepdims=True) < 0, -1.0, 1.0)
        values = np.concatenate([angle * flip, axis * flip], axis=1)
        values[:, 0] += 2 * np.pi * np.rint((pose.rotation_axis_angle[:, 0] - values[:, 0]) / (2 * np.pi))
        return "rotation_axis_angle", values - pose.rotation_axis_angle, ANGLE_TOLERANCE / 2
    angles = euler_angles(new, mode, pose.rotation_euler)
    return "rotation_euler", angles - pose.rotation_euler, ANGLE_TOLERANCE


def _pure_rotation(matrices: Array) -> Array:
    axes = matrices[:, :3, :3]
    return np.asarray(axes / np.linalg.norm(axes, axis=1, keepdims=True))


def _translation_at(displacement: Array, points: Array) -> Array:
    """How far displacements (F, 4, 4) carry points (F, 3), as displacements that do not turn."""
    result = np.broadcast_to(np.eye(4), displacement.shape).copy()
    result[:, :3, 3] = carried(displacement, points) - points
    return result
