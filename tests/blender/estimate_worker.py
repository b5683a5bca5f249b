"""A bake in a process of its own, so that its memory can be seen: prints the estimate and what it took as JSON."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import bpy

import softground_addon
from softground_addon.blender import jobs, settings
from softground_addon.blender.baking import bake_job
from softground_addon.blender.reading import analysis
from tests.blender import shots
from tests.pace import pace_now


def memory(what: str) -> int:
    """Memory that this process has, `VmRSS`, or has had at most, `VmHWM` [bytes]."""
    line = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith(what))
    return int(line.split()[1]) * 1024


def main(scale: float, cell_size: float, frames: int) -> dict[str, tuple[float, float]]:
    """Time [s] and memory [bytes] of a default bake: as estimated at the pace of this machine, and as taken."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    walker = shots.walker(scene, frames=frames, coarseness=1.0)
    walker.scale = (scale,) * 3
    bpy.ops.softground.add_character()
    bpy.ops.softground.load_preset(name="Snow")
    options = scene.softground
    options.cell_size, options.frame_end = cell_size, frames
    options.relief, options.debris, options.sink_feet = "CLOSE_UP", True, True
    estimated = analysis.read(scene).coverage.bake_costs(settings.snapshot(scene).fineness)
    before_it = pace_now()
    Path("/proc/self/clear_refs").write_text("5")  # the most that it has had, from here on
    before, started = memory("VmRSS"), time.process_time()
    jobs.run(bake_job.bake(scene))
    taken = memory("VmHWM") - before, time.process_time() - started
    estimated = estimated[0], estimated[1] * (before_it + pace_now()) / 2
    return dict(zip(("memory", "time"), zip(estimated, taken, strict=True), strict=True))


if __name__ == "__main__":
    softground_addon.register()
    try:
        print("RESULT", json.dumps(main(float(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3]))))
    finally:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        softground_addon.unregister()
