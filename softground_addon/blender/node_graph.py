"""Geometry nodes from Python: a group while it is built, and arithmetic with what its nodes give."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

COLUMN, ROW = 180.0, 160.0
"""Spacing of the nodes in the editor."""


class OtherGraphError(Exception):
    """A group has other nodes or links than those that it is to have."""


def build(tree: Any, fill: Callable[[NodeGraph], None]) -> None:
    """Fill a group, in place of what is in it; where that has the same nodes and links, only numbers are set.

    After each change Blender goes through the whole group, which takes seconds for one of some hundred nodes.

    Parameters
    ----------
    fill : callable
        Makes the nodes of a graph, and finishes it.
    """
    try:
        fill(NodeGraph(tree, known=True))
    except OtherGraphError:
        tree.nodes.clear()
        fill(NodeGraph(tree))


class NodeGraph:
    """A node group while it is built, laid out in rows.

    Parameters
    ----------
    known : bool
        Whether it has all nodes and links already, which are then looked at in their order; `OtherGraphError` if not.
    """

    def __init__(self, tree: Any, *, known: bool = False) -> None:
        self.tree = tree
        self._place = [0.0, 0.0]
        self._places: list[float] = []
        self._known = iter(tree.nodes[:]) if known else None
        self._made: dict[Hashable, Any] = {}
        self._links: set[tuple[Any, Any]] = set()

    def finish(self, geometry: Any) -> None:
        node = self.node("NodeGroupOutput")
        self.link(geometry, node.inputs["Geometry"])
        if self._known is not None:
            links = {(link.from_socket, link.to_socket) for link in self.tree.links}
            if next(self._known, None) is not None or links != self._links:
                raise OtherGraphError
        # All at once: after each that is set on its own, Blender goes through the whole group.
        self.tree.nodes.foreach_set("location", self._places)

    def next_row(self) -> None:
        self._place = [2 * COLUMN, self._place[1] - ROW]

    def node(self, kind: str, **properties: Any) -> Any:
        if self._known is None:
            node = self.tree.nodes.new(kind)
            node.hide = kind not in ("NodeGroupInput", "NodeGroupOutput")
        else:
            node = next(self._known, None)
            if node is None or node.bl_idname != kind or node.mute:
                raise OtherGraphError
        self._places += self._place
        self._place[0] += COLUMN
        for name, value in properties.items():
            if getattr(node, name) != value:
                setattr(node, name, value)
        return node

    def link(self, source: Any, socket: Any) -> None:
        """Connect an output, or set a number or vector."""
        if not isinstance(source, bpy.types.NodeSocket):
            if not _is(socket.default_value, source):
                socket.default_value = source
        elif self._known is None:
            self.tree.links.new(source, socket)
        else:
            self._links.add((source, socket))

    def _once(self, *key: Hashable, make: Callable[[], Any]) -> Any:
        """Nodes made for the same before, as the nodes of a file take more of it than thousands of vertices."""
        if key not in self._made:
            self._made[key] = make()
        return self._made[key]

    def attribute(self, name: str, kind: str = "FLOAT") -> Any:
        def make() -> Any:
            node = self.node("GeometryNodeInputNamedAttribute", data_type=kind)
            self.link(name, node.inputs["Name"])
            return node.outputs["Attribute"]

        return self._once(name, kind, make=make)

    def without(self, geometry: Any, selection: Any) -> Any:
        """The geometry without the selected vertices."""
        node = self.node("GeometryNodeDeleteGeometry", domain="POINT")
        self.link(geometry, node.inputs["Geometry"])
        self.link(selection, node.inputs["Selection"])
        return node.outputs["Geometry"]

    def put(self, geometry: Any, selection: Any, position: Any = None, offset: Any = (0.0, 0.0, 0.0)) -> Any:
        """Put the selected vertices elsewhere, from where they are if no position is given."""
        node = self.node("GeometryNodeSetPosition")
        self.link(geometry, node.inputs["Geometry"])
        self.link(selection, node.inputs["Selection"])
        if position is not None:
            self.link(position, node.inputs["Position"])
        self.link(offset, node.inputs["Offset"])
        return node.outputs["Geometry"]

    def put_higher(self, geometry: Any, up: Any, height: Any) -> Any:
        """Put all vertices higher by multiples of a vector; a position is set faster than an offset."""
        node = self.node("GeometryNodeSetPosition")
        self.link(geometry, node.inputs["Geometry"])
        position = self.node("GeometryNodeInputPosition").outputs["Position"]
        self.link(self.vector("ADD", position, self.scaled(up, height)), node.inputs["Position"])
        return node.outputs["Geometry"]

    def store(
        self, geometry: Any, name: str, value: Any, selection: Any, kind: str = "FLOAT", domain: str = "POINT"
    ) -> Any:
        """Give the selected vertices, or what else a domain has, another value of that name."""
        node = self.node("GeometryNodeStoreNamedAttribute", data_type=kind, domain=domain)
        self.link(name, node.inputs["Name"])
        self.link(geometry, node.inputs["Geometry"])
        self.link(selection, node.inputs["Selection"])
        self.link(value, node.inputs["Value"])
        return node.outputs["Geometry"]

    def captured(
        self, geometry: Any, *numbers: Number, kinds: str | Sequence[str] = "FLOAT", domain: str = "POINT"
    ) -> tuple[Any, list[Number]]:
        """The geometry with fields, of one kind or several, computed together and once, and these as it has them."""
        node = self.node("GeometryNodeCaptureAttribute", domain=domain)
        names = [f"Value {count}" for count in range(len(numbers))]
        if [item.name for item in node.capture_items] != names:
            if self._known is not None:
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
            node = self.node("GeometryNodeRemoveAttribute")
            self.link(geometry, node.inputs["Geometry"])
            self.link(name, node.inputs["Name"])
            geometry = node.outputs["Geometry"]
        return geometry

    def math(self, operation: str, first: Any, second: Any = 0.0, *, clamped: bool = False) -> Any:
        """Result of an operation, between 0 and 1 if it is clamped."""

        def make() -> Any:
            node = self.node("ShaderNodeMath", operation=operation, use_clamp=clamped)
            self.link(first, node.inputs[0])
            self.link(second, node.inputs[1])
            return node.outputs["Value"]

        return self._once(operation, first, second, clamped, make=make)

    def both(self, first: Any, second: Any) -> Any:
        return self.logic("AND", first, second)

    def either(self, first: Any, second: Any) -> Any:
        return self.logic("OR", first, second)

    def logic(self, operation: str, *operands: Any) -> Any:
        node = self.node("FunctionNodeBooleanMath", operation=operation)
        for operand, socket in zip(operands, node.inputs, strict=False):  # for one there may be two sockets
            self.link(operand, socket)
        return node.outputs["Boolean"]

    def compare(self, operation: str, first: Any, second: Any) -> Any:
        node = self.node("FunctionNodeCompare", data_type="FLOAT", operation=operation)
        self.link(first, node.inputs["A"])
        self.link(second, node.inputs["B"])
        return node.outputs["Result"]

    def scaled(self, vector: Any, factor: Any) -> Any:
        node = self.node("ShaderNodeVectorMath", operation="SCALE")
        self.link(vector, node.inputs[0])
        self.link(factor, node.inputs["Scale"])
        return node.outputs["Vector"]

    def separated(self, vector: Any) -> list[Any]:
        def make() -> list[Any]:
            node = self.node("ShaderNodeSeparateXYZ")
            self.link(vector, node.inputs["Vector"])
            return list(node.outputs)

        return self._once("separated", vector, make=make)

    def sample(self, splines: Any, number: Any, length: Any) -> Any:
        """A node that looks at one of the splines, at a length along it."""
        node = self.node("GeometryNodeSampleCurve", mode="LENGTH", data_type="FLOAT", use_all_curves=False)
        self.link(splines, node.inputs["Curves"])
        self.link(length, node.inputs["Length"])
        self.link(number, node.inputs["Curve Index"])
        return node

    def accumulated(self, parts: Any, kind: str = "FLOAT", domain: str = "POINT") -> Any:
        """A node with sums of a field over a domain: those before each, those up to and with it, and of all."""
        node = self.node("GeometryNodeAccumulateField", data_type=kind, domain=domain)
        self.link(parts, node.inputs["Value"])
        return node

    def object_geometry(self, obj: bpy.types.Object, name: str) -> Any:
        """The geometry of an object, by a node of this name."""
        node = self.node("GeometryNodeObjectInfo", label=name)
        if node.name != name:
            node.name = name
        self.link(obj, node.inputs["Object"])
        return node.outputs["Geometry"]

    def points(self, count: int) -> Any:
        """So many points."""
        node = self.node("GeometryNodePoints")
        self.link(count, node.inputs["Count"])
        return node.outputs[0]

    def at_index(self, geometry: Any, value: Any, index: Any, kind: str = "FLOAT_VECTOR", domain: str = "POINT") -> Any:
        """Value of a field at one of a geometry's points, or at the last of them."""
        node = self.node("GeometryNodeSampleIndex", data_type=kind, domain=domain, clamp=True)
        self.link(geometry, node.inputs["Geometry"])
        self.link(value, node.inputs["Value"])
        self.link(index, node.inputs["Index"])
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
        node = self.node("ShaderNodeCombineXYZ")
        for part, socket in zip(parts, node.inputs, strict=False):
            self.link(part, socket)
        return node.outputs["Vector"]

    def choose(self, kind: str, switch: Any, when_false: Any, when_true: Any) -> Any:
        """One or the other; a number is true if it is above 0."""
        node = self.node("GeometryNodeSwitch", input_type=kind)
        self.link(switch, node.inputs["Switch"])
        self.link(when_false, node.inputs["False"])
        self.link(when_true, node.inputs["True"])
        return node.outputs["Output"]

    def vector(self, operation: str, *vectors: Any, output: str = "Vector") -> Any:
        """An operation on vectors."""
        node = self.node("ShaderNodeVectorMath", operation=operation)
        for vector, socket in zip(vectors, node.inputs, strict=False):
            self.link(vector, socket)
        return node.outputs[output]

    def parts(self, vector: Any) -> list[Number]:
        """The three numbers of a vector."""
        return [self.number(part) for part in self.separated(vector)]

    def dot(self, first: Any, second: Any) -> Any:
        return self.vector("DOT_PRODUCT", first, second, output="Value")

    def number(self, source: Any) -> Number:
        """An output, or a number, to calculate with."""
        return Number(self, source)


