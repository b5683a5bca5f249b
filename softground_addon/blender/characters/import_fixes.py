"""Corrections of imports by an empty above the character; its own data stays as it is."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.errors import InputError
from ...core.motion.people import has_two_legs, likely_mass
from ...core.rig.bones import extent, stature
from ..compat import action_curves
from ..rigs.frame_ranges import ancestors
from ..sampling.skin_sampling import meshes_on
from ..settings import frame_rate_of, time_stretch_of


def size_of(unit_scale: float, armature: bpy.types.Object) -> float:
    """Largest extent of a rig's joints at rest [m]: the height of a body, or the length of a dog; 0 without bones."""
    return extent(_heads(armature), np.array(armature.matrix_world)) * unit_scale


def stature_of(unit_scale: float, armature: bpy.types.Object) -> float:
    """Its `CharacterMotion.stature` as it stands now [m]; 0 without bones."""
    return stature(_heads(armature), np.array(armature.matrix_world)) * unit_scale


def has_legs(character: Any) -> bool:
    """True if a character stands on two legs, as people do."""
    return has_two_legs(character.joints.keys(), len(character.soles))


def mass_of(character: Any) -> float:
    """Likely mass by the skin, or by the height where the skin is too large for it [kg]; 0 without a skin."""
    return likely_mass(character.skin_mass, character.size, two_legs=has_legs(character))[0]


def is_captured(character: Any) -> bool:
    """True if a character is the skeleton of a person without a skin, as of motion capture."""
    return has_legs(character) and not character.skin_mass > 0


def _heads(armature: bpy.types.Object) -> NDArray[np.float64]:
    bones = armature.data.bones if armature.data else ()  # a linked rig whose library is gone has no data
    heads = np.zeros((len(bones), 3), dtype=np.float32)
    if len(bones):
        bones.foreach_get("head_local", heads.reshape(-1))
    return heads.astype(float)


def put_under(scene: bpy.types.Scene, armature: bpy.types.Object, name: str) -> bpy.types.Object:
    """Hang a character, with the meshes that it deforms, on a new empty at the origin; whatever animates it stays.

    Raises
    ------
    InputError
        If it is linked from another file.
    """
    tops = dict.fromkeys([obj, *ancestors(obj)][-1] for obj in (armature, *meshes_on(scene.objects, armature)))
    linked = next((obj for obj in tops if obj.library), None)
    if linked is not None:
        raise InputError(
            f"'{linked.name}' is linked from another file: make a library override of it (Object > Library Override > "
            "Make), or scale it in its own file."
        )
    empty = bpy.data.objects.new(name, None)
    (armature.users_collection or (scene.collection,))[0].objects.link(empty)
    for obj in tops:
        obj.parent = empty
        obj.matrix_parent_inverse.identity()
    return empty


def walk_ahead(scene: bpy.types.Scene, armature: bpy.types.Object, velocity: NDArray[np.float64]) -> None:
    """Let a character that walks on the spot travel at a velocity (2,) [m/s], also beyond the frames of the bake.

    Raises
    ------
    InputError
        If it is linked from another file.
    """
    empty = put_under(scene, armature, f"{armature.name} Travel")
    start, end = scene.softground.frame_start, scene.softground.frame_end
    seconds = (end - start) / frame_rate_of(scene)
    for frame, travel in ((start, np.zeros(2)), (end, velocity * seconds / scene.unit_settings.scale_length)):
        empty.location[:2] = travel
        empty.keyframe_insert("location", frame=frame * time_stretch_of(scene))
    assert empty.animation_data is not None
    assert empty.animation_data.action is not None
    for curve in action_curves(empty.animation_data.action):
        curve.extrapolation = "LINEAR"
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
