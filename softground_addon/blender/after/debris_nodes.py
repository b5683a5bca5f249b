"""The node group that lets debris fly: each point's birth and first speed in, where it is at the time out.

It is native Blender data and needs nothing of this add-on; the closed form is that of `core.after.flight`. Points come
in the order of their birth, so that leaving out the unborn gives nobody another number.
"""

from __future__ import annotations

from typing import Any

import bpy

GROUP = "SoftGround Debris"
MARK = "softground_debris"
"""Custom property of the group, of its object and of the collections of shapes."""

BIRTH, FLIGHT, DRAG = "softground_birth", "softground_flight", "softground_drag"
"""Of a point: frame of its birth, time in the air [s], settling speed over gravity [s]."""
LEFT_OUT = "softground_left_out"
"""Whether its step was changed, so that it is not seen."""
LAUNCH = "softground_launch"
"""Its first speed [Blender units/s]."""
RADIUS, VELOCITY, AGE, KIND, STEP = "radius", "velocity", "age", "kind", "step"

FULL_TURNS = 12.0
"""How fast pieces turn in the air [rad/s]."""


def build(*, frame_rate: float, gravity: float, unit_scale: float, shapes: bpy.types.Collection) -> Any:
    """A new node group.

    Parameters
    ----------
    frame_rate : float
        Frames that the scene's time counts per second [Hz].
    gravity : float
        [m/s²]
    unit_scale : float
        Metres per Blender unit.
    shapes : bpy.types.Collection
        What pieces look like, of radius 1.
    """
    graph = _Graph()
    geometry, wind, amount, collection = graph.inputs(shapes)
    frame = graph.node("GeometryNodeInputSceneTime").outputs["Frame"]
    since = graph.math("DIVIDE", graph.math("SUBTRACT", frame, graph.attribute(BIRTH)), frame_rate)
    unseen = graph.either(graph.compare(since, 0.0), graph.attribute(LEFT_OUT, "BOOLEAN"))
    unseen = graph.either(unseen, graph.compare(amount, graph.random(0.0, 1.0, 1)))
    geometry = graph.without(geometry, unseen)

    flight, drag = graph.attribute(FLIGHT), graph.attribute(DRAG)
    time = graph.math("MINIMUM", since, flight)
    left = graph.math("EXPONENT", graph.math("DIVIDE", graph.math("MULTIPLY", time, -1.0), drag))
    passed = graph.math("MULTIPLY", drag, graph.math("SUBTRACT", 1.0, left))
    launch = graph.attribute(LAUNCH, "FLOAT_VECTOR")
    fall = graph.node("ShaderNodeCombineXYZ")
    graph.link(graph.math("MULTIPLY", drag, -gravity / unit_scale), fall.inputs["Z"])
    drift = graph.vector("ADD", graph.scaled(wind, 1.0 / unit_scale), fall.outputs["Vector"])
    moved = graph.vector("ADD", graph.scaled(launch, passed), graph.scaled(drift, graph.math("SUBTRACT", time, passed)))
    speed = graph.vector("ADD", graph.scaled(launch, left), graph.scaled(drift, graph.math("SUBTRACT", 1.0, left)))
    flies = graph.compare(since, flight)

    geometry = graph.store(geometry, AGE, "FLOAT", since)
    geometry = graph.store(geometry, VELOCITY, "FLOAT_VECTOR", graph.scaled(speed, flies))
    put = graph.node("GeometryNodeSetPosition")
    graph.link(geometry, put.inputs["Geometry"])
    graph.link(moved, put.inputs["Offset"])

    info = graph.node("GeometryNodeCollectionInfo")
    info.inputs["Separate Children"].default_value = True
    info.inputs["Reset Children"].default_value = True
    graph.link(collection, info.inputs["Collection"])
    turn = graph.vector("ADD", graph.random_turn(0), graph.scaled(graph.random_turn(2), time))
    on_points = graph.node("GeometryNodeInstanceOnPoints")
    on_points.inputs["Pick Instance"].default_value = True
    for source, socket in (
        (put.outputs["Geometry"], "Points"),
        (info.outputs[0], "Instance"),
        (graph.random(0, 100, 3, "INT"), "Instance Index"),
        (turn, "Rotation"),
        (graph.attribute(RADIUS), "Scale"),
    ):
        graph.link(source, on_points.inputs[socket])
    out = graph.node("NodeGroupOutput")
    graph.link(on_points.outputs["Instances"], out.inputs["Geometry"])
    return graph.tree


