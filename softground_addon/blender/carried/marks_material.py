"""The material of marks: where a sole has left enough, broken by its tread and by chance, wet or dry."""

from __future__ import annotations

from typing import Any

import bpy

from ...core.carried.ageing import AgedMark, aged
from ...core.ground.surfaces import Liquid, SurfaceRecord
from ...core.relief.tread import LENGTH, PADS
from ...core.weather import weather
from ..compat import shader_tree
from ..nodes.shader_graph import Graph, Socket
from . import marks_nodes as nodes

COVERED = 0.16
"""Part of the thickest film on a sole that covers a floor under the parts of the sole that press."""
LUGS, SLANT, GROOVES = 0.019, 0.6, (0.20, 0.30)
"""Pitch of the lugs of a shoe [m], how far they run back to the sides, and where in each a groove begins."""
WARP = 0.012
"""How far lumps bend the edges of lugs, over the size of the noise [m]."""
SMEAR = 0.4
"""How much of the floor a smear between lumps covers."""
WAIST, ARCH = (0.1, 0.3, 0.75, 0.95), 0.5
"""Between the zones of heel and arch, 0 and 1: where a shoe bears no more, not at all, not yet, and again; and how
much of the film the arch leaves."""
PAINT_SHADE = (0.55, 0.55, 0.55)
"""How much darker paint and blood are when they are dry."""
CLODS = 3e-3
"""Height of clods where a mark is thickest [m]."""
WET_SHADE = 0.55
"""Light that a wet floor gives back, over that of a dry one."""


def material_for(surface: SurfaceRecord | Liquid) -> bpy.types.Material:
    """A new material of marks of a surface."""
    material = bpy.data.materials.new(f"SoftGround {surface.label} Marks")
    material[nodes.MARK], material.diffuse_color = surface.name, (*surface.colour, 1.0)
    tree = shader_tree(material)
    tree.nodes.clear()
    graph = Graph(tree)
    now = now_by_clock(graph, surface)
    amount, edge = _amount(graph, surface, now.mass)
    wet = now.wetness
    if surface.melts:
        shader, height = _snow(graph, amount, edge, wet, now.melted)
    elif surface.name == "water":
        shader, height = _damp(graph, _thin(graph, amount, edge, wet)), wet * 0.0
    else:
        shader, height = _earth(graph, surface, amount, edge, wet)
    relief = graph.node("ShaderNodeDisplacement", {"Height": height, "Midlevel": 0.0, "Scale": 1.0})
    graph.node("ShaderNodeOutputMaterial", {"Surface": shader, "Displacement": graph.out(relief)})
    return material


def reads_clock(material: bpy.types.Material) -> bool:
    """True of a material that works out by itself how marks age."""
    tree = material.node_tree
    return tree is not None and any(getattr(node, "attribute_name", "") == nodes.CLOCK for node in tree.nodes)


def now_by_clock(graph: Graph, surface: SurfaceRecord | Liquid) -> AgedMark:
    """What marks have come to by the clock."""
    clock = graph.out(graph.node("ShaderNodeAttribute", attribute_name=nodes.CLOCK), 1)
    separate = graph.node("ShaderNodeSeparateXYZ", {0: clock})
    frame, drying, rain = (graph.out(separate, axis) for axis in range(3))
    warmth = graph.attribute(nodes.WARMTH) if surface.melts else None
    return aged(graph.attribute(nodes.MASS), frame - graph.attribute(nodes.BIRTH), surface, drying, rain, warmth)


