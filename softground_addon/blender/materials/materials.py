"""Render materials of the grounds, built from nodes: what the mesh attributes of a bake say is what one sees.

Textures are laid out in world space, so that grains keep their size on any ground. All relief is in metres.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import bpy
import numpy as np

from ...core.ground import surfaces
from ...core.ground.surfaces import SurfaceRecord
from ..compat import shader_tree
from ..drafts import none_left_if_it_fails
from ..ground_slots import MARK, OVER
from ..nodes.shader_graph import Graph, Socket
from ..playback.own_data import COMPRESSION, LAYER, RIM, SOLE
from ..playback.weather_nodes import FRESH
from . import surface_shaders
from .ground_place import ground_place
from .surface_shaders import Ground, Look
from .weather_look import bare, under_weather

TREAD_PITCH = 0.017
"""From bar to bar of a tread [m]."""

EDGE = "ground_edge"
"""Float attribute of a mesh that lets the add-on's materials fade out, as it goes from 0 to 1."""

WIDE = 5.0
"""Size of the largest shades and swells of open ground [m]; five octaves are in them."""


UNCOVERED = (0.5, 0.8)
"""Compression from which on what lies below a layer shows here and there, and everywhere, over the layer's depth."""
RAGGED, CRUMBS = 0.5, 0.03
"""How far that varies from place to place, and the size of the largest of these [m]: snow is torn off in crumbs."""
THINNEST = 1e-6
"""Layer from which on there is one [m]."""

SOLID_LUMINANCE = 0.15
"""Least luminance of a ground in Solid shading: on darker ground no print is seen there."""


def solid_colour(surface: SurfaceRecord) -> tuple[float, float, float]:
    """Colour of a surface in Solid shading."""
    luminance = float(np.dot((0.2126, 0.7152, 0.0722), surface.colour))
    red, green, blue = np.multiply(surface.colour, max(1.0, SOLID_LUMINANCE / luminance)).tolist()
    return red, green, blue


@none_left_if_it_fails()
def ensure_material(surface: str) -> bpy.types.Material:
    """The add-on's material for a surface, made on first use and left as it is from then on."""
    of = surfaces.find(surface)
    for material in bpy.data.materials:
        if material.get(MARK) == surface and material.library is None:
            return material
    material = bpy.data.materials.new(f"SoftGround {of.label}")
    material[MARK], material.diffuse_color = surface, (*solid_colour(of), 1.0)
    tree = shader_tree(material)
    tree.nodes.clear()
    graph = Graph(tree)
    shader, height = shaded(graph, of, ground_of(graph))
    material.use_transparent_shadow = False  # a ground throws no shadow by its edge, and they take time
    # Shown as bump; the material's own setting turns it into true displacement of a subdivided ground.
    relief = graph.node("ShaderNodeDisplacement", {"Height": height, "Midlevel": 0.0, "Scale": 1.0})
    graph.node("ShaderNodeOutputMaterial", {"Surface": shader, "Displacement": graph.out(relief)})
    return material


@contextmanager
def drafted(surface: str) -> Iterator[None]:
    """The same; one that is made now and that nothing has come to use at the end is taken away."""
    known = {material.session_uid for material in bpy.data.materials}
    uid = ensure_material(surface).session_uid
    try:
        yield
    finally:
        for material in bpy.data.materials:
            if material.session_uid == uid and uid not in known and not material.users:
                bpy.data.materials.remove(material)
                break


@none_left_if_it_fails()
def ensure_over(theirs: bpy.types.Material, surface: str) -> bpy.types.Material:
    """A copy of a material of the user's that shows a surface where prints are, and on their rims."""
    of, mark = surfaces.find(surface), f"{surface} over"
    for material in bpy.data.materials:
        if material.get(MARK) == mark and material.get(OVER) == theirs and material.library is None:
            return material
    material = theirs.copy()
    material.name, material[MARK], material[OVER] = f"{theirs.name} with {of.label} Prints", mark, theirs
    tree = shader_tree(material)
    output: Any = tree.get_output_node("ALL") or tree.nodes.new("ShaderNodeOutputMaterial")
    graph = Graph(tree)
    ground = ground_of(graph)
    shader, height = shaded(graph, of, ground, is_open=False)
    share = graph.math("MAXIMUM", graph.math("MAXIMUM", ground.pressed, ground.risen), graph.attribute(FRESH))
    mixed = graph.node("ShaderNodeMixShader", {0: share, 2: shader})
    relief = graph.node("ShaderNodeDisplacement", {"Height": height * share, "Midlevel": 0.0, "Scale": 1.0})
    both = graph.node("ShaderNodeVectorMath", {0: graph.out(relief)}, operation="ADD")
    for name, ours in (("Surface", mixed), ("Displacement", both)):
        into = output.inputs[name]
        for link in list(into.links):
            tree.links.new(link.from_socket, ours.inputs[1])
        tree.links.new(ours.outputs[0], into)
    return material


