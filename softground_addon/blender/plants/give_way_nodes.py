"""The node group by which plants and litter give way: a scatter and the time in, the scatter at that time out.

It is native Blender data and needs nothing of this add-on. What it looks up are the vertices of an object, the table of
`trampling_table`: tiles of small cells, and for each cell the passes of soles over it. The law, `core.plants.bending`,
is worked out for each pass that acts at the time; a root finds its cell by arithmetic, without a search, and takes what
is there. What no sole has come near is only compared.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import pi
from typing import Any

import bpy

from ...core.plants.bending import EVERYONE, NO_ONE, Pass, Plant, bend, cover
from ..nodes.node_graph import NodeGraph, Number
from ..nodes.node_modifiers import GroupInput, new_group

GROUP = "SoftGround Give Way"
MARK = "softground_give_way"
"""Custom property of the group."""

TILES, FIRST = "softground_tiles", "softground_first"
"""Of each tile: its first slot, less what the cell at its corner counts for; of each slot, its first pass."""
ACTIVE, TIMES, PACE, LEAN, SHARES, SINK = (
    f"softground_{name}" for name in ("active", "times", "pace", "lean", "shares", "sink")
)
"""Vectors of each pass: frames from which it acts, and the next two; start, end and number; speeds and height above;
direction; reach, what lasts, and 1 behind an earlier one; slope and height that it leaves."""
_HELD, _OLDER, _SUNK = (f".softground_{name}" for name in ("held", "older", "sunk"))
"""Of passes meanwhile, vectors: bend, bend of what is worn down, and share of what is not; the same of what is left of
the earlier one; slope and height now."""
META = "softground_meta"
"""Of the first vertex: tiles in a row, cells along a tile, frame rate; of the second: columns, rows, first frame."""

BENT = "softground_bent"
"""For materials, of curves, instances and points: from 0 to 1, how far they lie."""
_ROOT, _PASS, _TOUCHED, _CHANCE, _MOVED, _LEAN, _SHIFT, _BASE, _PART, _LOW = (
    f".softground_{name}"
    for name in ("root", "pass", "touched", "chance", "moved", "lean_way", "shift", "base", "part", "low")
)
"""Of curves, instances and points meanwhile. `_MOVED` is a vector in the table's space: where it leans [rad], and how
far its root goes up; `_LEAN` the way of what is upright, for its length."""
_MEANWHILE = (_ROOT, _PASS, _TOUCHED, _CHANCE, _MOVED, _LEAN, _SHIFT, _BASE, _PART, _LOW)

INPUTS = (
    GroupInput("Table", None, "Where and when soles tread: an object that each bake writes", kind="Object"),
    GroupInput("Height", 0.3, "Height of the tallest plants, from which on soles bend them", (0.001, 10.0)),
    GroupInput("Stiffness", 0.15, "Share of the bend that springs back as the sole leaves", (0.0, 1.0)),
    GroupInput("Recovery", 240.0, "Seconds in which plants rise to 1/e of their bend", (0.1, 86400.0)),
    GroupInput("Breaks", 0.3, "How much stays bent for good: 1 is all of it from 150 kPa on", (0.0, 10.0)),
    GroupInput("Half After", 150.0, "Passes after which half of the plants are worn down", (1.0, 10000.0)),
    GroupInput("Stands", True, "Plants that bend; off for what lies on the ground and tilts with it", kind="Bool"),
    GroupInput("Sinks", True, "Press roots into the prints; off where the scatter follows the ground", kind="Bool"),
    GroupInput("Loose Parts", False, "Bend each separate part of a mesh about its lowest vertices", kind="Bool"),
)
MEANS = 3
"""How many times the lower part of a blade of a mesh is taken, until its lowest vertices are left."""


def ensure_group() -> Any:
    """The node group, made on first use."""
    known = next((group for group in bpy.data.node_groups if is_give_way(group) and not group.library), None)
    if known is not None:
        return known
    graph = NodeGraph(new_group(GROUP, MARK, INPUTS))
    _fill(graph)
    return graph.tree


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
    frame = graph.number(graph.frame())
    plant = Plant(*(graph.number(chosen[name]) for name in ("Height", "Stiffness", "Recovery", "Breaks", "Half After")))
    table = _table(graph, chosen["Table"])
    graph.next_row()
    table = replace(table, vertices=_bent_passes(graph, table, plant, frame))
    graph.next_row()
    latest, moved = _latest(graph, table, frame), _moved(graph, table, chosen)

    given = chosen["Geometry"]
    graph.next_row()
    first = graph.node("GeometryNodePointsOfCurve").outputs["Point Index"]
    position = graph.position()
    root = _at(graph, position, first, "POINT")
    geometry = _stored(graph, given, "CURVE", root, latest, moved)
    geometry = _put(graph, table, geometry, "CURVE", position)
    graph.next_row()
    geometry = _stored(graph, geometry, "INSTANCE", position, latest, moved)
    geometry = _instances_moved(graph, table, geometry, chosen)
    graph.next_row()
    loose = _loose_parts_moved(graph, table, geometry, position, latest, moved)
    geometry = graph.choose("GEOMETRY", chosen["Loose Parts"], geometry, loose)
    geometry = graph.forgotten(geometry, *_MEANWHILE)
    acts = graph.both(
        graph.compare("LESS_EQUAL", table.first_frame.socket, frame.socket),
        graph.compare("LESS_THAN", 0.5, table.tile.socket),
    )
    graph.finish(graph.choose("GEOMETRY", acts, given, geometry))


def _table(graph: NodeGraph, obj: Any) -> _Table:
    info = graph.node("GeometryNodeObjectInfo", {"Object": obj}, transform_space="RELATIVE")
    vertices, to_scatter = info.outputs["Geometry"], info.outputs["Transform"]
    inverted = graph.node("FunctionNodeInvertMatrix", {"Matrix": to_scatter})
    numbers = graph.attribute(META, "FLOAT_VECTOR")
    row, tile, frame_rate = graph.parts(graph.at_index(vertices, numbers, 0))
    columns, rows, first_frame = graph.parts(graph.at_index(vertices, numbers, 1))
    up = graph.vector("NORMALIZE", _turned(graph, (0.0, 0.0, 1.0), to_scatter))
    space = to_scatter, inverted.outputs["Matrix"]
    return _Table(vertices, *space, row, tile, frame_rate, columns, rows, first_frame, up)


def _turned(graph: NodeGraph, direction: Any, by: Any) -> Any:
    inputs = {"Direction": direction, "Transform": by}
    return graph.node("FunctionNodeTransformDirection", inputs).outputs["Direction"]


def _at(graph: NodeGraph, value: Any, index: Any, domain: str, kind: str = "FLOAT_VECTOR") -> Any:
    """Value of a field at one of the elements of the geometry that it is of."""
    inputs = {"Value": value, "Index": index}
    return graph.node("GeometryNodeFieldAtIndex", inputs, data_type=kind, domain=domain).outputs["Value"]


def _in_cells(graph: NodeGraph, table: _Table) -> Any:
    """The root in cells of the table."""
    inputs = {"Vector": graph.attribute(_ROOT, "FLOAT_VECTOR"), "Transform": table.from_scatter}
    return graph.node("FunctionNodeTransformPoint", inputs).outputs["Vector"]


def _bent_passes(graph: NodeGraph, table: _Table, plant: Plant, frame: Number) -> Any:
    """The vertices of the table with what those passes come to that are the latest of their cells, or before these."""
    active, *later = (graph.number(part) for part in graph.separated(graph.attribute(ACTIVE, "FLOAT_VECTOR")))
    start, end, passes = graph.parts(graph.attribute(TIMES, "FLOAT_VECTOR"))
    down, up, above = graph.parts(graph.attribute(PACE, "FLOAT_VECTOR"))
    reach, lasting, is_second = graph.parts(graph.attribute(SHARES, "FLOAT_VECTOR"))
    by = Pass(start, end, down, up, reach, lasting, passes, above)
    (standing, weight), (worn, _) = (bend(by, plant, frame, table.frame_rate, chance) for chance in (NO_ONE, EVERYONE))
    remain = cover(passes, plant.half_after)
    acts, ends = graph.compare("LESS_EQUAL", active.socket, frame.socket), []
    for until in later:
        ends.append(graph.both(acts, graph.compare("LESS_THAN", frame.socket, until.socket)))
    held = graph.combined(standing.socket, worn.socket, remain.socket)
    vertices = graph.store(table.vertices, _HELD, held, ends[1], "FLOAT_VECTOR")

    before = graph.math("SUBTRACT", graph.node("GeometryNodeInputIndex").outputs["Index"], 1.0)
    yields = (is_second * (1.0 - weight)).socket
    older = _at(graph, graph.attribute(_HELD, "FLOAT_VECTOR"), before, "POINT")
    older = graph.vector("MULTIPLY", older, graph.combined(yields, yields, 1.0))
    vertices = graph.store(vertices, _OLDER, older, ends[0], "FLOAT_VECTOR")

    pressed = ((frame - start) / (end - start).at_least(1.0)).within_one()
    sink = graph.attribute(SINK, "FLOAT_VECTOR")
    was = graph.scaled(_at(graph, sink, before, "POINT"), is_second.socket)
    sunk = graph.vector("ADD", was, graph.scaled(graph.vector("SUBTRACT", sink, was), pressed.socket))
    return graph.store(vertices, _SUNK, sunk, ends[0], "FLOAT_VECTOR")


def _latest(graph: NodeGraph, table: _Table, frame: Number) -> Any:
    """The latest of the passes of a root that have begun, from 1 on; 0 without any."""
    last = graph.combined(table.columns.socket, table.rows.socket, 0.0)
    cell = graph.vector("MINIMUM", graph.vector("FLOOR", _in_cells(graph, table)), last)
    cell = graph.vector("MAXIMUM", cell, (0.0, 0.0, 0.0))
    tile = graph.vector("FLOOR", graph.scaled(cell, graph.math("DIVIDE", 1.0, table.tile.socket)))
    number = graph.dot(tile, graph.combined(1.0, table.row.socket))
    begin = graph.at_index(table.vertices, graph.attribute(TILES, "INT"), number, "INT")
    slot = graph.math("ADD", begin, graph.dot(cell, graph.combined(1.0, table.tile.socket)))

    active = graph.separated(graph.attribute(ACTIVE, "FLOAT_VECTOR"))[0]
    before = graph.accumulated(graph.compare("LESS_EQUAL", active, frame.socket), "INT").outputs["Leading"]
    index = graph.node("GeometryNodeInputIndex").outputs["Index"]
    first = graph.attribute(FIRST, "INT")
    end = _at(graph, first, graph.math("ADD", index, 1.0), "POINT", "INT")
    begun = graph.number(_at(graph, before, end, "POINT", "INT")) - graph.number(
        _at(graph, before, first, "POINT", "INT")
    )
    latest = (graph.number(first) + begun) * begun.above(0.5)
    return graph.at_index(table.vertices, latest.socket, slot, "INT")


def _moved(graph: NodeGraph, table: _Table, chosen: Any) -> Any:
    """How a touched root moves, as `_MOVED` has it."""
    latest = graph.number(graph.attribute(_PASS, "INT")) - 1.0

    def of_pass(name: str, index: Number = latest) -> Any:
        return graph.at_index(table.vertices, graph.attribute(name, "FLOAT_VECTOR"), index.socket)

    chance, ways = graph.number(graph.attribute(_CHANCE)), []
    for bends, index in ((_HELD, latest), (_OLDER, latest - 1.0)):
        standing, worn, remain = graph.parts(of_pass(bends))
        angle = standing + (worn - standing) * chance.above(remain)
        ways.append(graph.scaled(of_pass(LEAN, index), (angle * (pi / 2)).socket))
    slope = of_pass(_SUNK)
    steep = graph.vector("LENGTH", graph.vector("MULTIPLY", slope, (1.0, 1.0, 0.0)), output="Value")
    level = (0.0 - graph.number(graph.math("ARCTANGENT", steep))) / graph.number(steep)
    tilt = graph.choose("VECTOR", chosen["Stands"], graph.scaled(slope, level.socket), graph.vector("ADD", *ways))
    beside = graph.vector("SUBTRACT", graph.vector("FRACTION", _in_cells(graph, table)), (0.5, 0.5, 0.0))
    x, y, _ = graph.parts(beside)
    height = graph.dot(slope, graph.combined(x.socket, y.socket, 1.0))
    tilt = graph.parts(tilt)
    return graph.combined(tilt[0].socket, tilt[1].socket, graph.choose("FLOAT", chosen["Sinks"], 0.0, height))


def _stored(graph: NodeGraph, geometry: Any, domain: str, root: Any, latest: Any, moved: Any, each: Any = None) -> Any:
    """The geometry with its roots and how the touched ones move, as attributes of a domain; `each` numbers plants."""
    geometry = graph.store(geometry, _ROOT, root, True, "FLOAT_VECTOR", domain)
    geometry = graph.store(geometry, _PASS, latest, True, "INT", domain)
    is_touched = graph.compare("GREATER_THAN", graph.attribute(_PASS, "INT"), 0.5)
    geometry = graph.store(geometry, _TOUCHED, is_touched, True, "BOOLEAN", domain)
    is_touched = graph.attribute(_TOUCHED, "BOOLEAN")
    random = graph.node("FunctionNodeRandomValue", data_type="FLOAT")
    if each is not None:
        graph.link(each, next(socket for socket in random.inputs if socket.name == "ID"))
    chance = next(socket for socket in random.outputs if socket.enabled)
    geometry = graph.store(geometry, _CHANCE, chance, is_touched, domain=domain)
    geometry = graph.store(geometry, _MOVED, moved, is_touched, "FLOAT_VECTOR", domain)
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


def _put(graph: NodeGraph, table: _Table, geometry: Any, domain: str, position: Any) -> Any:
    """Move points whose blade leans: what is upright of their way from the root turns, and keeps its length."""
    toward, angle, shift = _lean_and_shift(graph, table)
    sine, cosine = (graph.number(graph.math(name, angle.socket)) for name in ("SINE", "COSINE"))
    lean = graph.vector("ADD", graph.scaled(toward, sine.socket), graph.scaled(table.up, (cosine - 1.0).socket))
    is_touched = graph.attribute(_TOUCHED, "BOOLEAN")
    base = graph.dot(graph.attribute(_ROOT, "FLOAT_VECTOR"), table.up)
    for name, value, kind in ((_LEAN, lean, "FLOAT_VECTOR"), (_SHIFT, shift, "FLOAT_VECTOR"), (_BASE, base, "FLOAT")):
        geometry = graph.store(geometry, name, value, is_touched, kind, domain)
    height = (graph.number(graph.dot(position, table.up)) - graph.number(graph.attribute(_BASE))).at_least(0.0)
    aside = graph.scaled(graph.attribute(_LEAN, "FLOAT_VECTOR"), height.socket)
    offset = graph.vector("ADD", aside, graph.attribute(_SHIFT, "FLOAT_VECTOR"))
    return graph.put(geometry, is_touched, graph.vector("ADD", position, offset))


def _instances_moved(graph: NodeGraph, table: _Table, geometry: Any, chosen: Any) -> Any:
    """Turn instances about their origins: plants until they lie, litter with the ground."""
    toward, angle, shift = _lean_and_shift(graph, table)
    own_rotation = graph.node("GeometryNodeInputInstanceRotation").outputs["Rotation"]
    turned = graph.node("FunctionNodeRotateVector", {"Vector": (0.0, 0.0, 1.0), "Rotation": own_rotation})
    stem = graph.choose("VECTOR", chosen["Stands"], table.up, turned.outputs["Vector"])
    to_lie = graph.number(graph.math("ARCCOSINE", graph.dot(stem, toward)))
    to_ground = {
        "Axis": graph.vector("CROSS_PRODUCT", stem, toward),
        "Angle": (angle * to_lie / (pi / 2)).socket,
    }
    rotation = graph.node("FunctionNodeAxisAngleToRotation", to_ground).outputs["Rotation"]
    pivot = {"Rotation": rotation, "Pivot Point": graph.attribute(_ROOT, "FLOAT_VECTOR")}
    for kind, change in (("Rotate", pivot), ("Translate", {"Translation": shift})):
        touched = {"Instances": geometry, "Selection": graph.attribute(_TOUCHED, "BOOLEAN"), "Local Space": False}
        geometry = graph.node(f"GeometryNode{kind}Instances", touched | change).outputs["Instances"]
    return geometry


def _loose_parts_moved(graph: NodeGraph, table: _Table, geometry: Any, position: Any, latest: Any, moved: Any) -> Any:
    """Bend the separate parts of a mesh about their roots, the middle of their lowest vertices.

    What each sum takes is stored first: a sum within another is worked out twice.
    """
    parts = graph.node("GeometryNodeSeparateComponents", {"Geometry": geometry})
    island = graph.node("GeometryNodeInputMeshIsland").outputs["Island Index"]
    mesh = graph.store(parts.outputs["Mesh"], _PART, island, True, "INT")
    part, low = graph.attribute(_PART, "INT"), graph.attribute(_LOW)

    def total(value: Any) -> Any:
        node = graph.accumulated(value, "FLOAT_VECTOR")
        graph.link(part, node.inputs["Group ID"])
        return next(socket for socket in node.outputs if socket.name == "Total" and socket.enabled)

    height = graph.number(graph.dot(position, table.up))
    among = graph.number(graph.math("ADD", 1.0, 0.0))
    for _ in range(MEANS):
        total_height, count, _ = graph.parts(total(graph.combined((height * among).socket, among.socket)))
        mesh = graph.store(mesh, _LOW, (1.0 - height.above(total_height / count + 1e-6)).socket, True)
        among = graph.number(low)
    share = graph.math("DIVIDE", 1.0, graph.separated(total(graph.combined(low)))[0])
    root = graph.scaled(total(graph.scaled(position, low)), share)
    mesh = _stored(graph, mesh, "POINT", root, latest, moved, part)
    mesh = _put(graph, table, mesh, "POINT", position)
    joined = graph.node("GeometryNodeJoinGeometry")
    for piece in [mesh, *(socket for socket in parts.outputs if socket.name != "Mesh")]:
        graph.link(piece, joined.inputs["Geometry"])
    return joined.outputs["Geometry"]
