"""Grounds with a shape of their own: grids over a rectangle, with height and painted factors as functions of place."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import bpy
import numpy as np
from numpy.typing import NDArray

from softground_addon.blender.materials.materials import ensure_material

Array = NDArray[np.float64]
Field = Callable[[Array, Array], Array]
"""A number at places x, y [m] in the world."""


def add_terrain(
    name: str,
    x: Array,
    y: Array,
    height: Field,
    surface: str,
    collection: bpy.types.Collection,
    painted: Mapping[str, Field] | None = None,
) -> bpy.types.Object:
    """A mesh with a vertex at each place of a grid.

    Parameters
    ----------
    name : str
    x, y : (C,), (R,) float arrays
        Ascending [m].
    height : function of x and y
        [m].
    surface : str
        Its look; see `materials.ensure_material`.
    collection : bpy.types.Collection
    painted : mapping, optional
        Float attributes by name.
    """
    across, along = np.meshgrid(x, y)
    points = np.stack([across, along, height(across, along)], axis=-1).astype(np.float32).reshape(-1, 3)
    corner = (np.arange(len(y) - 1)[:, None] * len(x) + np.arange(len(x) - 1)).ravel()
    quads = corner[:, None] + [0, 1, len(x) + 1, len(x)]
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(points))
    mesh.attributes["position"].data.foreach_set("vector", points.ravel())
    mesh.loops.add(quads.size)
    mesh.loops.foreach_set("vertex_index", quads.ravel().astype(np.int32))
    mesh.polygons.add(len(quads))
    mesh.polygons.foreach_set("loop_start", np.arange(len(quads), dtype=np.int32) * 4)
    mesh.update(calc_edges=True)
    mesh.shade_smooth()
    mesh.materials.append(ensure_material(surface))
    for attribute, field in (painted or {}).items():
        values = field(across, along).astype(np.float32).ravel()
        mesh.attributes.new(attribute, "FLOAT", "POINT").data.foreach_set("value", values)
    ground = bpy.data.objects.new(name, mesh)
    collection.objects.link(ground)
    return ground


def flat(x: Array, y: Array) -> Array:
    """Level ground at height 0."""
    return np.zeros(np.broadcast(x, y).shape)


def spaced(low: float, high: float, spacing: float) -> Array:
    """Places from low to about high, a whole number of spacings apart [m]."""
    return low + spacing * np.arange(round((high - low) / spacing) + 1)
