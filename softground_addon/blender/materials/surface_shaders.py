"""The look of each surface as nodes, by what mesh attributes say of its prints; its record names the function.

All relief is in metres.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from ..nodes.shader_graph import Graph, Socket
from ..playback.own_data import WATER

RIPPLE, RIPPLE_HEIGHT, LEE = 0.085, 0.0055, 0.68
"""From crest to crest of wind ripples, their height [m], and the part of a wave that faces the wind."""

RUN_TOGETHER = 0.05
"""Size of the patches of a print in which dry sand keeps a tread [m]."""


@dataclass(frozen=True)
class Ground:
    """A place of the ground, as every surface sees it.

    Attributes
    ----------
    place : Socket
        World place [m].
    pressed, deep, risen : Socket
        From 0 to 1: how far a foot was here, left a hollow, and the ground stands up as a rim.
    tread : Socket
        Height of the bars that the tread of a shoe left in the print [m].
    normal : Socket
        Unit normal of the smooth ground, with the swells of open ground.
    tones : tuple of colours
        Of its surface's record.
    """

    place: Socket
    pressed: Socket
    deep: Socket
    risen: Socket
    tread: Socket
    normal: Socket
    tones: tuple[tuple[float, float, float], ...] = ()

    @property
    def edge(self) -> Socket:
        """1 halfway down the wall of a print, 0 inside and outside."""
        graph = self.pressed.graph
        return self.pressed * graph.math("SUBTRACT", 1.0, self.pressed) * 4.0


@dataclass(frozen=True)
class Look:
    """Relief of a surface [m], and its inputs of the Principled BSDF."""

    relief: Socket
    inputs: Mapping[str, Any]


def snow(graph: Graph, ground: Ground) -> Look:
    """Bright, light scattering below the surface, glints; pressed snow is smooth, dense and bluish, its edge breaks.

    Walls break off and are as white as open snow: relief sets them beside what is pressed, whose border would cross
    them.
    """
    up = graph.out(graph.node("ShaderNodeSeparateXYZ", {0: ground.normal}), 2)
    pressed = graph.ramp(up, 0.5, 0.85, 0.0, ground.pressed)
    drifts = graph.noise(ground.place, 0.13, 2.0) * 0.012
    clumps = graph.swing(ground.place, 0.014, 3.0, 0.6) * graph.blend(pressed, 0.0045, 0.0012)
    crystals = graph.swing(ground.place, 0.0030, 3.0, 0.65) * graph.blend(pressed, 0.0018, 0.0008)
    broken = graph.swing(ground.place, 0.009, 3.0, 0.7) * ground.edge * 0.009

    glints = graph.cells(ground.place, 0.0016)
    random = graph.out(graph.node("ShaderNodeSeparateColor", {0: graph.out(glints, 1)}))
    tilted = {0: graph.out(glints, 1), 1: (1.0, 1.0, 0.0), 2: (-0.5, -0.5, 1.0)}
    tilt = graph.node("ShaderNodeVectorMath", tilted, operation="MULTIPLY_ADD")
    facet = graph.node("ShaderNodeVectorMath", {0: graph.out(tilt)}, operation="NORMALIZE")
    # A facet that mirrors the ground, or looks away, is a dark dot: only those that mirror the sky are seen.
    eye = graph.out(graph.node("ShaderNodeNewGeometry"), 4)
    light = graph.node("ShaderNodeVectorMath", {0: eye, 1: graph.out(facet)}, operation="REFLECT")
    down = graph.out(graph.node("ShaderNodeSeparateXYZ", {0: graph.out(light)}), 2)
    seen = graph.ramp(down, -0.2, 0.0, graph.ramp(random, 0.90, 0.91), 0.0)
    return Look(
        drifts + clumps + crystals + broken + ground.tread,
        {
            "Base Color": graph.mix(pressed, (0.915, 0.935, 0.96), (0.80, 0.875, 0.955)),
            "Roughness": graph.blend(pressed, 0.70, 0.45),
            "Subsurface Weight": 0.65,
            "Subsurface Radius": (0.5, 0.8, 1.0),
            "Subsurface Scale": 0.007,
            "Coat Weight": seen * graph.blend(pressed, 1.0, 0.2),
            "Coat Roughness": 0.10,
            "Coat Normal": graph.out(facet),
        },
    )


def _grains(graph: Graph, ground: Ground) -> tuple[Socket, Socket]:
    """Relief [m] and tint (0-1) of sand: fine grains over soft undulations; a foot leaves it even, its rim loose."""
    grain = graph.cells(ground.place, 0.0011)
    tint = graph.out(graph.node("ShaderNodeSeparateColor", {0: graph.out(grain, 1)}))
    relief = graph.noise(ground.place, 0.16, 1.0) * 0.012
    relief = relief + graph.swing(ground.place, 0.0022, 2.0, 0.7) * graph.blend(ground.pressed, 0.0010, 0.0008)
    relief = relief + graph.swing(ground.place, 0.024, 3.0, 0.6) * graph.blend(ground.pressed, 0.0034, 0.0012)
    loose = graph.swing(ground.place, 0.011, 3.0, 0.65) * graph.math("MAXIMUM", ground.risen, ground.edge)
    return relief + loose * 0.0040 + ground.tread * 0.5, tint


def _ripples(graph: Graph, ground: Ground) -> Socket:
    """Wind ripples [m] with a steep side in the lee, in patches, until a foot or its rim buries them."""
    wind = graph.node("ShaderNodeVectorMath", {0: ground.place, 1: (0.90, 0.44, 0.0)}, operation="DOT_PRODUCT")
    along = graph.out(wind, 1) * (1.0 / RIPPLE) + graph.noise(ground.place, 0.35, 2.0, 0.5) * 3.5
    phase = graph.math("FRACT", along, 0.0)
    wave = graph.ramp(phase, 0.0, LEE) * graph.ramp(phase, LEE, 1.0, 1.0, 0.0)
    patches = graph.ramp(graph.noise(ground.place, 2.5, 2.0), 0.38, 0.58, 0.25, 1.0)
    untouched = graph.math("SUBTRACT", 1.0, graph.math("MAXIMUM", ground.pressed, ground.risen))
    return wave * patches * untouched * RIPPLE_HEIGHT


def dry_sand(graph: Graph, ground: Ground) -> Look:
    """Fine grains of several colours; nothing shines. Sand runs together over most of a tread."""
    remaining = graph.ramp(graph.noise(ground.place, RUN_TOGETHER, 2.0, 0.6), 0.46, 0.66)
    relief, tint = _grains(graph, replace(ground, tread=ground.tread * remaining))
    relief = relief + _ripples(graph, ground)
    patches = graph.noise(ground.place, 0.25, 3.0)
    colour = graph.mix(graph.ramp(tint, 0.0, 1.0), (0.50, 0.30, 0.13), (0.86, 0.62, 0.36))
    colour = graph.mix(graph.ramp(patches, 0.35, 0.75, 0.0, 0.35), colour, (0.60, 0.37, 0.18))
    colour = graph.mix(ground.pressed * 0.35, colour, (0.40, 0.24, 0.11))
    return Look(relief, {"Base Color": colour, "Roughness": 0.92, "Specular IOR Level": 0.2})


def wet_sand(graph: Graph, ground: Ground) -> Look:
    """Dark and firm; the rims dry first, and the hollows hold the water that shines."""
    relief, tint = _grains(graph, ground)
    dark, light, trodden = ground.tones
    colour = graph.mix(graph.ramp(tint, 0.0, 1.0), dark, light)
    colour = graph.mix(ground.risen * 0.6, colour, (0.42, 0.29, 0.16))
    colour = graph.mix(ground.pressed * 0.5, colour, trodden)
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


def mud(graph: Graph, ground: Ground) -> Look:
    """Dark, smooth and sticky; damp in patches, its rims in lumps; in the hollow of a print a film of water shines."""
    lumps = graph.swing(ground.place, 0.06, 2.0, 0.45)
    bits = graph.swing(ground.place, 0.008, 3.0, 0.6)
    squeezed = graph.swing(ground.place, 0.020, 2.0, 0.5) * graph.math("MAXIMUM", ground.risen, ground.edge)
    relief = lumps * graph.blend(ground.pressed, 0.008, 0.003) + bits * graph.blend(ground.pressed, 0.0020, 0.0006)
    water = graph.ramp(graph.attribute(WATER), 0.0, 0.004) * ground.deep
    dry = graph.math("SUBTRACT", 1.0, water)
    relief = (relief + squeezed * 0.008 + ground.tread) * dry
    damp = graph.ramp(graph.noise(ground.place, 0.11, 2.0), 0.36, 0.62, 0.10, 0.65)
    wet = graph.math("MAXIMUM", ground.pressed, damp)
    dark, light, trodden = ground.tones
    colour = graph.mix(graph.ramp(lumps, -0.2, 0.2), dark, light)
    colour = graph.mix(wet, colour, trodden)
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


def soil(graph: Graph, ground: Ground) -> Look:
    """Dull crumbs of all sizes; crushed even and dark under the foot, in clods on the rim, which dries lightest."""
    trodden = graph.ramp(graph.noise(ground.place, 0.4, 3.0, 0.6), 0.35, 0.62, 0.25, 1.0)  # no gravel to the horizon
    loose = graph.ramp(ground.pressed, 0.0, 1.0, 1.0, 0.10) * graph.math("MAXIMUM", trodden, ground.risen)
    stirred = graph.noise(ground.place, 0.010, 3.0, 0.6) * 0.007
    stirred = graph.node("ShaderNodeVectorMath", {0: ground.place, 1: stirred}, operation="ADD")
    wavy = graph.out(stirred)  # crumbs are no honeycomb
    large, middle, small = (_lumps(graph, wavy, size) for size in (0.030, 0.014, 0.007))
    dust = graph.swing(ground.place, 0.0035, 3.0, 0.7)
    clods = graph.ramp(graph.noise(ground.place, 0.06, 2.0), 0.50, 0.66)
    crumbs = large * graph.blend(clods, 0.004, 0.020) + middle * graph.blend(ground.risen, 0.0085, 0.014)
    crumbs = crumbs + small * graph.blend(ground.risen, 0.0045, 0.0065)
    relief = crumbs * loose + dust * graph.blend(ground.pressed, 0.0018, 0.0012)
    relief = relief + graph.swing(ground.place, 0.012, 3.0, 0.7) * ground.edge * 0.008 + ground.tread
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
