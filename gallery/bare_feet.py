"""Bare feet along a beach in the evening: the swash has smoothed the sand that they print."""

from __future__ import annotations

from math import pi, radians
from pathlib import Path

import bpy
import numpy as np

from gallery import litter, open_air, seaside
from sample_scenes import production, stage
from sample_scenes.body import Body, Foot
from sample_scenes.production import Built, Claim, Options
from sample_scenes.stage import Array

CELL_SIZE = 0.002
"""Fine enough for toes [m]."""

PRESET = "Wet Sand"
PACKED = {
    "relief": "CLOSE_UP",
    "relief_strength": "0.16",
    "tread": "0",
    "material.youngs_modulus": "2.6e6",
    "material.blur_sigma": "0.0015",
    "material.poisson_ratio": "0.02",
    "material.rim_reach": "0.012",
    "debris": "false",
}
"""Sand that the swash has packed and smoothed keeps the toes apart, and hardly rises around a foot."""

BODY = Body(foot=Foot(0.26, 0.098, bare=True))
FRAMES = 260
START = 2.6  # m along y; the walk is toward -y
PICTURE = (1920, 1080)
EDGE, LEVEL = -0.85, -0.05  # m; where the water stands, and how high
SUN = (radians(24.0), radians(9.0))
"""Where the light goes, and how high it comes from: against it sand shines, and toes cast shadows."""
_HILLS = open_air.rolling(swell=0.10, hills=16.0, seed=8)


def height(x: Array, y: Array) -> Array:
    """Dunes on the left, which rise the slower the farther away, and on the right a slope into the sea [m]."""
    land = np.clip((x - 3.0) / (6.0 + 0.2 * np.abs(y)), 0.0, 1.0) ** 2
    return land * _HILLS(x, y) - 0.06 * np.clip(-0.8 - x, 0.0, 30.0)


def shore(y: Array) -> Array:
    """Edge of the water [m]: the lobes of the last wave."""
    return EDGE + 0.16 * np.sin(1.1 * y + 0.8) + 0.10 * np.sin(2.3 * y + 2.0) + 0.04 * np.sin(6.1 * y)


def build(scene: bpy.types.Scene, cell_size: float = CELL_SIZE, options: Options | None = None) -> Built:
    """A wide beach, and a walk along the water, away from the camera."""
    ground = open_air.add_ground(scene, "Beach", (-20.0, START + 3.0), height, "wet_sand")
    open_air.add_camera(scene, (0.14, 2.06, 0.52), (-0.15, -0.06, 0.0), 28.0, (0.0, 1.0, 0.0), 14.0, picture=PICTURE)
    chosen = PACKED | dict(options or {})
    return open_air.bake_walk(scene, ground, START, FRAMES, PRESET, cell_size, chosen, body=BODY)


def claims(built: Built) -> list[Claim]:
    """A track as deep as wet sand lets bare feet in."""
    steps = built.bakes[PRESET].footprints
    return [
        Claim("Steps in the sand", len(steps), 12, 40),
        Claim("Depth of the deepest [m]", max(step.max_depth_m for step in steps), 0.008, 0.06),
    ]


def _add_pebbles() -> None:
    """Pebbles beside the track."""
    chance = np.random.default_rng(11)
    shapes = litter.stones((0.20, 0.15, 0.11), (0.62, 0.55, 0.47), roughness=0.35, rough=0.25).objects
    x, y = chance.uniform(-0.8, 1.6, 220), chance.uniform(-7.0, 1.9, 220)
    for number in np.flatnonzero(np.abs(x) > 0.17):
        size = 0.005 + 0.006 * chance.gamma(0.8)
        pebble = bpy.data.objects.new("Pebble", shapes[number % len(shapes)].data)
        pebble.location = (x[number], y[number], float(height(x[number], y[number])) + 0.15 * size)
        pebble.rotation_euler.z, pebble.scale = chance.uniform(0.0, 2.0 * pi), (size, size, size)
        bpy.context.scene.collection.objects.link(pebble)


def shoot(_built: Built, folder: Path, samples: int) -> list[Path]:
    """Low over the sand, toward the sun over the sea."""
    scene = bpy.context.scene
    scene.frame_set(scene.frame_end)
    stage.hide(bpy.data.objects["Hiker"])
    open_air.add_low_sun(scene, *SUN, (1.0, 0.70, 0.44), 7.5, 0.11)
    seaside.add_sky(scene, *SUN, 0.5)
    seaside.add_film(-0.05, 1.0)
    _add_pebbles()
    open_air.add_sea(scene, shore, LEVEL, height)
    scene.view_settings.exposure, scene.render.image_settings.quality = 0.9, 85
    path = folder / "bare_feet.jpg"
    stage.render(scene, scene.camera, path, PICTURE, samples)
    return [path]


if __name__ == "__main__":
    production.main(__name__)
