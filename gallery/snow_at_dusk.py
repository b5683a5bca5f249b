"""A track in the snow leads to the horizon, at dusk, while it begins to snow."""

from __future__ import annotations

from math import radians
from pathlib import Path

import bpy
import numpy as np

from gallery import firs, open_air, outfit
from sample_scenes import production, stage
from sample_scenes.body import Body
from sample_scenes.production import Built, Claim, Options

CELL_SIZE: float | None = None
"""Fitted to the soles."""

PRESET = "Snow"
FRAMES = 300
START = 2.6  # m along y; the walk is toward -y
PICTURE = (1920, 1080)
FLAKES = 6000
HEIGHT = open_air.rolling(swell=0.16, hills=26.0, seed=3)


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> Built:
    """A wide ground, and a walk away from the camera, which is there first: relief is fine where it comes near."""
    ground = open_air.add_ground(scene, "Snow Field", (-26.0, START + 3.0), HEIGHT, "snow")
    open_air.add_camera(scene, (0.45, 1.75, 0.60), (-0.13, -1.5, 0.09), 28.0, (0.0, 0.1, 0.0), 8.0, picture=PICTURE)
    return open_air.bake_walk(scene, ground, START, FRAMES, PRESET, cell_size, options)


def claims(built: Built) -> list[Claim]:
    """A track, as deep as snow lets a boot in."""
    steps = built.bakes[PRESET].footprints
    return [
        Claim("Steps in the snow", len(steps), 15, 40),
        Claim("Depth of the deepest [m]", max(step.max_depth_m for step in steps), 0.03, 0.15),
    ]


def shoot(_built: Built, folder: Path, samples: int) -> list[Path]:
    """From where a photographer would kneel beside the first steps."""
    scene = bpy.context.scene
    scene.frame_set(scene.frame_end)
    open_air.add_low_sun(scene, radians(28), radians(6.5), (1.0, 0.60, 0.39), 6.5, 0.13, open_air.PALE_DUSK)
    chance = np.random.default_rng(5)
    spots = np.column_stack([chance.normal(0.0, 75.0, 190), -chance.uniform(48.0, 150.0, 190)])
    spots = spots[np.abs(spots[:, 0] + 2.0) > 7.0]
    unseen = np.column_stack([chance.uniform(-60.0, -16.0, 9), chance.uniform(-26.0, -2.0, 9)])
    spots = np.concatenate([spots, unseen])  # which throw shadows into the picture
    firs.add_firs(spots, chance.uniform(4.0, 11.0, len(spots)), HEIGHT, firs.WINTRY, snow=0.7)
    hiker = bpy.data.objects["Hiker"]
    outfit.wear_creased(hiker, Body())
    outfit.wear_rucksack(hiker, Body())
    open_air.add_snowfall(scene.camera, FLAKES, PICTURE[0] / PICTURE[1])
    scene.view_settings.exposure = 0.9
    path = folder / "snow_at_dusk.jpg"
    stage.render(scene, scene.camera, path, PICTURE, samples)
    return [path]


if __name__ == "__main__":
    production.main(__name__)
