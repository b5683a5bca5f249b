"""A moving picture of SoftGround in use: live mode and a dragged field in Blender's window, then a night of snow.

`make film` has the GUI test `filmed` take the pictures of the window first.
"""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import bpy
import numpy as np
from PIL import Image, ImageDraw

from gallery.moving_picture import put_together
from gallery.time_lapse import CELL_SIZE, hollow_left, light, take, track
from sample_scenes import production
from sample_scenes.production import Built, Claim, Options

__all__ = ["CELL_SIZE", "build", "claims", "shoot"]

WINDOW = Path("build/gui/trixie/filmed")
"""Where the test leaves its pictures."""
WEATHER = "SNOWFALL"
MOMENTS = 0.035 * np.arange(14)
"""Of the night, as shares of what a time lapse lasts."""
PLAYED = 2
"""Frames from one picture to the next, of what was played."""
MIXED = 5
"""Pictures from one moment of the night to the next, which fade into each other."""
LARGEST = 6_000_000
"""[bytes]."""
_POINTER = np.array([(0, 0), (0, 16), (4, 12), (7, 18), (10, 17), (7, 11), (12, 11)])


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> Built:
    """The track that is snowed in."""
    return Built({WEATHER: track(scene, WEATHER, cell_size, options)})


def claims(built: Built) -> list[Claim]:
    """The prints are gone in the morning."""
    return [Claim("Hollow left by a night of snow", hollow_left(built.bakes[WEATHER]), 0.0, 0.7)]


def shoot(built: Built, folder: Path, samples: int) -> list[Path]:
    """The window, and then the night."""
    shown = window(WINDOW)
    light(WEATHER)
    width, height = shown[0].size
    moments = take(built.bakes[WEATHER], MOMENTS, (width, height), folder / "in_use", samples, snow=True)
    pictures = [*shown, *flowing(moments, shown[0].size)]
    pause = round(1000 * PLAYED / bpy.context.scene.render.fps)
    return [put_together(pictures, pause, folder / "in_use.webp", LARGEST, (80, 70, 60, 50), effort=4)]


def window(folder: Path) -> list[Image.Image]:
    """What the window showed, with the pointer, which pictures of the screen leave out."""
    shown = []
    for part, moment, x, y in json.loads((folder / "facts.json").read_text(encoding="utf-8"))["pictures"]:
        if part == "played" and moment % PLAYED:
            continue
        picture = Image.open(folder / f"{part}_{moment:03d}.png").convert("RGB")
        corners = [(float(across + x), float(down + y)) for across, down in _POINTER]
        ImageDraw.Draw(picture).polygon(corners, fill="black", outline="white")
        shown.append(picture)
    return shown


def flowing(moments: list[Path], size: tuple[int, int]) -> list[Image.Image]:
    """Pictures of which each fades into the next, enlarged to a size: snow is soft."""
    pictures = [Image.open(moment).convert("RGB").resize(size, Image.Resampling.LANCZOS) for moment in moments]
    mixed = [Image.blend(*pair, part / MIXED) for pair in pairwise(pictures) for part in range(MIXED)]
    return mixed + pictures[-1:]


if __name__ == "__main__":
    production.main(__name__)
