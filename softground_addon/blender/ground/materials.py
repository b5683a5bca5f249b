"""Render materials of the grounds, built from nodes: what the mesh attributes of a bake say is what one sees.

Textures are laid out in world space, so that grains keep their size on any ground. All relief is in metres.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, cast

import bpy
import numpy as np

from ...core.errors import InputError
from ..shader_graph import Colour, Graph, Socket
from .own_data import COMPRESSION, RIM, SOLE, WATER
from .weather_look import bare, under_weather
from .weather_nodes import FRESH

TREAD_PITCH = 0.017
"""From bar to bar of a tread [m]."""

MARK = "softground_surface"
"""Custom property of the add-on's own materials, with the surface that they show: no other material is touched."""

OVER = "softground_over"
"""Custom property of the add-on's copies of the user's materials, with the material that they are of."""

EDGE = "ground_edge"
"""Float attribute of a mesh that lets the add-on's materials fade out, as it goes from 0 to 1."""

BLEND = "surface_blend"
"""Float attribute of a mesh that says which of two surfaces is seen: the first at 0, the second at 1."""

WIDE = 5.0
"""Size of the largest shades and swells of open ground [m]; five octaves are in them."""

RIPPLE, RIPPLE_HEIGHT, LEE = 0.085, 0.0055, 0.68
"""From crest to crest of wind ripples, their height [m], and the part of a wave that faces the wind."""

RUN_TOGETHER = 0.05
"""Size of the patches of a print in which dry sand keeps a tread [m]."""


@dataclass(frozen=True)
class Ground:
    """What every surface is made from.

    Attributes
    ----------
    place : Socket
        World place [m].
    pressed, deep, risen : Socket
        From 0 to 1: whether a foot was here, whether it left a hollow, whether the ground stands up as a rim.
    tread : Socket
        Height of the bars that the tread of a shoe left in the print [m].
    normal : Socket
        Unit normal of the smooth ground, with the swells of open ground.
    """

    place: Socket
    pressed: Socket
    deep: Socket
    risen: Socket
    tread: Socket
    normal: Socket

    @property
    def edge(self) -> Socket:
        """1 halfway down the wall of a print, 0 inside and outside."""
        graph = self.pressed.graph
        return self.pressed * graph.math("SUBTRACT", 1.0, self.pressed) * 4.0


@dataclass(frozen=True)
class Look:
    """What a surface hands to the shader: its relief [m] and the inputs of the Principled BSDF."""

    relief: Socket
    inputs: Mapping[str, Any]


def ensure_material(surface: str) -> bpy.types.Material:
    """The add-on's material for a surface, made on first use and left as it is from then on.

    Parameters
    ----------
    surface : str
        One of `core.ground.presets.SURFACES`.

    Raises
    ------
    InputError
        If there is no such surface.
    """
    name = surface.replace("_", " ").title()
    return _material(surface, name, (surface,), lambda graph: _shaded(graph, _look(graph, surface, _ground(graph))))


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


def ensure_blend(surface: str, other: str) -> bpy.types.Material:
    """A material that passes from one surface to another where the attribute `BLEND` of the mesh goes from 0 to 1.

    Raises
    ------
    InputError
        If there is no such surface.
    """

    def build(graph: Graph) -> tuple[Socket, Socket]:
        ground = _ground(graph)
        shaders, reliefs = zip(*(_shaded(graph, _look(graph, name, ground)) for name in (surface, other)), strict=True)
        drift = graph.noise(ground.place, 0.35, 4.0, 0.6) * 0.5  # no border is drawn with a ruler
        factor = graph.ramp(graph.attribute(BLEND) + drift, 0.70, 0.80)
        mixed = graph.node("ShaderNodeMixShader", {0: factor, 1: shaders[0], 2: shaders[1]})
        return graph.out(mixed), graph.blend(factor, *reliefs)

    name = " to ".join(one.replace("_", " ").title() for one in (surface, other))
    return _material(f"{surface} {other}", name, (surface, other), build)


