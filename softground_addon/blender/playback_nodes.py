"""The node group that plays a bake: attributes and the time in, the ground at that time out.

It is native Blender data and needs nothing of this add-on. Each vertex stands still most of the time: before its first
movement where it was, after its last where that left it. Only for vertices in between is the table of timelines looked
up (see `core.timelines`), whose rows are the vertices of a mesh of its own. The group is the same for every bake but
for the number of bisections. Positions start from the undisturbed ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy

from ..core.timelines import NO_VISIT

GROUP = "SoftGround Playback"

REST = "softground_rest"
MOVED = "softground_moved"
"""Whether the bake moves or touches the vertex at all."""
SPAN = "softground_span"
"""Frame from which on something happens to the vertex, frame from which on nothing does, and its change of height in
all [m]."""
FIRST_ROW, LAST_ROW = "softground_first_row", "softground_last_row"
"""The vertex's rows in the table."""
ACTIVE = "softground_active"
"""Whether something happens to the vertex at the frame that is shown; made by the nodes."""
CONTACT = "softground_contact"
"""Of a row of the table: first and last frame of the latest contact that has begun, and its pressure [Pa]. The row's
position is its frame, the change of height and the compression [m]."""
COMPRESSION, RIM, AGE, PRESSURE = "softground_compression", "softground_rim", "softground_age", "softground_pressure"

LOADING = 0.2
"""Part of a contact over which the pressure rises, and again falls: about that of a walking step."""

COLUMN, ROW = 180.0, 160.0
"""Spacing of the nodes in the editor."""


def build(*, table: bpy.types.Object, bisections: int, up: Sequence[float], frame_rate: float) -> bpy.types.NodeTree:
    """A new node group.

    Parameters
    ----------
    table : bpy.types.Object
        Its vertices are the rows of the timelines.
    bisections : int
        2 to this power is more than the largest number of rows of one vertex.
    up : (3,) floats
        World up in the ground's own space and units, of the length of one metre.
    frame_rate : float
        Scene frames per second [Hz].
    """
    graph = _Graph(GROUP)
    geometry, frame = graph.inputs(up)
    first, last, total = graph.components(graph.attribute(SPAN))
    over = graph.compare("GREATER_EQUAL", frame, last)
    under_way = graph.both(graph.compare("LESS_EQUAL", first, frame), graph.compare("LESS_THAN", frame, last))
    geometry = graph.store(geometry, ACTIVE, under_way, MOVED, kind="BOOLEAN")
    geometry = graph.raise_from_rest(geometry, MOVED, graph.math("MULTIPLY", total, over))
    rows = _Table(graph, table)
    row = _search(graph, rows, frame, bisections)
    _, height, compression = graph.components(rows.between(row, frame))
    graph.next_row()
    geometry = graph.raise_from_rest(geometry, ACTIVE, height)

    graph.next_row()
    shaded = geometry
    rim = graph.math("MAXIMUM", graph.math("ADD", height, compression), 0.0)
    for name, value in ((COMPRESSION, compression), (RIM, rim)):
        at_the_end = graph.attribute(name, "FLOAT")
        shaded = graph.store(shaded, name, graph.math("MULTIPLY", at_the_end, over), MOVED)
        shaded = graph.store(shaded, name, value, ACTIVE)
    shaded = _age_and_pressure(graph, shaded, rows, row, frame, over, frame_rate)
    graph.next_row()
    graph.finish(graph.choose("GEOMETRY", graph.with_shading, geometry, shaded))
    return graph.tree


def table_of(tree: bpy.types.NodeTree) -> bpy.types.Object | None:
    """The table that a group looks up."""
    for node in tree.nodes:
        if node.bl_idname == "GeometryNodeObjectInfo":
            found: bpy.types.Object | None = node.inputs["Object"].default_value
            return found
    return None


class _Table:
    """Look-ups in the timelines."""

    def __init__(self, graph: _Graph, table: bpy.types.Object) -> None:
        graph.next_row()
        info = graph.node("GeometryNodeObjectInfo")
        info.inputs["Object"].default_value = table
        self._graph, self._geometry = graph, info.outputs["Geometry"]
        self._position = graph.node("GeometryNodeInputPosition").outputs["Position"]
        self._contact = graph.attribute(CONTACT)

    def at(self, row: Any) -> Any:
        """Frame, height and compression of a row."""
        return self._graph.sample(self._geometry, self._position, row)

    def contact(self, row: Any) -> tuple[Any, Any, Any]:
        """First and last frame of the latest contact at a row, and its pressure."""
        return self._graph.components(self._graph.sample(self._geometry, self._contact, row))

    def between(self, row: Any, frame: Any) -> Any:
        """Frame, height and compression at a time between a row and the next."""
        graph = self._graph
        graph.next_row()
        before, after = self.at(row), self.at(graph.math("ADD", row, 1.0))
        share = graph.map_range(frame, graph.components(before)[0], graph.components(after)[0])
        step = graph.vector("SUBTRACT", after, before)
        return graph.vector("ADD", before, graph.vector("SCALE", step, scale=share))


