"""Objects that print with their own mesh, by whatever of it faces down: their surface and how it moves."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.errors import InputError
from ...core.motion.sole_motion import SoleMotion
from ...core.numerics.arrays import Array
from ...core.rig.mapping import SoleSource
from ...core.soles.prop_motion import prop_motion
from .. import mesh_arrays
from ..rigs.libraries import check_libraries
from ..settings import Objects
from .sampling_scene import object_named


def check_props(
    objects: Objects, owner: str, sources: tuple[SoleSource, ...], ground: bpy.types.Object | None = None
) -> None:
    """Raise InputError, naming the remedy, if an object that should print cannot.

    Parameters
    ----------
    owner : str
        Whose soles they are.
    ground : bpy.types.Object, optional
        What they may not be: that which they print on.
    """
    for source in sources:
        if not source.object:
            continue
        obj = next((obj for obj in objects if obj.name_full == source.object), None)
        if obj is None:
            raise InputError(
                f"Sole '{source.name}' of '{owner}': object '{source.object}' was deleted: choose another one, or "
                "remove the contact."
            )
        check_libraries(obj)
        if obj.type != "MESH":
            raise InputError(f"'{obj.name}' has no mesh to print with: choose a mesh object for sole '{source.name}'.")
        if obj.mode == "EDIT":
            raise InputError(f"'{obj.name}', which prints, is in Edit Mode: leave it with Tab first.")
        if obj == ground:
            raise InputError(
                f"'{obj.name}' is the ground and cannot print on itself: choose another object for sole "
                f"'{source.name}' of '{owner}', or another ground."
            )


def surface_of(view_layer: bpy.types.ViewLayer, obj: bpy.types.Object) -> tuple[Array, NDArray[np.intp]]:
    """Vertices (V, 3) and triangles (T, 3) of a mesh object in its own frame, with its modifiers.

    Without them where the object is hidden in the layer: Blender does not evaluate it then.

    Raises
    ------
    InputError
        If it has no faces.
    """
    view_layer.update()
    depsgraph = view_layer.depsgraph
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


def read_prop(view_layer: bpy.types.ViewLayer, source: SoleSource, matrices: Array) -> tuple[SoleMotion, float]:
    """An object that prints with its own mesh, and its volume [m³]: its `prop_motion`.

    Parameters
    ----------
    source : SoleSource
        Names the object.
    matrices : (F, 4, 4) float array
        Its frame to the world over time [m].

    Raises
    ------
    InputError
        If its mesh has no faces, or its scale is 0 or changes.
    """
    obj = object_named(source.object)
    vertices, triangles = surface_of(view_layer, obj)
    return prop_motion(vertices, triangles, matrices, owner=obj.name, name=source.name, side=source.side)
