"""The node group that plays a bake: attributes and the time in, the ground at that time out.

It is native Blender data and needs nothing of this add-on. The timelines are splines of an object of its own, one for
each vertex that the bake moves: a vertex stands still most of the time, before its first movement where it was, after
its last where that left it, and only the splines of vertices in between are sampled (see `core.polylines`). All of that
happens on the splines, of which there are few beside the vertices of a dense ground; each vertex then takes its height
from its spline. The group is the same for every bake. Positions start from the undisturbed ones.
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
SPLINE = "softground_spline"
"""Number of the vertex's spline."""
COMPRESSION, RIM, AGE, PRESSURE = "softground_compression", "softground_rim", "softground_age", "softground_pressure"

STATE = "softground_state"
"""Of a point of a spline, whose position is the time since the spline's first frame: height, compression, last frame of
the latest contact and pressure, as a colour."""
STATE_NOW = "softground_state_now"
"""The state of a spline at the frame that is shown; as it is stored, that after its last frame."""
START, END = "softground_start", "softground_end"
"""Frame from which on something happens to a spline's vertex, and frame from which on nothing does."""
UNTOUCHED = (0.0, 0.0, NO_VISIT, 0.0)
"""The state before the first frame of a spline."""

COLUMN, ROW = 180.0, 160.0
"""Spacing of the nodes in the editor."""


def build(*, table: bpy.types.Object, up: Sequence[float], frame_rate: float) -> bpy.types.NodeTree:
    """A new node group.

    Parameters
    ----------
    table : bpy.types.Object
        Its splines are the timelines.
    up : (3,) floats
        World up in the ground's own space and units, of the length of one metre.
    frame_rate : float
        Frames of the table per second [Hz].
    """
    graph = _Graph(GROUP)
    geometry, frame = graph.inputs(up)
    splines = _state_at(graph, table, frame)
    graph.next_row()
    height, compression, contact_end, pressure = graph.channels(graph.sample(splines, STATE_NOW, SPLINE))
    geometry = graph.raise_from_rest(geometry, MOVED, height)
    graph.next_row()
    rim = graph.math("MAXIMUM", graph.math("ADD", height, compression), 0.0)
    since = graph.math("MAXIMUM", graph.math("SUBTRACT", frame, contact_end), 0.0)
    touched = graph.compare("LESS_THAN", contact_end, NO_VISIT / 2)
    age = graph.choose("FLOAT", touched, -1.0, graph.math("DIVIDE", since, frame_rate))
    shaded = geometry
    for name, value in ((COMPRESSION, compression), (RIM, rim), (AGE, age), (PRESSURE, pressure)):
        graph.next_row()
        shaded = graph.store(shaded, name, value, graph.attribute(MOVED, "BOOLEAN"))
    graph.next_row()
    graph.finish(graph.choose("GEOMETRY", graph.with_shading, geometry, shaded))
    return graph.tree


def table_of(tree: bpy.types.NodeTree) -> bpy.types.Object | None:
    """The object whose splines a group samples."""
    for node in tree.nodes:
        if node.bl_idname == "GeometryNodeObjectInfo":
            found: bpy.types.Object | None = node.inputs["Object"].default_value
            return found
    return None


def _state_at(graph: _Graph, table: bpy.types.Object, frame: Any) -> Any:
    """The splines, each with its state at a frame."""
    graph.next_row()
    info = graph.node("GeometryNodeObjectInfo")
    info.inputs["Object"].default_value = table
    splines = info.outputs["Geometry"]
    start, end = graph.attribute(START, "FLOAT"), graph.attribute(END, "FLOAT")
    yet_to_begin = graph.compare("LESS_THAN", frame, start)
    under_way = graph.both(graph.compare("LESS_EQUAL", start, frame), graph.compare("LESS_THAN", frame, end))
    state = graph.sample_own_spline(splines, STATE, graph.math("SUBTRACT", frame, start))
    graph.next_row()
    for value, selection in ((UNTOUCHED, yet_to_begin), (state, under_way)):
        splines = graph.store(splines, STATE_NOW, value, selection, kind="FLOAT_COLOR", domain="CURVE")
    return splines


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
        self.link(self.scaled(self.up, height), node.inputs["Offset"])
        return node.outputs["Geometry"]

    def store(
        self, geometry: Any, name: str, value: Any, selection: Any, *, kind: str = "FLOAT", domain: str = "POINT"
    ) -> Any:
        node = self.node("GeometryNodeStoreNamedAttribute")
        node.data_type, node.domain = kind, domain
        node.inputs["Name"].default_value = name
        self.link(geometry, node.inputs["Geometry"])
        self.link(selection, node.inputs["Selection"])
        self.link(value, node.inputs["Value"])
        return node.outputs["Geometry"]

    def math(self, operation: str, first: Any, second: Any) -> Any:
        node = self.node("ShaderNodeMath")
        node.operation = operation
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

    def scaled(self, vector: Any, factor: Any) -> Any:
        node = self.node("ShaderNodeVectorMath")
        node.operation = "SCALE"
        self.link(vector, node.inputs[0])
        self.link(factor, node.inputs["Scale"])
        return node.outputs["Vector"]

    def channels(self, colour: Any) -> tuple[Any, Any, Any, Any]:
        node = self.node("FunctionNodeSeparateColor")
        self.link(colour, node.inputs["Color"])
        return node.outputs["Red"], node.outputs["Green"], node.outputs["Blue"], node.outputs["Alpha"]

    def sample(self, splines: Any, name: str, number: str) -> Any:
        """A colour of the spline whose number is in an attribute."""
        node = self.node("GeometryNodeSampleIndex")
        node.data_type, node.domain, node.clamp = "FLOAT_COLOR", "CURVE", True
        self.link(splines, node.inputs["Geometry"])
        self.link(self.attribute(name, "FLOAT_COLOR"), node.inputs["Value"])
        self.link(self.attribute(number, "INT"), node.inputs["Index"])
        return node.outputs["Value"]

    def sample_own_spline(self, splines: Any, name: str, length: Any) -> Any:
        """A colour of each spline's points, at a length along it."""
        node = self.node("GeometryNodeSampleCurve")
        node.mode, node.data_type, node.use_all_curves = "LENGTH", "FLOAT_COLOR", False
        self.link(splines, node.inputs["Curves"])
        self.link(self.attribute(name, "FLOAT_COLOR"), node.inputs["Value"])
        self.link(length, node.inputs["Length"])
        self.link(self.node("GeometryNodeInputIndex").outputs["Index"], node.inputs["Curve Index"])
        return node.outputs["Value"]

    def choose(self, kind: str, switch: Any, when_false: Any, when_true: Any) -> Any:
        node = self.node("GeometryNodeSwitch")
        node.input_type = kind
        self.link(switch, node.inputs["Switch"])
        self.link(when_false, node.inputs["False"])
        self.link(when_true, node.inputs["True"])
        return node.outputs["Output"]
