"""Geometry nodes from Python: a group while it is built, and arithmetic with what its nodes give."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ...core.numerics.slices import Slices, sliced
from .arithmetic import Arithmetic

COLUMN, ROW = 180.0, 160.0
"""Spacing of the nodes in the editor."""
SLICE = 0.1
"""Time in which a part of a group is made, before whoever waits has a turn [s]."""


class OtherGraphError(Exception):
    """A group has other nodes or links than those that it is to have."""


class _TurnError(Exception):
    """The time of a slice is over before all nodes are made."""


@sliced
def build(tree: Any, fill: Callable[[NodeGraph], None]) -> Slices[None]:
    """Fill a group, in place of what is in it; where that has the same nodes and links, only numbers are set.

    After each change Blender goes through the whole group, which takes seconds for one of some hundred nodes. Each
    slice finds the nodes of those before it, in their order.

    Parameters
    ----------
    fill : callable
        Makes the nodes of a graph, and finishes it; always the same.
    """
    try:
        fill(NodeGraph(tree, known=True))
    except OtherGraphError:
        tree.nodes.clear()
        while True:
            yield
            try:
                fill(NodeGraph(tree, until=time.perf_counter() + SLICE))
            except _TurnError:
                continue
            return


class NodeGraph:
    """A node group while it is built, laid out in rows.

    Parameters
    ----------
    known : bool
        True if it has all nodes and links already, which are then looked at in their order; `OtherGraphError` if not.
        Otherwise it may have the first of them.
    until : float, optional
        Time by `perf_counter` after which no more than one node is made [s].
    """

    def __init__(self, tree: Any, *, known: bool = False, until: float = math.inf) -> None:
        self.tree = tree
        self._place = [0.0, 0.0]
        self._places: list[float] = []
        self._is_known, self._until, self._is_late = known, until, False
        self._nodes = iter(tree.nodes[:])
        self._linked = {(link.from_socket, link.to_socket) for link in tree.links}
        self._made: dict[Hashable, Any] = {}
        self._links: set[tuple[Any, Any]] = set()

    def finish(self, geometry: Any) -> None:
        self.node("NodeGroupOutput", {"Geometry": geometry})
        if self._is_known and (next(self._nodes, None) is not None or self._links != self._linked):
            raise OtherGraphError
        # All at once: after each that is set on its own, Blender goes through the whole group.
        self.tree.nodes.foreach_set("location", self._places)

    def next_row(self) -> None:
        self._place = [2 * COLUMN, self._place[1] - ROW]

    def node(self, kind: str, inputs: Mapping[Any, Any] | None = None, **properties: Any) -> Any:
        """A node with its properties set and its inputs, given by name or position, linked or set."""
        node = next(self._nodes, None)
        if node is None and not self._is_known:
            node = self._new(kind)
        elif node is None or node.bl_idname != kind or node.mute:
            raise OtherGraphError
        self._places += self._place
        self._place[0] += COLUMN
        for name, value in properties.items():
            if getattr(node, name) != value:
                setattr(node, name, value)
        for key, source in (inputs or {}).items():
            self.link(source, node.inputs[key])
        return node

    def link(self, source: Any, socket: Any) -> None:
        """Connect an output, or set a number or vector."""
        if not isinstance(source, bpy.types.NodeSocket):
            if not _is(socket.default_value, source):
                socket.default_value = source
            return
        self._links.add((source, socket))
        if not self._is_known and (source, socket) not in self._linked:
            self.tree.links.new(source, socket)

    def _new(self, kind: str) -> Any:
        if self._is_late:
            raise _TurnError
        self._is_late = time.perf_counter() > self._until
        node = self.tree.nodes.new(kind)
        node.hide = kind not in ("NodeGroupInput", "NodeGroupOutput")
        return node

    def _once(self, *key: Hashable, make: Callable[[], Any]) -> Any:
        """Nodes made for the same before, as the nodes of a file take more of it than thousands of vertices."""
        if key not in self._made:
            self._made[key] = make()
        return self._made[key]

    def attribute(self, name: str, kind: str = "FLOAT") -> Any:
        def make() -> Any:
            return self.node("GeometryNodeInputNamedAttribute", {"Name": name}, data_type=kind).outputs["Attribute"]

        return self._once(name, kind, make=make)

    def frame(self) -> Any:
        """The scene's frame, with its fraction."""
        return self.node("GeometryNodeInputSceneTime").outputs["Frame"]

    def position(self) -> Any:
        """Where each point is."""
        return self.node("GeometryNodeInputPosition").outputs["Position"]

    def without(self, geometry: Any, selection: Any) -> Any:
        """The geometry without the selected vertices."""
        inputs = {"Geometry": geometry, "Selection": selection}
        return self.node("GeometryNodeDeleteGeometry", inputs, domain="POINT").outputs["Geometry"]

    def put(self, geometry: Any, selection: Any, position: Any = None, offset: Any = (0.0, 0.0, 0.0)) -> Any:
        """Put the selected vertices elsewhere, from where they are if no position is given."""
        inputs = {"Geometry": geometry, "Selection": selection, "Offset": offset}
        inputs |= {} if position is None else {"Position": position}
        return self.node("GeometryNodeSetPosition", inputs).outputs["Geometry"]

    def put_higher(self, geometry: Any, up: Any, height: Any, selection: Any = True) -> Any:
        """Put vertices higher by multiples of a vector; a position is set faster than an offset."""
        position = self.vector("ADD", self.position(), self.scaled(up, height))
        inputs = {"Geometry": geometry, "Selection": selection, "Position": position}
        return self.node("GeometryNodeSetPosition", inputs).outputs["Geometry"]

    def store(
        self, geometry: Any, name: str, value: Any, selection: Any, kind: str = "FLOAT", domain: str = "POINT"
    ) -> Any:
        """Give the selected vertices, or what else a domain has, another value of that name."""
        inputs = {"Name": name, "Geometry": geometry, "Selection": selection, "Value": value}
        node = self.node("GeometryNodeStoreNamedAttribute", inputs, data_type=kind, domain=domain)
        return node.outputs["Geometry"]

    def captured(
        self, geometry: Any, *numbers: Number, kinds: str | Sequence[str] = "FLOAT", domain: str = "POINT"
    ) -> tuple[Any, list[Number]]:
        """The geometry with fields, of one kind or several, computed together and once, and these as it has them."""
        node = self.node("GeometryNodeCaptureAttribute", domain=domain)
        names = [f"Value {count}" for count in range(len(numbers))]
        if [item.name for item in node.capture_items] != names:
            if self._is_known:
                raise OtherGraphError
            for count, name in enumerate(names):
                node.capture_items.new(kinds if isinstance(kinds, str) else kinds[count], name)
        self.link(geometry, node.inputs["Geometry"])
        for name, number in zip(names, numbers, strict=True):
            self.link(number.socket, node.inputs[name])
        return node.outputs["Geometry"], [self.number(node.outputs[name]) for name in names]

    def forgotten(self, geometry: Any, *names: str) -> Any:
        """The geometry without some attributes."""
        for name in names:
            inputs = {"Geometry": geometry, "Name": name}
            geometry = self.node("GeometryNodeRemoveAttribute", inputs).outputs["Geometry"]
        return geometry

    def math(self, operation: str, first: Any, second: Any = 0.0, *, clamped: bool = False) -> Any:
        """Result of an operation, between 0 and 1 if it is clamped."""

        def make() -> Any:
            node = self.node("ShaderNodeMath", {0: first, 1: second}, operation=operation, use_clamp=clamped)
            return node.outputs["Value"]

        return self._once(operation, first, second, clamped, make=make)

    def both(self, first: Any, second: Any) -> Any:
        return self.logic("AND", first, second)

    def either(self, first: Any, second: Any) -> Any:
        return self.logic("OR", first, second)

    def logic(self, operation: str, *operands: Any) -> Any:
        return self.node("FunctionNodeBooleanMath", dict(enumerate(operands)), operation=operation).outputs["Boolean"]

    def compare(self, operation: str, first: Any, second: Any) -> Any:
        inputs = {"A": first, "B": second}
        return self.node("FunctionNodeCompare", inputs, data_type="FLOAT", operation=operation).outputs["Result"]

    def scaled(self, vector: Any, factor: Any) -> Any:
        return self.node("ShaderNodeVectorMath", {0: vector, "Scale": factor}, operation="SCALE").outputs["Vector"]

    def separated(self, vector: Any) -> list[Any]:
        def make() -> list[Any]:
            return list(self.node("ShaderNodeSeparateXYZ", {"Vector": vector}).outputs)

        return self._once("separated", vector, make=make)

    def sample(self, splines: Any, number: Any, length: Any) -> Any:
        """A node that looks at one of the splines, at a length along it."""
        inputs = {"Curves": splines, "Length": length, "Curve Index": number}
        return self.node("GeometryNodeSampleCurve", inputs, mode="LENGTH", data_type="FLOAT", use_all_curves=False)

    def accumulated(self, parts: Any, kind: str = "FLOAT", domain: str = "POINT") -> Any:
        """A node with sums of a field over a domain: those before each, those up to and with it, and of all."""
        return self.node("GeometryNodeAccumulateField", {"Value": parts}, data_type=kind, domain=domain)

    def object_geometry(self, obj: bpy.types.Object, name: str) -> Any:
        """The geometry of an object, by a node of this name."""
        node = self.node("GeometryNodeObjectInfo", {"Object": obj}, label=name)
        if node.name != name:
            node.name = name
        return node.outputs["Geometry"]

    def points(self, count: int) -> Any:
        """So many points."""
        return self.node("GeometryNodePoints", {"Count": count}).outputs[0]

    def at_index(self, geometry: Any, value: Any, index: Any, kind: str = "FLOAT_VECTOR", domain: str = "POINT") -> Any:
        """Value of a field at one of a geometry's points, or at the last of them."""
        inputs = {"Geometry": geometry, "Value": value, "Index": index}
        node = self.node("GeometryNodeSampleIndex", inputs, data_type=kind, domain=domain, clamp=True)
        return node.outputs["Value"]

    def repeated(
        self, count: int, geometry: Any, number: float, step: Callable[[Any, Number], tuple[Any, Number]]
    ) -> Any:
        """What a geometry becomes by so many steps, each from it and a number to the next of both."""
        begin, end = self.node("GeometryNodeRepeatInput"), self.node("GeometryNodeRepeatOutput")
        if begin.paired_output != end:
            begin.pair_with_output(end)
        if "Number" not in end.repeat_items:
            end.repeat_items.new("FLOAT", "Number")
        for value, name in ((count, "Iterations"), (geometry, "Geometry"), (number, "Number")):
            self.link(value, begin.inputs[name])
        changed, following = step(begin.outputs["Geometry"], self.number(begin.outputs["Number"]))
        self.link(changed, end.inputs["Geometry"])
        self.link(following.socket, end.inputs["Number"])
        return end.outputs["Geometry"]

    def combined(self, *parts: Any) -> Any:
        """A vector of up to three numbers."""
        return self.node("ShaderNodeCombineXYZ", dict(enumerate(parts))).outputs["Vector"]

    def choose(self, kind: str, switch: Any, when_false: Any, when_true: Any) -> Any:
        """One or the other; a number is true if it is above 0."""
        inputs = {"Switch": switch, "False": when_false, "True": when_true}
        return self.node("GeometryNodeSwitch", inputs, input_type=kind).outputs["Output"]

    def vector(self, operation: str, *vectors: Any, output: str = "Vector") -> Any:
        """An operation on vectors."""
        return self.node("ShaderNodeVectorMath", dict(enumerate(vectors)), operation=operation).outputs[output]

    def parts(self, vector: Any) -> list[Number]:
        """The three numbers of a vector."""
        return [self.number(part) for part in self.separated(vector)]

    def dot(self, first: Any, second: Any) -> Any:
        return self.vector("DOT_PRODUCT", first, second, output="Value")

    def number(self, source: Any) -> Number:
        """An output, or a number, to calculate with."""
        return Number(self, source)


