"""A fox walks through snow to its elbows: each paw carves its way in and out."""

from __future__ import annotations

from math import radians
from pathlib import Path

import bpy
import numpy as np

from gallery import firs, open_air
from gallery.fox_in_powder import BODY, wear_fur
from sample_scenes import production, stage
from sample_scenes.four_legged import WALK, go_on_four_legs
from sample_scenes.production import Built, Claim, Options

CELL_SIZE = 0.005
PRESET = "Settled Snow"
FIRM = {"material.youngs_modulus": "200000"}
"""In which a fox sinks to its elbows and no more [Pa]."""
FRAMES, MOMENT = 80, 66
START = 2.5  # m along y; the fox goes toward -y
PICTURE = (1280, 720)
FIRS = 120
HEIGHT = open_air.rolling(swell=0.2, hills=16.0, seed=9)


def build(scene: bpy.types.Scene, cell_size: float = CELL_SIZE, options: Options | None = None) -> Built:
    """A snow field, and a fox across the picture."""
    ground = open_air.add_ground(scene, "Snow", (-6.0, START + 3.0), HEIGHT, "snow")
    open_air.add_camera(scene, (1.75, -0.6, 0.5), (0.0, -0.1, 0.12), 38.0, (0.0, 0.0, 0.0), 11.0, picture=PICTURE)
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
    """From the side, as high as the fox."""
    scene = bpy.context.scene
    scene.frame_set(MOMENT)
    open_air.add_low_sun(scene, radians(120), radians(15), (1.0, 0.80, 0.60), 8.0, 0.3, open_air.PALE_DUSK)
    chance = np.random.default_rng(4)
    spots = np.column_stack([-chance.uniform(18.0, 110.0, FIRS), chance.normal(0.0, 40.0, FIRS)])
    firs.add_firs(spots, chance.uniform(4.0, 12.0, FIRS), HEIGHT, firs.WINTRY, snow=0.7)
    wear_fur()
    scene.view_settings.exposure = 0.1
    path = folder / "fox_in_deep_snow.jpg"
    stage.render(scene, scene.camera, path, PICTURE, samples)
    return [path]


if __name__ == "__main__":
    production.main(__name__)
