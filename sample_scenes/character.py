"""A person or a dog in Blender: an armature, one weighted mesh, simple materials."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import bmesh
import bpy
import numpy as np

from sample_scenes.body import Body
from sample_scenes.dog import Dog
from sample_scenes.dog_figure import hound
from sample_scenes.figure import PARTS, hiker
from sample_scenes.motion import Skeleton
from sample_scenes.stage import plain_material

TO_BLENDER = np.array(((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
"""Rotation from the body's frame (x forward) to Blender's custom (-Y forward, .L on +X)."""

_LOOKS = {
    "skin": ((0.52, 0.29, 0.20), 0.50),
    "jacket": ((0.42, 0.055, 0.035), 0.75),
    "trousers": ((0.055, 0.07, 0.095), 0.85),
    "cap": ((0.60, 0.34, 0.06), 0.90),
    "shoe": ((0.12, 0.065, 0.035), 0.55),
    "sole": ((0.34, 0.31, 0.26), 0.70),
    "coat": ((0.20, 0.11, 0.05), 0.85),
    "dark": ((0.012, 0.010, 0.009), 0.45),
}
"""Base colour (linear) and roughness of each part."""


def create_character(
    name: str, body: Body | Dog, collection: bpy.types.Collection, coarseness: float = 1.0
) -> bpy.types.Object:
    """A person or a dog in rest pose at the origin, facing -Y.

    Parameters
    ----------
    name : str
    body : Body or Dog
    collection : bpy.types.Collection
    coarseness : float
        How many times further apart the vertices of a person are than in the finest figure.

    Returns
    -------
    The armature object; its mesh child is named `name` + " Figure".
    """
    armature = create_armature(name, body, collection)
    figure = hound(body) if isinstance(body, Dog) else hiker(body, coarseness)
    mesh = bpy.data.meshes.new(f"{name} Figure")
    faces = [quad[:3] if quad[2] == quad[3] else quad for quad in figure.quads.tolist()]
    mesh.from_pydata((figure.vertices @ TO_BLENDER.T).tolist(), [], faces)
    used, slots = np.unique(figure.parts, return_inverse=True)
    for part in used:
        mesh.materials.append(_material(PARTS[part]))
    mesh.polygons.foreach_set("material_index", slots.astype(np.int32))
    mesh.polygons.foreach_set("use_smooth", np.ones(len(figure.parts), dtype=bool))
    mesh.update()

    skin = bpy.data.objects.new(mesh.name, mesh)
    collection.objects.link(skin)
    skin.parent = armature
    assign_weights(skin, list(body.bones), figure.weights)
    skin.modifiers.new("Armature", "ARMATURE").object = armature
    return armature


def create_armature(name: str, body: Skeleton, collection: bpy.types.Collection) -> bpy.types.Object:
    """The bones of a body in rest pose at the origin, facing -Y."""
    armature = bpy.data.objects.new(name, bpy.data.armatures.new(name))
    collection.objects.link(armature)
    view_layer = bpy.context.view_layer
    previous = view_layer.objects.active
    view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        edit_bones = armature.data.edit_bones
        for bone, (head, tail, parent) in body.bones.items():
            edit_bone = edit_bones.new(bone)
            edit_bone.head, edit_bone.tail = TO_BLENDER @ body.joints[head], TO_BLENDER @ body.joints[tail]
            if parent:
                edit_bone.parent = edit_bones[parent]
                edit_bone.use_connect = bool(np.allclose(body.joints[head], body.joints[body.bones[parent][1]]))
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")
        view_layer.objects.active = previous
    return armature


def copy_character(armature: bpy.types.Object, name: str, collection: bpy.types.Collection) -> bpy.types.Object:
    """A second object of the same character: armature data, action and mesh are shared."""
    twin = armature.copy()
    twin.name = name
    collection.objects.link(twin)
    for child in _meshes(armature):
        skin = child.copy()
        skin.name = f"{name} Figure"
        collection.objects.link(skin)
        skin.parent = twin
        for modifier in skin.modifiers:
            if modifier.type == "ARMATURE":
                modifier.object = twin
    return twin


def _meshes(armature: bpy.types.Object) -> Iterable[bpy.types.Object]:
    return [child for child in armature.children if child.type == "MESH"]


def assign_weights(skin: bpy.types.Object, bones: Sequence[str], weights: np.ndarray) -> None:
    """Write the weights (V, B), small ones dropped. Blender's call for it takes a hundred times longer than BMesh."""
    for bone in bones:
        skin.vertex_groups.new(name=bone)
    bound = np.where(weights < 0.01, 0.0, weights)
    bound /= bound.sum(axis=1, keepdims=True)
    mesh = bmesh.new()
    mesh.from_mesh(skin.data)
    groups = mesh.verts.layers.deform.verify()
    vertices = list(mesh.verts)
    rows, columns = bound.nonzero()
    for row, column, weight in zip(rows.tolist(), columns.tolist(), bound[rows, columns].tolist(), strict=True):
        vertices[row][groups][column] = weight
    mesh.to_mesh(skin.data)
    mesh.free()


def _material(part: str) -> bpy.types.Material:
    return plain_material(f"SoftGround Sample {part}", *_LOOKS[part])