def _amount(graph: Graph, surface: SurfaceRecord | Liquid, mass: Socket) -> tuple[Socket, Socket]:
    """How much lies at a place, over what covers a floor, and 1 under the sole, 0 beside it."""
    assert surface.carried is not None
    place = graph.out(graph.node("ShaderNodeNewGeometry"))
    sole = graph.node("ShaderNodeAttribute", attribute_name=nodes.SOLE)
    separate = graph.node("ShaderNodeSeparateXYZ", {0: graph.out(sole, 1)})
    along, across, distance = (graph.out(separate, axis) for axis in range(3))
    coarse, fine = graph.swing(place, 0.022, 4.0, 0.65), graph.swing(place, 0.004, 3.0, 0.6)
    aside = graph.math("ABSOLUTE", across, 0.0)
    phase = graph.math("FRACT", (along + aside * SLANT + coarse * WARP) * (1.0 / LUGS), 0.0)
    groove = graph.math("ABSOLUTE", phase + -0.5, 0.0)
    is_shod = graph.math("GREATER_THAN", graph.attribute(nodes.TREAD), 0.0)
    lug = graph.blend(is_shod, 0.8, graph.ramp(groove, *GROOVES, 1.0, 0.25))
    zone = graph.attribute(nodes.ZONE) + coarse * 0.3
    waist = graph.ramp(zone, *WAIST[:2], 1.0, 0.0) + graph.ramp(zone, *WAIST[2:])
    arch = graph.ramp(zone, *WAIST[2:], 1.0, ARCH) + graph.ramp(zone, 1.0, 1.5, 0.0, 1.0 - ARCH)
    full = mass * (1.0 / (COVERED * surface.carried.most)) * graph.blend(is_shod, 1.0, arch)
    patches = graph.ramp(graph.noise(place, 0.07, 2.0), 0.3, 0.7, 0.7, 1.25)
    amount = full * lug * patches + (coarse * 1.7 + fine * 0.9) * graph.ramp(full, 0.0, 0.5)
    ragged = distance + coarse * 0.010 + fine * 0.004
    edge = graph.ramp(ragged, -0.004, 0.001, 1.0, 0.0)
    edge = edge * graph.blend(is_shod, 1.0, waist)
    return amount, edge * _pads(graph, coarse * 0.006 + fine * 0.003)


def _pads(graph: Graph, uneven: Socket) -> Socket:
    """1 under heel, ball and toes of a bare foot, 0 under its arch and between its toes; 1 under other soles."""
    place = graph.out(graph.node("ShaderNodeAttribute", attribute_name=nodes.PAD), 1)
    separate = graph.node("ShaderNodeSeparateXYZ", {0: place})
    is_bare = graph.math("GREATER_THAN", graph.out(separate, 2), 0.0)
    level = graph.out(graph.node("ShaderNodeVectorMath", {0: place, 1: (1.0, 1.0, 0.0)}, operation="MULTIPLY"))
    inside = uneven
    for number, (ahead, left, half_length, half_breadth) in enumerate(PADS):
        offset = graph.node("ShaderNodeVectorMath", {0: level, 1: (ahead, left, 0.0)}, operation="SUBTRACT")
        size = {0: graph.out(offset), 1: (half_length, half_breadth, 1.0)}
        share = graph.node("ShaderNodeVectorMath", size, operation="DIVIDE")
        share = graph.out(graph.node("ShaderNodeVectorMath", {0: graph.out(share)}, operation="LENGTH"), 1)
        within = graph.math("SUBTRACT", 1.0, share) * (half_length * LENGTH) + uneven
        inside = graph.math("MAXIMUM", inside, within) if number else within
    return graph.blend(is_bare, 1.0, graph.ramp(inside, -0.001, 0.003))


