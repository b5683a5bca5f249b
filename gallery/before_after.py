"""Sink Feet, before and after: a walk in deep snow, and a line that wipes from one to the other and back."""

from __future__ import annotations

from math import cos, pi, radians
from pathlib import Path

import bpy
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from gallery import firs, open_air, outfit
from sample_scenes import production, stage
from sample_scenes.body import Body
from sample_scenes.production import Built, Claim, Options

CELL_SIZE: float | None = None
"""Fitted to the soles."""

PRESET = "Snow"
SOFTER = "2.2e5"
"""Young's modulus for prints of a hand's breadth [Pa]."""
FRAMES, SHOWN = 72, 60
START = 1.6  # m along y; the walk is toward -y
FIRS = 190
HEIGHT = open_air.rolling(swell=0.2, hills=14.0, seed=11)
PICTURE = (960, 540)

MOMENTS, HOLD = 32, 900
"""Frames of the wipe there and back, and how long it rests at either end [ms]."""
STEP = 50
"""What each of the others takes [ms]."""
QUALITY = 82


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> Built:
    """A walk past the camera, which is there first."""
    ground = open_air.add_ground(scene, "Snow", (-8.0, START + 3.0), HEIGHT, "snow")
    open_air.add_camera(scene, (0.95, -1.80, 0.34), (0.02, -1.21, 0.10), 34.0, (0.06, -1.28, 0.0), 8.0, picture=PICTURE)
    chosen = {"relief_vertices": "400000", "material.youngs_modulus": SOFTER} | dict(options or {})
    return open_air.bake_walk(scene, ground, START, FRAMES, PRESET, cell_size, chosen)


def claims(built: Built) -> list[Claim]:
    """Feet that float without the response stand with it."""
    gaps = {
        when: max(size["p95"] for size in built.bakes[PRESET].report["gaps_mm"][when]["Hiker"].values())
        for when in ("before", "after")
    }
    return [
        Claim("Distance of standing soles from the ground without response, 95 % [mm]", gaps["before"], 20, 300),
        Claim("Distance of standing soles from the ground with response, 95 % [mm]", gaps["after"], 0, 3),
    ]


def shoot(_built: Built, folder: Path, samples: int) -> list[Path]:
    """The same frame without and with the layer, and the wipe between them."""
    scene = bpy.context.scene
    open_air.add_low_sun(scene, radians(110), radians(11), (1.0, 0.80, 0.60), 7.0, 0.20, open_air.PALE_DUSK)
    scene.view_settings.exposure = 0.45
    chance = np.random.default_rng(5)
    spots = np.column_stack([-chance.uniform(26.0, 110.0, FIRS), chance.normal(14.0, 45.0, FIRS)])
    firs.add_firs(spots, chance.uniform(5.0, 12.0, FIRS), HEIGHT, firs.WINTRY, snow=0.7)
    scene.frame_set(SHOWN)
    hiker = bpy.data.objects["Hiker"]
    outfit.wear_boots(hiker, Body())
    outfit.wear_creased(hiker, Body())
    pictures = []
    for name, strength in (("before", 0.0), ("after", 1.0)):
        scene.softground.characters[0].response_strength = strength
        pictures.append(folder / f"before_after_{name}.png")
        stage.render(scene, scene.camera, pictures[-1], PICTURE, samples)
    return [wipe(*pictures, folder / "before_after.webp")]


def wipe(before: Path, after: Path, path: Path) -> Path:
    """A moving picture in which a line goes over two pictures and back: the first is to its right, the second to its
    left."""
    first, second = (Image.open(picture).convert("RGB") for picture in (before, after))
    width, height = first.size
    font = ImageFont.load_default(max(12, height // 22))
    for picture, text, anchor in ((first, "As animated", "rd"), (second, "Sink Feet", "ld")):
        place = (width - height // 30 if anchor[0] == "r" else height // 30, height - height // 30)
        ImageDraw.Draw(picture).text(
            place, text, font=font, fill="white", anchor=anchor, stroke_width=2, stroke_fill="#333"
        )
    frames, durations = [], []
    for moment in range(MOMENTS):
        share = 0.5 - 0.5 * cos(2.0 * pi * moment / MOMENTS)
        line = round(share * width)
        shown = first.copy()
        shown.paste(second.crop((0, 0, line, height)), (0, 0))
        if 0 < line < width:
            ImageDraw.Draw(shown).line(((line, 0), (line, height)), fill="white", width=3)
        frames.append(shown)
        durations.append(HOLD if line in (0, width) else STEP)
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=durations, loop=0, quality=QUALITY, method=6)
    return path


if __name__ == "__main__":
    production.main(__name__)
