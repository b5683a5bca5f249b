"""Objects of one mesh and one plain material."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from numpy.typing import ArrayLike

from sample_scenes.motion import Array
from sample_scenes.stage import plain_material

Faces = Sequence[Sequence[int]]

Look = tuple[str, tuple[float, float, float], float]
"""Name, colour (linear) and roughness of a material."""

BOX: Faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
"""Faces of a box, outward."""


def box_corners(low: ArrayLike, high: ArrayLike) -> Array:
    """Corners (8, 3) of a box [m], in the order of `BOX`."""
    return np.stack(np.meshgrid(*np.stack([low, high], axis=-1), indexing="ij"), axis=-1).reshape(-1, 3)


def add_object(
    name: str, vertices: Array, faces: Faces, look: Look, collection: bpy.types.Collection, *, smooth: bool = False
) -> bpy.types.Object:
    """A mesh of vertices (V, 3) [m] as an object in a collection."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices.tolist(), [], faces)
    if smooth:
        mesh.polygons.foreach_set("use_smooth", np.ones(len(faces), dtype=bool))
    mesh.materials.append(plain_material(*look))
    thing = bpy.data.objects.new(name, mesh)
    collection.objects.link(thing)
    return thing
