"""The node group by which plants and litter give way: a scatter and the time in, the scatter at that time out.

It is native Blender data and needs nothing of this add-on. What it looks up are the vertices of an object, the table of
`trampling_table`: tiles of small cells, and for each cell the passes of soles over it. A root finds its cell by
arithmetic, without a search; what no sole has come near is only compared. The law is `core.plants.bending`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from typing import Any

import bpy

from ...core.plants.bending import Pass, Plant, bend
from ..node_graph import NodeGraph, Number
from ..node_modifiers import new_group

GROUP = "SoftGround Give Way"
MARK = "softground_give_way"
"""Custom property of the group."""

TILES, FIRST, ACTIVE = "softground_tiles", "softground_first", "softground_active"
TIMES, LEAN, PACE, SINK = "softground_times", "softground_lean", "softground_pace", "softground_sink"
"""Of each pass: times and reach; direction [rad], what lasts, height above; speeds and number; height and slope."""
META = "softground_meta"
"""Of the first vertex: tiles in a row, cells along a tile, frame rate; of the second: columns, rows, first frame."""

BENT = "softground_bent"
"""For materials, of curves, instances and points: from 0 to 1, how far they lie."""
_ROOT, _TOUCHED, _CHANCE, _MOVED = (f".softground_{name}" for name in ("root", "touched", "chance", "moved"))
"""Of curves, instances and points meanwhile. The last is a vector in the table's space: where it leans [rad], and how
far its root goes up."""

INPUTS: Mapping[str, tuple[str, Any, tuple[float, float] | None, str]] = {
    "Table": ("NodeSocketObject", None, None, "Where and when soles tread: an object that each bake writes"),
    "Height": ("NodeSocketFloat", 0.3, (0.001, 10.0), "Height of the tallest plants, from which on soles bend them"),
    "Stiffness": ("NodeSocketFloat", 0.15, (0.0, 1.0), "Share of the bend that springs back as the sole leaves"),
    "Recovery": ("NodeSocketFloat", 240.0, (0.1, 86400.0), "Seconds in which plants rise to 1/e of their bend"),
    "Breaks": ("NodeSocketFloat", 0.3, (0.0, 10.0), "How much stays bent for good: 1 is all of it from 150 kPa on"),
    "Half After": ("NodeSocketFloat", 150.0, (1.0, 10_000.0), "Passes after which half of the plants are worn down"),
    "Stands": ("NodeSocketBool", True, None, "Plants that bend; off for what lies on the ground and tilts with it"),
    "Sinks": ("NodeSocketBool", True, None, "Press roots into the prints; off where the scatter follows the ground"),
    "Loose Parts": ("NodeSocketBool", False, None, "Bend each separate part of a mesh about its lowest vertices"),
}
"""What the group asks for: kind of socket, value at first, range, meaning."""
MEANS = 3
"""How many times the lower part of a blade of a mesh is taken, until its lowest vertices are left."""


def ensure_group() -> Any:
    """The node group, made on first use."""
    known = next((group for group in bpy.data.node_groups if is_give_way(group) and not group.library), None)
    if known is not None:
        return known
    tree: Any = new_group(GROUP, MARK)
    graph = NodeGraph(tree)
    interface = tree.interface
    for way in ("INPUT", "OUTPUT"):
        interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    for name, (kind, value, span, meaning) in INPUTS.items():
        socket = interface.new_socket(name, in_out="INPUT", socket_type=kind)
        socket.description = meaning
        if value is not None:
            socket.default_value = value
        if span:
            socket.min_value, socket.max_value = span
    _fill(graph)
    return tree


def is_give_way(tree: Any) -> bool:
    """True of a node group that `ensure_group` made."""
    return MARK in tree.keys()  # noqa: SIM118  (an ID is no mapping)


@dataclass(frozen=True)
class _Table:
    """The table as the group sees it: its vertices, its space in that of the scatter, and its numbers."""

    vertices: Any
    to_scatter: Any
    from_scatter: Any
    row: Number
    tile: Number
    frame_rate: Number
    columns: Number
    rows: Number
    first_frame: Number
    up: Any


def _fill(graph: NodeGraph) -> None:
    chosen = graph.node("NodeGroupInput").outputs
    frame = graph.number(graph.node("GeometryNodeInputSceneTime").outputs["Frame"])
    table = _table(graph, chosen["Table"])
    graph.next_row()
    slot, begun = _found(graph, table, frame)
    plant = Plant(*(graph.number(chosen[name]) for name in ("Height", "Stiffness", "Recovery", "Breaks", "Half After")))
    graph.next_row()
    touched = begun.above(0.5).socket, _moved(graph, table, slot, begun, plant, frame, chosen)

    given = chosen["Geometry"]
    graph.next_row()
    first = graph.node("GeometryNodePointsOfCurve").outputs["Point Index"]
    position = graph.node("GeometryNodeInputPosition").outputs["Position"]
    root = _at(graph, position, first, "POINT")
    geometry = _stored(graph, given, "CURVE", root, touched)
    geometry = _put(graph, table, geometry, position)
    graph.next_row()
    geometry = _instances_moved(graph, table, _stored(graph, geometry, "INSTANCE", position, touched), chosen)
    graph.next_row()
    loose = _loose_parts_moved(graph, table, geometry, position, touched)
    geometry = graph.choose("GEOMETRY", chosen["Loose Parts"], geometry, loose)
    geometry = graph.forgotten(geometry, _ROOT, _TOUCHED, _CHANCE, _MOVED)
    acts = graph.both(
        graph.compare("LESS_EQUAL", table.first_frame.socket, frame.socket),
        graph.compare("LESS_THAN", 0.5, table.tile.socket),
    )
    graph.finish(graph.choose("GEOMETRY", acts, given, geometry))


def _table(graph: NodeGraph, obj: Any) -> _Table:
    info = graph.node("GeometryNodeObjectInfo", transform_space="RELATIVE")
    graph.link(obj, info.inputs["Object"])
    vertices, to_scatter = info.outputs["Geometry"], info.outputs["Transform"]
    inverted = graph.node("FunctionNodeInvertMatrix")
    graph.link(to_scatter, inverted.inputs["Matrix"])
    numbers = graph.attribute(META, "FLOAT_VECTOR")
    row, tile, frame_rate = graph.parts(graph.at_index(vertices, numbers, 0))
    columns, rows, first_frame = graph.parts(graph.at_index(vertices, numbers, 1))
    up = graph.vector("NORMALIZE", _turned(graph, (0.0, 0.0, 1.0), to_scatter))
    space = to_scatter, inverted.outputs["Matrix"]
    return _Table(vertices, *space, row, tile, frame_rate, columns, rows, first_frame, up)


def _turned(graph: NodeGraph, direction: Any, by: Any) -> Any:
    node = graph.node("FunctionNodeTransformDirection")
    graph.link(direction, node.inputs["Direction"])
    graph.link(by, node.inputs["Transform"])
    return node.outputs["Direction"]


def _at(graph: NodeGraph, value: Any, index: Any, domain: str, kind: str = "FLOAT_VECTOR") -> Any:
    """Value of a field at one of the elements of the geometry that it is of."""
    node = graph.node("GeometryNodeFieldAtIndex", data_type=kind, domain=domain)
    graph.link(value, node.inputs["Value"])
    graph.link(index, node.inputs["Index"])
    return node.outputs["Value"]


def _in_cells(graph: NodeGraph, table: _Table) -> Any:
    """The root in cells of the table."""
    node = graph.node("FunctionNodeTransformPoint")
    graph.link(graph.attribute(_ROOT, "FLOAT_VECTOR"), node.inputs["Vector"])
    graph.link(table.from_scatter, node.inputs["Transform"])
    return node.outputs["Vector"]


def _found(graph: NodeGraph, table: _Table, frame: Number) -> tuple[Any, Number]:
    """The slot of a root, and how many of its passes have begun."""
    x, y, _ = graph.parts(graph.vector("FLOOR", _in_cells(graph, table)))
    column, row = x.at_least(0.0).at_most(table.columns), y.at_least(0.0).at_most(table.rows)
    across, down = (column / table.tile).floor(), (row / table.tile).floor()
    tile = graph.at_index(table.vertices, graph.attribute(TILES, "INT"), (down * table.row + across).socket, "INT")
    slot = graph.number(tile) + (row - down * table.tile) * table.tile + (column - across * table.tile)

    active = graph.compare("LESS_EQUAL", graph.attribute(ACTIVE), frame.socket)
    before = graph.accumulated(active, "INT").outputs["Leading"]
    index = graph.node("GeometryNodeInputIndex").outputs["Index"]
    first = graph.attribute(FIRST, "INT")
    end = _at(graph, first, graph.math("ADD", index, 1.0), "POINT", "INT")
    begun = graph.number(_at(graph, before, end, "POINT", "INT")) - graph.number(
        _at(graph, before, first, "POINT", "INT")
    )
    return slot.socket, graph.number(graph.at_index(table.vertices, begun.socket, slot.socket, "INT"))


def _pass(graph: NodeGraph, table: _Table, index: Any) -> tuple[Pass, list[Number], list[Number]]:
    """A pass of the table, the direction in which it leans blades, and height and slope that it leaves."""
    times, lean, pace, sink = (
        graph.parts(graph.at_index(table.vertices, graph.attribute(name, "FLOAT_VECTOR"), index))
        for name in (TIMES, LEAN, PACE, SINK)
    )
    by = Pass(times[0], times[1], pace[0], pace[1], times[2], lean[1], pace[2], lean[2])
    return by, [graph.number(graph.math(name, lean[0].socket)) for name in ("COSINE", "SINE")], sink


def _moved(graph: NodeGraph, table: _Table, slot: Any, begun: Number, plant: Plant, frame: Number, chosen: Any) -> Any:
    """How a touched root moves, as `_MOVED` has it."""
    first = graph.number(graph.at_index(table.vertices, graph.attribute(FIRST, "INT"), slot, "INT"))
    latest = first + begun - 1.0
    chance = graph.number(graph.attribute(_CHANCE))
    by, way, remaining = _pass(graph, table, latest.socket)
    older, older_way, older_left = _pass(graph, table, (latest - 1.0).socket)
    is_second = begun.above(1.5)
    angle, weight = bend(by, plant, frame, table.frame_rate, chance)
    before, _ = bend(older, plant, frame, table.frame_rate, chance)
    before = before * is_second * (1.0 - weight)
    lean = [(new * angle + old * before) * (pi / 2) for new, old in zip(way, older_way, strict=True)]

    pressed = ((frame - by.start) / (by.end - by.start).at_least(1.0)).within_one()
    height, *slope = (
        old * is_second + (new - old * is_second) * pressed for new, old in zip(remaining, older_left, strict=True)
    )
    x, y, _ = graph.parts(graph.vector("FRACTION", _in_cells(graph, table)))
    height = height + slope[0] * (x - 0.5) + slope[1] * (y - 0.5)
    steep = graph.vector("LENGTH", graph.combined(slope[0].socket, slope[1].socket, 0.0), output="Value")
    level = (0.0 - graph.number(graph.math("ARCTANGENT", steep))) / graph.number(steep)
    sunk = graph.choose("FLOAT", chosen["Sinks"], 0.0, height.socket)
    tilt = [
        graph.choose("FLOAT", chosen["Stands"], (part * level).socket, bent.socket)
        for part, bent in zip(slope, lean, strict=True)
    ]
    return graph.combined(*tilt, sunk)


def _stored(graph: NodeGraph, geometry: Any, domain: str, root: Any, touched: tuple[Any, Any], each: Any = None) -> Any:
    """The geometry with its roots and how the touched ones move, as attributes of a domain; `each` numbers plants."""
    geometry = graph.store(geometry, _ROOT, root, True, "FLOAT_VECTOR", domain)
    geometry = graph.store(geometry, _TOUCHED, touched[0], True, "BOOLEAN", domain)
    is_touched = graph.attribute(_TOUCHED, "BOOLEAN")
    random = graph.node("FunctionNodeRandomValue", data_type="FLOAT")
    if each is not None:
        graph.link(each, next(socket for socket in random.inputs if socket.name == "ID"))
    chance = next(socket for socket in random.outputs if socket.enabled)
    geometry = graph.store(geometry, _CHANCE, chance, is_touched, domain=domain)
    geometry = graph.store(geometry, _MOVED, touched[1], is_touched, "FLOAT_VECTOR", domain)
    x, y, _ = graph.parts(graph.attribute(_MOVED, "FLOAT_VECTOR"))
    bent = graph.math("MULTIPLY", graph.vector("LENGTH", graph.combined(x.socket, y.socket), output="Value"), 2.0 / pi)
    return graph.store(geometry, BENT, bent, is_touched, domain=domain)


def _lean_and_shift(graph: NodeGraph, table: _Table) -> tuple[Any, Number, Any]:
    """Direction in which a root leans, its angle [rad] and the way that it goes, in the scatter's space."""
    x, y, z = graph.parts(graph.attribute(_MOVED, "FLOAT_VECTOR"))
    level = graph.combined(x.socket, y.socket, 0.0)
    toward = graph.vector("NORMALIZE", _turned(graph, level, table.to_scatter))
    angle = graph.number(graph.vector("LENGTH", level, output="Value"))
    return toward, angle, _turned(graph, graph.combined(0.0, 0.0, z.socket), table.to_scatter)


