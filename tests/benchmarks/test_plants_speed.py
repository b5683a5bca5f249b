"""What plants that give way cost a frame, against a modifier that moves all of them by one vector.

Processor time: the least of each frame. Curves are polylines: of smooth ones Blender works out the bounds of whatever
moves, which takes ten times as long as to move it.
"""

import time

import bpy
import numpy as np
import pytest

from softground_addon.blender.ground import baked_ground
from softground_addon.blender.nodes.node_graph import NodeGraph
from softground_addon.blender.nodes.node_modifiers import new_group
from tests.benchmarks.bars import below
from tests.blender import shots
from tests.blender.plants.test_give_way import give_way, hair

pytestmark = pytest.mark.benchmark

CURVES, FRAMES = 100_000, (30, 60, 90, 45, 75)
ON_THE_TRAIL, AROUND_IT, AWAY = 6.0, 7.0, 1.5
"""Most times that of moving them: plants that soles have trodden on, a meadow that they have crossed, and others."""


def lifted(obj):
    """A modifier that moves all by one vector."""
    graph = NodeGraph(new_group("Lift", "lift"))
    given = graph.node("NodeGroupInput").outputs["Geometry"]
    graph.finish(graph.put(given, True, offset=graph.combined(0.0, 0.0, graph.math("MULTIPLY", graph.frame(), 1e-6))))
    modifier = obj.modifiers.new("Lift", "NODES")
    modifier.node_group = graph.tree
    return modifier


def milliseconds(scene):
    def played(frame):
        start = time.process_time()
        scene.frame_set(frame)
        return time.process_time() - start

    return np.min([[played(frame) for frame in FRAMES] for _ in range(5)], axis=0).mean() * 1e3


@pytest.mark.parametrize(
    ("aside", "beyond", "most"), [(0.0, 0.1, ON_THE_TRAIL), (0.0, 4.0, AROUND_IT), (20.0, 0.1, AWAY)]
)
def test_plants_that_give_way(scene, aside, beyond, most):
    shots.walker(scene, frames=100)
    bpy.ops.softground.add_character()
    bpy.ops.softground.bake()
    bare = milliseconds(scene)
    trail = np.array([step.position[:2] for step in baked_ground.load(scene.softground.ground)[0]])
    chance = np.random.default_rng(0)
    place = chance.uniform(trail.min(axis=0) - beyond, trail.max(axis=0) + beyond, (CURVES, 2)) + np.array((aside, 0.0))
    grass = hair(np.column_stack([place, np.zeros(CURVES)]))
    grass.data.set_types(type="POLY")
    modifier = lifted(grass)
    moved = milliseconds(scene) - bare
    grass.modifiers.remove(modifier)
    give_way(grass)
    given_way = milliseconds(scene) - bare
    below(f"plants that give way over moved ones, {aside:g} m aside, {beyond:g} m around", given_way / moved, most)
