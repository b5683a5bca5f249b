"""Boots have broken through wind-packed snow: plates around their holes, in a low sun."""

from __future__ import annotations

from math import radians
from pathlib import Path

import bpy
import numpy as np

from gallery import open_air
from sample_scenes import production, stage
from sample_scenes.production import Built, Claim, Options

CELL_SIZE: float | None = None
"""Fitted to the soles."""

PRESET = "Wind-Packed Snow"
FRAMES = 96
START = 2.6  # m along y; the walk is toward -y
STEP = -4  # the step that is seen
PICTURE = (720, 480)
BOUNCES = 8
"""Of light, from one piece of snow to the next."""
EYE, TARGET = np.array((0.66, 0.56, 0.4)), np.array((0.09, -0.12, -0.03))
"""Of the camera, beside the step [m]."""
HEIGHT = open_air.rolling(swell=0.2, hills=14.0, seed=4)


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> Built:
    """A snow field, and a walk away from the camera."""
    ground = open_air.add_ground(scene, "Snow", (-5.0, START + 3.0), HEIGHT, "snow")
    open_air.add_camera(scene, (0.75, 0.3, 0.62), (0.0, -0.62, -0.1), 38.0, (0.0, -0.5, 0.0), 11.0, picture=PICTURE)
    return open_air.bake_walk(scene, ground, START, FRAMES, PRESET, cell_size, options)


def claims(built: Built) -> list[Claim]:
    """Steps that go through the crust."""
    bake = built.bakes[PRESET]
    return [
        Claim("Steps in the snow", len(bake.footprints), 5, 12),
        Claim("Depth of the deepest [m]", max(step.max_depth_m for step in bake.footprints), 0.12, 0.25),
    ]


def shoot(built: Built, folder: Path, samples: int) -> list[Path]:
    """A hole from near, with those before it."""
    scene, bake = bpy.context.scene, built.bakes[PRESET]
    step = bake.footprints[STEP]
    bpy.data.objects["Hiker"].hide_render = True
    for child in bpy.data.objects["Hiker"].children_recursive:
        child.hide_render = True
    scene.cycles.max_bounces = BOUNCES
    scene.view_settings.exposure = -0.1
    open_air.add_low_sun(scene, radians(125), radians(11), (1.0, 0.82, 0.64), 7.0, 0.3, open_air.PALE_DUSK)
    scene.frame_set(FRAMES)
    stage.aim(scene.camera, step.position + EYE, step.position + TARGET)
    path = folder / "wind_crust.jpg"
    stage.render(scene, scene.camera, path, PICTURE, samples)
    return [path]


if __name__ == "__main__":
    production.main(__name__)