def _put(graph: NodeGraph, table: _Table, geometry: Any, position: Any) -> Any:
    """Move points whose blade leans: what is upright of their way from the root turns, and keeps its length."""
    toward, angle, shift = _lean_and_shift(graph, table)
    from_root = graph.vector("SUBTRACT", position, graph.attribute(_ROOT, "FLOAT_VECTOR"))
    height = graph.number(graph.dot(from_root, table.up)).at_least(0.0)
    sine, cosine = (graph.number(graph.math(name, angle.socket)) for name in ("SINE", "COSINE"))
    aside = graph.scaled(toward, (height * sine).socket)
    down = graph.scaled(table.up, (height * (cosine - 1.0)).socket)
    offset = graph.vector("ADD", graph.vector("ADD", aside, down), shift)
    return graph.put(geometry, graph.attribute(_TOUCHED, "BOOLEAN"), position, offset)


def _instances_moved(graph: NodeGraph, table: _Table, geometry: Any, chosen: Any) -> Any:
    """Turn instances about their origins: plants until they lie, litter with the ground."""
    toward, angle, shift = _lean_and_shift(graph, table)
    turned = graph.node("FunctionNodeRotateVector")
    graph.link((0.0, 0.0, 1.0), turned.inputs["Vector"])
    graph.link(graph.node("GeometryNodeInputInstanceRotation").outputs["Rotation"], turned.inputs["Rotation"])
    stem = graph.choose("VECTOR", chosen["Stands"], table.up, turned.outputs["Vector"])
    to_lie = graph.number(graph.math("ARCCOSINE", graph.dot(stem, toward)))
    rotation = graph.node("FunctionNodeAxisAngleToRotation")
    graph.link(graph.vector("CROSS_PRODUCT", stem, toward), rotation.inputs["Axis"])
    graph.link((angle * to_lie / (pi / 2)).socket, rotation.inputs["Angle"])
    rotated, moved = graph.node("GeometryNodeRotateInstances"), graph.node("GeometryNodeTranslateInstances")
    for node, name, value in ((rotated, "Rotation", rotation.outputs["Rotation"]), (moved, "Translation", shift)):
        node.inputs["Local Space"].default_value = False
        graph.link(geometry, node.inputs["Instances"])
        graph.link(graph.attribute(_TOUCHED, "BOOLEAN"), node.inputs["Selection"])
        graph.link(value, node.inputs[name])
        geometry = node.outputs["Instances"]
    graph.link(graph.attribute(_ROOT, "FLOAT_VECTOR"), rotated.inputs["Pivot Point"])
    return geometry


