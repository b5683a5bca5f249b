"""The node group by which plants and litter give way: a scatter and the time in, the scatter at that time out.

It is native Blender data and needs nothing of this add-on. What it looks up are the vertices of an object, the table of
`trampling_table`: tiles of small cells, and for each cell the passes of soles over it. The law, `core.plants.bending`,
is worked out for each pass that acts at the time; a root finds its cell by arithmetic, without a search, and takes what
is there. What no sole has come near is only compared.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from math import pi
from typing import Any

import bpy

from ...core.numerics.slices import Slices, sliced
from ...core.plants.bending import EVERYONE, NO_ONE, Pass, Plant, bend, cover
from ..nodes.node_graph import NodeGraph, Number, build
from ..nodes.node_modifiers import GroupInput, new_group
from . import litter_nodes, wind_nodes
from .table_nodes import UNITS, Table, any_of, at_element, in_cells, is_over, raised_at, slot_of, table_of, turned
from .trampling_layout import ACTIVE, FIRST, LEAN, MARK, PACE, SHARES, SINK, TIMES, VERSION

GROUP = "SoftGround Give Way"
BENT = "softground_bent"
"""For materials, of curves, instances and points: from 0 to 1, how far they lie."""
MADE = "softground_give_way_made"
"""Of the group: what it was when it was made."""
_NUMBERS = ("VALUE", "INT", "VECTOR")
_ROOT, _PART, _LOW = (f".softground_{name}" for name in ("root", "part", "low"))
"""Of the vertices of loose parts meanwhile."""

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
    GroupInput("Surface", None, "Ground that hair curves follow: its snow does not lift them", kind="Object"),
    GroupInput("Rolls", 0.0, "How far what lies there rolls where the ground is too hard to press it in", (0.0, 10.0)),
)
BURIED = 0.5
"""Share of litter that a rim covers as it rises."""
FLATTEST = 0.9999
"""Share by which instances are laid flat, which without any thickness would have no sides to shade."""
MEANS = 3
"""How many times the lower part of a blade of a mesh is taken, until its lowest vertices are left."""


@sliced
def ensure_group() -> Slices[Any]:
    """The node group of this version, made on first use."""
    known = next((group for group in bpy.data.node_groups if group.get(MARK) == VERSION and not group.library), None)
    if known is not None:
        return known
    tree = new_group(GROUP, MARK, INPUTS)
    try:
        yield from build.slices(tree, _fill)
    except BaseException:
        bpy.data.node_groups.remove(tree)
        raise
    tree[MARK], tree[MADE] = VERSION, _digest(tree)
    return tree


def is_edited(tree: Any) -> bool:
    """True of a node group of any version whose nodes are not those that were made."""
    made = tree.get(MADE)
    return made is not None and made != _digest(tree)


def _digest(tree: Any) -> str:
    """Hash of the nodes of a group, of what is set in them and of their links, wherever they lie in the editor.

    Sockets that are not shown differ between Blender's versions.
    """
    nodes = {
        node.name: (
            node.bl_idname,
            node.mute,
            getattr(node, "operation", ""),
            *(
                _rounded(socket.default_value)
                for socket in node.inputs
                if socket.type in _NUMBERS and socket.enabled and not socket.is_linked
            ),
        )
        for node in tree.nodes
    }
    links = (
        (link.from_node.name, link.from_socket.name, link.to_node.name, link.to_socket.name, link.is_muted)
        for link in tree.links
    )
    return sha256(repr((sorted(nodes.items()), sorted(links))).encode()).hexdigest()


def _rounded(value: Any) -> Any:
    """A number or a vector of them in six digits."""
    return f"{value:.6g}" if isinstance(value, int | float) else tuple(f"{part:.6g}" for part in value)


def is_give_way(tree: Any) -> bool:
    """True of a node group that `ensure_group` made, of any version."""
    return MARK in tree.keys()  # noqa: SIM118  (an ID is no mapping)


def _fill(graph: NodeGraph) -> None:
    chosen = graph.node("NodeGroupInput").outputs
    frame = graph.number(graph.frame())
    plant = Plant(*(graph.number(chosen[name]) for name in ("Height", "Stiffness", "Recovery", "Breaks", "Half After")))
    table = table_of(graph, chosen)
    graph.next_row()
    passes = _passes(graph, table, plant, frame)

    given = chosen["Geometry"]
    graph.next_row()
    first = graph.node("GeometryNodePointsOfCurve").outputs["Point Index"]
    position = graph.position()
    root, move = at_element(graph, position, first, "POINT"), partial(_put, graph, table, position)
    sway = partial(wind_nodes.lean, table, plant, frame)
    geometry = _given_way(graph, table, passes, given, "CURVE", root, move, sway)
    graph.next_row()
    move = partial(_instances_moved, graph, table, position)
    geometry = _given_way(graph, table, passes, geometry, "INSTANCE", position, move, sway)
    graph.next_row()
    loose = _loose_parts_moved(graph, table, passes, geometry, position, sway)
    geometry = graph.choose("GEOMETRY", chosen["Loose Parts"], geometry, loose)
    always = graph.either(table.is_windy.socket, graph.logic("NOT", table.sinks))  # snow may lift it
    acts = graph.both(
        graph.either(always, graph.compare("LESS_EQUAL", table.first_frame.socket, frame.socket)),
        graph.compare("LESS_THAN", 0.5, table.tile.socket),
    )
    graph.finish(graph.choose("GEOMETRY", acts, given, geometry))


@dataclass(frozen=True)
class _Passes:
    """The table with what its passes come to at the time, as fields.

    Attributes
    ----------
    counted : geometry
        The table, with what `latest` needs alone.
    latest : int
        Of each slot, the latest pass that has begun; 0 without any.
    vertices : geometry
        The table, with what follows.
    lean, further : vectors
        Way of what is upright, for its length, in the scatter's space; and how much further what is worn down leans.
    share : vector
        Share of plants that are not worn down; how far they lie, and how much further the others do.
    ground : vector
        Slope and height of the ground [cells].
    sent : vector
        Way along the ground of what lies on it, and its height above it [cells].
    """

    counted: Any
    latest: Any
    vertices: Any
    lean: Any
    further: Any
    share: Any
    ground: Any
    sent: Any


def _passes(graph: NodeGraph, table: Table, plant: Plant, frame: Number) -> _Passes:
    active, settled, _ = graph.parts(graph.attribute(ACTIVE, "FLOAT_VECTOR"))
    before = graph.accumulated(graph.compare("LESS_EQUAL", active.socket, frame.socket), "INT").outputs["Leading"]
    counted, (before,) = graph.captured(table.vertices, graph.number(before), kinds="INT")
    index, first = graph.node("GeometryNodeInputIndex").outputs["Index"], graph.attribute(FIRST, "INT")
    following = at_element(graph, first, graph.math("ADD", index, 1.0), "POINT", "INT")
    of_slot = [graph.number(at_element(graph, before.socket, at, "POINT", "INT")) for at in (first, following)]
    count = of_slot[1] - of_slot[0]
    latest = (graph.number(first) + count - 1.0) * count.above(0.5)

    start, end, passes = graph.parts(graph.attribute(TIMES, "FLOAT_VECTOR"))
    down, up, above = graph.parts(graph.attribute(PACE, "FLOAT_VECTOR"))
    reach, lasting, is_second = graph.parts(graph.attribute(SHARES, "FLOAT_VECTOR"))
    by = Pass(start, end, down, up, reach, lasting, passes, above)
    (standing, weight), (worn, _) = (bend(by, plant, frame, table.frame_rate, chance) for chance in (NO_ONE, EVERYONE))
    held = graph.combined(standing.socket, worn.socket, cover(passes, plant.half_after).socket)
    pressed = ((frame - start) / (settled - start)).within_one()
    fields, kinds = (graph.number(held), weight, pressed), ("VECTOR", "FLOAT", "FLOAT")
    vertices, (held, weight, pressed) = graph.captured(table.vertices, *fields, kinds=kinds)

    def earlier(value: Any) -> Any:
        return graph.scaled(at_element(graph, value, graph.math("SUBTRACT", index, 1.0), "POINT"), is_second.socket)

    toward, sink = graph.attribute(LEAN, "FLOAT_VECTOR"), graph.attribute(SINK, "FLOAT_VECTOR")
    *bends, remain = graph.parts(held.socket)
    *older, remained = graph.parts(earlier(held.socket))
    remained = remained + (1.0 - is_second)
    remain = remained + (remain - remained) * weight
    was, was_toward = earlier(sink), graph.scaled(earlier(toward), (1.0 - weight).socket)
    ground = graph.vector("MULTIPLY_ADD", graph.vector("SUBTRACT", sink, was), pressed.socket, was)
    steep = graph.vector("LENGTH", graph.vector("MULTIPLY", ground, (1.0, 1.0, 0.0)), output="Value")
    level = (graph.number(graph.math("ARCTANGENT", steep)) / graph.number(steep)) * (-2.0 / pi)
    tilt = graph.vector("MULTIPLY", graph.scaled(ground, level.socket), (1.0, 1.0, 0.0))
    leans, shares = [], []
    for now, then in zip(bends, older, strict=True):
        way = graph.vector("MULTIPLY_ADD", was_toward, then.socket, graph.scaled(toward, now.socket))
        way = graph.choose("VECTOR", table.stands, tilt, way)
        share = graph.number(graph.vector("LENGTH", way, output="Value"))
        sine = graph.number(graph.math("SINE", (share * (pi / 2)).socket))
        x, y = (part * sine / share for part in graph.parts(way)[:2])
        lean = graph.scaled(table.up, ((1.0 - sine * sine).root() - 1.0).socket)
        for axis, part in zip(table.ways, (x, y), strict=False):
            lean = graph.vector("MULTIPLY_ADD", axis, part.socket, lean)
        leans.append(lean)
        shares.append(share)
    share = graph.combined(remain.socket, shares[0].socket, (shares[1] - shares[0]).socket)
    sent = litter_nodes.way(graph, table, by, plant.height, frame)
    sent = graph.choose("VECTOR", table.stands, sent, (0.0, 0.0, 0.0))
    vectors = leans[0], graph.vector("SUBTRACT", leans[1], leans[0]), share, ground, sent
    vertices, captured = graph.captured(vertices, *map(graph.number, vectors), kinds="VECTOR")
    return _Passes(counted, latest.socket, vertices, *(number.socket for number in captured))


@dataclass(frozen=True)
class _Moved:
    """How plants move, as fields: by `lean` times a point's height and by `shift`; how far they lie, from 0 to 1."""

    lean: Any
    shift: Any
    bent: Any
    is_touched: Any