def ensure_over(theirs: bpy.types.Material, surface: str) -> bpy.types.Material:
    """A copy of a material of the user's that shows a surface where prints are, and on their rims.

    Raises
    ------
    InputError
        If there is no such surface.
    """
    mark = f"{surface} over"
    _looks(surface)  # or it is none
    for material in bpy.data.materials:
        if material.get(MARK) == mark and material.get(OVER) == theirs and material.library is None:
            return material
    material = theirs.copy()
    material.name, material[MARK], material[OVER] = f"{theirs.name} with {surface.title()} Prints", mark, theirs
    if material.node_tree is None or not material.use_nodes:
        material.use_nodes = True
    tree = cast("bpy.types.NodeTree", material.node_tree)
    output: Any = tree.get_output_node("ALL") or tree.nodes.new("ShaderNodeOutputMaterial")
    graph = Graph(tree)
    ground = _ground(graph)
    shader, height = _shaded(graph, _look(graph, surface, ground, is_open=False))
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


def _looks(surface: str) -> tuple[Callable[[Graph, Ground], Look], Colour]:
    if surface not in _SURFACES:
        raise InputError(f"There is no surface '{surface}': choose one of {', '.join(_SURFACES)}.")
    return _SURFACES[surface]


def _material(
    mark: str, name: str, surfaces: tuple[str, ...], build: Callable[[Graph], tuple[Socket, Socket]]
) -> bpy.types.Material:
    """The material of that mark, or a new one: its nodes from `build`, which gives its shader and its relief [m]."""
    preview = np.mean([_looks(surface)[1] for surface in surfaces], axis=0)
    for material in bpy.data.materials:
        if material.get(MARK) == mark and material.library is None:
            return material
    material = bpy.data.materials.new(f"SoftGround {name}")
    material[MARK] = mark
    material.diffuse_color = (*preview.tolist(), 1.0)
    if material.node_tree is None:  # 5.x makes the tree with the material and warns of the switch
        material.use_nodes = True
    tree = cast("bpy.types.NodeTree", material.node_tree)
    tree.nodes.clear()
    graph = Graph(tree)
    shader, height = build(graph)
    material.use_transparent_shadow = False  # a ground throws no shadow by its edge, and they take time
    # Shown as bump; the material's own setting turns it into true displacement of a subdivided ground.
    relief = graph.node("ShaderNodeDisplacement", {"Height": height, "Midlevel": 0.0, "Scale": 1.0})
    graph.node("ShaderNodeOutputMaterial", {"Surface": shader, "Displacement": graph.out(relief)})
    return material


def _look(graph: Graph, surface: str, ground: Ground, *, is_open: bool = True) -> Look:
    """What a surface hands to the shader, with what weather has made of it; open ground has shades and swells."""
    build, _ = _looks(surface)
    if not is_open:
        look = build(graph, ground)
        inputs, relief = under_weather(graph, surface, look.inputs, look.relief)
        return Look(relief, inputs)
    wide = graph.noise(ground.place, WIDE, 5.0, 0.65)
    dark, light, uneven = _WIDE[surface]
    # Swells are decimetres high. EEVEE makes bump of a displacement with an error that grows with its height and
    # the curvature of the mesh (stripes on the walls of prints); a bump node has none.
    normal = graph.out(graph.node("ShaderNodeBump", {"Height": wide, "Distance": uneven}))
    look = build(graph, replace(ground, normal=normal))
    shade = graph.ramp(wide, 0.30, 0.70, dark, light)
    colour = graph.node("ShaderNodeVectorMath", {0: look.inputs["Base Color"], "Scale": shade}, operation="SCALE")
    shaded = {"Normal": normal, "Coat Normal": normal, **look.inputs, "Base Color": graph.out(colour)}
    inputs, relief = under_weather(graph, surface, shaded, look.relief)
    return Look(relief, inputs)


def _ground(graph: Graph) -> Ground:
    shows = bare(graph)
    compression = graph.attribute(COMPRESSION) * shows
    pressed = graph.ramp(compression, 0.0004, 0.004)
    return Ground(
        place=graph.out(graph.node("ShaderNodeNewGeometry")),
        pressed=pressed,
        deep=graph.ramp(compression, 0.006, 0.020),
        risen=graph.ramp(graph.attribute(RIM) * shows, 0.0002, 0.005),
        tread=_tread(graph, pressed),
        normal=graph.normal(),
    )


