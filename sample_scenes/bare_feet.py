"""Bare feet along a beach in the evening: the swash has smoothed the sand that they print."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians
from pathlib import Path

import bpy
import numpy as np

from sample_scenes import open_air, production, stage
from sample_scenes.body import Body, Foot
from sample_scenes.production import Bake, Claim, Options
from sample_scenes.stage import Array

CELL_SIZE = 0.003
"""Fine enough for toes [m]."""

PRESET = "Wet Sand"
PACKED = {
    "relief": "OFF",
    "tread": "0",
    "material.blur_sigma": "0.0015",
    "material.poisson_ratio": "0.15",
    "debris": "false",
}
"""Sand that the swash has packed and smoothed keeps the toes apart and hardly rises around a foot."""

BODY = Body(foot=Foot(0.26, 0.098, bare=True))
FRAMES = 260
START = 2.6  # m along y; the walk is toward -y
PICTURE = (1920, 1080)
EDGE, LEVEL = -1.0, -0.05  # m; where the water stands, and how high
_SKY = (radians(13.0), 1.0)  # as high as the sun: pale gold at the horizon, where a lower one makes it mustard
_HILLS = open_air.rolling(swell=0.10, hills=16.0, seed=8)


def height(x: Array, y: Array) -> Array:
    """Dunes on the left, which rise the slower the farther away, and on the right a slope into the sea [m]."""
    land = np.clip((x + 1.2) / (6.0 + 0.2 * np.abs(y)), 0.0, 1.0) ** 2
    return land * _HILLS(x, y) - 0.06 * np.clip(-0.8 - x, 0.0, 30.0)


def shore(y: Array) -> Array:
    """Edge of the water [m]: the lobes of the last wave."""
    return EDGE + 0.16 * np.sin(1.1 * y + 0.8) + 0.10 * np.sin(2.3 * y + 2.0) + 0.04 * np.sin(6.1 * y)


@dataclass(frozen=True)
class BareFeet:
    """One long walk."""

    bakes: dict[str, Bake]


def build(scene: bpy.types.Scene, cell_size: float = CELL_SIZE, options: Options | None = None) -> BareFeet:
    """A wide beach, and a walk along the water, away from the camera."""
    ground = open_air.add_ground(scene, "Beach", (-20.0, START + 3.0), height, "wet_sand")
    scene.render.resolution_x, scene.render.resolution_y = PICTURE
    open_air.add_camera(scene, (0.30, 1.76, 0.74), (-0.24, -1.5, 0.0), 28.0, (0.0, 0.1, 0.0), 8.0)
    chosen = PACKED | dict(options or {})
    bake = open_air.bake_walk(scene, ground, START, FRAMES, PRESET, cell_size, chosen, body=BODY)
    return BareFeet({PRESET: bake})


def claims(built: BareFeet) -> list[Claim]:
    """A track as deep as wet sand lets bare feet in."""
    steps = built.bakes[PRESET].footprints
    return [
        Claim("Steps in the sand", len(steps), 12, 40),
        Claim("Depth of the deepest [m]", max(step.max_depth_m for step in steps), 0.008, 0.06),
    ]


def shoot(_built: BareFeet, folder: Path, samples: int) -> list[Path]:
    """From the height of a knee, with the sun over the sea."""
    scene = bpy.context.scene
    scene.frame_set(scene.frame_end)
    open_air.add_low_sun(scene, radians(-50), radians(21), (1.0, 0.72, 0.48), 6.5, 0.11, _SKY)
    open_air.add_sea(scene, shore, LEVEL, height)
    chance = np.random.default_rng(5)
    spots = np.column_stack([5.5 + chance.gamma(1.5, 5.0, 700), 1.0 - chance.uniform(0.0, 60.0, 700)])
    open_air.add_grass(spots, 0.15 + chance.gamma(2.0, 0.12, len(spots)), height)
    scene.view_settings.exposure, scene.render.image_settings.quality = 0.85, 85
    path = folder / "bare_feet.jpg"
    stage.render(scene, scene.camera, path, PICTURE, samples)
    return [path]


if __name__ == "__main__":
    production.main(__name__)
