"""Further parts of a character that print: bones, patches of its skin, objects that it carries."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.numerics.components import components
from ..properties import SoftGroundCharacter
from ..rigs.libraries import check_libraries
from ..rigs.object_data import armature_of, mesh_of
from .character_setup import title_of


def add_bone_contacts(character: SoftGroundCharacter, bones: Iterable[str]) -> list[str]:
    """Let limbs of a character print, by whatever side of them faces down; names of the soles that were added.

    Raises
    ------
    InputError
        If there is none, or all print already.
    """
    taken = {bone for sole in character.soles for bone in (sole.bone, sole.toe_bone)}
    fresh = [bone for bone in bones if bone not in taken]
    if not fresh:
        raise InputError(
            f"No further bone of '{title_of(character)}' is selected: select the bones that touch the ground, in Pose "
            "Mode."
        )
    for bone in fresh:
        sole = character.soles.add()
        sole.name, sole.bone, sole.kind = bone, bone, "LIMB"
        sole.side = _side_of(bone)
    character.active_sole = len(character.soles) - 1
    return fresh


LEAST_SHARE = 0.05
"""Share of the weights on some vertices from which a bone carries them."""


def add_vertex_contacts(character: SoftGroundCharacter, skin: bpy.types.Object) -> list[str]:
    """Let what carries the selected vertices of a character's mesh print, a contact for each patch of them; its names.

    Raises
    ------
    InputError
        If none is selected, or no bone carries them.
    """
    skin.update_from_editmode()
    mesh = skin.data
    assert isinstance(mesh, bpy.types.Mesh)
    chosen = np.zeros(len(mesh.vertices), dtype=bool)
    mesh.vertices.foreach_get("select", chosen)
    edges = np.zeros(2 * len(mesh.edges), dtype=np.int32)
    mesh.edges.foreach_get("vertices", edges)
    start, other = edges.reshape(-1, 2)[chosen[edges.reshape(-1, 2)].all(axis=1)].T
    patch, bones = components(len(chosen), start, other), armature_of(character.armature).bones
    carried: dict[str, set[str]] = {}
    for number in np.unique(patch[chosen]):
        weights: dict[str, float] = {}
        for vertex in np.flatnonzero(chosen & (patch == number)).tolist():
            for element in mesh.vertices[vertex].groups:
                name = skin.vertex_groups[element.group].name
                if name in bones and bones[name].use_deform:
                    weights[name] = weights.get(name, 0.0) + element.weight
        least = LEAST_SHARE * sum(weights.values())
        if least > 0:
            main = max(weights, key=weights.__getitem__)
            carried.setdefault(main, set()).update(name for name, weight in weights.items() if weight >= least)
    if not carried:
        raise InputError(
            f"No vertex of '{skin.name}' is selected that a bone of '{title_of(character)}' carries: select those that "
            "touch the ground."
        )
    added = add_bone_contacts(character, carried)
    for name in added:
        for bone in sorted(carried[name]):
            character.soles[name].parts.add().name = bone
    return added


def add_object_contacts(options: Any, character: SoftGroundCharacter, props: Iterable[bpy.types.Object]) -> list[str]:
    """Let objects print as soles of a character: canes, snowshoes, wheels; names of those that were added.

    Raises
    ------
    InputError
        If there is none, or one is no mesh, the ground, or printing already.
    """
    props = list(props)
    if not props:
        raise InputError(
            "No object is selected: select the meshes that touch the ground, such as a cane or a snowshoe."
        )
    if character.body:
        raise InputError(f"'{character.name}' has no armature, and prints with its own parts: add a prop by itself.")
    for obj in props:
        check_printable(options, obj)
    for obj in props:
        sole = character.soles.add()
        sole.name, sole.object = obj.name, obj
        sole.side = _side_of(obj.name)
    character.active_sole = len(character.soles) - 1
    return [obj.name for obj in props]


def _side_of(name: str) -> str:
    """'LEFT', 'RIGHT' or 'NONE', by the ending of a name (`.L`, `.R`)."""
    return next((side for end, side in ((".L", "LEFT"), (".R", "RIGHT")) if name.upper().endswith(end)), "NONE")


def check_printable(options: Any, obj: bpy.types.Object) -> None:
    """Raise InputError, with the remedy, if an object cannot print, is the ground, or prints already."""
    check_libraries(obj)
    if obj.type != "MESH":
        raise InputError(
            f"'{obj.name}' is not a mesh but of type {obj.type.title()}: select an animated armature, or mesh "
            "objects that fall or roll."
        )
    if obj == options.ground:
        raise InputError(f"'{obj.name}' is the ground: select what moves on it.")
    if not mesh_of(obj).polygons and not obj.modifiers:
        raise InputError(f"'{obj.name}' has no faces to print with: give its mesh faces, or select another object.")
    for character in options.characters:
        if any(sole.object == obj for sole in character.soles):
            raise InputError(
                f"'{obj.name}' already prints, as a sole of '{title_of(character)}': select another object."
            )
