"""The node group that plays a bake: attributes and the time in, the ground at that time out.

It is native Blender data and needs nothing of this add-on. Each vertex stands still most of the time: before its first
movement where it was, after its last where that left it. Only vertices in between have their ramps added up, three to
a layer. Positions start from the undisturbed ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy

GROUP = "SoftGround Playback"

REST = "softground_rest"
MOVED = "softground_moved"
"""Whether the bake moves or touches the vertex at all."""
SPAN = "softground_span"
"""Frame before which nothing happens to the vertex, frame after which nothing does, and change of height in all [m]."""
HEIGHTS = ("softground_height_start", "softground_height_end", "softground_height_change")
COMPRESSIONS = ("softground_press_start", "softground_press_end", "softground_press_change")
"""Vectors that hold three ramps each: first frame, last frame, change [m]; by layer."""
VISIT = "softground_visit"
"""First and last frame of a contact and its pressure [Pa], by number of the visit."""
VISITED = "softground_visited"
ACTIVE = "softground_active"
"""Whether something happens to the vertex at the frame that is shown; made by the nodes."""
PENDING = "softground_pending"
"""Whether something is still to happen to the vertex after the frame that is shown; made by the nodes."""
COMPRESSION, RIM, AGE, PRESSURE = "softground_compression", "softground_rim", "softground_age", "softground_pressure"

LOADING = 0.2
"""Part of a contact over which the pressure rises, and again falls: about that of a walking step."""

COLUMN, ROW = 180.0, 160.0
"""Spacing of the nodes in the editor."""


def numbered(name: str, layer: int) -> str:
    """Name of an attribute that exists once for each layer or visit."""
    return f"{name}_{layer}"


def build(
    *, height_layers: int, compression_layers: int, visits: int, up: Sequence[float], frame_rate: float
) -> bpy.types.NodeTree:
    """A new node group.

    Parameters
    ----------
    height_layers, compression_layers : int
        Number of layers of three ramps.
    visits : int
        Largest number of contacts of one vertex.
    up : (3,) floats
        World up in the ground's own space and units, of the length of one metre.
    frame_rate : float
        Scene frames per second [Hz].
    """
    graph = _Graph(GROUP)
    geometry, frame = graph.inputs(up)
    first, last, total = graph.components(graph.attribute(SPAN))
    under_way = graph.both(graph.compare("LESS_THAN", first, frame), graph.compare("LESS_THAN", frame, last))
    geometry = graph.store(geometry, ACTIVE, under_way, MOVED, kind="BOOLEAN")
    graph.next_row()
    over = graph.compare("GREATER_EQUAL", frame, last)
    geometry = graph.raise_from_rest(geometry, MOVED, graph.math("MULTIPLY", total, over))
    if height_layers:
        geometry = graph.raise_from_rest(geometry, ACTIVE, _sum(graph, frame, HEIGHTS, height_layers))
    shaded = _compression_and_rim(graph, geometry, frame, last, compression_layers)
    if visits:
        shaded = _age_and_pressure(graph, shaded, frame, visits, frame_rate)
    graph.next_row()
    graph.finish(graph.choose("GEOMETRY", graph.with_shading, geometry, shaded))
    return graph.tree


def _sum(graph: _Graph, frame: Any, names: Sequence[str], layers: int) -> Any:
    """Sum of the ramps of all layers."""
    start, end, change = names
    total: Any = None
    for layer in range(layers):
        graph.next_row()
        share = graph.map_range(
            "FLOAT_VECTOR", frame, graph.attribute(numbered(start, layer)), graph.attribute(numbered(end, layer))
        )
        value = graph.vector("DOT_PRODUCT", share, graph.attribute(numbered(change, layer)))
        total = value if total is None else graph.math("ADD", total, value)
    return total


def _compression_and_rim(graph: _Graph, geometry: Any, frame: Any, last: Any, layers: int) -> Any:
    """Both as the finished ground has them where a vertex has come to rest, nothing before its first movement."""
    graph.next_row()
    geometry = graph.store(geometry, PENDING, graph.compare("LESS_THAN", frame, last), MOVED, kind="BOOLEAN")
    for name in (COMPRESSION, RIM):
        geometry = graph.store(geometry, name, 0.0, PENDING)
    value = _sum(graph, frame, COMPRESSIONS, layers) if layers else 0.0
    geometry = graph.store(geometry, COMPRESSION, value, ACTIVE)
    graph.next_row()
    position = graph.node("GeometryNodeInputPosition").outputs["Position"]
    moved = graph.vector("SUBTRACT", position, graph.attribute(REST))
    per_metre = graph.vector("DOT_PRODUCT", graph.up, graph.up)
    height = graph.math("DIVIDE", graph.vector("DOT_PRODUCT", moved, graph.up), per_metre)
    rim = graph.math("MAXIMUM", graph.math("ADD", height, graph.attribute(COMPRESSION, "FLOAT")), 0.0)
    return graph.store(geometry, RIM, rim, ACTIVE)


def _age_and_pressure(graph: _Graph, geometry: Any, frame: Any, visits: int, frame_rate: float) -> Any:
    """Time since the latest contact that has begun, and the pressure while it lasts."""
    graph.next_row()
    latest = graph.attribute(numbered(VISIT, 0))
    begun = graph.compare("LESS_EQUAL", graph.components(latest)[0], frame)
    for number in range(1, visits):
        visit = graph.attribute(numbered(VISIT, number))
        later = graph.compare("LESS_EQUAL", graph.components(visit)[0], frame)
        latest = graph.choose("VECTOR", later, latest, visit)
    start, end, pressure = graph.components(latest)
    graph.next_row()
    since = graph.math("MAXIMUM", graph.math("SUBTRACT", frame, end), 0.0)
    age = graph.choose("FLOAT", begun, -1.0, graph.math("DIVIDE", since, frame_rate))
    geometry = graph.store(geometry, AGE, age, VISITED)
    graph.next_row()
    passed = graph.map_range("FLOAT", frame, start, end)
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

    def map_range(self, kind: str, value: Any, low: Any, high: Any) -> Any:
        """(value - low) / (high - low), limited to 0 and 1; 0 where low = high."""
        node = self.node("ShaderNodeMapRange")
        node.data_type, node.clamp, node.interpolation_type = kind, True, "LINEAR"
        names = ("Value", "From Min", "From Max", "Result")
        if kind == "FLOAT_VECTOR":
            names = ("Vector", "From_Min_FLOAT3", "From_Max_FLOAT3", "Vector")
        sockets = {socket.identifier: socket for socket in node.inputs}
        for name, source in zip(names, (value, low, high), strict=False):
            self.link(source, sockets[name])
        return next(socket for socket in node.outputs if socket.identifier == names[3])

    def choose(self, kind: str, switch: Any, when_false: Any, when_true: Any) -> Any:
        node = self.node("GeometryNodeSwitch")
        node.input_type = kind
        self.link(switch, node.inputs["Switch"])
        self.link(when_false, node.inputs["False"])
        self.link(when_true, node.inputs["True"])
        return node.outputs["Output"]