def shaded(graph: Graph, surface: SurfaceRecord, ground: Ground, *, is_open: bool = True) -> tuple[Socket, Socket]:
    """Shader and relief [m] of a surface under weather; open ground has shades and swells."""
    inputs, relief = _look(graph, surface, ground, is_open=is_open)
    ragged = graph.noise(ground_place(graph), 0.5, 4.0, 0.6) * 0.5
    shown = graph.ramp(graph.attribute(EDGE) + ragged, 0.55, 1.05, 1.0, 0.0)  # noise is around 0.5: all is shown at 0
    # Christensen-Burley is as good as a random walk over a centimetre of snow, at half the time.
    shader = graph.node("ShaderNodeBsdfPrincipled", {**inputs, "Alpha": shown}, subsurface_method="BURLEY")
    return graph.out(shader), relief


def _look(graph: Graph, surface: SurfaceRecord, ground: Ground, *, is_open: bool) -> tuple[Any, Socket]:
    """Shader inputs and relief [m] of a surface under weather."""
    build: Callable[[Graph, Ground], Look] = getattr(surface_shaders, surface.shader)
    ground = replace(ground, tones=surface.tones)
    if not is_open:
        look = build(graph, ground)
        return under_weather(graph, surface, _with_under(graph, surface, look.inputs), look.relief)
    wide = graph.noise(ground.place, WIDE, 5.0, 0.65)
    # Swells are decimetres high. EEVEE makes bump of a displacement with an error that grows with its height and
    # the curvature of the mesh (stripes on the walls of prints); a bump node has none.
    normal = graph.out(graph.node("ShaderNodeBump", {"Height": wide, "Distance": surface.swell}))
    look = build(graph, replace(ground, normal=normal))
    shade = graph.ramp(wide, 0.30, 0.70, *surface.shades)
    colour = graph.node("ShaderNodeVectorMath", {0: look.inputs["Base Color"], "Scale": shade}, operation="SCALE")
    inputs = {"Normal": normal, "Coat Normal": normal, **look.inputs, "Base Color": graph.out(colour)}
    return under_weather(graph, surface, _with_under(graph, surface, inputs), look.relief)


def _with_under(graph: Graph, surface: SurfaceRecord, inputs: Mapping[str, Any]) -> Mapping[str, Any]:
    """Shader inputs of a surface, and of what lies below it where little of the layer is left; in crumbs between."""
    layer = graph.attribute(LAYER)
    is_thin = graph.math("GREATER_THAN", layer, THINNEST)
    crumbs = graph.noise(ground_place(graph), CRUMBS, 4.0, 0.7)
    pressed = graph.math("DIVIDE", graph.attribute(COMPRESSION), layer + THINNEST) * bare(graph) * is_thin
    share = graph.ramp(pressed + (crumbs + -0.5) * RAGGED, *UNCOVERED) * is_thin
    shade = graph.ramp(crumbs, 0.3, 0.7, 0.6, 1.4)
    below = graph.out(graph.node("ShaderNodeVectorMath", {0: surface.under, "Scale": shade}, operation="SCALE"))
    shown = {**inputs, "Base Color": graph.mix(share, inputs["Base Color"], below)}
    for name, value in (("Roughness", 0.85), ("Subsurface Weight", 0.0), ("Coat Weight", 0.0)):
        if name in inputs:
            shown[name] = graph.blend(share, inputs[name], value)
    return shown


def ground_of(graph: Graph) -> Ground:
    """The place that is shaded."""
    shows = bare(graph)
    geometry = graph.node("ShaderNodeNewGeometry")
    compression = graph.attribute(COMPRESSION) * shows
    pressed = graph.ramp(compression, 0.0004, 0.004)
    return Ground(
        place=ground_place(graph),
        pressed=pressed,
        deep=graph.ramp(compression, 0.006, 0.020),
        risen=graph.ramp(graph.attribute(RIM) * shows, 0.0002, 0.005),
        tread=_tread(graph, pressed),
        normal=graph.out(geometry, 1),
    )


def _tread(graph: Graph, pressed: Socket) -> Socket:
    """Ridges that bow across the print where the sole has grooves, beside a plain edge [m]; they come with the foot."""
    place = graph.node("ShaderNodeAttribute", attribute_name=SOLE)
    separate = graph.node("ShaderNodeSeparateXYZ", {0: graph.out(place, 1)})
    along, across, depth = (graph.out(separate, axis) for axis in range(3))
    aside = graph.math("ABSOLUTE", across, 0.0)
    phase = graph.math("FRACT", (along + aside * 0.35) * (1.0 / TREAD_PITCH), 0.0)
    ridge = graph.ramp(graph.math("ABSOLUTE", phase + -0.5, 0.0), 0.12, 0.24, 1.0, 0.0)
    return ridge * graph.ramp(aside, 0.030, 0.034, pressed, 0.0) * depth
