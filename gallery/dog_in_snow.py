"""A dog walks through snow as deep as its legs are long: each paw carves its way in and out."""

from __future__ import annotations

from math import radians
from pathlib import Path

import bpy
import numpy as np

from gallery import firs, fur, open_air
from sample_scenes import production, stage
from sample_scenes.dog import Dog
from sample_scenes.four_legged import WALK, go_on_four_legs
from sample_scenes.production import Built, Claim, Options
from sample_scenes.stage import Array

CELL_SIZE = 0.005
PRESET = "Settled Snow"
FIRM = {"material.youngs_modulus": "300000"}
"""In which a dog sinks to its elbows no more [Pa]."""
BODY = Dog()
FRAMES, MOMENT = 80, 66
START = 2.4  # m along y; the dog goes toward -y
PICTURE = (1280, 720)
HAIRS, THICKNESS, LONGEST = 50000, 0.0012, 0.03
FIRS = 120
HEIGHT = open_air.rolling(swell=0.2, hills=16.0, seed=9)


def build(scene: bpy.types.Scene, cell_size: float = CELL_SIZE, options: Options | None = None) -> Built:
    """A snow field, and a dog across the picture."""
    ground = open_air.add_ground(scene, "Snow", (-6.0, START + 3.0), HEIGHT, "snow")
    open_air.add_camera(scene, (2.5, -0.75, 0.72), (0.0, -0.12, 0.2), 38.0, (0.0, 0.0, 0.0), 11.0, picture=PICTURE)
    motion = go_on_four_legs(BODY, WALK, FRAMES, scene.render.fps)
    return open_air.bake_walk(scene, ground, START, FRAMES, PRESET, cell_size, FIRM | dict(options or {}), motion, BODY)


def claims(built: Built) -> list[Claim]:
    """Paws in the snow, and more of it carved by legs than pressed."""
    bake = built.bakes[PRESET]
    totals = bake.report["totals"]
    return [
        Claim("Steps in the snow", len(bake.footprints), 12, 30),
        Claim("Depth of the deepest [m]", max(step.max_depth_m for step in bake.footprints), 0.1, 0.4),
        Claim("Carved snow over what was pressed", totals["carved_m3"] / totals["compressed_m3"], 0.3, 5.0),
    ]


def shoot(_built: Built, folder: Path, samples: int) -> list[Path]:
    """From the side, as high as the dog."""
    scene = bpy.context.scene
    scene.frame_set(MOMENT)
    open_air.add_low_sun(scene, radians(120), radians(15), (1.0, 0.80, 0.60), 8.0, 0.3, open_air.PALE_DUSK)
    chance = np.random.default_rng(4)
    spots = np.column_stack([-chance.uniform(18.0, 110.0, FIRS), chance.normal(0.0, 40.0, FIRS)])
    firs.add_firs(spots, chance.uniform(4.0, 12.0, FIRS), HEIGHT, firs.WINTRY, snow=0.7)
    figure = next(child for child in bpy.data.objects["Animal"].children if child.type == "MESH")
    coat = next(number for number, one in enumerate(figure.material_slots) if "coat" in one.material.name.lower())
    fur.add_fur(figure, HAIRS, _lie, _coat, THICKNESS, coat)
    scene.view_settings.exposure = 0.1
    path = folder / "dog_in_snow.jpg"
    stage.render(scene, scene.camera, path, PICTURE, samples)
    return [path]


def _lie(place: Array, normal: Array, chance: np.random.Generator) -> Array:
    """Hairs from root to tip [m]: backward on the trunk, down on legs, short on head and paws."""
    up = place[:, 2] / BODY.withers
    ahead = -place[:, 1] / BODY.withers
    flow = np.where((up < 0.55)[:, None], (0.0, 0.3, -1.0), (0.0, 1.0, -0.35)) + chance.normal(0.0, 0.2, place.shape)
    flow -= (flow * normal).sum(axis=1, keepdims=True) * normal
    flow /= np.linalg.norm(flow, axis=1, keepdims=True)
    length = LONGEST * np.clip(up - 0.15, 0.2, 0.6) / 0.6 * np.where(ahead > 0.6, 0.4, 1.0)
    return (length * chance.uniform(0.6, 1.1, len(place)))[:, None] * (flow + 0.35 * normal)


def _coat(place: Array, normal: Array, chance: np.random.Generator) -> Array:
    """Black on the back, brown below."""
    dark = np.clip(1.6 * normal[:, 2] + chance.normal(0.0, 0.25, len(place)), 0.0, 1.0)[:, None]
    light = chance.uniform(0.8, 1.2, len(place))[:, None]
    return light * ((1.0 - dark) * np.array((0.30, 0.16, 0.07)) + dark * np.array((0.045, 0.03, 0.022)))


if __name__ == "__main__":
    production.main(__name__)
