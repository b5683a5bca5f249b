"""What debris costs in a frame, against the bare frame of a walk and an instance for each piece; in turns."""

import time

import bpy
import numpy as np
import pytest

from softground_addon.blender import compat
from softground_addon.blender.debris import debris_object
from softground_addon.blender.nodes import node_modifiers
from softground_addon.core.debris.debris import Debris
from softground_addon.core.rig.recording import SceneUnits
from tests.benchmarks.bars import below
from tests.benchmarks.test_playback_speed import heavy_walker

pytestmark = pytest.mark.benchmark

FRAMES = 120
TURNS = 8
TIMED = np.random.default_rng(0).permutation(np.arange(2, FRAMES))[:30]


def thrown(count):
    """Pieces whose births are spread over a shot."""
    random = np.random.default_rng(0)
    return Debris(
        birth=np.sort(random.uniform(1, FRAMES, count)),
        start=random.uniform(-3, 3, (count, 3)),
        velocity=random.normal(0, 1, (count, 3)),
        drag_time=random.uniform(0.05, 0.5, count),
        time=random.uniform(0.05, 0.8, count),
        radius=random.uniform(0.001, 0.01, count),
        kind=random.integers(0, 3, count).astype(np.int32),
        step=np.sort(random.integers(0, 50, count)).astype(np.int32),
    )


def put(scene, count):
    parent = bpy.data.objects.new("Ground", None)
    scene.collection.objects.link(parent)
    units = SceneUnits(frame_rate=24.0, time_stretch=1.0, gravity_m_s2=9.81, unit_scale_m=1.0)
    return debris_object.put(parent, thrown(count), surface="snow", units=units)


def an_instance_each(obj):
    """A copy in which every piece has a shape."""
    copy = obj.copy()
    modifier = copy.modifiers[0]
    compat.write_input(modifier, node_modifiers.inputs_of(modifier)["Shaped"], 10**7)
    bpy.context.scene.collection.objects.link(copy)
    return copy


def played(scene, shown, others):
    """Milliseconds of each frame, (F,)."""
    for other in others:
        other.hide_viewport = other != shown
    scene.frame_set(1)
    taken = []
    for frame in TIMED:
        started = time.perf_counter()
        scene.frame_set(int(frame))
        taken.append(time.perf_counter() - started)
    return np.array(taken) * 1e3


@pytest.mark.parametrize(("count", "limit"), [(50_000, 3.0), (300_000, 9.0)])
def test_debris_costs_little_beside_the_bare_frame_of_a_walk(scene, count, limit):
    heavy_walker(scene, FRAMES)
    debris = put(scene, count)
    each = an_instance_each(debris)
    contestants = {"bare": None, "debris": debris, "an instance each": each}
    turns = [{name: played(scene, shown, (debris, each)) for name, shown in contestants.items()} for _ in range(TURNS)]
    least = {name: float(np.min([turn[name] for turn in turns], axis=0).mean()) for name in contestants}
    bare = least["bare"]
    more = least["debris"] - bare
    below(f"a frame's {count:,} pieces of debris over the bare frame", more / bare, limit)
    below(f"a frame's {count:,} pieces of debris over instances", more / (least["an instance each"] - bare), 0.5)