def _tread(graph: Graph, pressed: Socket) -> Socket:
    """Ridges that bow across the print where the sole has grooves, beside a plain edge [m]; they come with the foot."""
    place = graph.node("ShaderNodeAttribute", attribute_name=SOLE)
    separate = graph.node("ShaderNodeSeparateXYZ", {0: graph.out(place, 1)})
    along, across, depth = (graph.out(separate, axis) for axis in range(3))
    aside = graph.math("ABSOLUTE", across, 0.0)
    phase = graph.math("FRACT", (along + aside * 0.35) * (1.0 / TREAD_PITCH), 0.0)
    ridge = graph.ramp(graph.math("ABSOLUTE", phase + -0.5, 0.0), 0.12, 0.24, 1.0, 0.0)
    return ridge * graph.ramp(aside, 0.030, 0.034, 1.0, 0.0) * depth * pressed


def _shaded(graph: Graph, look: Look) -> tuple[Socket, Socket]:
    """Shader and relief [m] of a look."""
    ragged = graph.noise(graph.out(graph.node("ShaderNodeNewGeometry")), 0.5, 4.0, 0.6) * 0.5
    shown = graph.ramp(graph.attribute(EDGE) + ragged, 0.55, 1.05, 1.0, 0.0)  # noise is around 0.5: all is shown at 0
    # Christensen-Burley is as good as a random walk over a centimetre of snow, at half the time.
    shader = graph.node("ShaderNodeBsdfPrincipled", {**look.inputs, "Alpha": shown}, subsurface_method="BURLEY")
    return graph.out(shader), look.relief


def _snow(graph: Graph, ground: Ground) -> Look:
    """Bright, light scattering below the surface, glints; pressed snow is smooth, dense and bluish, its edge breaks."""
    drifts = graph.noise(ground.place, 0.13, 2.0) * 0.012
    clumps = graph.noise(ground.place, 0.014, 3.0, 0.6) * graph.blend(ground.pressed, 0.0045, 0.0012)
    crystals = graph.noise(ground.place, 0.0030, 3.0, 0.65) * graph.blend(ground.pressed, 0.0018, 0.0008)
    broken = graph.noise(ground.place, 0.009, 3.0, 0.7) * ground.edge * 0.009

    glints = graph.cells(ground.place, 0.0016)
    random = graph.out(graph.node("ShaderNodeSeparateColor", {0: graph.out(glints, 1)}))
    tilt = graph.node("ShaderNodeVectorMath", {0: graph.out(glints, 1), 1: (0.5, 0.5, 0.0)}, operation="SUBTRACT")
    facet = graph.node("ShaderNodeVectorMath", {0: graph.out(tilt)}, operation="NORMALIZE")
    return Look(
        drifts + clumps + crystals + broken + ground.tread,
        {
            "Base Color": graph.mix(ground.pressed, (0.915, 0.935, 0.96), (0.80, 0.875, 0.955)),
            "Roughness": graph.blend(ground.pressed, 0.70, 0.45),
            "Subsurface Weight": 0.65,
            "Subsurface Radius": (0.5, 0.8, 1.0),
            "Subsurface Scale": 0.007,
            "Coat Weight": graph.ramp(random, 0.90, 0.91) * graph.blend(ground.pressed, 1.0, 0.2),
            "Coat Roughness": 0.10,
            "Coat Normal": graph.out(facet),
        },
    )


def _grains(graph: Graph, ground: Ground) -> tuple[Socket, Socket]:
    """Relief [m] and tint (0-1) of sand: fine grains over soft undulations; a foot leaves it even, its rim loose."""
    grain = graph.cells(ground.place, 0.0011)
    tint = graph.out(graph.node("ShaderNodeSeparateColor", {0: graph.out(grain, 1)}))
    relief = graph.noise(ground.place, 0.16, 1.0) * 0.012
    relief = relief + graph.noise(ground.place, 0.0022, 2.0, 0.7) * graph.blend(ground.pressed, 0.0010, 0.0008)
    relief = relief + graph.noise(ground.place, 0.024, 3.0, 0.6) * graph.blend(ground.pressed, 0.0034, 0.0012)
    loose = graph.noise(ground.place, 0.011, 3.0, 0.65) * graph.math("MAXIMUM", ground.risen, ground.edge)
    return relief + loose * 0.0040 + ground.tread * 0.5, tint


