"""Somebody walks through a meadow in the evening: grass parts, lies where boots trod, and rises behind them."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
from PIL import Image

from gallery import meadow, moving_picture
from sample_scenes import production, stage
from sample_scenes.production import Built, Options
from softground_addon.blender import compat
from softground_addon.blender.nodes.node_modifiers import inputs_of

CELL_SIZE = meadow.CELL_SIZE
EYE, TARGET, LENS, ASIDE = (-1.05, 1.35, 1.15), (0.08, -1.0, 0.2), 32.0, 0.48
"""Of the camera [m, mm], and how far toward x it looks for each metre toward -y."""
TUFTS, REACH = 30_000, 0.7
"""Tufts of grass, and how far beside the way they give way [m]: what stays as it is is rendered sooner."""
WET = {"Recovery": 3.0, "Stiffness": 0.0, "Breaks": 0.05}
"""Young grass in the dew: it rises while one looks [s]."""
SHOWN = range(34, 122, 2)
"""Every second frame: 12 a second."""
PICTURE = (480, 270)
LARGEST, QUALITIES = 500_000, (85, 75, 65, 55)
"""Bytes of the picture, and qualities to try."""
BOUNCES = 2
"""Of light, from one blade to the next."""

claims = meadow.claims


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> Built:
    """The walk through the meadow, and a camera beside its way."""
    built = meadow.build(scene, cell_size, options)
    stage.aim(scene.camera, EYE, TARGET)
    scene.camera.data.lens = LENS
    return built


def shoot(_built: Built, folder: Path, samples: int) -> list[Path]:
    """The frames, and the picture that they make."""
    scene, chance = bpy.context.scene, np.random.default_rng(3)
    spots = meadow.tufts(chance, TUFTS, EYE, ASIDE)
    aside = np.abs(spots[:, 0]) > REACH
    meadow.plant(spots[aside], chance)
    grass = meadow.plant(spots[~aside], chance)
    meadow.give_way(grass)
    for name, value in WET.items():
        compat.write_input(grass.modifiers[-1], inputs_of(grass.modifiers[-1])[name], value)
    meadow.dress(scene)
    scene.cycles.max_bounces = BOUNCES
    frames = []
    for frame in SHOWN:
        scene.frame_set(frame)
        frames.append(folder / f"through_meadow_{frame:03d}.png")
        stage.render(scene, scene.camera, frames[-1], PICTURE, samples)
    pictures = [Image.open(frame).convert("RGB") for frame in frames]
    duration = 1000 * SHOWN.step // scene.render.fps
    path = folder / "through_meadow.webp"
    return [moving_picture.put_together(pictures, duration, path, LARGEST, QUALITIES, effort=6)]


if __name__ == "__main__":
    production.main(__name__)