def _given_way(
    graph: NodeGraph,
    table: Table,
    passes: _Passes,
    geometry: Any,
    domain: str,
    root: Any,
    move: Callable[[Any, _Moved], Any],
    sway: Callable[[Any, Number], Number],
    each: Any = None,
) -> Any:
    """The geometry moved, or as it was where no sole has touched any of its plants, which `each` numbers, and no wind
    does."""
    place = in_cells(graph, table, root)
    plants, (place,) = graph.captured(geometry, graph.number(place), kinds="VECTOR", domain=domain)
    place = place.socket
    # Height by which snow lifts what stands on it, where that does not sink by itself.
    snow = graph.number(graph.choose("FLOAT", table.sinks, raised_at(graph, table, root), 0.0))
    is_lifted = snow.above(0.0)
    is_any_lifted = graph.choose("INT", table.sinks, any_of(graph, plants, is_lifted.socket, domain), 0)
    is_near = graph.either(table.is_windy.socket, any_of(graph, plants, is_over(graph, table, place), domain))
    is_near = graph.either(is_near, is_any_lifted)
    latest = graph.at_index(passes.counted, passes.latest, slot_of(graph, table, place), "INT")
    plants, (latest,) = graph.captured(plants, graph.number(latest), kinds="INT", domain=domain)
    is_touched = latest.above(0.5).at_least(table.is_windy).at_least(is_lifted).socket
    touched = any_of(graph, plants, is_touched, domain)

    random = graph.node("FunctionNodeRandomValue", data_type="FLOAT")
    if each is not None:
        graph.link(each, next(socket for socket in random.inputs if socket.name == "ID"))
    chance = graph.number(next(socket for socket in random.outputs if socket.enabled))
    sent_off, sent, landing, acting = litter_nodes.sent_off(graph, table, passes, plants, domain, place, latest, chance)
    plants = graph.choose("GEOMETRY", table.stands, sent_off, plants)
    acting = graph.choose("INT", table.stands, acting, latest.socket)
    place = graph.choose("VECTOR", table.stands, landing, place)
    lean, further, share, ground = (
        graph.at_index(passes.vertices, value, acting)
        for value in (passes.lean, passes.further, passes.share, passes.ground)
    )
    remain, bent, bent_further = graph.parts(share)
    is_worn = chance.above(remain)
    lean = graph.vector("ADD", graph.scaled(further, is_worn.socket), lean)
    bent = bent + bent_further * is_worn
    swaying = sway(place, chance) * (1.0 - bent)
    swayed = wind_nodes.leaning(graph, table, swaying)
    lean = graph.choose("VECTOR", table.is_windy.socket, lean, graph.vector("ADD", lean, swayed))
    bent = (bent + swaying).at_most(1.0).where(table.is_windy, otherwise=bent)
    beside = graph.vector("MULTIPLY_ADD", graph.vector("FRACTION", place), (1.0, 1.0, 0.0), (-0.5, -0.5, 1.0))
    height = graph.number(graph.dot(ground, beside))
    seen = height.at_most(0.0) + height.at_least(0.0) * chance.above(BURIED)
    height = graph.choose("FLOAT", table.stands, seen.socket, height.socket)
    lowered = snow * table.metre * -1.0 / table.cell
    shift = graph.scaled(table.cell_up, graph.choose("FLOAT", table.sinks, lowered.socket, height))
    way = turned(graph, sent, table.to_scatter)
    shift = graph.choose("VECTOR", table.stands, graph.vector("ADD", shift, way), shift)
    if domain != "INSTANCE":
        shift = graph.vector("SUBTRACT", shift, graph.scaled(lean, graph.separated(place)[2]))
    fields = (graph.number(lean), graph.number(shift), bent)
    changed, captured = graph.captured(plants, *fields, kinds=("VECTOR", "VECTOR", "FLOAT"), domain=domain)
    lean, shift, bent = (number.socket for number in captured)
    moved = _Moved(lean, shift, bent, is_touched)
    changed = graph.store(changed, BENT, moved.bent, True, domain=domain)
    given_way = graph.choose("GEOMETRY", touched, geometry, move(changed, moved))
    return graph.choose("GEOMETRY", is_near, geometry, given_way)


