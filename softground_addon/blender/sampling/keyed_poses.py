"""Poses of a rig that nothing but its keys moves, from its F-curves by forward kinematics.

To evaluate such a rig takes several times as long, and a copy of all its keys.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.numerics.arrays import Array
from ...core.numerics.orientation import euler_rotations, rotation_matrices
from ...core.numerics.rigid import rotation, unit
from ..animation_layer.constraint_layer import is_own
from ..animation_layer.layer_curves import path_of_bone
from ..compat import HAS_SLOTS, action_curves, slot_of
from ..rigs.object_data import armature_of, pose_bones

_NO_SIMPLE_CHANNEL = re.compile(r'(.*\.)?rotation_mode|delta_.*|pose\.bones\[[^"].*')
"""Animated paths that mean more than the value of a channel, or name a bone in a way of their own."""


def is_moved_by_keys_alone(armature: bpy.types.Object, bones: Iterable[str]) -> bool:
    """True if its keys tell all that moves these bones.

    Parents, constraints, drivers, strips and animated properties of the armature's data are left to Blender, and so are
    bones that take over a part of their parent's motion only.
    """
    animation = armature.animation_data
    if animation is None or armature.parent or armature_of(armature).animation_data:
        return False
    if animation.drivers or not _plays_its_action_only(animation) or _has_deltas(armature):
        return False
    constraints = (constraint for owner in (armature, *pose_bones(armature)) for constraint in owner.constraints)
    if any(not (constraint.mute and is_own(constraint)) for constraint in constraints):
        return False
    if not all(_follows_its_parent(armature_of(armature).bones[name]) for name in with_parents(armature, bones)):
        return False
    curves = _curves(animation)
    if any(curve.group and curve.group.mute for curve in curves):  # which some Blenders heed
        return False
    return not any(_NO_SIMPLE_CHANNEL.fullmatch(curve.data_path) for curve in curves)


def with_parents(armature: bpy.types.Object, bones: Iterable[str]) -> list[str]:
    """Names of bones and of all above them, parents first."""
    names_in_order: dict[str, None] = {}
    for name in bones:
        bone = armature_of(armature).bones[name]
        names_in_order.update(dict.fromkeys([each.name for each in (*reversed(bone.parent_recursive), bone)]))
    return list(names_in_order)


def keyed_pose(armature: bpy.types.Object, name: str, times: Array, parent: NDArray[Any]) -> Array:
    """Transforms of a bone over time.

    Parameters
    ----------
    armature : bpy.types.Object
        One that `is_moved_by_keys_alone`.
    name : str
        Of the bone.
    times : (F,) float array
        Frames of the animation.
    parent : (F, 4, 4) float array
        The same for the bone's parent; not looked at where it has none.

    Returns
    -------
    (F, 4, 4) float array
        Matrices of the bone in the armature's space [Blender units].
    """
    bone = armature_of(armature).bones[name]
    local = _transforms(pose_bones(armature)[name], path_of_bone(name, ""), times)
    if bone.use_connect:
        local[:, :3, 3] = 0.0
    if bone.parent is None:
        return np.asarray(np.array(bone.matrix_local) @ local)
    return np.asarray(parent @ _from_parent(bone, bone.parent) @ local)


def keyed_world(armature: bpy.types.Object, times: Array) -> Array:
    """World matrices of such an armature over time, (F, 4, 4) [Blender units]."""
    return _transforms(armature, "", times)


def _plays_its_action_only(animation: bpy.types.AnimData) -> bool:
    """True if no strip of the NLA has a say in what the action does."""
    whole = animation.action_blend_type, animation.action_influence, animation.action_extrapolation
    return (
        all(track.mute and not track.is_solo for track in animation.nla_tracks)
        and not animation.use_tweak_mode
        and whole == ("REPLACE", 1.0, "HOLD")
    )


_NO_DELTA = {
    "delta_location": (0, 0, 0),
    "delta_rotation_euler": (0, 0, 0),
    "delta_rotation_quaternion": (1, 0, 0, 0),
    "delta_scale": (1, 1, 1),
}


def _has_deltas(obj: bpy.types.Object) -> bool:
    return any(tuple(getattr(obj, name)) != none for name, none in _NO_DELTA.items())


def _follows_its_parent(bone: bpy.types.Bone) -> bool:
    return bool(bone.use_inherit_rotation and bone.inherit_scale == "FULL" and bone.use_local_location)


def _curves(animation: bpy.types.AnimData) -> list[bpy.types.FCurve]:
    """The curves of the action that are in effect."""
    if animation.action is None or (HAS_SLOTS and slot_of(animation) is None):
        return []
    return [
        curve
        for curve in action_curves(animation.action, slot_of(animation))
        if curve.is_valid and not (curve.mute or curve.is_empty)
    ]


def _from_parent(bone: bpy.types.Bone, parent: bpy.types.Bone) -> Array:
    """Matrix from the bone's space to its parent's, at rest."""
    matrix = np.array(bone.matrix.to_4x4())
    matrix[:3, 3] = bone.head
    matrix[1, 3] += parent.length  # heads count from the parent's tail
    return matrix


def _transforms(obj: bpy.types.Object | bpy.types.PoseBone, path: str, times: Array) -> Array:
    """Matrices from the channels of an object or a bone over time, (F, 4, 4).

    The object's curves have its channels at `path`; those that no curve animates stay as they are.
    """
    owner: Any = obj.id_data
    curves = [curve for curve in _curves(owner.animation_data) if curve.data_path.startswith(path)]
    channel = partial(_channel, obj, curves, path, times)
    result = np.zeros((len(times), 4, 4))
    with np.errstate(invalid="ignore"):  # of broken keys
        result[:, :3, :3] = _turns(obj.rotation_mode, channel) * channel("scale")[:, None]
    result[:, :3, 3] = channel("location")
    result[:, 3, 3] = 1.0
    return result


def _channel(
    obj: bpy.types.Object | bpy.types.PoseBone, curves: Iterable[bpy.types.FCurve], path: str, times: Array, name: str
) -> Array:
    values = np.tile(np.array(getattr(obj, name), dtype=float), (len(times), 1))
    for curve in curves:
        if curve.data_path == path + name:
            values[:, curve.array_index] = _values(curve, times)
    return values


def _values(curve: bpy.types.FCurve, times: Array) -> Array:
    """A curve over time, (F,): its keys, read in bulk, where there are any; Blender's own evaluation between them."""
    keys = np.empty((len(curve.keyframe_points), 2), dtype=np.float32)
    curve.keyframe_points.foreach_get("co", keys.reshape(-1))
    result = np.empty(len(times))
    place = np.searchsorted(keys[:, 0], times).clip(max=len(keys) - 1)
    between = np.ones(len(times), dtype=bool)
    if len(keys) and not curve.modifiers and (np.diff(keys[:, 0]) > 0).all():
        between = keys[place, 0] != times
        result[:] = keys[place, 1]
    result[between] = [curve.evaluate(time) for time in times[between].tolist()]
    return result


def _turns(mode: str, channel: Callable[[str], Array]) -> Array:
    """Rotation matrices (F, 3, 3) of the channels that are in use."""
    if mode == "QUATERNION":
        values = channel("rotation_quaternion")
        values[~values.any(axis=1)] = (0.0, 1.0, 0.0, 0.0)  # as Blender takes a quaternion of no length
        return rotation_matrices(values)
    if mode == "AXIS_ANGLE":
        values = channel("rotation_axis_angle")
        return rotation(values[:, :1] * unit(values[:, 1:]))
    return euler_rotations(channel("rotation_euler"), mode)