def _ripples(graph: Graph, ground: Ground) -> Socket:
    """Wind ripples [m] with a steep side in the lee, in patches, until a foot or its rim buries them."""
    wind = graph.node("ShaderNodeVectorMath", {0: ground.place, 1: (0.90, 0.44, 0.0)}, operation="DOT_PRODUCT")
    along = graph.out(wind, 1) * (1.0 / RIPPLE) + graph.noise(ground.place, 0.35, 2.0, 0.5) * 3.5
    phase = graph.math("FRACT", along, 0.0)
    wave = graph.ramp(phase, 0.0, LEE) * graph.ramp(phase, LEE, 1.0, 1.0, 0.0)
    there = graph.ramp(graph.noise(ground.place, 2.5, 2.0), 0.38, 0.58, 0.25, 1.0)
    left = graph.math("SUBTRACT", 1.0, graph.math("MAXIMUM", ground.pressed, ground.risen))
    return wave * there * left * RIPPLE_HEIGHT


def _dry_sand(graph: Graph, ground: Ground) -> Look:
    """Fine grains of several colours; nothing shines. Sand runs together over most of a tread."""
    left = graph.ramp(graph.noise(ground.place, RUN_TOGETHER, 2.0, 0.6), 0.46, 0.66)
    relief, tint = _grains(graph, replace(ground, tread=ground.tread * left))
    relief = relief + _ripples(graph, ground)
    patches = graph.noise(ground.place, 0.25, 3.0)
    colour = graph.mix(graph.ramp(tint, 0.0, 1.0), (0.50, 0.30, 0.13), (0.86, 0.62, 0.36))
    colour = graph.mix(graph.ramp(patches, 0.35, 0.75, 0.0, 0.35), colour, (0.60, 0.37, 0.18))
    colour = graph.mix(ground.pressed * 0.35, colour, (0.40, 0.24, 0.11))
    return Look(relief, {"Base Color": colour, "Roughness": 0.92, "Specular IOR Level": 0.2})


def _wet_sand(graph: Graph, ground: Ground) -> Look:
    """Dark and firm; the rims dry first, and the hollows hold the water that shines."""
    relief, tint = _grains(graph, ground)
    colour = graph.mix(graph.ramp(tint, 0.0, 1.0), (0.16, 0.095, 0.045), (0.30, 0.20, 0.115))
    colour = graph.mix(ground.risen * 0.6, colour, (0.42, 0.29, 0.16))
    colour = graph.mix(ground.pressed * 0.5, colour, (0.12, 0.072, 0.036))
    return Look(
        relief,
        {
            "Base Color": colour,
            "Roughness": graph.blend(ground.pressed, 0.62, 0.36),
            "Specular IOR Level": 0.5,
            "Coat Weight": ground.deep * 0.6,
            "Coat Roughness": 0.12,
            "Coat IOR": 1.33,
        },
    )


def _mud(graph: Graph, ground: Ground) -> Look:
    """Dark, smooth and sticky; damp in patches, its rims in lumps; in the hollow of a print a film of water shines."""
    lumps = graph.noise(ground.place, 0.06, 2.0, 0.45)
    bits = graph.noise(ground.place, 0.008, 3.0, 0.6)
    squeezed = graph.noise(ground.place, 0.020, 2.0, 0.5) * graph.math("MAXIMUM", ground.risen, ground.edge)
    relief = lumps * graph.blend(ground.pressed, 0.008, 0.003) + bits * graph.blend(ground.pressed, 0.0020, 0.0006)
    water = graph.ramp(graph.attribute(WATER), 0.0, 0.004) * ground.deep
    dry = graph.math("SUBTRACT", 1.0, water)
    relief = (relief + squeezed * 0.008 + ground.tread) * dry
    damp = graph.ramp(graph.noise(ground.place, 0.11, 2.0), 0.36, 0.62, 0.10, 0.65)
    wet = graph.math("MAXIMUM", ground.pressed, damp)
    colour = graph.mix(graph.ramp(lumps, 0.3, 0.7), (0.128, 0.076, 0.041), (0.205, 0.130, 0.076))
    colour = graph.mix(wet, colour, (0.080, 0.045, 0.023))
    colour = graph.mix(water * 0.93, colour, (0.150, 0.100, 0.060))
    level = graph.node("ShaderNodeMix", {"Factor_Float": water, "A_Vector": ground.normal, "B_Vector": UP}, **_VECTOR)
    return Look(
        relief,
        {
            "Base Color": colour,
            "Roughness": graph.blend(wet, 0.76, 0.42),
            "Specular IOR Level": 0.5,
            "Coat Weight": ground.deep,
            "Coat Roughness": graph.blend(water, 0.08, 0.025),
            "Coat IOR": 1.33,
            "Coat Normal": graph.out(level, 1),
        },
    )