def _is(value: Any, other: Any) -> bool:
    """Return whether a socket's value is another one, as Blender rounds numbers."""
    if isinstance(other, bool | int | float) or (isinstance(other, tuple | list) and value is not None):
        return np.array_equal(np.asarray(value, np.float32), np.asarray(other, np.float32))
    return bool(value == other)


@dataclass(frozen=True)
class Number:
    """An output of a group's node, with arithmetic; what is divided by nothing is nothing."""

    graph: NodeGraph
    socket: Any

    def __add__(self, other: Number | float) -> Number:
        return self._with("ADD", other)

    def __sub__(self, other: Number | float) -> Number:
        return self._with("SUBTRACT", other)

    def __mul__(self, other: Number | float) -> Number:
        return self._with("MULTIPLY", other)

    def __truediv__(self, other: Number | float) -> Number:
        return self._with("DIVIDE", other)

    __radd__, __rmul__ = __add__, __mul__

    def __array_ufunc__(self, function: np.ufunc, _method: str, *operands: Number | float) -> Number:
        """Numpy's functions as nodes, so that what is a law for arrays is one for these."""
        return _FUNCTIONS[function](
            *(operand if isinstance(operand, Number) else self.graph.number(operand) for operand in operands)
        )

    def __rsub__(self, other: float) -> Number:
        return Number(self.graph, self.graph.math("SUBTRACT", other, self.socket))

    def above(self, other: Number | float) -> Number:
        """1 where it is more than another, else 0."""
        return self._with("GREATER_THAN", other)

    def at_least(self, other: Number | float) -> Number:
        """The larger of two."""
        return self._with("MAXIMUM", other)

    def at_most(self, other: Number | float) -> Number:
        """The smaller of two."""
        return self._with("MINIMUM", other)

    def where(self, *acting: Number, otherwise: Number | float = 0.0) -> Number:
        """This, or another where none of some numbers, the same everywhere and never negative, is above 0.

        What is not asked for is not worked out.
        """
        value = otherwise.socket if isinstance(otherwise, Number) else otherwise
        return Number(self.graph, self.graph.choose("FLOAT", sum(acting[1:], acting[0]).socket, value, self.socket))

    def within_one(self) -> Number:
        """No less than 0, no more than 1."""
        return Number(self.graph, self.graph.math("ADD", self.socket, 0.0, clamped=True))

    def exp(self) -> Number:
        return self._with("EXPONENT", 0.0)

    def log(self) -> Number:
        return self._with("LOGARITHM", math.e)

    def root(self) -> Number:
        return self._with("SQRT", 0.0)

    def arccos(self) -> Number:
        return self._with("ARCCOSINE", 0.0)

    def floor(self) -> Number:
        return self._with("FLOOR", 0.0)

    def fraction(self) -> Number:
        return self._with("FRACT", 0.0)

    def _with(self, operation: str, other: Number | float) -> Number:
        value = other.socket if isinstance(other, Number) else other
        return Number(self.graph, self.graph.math(operation, self.socket, value))


_FUNCTIONS: Mapping[np.ufunc, Callable[..., Number]] = {
    np.add: Number.__add__,
    np.subtract: Number.__sub__,
    np.multiply: Number.__mul__,
    np.divide: Number.__truediv__,
    np.minimum: Number.at_most,
    np.maximum: Number.at_least,
    np.greater: Number.above,
    np.exp: Number.exp,
    np.expm1: lambda number: number.exp() - 1.0,
    np.log1p: lambda number: (number + 1.0).log(),
    np.sqrt: Number.root,
    np.arccos: Number.arccos,
}
