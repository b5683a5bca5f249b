"""Corrections of imports by an empty above the character; its own data stays as it is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ...core.errors import InputError
from ...core.motion.people import has_two_legs, likely_mass
from ...core.rig.mapping import RigMapping
from ...core.rig.rig_at_rest import sizes_at_rest
from ..compat import HAS_SLOTS, action_curves, slot_of
from ..rigs.frame_ranges import ancestors
from ..sampling.skin_sampling import meshes_on
from ..settings import character_of, units_of


def sizes_of(unit_scale: float, character: Any) -> tuple[float, float]:
    """Its `CharacterMotion.stature` and `size` as its rig stands now [m]; 0 without bones."""
    if not character.armature:
        return 0.0, 0.0
    return _sizes(unit_scale, character.armature, _mapping_of(character), has_skin=character.skin_mass > 0)


def _sizes(
    unit_scale: float, armature: bpy.types.Object, mapping: RigMapping, *, has_skin: bool
) -> tuple[float, float]:
    if not isinstance(armature.data, bpy.types.Armature) or not armature.data.bones:  # its library is gone
        return 0.0, 0.0
    bones = armature.data.bones
    heads, world = np.zeros((len(bones), 3), dtype=np.float32), np.array(armature.matrix_world)
    bones.foreach_get("head_local", heads.reshape(-1))
    mapped = ((joint, bones.get(bone), f"{end}_local") for joint, (bone, end) in mapping.joints.items())
    joints = {joint: np.array(getattr(bone, end)) for joint, bone, end in mapped if bone}
    sizes = sizes_at_rest(heads.astype(float), joints, world, mapping.legs, has_skin=has_skin)
    return sizes[0] * unit_scale, sizes[1] * unit_scale


def extent_of(unit_scale: float, armature: bpy.types.Object) -> float:
    """Largest extent of an armature's bones at rest as it stands now [m], whatever its joints; 0 without bones."""
    return _sizes(unit_scale, armature, RigMapping(), has_skin=True)[1]


def _mapping_of(character: Any) -> RigMapping:
    known = character_of(character)
    return RigMapping(known.joints, known.soles)


def has_legs(character: Any) -> bool:
    """True if a character stands on two legs, as people do."""
    mapping = _mapping_of(character)
    return has_two_legs(mapping.joints, mapping.legs)


def mass_of(character: Any) -> float:
    """Likely mass by the skin, or by the height where the skin is too large for it [kg]; 0 without a skin."""
    if not has_legs(character) or not (extent := extent_of(1.0, character.armature)):
        return character.skin_mass
    size = character.size * sizes_of(1.0, character)[1] / extent  # that of the skin, whatever the rig's scale is now
    return likely_mass(character.skin_mass, size, two_legs=True)[0]


def is_captured(character: Any) -> bool:
    """True if a character is the skeleton of a person without a skin, as of motion capture."""
    return has_legs(character) and not character.skin_mass > 0


PUT_UNDER = "softground_empty"
"""Custom property of an empty above a character: what it is for."""


def put_under(
    collection: bpy.types.Collection,
    armature: bpy.types.Object,
    purpose: str,
    is_fit: Callable[[bpy.types.Object], object] = bool,
) -> bpy.types.Object:
    """Hang a character, with the meshes of a collection that it deforms, on an empty at the origin; its keys stay.

    It is the one that was made for this purpose before, wherever the user has put that since, if it is still fit for
    it, or else a new one above all.

    Raises
    ------
    InputError
        If it is linked from another file.
    """
    before = next((obj for obj in ancestors(armature) if obj.get(PUT_UNDER) == purpose and is_fit(obj)), None)
    tops = dict.fromkeys([obj, *ancestors(obj)][-1] for obj in (armature, *meshes_on(collection.all_objects, armature)))
    linked = next((obj for obj in ([before] if before else tops) if obj.library), None)
    if linked is not None:
        raise InputError(
            f"'{linked.name}' is linked from another file: make a library override of it (Object > Library Override > "
            "Make), or scale it in its own file."
        )
    if before:
        return before
    empty = bpy.data.objects.new(f"{armature.name} {purpose}", None)
    empty[PUT_UNDER] = purpose
    (armature.users_collection or (collection,))[0].objects.link(empty)
    for obj in tops:
        obj.parent = empty
        obj.matrix_parent_inverse.identity()
    return empty


def walk_ahead(scene: bpy.types.Scene, armature: bpy.types.Object, velocity: NDArray[np.float64]) -> None:
    """Let a character that walks on the spot travel at a velocity (2,) [m/s], also beyond the frames of the bake.

    A character that was let travel before goes on as it does, and so much faster.

    Raises
    ------
    InputError
        If it is linked from another file.
    """
    empty = put_under(scene.collection, armature, "Travel", _travels)
    options, units = scene.softground, units_of(scene)
    if not _travels(empty):
        for frame in (options.frame_start, options.frame_end):
            empty.keyframe_insert("location", frame=frame * units.time_stretch)
        for curve in _travels(empty):
            curve.extrapolation = "LINEAR"
            for key in curve.keyframe_points:
                key.interpolation = "LINEAR"
    above = empty.parent.matrix_world @ empty.matrix_parent_inverse if empty.parent else Matrix()
    per_second = np.linalg.pinv(np.array(above)[:3, :3])[:, :2] @ velocity / units.unit_scale_m
    for curve in _travels(empty):
        slope = per_second[curve.array_index] / (units.frame_rate * units.time_stretch)
        for key in curve.keyframe_points:
            for point in (key.handle_left, key.handle_right, key.co):
                point.y += slope * (point.x - options.frame_start * units.time_stretch)
        curve.update()
        cast("bpy.types.Action", curve.id_data).update_tag()


def _travels(empty: bpy.types.Object) -> list[bpy.types.FCurve]:
    """Curves of the place of an empty; none where they do not move it level, or are not its own alone."""
    animation = empty.animation_data
    action = animation.action if animation else None
    if not animation or not action or action.library or action.users - action.use_fake_user > 1 or animation.nla_tracks:
        return []
    slot = slot_of(animation)
    curves = [] if HAS_SLOTS and slot is None else action_curves(action, slot)
    moving = [curve for curve in curves if curve.data_path == "location" and not curve.mute]
    moving = [curve for curve in moving if len(curve.keyframe_points) > 1]
    return moving if {0, 1} <= {curve.array_index for curve in moving} else []
