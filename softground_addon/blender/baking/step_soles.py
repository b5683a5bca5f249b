"""Soles that steps take from meshes of the scene: a shoe, a hoof, the tip of a cane."""

from __future__ import annotations

from collections.abc import Mapping

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.numerics.arrays import Array
from ...core.record.edits import StepEdit, mesh_soles, with_meshes
from ...core.record.mesh_sole import LONGEST, SHORTEST, MeshSole
from ...core.settings import BakeSettings
from ...core.soles.soles import sole_from_underside
from .. import mesh_arrays, settings
from ..ground import baked_ground, ground_mesh, ground_surface

_FROM_SCENE = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""World axes to those of a sole: its toes point along -Y, as a character faces in front view."""
_REMEDY = "or choose another sole for the steps that it presses"


def object_of(objects: settings.Objects, name: str) -> bpy.types.Object | None:
    """The object that edits call so, by its full name, which tells linked ones from local ones."""
    return next((obj for obj in objects if obj.name_full == name), None)


def names(objects: settings.Objects, ground: bpy.types.Object | None) -> list[str]:
    """Objects that steps may take their sole from: the meshes but the ground and what shows its prints."""
    grounds = {ground, baked_ground.display_mesh_of(ground)} if ground else set()
    return [obj.name_full for obj in objects if obj.type == "MESH" and obj not in grounds]


def edits_with_soles(
    objects: settings.Objects, wanted: BakeSettings, edits: Mapping[str, StepEdit] | None
) -> dict[str, StepEdit]:
    """Edits for a bake, by default those on its grounds, with the soles of the meshes that they name as these are now.

    Of a mesh that is gone, what the edits keep stays, or what those on the ground keep.

    Raises
    ------
    InputError
        If an object that is named cannot be a sole.
    """
    if edits == {}:
        return {}
    grounds, now = list(map(settings.resolve, wanted.soft_grounds)), wanted.characters
    on_ground = {name: edit for each in grounds for name, edit in baked_ground.edits_of(each, now).items()}
    edits = on_ground if edits is None else edits
    named = {edit.sole for edit in edits.values() if edit.sole}
    first = next(iter(grounds), None)
    here = {name: read(obj, first, wanted.unit_scale_m) for name in sorted(named) if (obj := object_of(objects, name))}
    return with_meshes(edits, mesh_soles(on_ground) | mesh_soles(edits) | here)


def read(obj: bpy.types.Object, ground: bpy.types.Object | None, unit_scale: float) -> MeshSole:
    """The sole of a mesh as it stands in the scene, its toes toward -Y; with its modifiers, hidden or not.

    Parameters
    ----------
    ground : bpy.types.Object or None
        That it is to press.
    unit_scale : float
        Metres in a unit of the scene.

    Raises
    ------
    InputError
        If it has no underside, or one of a size that no sole has.
    """
    name = obj.name_full
    if obj.type != "MESH":
        raise InputError(f"'{name}' has no mesh to take a sole from: choose a mesh object, or a foot of the bake.")
    if ground and obj in (ground, baked_ground.display_mesh_of(ground)):
        raise InputError(f"'{name}' is the ground and cannot print on itself: choose another object for the sole.")
    if obj.mode == "EDIT":
        raise InputError(f"'{name}', which is to press steps, is in Edit Mode: leave it with Tab first.")
    with ground_surface.stand_in(obj, ground_mesh.mesh_of(obj)) as evaluated:
        mesh = evaluated.to_mesh()
        try:
            vertices, triangles = mesh_arrays.positions(mesh).astype(float), mesh_arrays.triangles(mesh)
        finally:
            evaluated.to_mesh_clear()
        matrix = np.array(evaluated.matrix_world)[:3] * unit_scale
    if not len(triangles):
        raise InputError(f"'{name}' has no faces to press steps with: give its mesh faces, {_REMEDY}.")
    placed = (vertices @ matrix[:, :3].T)[np.unique(triangles)]
    if not np.isfinite(placed).all():
        raise InputError(
            f"The mesh of '{name}' has vertices without a valid position (NaN or infinite): delete them, {_REMEDY}."
        )
    _check_size(name, np.ptp(placed, axis=0))
    in_sole = (vertices @ matrix[:, :3].T - (placed.min(axis=0) + placed.max(axis=0)) / 2) @ _FROM_SCENE.T
    try:
        sole = sole_from_underside(in_sole, triangles, name=name, side="")
    except InputError:
        raise InputError(
            f"'{name}' has no underside to press steps with: it needs faces that look down as it stands in the scene. "
            f"Turn it until its sole lies flat, {_REMEDY}."
        ) from None
    return MeshSole.of(sole.sole, sole.placements)


def _check_size(name: str, extent: Array) -> None:
    """Raise InputError where an extent (3,) [m] is that of no sole."""
    length = float(extent[:2].max())
    if length > LONGEST:
        raise InputError(
            f"'{name}' is {length:.3g} m long, and a sole at most {LONGEST:g} m: scale it to the size of the character "
            f"(its file may be in other units), {_REMEDY}."
        )
    if length < SHORTEST:
        raise InputError(
            f"'{name}' is {length * 1e3:.2g} mm long, and a sole at least {SHORTEST * 1e3:g} mm: scale it to the size "
            f"of the character (its file may be in other units), {_REMEDY}."
        )
