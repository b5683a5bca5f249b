"""The node group that plays marks: those to come are hidden, those that lie there dry, and snow melts.

It is native Blender data and needs nothing of this add-on; the laws are those of `core.weather.weather`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.ground.surfaces import Liquid, SurfaceRecord
from ...core.weather import weather
from ..nodes.node_graph import NodeGraph
from ..nodes.node_modifiers import GroupInput, new_group

GROUP = "SoftGround Marks"
VERSION = 2
"""Of the laws that it plays; another bake replaces a group of an earlier one."""
MARK = "softground_marks"
"""Custom property of the group, of its object and of the material."""

BIRTH, MASS, KIND, WETNESS, SOLE, STEP = "birth", "mass", "kind", "wetness", "sole", "step"
"""Of a vertex: frame from which it is there, mass [kg/m²], number among `surfaces.CARRIED_KINDS`, wet look from 1 to 0,
place along and across the sole and distance to its outline [m], number of the contact."""
TREAD = "tread"
"""Depth of the grooves of the sole [m], 0 of bare feet."""
SHARE, ZONE = "share", "zone"
"""Share of the film on the sole that is left there, and zone of the sole: for steps that are edited."""
NOTHING = -1.0
"""Mass of a mark that no sole leaves as the steps are now."""
MELTED = "melted"
"""Share of snow that has melted, 0 to 1."""

INPUTS = (
    GroupInput(
        "Drying",
        0.2,
        "Water that the air takes up, in millimetres per hour: 0.2 is mild, 0.5 sunny and windy",
        (0.0, 50.0),
    ),
    GroupInput("Temperature", 10.0, "Temperature of the floor in °C: above 0, snow on it melts", (-60.0, 60.0)),
    GroupInput(
        "Rain", 0.0, "Rain in millimetres per hour: it keeps marks wet and washes them off, 90 % by 13 mm", (0.0, 200.0)
    ),
    GroupInput("Time Scale", 1.0, "How many times faster than the animation marks dry and melt", (0.0, 1e7)),
)
"""Sliders; only snow has a temperature."""
WASH_OFF = 0.18
"""Share that a millimetre of rain washes off paved ground, of what is there [1/mm]: 90 % by half an inch (J. D. Sartor
and G. B. Boyd, EPA-R2-72-081, 1972, as in the Storm Water Management Model)."""
MILLIMETRES_PER_HOUR = 1e-3 / weather.HOUR
"""In metres per second."""


def build(surface: SurfaceRecord | Liquid, *, frame_rate: float) -> Any:
    """A new node group for marks of a surface, in a scene whose time counts so many frames per second."""
    assert surface.carried is not None
    inputs = [each for each in INPUTS if each.name != "Temperature" or surface.melts]
    graph = NodeGraph(new_group(GROUP, MARK, inputs))
    chosen = graph.node("NodeGroupInput").outputs
    geometry, sliders = chosen["Geometry"], {name: graph.number(chosen[name]) for name, *_ in inputs}
    age = (graph.number(graph.frame()) - graph.number(graph.attribute(BIRTH))) / frame_rate
    is_none = graph.compare("LESS_THAN", graph.attribute(MASS), 0.0)
    geometry = graph.without(geometry, graph.either(graph.compare("LESS_THAN", age.socket, 0.0), is_none))
    passed = age * sliders["Time Scale"]
    water = graph.number(graph.attribute(MASS)) * (surface.carried.water / weather.WATER_DENSITY)
    if surface.melts:
        rate = weather.melting_rate(sliders["Temperature"])
        melted = (passed * rate / water).within_one()
        geometry = graph.store(geometry, MELTED, melted.socket, True)
        passed = np.maximum(passed - water / rate, 0.0) * rate.above(0.0)
    lost = passed * (sliders["Drying"] - sliders["Rain"]).at_least(0.0) * MILLIMETRES_PER_HOUR
    wet = weather.wetness(lost / water * weather.SURFACE_FILM)
    geometry = graph.store(geometry, WETNESS, wet.socket, True)
    fallen = age * sliders["Time Scale"] * sliders["Rain"] * (MILLIMETRES_PER_HOUR * 1e3)
    remains = graph.number(graph.attribute(MASS)) * (fallen * -WASH_OFF).exp()
    graph.finish(graph.store(geometry, MASS, remains.socket, True))
    return graph.tree
