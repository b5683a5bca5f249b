"""Inputs of the weather's node group, the sliders of its modifier: their sockets and values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import bpy

from ..nodes.node_graph import NodeGraph
from ..nodes.node_modifiers import GroupInput, new_group

GROUP = "SoftGround Weather"


MARK = "softground_weather"
"""Custom property of the group, whatever the user calls it."""


INPUTS = (
    GroupInput(
        "Snowfall", 0.0, "New snow in centimetres per hour. It settles, and rounds whatever it covers", (0.0, 100.0)
    ),
    GroupInput(
        "Temperature",
        0.0,
        "Air temperature in °C. Above 0, new snow melts first, then the ground's, trodden snow last",
        (-60.0, 40.0),
    ),
    GroupInput(
        "Wind",
        0.0,
        "Wind speed in metres per second, at 10 m. It blows sand into prints from about 5 on, snow from 6",
        (0.0, 60.0),
    ),
    GroupInput(
        "Rain",
        0.0,
        "Rain in millimetres per hour. It rounds edges; what does not soak in stands in prints",
        (0.0, 500.0),
    ),
    GroupInput(
        "Drying",
        0.0,
        "Water that the air takes up, in millimetres per hour: 0.2 is mild, 0.5 sunny and windy",
        (0.0, 50.0),
    ),
    GroupInput(
        "Water Table",
        100.0,
        "Water level in centimetres below the brim of each print, to which water seeps in",
        (0.0, 100.0),
    ),
    GroupInput("Halo", 0.0, "How pale wet sand turns around a loaded foot; it is wet again seconds later", (0.0, 1.0)),
    GroupInput(
        "Time Scale",
        1.0,
        "How many times faster than the animation the weather runs: 2880 shows 8 hours in 10 seconds",
        (0.0, 1e7),
    ),
)

PRESETS: Mapping[str, tuple[str, Mapping[str, float]]] = {
    "SNOWFALL": (
        "Snowfall",
        {"Snowfall": 3.0, "Temperature": -5.0, "Time Scale": 2880.0},
    ),
    "THAW": ("Thaw", {"Temperature": 3.0, "Time Scale": 20_000.0}),
    "WINDY_DUNES": ("Windy Dunes", {"Wind": 9.0, "Time Scale": 60.0}),
    "SHOWER": ("Shower", {"Rain": 40.0, "Time Scale": 180.0}),
    "DRYING_BEACH": ("Drying Beach", {"Drying": 0.5, "Time Scale": 2880.0}),
}
"""Title of each preset, and its inputs where they are not as in a new group. Ten seconds show a night of snow, two days
of thaw, ten minutes of wind, half an hour of rain, eight hours of sun."""


def new() -> Any:
    """A new group with its inputs and nothing in it."""
    return new_group(GROUP, MARK, INPUTS)


def is_weather(tree: bpy.types.NodeTree) -> bool:
    """True if a node group is one that `new` made."""
    return MARK in tree.keys()  # noqa: SIM118  (an ID is no mapping)


def hold(graph: NodeGraph, inners: Sequence[Any]) -> None:
    """Have a group do what those within do, one after the other."""
    group = graph.node("NodeGroupInput")
    geometry = group.outputs["Geometry"]
    for inner in inners:
        held = graph.node("GeometryNodeGroup", {"Geometry": geometry}, node_tree=inner)
        for name, *_ in INPUTS:
            graph.link(group.outputs[name], held.inputs[name])
        geometry = held.outputs["Geometry"]
    graph.finish(geometry)
