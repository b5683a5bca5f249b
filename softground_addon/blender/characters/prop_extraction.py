"""Objects that print with their own mesh, by whatever of it faces down: their surface and how it moves."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.errors import InputError
from ...core.motion.motion import Array, SoleMotion
from ...core.motion.props import mass_properties
from ...core.numerics.rigid import displacement, nearest_rotation
from ...core.soles.soles import prop_sole
from .. import mesh_arrays
from .rig_mapping import SoleSource

_SAME_SIZE = 0.01
"""Relative change of an object's size over a shot that is still none."""

_FLAT = 1e-9
"""An object whose scale along one axis is smaller than this part of the largest is squashed flat."""


def check_props(scene: bpy.types.Scene, owner: str, sources: tuple[SoleSource, ...]) -> None:
    """Raise InputError, naming the remedy, if an object that should print cannot.

    Parameters
    ----------
    scene : bpy.types.Scene
    owner : str
        Whose soles they are.
    sources : tuple of SoleSource
    """
    for source in sources:
        if not source.object:
            continue
        obj = next((obj for obj in scene.objects if obj.name_full == source.object), None)
        if obj is None:
            raise InputError(
                f"Sole '{source.name}' of '{owner}': object '{source.object}' was deleted: choose another one, or "
                "remove the contact."
            )
        if obj.type != "MESH":
            raise InputError(f"'{obj.name}' has no mesh to print with: choose a mesh object for sole '{source.name}'.")
        if obj.mode == "EDIT":
            raise InputError(f"'{obj.name}', which prints, is in Edit Mode: leave it with Tab first.")
        if obj == scene.softground.ground:
            raise InputError(
                f"'{obj.name}' is the ground and cannot print on itself: choose another object for sole "
                f"'{source.name}' of '{owner}', or another ground."
            )


def surface_of(scene: bpy.types.Scene, obj: bpy.types.Object) -> tuple[Array, NDArray[np.intp]]:
    """Vertices (V, 3) and triangles (T, 3) of a mesh object in its own frame, with its modifiers.

    Without them where the object is hidden in the scene: Blender does not evaluate it then.

    Raises
    ------
    InputError
        If it has no faces.
    """
    scene.view_layers[0].update()
    depsgraph = scene.view_layers[0].depsgraph
    evaluated = obj.evaluated_get(depsgraph) if depsgraph else obj
    mesh = evaluated.to_mesh()
    try:
        vertices, triangles = mesh_arrays.positions(mesh), mesh_arrays.triangles(mesh)
    finally:
        evaluated.to_mesh_clear()
    if not len(triangles):
        raise InputError(f"'{obj.name}' has no faces to print with: give its mesh faces, or choose another object.")
    if not np.isfinite(vertices).all():
        raise InputError(
            f"The mesh of '{obj.name}' has vertices without a valid position (NaN or infinite): delete them."
        )
    return vertices.astype(float), triangles


def prop_motion(scene: bpy.types.Scene, source: SoleSource, matrices: Array) -> tuple[SoleMotion, float]:
    """An object that prints with its own mesh, and its volume [m³].

    Its scale may differ along its axes, mirror or shear it, as long as it stays as it is.

    Parameters
    ----------
    scene : bpy.types.Scene
    source : SoleSource
        Names the object.
    matrices : (F, 4, 4) float array
        Its frame to the world over time [m].

    Raises
    ------
    InputError
        If its mesh has no faces, or its scale is 0 or changes.
    """
    obj = next(obj for obj in scene.objects if obj.name_full == source.object)
    turn = nearest_rotation(matrices[:1, :3, :3])[0]
    stretch = turn.T @ matrices[0, :3, :3]
    sizes = np.linalg.svd(stretch, compute_uv=False)
    if not sizes.min() > _FLAT * max(sizes.max(), 1e-300):
        raise InputError(
            f"'{obj.name}' has a scale of zero: set its scale, or apply it (Object > Apply > Scale), also on its "
            "parents."
        )
    rotation = nearest_rotation(matrices[:, :3, :3] @ np.linalg.inv(stretch))
    change = np.abs(matrices[:, :3, :3] - rotation @ stretch).max(axis=(1, 2)) / sizes.max()
    if change.max() > _SAME_SIZE:
        raise InputError(
            f"'{obj.name}' changes its size or shape, but prints as a rigid body: take the keys off its scale, or "
            "let a child that keeps its size print."
        )
    vertices, triangles = surface_of(scene, obj)
    vertices = vertices @ stretch.T
    mass = mass_properties(vertices, triangles)
    transforms = displacement(rotation, -mass.centre, matrices[:, :3, 3])
    sole = prop_sole(vertices - mass.centre, triangles, name=source.name, side=source.side)
    return SoleMotion(sole, transforms[:, None]), mass.volume
