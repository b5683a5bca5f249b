"""Objects that the bones of a rig carry: they hang on one, as children or by a constraint."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ...core.numerics.arrays import Array
from ..animation_layer.layer_curves import animated_paths
from ..placement import world_matrix

Carried = tuple[str, Array]
"""A bone, and the place of what it carries in the space of its armature at rest, (4, 4)."""

FULL = 0.5
"""Least influence of a constraint that counts."""


def carrier_of(obj: bpy.types.Object, armature: bpy.types.Object) -> Carried | None:
    """The bone of an armature that carries an object which does not move by itself, and its place at rest."""
    parent = obj.parent
    if parent == armature and obj.parent_type == "BONE":
        bone = armature.data.bones.get(obj.parent_bone)
        return (bone.name, on_bone(obj, bone)) if bone else None
    is_held = not obj.animation_data and any(not constraint.mute for constraint in obj.constraints)
    return _held(obj, armature) if is_held else None


def on_bone(obj: bpy.types.Object, bone: bpy.types.Bone) -> Array:
    """The place of an object that hangs on a bone, in the space of the bone's armature at rest, (4, 4)."""
    parent = np.eye(4)
    if not bone.use_relative_parent:
        parent = np.array(bone.matrix_local)
        parent[:3, 3] += parent[:3, 1] * bone.length
    return np.asarray(parent @ np.array(obj.matrix_parent_inverse @ obj.matrix_basis))


def _held(obj: bpy.types.Object, armature: bpy.types.Object) -> Carried | None:
    """The same of an object that follows a bone by its only constraint."""
    (constraint, *others), own = (each for each in obj.constraints if not each.mute), np.array(obj.matrix_basis)
    each: Any = constraint
    target: Any = each
    if each.type == "ARMATURE":
        target = each.targets[0] if len(each.targets) == 1 else None
    bone = armature.data.bones.get(getattr(target, "subtarget", ""))
    if others or each.influence < FULL or bone is None or target.target != armature:
        return None
    if each.type == "COPY_TRANSFORMS" and each.mix_mode == "REPLACE":
        return bone.name, np.array(bone.matrix_local)
    if each.type == "CHILD_OF" and obj.parent is None:
        return bone.name, np.array(bone.matrix_local) @ np.array(each.inverse_matrix) @ own
    if each.type == "ARMATURE" and obj.parent == armature:
        return bone.name, np.array(obj.matrix_parent_inverse) @ own
    if each.type == "ARMATURE" and obj.parent is None and _stands(armature):
        return bone.name, np.linalg.pinv(world_matrix(armature)) @ own
    return None


def _stands(armature: bpy.types.Object) -> bool:
    """True if an armature stays where it is as an object."""
    moved = (path.partition("[")[0] for path, _ in animated_paths(armature))
    return armature.parent is None and not armature.constraints and set(moved) <= {"pose.bones"}
