"""Wind of the weather on plants: how it comes to the table that they give way by, and nodes that sway them.

The table has a modifier of its own, whose input a driver takes from the weather's slider. It needs no Python, and
follows keys.
"""

from __future__ import annotations

from math import pi
from typing import Any, cast

import bpy

from ...core.plants.bending import Plant
from ...core.plants.swaying import swayed
from ..nodes.node_graph import NodeGraph, Number
from ..nodes.node_modifiers import GroupInput, modifier_with, new_group
from ..playback import weather_modifier
from .table_nodes import Table
from .trampling_layout import WIND

GROUP = MARK = "SoftGround Wind"
CALM = {"Wind": 0.0}
"""What the table has without weather [m/s]."""


def follow(table: bpy.types.Object, shown: bpy.types.Object) -> None:
    """Have the table of a ground's plants follow the wind of the weather on what shows its prints; none without."""
    known = modifier_with(table, is_wind)
    if weather_modifier.modifier_of(shown) is None:
        if known is not None:
            weather_modifier.let_go(known, CALM)
            table.modifiers.remove(known)
        return
    modifier: Any = known or table.modifiers.new(GROUP, "NODES")
    if known is None:
        modifier.node_group = next(filter(is_wind, bpy.data.node_groups), None) or _group()
    weather_modifier.lead(shown, modifier, CALM)


def is_wind(tree: Any) -> bool:
    """True of a group that brings wind to a table."""
    return MARK in tree.keys() and tree.library is None  # noqa: SIM118  (an ID is no mapping)


def _group() -> Any:
    inputs = [GroupInput(name, value, "Of the weather [m/s]") for name, value in CALM.items()]
    graph = NodeGraph(new_group(GROUP, MARK, inputs))
    given = graph.node("NodeGroupInput").outputs
    graph.finish(graph.store(given["Geometry"], WIND, given["Wind"], True))
    return graph.tree


def lean(table: Table, plant: Plant, frame: Number, place: Any, chance: Number) -> Number:
    """Lean of standing plants along the first axis of the table, in right angles."""
    ahead = frame.graph.parts(place)[0] * table.cell
    return cast("Number", swayed(table.wind, plant.height, table.metre, frame / table.frame_rate, ahead, chance))


def leaning(graph: NodeGraph, table: Table, share: Number) -> Any:
    """Way of what is upright, for its length, that leans along the first axis by a share of a right angle."""
    sine = (share * (pi / 2)).sine()
    down = graph.scaled(table.up, ((1.0 - sine * sine).root() - 1.0).socket)
    return graph.vector("MULTIPLY_ADD", table.ways[0], sine.socket, down)
