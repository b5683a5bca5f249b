"""Nodes by which litter rolls along or is thrown; `passes` are those of `give_way_nodes`."""

from __future__ import annotations

from math import pi
from typing import Any

from ...core.plants.bending import Pass
from ..nodes.node_graph import NodeGraph, Number
from .table_nodes import Table, slot_of
from .trampling_layout import LEAN, SENT_BY, SINK

ROLLING = 0.4
"""Time in which a pebble rolls out [s]."""
ASIDE = 2 * pi / 3
"""Angle over which pieces part that are sent off [rad]."""


def way(graph: NodeGraph, table: Table, by: Pass, height: Number, frame: Number) -> Any:
    """Way of litter: rolled along where the ground is too hard to press it in, thrown back by soles that throw debris.

    What rolls is slowed down evenly; what is thrown leaves at 45° with the speed of the sole, v, less what holds it:
    it comes as far as v²/g - R.
    """
    level = graph.parts(graph.attribute(SINK, "FLOAT_VECTOR"))[2]
    hard = (level * table.cell / height + 1.0).within_one()
    remains = 1.0 - ((frame - by.start) / (table.frame_rate * ROLLING)).within_one()
    rolled = graph.number(table.rolls) / table.cell * hard * (1.0 - remains * remains)
    speed = by.up * table.frame_rate
    reach = (speed * speed / table.gravity - table.radius).at_least(0.0)
    flown = ((frame - by.end) / ((reach * 2.0 / table.gravity).root() * table.frame_rate).at_least(1.0)).within_one()
    is_sent = by.passes.above(0.5)
    along, rise = ((way * is_sent) for way in (rolled - reach / table.cell * flown, reach / table.cell * flown))
    upward = graph.combined(0.0, 0.0, (rise * (1.0 - flown)).socket)
    return graph.vector("MULTIPLY_ADD", graph.attribute(LEAN, "FLOAT_VECTOR"), along.socket, upward)


def sent_off(
    graph: NodeGraph,
    table: Table,
    passes: Any,
    geometry: Any,
    domain: str,
    place: Any,
    latest: Number,
    chance: Number,
) -> tuple[Any, ...]:
    """The geometry with the way of each piece by the first sole that trod on it, a part of it and to another side for
    each [cells]; these ways, where each lies then, and the latest pass that acts there; see `table_nodes.in_cells`.
    """
    by = graph.at_index(passes.vertices, graph.attribute(SENT_BY, "INT"), latest.socket, "INT")
    sent = graph.scaled(graph.at_index(passes.vertices, passes.sent, by), chance.socket)
    angle = ((chance * 17.0).fraction() - 0.5) * ASIDE
    inputs = {"Vector": sent, "Angle": angle.socket}
    sent = graph.node("ShaderNodeVectorRotate", inputs, rotation_type="Z_AXIS").outputs["Vector"]
    geometry, (sent,) = graph.captured(geometry, graph.number(sent), kinds="VECTOR", domain=domain)
    landing = graph.vector("MULTIPLY_ADD", sent.socket, (1.0, 1.0, 0.0), place)
    acting = graph.at_index(passes.counted, passes.latest, slot_of(graph, table, landing), "INT")
    geometry, (acting,) = graph.captured(geometry, graph.number(acting), kinds="INT", domain=domain)
    return geometry, sent.socket, landing, acting.socket
