"""Sink Feet, before and after: a walk in deep snow, and a line that wipes from one to the other and back."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, radians
from pathlib import Path

import bpy
from PIL import Image, ImageDraw, ImageFont

from sample_scenes import production, stage
from sample_scenes.body import Body
from sample_scenes.character import create_character
from sample_scenes.gait import Gait, walk
from sample_scenes.keys import write_action
from sample_scenes.production import Bake, Claim, Options, Walker

CELL_SIZE: float | None = None
"""Fitted to the soles."""

PRESET = "Snow"
SOFTER = "2.2e5"
"""Young's modulus for prints of a hand's breadth [Pa]."""
FRAMES, SHOWN = 72, 60
PICTURE = (960, 540)

MOMENTS, HOLD = 32, 900
"""Frames of the wipe there and back, and how long it rests at either end [ms]."""
STEP = 50
"""What each of the others takes [ms]."""
QUALITY = 82


@dataclass(frozen=True)
class BeforeAfter:
    """One walk, with its response as a layer that fades."""

    bakes: dict[str, Bake]
    walker: bpy.types.Object


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> BeforeAfter:
    """A walk past the camera, which is there first."""
    body = Body()
    walker = create_character("Hiker", body, scene.collection)
    walker.location = (0.0, 1.6, 0.0)
    write_action(walker, walk(body, Gait(), FRAMES, scene.render.fps), "Walk")
    scene.frame_start, scene.frame_end = 1, FRAMES
    scene.render.resolution_x, scene.render.resolution_y = PICTURE
    scene.camera = stage.add_camera(scene, "Beside the Boots", lens=34.0)
    stage.aim(scene.camera, (1.22, -1.50, 0.66), (-0.02, -1.00, 0.13))
    chosen = {"shape_keys": "false", "relief": "CLOSE_UP", "relief_vertices": "400000"}
    chosen |= {"material.youngs_modulus": SOFTER, "sink_feet": "true", "ground_margin": "4.0"} | dict(options or {})
    bake = production.bake(scene, [Walker(walker, body.mass)], PRESET, cell_size, options=chosen)
    return BeforeAfter({PRESET: bake}, walker)


def claims(built: BeforeAfter) -> list[Claim]:
    """Feet that float without the response stand with it."""
    gaps = {
        when: max(size["p95"] for size in built.bakes[PRESET].report["gaps_mm"][when]["Hiker"].values())
        for when in ("before", "after")
    }
    return [
        Claim("Distance of standing soles from the ground without response, 95 % [mm]", gaps["before"], 20, 300),
        Claim("Distance of standing soles from the ground with response, 95 % [mm]", gaps["after"], 0, 3),
    ]


def shoot(_built: BeforeAfter, folder: Path, samples: int) -> list[Path]:
    """The same frame without and with the layer, and the wipe between them."""
    scene = bpy.context.scene
    stage.add_sun(scene, radians(65), radians(17))
    scene.view_settings.exposure = -0.4
    scene.frame_set(SHOWN)
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
