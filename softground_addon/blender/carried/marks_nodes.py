"""The node group that plays marks: those to come are hidden, those that lie there dry, and snow melts.

It is native Blender data and needs nothing of this add-on; the law is that of `core.carried.ageing`.
"""

from __future__ import annotations

from typing import Any

from ...core.carried.ageing import aged
from ...core.ground.surfaces import Liquid, SurfaceRecord
from ..nodes.node_graph import NodeGraph
from ..nodes.node_modifiers import GroupInput, new_group

GROUP = "SoftGround Marks"
VERSION = 3
"""Of the laws that it plays; another bake replaces a group of an earlier one."""
MARK = "softground_marks"
"""Custom property of the group, of its object and of the material."""

BIRTH, MASS, KIND, WETNESS, SOLE, STEP = "birth", "mass", "kind", "wetness", "sole", "step"
"""Of a vertex: frame from which it is there, mass [kg/m²], number among `surfaces.CARRIED_KINDS`, wet look from 1 to 0,
place along and across the sole and distance to its outline [m], number of the contact."""
TREAD = "tread"
"""Depth of the grooves of the sole [m], 0 of bare feet."""
PAD = "pad"
"""Of bare feet alone, a vector; see `core.carried.marks.Marks`."""
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
    mass, passed = graph.number(graph.attribute(MASS)), age * sliders["Time Scale"]
    now = aged(mass, passed, surface, sliders["Drying"], sliders["Rain"], sliders.get("Temperature"))
    melted = {MELTED: now.melted} if surface.melts else {}
    for name, value in (melted | {WETNESS: now.wetness, MASS: now.mass}).items():
        geometry = graph.store(geometry, name, value.socket, True)
    graph.finish(geometry)
    return graph.tree