def _is(value: Any, other: Any) -> bool:
    """True if a socket's value is another one, as Blender rounds numbers."""
    if isinstance(other, bool | int | float) or (isinstance(other, tuple | list) and value is not None):
        return np.array_equal(np.asarray(value, np.float32), np.asarray(other, np.float32))
    return bool(value == other)


@dataclass(frozen=True)
class Number(Arithmetic):
    """An output of a group's node, with arithmetic; what is divided by nothing is nothing."""

    graph: NodeGraph
    socket: Any

    def where(self, *acting: Number, otherwise: Number | float = 0.0) -> Number:
        """This, or another where none of some numbers, the same everywhere and never negative, is above 0.

        What is not asked for is not worked out.
        """
        value = otherwise.socket if isinstance(otherwise, Number) else otherwise
        return Number(self.graph, self.graph.choose("FLOAT", sum(acting[1:], acting[0]).socket, value, self.socket))

    def within_one(self) -> Number:
        """No less than 0, no more than 1."""
        return Number(self.graph, self.graph.math("ADD", self.socket, 0.0, clamped=True))

    def calculated(self, operation: str, first: Number | float, second: Number | float) -> Number:
        return Number(self.graph, self.graph.math(operation, *map(_socket, (first, second))))


def _socket(value: Number | float) -> Any:
    return value.socket if isinstance(value, Number) else value
