"""Weather on the add-on's materials: new snow over all, rain dark, sun pale, and water level and smooth.

Where a mesh has no weather its attributes are 0, and every surface is as without it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...core.ground.surfaces import SurfaceRecord
from ...core.weather import weather
from ..nodes.shader_graph import Graph, Socket
from ..playback.weather_nodes import BLOWN, DRIED, FRESH, WATER, WETNESS
from .ground_place import ground_place

NEW_SNOW = (0.915, 0.935, 0.96)
PATCH = 0.4
"""Size of the largest patches in which wet ground dries, of five octaves [m]."""
DULL = 0.2
"""Specular level of dry grains."""
FULL = 0.004
"""Water that hides the grain of the ground [m]."""
FILM = 0.07
"""Size of the patches of wet ground that shine [m]."""


def bare(graph: Graph) -> Socket:
    """Share of the ground that neither new snow nor wind has covered, 1 to 0."""
    return graph.math("SUBTRACT", 1.0, graph.math("MAXIMUM", graph.attribute(FRESH), graph.attribute(BLOWN)))


def under_weather(
    graph: Graph, surface: SurfaceRecord, inputs: Mapping[str, Any], relief: Socket
) -> tuple[Any, Socket]:
    """A surface's shader inputs and relief [m] under weather."""
    shown, fresh = dict(inputs), graph.attribute(FRESH)
    if not surface.melts:
        shown["Base Color"], relief = _wet(graph, surface, shown, relief)
        shown["Base Color"] = graph.mix(fresh, shown["Base Color"], NEW_SNOW)
    shown["Roughness"] = graph.blend(fresh, shown["Roughness"], 0.70)
    return shown, relief


def _wet(graph: Graph, surface: SurfaceRecord, shown: dict[str, Any], relief: Socket) -> tuple[Any, Socket]:
    """Colour and relief of wet or dried ground; its gloss is set."""
    colour = shown["Base Color"]
    if surface.wet:
        late = graph.ramp(graph.noise(ground_place(graph), PATCH, 5.0, 0.6), 0.35, 0.65)
        # Water never lies even: some of it is pale while the rest is still dark. Wet and dry all of it is.
        dried = graph.ramp(graph.attribute(DRIED) * 2.0 + late * -1.0, 0.0, 1.0)
        pale = graph.times(colour, weather.PALE)
        shown["Roughness"] = graph.blend(dried, shown["Roughness"], 0.95)
        shown["Specular IOR Level"] = graph.blend(dried, shown.get("Specular IOR Level", 0.5), DULL)
        if "Coat Weight" in shown:
            shown["Coat Weight"] = shown["Coat Weight"] * graph.math("SUBTRACT", 1.0, dried)
        return graph.mix(dried, colour, pale), relief
    wet, water = graph.attribute(WETNESS), graph.ramp(graph.attribute(WATER), 0.0, FULL)
    dark = graph.times(colour, weather.SOAKED)
    # Water films shine in patches only: where all is glossy, a low sun makes concrete of it.
    film = graph.ramp(graph.noise(ground_place(graph), FILM, 3.0), 0.45, 0.80)
    gloss = graph.blend(wet, shown["Roughness"], graph.blend(film, 0.75, 0.50))
    shown["Roughness"] = graph.blend(water, gloss, 0.04)
    mirror = graph.blend(wet, shown.get("Specular IOR Level", 0.5), graph.blend(film, 0.20, 0.4))
    shown["Specular IOR Level"] = graph.blend(water, mirror, 0.5)
    return graph.mix(wet, colour, dark), relief * graph.math("SUBTRACT", 1.0, water)
