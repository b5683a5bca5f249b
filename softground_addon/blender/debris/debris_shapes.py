"""Shapes of pieces: a small collection for each surface, which an artist may replace by one of their own."""

from __future__ import annotations

from typing import Any

import bpy

from ...core.ground.surfaces import SurfaceRecord
from ...core.meshing.crumbs import lumps
from ..compat import shader_tree
from .debris_nodes import MARK


def collection_of(surface: SurfaceRecord) -> bpy.types.Collection:
    """A new collection of a surface's shapes, in no scene."""
    material = _material(surface)
    shapes = bpy.data.collections.new(f"SoftGround {surface.label} Pieces")
    shapes[MARK] = surface.name
    for number, lump in enumerate(lumps(surface.name), 1):
        mesh = bpy.data.meshes.new(f"{shapes.name} {number}")
        mesh.from_pydata(lump.vertices.tolist(), [], lump.faces.tolist())
        if not surface.fragments.angular:
            mesh.shade_smooth()
        mesh.materials.append(material)
        shapes.objects.link(bpy.data.objects.new(mesh.name, mesh))
    return shapes


def material_of(shapes: bpy.types.Collection) -> bpy.types.Material | None:
    """The material of a collection from `collection_of`, as the artist has left it."""
    return next((obj.active_material for obj in shapes.objects), None)


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


def _material(surface: SurfaceRecord) -> bpy.types.Material:
    """A plain material in the colour of a surface."""
    material: Any = bpy.data.materials.new(f"SoftGround {surface.label} Pieces")
    material[MARK] = True
    tree, colour = shader_tree(material), (*surface.colour, 1.0)
    nodes, links = tree.nodes, tree.links
    shader = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = material.diffuse_color = colour
    shader.inputs["Roughness"].default_value = 0.3 if surface.wet else 0.9
    if surface.fragments.translucency:
        through, mixed = nodes.new("ShaderNodeBsdfTranslucent"), nodes.new("ShaderNodeMixShader")
        through.inputs["Color"].default_value = colour
        mixed.inputs[0].default_value = surface.fragments.translucency
        for number, shader_node in enumerate((shader, through), 1):
            links.new(shader_node.outputs[0], mixed.inputs[number])
        links.new(mixed.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
        # EEVEE lets no light through closed pieces that lie in their own shadow, and draws that share of them dark.
        solid = nodes.new("ShaderNodeOutputMaterial")
        solid.target = "EEVEE"
        links.new(shader.outputs[0], solid.inputs["Surface"])
    return material
