"""What pieces look like: a small collection for each surface, which an artist may replace by one of their own."""

from __future__ import annotations

from typing import Any

import bpy

from ...core.ground.crumbs import lumps
from .debris_nodes import MARK

COLOURS = {
    "snow": (0.87, 0.90, 0.94, 1.0),
    "sand": (0.66, 0.48, 0.29, 1.0),
    "wet_sand": (0.24, 0.16, 0.09, 1.0),
    "mud": (0.10, 0.065, 0.04, 1.0),
    "soil": (0.16, 0.09, 0.045, 1.0),
}
"""Of pieces: the grain and the waves of a ground's look are too coarse for them."""
THROUGH = {"snow": 0.5, "sand": 0.15}
"""Share of light that pieces let through: they glow against the sun. Sand that lies turns dark by more of it."""
ANGULAR = ("soil",)
"""Surfaces whose pieces break along faces: clods, which smooth shading makes pebbles of."""
GLOSSY = ("wet_sand", "mud")
"""Surfaces whose pieces shine."""


def collection_of(surface: str) -> bpy.types.Collection:
    """A new collection of a surface's shapes, in no scene."""
    material = _material(surface)
    shapes = bpy.data.collections.new(f"SoftGround {surface.replace('_', ' ').title()} Pieces")
    shapes[MARK] = True
    for number, lump in enumerate(lumps(surface), 1):
        mesh = bpy.data.meshes.new(f"{shapes.name} {number}")
        mesh.from_pydata(lump.vertices.tolist(), [], lump.faces.tolist())
        if surface not in ANGULAR:
            mesh.shade_smooth()
        mesh.materials.append(material)
        shapes.objects.link(bpy.data.objects.new(mesh.name, mesh))
    return shapes


def material_of(shapes: bpy.types.Collection) -> bpy.types.Material:
    """The material of a collection from `collection_of`."""
    material = shapes.objects[0].active_material
    assert material is not None
    return material


def remove(shapes: bpy.types.Collection) -> None:
    """Take a collection from `collection_of` away with what is in it."""
    for obj in list(shapes.objects):
        mesh: Any = obj.data
        material: Any = obj.active_material
        bpy.data.objects.remove(obj)
        if mesh is not None and not mesh.users:
            bpy.data.meshes.remove(mesh)
        if material is not None and material.get(MARK) and not material.users:
            bpy.data.materials.remove(material)
    bpy.data.collections.remove(shapes)


def _material(surface: str) -> bpy.types.Material:
    """A plain material in the colour of a surface."""
    material: Any = bpy.data.materials.new(f"SoftGround {surface.replace('_', ' ').title()} Pieces")
    material[MARK] = True
    if material.node_tree is None:  # before 5.0
        material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    shader = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = material.diffuse_color = COLOURS[surface]
    shader.inputs["Roughness"].default_value = 0.3 if surface in GLOSSY else 0.9
    if surface in THROUGH:
        through, mixed = nodes.new("ShaderNodeBsdfTranslucent"), nodes.new("ShaderNodeMixShader")
        through.inputs["Color"].default_value = COLOURS[surface]
        mixed.inputs[0].default_value = THROUGH[surface]
        for number, one in enumerate((shader, through), 1):
            links.new(one.outputs[0], mixed.inputs[number])
        links.new(mixed.outputs[0], material.node_tree.get_output_node("ALL").inputs["Surface"])
        # EEVEE lets no light through closed pieces that lie in their own shadow, and draws that share of them dark.
        solid = nodes.new("ShaderNodeOutputMaterial")
        solid.target = "EEVEE"
        links.new(shader.outputs[0], solid.inputs["Surface"])
    return material
