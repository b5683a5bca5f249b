"""Inputs of the weather's node group, the sliders of its modifier: their sockets and values."""

from __future__ import annotations

from typing import Any

import bpy

from ..nodes.node_graph import NodeGraph
from ..nodes.node_modifiers import new_group

GROUP = "SoftGround Weather"


MARK = "softground_weather"
"""Custom property of the group, whatever the user calls it."""


INPUTS = (
    ("Snowfall", 0.0, 0.0, 100.0, "New snow in centimetres per hour. It settles, and rounds whatever it covers"),
    (
        "Temperature",
        0.0,
        -60.0,
        40.0,
        "Air temperature in °C. Above 0, new snow melts first, then the ground's, trodden snow last",
    ),
    (
        "Wind",
        0.0,
        0.0,
        60.0,
        "Wind speed in metres per second, at 10 m. It blows sand into prints from about 5 on, snow from 6",
    ),
    ("Rain", 0.0, 0.0, 500.0, "Rain in millimetres per hour. It rounds edges; what does not soak in stands in prints"),
    (
        "Drying",
        0.0,
        0.0,
        50.0,
        "Water that the air takes up, in millimetres per hour: 0.2 is mild, 0.5 sunny and windy",
    ),
    (
        "Water Table",
        100.0,
        0.0,
        100.0,
        "Water level in centimetres below the brim of each print, to which water seeps in",
    ),
    ("Halo", 0.0, 0.0, 1.0, "How pale wet sand turns around a loaded foot; it is wet again seconds later"),
    (
        "Time Scale",
        1.0,
        0.0,
        1e7,
        "How many times faster than the animation the weather runs: 2880 shows 8 hours in 10 seconds",
    ),
)
"""Name, value, least, most and description of each of the group's inputs."""


def new() -> Any:
    """A new group with its inputs and nothing in it."""
    tree = new_group(GROUP, MARK)
    add_sockets(tree)
    return tree


def add_sockets(tree: Any) -> None:
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    for name, value, least, most, description in INPUTS:
        socket = tree.interface.new_socket(name, in_out="INPUT", socket_type="NodeSocketFloat")
        socket.default_value, socket.min_value, socket.max_value = value, least, most
        socket.description = description


def is_weather(tree: bpy.types.NodeTree) -> bool:
    """Return whether a node group is one that `new` made."""
    return MARK in tree.keys()  # noqa: SIM118  (an ID is no mapping)


def hold(graph: NodeGraph, inner: Any) -> None:
    """Have a group do what the one within does."""
    group = graph.node("NodeGroupInput")
    held = graph.node("GeometryNodeGroup", node_tree=inner)
    for name in ("Geometry", *(name for name, *_ in INPUTS)):
        graph.link(group.outputs[name], held.inputs[name])
    graph.finish(held.outputs["Geometry"])