def _put(graph: NodeGraph, table: Table, position: Any, geometry: Any, moved: _Moved) -> Any:
    """Move points whose blade leans: what is upright of their way from the root turns, and keeps its length.

    All are moved, those that no sole has touched by nothing: to choose some takes longer.
    """
    turned_by = graph.scaled(moved.lean, graph.dot(position, table.up))
    return graph.put(geometry, True, offset=graph.vector("ADD", turned_by, moved.shift))


def _instances_moved(graph: NodeGraph, table: Table, position: Any, geometry: Any, moved: _Moved) -> Any:
    """Lean plants about their origins as points do, tufts with all of their blades; turn litter with the ground."""
    lean = graph.scaled(moved.lean, FLATTEST)
    shift = graph.vector("SUBTRACT", moved.shift, graph.scaled(lean, graph.dot(position, table.up)))
    along = zip(graph.separated(table.up), UNITS, strict=True)
    columns = [*(graph.vector("MULTIPLY_ADD", lean, part, unit) for part, unit in along), shift]
    by = graph.node("FunctionNodeCombineMatrix")
    for number, column in enumerate(columns):
        for row, part in enumerate(graph.separated(column)):
            graph.link(part, by.inputs[4 * number + row])
    before = graph.node("GeometryNodeInstanceTransform").outputs["Transform"]
    leaning = graph.node("FunctionNodeMatrixMultiply", {0: by.outputs[0], 1: before}).outputs["Matrix"]
    inputs = {"Instances": geometry, "Selection": moved.is_touched, "Transform": leaning}
    leaning = graph.node("GeometryNodeSetInstanceTransform", inputs).outputs["Instances"]

    axis = graph.vector("CROSS_PRODUCT", table.up, moved.lean)
    turn = {"Axis": axis, "Angle": graph.math("MULTIPLY", moved.bent, pi / 2)}
    rotation = graph.node("FunctionNodeAxisAngleToRotation", turn).outputs["Rotation"]
    inputs = {"Instances": geometry, "Selection": moved.is_touched, "Local Space": False}
    turned = {**inputs, "Rotation": rotation, "Pivot Point": position}
    shifted = {**inputs, "Translation": moved.shift}
    shifted["Instances"] = graph.node("GeometryNodeRotateInstances", turned).outputs["Instances"]
    turned = graph.node("GeometryNodeTranslateInstances", shifted).outputs["Instances"]
    return graph.choose("GEOMETRY", table.stands, turned, leaning)


