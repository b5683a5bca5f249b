"""A bake in a process of its own, so that its memory can be told: prints what it took as JSON."""

import json
import math
import sys
import time
from pathlib import Path

import bpy
import numpy as np

import softground_addon
from sample_scenes.body import Body
from sample_scenes.character import create_character
from sample_scenes.course import Course
from sample_scenes.gait import Gait, walk
from sample_scenes.keys import write_action
from softground_addon.blender import jobs
from softground_addon.blender.baking import bake_job
from softground_addon.blender.ground import baked_ground, ground_mesh

RATE = 24


def peak_memory() -> int:
    """The largest memory that this process has had [bytes]. That of `resource` counts its parent's too."""
    line = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM"))
    return int(line.split()[1]) * 1024


def way(radius: float, length: float) -> Course:
    """Straight on, or around the origin as often as it takes."""
    if not radius:
        return Course()
    rounds = math.ceil(length / (2 * np.pi * radius))
    angle = 2 * np.pi * np.linspace(0.0, rounds, 24 * rounds + 1)
    return Course(radius * np.stack([np.sin(angle), -np.cos(angle)], axis=-1))


def main(steps: int, size: float, cell_size: float, radius: float, blend: Path) -> dict[str, object]:
    """Bake a walk of so many steps on a plane of four vertices, with detail along the trail."""
    scene = bpy.context.scene
    scene.render.fps = RATE
    body, gait = Body(), Gait(speed=0.6)
    frames = round(steps * gait.stride_time(body) / 2 * RATE)
    armature = create_character("Walker", body, scene.collection)
    write_action(armature, walk(body, gait, frames, RATE, course=way(radius, gait.speed * frames / RATE)), "Walk")
    scene.frame_end = frames
    bpy.ops.mesh.primitive_plane_add(size=size)
    options = scene.softground
    options.ground, options.cell_size, options.shape_keys = bpy.context.object, cell_size, False
    bpy.context.view_layer.objects.active = armature
    bpy.ops.softground.add_character()
    options.frame_end = frames
    bpy.context.view_layer.update()
    bpy.ops.wm.save_as_mainfile(filepath=str(blend), compress=True)
    before, without = peak_memory(), blend.stat().st_size
    started = time.process_time()
    report = jobs.run(bake_job.bake(scene)).report
    seconds = time.process_time() - started
    display_mesh = baked_ground.display_mesh_of(options.ground)
    memory = peak_memory()
    bpy.ops.wm.save_as_mainfile(filepath=str(blend), compress=True)
    return {
        "steps": report["totals"]["steps"],
        "seconds": seconds,
        "memory": memory - before,
        "vertices": len(display_mesh.data.vertices),
        "record": len(bytes(display_mesh.data[ground_mesh.RECORD])),
        "blend": blend.stat().st_size - without,
    }


if __name__ == "__main__":
    softground_addon.register()
    try:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        arguments = sys.argv[1:]
        print("RESULT", json.dumps(main(int(arguments[0]), *map(float, arguments[1:4]), Path(arguments[4]))))
    finally:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        softground_addon.unregister()
