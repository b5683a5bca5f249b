"""The moving picture of the README: boots walk through snow, as two clicks have it, with relief.

`make moving` builds it into docs/images. Pillow, which matplotlib brings along, puts the frames together.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import radians
from pathlib import Path

import bpy
from PIL import Image

from gallery import open_air, outfit
from sample_scenes import production, stage
from sample_scenes.body import Body
from sample_scenes.character import create_character
from sample_scenes.gait import Gait, walk
from sample_scenes.keys import write_action
from sample_scenes.production import Built, Claim, Options, Walker

CELL_SIZE: float | None = None
"""Fitted to the soles."""

PRESET = "Snow"
FRAMES = 66
SHOWN = range(8, FRAMES - 3, 2)
"""Every second frame: 12 a second."""

EYE, TARGET = (0.68, 2.08, 0.66), (0.0, 1.28, 0.0)
"""Of the camera in the first frame [m]."""
PACE = 0.0496  # m a frame: the camera goes with the walker

LAST_HOLD = 1200
"""How long the last frame stays before the picture begins again [ms]."""

PICTURE = (960, 540)
LARGEST = 1_800_000
"""More than this a README should not make its readers load [bytes]."""


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> Built:
    """A walk, with the camera behind: the ground reaches as far as that sees."""
    body = Body()
    walker = create_character("Hiker", body, scene.collection)
    walker.location = (0.0, 1.0, 0.0)
    write_action(walker, walk(body, Gait(), FRAMES, scene.render.fps), "Walk")
    scene.frame_start, scene.frame_end = 1, FRAMES
    scene.render.resolution_x, scene.render.resolution_y = PICTURE
    scene.camera = stage.add_camera(scene, "Behind the Boots", lens=28.0)
    stage.aim(scene.camera, EYE, TARGET)
    for frame in range(1, FRAMES + 1):  # relief is fine along its way
        scene.camera.location.y = EYE[1] - PACE * (frame - 1)
        scene.camera.keyframe_insert("location", index=1, frame=frame)
    chosen = {"shape_keys": "false", "relief": "CLOSE_UP", "relief_vertices": "800000"}
    chosen |= {"sink_feet": "true", "ground_margin": "3.0"} | dict(options or {})
    bake = production.bake(scene, [Walker(walker, body.mass)], PRESET, cell_size, options=chosen)
    return Built({PRESET: bake})


def claims(built: Built) -> list[Claim]:
    """There is something to see."""
    steps = built.bakes[PRESET].footprints
    return [
        Claim("Steps in the snow", len(steps), 4, 12),
        Claim("Depth of the deepest [m]", max(step.max_depth_m for step in steps), 0.03, 0.15),
    ]


def shoot(_built: Built, folder: Path, samples: int) -> list[Path]:
    """The frames, and the picture that they make."""
    scene, hiker = bpy.context.scene, bpy.data.objects["Hiker"]
    outfit.wear_boots(hiker, Body())
    outfit.wear_creased(hiker, Body())
    open_air.add_low_sun(scene, radians(160), radians(11), (1.0, 0.78, 0.58), 7.5, 0.2, open_air.PALE_DUSK)
    scene.view_settings.exposure = 0.1
    frames = [folder / f"moving_picture_{frame:03d}.png" for frame in SHOWN]
    for frame, path in zip(SHOWN, frames, strict=True):
        scene.frame_set(frame)
        stage.render(scene, scene.camera, path, PICTURE, samples)
    return [animate(frames, 1000 * (SHOWN[1] - SHOWN[0]) // scene.render.fps, folder / "moving_picture.webp")]


def animate(frames: list[Path], duration: int, path: Path) -> Path:
    """Pictures one after another [ms each], for ever, the last one for longer; as large as `LARGEST` at most."""
    pictures = [Image.open(frame).convert("RGB") for frame in frames]
    durations = [duration] * (len(frames) - 1) + [LAST_HOLD]
    return put_together(pictures, durations, path, LARGEST, (95, 88, 80, 70), effort=6)


def put_together(
    pictures: Sequence[Image.Image],
    durations: int | list[int],
    path: Path,
    largest: int,
    qualities: Sequence[int],
    *,
    effort: int,
) -> Path:
    """Pictures one after another [ms each], for ever, in the first of some qualities that is no larger [bytes]."""
    for quality in qualities:
        pictures[0].save(
            path, save_all=True, append_images=pictures[1:], duration=durations, loop=0, quality=quality, method=effort
        )
        if path.stat().st_size <= largest:
            break
    return path


if __name__ == "__main__":
    production.main(__name__)