class _Graph:
    """A node group while it is built."""

    def __init__(self) -> None:
        self.tree: Any = bpy.data.node_groups.new(GROUP, "GeometryNodeTree")
        self.tree.is_modifier = True
        self.tree[MARK] = True
        self._place = 0.0

    def inputs(self, shapes: bpy.types.Collection) -> list[Any]:
        """Geometry, wind, amount and shapes."""
        interface = self.tree.interface
        interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
        interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
        wind = interface.new_socket("Wind", in_out="INPUT", socket_type="NodeSocketVector")
        wind.description = "Speed of the air in metres per second: it takes along what flies"
        amount = interface.new_socket("Amount", in_out="INPUT", socket_type="NodeSocketFloat")
        amount.default_value, amount.min_value, amount.max_value = 1.0, 0.0, 1.0
        amount.description = "Share of the pieces that is shown"
        collection = interface.new_socket("Shapes", in_out="INPUT", socket_type="NodeSocketCollection")
        collection.default_value = shapes
        collection.description = "What pieces look like: objects of radius 1, one of which is picked for each"
        group = self.node("NodeGroupInput")
        return [group.outputs[name] for name in ("Geometry", "Wind", "Amount", "Shapes")]

    def node(self, kind: str) -> Any:
        node = self.tree.nodes.new(kind)
        node.location = (self._place, 0.0)
        node.hide = kind not in ("NodeGroupInput", "NodeGroupOutput")
        self._place += 160.0
        return node

    def link(self, source: Any, socket: Any) -> None:
        """Connect an output, or set a value."""
        if isinstance(source, bpy.types.NodeSocket):
            self.tree.links.new(source, socket)
        else:
            socket.default_value = source

    def attribute(self, name: str, kind: str = "FLOAT") -> Any:
        node = self.node("GeometryNodeInputNamedAttribute")
        node.data_type = kind
        node.inputs["Name"].default_value = name
        return node.outputs["Attribute"]

    def math(self, operation: str, first: Any, second: Any = 0.0) -> Any:
        node = self.node("ShaderNodeMath")
        node.operation = operation
        self.link(first, node.inputs[0])
        self.link(second, node.inputs[1])
        return node.outputs["Value"]

    def vector(self, operation: str, first: Any, second: Any) -> Any:
        node = self.node("ShaderNodeVectorMath")
        node.operation = operation
        self.link(first, node.inputs[0])
        self.link(second, node.inputs[1])
        return node.outputs["Vector"]

    def scaled(self, vector: Any, factor: Any) -> Any:
        node = self.node("ShaderNodeVectorMath")
        node.operation = "SCALE"
        self.link(vector, node.inputs[0])
        self.link(factor, node.inputs["Scale"])
        return node.outputs["Vector"]

    def compare(self, first: Any, second: Any) -> Any:
        """Whether one is less than the other."""
        node = self.node("FunctionNodeCompare")
        node.data_type, node.operation = "FLOAT", "LESS_THAN"
        self.link(first, node.inputs["A"])
        self.link(second, node.inputs["B"])
        return node.outputs["Result"]

    def either(self, first: Any, second: Any) -> Any:
        node = self.node("FunctionNodeBooleanMath")
        node.operation = "OR"
        self.link(first, node.inputs[0])
        self.link(second, node.inputs[1])
        return node.outputs["Boolean"]

    def random(self, low: Any, high: Any, seed: int, kind: str = "FLOAT") -> Any:
        node = self.node("FunctionNodeRandomValue")
        node.data_type = kind
        sockets = [socket for socket in node.inputs if socket.enabled]
        for name, value in (("Min", low), ("Max", high), ("Seed", seed)):
            self.link(value, next(socket for socket in sockets if socket.name == name))
        return next(socket for socket in node.outputs if socket.enabled)

    def random_turn(self, seed: int) -> Any:
        return self.random((-FULL_TURNS,) * 3, (FULL_TURNS,) * 3, seed, "FLOAT_VECTOR")

    def without(self, geometry: Any, selection: Any) -> Any:
        node = self.node("GeometryNodeDeleteGeometry")
        node.domain = "POINT"
        self.link(geometry, node.inputs["Geometry"])
        self.link(selection, node.inputs["Selection"])
        return node.outputs["Geometry"]

    def store(self, geometry: Any, name: str, kind: str, value: Any) -> Any:
        node = self.node("GeometryNodeStoreNamedAttribute")
        node.data_type, node.domain = kind, "POINT"
        node.inputs["Name"].default_value = name
        self.link(geometry, node.inputs["Geometry"])
        self.link(value, node.inputs["Value"])
        return node.outputs["Geometry"]