def _loose_parts_moved(
    graph: NodeGraph,
    table: Table,
    passes: _Passes,
    geometry: Any,
    position: Any,
    sway: Callable[[Any, Number], Number],
) -> Any:
    """Bend the separate parts of a mesh about their roots, the middle of their lowest vertices.

    What each sum takes is stored first: a sum within another is worked out twice.
    """
    parts = graph.node("GeometryNodeSeparateComponents")
    graph.link(geometry, parts.inputs["Geometry"])
    island = graph.node("GeometryNodeInputMeshIsland").outputs["Island Index"]
    given = parts.outputs["Mesh"]
    mesh = graph.store(given, _PART, island, True, "INT")
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
    mesh = graph.store(mesh, _ROOT, root, True, "FLOAT_VECTOR")
    move, root = partial(_put, graph, table, position), graph.attribute(_ROOT, "FLOAT_VECTOR")
    mesh = graph.forgotten(_given_way(graph, table, passes, mesh, "POINT", root, move, sway, part), _ROOT, _PART, _LOW)
    is_near = any_of(graph, given, is_over(graph, table, in_cells(graph, table, position)), "POINT")
    is_near = graph.either(table.is_windy.socket, is_near)
    mesh = graph.choose("GEOMETRY", is_near, given, mesh)
    joined = graph.node("GeometryNodeJoinGeometry")
    for piece in [mesh, *(socket for socket in parts.outputs if socket.name != "Mesh")]:
        graph.link(piece, joined.inputs["Geometry"])
    return joined.outputs["Geometry"]
