"""Nodes by which a scatter finds its way in the table of `trampling_table`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from ..nodes.node_graph import NodeGraph, Number
from ..playback.weather_nodes import RAISED
from .trampling_layout import META, THROWN_FROM, TILES, WIND

UNITS = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
NOWHERE = 1e9
"""More vertices than a table has: the last one is empty."""


@dataclass(frozen=True)
class Table:
    """The table as the group sees it, with its numbers and what is chosen.

    Attributes
    ----------
    to_scatter : matrix
        From cells to the scatter's space.
    cell_up : vector
        Up by one cell, in the scatter's space.
    ways : three vectors
        Axes of the table for a length of one along its last one, `up`, in the scatter's space.
    axes, origin : two vectors and a vector
        By which the column and the row of a place are found.
    """

    vertices: Any
    to_scatter: Any
    cell_up: Any
    ways: list[Any]
    axes: list[Any]
    origin: Any
    row: Number
    tile: Number
    frame_rate: Number
    columns: Number
    rows: Number
    first_frame: Number
    cell: Number
    gravity: Number
    radius: Number
    wind: Number
    stands: Any
    rolls: Any
    sinks: Any
    surface: Any

    @property
    def up(self) -> Any:
        return self.ways[2]

    @cached_property
    def is_windy(self) -> Number:
        """1 where the wind sways what stands, the same everywhere."""
        return self.wind.above(0.0) * self.wind.graph.number(self.stands)

    @property
    def metre(self) -> Number:
        """A metre in Blender units."""
        return self.radius * (1.0 / THROWN_FROM)


def table_of(graph: NodeGraph, chosen: Any) -> Table:
    info = graph.node("GeometryNodeObjectInfo", {"Object": chosen["Table"]}, transform_space="RELATIVE")
    vertices, to_scatter = info.outputs["Geometry"], info.outputs["Transform"]
    inverted = graph.node("FunctionNodeInvertMatrix", {"Matrix": to_scatter}).outputs["Matrix"]
    origin = graph.node("FunctionNodeTransformPoint", {"Vector": (0.0, 0.0, 0.0), "Transform": inverted})
    ways = [turned(graph, way, to_scatter) for way in UNITS]
    cell_up, each = ways[2], graph.math("DIVIDE", 1.0, graph.vector("LENGTH", ways[2], output="Value"))
    ways = [graph.scaled(way, each) for way in ways]
    back = [graph.parts(turned(graph, way, inverted)) for way in UNITS]
    axes = [graph.combined(*(way[number].socket for way in back)) for number in (0, 1)]
    numbers = graph.attribute(META, "FLOAT_VECTOR")
    row, tile, frame_rate = graph.parts(graph.at_index(vertices, numbers, 0))
    columns, rows, first_frame = graph.parts(graph.at_index(vertices, numbers, 1))
    cell, gravity, radius = graph.parts(graph.at_index(vertices, numbers, 2))
    wind = graph.number(graph.at_index(vertices, graph.attribute(WIND), 0, "FLOAT"))
    numbers = row, tile, frame_rate, columns, rows, first_frame, cell, gravity, radius, wind
    space = to_scatter, cell_up, ways, axes, origin.outputs["Vector"]
    return Table(vertices, *space, *numbers, *(chosen[name] for name in ("Stands", "Rolls", "Sinks", "Surface")))


def raised_at(graph: NodeGraph, table: Table, root: Any) -> Any:
    """Height by which snow raises the ground under a root [m]: as the root has it, or the surface that it grows on."""
    surface = graph.node("GeometryNodeObjectInfo", {"Object": table.surface}, transform_space="RELATIVE")
    mesh, own = surface.outputs["Geometry"], graph.attribute(RAISED)
    is_raised = graph.at_index(mesh, own.node.outputs["Exists"], 0, "BOOLEAN")
    inputs = {"Mesh": mesh, "Value": own, "Sample Position": root}
    nearest = graph.node("GeometryNodeSampleNearestSurface", inputs, data_type="FLOAT").outputs["Value"]
    return graph.choose("FLOAT", is_raised, own, nearest)


def turned(graph: NodeGraph, direction: Any, by: Any) -> Any:
    inputs = {"Direction": direction, "Transform": by}
    return graph.node("FunctionNodeTransformDirection", inputs).outputs["Direction"]


def at_element(graph: NodeGraph, value: Any, index: Any, domain: str, kind: str = "FLOAT_VECTOR") -> Any:
    """Value of a field at one of the elements of the geometry that it is of."""
    inputs = {"Value": value, "Index": index}
    return graph.node("GeometryNodeFieldAtIndex", inputs, data_type=kind, domain=domain).outputs["Value"]


def any_of(graph: NodeGraph, geometry: Any, condition: Any, domain: str) -> Any:
    """Above 0 if a condition holds for any element of a geometry."""
    total = graph.accumulated(condition, "INT", domain).outputs["Total"]
    return graph.at_index(geometry, total, 0, "INT", domain)


def is_over(graph: NodeGraph, table: Table, place: Any) -> Any:
    """1 of places over the table, else 0."""
    column, row = graph.parts(place)[:2]
    beyond = (0.0 - column).at_least(column - table.columns).at_least((0.0 - row).at_least(row - table.rows))
    return graph.compare("LESS_THAN", beyond.socket, 1.0)


def in_cells(graph: NodeGraph, table: Table, root: Any) -> Any:
    """Column and row of a root, with fractions, and its height along `up`.

    Where scatter and table are turned alike, parts of the vector are scaled, in half the time.
    """
    axes = [graph.separated(axis) for axis in (*table.axes, table.up)]
    beside = [part for i, axis in enumerate(axes) for j, part in enumerate(axis) if i != j]
    turned = sum((graph.number(graph.math("ABSOLUTE", part)) for part in beside), graph.number(0.0))
    scales = graph.combined(*(axes[i][i] for i in range(3)))
    origin = graph.vector("MULTIPLY", table.origin, (1.0, 1.0, 0.0))
    scaled = graph.vector("MULTIPLY_ADD", root, scales, origin)
    whole = graph.combined(*(graph.dot(root, axis) for axis in (*table.axes, table.up)))
    return graph.choose("VECTOR", turned.above(0.0).socket, scaled, graph.vector("ADD", whole, origin))


def slot_of(graph: NodeGraph, table: Table, place: Any) -> Any:
    """Slot of a place in cells; the cells at the edge of the table are empty, and so are those beyond."""
    most = graph.combined(table.columns.socket, table.rows.socket)
    cell = graph.vector("FLOOR", graph.vector("MAXIMUM", graph.vector("MINIMUM", place, most), (0.0, 0.0, 0.0)))
    tile = graph.vector("FLOOR", graph.scaled(cell, graph.math("DIVIDE", 1.0, table.tile.socket)))
    number = graph.dot(tile, graph.combined(1.0, table.row.socket))
    begin = graph.at_index(table.vertices, graph.attribute(TILES), number, "FLOAT")
    return graph.math("ADD", begin, graph.dot(cell, graph.combined(1.0, table.tile.socket)))
