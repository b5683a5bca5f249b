"""Body motions as actions: one key per bone and frame, written in bulk."""

from __future__ import annotations

import bpy
import numpy as np

from sample_scenes.character import TO_BLENDER
from sample_scenes.motion import Array, BodyMotion


def write_action(armature: bpy.types.Object, motion: BodyMotion, name: str, first_frame: int = 1) -> bpy.types.Action:
    """Give a character of `create_character` an action that plays the motion from `first_frame` on."""
    action, curves = object_curves(armature, name)
    frames = first_frame + np.arange(len(motion.hips), dtype=float)
    turns = {bone: TO_BLENDER @ turn @ TO_BLENDER.T for bone, turn in motion.turns.items()}
    for bone, turn in turns.items():
        parent = armature.data.bones[bone].parent
        rest = np.array(armature.data.bones[bone].matrix_local)[:3, :3]
        local = turn if parent is None else np.swapaxes(turns[parent.name], 1, 2) @ turn
        path = f'pose.bones["{bone}"].'
        armature.pose.bones[bone].rotation_mode = "QUATERNION"
        for index, values in enumerate(quaternions(rest.T @ local @ rest).T):
            write_curve(curves, path + "rotation_quaternion", index, frames, values)
        if parent is None:
            offset = (motion.hips @ TO_BLENDER.T - np.array(armature.data.bones[bone].head_local)) @ rest
            for index, values in enumerate(offset.T):
                write_curve(curves, path + "location", index, frames, values)
    return action


def quaternions(matrices: Array) -> Array:
    """Unit quaternions (F, 4) of rotations (F, 3, 3), w first, without jumps of sign from frame to frame."""
    m = matrices
    trace = np.trace(m, axis1=1, axis2=2)
    diagonal = np.diagonal(m, axis1=1, axis2=2)
    # Four times the square of each component; the largest is the safe one to divide by (Shepperd 1978).
    squares = np.concatenate([1 + trace[:, None], 1 + 2 * diagonal - trace[:, None]], axis=1)
    skew = np.stack([m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]], axis=1)
    symmetric = m + np.swapaxes(m, 1, 2)
    products = np.empty((len(m), 4, 4))  # row c: four times component c times (w, x, y, z)
    products[:, range(4), range(4)] = squares
    products[:, 0, 1:] = products[:, 1:, 0] = skew
    for i in range(3):
        for j in range(3):
            if i != j:
                products[:, 1 + i, 1 + j] = symmetric[:, i, j]
    result = products[np.arange(len(m)), squares.argmax(axis=1)]
    result /= np.linalg.norm(result, axis=1, keepdims=True)
    flips = np.cumprod(np.where((result[1:] * result[:-1]).sum(axis=1) < 0, -1.0, 1.0))
    result[1:] *= flips[:, None]
    return result


def object_curves(thing: bpy.types.Object, name: str) -> tuple[bpy.types.Action, bpy.types.bpy_prop_collection]:
    """A new action of an object, and the collection that its F-curves go into: its own, or its slot's (4.4 on)."""
    action = bpy.data.actions.new(name)
    thing.animation_data_create().action = action
    if not hasattr(action, "slots"):
        return action, action.fcurves
    slot = action.slots.new(id_type="OBJECT", name=thing.name)
    thing.animation_data.action_slot = slot
    strip = action.layers.new("Layer").strips.new(type="KEYFRAME")
    return action, strip.channelbag(slot, ensure=True).fcurves


def write_curve(curves: bpy.types.bpy_prop_collection, path: str, index: int, frames: Array, values: Array) -> None:
    """One F-curve with a key at each of the frames."""
    curve = curves.new(path, index=index)
    curve.keyframe_points.add(len(frames))
    curve.keyframe_points.foreach_set("co", np.stack([frames, values], axis=1).ravel())
    curve.update()