def _earth(
    graph: Graph, surface: SurfaceRecord | Liquid, amount: Socket, edge: Socket, wet: Socket
) -> tuple[Socket, Socket]:
    """Mud or sand: wet it is dark and shines, dry it is pale and has flaked off where it was thin."""
    place = graph.out(graph.node("ShaderNodeNewGeometry"))
    flaked = graph.blend(wet, 0.12, 0.0)
    solid = graph.ramp(graph.math("SUBTRACT", amount, flaked), 0.18, 0.45) * edge
    smeared = graph.ramp(graph.math("SUBTRACT", amount, flaked), -0.25, 0.4) * edge * SMEAR
    alpha = graph.math("MAXIMUM", solid, smeared)
    uneven = graph.swing(place, 0.012, 3.0) * 0.5
    look: Any = surface.colour
    shade = PAINT_SHADE
    if isinstance(surface, SurfaceRecord):  # as the ground, trodden where it lies thick
        dark, light, trodden = surface.tones or (surface.colour,) * 3
        look = graph.mix(solid * 0.5, graph.mix(graph.ramp(uneven, -0.1, 0.1), dark, light), trodden)
        shade = weather.PALE
    colour = graph.mix(graph.math("MAXIMUM", wet + uneven, 0.0), graph.times(look, shade), look)
    clods = CLODS if isinstance(surface, SurfaceRecord) else 0.02 * CLODS
    height = solid * graph.ramp(amount, 0.1, 1.6) * (graph.noise(place, 0.009, 4.0, 0.6) * clods)
    inputs = {
        "Base Color": colour,
        "Roughness": graph.blend(wet, 0.92, 0.42) + uneven * 0.3,
        "Alpha": alpha,
    }
    return graph.out(graph.node("ShaderNodeBsdfPrincipled", inputs)), height


def _snow(graph: Graph, amount: Socket, edge: Socket, wet: Socket, melted: Socket) -> tuple[Socket, Socket]:
    """Snow, and what is left of it: water, which dries without a trace."""
    place = graph.out(graph.node("ShaderNodeNewGeometry"))
    alpha = graph.ramp(graph.math("SUBTRACT", amount, melted * 1.2), 0.05, 0.30) * edge
    inputs = {"Base Color": (0.87, 0.90, 0.94, 1.0), "Roughness": 0.7, "Alpha": alpha}
    lying = graph.out(graph.node("ShaderNodeBsdfPrincipled", inputs))
    thin = graph.ramp(amount, 0.05, 0.2) * edge * graph.ramp(melted, 0.0, 0.5) * graph.ramp(wet, 0.0, 0.4)
    whole = graph.node("ShaderNodeMixShader", {0: alpha, 1: _damp(graph, thin), 2: lying})
    return graph.out(whole), alpha * (graph.noise(place, 0.008, 4.0, 0.6) * (0.4 * CLODS))


def _thin(graph: Graph, amount: Socket, edge: Socket, wet: Socket) -> Socket:
    """How much of a film of water covers a place: it dries from its thin places on."""
    dried = graph.blend(wet, 1.6, 0.0)
    return graph.ramp(graph.math("SUBTRACT", amount, dried), 0.0, 0.12) * edge * graph.ramp(wet, 0.0, 0.25)


def _damp(graph: Graph, thin: Socket) -> Socket:
    """The floor, where a film of water covers it as much as that."""
    is_shadow = graph.out(graph.node("ShaderNodeLightPath"), 1)  # the floor below is lit
    thin = thin * graph.math("SUBTRACT", 1.0, is_shadow)
    return graph.out(graph.node("ShaderNodeMixShader", {0: thin, 1: _clear(graph, 1.0), 2: _water(graph)}))


def _water(graph: Graph) -> Socket:
    """A film of water: the floor is darker through it, and it mirrors."""
    aside = graph.out(graph.node("ShaderNodeLayerWeight", {"Blend": 0.5}), 1)
    facing = graph.ramp(aside, 0.4, 1.0, 0.03, 0.6)  # as Fresnel's, from below too
    mirror = graph.out(graph.node("ShaderNodeBsdfAnisotropic", {"Roughness": 0.08}))
    return graph.out(graph.node("ShaderNodeMixShader", {0: facing, 1: _clear(graph, WET_SHADE), 2: mirror}))


def _clear(graph: Graph, shade: float) -> Socket:
    return graph.out(graph.node("ShaderNodeBsdfTransparent", {"Color": (shade, shade, shade, 1.0)}))
