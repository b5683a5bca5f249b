"""Roles of bones: joints and feet of an armature, from the names of the usual rigs, else from its rest pose.

`core.rig.name_mapping` reads the names; here joints that they leave out are completed from the rest pose.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.findings import listed
from ...core.rig.bones import RestBone, RigBones
from ...core.rig.mapping import BoneEnd, RigMapping, SoleSource
from ...core.rig.name_mapping import map_by_names
from .libraries import check_libraries
from .object_data import armature_of
from .rest_pose import map_by_rest_pose

CHOOSE_CONTACTS = (
    "select the bones that touch the ground in Pose Mode, or vertices of the mesh in Edit Mode, and press Add Contact "
    "in Feet"
)
"""Remedy if no feet are found."""


def map_rig(armature: bpy.types.Object, *, posed: bool = False, named: bool = True, skinned: bool = True) -> RigMapping:
    """Joints and feet of an armature.

    Parameters
    ----------
    armature : bpy.types.Object
        Only read; may be linked or overridden.
    posed : bool
        True if the current pose stands in for the rest pose.
    named : bool
        False if the names say nothing.
    skinned : bool
        False if it has no skin, so that bones alone tell where its legs end.

    Returns
    -------
    RigMapping

    Raises
    ------
    InputError
        If the object is no armature, or no feet are found by name or by rest pose.
    """
    require_armature(armature)
    deforming = {bone.name for bone in armature_of(armature).bones if bone.use_deform}
    mapping = map_by_names(rest_bones(armature), deforming) if named else None
    if mapping is None or not mapping.joints.keys() >= _WHOLE_BODY:
        shape = map_by_rest_pose(armature, posed=posed, skinned=skinned)
        if shape is not None:
            joints, feet = shape
            by_shape = RigMapping(joints, tuple(SoleSource(*foot) for foot in feet), method="rest pose")
            mapping = by_shape if mapping is None else _completed(mapping, by_shape)
    if mapping is None or not mapping.soles:
        raise InputError(
            f"No feet found in '{armature.name}', neither by the names of its bones nor by how they lie: "
            f"{CHOOSE_CONTACTS}."
        )
    return mapping


_LEG, _ARM = ("hip", "knee", "ankle", "ball", "toe"), ("shoulder", "elbow", "wrist")

_WHOLE_BODY = frozenset(("hips", "neck", "head", *(f"{joint}_{side}" for joint in (*_LEG[:3], *_ARM) for side in "lr")))
"""Joints without which the rest pose is read, too."""


def _completed(named: RigMapping, shaped: RigMapping) -> RigMapping:
    """The mapping by names, completed from the shape of the rest pose.

    A leg that is named in part is taken whole from the shape, as its words may mean other bones; of arms and trunk, the
    missing joints. Limbs on which the two disagree stay as they are named, and what is named a leg is no arm. Legs that
    are misread, so that none is named, are taken from the shape.
    """
    joints, soles, by_shape = dict(named.joints), named.soles, dict(shaped.joints)
    arms, named_legs = ({f"{joint}_{side}" for joint in limb for side in "lr"} for limb in (_ARM, _LEG))
    if not named.soles:
        taken = {by_shape[joint][0] for joint in named_legs & by_shape.keys()}
        others = {joint: at for joint, at in joints.items() if joint not in named_legs and at[0] not in taken}
        return RigMapping({**by_shape, **others}, shaped.soles, shaped.method)
    legs = {joints[joint][0] for joint in named_legs & joints.keys()}
    if any(by_shape[joint][0] in legs for joint in arms & by_shape.keys()):
        by_shape = {joint: place for joint, place in by_shape.items() if joint not in arms}
    shaped_soles = {sole.name: sole for sole in shaped.soles}
    for side in "lr":
        leg, arm = ([f"{joint}_{side}" for joint in limb] for limb in (_LEG, _ARM))
        if _is_part_of_leg(joints, by_shape, side):
            joints = {joint: place for joint, place in joints.items() if joint not in leg}
            joints |= {joint: by_shape[joint] for joint in leg if joint in by_shape}
            soles = tuple(shaped_soles.get(sole.name, sole) if sole.side.lower() == side else sole for sole in soles)
        shoulder = f"shoulder_{side}"
        if shoulder not in joints or joints[shoulder] == by_shape.get(shoulder):
            joints = _with_missing(joints, by_shape, arm)
    trunk = [joint for joint in by_shape if not joint.endswith(("_l", "_r"))]
    return RigMapping(_with_missing(joints, by_shape, trunk), soles, named.method)


def _is_part_of_leg(joints: Mapping[str, BoneEnd], by_shape: Mapping[str, BoneEnd], side: str) -> bool:
    """True if a leg is named in part, and ends at a bone that is the end of a leg by its shape too."""
    hip, knee, ankle, ball, _ = (f"{joint}_{side}" for joint in _LEG)
    is_whole = {hip, knee, ankle} <= joints.keys()
    return not is_whole and ankle in joints and joints[ankle] in (by_shape.get(ankle), by_shape.get(ball))


def _with_missing(
    joints: Mapping[str, BoneEnd], by_shape: Mapping[str, BoneEnd], wanted: Iterable[str]
) -> dict[str, BoneEnd]:
    """The joints, with the wanted ones that only the shape has."""
    return {**joints, **{joint: by_shape[joint] for joint in wanted if joint in by_shape and joint not in joints}}


def instances_armature(obj: bpy.types.Object) -> bool:
    """True if an object shows an armature of the collection that it instances, as linked characters are at first."""
    collection = obj.instance_collection
    return collection is not None and any(part.type == "ARMATURE" for part in collection.all_objects)


def instances_mesh(obj: bpy.types.Object) -> bool:
    """True if an object shows a mesh of the collection that it instances, and no armature."""
    collection = obj.instance_collection
    if collection is None or instances_armature(obj):
        return False
    return any(part.type == "MESH" for part in collection.all_objects)


def parts_of(obj: bpy.types.Object) -> list[bpy.types.Object]:
    """The mesh objects of which an empty is the top, where no armature is among them."""
    below = obj.children_recursive if obj.type == "EMPTY" else []
    return [] if any(part.type == "ARMATURE" for part in below) else [part for part in below if part.type == "MESH"]


def only_parts(top: bpy.types.Object, reason: str = "") -> str:
    """Refusal of an empty above mesh objects, and the reason for which they are no figure."""
    return (
        f"'{top.name}' has no armature, only mesh objects below it: select those that touch the ground (of "
        f"{listed(part.name for part in parts_of(top))}) and press Add Character; each prints as a rigid body."
        f"{reason and f' As one figure they print nothing, as {reason}.'}"
    )


def require_armature(armature: bpy.types.Object | None) -> None:
    """Raise InputError unless the object is an armature with bones."""
    if armature is None:
        raise InputError(
            "No armature is chosen: select the character's armature, or mesh objects that fall or roll, and press Add "
            "Character."
        )
    check_libraries(armature)
    if instances_armature(armature):
        raise InputError(
            f"The armature of '{armature.name}' is in a collection instance and cannot be read there: make it real "
            "(Object > Library Override > Make, or Object > Apply > Make Instances Real)."
        )
    if parts_of(armature):
        raise InputError(only_parts(armature))
    if armature.type != "ARMATURE":
        raise InputError(
            f"'{armature.name}' is not an armature but of type {armature.type.title()}: select the character's "
            "armature."
        )
    if not armature_of(armature).bones:
        raise InputError(f"Armature '{armature.name}' has no bones: choose the armature that moves the character.")


def rest_bones(armature: bpy.types.Object) -> RigBones:
    """The bones of an armature at rest."""
    return {
        bone.name: RestBone(
            parent=bone.parent.name if bone.parent else "",
            matrix=np.array(bone.matrix_local, dtype=float),
            head=np.array(bone.head_local, dtype=float),
            tail=np.array(bone.tail_local, dtype=float),
            length=float(
                np.linalg.norm(np.array(bone.tail_local, dtype=float) - np.array(bone.head_local, dtype=float))
            ),
        )
        for bone in armature_of(armature).bones
    }
