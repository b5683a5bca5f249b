"""Fur for pictures: hair curves on a posed figure, which lie along its body and have the colours of its coat."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np

from sample_scenes import stage
from sample_scenes.stage import Array
from softground_addon.blender.nodes.shader_graph import Graph

COLOUR = "coat"
"""Attribute of hairs and skin."""
_POINTS = 4
"""Along a hair."""

Skin = Callable[[Array, Array, np.random.Generator], Array]
"""Something of the coat at places of the resting figure (N, 3) [m] with normals (N, 3), no two hairs alike."""


def add_fur(figure: bpy.types.Object, count: int, lie: Skin, colour: Skin, thickness: float, slot: int = 0) -> None:
    """Hairs on one material of a figure as it is posed now; the skin below gets their colours.

    Parameters
    ----------
    figure : bpy.types.Object
        A mesh that is only posed by its modifiers.
    count : int
    lie : Skin
        Hairs from root to tip (N, 3) [m].
    colour : Skin
        Linear colours (N, 3).
    thickness : float
        Of a hair at its root [m].
    slot : int
        Of the material.
    """
    chance = np.random.default_rng(count)
    mesh = figure.data
    rest, normals = _vectors(mesh.vertices, "co"), _vectors(mesh.vertex_normals, "vector")
    posed = figure.evaluated_get(bpy.context.evaluated_depsgraph_get())
    world = np.array(figure.matrix_world)
    now = _vectors(posed.data.vertices, "co") @ world[:3, :3].T + world[:3, 3]
    mesh.calc_loop_triangles()
    corners, of_slot = np.empty(3 * len(mesh.loop_triangles), np.int32), np.empty(len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("vertices", corners)
    mesh.loop_triangles.foreach_get("material_index", of_slot)
    triangles = corners.reshape(-1, 3)[of_slot == slot]

    frames = [_frames(places[triangles]) for places in (rest, now)]
    area = np.linalg.norm(frames[0][:, :, 2], axis=1) ** 2
    chosen = chance.choice(len(triangles), count, p=area / area.sum())
    share = chance.dirichlet((1.0, 1.0, 1.0), count)[:, :, None]
    place, normal = ((values[triangles[chosen]] * share).sum(axis=1) for values in (rest, normals))
    root = (now[triangles[chosen]] * share).sum(axis=1)
    turned = frames[1][chosen] @ np.linalg.inv(frames[0][chosen])
    hair = np.einsum("nij,nj->ni", turned, lie(place, normal, chance))
    outward = np.cross(*(now[triangles[chosen]][:, 1:] - now[triangles[chosen]][:, :1]).transpose(1, 0, 2))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    along = np.linspace(0.0, 1.0, _POINTS)[:, None]
    bow = 0.25 * np.linalg.norm(hair, axis=1)[:, None, None] * outward[:, None] * (along - along**2)
    look = _look()
    _add_hairs(root[:, None] + along * hair[:, None] + bow, colour(place, normal, chance), thickness, look)

    skin = mesh.attributes.new(COLOUR, "FLOAT_COLOR", "POINT")
    skin.data.foreach_set("color", _opaque(colour(rest, normals, chance)))
    figure.material_slots[slot].link = "OBJECT"
    figure.material_slots[slot].material = look


def _vectors(items: bpy.types.bpy_prop_collection, name: str) -> Array:
    values = np.empty(3 * len(items), np.float32)
    items.foreach_get(name, values)
    return values.reshape(-1, 3).astype(float)


def _frames(corners: Array) -> Array:
    """Two edges of triangles (T, 3, 3) and a normal as long as the root of their area, as columns."""
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(first, second)
    normal /= np.sqrt(np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-18))
    return np.stack([first, second, normal], axis=-1)


def _opaque(colours: Array) -> Array:
    return np.column_stack([colours, np.ones(len(colours))]).astype(np.float32).ravel()


def _add_hairs(places: Array, colours: Array, thickness: float, look: bpy.types.Material) -> None:
    """Curves through places (N, K, 3), pointed at the end."""
    curves = bpy.data.hair_curves.new("Fur")
    curves.add_curves([places.shape[1]] * len(places))
    curves.points.foreach_set("position", places.astype(np.float32).ravel())
    thin = np.tile(0.5 * thickness * np.linspace(1.0, 0.15, places.shape[1]), len(places)).astype(np.float32)
    curves.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", thin)
    curves.attributes.new(COLOUR, "FLOAT_COLOR", "CURVE").data.foreach_set("color", _opaque(colours))
    curves.materials.append(look)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Fur", curves))


def _look() -> bpy.types.Material:
    material = stage.plain_material("SoftGround Sample fur", (0.5, 0.3, 0.1), 0.7)
    graph = Graph(material.node_tree)
    colour = graph.out(graph.node("ShaderNodeAttribute", attribute_name=COLOUR))
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    material.node_tree.links.new(colour.output, shader.inputs["Base Color"])
    return material