def _search(graph: _Graph, rows: _Table, frame: Any, bisections: int) -> Any:
    """The last row of the vertex that is not after the frame."""
    graph.next_row()
    start, end = graph.repeat(bisections, Row="INT", Step="FLOAT")
    graph.link(graph.attribute(FIRST_ROW, "INT"), start.inputs["Row"])
    graph.link(2.0 ** (bisections - 1), start.inputs["Step"])
    ahead = graph.math("ADD", start.outputs["Row"], start.outputs["Step"])
    inside = graph.compare("LESS_EQUAL", ahead, graph.attribute(LAST_ROW, "INT"))
    passed = graph.compare("LESS_EQUAL", graph.components(rows.at(ahead))[0], frame)
    row = graph.choose("INT", graph.both(inside, passed), start.outputs["Row"], ahead)
    graph.link(row, end.inputs["Row"])
    graph.link(graph.math("MULTIPLY", start.outputs["Step"], 0.5), end.inputs["Step"])
    return end.outputs["Row"]


def _age_and_pressure(
    graph: _Graph, geometry: Any, rows: _Table, row: Any, frame: Any, over: Any, frame_rate: float
) -> Any:
    """Time since the latest contact that has begun, and the pressure while it lasts."""
    for selection, latest in ((MOVED, graph.attribute(LAST_ROW, "INT")), (ACTIVE, row)):
        graph.next_row()
        start, end, pressure = rows.contact(latest)
        since = graph.math("MAXIMUM", graph.math("SUBTRACT", frame, end), 0.0)
        begun = graph.compare("LESS_THAN", start, NO_VISIT)
        if selection == MOVED:
            begun = graph.both(begun, over)
        age = graph.choose("FLOAT", begun, -1.0, graph.math("DIVIDE", since, frame_rate))
        geometry = graph.store(geometry, AGE, age, selection)
    graph.next_row()
    passed = graph.map_range(frame, start, end)
    sides = graph.math("MINIMUM", passed, graph.math("SUBTRACT", 1.0, passed))
    loaded = graph.math("MULTIPLY", sides, 1.0 / LOADING, clamp=True)
    return graph.store(geometry, PRESSURE, graph.math("MULTIPLY", loaded, pressure), ACTIVE)


