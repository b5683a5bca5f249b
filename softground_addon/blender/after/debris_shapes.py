"""What pieces look like: a small collection for each surface, which an artist may replace by one of their own."""

from __future__ import annotations

from typing import Any

import bmesh
import bpy
import numpy as np

from .debris_nodes import MARK

COUNT = 4
"""Shapes of a surface."""
ROUGHNESS = {"snow": 0.35, "sand": 0.25, "wet_sand": 0.3, "mud": 0.15, "soil": 0.4}
"""How far their corners are from a sphere."""
STRETCH = {"snow": (1.0, 1.0, 0.6), "mud": (0.8, 0.8, 1.5)}
"""Broken crust is flat, drops of mud are long."""

UNTOUCHED = ("softground_age", -1.0)
"""As the ground's material knows what no foot has touched: it shows trodden ground darker."""


def collection_of(surface: str, material: bpy.types.Material | None) -> bpy.types.Collection:
    """A new collection of a surface's shapes, in no scene."""
    shapes = bpy.data.collections.new(f"SoftGround {surface.replace('_', ' ').title()} Pieces")
    shapes[MARK] = True
    for number in range(COUNT):
        mesh = _shape(f"{shapes.name} {number + 1}", surface, number)
        if material is not None:
            mesh.materials.append(material)
        shapes.objects.link(bpy.data.objects.new(mesh.name, mesh))
    return shapes


def remove(shapes: bpy.types.Collection) -> None:
    """Take a collection from `collection_of` away with what is in it."""
    for obj in list(shapes.objects):
        mesh: Any = obj.data
        bpy.data.objects.remove(obj)
        if mesh is not None and not mesh.users:
            bpy.data.meshes.remove(mesh)
    bpy.data.collections.remove(shapes)


def _shape(name: str, surface: str, number: int) -> bpy.types.Mesh:
    """A lump of radius 1 on average."""
    random = np.random.default_rng(number)
    mesh = bpy.data.meshes.new(name)
    lump = bmesh.new()
    bmesh.ops.create_icosphere(lump, subdivisions=1, radius=1.0)
    stretch = STRETCH.get(surface, (1.0, 1.0, 0.85))
    for vertex in lump.verts:
        size = 1.0 + ROUGHNESS[surface] * (2 * random.random() - 1)
        vertex.co = [vertex.co[axis] * size * stretch[axis] for axis in range(3)]
    lump.to_mesh(mesh)
    lump.free()
    age: Any = mesh.attributes.new(UNTOUCHED[0], "FLOAT", "POINT")
    age.data.foreach_set("value", np.full(len(mesh.vertices), UNTOUCHED[1], np.float32))
    return mesh
