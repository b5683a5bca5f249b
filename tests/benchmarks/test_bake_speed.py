"""What a whole bake costs against what Blender needs to step through the same frames."""

import time

import bpy
import pytest

import softground_addon
from softground_addon.blender import bake_job, jobs
from tests.blender import shots

FRAMES = 250


@pytest.fixture
def scene():
    softground_addon.register()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    yield bpy.context.scene
    bpy.ops.wm.read_factory_settings(use_empty=True)
    softground_addon.unregister()


def bare_frames(scene):
    """Seconds to step through the frames of the character without its meshes."""
    for thing in list(scene.objects):
        if thing.type == "MESH":
            bpy.data.objects.remove(thing)
    started = time.perf_counter()
    for frame in range(1, FRAMES + 1):
        scene.frame_set(frame)
    return time.perf_counter() - started


@pytest.mark.benchmark
@pytest.mark.xfail(reason="reading soles, making the ground and fitting the playback cost more than light rigs do")
def test_a_whole_bake_costs_at_most_twice_the_bare_frames_plus_the_simulation(scene):
    ratios = []
    for _ in range(3):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        shots.walker(scene, frames=FRAMES)
        bpy.context.view_layer.update()
        bpy.ops.softground.add_character()
        started = time.perf_counter()
        timings = jobs.run(bake_job.bake(scene)).report["timings"]
        whole = time.perf_counter() - started
        bare = bare_frames(scene)
        ratios.append((whole - timings["simulate"]) / bare)
        stages = ", ".join(f"{stage} {timings[stage] / FRAMES * 1e3:.2f}" for stage in ("sample", "simulate", "write"))
        print(
            f"\n{FRAMES} frames, {timings['frames_per_second']:.0f} frames/s; ms per frame: {stages}, "
            f"bare {bare / FRAMES * 1e3:.2f}; (sample + write) / bare {ratios[-1]:.2f}"
        )
    assert sorted(ratios)[1] < 2.0
