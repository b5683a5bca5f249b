"""A run over dunes against the sun: each step throws dry sand, which glows."""

from __future__ import annotations

from math import radians
from pathlib import Path

import bpy
import numpy as np

from gallery import open_air, outfit
from sample_scenes import production, stage
from sample_scenes.body import Body
from sample_scenes.production import Built, Claim, Options
from sample_scenes.run import Run, run

CELL_SIZE: float | None = None
"""Fitted to the soles."""

PRESET = "Dry Sand"
SPEED = 4.2  # m/s
FRAMES = 76
START = 9.5  # m along y; the run is toward -y
STEP, AFTER = -3, 4.3  # the step that is seen, and frames from its strike to the picture
SHUTTER = 0.06
"""Frames that the picture is exposed for."""
PICTURE = (1920, 1080)
HEIGHT = open_air.rolling(swell=0.35, hills=9.0, seed=11)


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> Built:
    """A wide ground, and a run away from the camera."""
    ground = open_air.add_ground(scene, "Dunes", (-7.0, START + 3.0), HEIGHT, "sand")
    open_air.add_camera(
        scene, (0.52, 0.18, 0.22), (-0.04, -0.66, 0.125), 34.0, (-0.04, -0.56, 0.0), 9.0, picture=PICTURE
    )
    motion = run(Body(), Run(speed=SPEED), FRAMES, scene.render.fps)
    return open_air.bake_walk(scene, ground, START, FRAMES, PRESET, cell_size, options, motion)


def claims(built: Built) -> list[Claim]:
    """Steps as deep as a run makes them in dry sand, which throw some of it."""
    bake = built.bakes[PRESET]
    return [
        Claim("Steps in the sand", len(bake.footprints), 6, 12),
        Claim("Depth of the deepest [m]", max(step.max_depth_m for step in bake.footprints), 0.02, 0.12),
        Claim("Thrown sand [l]", bake.report["totals"]["thrown_m3"] * 1e3, 0.05, 10.0),
    ]


def shoot(built: Built, folder: Path, samples: int) -> list[Path]:
    """From where a photographer would lie in the sand, as the heel lifts, with the sun ahead."""
    scene = bpy.context.scene
    step, runner = built.bakes[PRESET].footprints[STEP], bpy.data.objects["Hiker"]
    outfit.wear_boots(runner, Body())
    outfit.wear_creased(runner, Body())
    stage.go_to(scene, step.start_frame + AFTER)
    stage.aim(scene.camera, step.position + np.array((0.56, 0.74, 0.22)), step.position + np.array((0, -0.1, 0.125)))
    open_air.add_low_sun(scene, radians(44), radians(10), (1.0, 0.74, 0.52), 8.0, 0.26, (radians(9.0), 1.6))
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, SHUTTER
    scene.view_settings.exposure, scene.render.image_settings.quality = -0.05, 85
    path = folder / "dune_runner.jpg"
    stage.render(scene, scene.camera, path, PICTURE, samples)
    return [path]


if __name__ == "__main__":
    production.main(__name__)
