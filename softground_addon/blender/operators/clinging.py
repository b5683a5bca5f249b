"""*Snow and Mud on Legs*: how high what a body waded in clings to it, as an attribute of its meshes.

One modifier before the user's, where meshes have their rest pose, stores it: up to the depth of the deepest step so far
of the nearest sole, which halves with time.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import log
from typing import Any

import bpy
import numpy as np

from ...core.errors import InputError
from .. import mesh_arrays, settings
from ..drafts import none_left_if_it_fails
from ..ground import baked_ground
from ..nodes.node_graph import NodeGraph
from ..nodes.node_modifiers import GroupInput, modifier_with, new_group, put, set_inputs
from ..operator_base import Act, OnBake
from ..playback.playback import barrier_on
from ..sampling.skin_sampling import meshes_on
from .panel_base import active_character

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


class SOFTGROUND_OT_cling(OnBake, Act):
    """Give the character's meshes an attribute for your shaders, softground_clung: how far below the edge of clinging
    snow or mud a vertex is [m], less than 0 above it. One modifier before yours; remove it, and all is as it was. Press
    it again after another bake"""

    bl_idname = "softground.cling"
    bl_label = "Snow and Mud on Legs"

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        character = active_character(settings.options_of(context))
        return super().missing(context) if character and character.armature else "Add a character first"

    def act(self, context: bpy.types.Context) -> None:
        scene, character = settings.scene_of(context), active_character(settings.options_of(context))
        armature, every = character.armature, meshes_on(scene.objects, character.armature)
        meshes = [obj for obj in every if not (obj.library or obj.parent_type == "BONE" or barrier_on(obj))]
        soles = [sole for sole in character.soles if sole.bone in armature.data.bones]
        if not (meshes and soles):
            raise InputError(f"'{armature.name}' deforms no mesh that stands on its bones.")
        with none_left_if_it_fails():
            group = _group(_table(armature, soles, meshes, settings.grounds_of(scene.softground)), soles, scene)
        for obj in meshes:
            modifier = modifier_with(obj, is_clinging) or put(obj, NAME, group, 0)
            modifier.node_group = group
            set_inputs(modifier, {"Metres": obj.matrix_world.median_scale * scene.unit_settings.scale_length})
        bpy.data.batch_remove({tree for tree in bpy.data.node_groups if is_clinging(tree) and not tree.users})
        self.say("{count} meshes have '{name}'", count=len(meshes), name=CLUNG)


def is_clinging(tree: Any) -> bool:
    """True if a node group is ours."""
    return MARK in tree.keys()  # noqa: SIM118  (an ID is no mapping)


def _table(armature: Any, soles: Sequence[Any], meshes: Iterable[Any], grounds: Iterable[Any]) -> bpy.types.Object:
    """The steps of a character, first one of no depth for each sole, in the middles of spheres in the rest pose.

    A leg is as far from them as it is high, plus their radius; an arm, as far as it is long.
    """
    to_rig, names = np.array(armature.matrix_world.inverted()), [sole.name for sole in soles]
    up, lies = to_rig[:3, 2], [(to_rig @ obj.matrix_world, mesh_arrays.positions(obj.data)) for obj in meshes]
    floor = min(float((place @ at[:3, :3].T @ up).min() + at[:3, 3] @ up) for at, place in lies if len(place))
    places = np.array([armature.data.bones[sole.bone].head_local for sole in soles])
    stands = np.array([sole.kind == "FOOT" for sole in soles])
    places[stands] -= ((places[stands] @ up - floor) / (up @ up) + FLAT)[:, None] * up
    steps = [(number, 0.0, 0.0) for number in range(len(soles))]
    for record in map(baked_ground.record_of, filter(baked_ground.is_baked, grounds)):
        stretch = baked_ground.units_of(record.about["inputs"]).time_stretch
        for step in record.edited:
            if step.character == armature.name and step.sole in names:
                middle = (step.start_frame + step.end_frame) / 2 * stretch
                steps.append((names.index(step.sole), middle, step.max_depth_m))
    values = np.array(steps).T
    columns = [(name, "FLOAT", column) for name, column in zip(OF_STEPS, values, strict=True)]
    table = bpy.data.objects.new(NAME, mesh_arrays.points(NAME, places[values[0].astype(int)], columns))
    table.parent = armature
    return table


def _group(table: bpy.types.Object, soles: Sequence[Any], scene: bpy.types.Scene) -> bpy.types.NodeTree:
    """The node group, for a table with the steps of some soles."""
    graph = NodeGraph(new_group(NAME, MARK, INPUTS))
    given, frame = graph.node("NodeGroupInput").outputs, graph.number(graph.frame())
    half, metres = (graph.number(given[name]) for name, *_ in INPUTS)
    steps = graph.node("GeometryNodeObjectInfo", {"Object": table}, transform_space="RELATIVE").outputs["Geometry"]
    of, middle, depth = (graph.number(graph.attribute(name)) for name in OF_STEPS)
    age, second = (frame - middle).at_least(0.0), scene.render.fps / scene.render.fps_base
    depth = depth * np.exp(age * (-log(2.0) / second) / half) * (1.0 - (middle - frame).above(0.0))
    nearest, clings = graph.number(1e6), graph.number(0.0)
    for number, sole in enumerate(soles):
        inputs = {"Selection": graph.compare("EQUAL", of.socket, float(number)), "Attribute": depth.socket}
        most = graph.node("GeometryNodeAttributeStatistic", {"Geometry": steps, **inputs}).outputs["Max"]
        place = graph.at_index(steps, graph.position(), number)
        away = graph.number(graph.vector("DISTANCE", graph.position(), place, output="Value")) * metres
        away = away - FLAT * scene.unit_settings.scale_length * (sole.kind == "FOOT")
        closer = graph.compare("LESS_THAN", away.socket, nearest.socket)
        clings = graph.number(graph.choose("FLOAT", closer, clings.socket, most))
        nearest = away.at_most(nearest)
    graph.finish(graph.store(given["Geometry"], CLUNG, (clings - nearest).socket, True))
    return graph.tree


CLASSES = (SOFTGROUND_OT_cling,)
