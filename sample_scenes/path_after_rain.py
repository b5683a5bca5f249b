"""A walk along a forest path, after a shower: water stands in the prints and mirrors the sky."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians
from pathlib import Path

import bpy
import numpy as np

from sample_scenes import firs, open_air, production, stage
from sample_scenes.production import Bake, Claim, Options
from softground_addon.blender.ground import weather

CELL_SIZE: float | None = None
"""Fitted to the soles."""

PRESET = "Soil"
FRAMES = 260
START = 2.6  # m along y; the walk is toward -y
PICTURE = (1920, 1080)
TUFTS = 3000
HEIGHT = open_air.rolling(swell=0.20, hills=14.0, seed=8)


@dataclass(frozen=True)
class PathAfterRain:
    """One long walk."""

    bakes: dict[str, Bake]


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> PathAfterRain:
    """A wide ground, a walk away from the camera, and a shower on its prints."""
    ground = open_air.add_ground(scene, "Path", (-20.0, START + 3.0), HEIGHT, "soil")
    scene.render.resolution_x, scene.render.resolution_y = PICTURE
    open_air.add_camera(scene, (0.40, 1.70, 0.62), (-0.12, -1.2, 0.06), 28.0, (0.0, 0.1, 0.0), 8.0)
    bake = open_air.bake_walk(scene, ground, START, FRAMES, PRESET, cell_size, options)
    weather.set_preset(weather.add(bake.ground), "SHOWER")
    return PathAfterRain({PRESET: bake})


def claims(built: PathAfterRain) -> list[Claim]:
    """A track of the depth of boots in soil."""
    steps = built.bakes[PRESET].footprints
    return [
        Claim("Steps in the soil", len(steps), 12, 40),
        Claim("Depth of the deepest [m]", max(step.max_depth_m for step in steps), 0.01, 0.08),
    ]


def shoot(_built: PathAfterRain, folder: Path, samples: int) -> list[Path]:
    """From the height of a knee, with the light from the side."""
    scene = bpy.context.scene
    scene.frame_set(scene.frame_end)
    stage.add_sun(scene, radians(28), radians(14))
    chance = np.random.default_rng(5)
    sides = np.where(chance.random(140) < 0.5, -1.0, 1.0)
    spots = np.column_stack([sides * (9.0 + chance.gamma(1.6, 9.0, 140)), -chance.uniform(22.0, 110.0, 140)])
    firs.add_firs(spots, chance.uniform(5.0, 14.0, len(spots)), HEIGHT, (0.042, 0.060, 0.036))
    sides = np.where(chance.random(TUFTS) < 0.5, -1.0, 1.0)
    spots = np.column_stack(
        [sides * (0.75 + chance.gamma(1.3, 1.9, TUFTS)), 2.0 - chance.uniform(0.0, 1.0, TUFTS) ** 1.6 * 24]
    )
    open_air.add_grass(spots, 0.06 + chance.gamma(2.0, 0.05, TUFTS), HEIGHT)
    scene.view_settings.exposure, scene.render.image_settings.quality = 0.1, 80
    path = folder / "path_after_rain.jpg"
    stage.render(scene, scene.camera, path, PICTURE, samples)
    return [path]


if __name__ == "__main__":
    production.main(__name__)
