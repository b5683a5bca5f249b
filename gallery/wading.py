"""Somebody wades through powder in the afternoon; then the trench behind him, at dusk, from above."""

from __future__ import annotations

from math import radians
from pathlib import Path

import bpy
import numpy as np

from gallery import firs, open_air, outfit
from sample_scenes import production, stage
from sample_scenes.body import Body
from sample_scenes.production import Bake, Built, Claim, Options

CELL_SIZE = 0.005
"""Walls of a trench are seen from near [m]."""

PRESET = "Fresh Fallen Snow"
FRAMES, MOMENT = 80, 60
START = 3.2  # m along y; the walk is toward -y
PICTURE = (1280, 720)
FIRS = 150
BOUNCES = 8
"""Of light, from one piece of snow to the next."""
HEIGHT = open_air.rolling(swell=0.2, hills=18.0, seed=5)


def build(scene: bpy.types.Scene, cell_size: float = CELL_SIZE, options: Options | None = None) -> Built:
    """A snow field, and a walk across the picture."""
    ground = open_air.add_ground(scene, "Powder", (-7.0, START + 3.0), HEIGHT, "snow")
    open_air.add_camera(scene, (3.3, -0.55, 0.85), (0.0, 0.35, 0.42), 35.0, (0.0, 0.2, 0.0), 11.0, picture=PICTURE)
    return open_air.bake_walk(scene, ground, START, FRAMES, PRESET, cell_size, options)


def claims(built: Built) -> list[Claim]:
    """Steps to the knees, and walls that are no steps of a stair."""
    bake = built.bakes[PRESET]
    return [
        Claim("Steps in the snow", len(bake.footprints), 5, 12),
        Claim("Depth of the deepest [m]", max(step.max_depth_m for step in bake.footprints), 0.3, 0.5),
        Claim("Carved snow over what was pressed", _carved(bake), 0.5, 3.0),
    ]


def _carved(bake: Bake) -> float:
    totals = bake.report["totals"]
    return float(totals.get("carved_m3", 0.0) / totals["compressed_m3"])


def shoot(_built: Built, folder: Path, samples: int) -> list[Path]:
    """From the side, as high as the hips; then from above, along the trench."""
    scene = bpy.context.scene
    scene.frame_set(MOMENT)
    hiker = bpy.data.objects["Hiker"]
    outfit.wear_boots(hiker, Body())
    outfit.wear_creased(hiker, Body())
    outfit.wear_rucksack(hiker, Body())
    outfit.wear_snow(hiker)
    chance = np.random.default_rng(8)
    spots = np.column_stack([-chance.uniform(20.0, 120.0, FIRS), chance.normal(0.0, 45.0, FIRS)])
    firs.add_firs(spots, chance.uniform(4.0, 13.0, FIRS), HEIGHT, firs.WINTRY, snow=0.7)
    scene.cycles.max_bounces = BOUNCES
    scene.view_settings.exposure = 0.1
    open_air.add_low_sun(scene, radians(115), radians(17), (1.0, 0.82, 0.64), 8.0, 0.3, open_air.PALE_DUSK)
    side = folder / "wading.jpg"
    stage.render(scene, scene.camera, side, PICTURE, samples)
    scene.view_settings.exposure = 0.7
    open_air.add_low_sun(scene, radians(60), radians(7), (1.0, 0.66, 0.44), 6.0, 0.22, open_air.PALE_DUSK)
    stage.aim(scene.camera, (0.85, 2.9, 1.75), (-0.02, 1.0, -0.1))
    scene.camera.data.dof.use_dof = False
    above = folder / "wading_trench.jpg"
    stage.render(scene, scene.camera, above, PICTURE, samples)
    return [side, above]


if __name__ == "__main__":
    production.main(__name__)
