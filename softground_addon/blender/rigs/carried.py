"""Objects that the bones of a rig carry: they hang on one, as children or by a constraint, or on what does."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ...core.numerics.arrays import Array
from ..animation_layer.layer_curves import animated_paths
from ..placement import world_matrix
from .object_data import armature_of

Carried = tuple[str, Array]
"""A bone, and the place of what it carries in the space of its armature at rest, (4, 4)."""

FULL = 0.5
"""Least influence of a constraint that counts."""


def carrier_of(obj: bpy.types.Object, armature: bpy.types.Object) -> Carried | None:
    """The bone of an armature that carries an object which does not move by itself, and its place at rest."""
    carried = None
    for node in reversed(held_with(obj, armature)):
        in_parent = np.array(node.matrix_parent_inverse @ node.matrix_basis)
        carried = (carried[0], carried[1] @ in_parent) if carried else _hung(node, armature)
    return carried


def held_with(obj: bpy.types.Object, armature: bpy.types.Object) -> list[bpy.types.Object]:
    """An object and those above it, up to the one that a bone carries; empty where none does."""
    if _hung(obj, armature):
        return [obj]
    parent = obj.parent if obj.parent_type == "OBJECT" else None
    if parent is None or parent.type == "ARMATURE" or _active(obj) or obj.find_armature():
        return []
    above = held_with(parent, armature)
    return [obj, *above] if above and not _is_keyed(obj) else []


def _hung(obj: bpy.types.Object, armature: bpy.types.Object) -> Carried | None:
    """The bone on which an object itself hangs, or that it follows."""
    if obj.parent == armature and obj.parent_type == "BONE":
        bone = armature_of(armature).bones.get(obj.parent_bone)
        return (bone.name, _on_bone(obj, bone)) if bone else None
    return _held(obj, armature) if _active(obj) and not _is_keyed(obj) else None


def _active(obj: bpy.types.Object) -> list[bpy.types.Constraint]:
    return [constraint for constraint in obj.constraints if not constraint.mute]


def _on_bone(obj: bpy.types.Object, bone: bpy.types.Bone) -> Array:
    """The place of an object that hangs on a bone, in the space of the bone's armature at rest, (4, 4)."""
    parent = np.eye(4)
    if not bone.use_relative_parent:
        parent = np.array(bone.matrix_local)
        parent[:3, 3] += parent[:3, 1] * bone.length
    return np.asarray(parent @ np.array(obj.matrix_parent_inverse @ obj.matrix_basis))


def _held(obj: bpy.types.Object, armature: bpy.types.Object) -> Carried | None:
    """The same of an object that follows a bone by its only constraint."""
    (constraint, *others), basis = _active(obj), np.array(obj.matrix_basis)
    each: Any = constraint
    target: Any = each
    if each.type == "ARMATURE":
        target = each.targets[0] if len(each.targets) == 1 else None
    bone = armature_of(armature).bones.get(getattr(target, "subtarget", ""))
    if others or each.influence < FULL or bone is None or target.target != armature:
        return None
    if each.type == "COPY_TRANSFORMS" and each.mix_mode == "REPLACE":
        return bone.name, np.array(bone.matrix_local)
    if each.type == "CHILD_OF" and obj.parent is None:
        return bone.name, np.array(bone.matrix_local) @ np.array(each.inverse_matrix) @ basis
    if each.type == "ARMATURE" and obj.parent == armature:
        return bone.name, np.array(obj.matrix_parent_inverse) @ basis
    if each.type == "ARMATURE" and obj.parent is None and _stands(armature):
        return bone.name, np.linalg.pinv(world_matrix(armature)) @ basis
    return None


def _stands(armature: bpy.types.Object) -> bool:
    """True if an armature stays where it is as an object."""
    return armature.parent is None and not armature.constraints and not _is_keyed(armature)


def _is_keyed(obj: bpy.types.Object) -> bool:
    """True if keys, strips or drivers set anything of an object but its bones."""
    return not {path.partition("[")[0] for path, _ in animated_paths(obj)} <= {"pose.bones"}
