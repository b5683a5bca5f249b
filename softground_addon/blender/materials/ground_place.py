"""Place that materials take for that of a point of the ground: in the world, or in the frame of a bake that has one."""

from __future__ import annotations

from typing import Any

from ..nodes.shader_graph import Graph, Socket
from ..playback.own_data import FRAME


def ground_place(graph: Graph) -> Socket:
    """Place of what is shaded [Blender units]: that in the world, and in the frame of a bake on ground that moves.

    What looks go by then moves with the ground. The mesh has the axes of its space there.
    """
    return graph.once("place", lambda: _place(graph))


def _place(graph: Graph) -> Socket:
    def axis(name: str) -> Socket:
        return graph.out(graph.node("ShaderNodeAttribute", attribute_name=name, attribute_type="OBJECT"), 1)

    def vector(operation: str, inputs: dict[Any, Socket]) -> Socket:
        return graph.out(graph.node("ShaderNodeVectorMath", inputs, operation=operation))

    in_object = graph.node("ShaderNodeSeparateXYZ", {0: graph.out(graph.node("ShaderNodeTexCoord"), 3)})
    *axes, in_frame = map(axis, FRAME)
    for number, along in enumerate(axes):
        in_frame = vector("ADD", {0: in_frame, 1: vector("SCALE", {0: along, "Scale": graph.out(in_object, number)})})
    length = graph.out(graph.node("ShaderNodeVectorMath", {0: axes[0]}, operation="LENGTH"), 1)
    in_world, has_frame = graph.out(graph.node("ShaderNodeNewGeometry")), graph.math("GREATER_THAN", length, 0.0)
    mixed = {"Factor_Float": has_frame, "A_Vector": in_world, "B_Vector": in_frame}
    return graph.out(graph.node("ShaderNodeMix", mixed, data_type="VECTOR"), 1)