def _loose_parts_moved(graph: NodeGraph, table: _Table, geometry: Any, position: Any, touched: tuple[Any, Any]) -> Any:
    """Bend the separate parts of a mesh about their roots, the middle of their lowest vertices."""
    parts = graph.node("GeometryNodeSeparateComponents")
    graph.link(geometry, parts.inputs["Geometry"])
    island = graph.node("GeometryNodeInputMeshIsland").outputs["Island Index"]

    def total(value: Any, kind: str = "FLOAT") -> Any:
        node = graph.accumulated(value, kind)
        graph.link(island, node.inputs["Group ID"])
        return next(socket for socket in node.outputs if socket.name == "Total" and socket.enabled)

    height = graph.number(graph.dot(position, table.up))
    low = graph.number(1.0)
    for _ in range(MEANS):
        mean = graph.number(total((height * low).socket)) / graph.number(total(low.socket))
        low = 1.0 - height.above(mean + 1e-6)
    share = graph.math("DIVIDE", 1.0, total(low.socket))
    root = graph.scaled(total(graph.scaled(position, low.socket), "FLOAT_VECTOR"), share)
    mesh = _stored(graph, parts.outputs["Mesh"], "POINT", root, touched, island)
    mesh = _put(graph, table, mesh, position)
    joined = graph.node("GeometryNodeJoinGeometry")
    for part in [mesh, *(socket for socket in parts.outputs if socket.name != "Mesh")]:
        graph.link(part, joined.inputs["Geometry"])
    return joined.outputs["Geometry"]
