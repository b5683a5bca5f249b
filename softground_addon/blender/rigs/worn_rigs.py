"""Rigs that a character wears: shoes, hair and skirts on armatures of their own that follow the body's bones."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Any

import bpy
import numpy as np

from ...core.numerics.arrays import Array
from ..animation_layer.constraint_layer import is_own
from ..placement import beside
from ..settings import Objects
from .carried import Carried, carrier_of
from .frame_ranges import ancestors
from .object_data import armature_of, pose_bones

Lead = tuple[bpy.types.Object, str]
"""An armature and a bone of it that others follow."""

_COPIES = {"COPY_TRANSFORMS", "COPY_LOCATION"}
_HOLDS = _COPIES | {"CHILD_OF", "ARMATURE"}
"""Constraints by which a bone goes where another one goes, and those by which it lies as that lies."""

LOWER = 0.2
"""A rig is below a body if it reaches lower by so much of its height."""

_FULL = 0.5
"""Least influence of a constraint that counts."""


def worn_rigs(objects: Objects, body: bpy.types.Object) -> list[bpy.types.Object]:
    """The armatures that a body wears: they hang on its bones, or have no keys and go where its bones go."""
    return [obj for obj in objects if obj.type == "ARMATURE" and is_worn(body, obj)]


def rigs_below(
    objects: Objects, body: bpy.types.Object, known: Collection[bpy.types.Object] = ()
) -> list[bpy.types.Object]:
    """The armatures with a skin, but for those known, that stand under a body as it is now and move by themselves: legs
    with a rig of their own, a horse."""
    skinned = dict.fromkeys(rig for obj in objects if obj.type == "MESH" and (rig := obj.find_armature()))
    others = [rig for rig in skinned if rig != body and rig not in known]
    if not others:
        return []
    (low, high), worn = _extent(body), [rig for rig in worn_rigs(objects, body) if not rig.animation_data]
    return [rig for rig in others if rig not in worn and _is_below(_extent(rig), low, high)]


def _is_below(extent: Array, low: Array, high: Array) -> bool:
    meets = (extent[0, :2] < high[:2]).all() and (extent[1, :2] > low[:2]).all()
    return bool(meets and low[2] - extent[0, 2] > LOWER * (high[2] - low[2]))


def _extent(rig: bpy.types.Object) -> Array:
    """Lowest and highest corner of a rig's bones in the world, (2, 3)."""
    ends = np.array([np.array(rig.matrix_world @ end) for bone in pose_bones(rig) for end in (bone.head, bone.tail)])
    return np.stack([ends.min(axis=0), ends.max(axis=0)]) if len(ends) else np.zeros((2, 3))


def hung_on(rig: bpy.types.Object, body: bpy.types.Object) -> Carried | None:
    """The bone of a body on which a rig hangs as an object, and its place in the body's space at rest."""
    if not any(node.parent_type == "BONE" or node.constraints for node in (rig, *ancestors(rig))):
        return None  # as most rigs of a crowd
    leads = _leads(body, rig)
    for leader in dict.fromkeys(leader for leader, _ in leads):
        bone, place = carrier_of(rig, leader) or ("", np.eye(4))
        if name := leads.get((leader, bone)):
            lies = armature_of(body).bones[name].matrix_local @ armature_of(leader).bones[bone].matrix_local.inverted()
            return name, np.asarray(np.array(lies) @ place)
    return None


def is_worn(body: bpy.types.Object, rig: bpy.types.Object) -> bool:
    """True if a body wears an armature, as `worn_rigs` has it."""
    if rig == body:
        return False
    if hung_on(rig, body):
        return True
    animation = rig.animation_data
    if animation and (animation.action or any(track.strips for track in animation.nla_tracks)):
        return False
    leads = _leads(body, rig)
    led = [bone for bone in pose_bones(rig) if any(lead in leads for _, lead in _followed(bone))]
    # A body of its own whose animation is retargeted copies rotations, or reaches for places.
    return bool(led) and all(_held(bone, leads) for bone in led)


def _leads(body: bpy.types.Object, rig: bpy.types.Object) -> dict[Lead, str]:
    """The bone of a body that goes where each of some bones goes, its own and, of the larger of two rigs that follow
    the same one, those that it follows."""
    leads = {(body, bone.name): bone.name for bone in armature_of(body).bones}
    if (len(armature_of(body).bones), body.name) > (len(armature_of(rig).bones), rig.name):
        for bone in pose_bones(body):
            leads |= {lead: bone.name for kind, lead in _followed(bone) if kind in _COPIES and lead[0] != rig}
    return leads


def _followed(bone: bpy.types.PoseBone) -> Iterator[tuple[str, Lead]]:
    """Targets that a bone follows in the world, by constraints that count."""
    for constraint in bone.constraints:
        if constraint.mute or constraint.influence < _FULL or is_own(constraint):
            continue
        each: Any = constraint
        rig: Any = bone.id_data
        for target in each.targets if constraint.type == "ARMATURE" else [each]:
            leader, name = getattr(target, "target", None), getattr(target, "subtarget", "")
            if leader and name and (each.owner_space == "WORLD" or leader.matrix_world == rig.matrix_world):
                yield constraint.type, (leader, name)


def _held(bone: bpy.types.PoseBone, leads: Collection[Lead]) -> tuple[str, Lead] | None:
    """Kind of the constraint by which a bone follows one of the leads."""
    return next((held for held in _followed(bone) if held[0] in _HOLDS and held[1] in leads), None)


def carriers(rig: bpy.types.Object, body: bpy.types.Object) -> dict[str, Carried]:
    """The bone of a body that carries each bone of a rig that it wears, and the matrix (4, 4) from the rig's space into
    the body's, both at rest.

    Bones that follow none go with those that they hang on.
    """
    leads, carrying = _leads(body, rig), {}
    in_body = beside(rig, body)
    for bone in pose_bones(rig):
        for node in (bone, *bone.parent_recursive):
            if (held := _held(node, leads)) is not None:
                kind, name = held[0], leads[held[1]]
                lies = armature_of(body).bones[name].matrix_local @ node.bone.matrix_local.inverted()
                carrying[bone.name] = name, np.array(lies) if kind in _COPIES else in_body
                break
    return carrying
