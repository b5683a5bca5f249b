"""Shots to bake in tests: the project's own walker, and motion files read with their own scale and axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import bpy
import pytest

from sample_scenes.body import Body
from sample_scenes.character import create_character
from sample_scenes.gait import Gait, walk
from sample_scenes.keys import write_action

SHARED = Path(__file__).parents[3] / "shared" / "data"


@dataclass(frozen=True)
class MotionFile:
    """A motion file and how it is imported."""

    path: str
    scale: float
    forward: str
    up: str


MOTION_FILES = {
    "walk": MotionFile("gait/walk_subject01.bvh", 0.01, "-Z", "Y"),
    "run": MotionFile("gait/run_rajagopal.bvh", 0.01, "-Z", "Y"),
    "zombie": MotionFile("bvh/zombie.bvh", 0.04, "Y", "Z"),
    "jumping": MotionFile("bvh/jumping.bvh", 0.04, "Y", "Z"),
    "jumping_jacks": MotionFile("bvh/jumping_jacks.bvh", 0.056444, "-Z", "Y"),
    "dance": MotionFile("bvh/jesse_dance.bvh", 0.01, "-Z", "Y"),
}


def import_motion(name: str) -> bpy.types.Object:
    """Import a motion file of the reference data into the open file, with `coarse` settings."""
    import_file(MOTION_FILES[name])
    coarse(bpy.context.scene)
    return bpy.context.active_object


def import_file(motion: MotionFile) -> None:
    """Import a motion file of the reference data into the open file; skips the test where it is not there."""
    path = SHARED / motion.path
    if not path.is_file():
        pytest.skip(f"the reference data is not here: {path}")
    bpy.ops.import_anim.bvh(
        filepath=str(path),
        global_scale=motion.scale,
        axis_forward=motion.forward,
        axis_up=motion.up,
        update_scene_fps=True,
        update_scene_duration=True,
    )


COARSE = 4.0
"""How many times further apart than in pictures the vertices of a test's figure are, but for its shoes."""


def coarse(scene: bpy.types.Scene) -> None:
    """Settings with which tests bake quickly: prints alone, flat pressure, cells of a centimetre, a narrow ground."""
    options = scene.softground
    options.sink_feet, options.ground_margin = False, 0.0
    options.cell_size, options.pressure, options.tread = 0.01, "UNIFORM", 0.0
    options.relief, options.debris = "OFF", False


_walk = cache(walk)


def walker(
    scene: bpy.types.Scene, frames: int = 72, rate: int = 24, coarseness: float = COARSE, **gait: float
) -> bpy.types.Object:
    """The project's own character, walking from the origin, with `coarse` settings; it is the active object."""
    scene.render.fps, scene.render.fps_base = rate, 1.0
    body = Body()
    armature = create_character("Walker", body, scene.collection, coarseness)
    write_action(armature, _walk(body, Gait(**gait), frames, rate), "Walk")
    coarse(scene)
    bpy.context.view_layer.objects.active = armature
    return armature


def copies(rig: bpy.types.Object, places: Sequence[tuple[float, float, float, float]]) -> list[bpy.types.Object]:
    """A rig and copies of it with the same meshes and action, at some places (x, y, z, heading) [m, rad]."""
    parts, crowd = [obj for obj in rig.users_collection[0].objects if obj.parent == rig], [rig]
    for _ in places[1:]:
        crowd.append(other := rig.copy())
        for each, parent in ((other, None), *((part.copy(), other) for part in parts)):
            each.parent = parent
            rig.users_collection[0].objects.link(each)
            for modifier in each.modifiers:
                modifier.object = other
    for each, (x, y, z, heading) in zip(crowd, places, strict=True):
        each.location, each.rotation_euler = (x, y, z), (0.0, 0.0, heading)
    return crowd
