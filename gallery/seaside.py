"""A shore in the evening: sky with clouds, water with foam, and sand that shines from the last wave."""

from __future__ import annotations

from math import cos, sin

import bpy

from softground_addon.blender.materials.materials import ensure_material
from softground_addon.blender.materials.surface_shaders import UP
from softground_addon.blender.nodes.shader_graph import Graph
from softground_addon.blender.playback.own_data import COMPRESSION

HORIZON, HALFWAY, ZENITH = (0.96, 0.60, 0.40), (0.62, 0.62, 0.68), (0.15, 0.28, 0.52)
"""Colours of the sky: at the horizon, at 8 degrees and from 30 degrees on."""
GLOW, CLOUD, LIT_CLOUD = (1.0, 0.55, 0.22), (0.42, 0.38, 0.46), (1.0, 0.58, 0.42)
"""Colours around the sun, of clouds away from it and of clouds near it."""


def add_sky(scene: bpy.types.Scene, toward: float, elevation: float, strength: float) -> None:
    """Blue above peach, with thin clouds, around a sun whose light goes `toward` and comes from so high [rad]."""
    tree = scene.world.node_tree
    tree.nodes.clear()
    graph = Graph(tree)
    way = graph.out(graph.node("ShaderNodeTexCoord"))
    way = graph.out(graph.node("ShaderNodeVectorMath", {0: way}, operation="NORMALIZE"))
    parts = graph.node("ShaderNodeSeparateXYZ", {0: way})
    x, y, up = (graph.out(parts, axis) for axis in range(3))
    up = graph.math("MAXIMUM", up, 0.0)
    colour = graph.mix(graph.ramp(up, -0.03, 0.14), HORIZON, HALFWAY)
    colour = graph.mix(graph.ramp(up, 0.05, 0.50), colour, ZENITH)
    sun = (-cos(elevation) * cos(toward), -cos(elevation) * sin(toward), sin(elevation))
    near = graph.out(graph.node("ShaderNodeVectorMath", {0: way, 1: sun}, operation="DOT_PRODUCT"), 1)
    near = graph.math("MAXIMUM", near, 0.0)
    far = graph.math("DIVIDE", 1.0, up + 0.06)  # on a flat layer overhead
    layer = graph.node("ShaderNodeCombineXYZ", {0: x * far, 1: y * far * 0.45})
    clouds = graph.noise(graph.out(layer), 1.6, 7.0, 0.58)
    cover = graph.ramp(clouds, 0.44, 0.66) * graph.ramp(up, 0.004, 0.06) * 0.85
    lit = graph.mix(graph.ramp(near, 0.4, 1.0), CLOUD, LIT_CLOUD)
    colour = graph.mix(cover, colour, lit)
    colour = graph.mix(graph.math("POWER", near, 14.0) * 0.7, colour, GLOW)
    bright = graph.math("POWER", near, 60.0) * 2.0 + graph.math("POWER", near, 8.0) * 0.5 + 1.0
    background = graph.node("ShaderNodeBackground", {"Color": colour, "Strength": bright * strength})
    graph.node("ShaderNodeOutputWorld", {"Surface": graph.out(background)})


def add_film(shore: float, reach: float) -> None:
    """Let wet sand mirror the sky where it still holds water: from x = `shore` on, over about a reach [m]."""
    material = ensure_material("wet_sand")
    tree = material.node_tree
    graph = Graph(tree)
    place = graph.out(graph.node("ShaderNodeNewGeometry"))
    x = graph.out(graph.node("ShaderNodeSeparateXYZ", {0: place}))
    ragged = graph.noise(place, 0.9, 5.0, 0.55) * reach
    wet = graph.ramp(x + ragged * -1.0, shore, shore + 0.6 * reach, 1.0, 0.0)
    pressed = graph.ramp(graph.attribute(COMPRESSION), 0.0004, 0.004)
    film = wet * graph.math("SUBTRACT", 1.0, pressed)
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    darker = graph.node("ShaderNodeVectorMath", {"Scale": graph.blend(wet, 1.0, 0.7)}, operation="SCALE")
    coat = graph.node("ShaderNodeMath", {1: film}, operation="MAXIMUM")
    level = graph.node("ShaderNodeMix", {"Factor_Float": film * 0.9, "B_Vector": UP}, data_type="VECTOR")
    for name, into, out in (
        ("Base Color", darker.inputs[0], darker.outputs[0]),
        ("Coat Weight", coat.inputs[0], coat.outputs[0]),
        ("Coat Normal", level.inputs[4], level.outputs[1]),
    ):
        tree.links.new(shader.inputs[name].links[0].from_socket, into)
        tree.links.new(out, shader.inputs[name])