class _Graph:
    """A node group while it is built, laid out in rows."""

    def __init__(self, name: str) -> None:
        self.tree: Any = bpy.data.node_groups.new(name, "GeometryNodeTree")
        self.tree.is_modifier = True
        self._place = [0.0, 0.0]

    def inputs(self, up: Sequence[float]) -> tuple[Any, Any]:
        """The group's geometry and the scene's frame, with its fraction."""
        interface = self.tree.interface
        interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
        interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
        shading = interface.new_socket("Shading", in_out="INPUT", socket_type="NodeSocketBool")
        shading.default_value = True
        shading.description = "Let compression, rim, age and pressure follow the time, for materials that read them"
        direction = interface.new_socket("Up", in_out="INPUT", socket_type="NodeSocketVector")
        direction.default_value = tuple(up)
        direction.description = "World up in the space of the ground, of the length of one metre"
        group = self.node("NodeGroupInput")
        self.with_shading, self.up = group.outputs["Shading"], group.outputs["Up"]
        return group.outputs["Geometry"], self.node("GeometryNodeInputSceneTime").outputs["Frame"]

    def finish(self, geometry: Any) -> None:
        node = self.node("NodeGroupOutput")
        self.link(geometry, node.inputs["Geometry"])

    def next_row(self) -> None:
        self._place = [2 * COLUMN, self._place[1] - ROW]

    def node(self, kind: str) -> Any:
        node = self.tree.nodes.new(kind)
        node.location = self._place
        node.hide = kind not in ("NodeGroupInput", "NodeGroupOutput")
        self._place[0] += COLUMN
        return node

    def link(self, source: Any, socket: Any) -> None:
        """Connect an output, or set a number or vector."""
        if isinstance(source, bpy.types.NodeSocket):
            self.tree.links.new(source, socket)
        else:
            socket.default_value = source

    def attribute(self, name: str, kind: str = "FLOAT_VECTOR") -> Any:
        node = self.node("GeometryNodeInputNamedAttribute")
        node.data_type = kind
        node.inputs["Name"].default_value = name
        return node.outputs["Attribute"]

    def raise_from_rest(self, geometry: Any, selection: str, height: Any) -> Any:
        """Put the selected vertices so many metres above their undisturbed positions."""
        node = self.node("GeometryNodeSetPosition")
        self.link(geometry, node.inputs["Geometry"])
        self.link(self.attribute(selection, "BOOLEAN"), node.inputs["Selection"])
        self.link(self.attribute(REST), node.inputs["Position"])
        self.link(self.vector("SCALE", self.up, scale=height), node.inputs["Offset"])
        return node.outputs["Geometry"]

    def store(self, geometry: Any, name: str, value: Any, selection: str, *, kind: str = "FLOAT") -> Any:
        node = self.node("GeometryNodeStoreNamedAttribute")
        node.data_type, node.domain = kind, "POINT"
        node.inputs["Name"].default_value = name
        self.link(geometry, node.inputs["Geometry"])
        self.link(self.attribute(selection, "BOOLEAN"), node.inputs["Selection"])
        self.link(value, node.inputs["Value"])
        return node.outputs["Geometry"]

    def math(self, operation: str, first: Any, second: Any, *, clamp: bool = False) -> Any:
        node = self.node("ShaderNodeMath")
        node.operation, node.use_clamp = operation, clamp
        self.link(first, node.inputs[0])
        self.link(second, node.inputs[1])
        return node.outputs["Value"]

    def both(self, first: Any, second: Any) -> Any:
        node = self.node("FunctionNodeBooleanMath")
        node.operation = "AND"
        self.link(first, node.inputs[0])
        self.link(second, node.inputs[1])
        return node.outputs["Boolean"]

    def compare(self, operation: str, first: Any, second: Any) -> Any:
        node = self.node("FunctionNodeCompare")
        node.data_type, node.operation = "FLOAT", operation
        self.link(first, node.inputs["A"])
        self.link(second, node.inputs["B"])
        return node.outputs["Result"]

    def vector(self, operation: str, first: Any, second: Any = None, *, scale: Any = None) -> Any:
        node = self.node("ShaderNodeVectorMath")
        node.operation = operation
        self.link(first, node.inputs[0])
        if second is not None:
            self.link(second, node.inputs[1])
        if scale is not None:
            self.link(scale, node.inputs["Scale"])
        return node.outputs["Value" if operation == "DOT_PRODUCT" else "Vector"]

    def components(self, vector: Any) -> tuple[Any, Any, Any]:
        node = self.node("ShaderNodeSeparateXYZ")
        self.link(vector, node.inputs[0])
        return node.outputs["X"], node.outputs["Y"], node.outputs["Z"]

    def map_range(self, value: Any, low: Any, high: Any) -> Any:
        """(value - low) / (high - low), limited to 0 and 1; 0 where low = high."""
        node = self.node("ShaderNodeMapRange")
        node.clamp, node.interpolation_type = True, "LINEAR"
        for name, source in (("Value", value), ("From Min", low), ("From Max", high)):
            self.link(source, node.inputs[name])
        return node.outputs["Result"]

    def sample(self, geometry: Any, value: Any, index: Any) -> Any:
        """A vector of the geometry's point of that number."""
        node = self.node("GeometryNodeSampleIndex")
        node.data_type, node.domain, node.clamp = "FLOAT_VECTOR", "POINT", True
        self.link(geometry, node.inputs["Geometry"])
        self.link(value, node.inputs["Value"])
        self.link(index, node.inputs["Index"])
        return node.outputs["Value"]

    def repeat(self, iterations: int, **items: str) -> tuple[Any, Any]:
        """Begin and end of a part that is worked through so many times; its state by name and type."""
        start, end = self.node("GeometryNodeRepeatInput"), self.node("GeometryNodeRepeatOutput")
        start.pair_with_output(end)
        end.repeat_items.clear()
        for name, kind in items.items():
            end.repeat_items.new(kind, name)
        start.inputs["Iterations"].default_value = iterations
        return start, end

    def choose(self, kind: str, switch: Any, when_false: Any, when_true: Any) -> Any:
        node = self.node("GeometryNodeSwitch")
        node.input_type = kind
        self.link(switch, node.inputs["Switch"])
        self.link(when_false, node.inputs["False"])
        self.link(when_true, node.inputs["True"])
        return node.outputs["Output"]
