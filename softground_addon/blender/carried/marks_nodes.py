"""The node group that plays marks: those to come are hidden, those that lie there dry, and snow melts.

It is native Blender data and needs nothing of this add-on; the law is that of `core.carried.ageing`. In renders and
files marks to come are deleted, and attributes say what those that lie there have come to. In the viewport, where that
would copy all of them at each frame, those to come shrink to a point, and the material alone works out their age, from
the clock and the sliders.
"""

from __future__ import annotations

from typing import Any

from ...core.carried.ageing import aged
from ...core.ground.surfaces import Liquid, SurfaceRecord
from ..nodes.node_graph import NodeGraph
from ..nodes.node_modifiers import GroupInput, new_group

GROUP = "SoftGround Marks"
VERSION = 4
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
NEVER = 2.0**20
"""Frames by which marks come later that no sole leaves as the steps are now."""
MELTED = "melted"
"""Share of snow that has melted, 0 to 1."""
CLOCK, WARMTH = "softground_clock", "softground_warmth"
"""Of faces, as there are fewer than vertices, the same for all: frame, drying and rain, and for snow the temperature,
each of the last three times the seconds by which marks age in a frame."""

SLIDERS = (
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
"""Only snow has a temperature."""
IN_VIEW = GroupInput(
    "Attributes in Viewport",
    False,
    "Delete marks to come and work out attributes in the viewport too, as for renders, Alembic and USD: slower, for "
    "materials that read wetness, and for Apply and exporters that take what the viewport shows, as OBJ",
    kind="Bool",
)
INPUTS = (*SLIDERS, IN_VIEW)


def build(surface: SurfaceRecord | Liquid, *, frame_rate: float) -> Any:
    """A new node group for marks of a surface, in a scene whose time counts so many frames per second."""
    assert surface.carried is not None
    inputs = [each for each in INPUTS if each.name != "Temperature" or surface.melts]
    graph = NodeGraph(new_group(GROUP, MARK, inputs))
    chosen = graph.node("NodeGroupInput").outputs
    geometry, sliders = chosen["Geometry"], {name: graph.number(chosen[name]) for name, *_ in inputs}
    frame, birth = graph.number(graph.frame()), graph.number(graph.attribute(BIRTH))
    is_to_come = graph.compare("GREATER_THAN", birth.socket, frame.socket)
    each = sliders["Time Scale"] * (1.0 / frame_rate)
    drying, rain = sliders["Drying"] * each, sliders["Rain"] * each
    warmth = sliders["Temperature"] * each if surface.melts else None

    shrunk = graph.put(geometry, is_to_come, graph.combined(0.0, 0.0, 0.0))
    clock = graph.combined(frame.socket, drying.socket, rain.socket)
    shrunk = graph.store(shrunk, CLOCK, clock, True, "FLOAT_VECTOR", "FACE")

    graph.next_row()
    now = aged(graph.number(graph.attribute(MASS)), frame - birth, surface, drying, rain, warmth)
    melted = {MELTED: now.melted} if surface.melts else {}
    cut = graph.without(geometry, is_to_come)
    for name, value in (melted | {WETNESS: now.wetness, MASS: now.mass}).items():
        cut = graph.store(cut, name, value.socket, True)
    clock = graph.combined(frame.socket, (drying - rain).at_least(0.0).socket)  # what it rained is taken off the mass
    cut = graph.store(cut, CLOCK, clock, True, "FLOAT_VECTOR", "FACE")

    is_view = graph.node("GeometryNodeIsViewport").outputs["Is Viewport"]
    is_view = graph.both(is_view, graph.logic("NOT", chosen[IN_VIEW.name]))
    geometry = graph.choose("GEOMETRY", is_view, cut, shrunk)
    graph.finish(graph.store(geometry, WARMTH, warmth.socket, True, domain="FACE") if warmth else geometry)
    return graph.tree