UP = (0.0, 0.0, 1.0)
"""Where the surface of water faces."""
_VECTOR = {"data_type": "VECTOR"}


def _soil(graph: Graph, ground: Ground) -> Look:
    """Dull crumbs of all sizes; crushed even and dark under the foot, in clods on the rim, which dries lightest."""
    trodden = graph.ramp(graph.noise(ground.place, 0.4, 3.0, 0.6), 0.35, 0.62, 0.25, 1.0)  # no gravel to the horizon
    loose = graph.ramp(ground.pressed, 0.0, 1.0, 1.0, 0.10) * graph.math("MAXIMUM", trodden, ground.risen)
    stirred = graph.noise(ground.place, 0.010, 3.0, 0.6) * 0.007
    stirred = graph.node("ShaderNodeVectorMath", {0: ground.place, 1: stirred}, operation="ADD")
    wavy = graph.out(stirred)  # crumbs are no honeycomb
    large, middle, small = (_lumps(graph, wavy, size) for size in (0.030, 0.014, 0.007))
    dust = graph.noise(ground.place, 0.0035, 3.0, 0.7)
    clods = graph.ramp(graph.noise(ground.place, 0.06, 2.0), 0.50, 0.66)
    crumbs = large * graph.blend(clods, 0.004, 0.020) + middle * graph.blend(ground.risen, 0.0085, 0.014)
    crumbs = crumbs + small * graph.blend(ground.risen, 0.0045, 0.0065)
    relief = crumbs * loose + dust * graph.blend(ground.pressed, 0.0018, 0.0012)
    relief = relief + graph.noise(ground.place, 0.012, 3.0, 0.7) * ground.edge * 0.008 + ground.tread
    tint = graph.ramp(graph.noise(ground.place, 0.016, 4.0, 0.7), 0.30, 0.75)
    colour = graph.mix(tint, (0.072, 0.042, 0.026), (0.195, 0.122, 0.077))
    colour = graph.mix(graph.math("MAXIMUM", middle, small) * 0.20, colour, (0.24, 0.15, 0.095))
    gaps = graph.ramp(large + middle + small, 0.0, 0.30, 0.55, 0.0) * loose  # bump throws no shadows
    colour = graph.mix(gaps, colour, (0.034, 0.020, 0.013))
    colour = graph.mix(ground.risen * middle * 0.6, colour, (0.28, 0.18, 0.115))
    colour = graph.mix(ground.pressed * 0.7, colour, (0.060, 0.036, 0.022))
    return Look(relief, {"Base Color": colour, "Roughness": 0.95, "Specular IOR Level": 0.15})


def _lumps(graph: Graph, place: Socket, size: float) -> Socket:
    """Rounded lumps of about a size [m] between 0 and 1 high, most of them low."""
    cells = graph.cells(place, size)
    random = graph.out(graph.node("ShaderNodeSeparateColor", {0: graph.out(cells, 1)}))
    return graph.ramp(graph.out(cells), 0.15, 0.70, 1.0, 0.0) * graph.math("POWER", random, 2.0)


_WIDE: dict[str, tuple[float, float, float]] = {
    "snow": (0.92, 1.0, 0.50),
    "sand": (0.84, 1.10, 0.20),
    "wet_sand": (0.74, 1.18, 0.14),
    "mud": (0.70, 1.25, 0.16),
    "soil": (0.70, 1.25, 0.16),
}
"""Brightness of the darkest and the lightest parts of open ground, and the height of its swells [m]."""

_SURFACES: dict[str, tuple[Callable[[Graph, Ground], Look], Colour]] = {
    "snow": (_snow, (0.85, 0.89, 0.95)),
    "sand": (_dry_sand, (0.66, 0.48, 0.29)),
    "wet_sand": (_wet_sand, (0.24, 0.16, 0.09)),
    "mud": (_mud, (0.07, 0.04, 0.02)),
    "soil": (_soil, (0.12, 0.07, 0.04)),
}
"""What builds each surface, and its colour in Prop shading."""
