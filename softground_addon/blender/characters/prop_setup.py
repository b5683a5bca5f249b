"""Setting up props without a rig: objects that fall, roll and slide."""

from __future__ import annotations

from collections.abc import Iterable
from math import floor, log10

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.motion.props import mass_properties
from ..properties import SoftGroundCharacter
from ..rigs.frame_ranges import ancestors, animated_frames
from ..sampling.prop_extraction import surface_of
from ..sampling.rig_recording import is_simulated
from ..settings import timeline_of
from .character_setup import LONGEST_OF_LIMBS, fit_ground, take_frames
from .contact_editing import check_printable

DENSITY = 500.0
"""Density from which a prop's first mass is guessed [kg/m³]: wood's, between a tyre's and a stone's."""


def add_props(scene: bpy.types.Scene, props: Iterable[bpy.types.Object]) -> list[SoftGroundCharacter]:
    """Add mesh objects to the scene's characters, as props without a rig that fall, roll and slide.

    Objects that hang on one parent, such as the wheels of a bicycle, are one prop. Its mass is that of its rigid
    bodies, or guessed from its volume.

    Raises
    ------
    InputError
        If there is no object, or one is no mesh, the ground, or printing already.
    """
    props = list(props)
    if not props:
        raise InputError("No object is selected: select an animated armature, or mesh objects that fall or roll.")
    for obj in props:
        check_printable(scene.softground, obj)
        for character in scene.softground.characters:
            if character.armature and character.armature in ancestors(obj):
                raise InputError(
                    f"'{obj.name}' is attached to the character '{character.armature.name}': let it print with Add "
                    "Contact."
                )
    groups: dict[bpy.types.Object, list[bpy.types.Object]] = {}
    for obj in props:
        groups.setdefault(_root(obj), []).append(obj)
    added, unit_scale = [], scene.unit_settings.scale_length
    for root, members in groups.items():
        character = scene.softground.characters.add()
        character.name = (members[0] if len(members) == 1 else root).name
        character.mass = _guessed_mass(members, scene.view_layers[0], unit_scale)
        size = min(float(np.array(obj.dimensions).max()) for obj in members) * unit_scale
        character.sole_length = min(size, LONGEST_OF_LIMBS)
        for obj in members:
            sole = character.soles.add()
            sole.name, sole.object = obj.name, obj
        added.append(character)
        for obj in members:
            take_frames(scene.softground, timeline_of(scene), _moving_frames(scene, obj))
        fit_ground(scene.softground)
    scene.softground.active_character = len(scene.softground.characters) - 1
    return added


def _root(obj: bpy.types.Object) -> bpy.types.Object:
    return ([obj, *ancestors(obj)])[-1]


def _guessed_mass(props: Iterable[bpy.types.Object], view_layer: bpy.types.ViewLayer, unit_scale: float) -> float:
    """Mass of some objects [kg]: that of their rigid bodies, or from their volume, to two digits."""
    total = 0.0
    for obj in props:
        if obj.rigid_body:
            total += obj.rigid_body.mass
            continue
        vertices, triangles = surface_of(view_layer, obj)
        to_world = np.array(obj.matrix_world)[:3, :3] * unit_scale
        total += mass_properties(vertices @ to_world.T, triangles).volume * DENSITY
    if not total > 0:
        return 1.0
    return round(total, 1 - floor(log10(total)))


def _moving_frames(scene: bpy.types.Scene, obj: bpy.types.Object) -> tuple[int, int] | None:
    if is_simulated(obj) and scene.rigidbody_world:
        cache = scene.rigidbody_world.point_cache
        return max(cache.frame_start, scene.frame_start), min(cache.frame_end, scene.frame_end)
    return animated_frames(timeline_of(scene), obj)
