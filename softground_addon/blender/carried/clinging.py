"""What a body waded in clings to it: how high, as an attribute of its meshes that shaders read.

One modifier before the user's, where meshes have their rest pose, stores it: up to the depth of the deepest step so far
of the nearest sole, which halves with time.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import log
from typing import Any

import bpy
import numpy as np

from ...core.rig.recording import SceneUnits
from .. import mesh_arrays
from ..drafts import none_left_if_it_fails
from ..nodes.node_graph import NodeGraph
from ..nodes.node_modifiers import GroupInput, modifier_with, new_group, put, set_inputs

Step = tuple[int, float, float]
"""Number of its sole, the frame in the middle of its contact, and its depth [m]."""

NAME = "SoftGround Clinging"
MARK = "softground_clinging"
"""Custom property of the group, whatever the user calls it."""
CLUNG = "softground_clung"
OF_STEPS = ("softground_sole", "softground_frame", "softground_depth")
"""Sole of each step, the frame in the middle of its contact, and its depth [m]."""
FLAT = 20.0
"""Radius of a sphere below a foot that is flat across a leg [Blender units]."""
INPUTS = (
    GroupInput("Half After", 60.0, "Time after which half of what clings has fallen off [s]", (0.01, 1e6)),
    GroupInput("Metres", 1.0, "Length of the mesh's unit in the world [m]"),
)


def is_clinging(tree: Any) -> bool:
    """True if a node group is ours."""
    return MARK in tree.keys()  # noqa: SIM118  (an ID is no mapping)


def cling(units: SceneUnits, armature: Any, soles: Sequence[Any], meshes: Sequence[Any], steps: Iterable[Step]) -> None:
    """Let cling to meshes of a character what it waded in by its steps, and by no others."""
    with none_left_if_it_fails():
        group = _group(_table(armature, soles, meshes, steps), soles, units)
    for obj in meshes:
        modifier = modifier_with(obj, is_clinging) or put(obj, NAME, group, 0)
        modifier.node_group = group
        set_inputs(modifier, {"Metres": obj.matrix_world.median_scale * units.unit_scale_m})
    bpy.data.batch_remove({tree for tree in bpy.data.node_groups if is_clinging(tree) and not tree.users})


def _table(armature: Any, soles: Sequence[Any], meshes: Iterable[Any], steps: Iterable[Step]) -> bpy.types.Object:
    """The steps of a character, first one of no depth for each sole, in the middles of spheres in the rest pose.

    A leg is as far from them as it is high, plus their radius; an arm, as far as it is long.
    """
    to_rig = np.array(armature.matrix_world.inverted())
    up, lies = to_rig[:3, 2], [(to_rig @ obj.matrix_world, mesh_arrays.positions(obj.data)) for obj in meshes]
    floor = min(float((place @ at[:3, :3].T @ up).min() + at[:3, 3] @ up) for at, place in lies if len(place))
    places = np.array([armature.data.bones[sole.bone].head_local for sole in soles])
    stands = np.array([sole.kind == "FOOT" for sole in soles])
    places[stands] -= ((places[stands] @ up - floor) / (up @ up) + FLAT)[:, None] * up
    first = ((number, 0.0, 0.0) for number in range(len(soles)))
    values = np.array([*first, *steps]).T
    columns = [(name, "FLOAT", column) for name, column in zip(OF_STEPS, values, strict=True)]
    table = bpy.data.objects.new(NAME, mesh_arrays.points(NAME, places[values[0].astype(int)], columns))
    table.parent = armature
    return table


def _group(table: bpy.types.Object, soles: Sequence[Any], units: SceneUnits) -> bpy.types.NodeTree:
    """The node group, for a table with the steps of some soles."""
    graph = NodeGraph(new_group(NAME, MARK, INPUTS))
    given, frame = graph.node("NodeGroupInput").outputs, graph.number(graph.frame())
    half, metres = (graph.number(given[name]) for name, *_ in INPUTS)
    steps = graph.node("GeometryNodeObjectInfo", {"Object": table}, transform_space="RELATIVE").outputs["Geometry"]
    of, middle, depth = (graph.number(graph.attribute(name)) for name in OF_STEPS)
    age, second = (frame - middle).at_least(0.0), units.frame_rate
    depth = depth * np.exp(age * (-log(2.0) / second) / half) * (1.0 - (middle - frame).above(0.0))
    nearest, clings = graph.number(1e6), graph.number(0.0)
    for number, sole in enumerate(soles):
        inputs = {"Selection": graph.compare("EQUAL", of.socket, float(number)), "Attribute": depth.socket}
        most = graph.node("GeometryNodeAttributeStatistic", {"Geometry": steps, **inputs}).outputs["Max"]
        place = graph.at_index(steps, graph.position(), number)
        away = graph.number(graph.vector("DISTANCE", graph.position(), place, output="Value")) * metres
        away = away - FLAT * units.unit_scale_m * (sole.kind == "FOOT")
        closer = graph.compare("LESS_THAN", away.socket, nearest.socket)
        clings = graph.number(graph.choose("FLOAT", closer, clings.socket, most))
        nearest = away.at_most(nearest)
    graph.finish(graph.store(given["Geometry"], CLUNG, (clings - nearest).socket, True))
    return graph.tree
