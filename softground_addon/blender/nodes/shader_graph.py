"""Shaders from Python: the nodes of a material, and arithmetic with what they give."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import bpy

from .arithmetic import Arithmetic

Colour = tuple[float, float, float]

FLAT = 0.1
"""Size of noise that no print is deep enough to show more than a plane of [m]: in two dimensions it compiles in half
the time, which in EEVEE is most of a material's."""


@dataclass(frozen=True)
class Socket(Arithmetic):
    """An output of a node, with the arithmetic of shader graphs."""

    graph: Graph
    output: Any

    def calculated(self, operation: str, first: Socket | float, second: Socket | float) -> Socket:
        return self.graph.math(operation, first, second)


class Graph:
    """Writes nodes into a material, each at the right of those that it reads."""

    def __init__(self, tree: bpy.types.NodeTree) -> None:
        self._tree = tree
        self._depth: dict[str, int] = {}
        self._rows: dict[int, int] = {}
        self._made: dict[str, Socket] = {}

    def once(self, name: str, make: Callable[[], Socket]) -> Socket:
        """What is made when it is first asked for, and the same after that."""
        if name not in self._made:
            self._made[name] = make()
        return self._made[name]

    def node(self, kind: str, inputs: Mapping[Any, Any] | None = None, **properties: Any) -> Any:
        """A node with its properties set and its inputs, given by identifier or position, linked or set."""
        node: Any = self._tree.nodes.new(kind)
        for name, value in properties.items():
            setattr(node, name, value)
        depth = 0
        for key, value in (inputs or {}).items():
            socket = _input(node, key)
            if isinstance(value, Socket):
                self._tree.links.new(value.output, socket)
                depth = max(depth, self._depth[value.output.node.name] + 1)
            else:
                socket.default_value = value
        row = self._rows.get(depth, 0)
        self._depth[node.name], self._rows[depth] = depth, row + 1
        node.location = (220 * depth, -260 * row)
        return node

    def out(self, node: Any, index: int = 0) -> Socket:
        """An output by its position: names of outputs differ between Blender versions."""
        return Socket(self, node.outputs[index])

    def math(self, operation: str, a: Socket | float, b: Socket | float) -> Socket:
        """a operation b."""
        return self.out(self.node("ShaderNodeMath", {0: a, 1: b}, operation=operation))

    def attribute(self, name: str) -> Socket:
        """A float attribute of the mesh; 0 where the mesh has none."""
        return self.out(self.node("ShaderNodeAttribute", attribute_name=name), 2)

    def ramp(
        self, value: Socket, low: float, high: float, start: Socket | float = 0.0, end: Socket | float = 1.0
    ) -> Socket:
        """From `start` at `low` to `end` at `high`, smoothly, and level outside."""
        inputs = {0: value, 1: low, 2: high, 3: start, 4: end}
        return self.out(self.node("ShaderNodeMapRange", inputs, interpolation_type="SMOOTHSTEP"))

    def noise(self, place: Socket, size: float, detail: float = 2.0, roughness: float = 0.5) -> Socket:
        """Noise around 0.5 whose features are about `size` [m] large; from `FLAT` on they vary with x and y alone."""
        inputs = {"Vector": place, "Scale": 1.0 / size, "Detail": detail, "Roughness": roughness}
        return self.out(self.node("ShaderNodeTexNoise", inputs, noise_dimensions="2D" if size >= FLAT else "3D"))

    def swing(self, place: Socket, size: float, detail: float = 2.0, roughness: float = 0.5) -> Socket:
        """Noise around 0: relief that fades out with it leaves neither a step nor a ridge."""
        return self.noise(place, size, detail, roughness) + -0.5

    def cells(self, place: Socket, size: float) -> Any:
        """Voronoi cells of about `size` [m]: outputs are distance to the centre [cells], random colour."""
        return self.node("ShaderNodeTexVoronoi", {"Vector": place, "Scale": 1.0 / size})

    def mix(self, factor: Socket, a: Socket | Colour, b: Socket | Colour) -> Socket:
        """Colour a at factor 0, b at factor 1."""
        inputs = {"Factor_Float": factor, "A_Color": _rgba(a), "B_Color": _rgba(b)}
        return self.out(self.node("ShaderNodeMix", inputs, data_type="RGBA"), 2)

    def times(self, a: Socket | Colour, b: Colour) -> Socket:
        """A colour times another."""
        inputs = {"Factor_Float": 1.0, "A_Color": _rgba(a), "B_Color": _rgba(b)}
        return self.out(self.node("ShaderNodeMix", inputs, data_type="RGBA", blend_type="MULTIPLY"), 2)

    def blend(self, factor: Socket, a: Socket | float, b: Socket | float) -> Socket:
        """Number a at factor 0, b at factor 1."""
        return self.out(self.node("ShaderNodeMix", {"Factor_Float": factor, "A_Float": a, "B_Float": b}))


def _rgba(colour: Socket | Colour) -> Any:
    return colour if isinstance(colour, Socket) else (*colour, 1.0)


def _input(node: Any, key: str | int) -> Any:
    if isinstance(key, int):
        return node.inputs[key]
    return next(socket for socket in node.inputs if key in (socket.identifier, socket.name))
