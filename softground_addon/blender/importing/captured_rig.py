"""An armature that moves as a captured body did, and an object for each force plate."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from ...core.capture.captured import Plate
from ...core.capture.skeleton import Skeleton
from ...core.numerics.orientation import quaternions, without_leaps
from ..animation_layer.layer_curves import LayerCurve, assign_action, new_action

Array = NDArray[np.float64]


def new_rig(context: bpy.types.Context, name: str, skeleton: Skeleton, frames: Array, unit: float) -> bpy.types.Object:
    """An armature with the bones and the motion of a skeleton, active and selected.

    Parameters
    ----------
    frames : (F,) float array
        Scene frame of each pose.
    unit : float
        Length of a unit of the scene [m].
    """
    armature = bpy.data.objects.new(name, bpy.data.armatures.new(name))
    context.collection.objects.link(armature)
    for obj in context.selected_objects:
        obj.select_set(False)
    context.view_layer.objects.active = armature
    armature.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    for bone, matrix in zip(skeleton.bones, skeleton.rest(), strict=True):
        made = armature.data.edit_bones.new(bone.name)
        made.head, made.tail = (Vector((point / unit).tolist()) for point in (bone.head, bone.tail))
        made.align_roll(Vector(matrix[:3, 2].tolist()))
        made.parent = armature.data.edit_bones.get(bone.parent) if bone.parent else None
    bpy.ops.object.mode_set(mode="OBJECT")
    _animate(armature, skeleton, frames, unit)
    return armature


def _animate(armature: bpy.types.Object, skeleton: Skeleton, frames: Array, unit: float) -> None:
    """Key places and turns of all bones."""
    channels, curves = skeleton.channels(), []
    for index, bone in enumerate(skeleton.bones):
        path = armature.pose.bones[bone.name].path_from_id()
        turns = without_leaps(quaternions(channels[:, index, :3, :3]))
        places = channels[:, index, :3, 3] / unit
        for what, values in (("location", places), ("rotation_quaternion", turns)):
            curves += [
                LayerCurve(f"{path}.{what}", axis, bone.name, frames, column) for axis, column in enumerate(values.T)
            ]
    assign_action(armature, new_action(armature.name, armature, curves))


def new_plate(context: bpy.types.Context, name: str, plate: Plate, frames: Array, unit: float) -> bpy.types.Object:
    """A force plate as a mesh with its force as animated custom properties `force_x`, `force_y`, `force_z` [N].

    Parameters
    ----------
    frames : (S,) float array
        Scene frame of each sample.
    unit : float
        Length of a unit of the scene [m].
    """
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(corner) for corner in plate.corners / unit], [], [(0, 1, 2, 3)])
    obj = bpy.data.objects.new(name, mesh)
    context.collection.objects.link(obj)
    curves = []
    for axis, values in zip("xyz", plate.force.T, strict=True):
        obj[f"force_{axis}"] = 0.0
        curves.append(LayerCurve(f'["force_{axis}"]', 0, "Force", frames, values))
    assign_action(obj, new_action(name, obj, curves))
    return obj
