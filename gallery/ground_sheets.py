"""`make ground_sheets`: each ground as two clicks have it, from 0.3, 2 and 20 m, in Cycles, EEVEE and Material Preview.

    python -m gallery.ground_sheets [GROUND ...] [--output DIR] [--samples N]

A row for each engine, then ten frames of a print that grows. EEVEE and Material Preview are rendered by the newest real
Blender, and left out where `../shared`, which has it, is missing.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from math import cos, radians, sin
from pathlib import Path

import bpy
import numpy as np

from sample_scenes import demo, stage
from sample_scenes.four_grounds import EXPOSURE, close_up_of, light
from sample_scenes.production import addon
from softground_addon.core.record.footprints import Footprint

GROUNDS = ("Snow", "Dry Sand", "Wet Sand", "Mud", "Soil")
VIEWS = {"0.3 m": (0.45, 24.0, 44.0), "2 m": (2.0, 35.0, 30.0), "20 m": (20.0, 70.0, 12.0)}
"""Distance of the camera from a print [m], its focal length [mm] and how high it stands over the print [deg]."""
MARGIN = 9.0
"""Ground around the walk [m]: at 20 m much of it is seen."""
TILE = (320, 240)
GROWTH = 10
"""Frames of the print that grows."""
REAL_BLENDER = Path("../shared/tools/real_blender.sh")
IN_WINDOW = Path(__file__).with_name("tiles_in_window.py")
WINDOW = ("--window-geometry", "0", "0", "480", "360")  # a small one is drawn sooner
IN_WINDOW_ROWS = ("eevee", "preview")


def shoot(preset: str, folder: Path, samples: int) -> list[Path]:
    """Bake a walk, save it as `shot.blend` with a camera for each distance, and render it in Cycles: growth last."""
    with addon():
        scene = bpy.context.scene
        lane = demo.bake_lane(scene, demo.create_walker(scene), preset, None, MARGIN)
        stage.hide(lane.armature)
        step = close_up_of(lane.footprints)
        _set_up(scene, preset, step)
        bpy.ops.wm.save_as_mainfile(filepath=str((folder / "shot.blend").resolve()), compress=True)
        pictures = [folder / f"cycles {name}.png" for name in VIEWS]
        for picture, name in zip(pictures, VIEWS, strict=True):
            stage.render(scene, scene.objects[name], picture, TILE, samples)
        for number in range(GROWTH):
            scene.frame_set(int(step.start_frame) + number)
            pictures.append(folder / f"growth {number}.png")
            stage.render(scene, scene.objects["0.3 m"], pictures[-1], TILE, samples)
        return pictures


def _set_up(scene: bpy.types.Scene, preset: str, step: Footprint) -> None:
    """A low sun and the cameras, at the end of the walk."""
    stage.set_up_rendering(scene)
    light(scene, step)
    scene.view_settings.exposure = EXPOSURE.get(preset, 0.0)
    scene.render.resolution_x, scene.render.resolution_y = TILE
    scene.frame_set(scene.frame_end)
    for name, (distance, lens, elevation) in VIEWS.items():
        scene.camera = stage.add_camera(scene, name, lens)
        scene.camera.data.clip_start = 0.01
        around, up = step.heading + radians(165), radians(elevation)
        way = np.array((cos(up) * cos(around), cos(up) * sin(around), sin(up)))
        stage.aim(scene.camera, step.position + distance * way, step.position)


def main(arguments: list[str]) -> int:
    """Make the sheets of some grounds, or of all."""
    parser = argparse.ArgumentParser(prog="python -m gallery.ground_sheets")
    parser.add_argument("grounds", nargs="*", metavar="GROUND", help=f"presets (default: {', '.join(GROUNDS)})")
    parser.add_argument("--output", type=Path, default=Path("build/ground_sheets"), metavar="DIR")
    parser.add_argument("--samples", type=int, default=6, metavar="N")
    options = parser.parse_args(arguments)
    for preset in options.grounds or GROUNDS:
        slug = preset.lower().replace(" ", "_")
        folder: Path = options.output / slug
        folder.mkdir(parents=True, exist_ok=True)
        pictures = shoot(preset, folder, options.samples)
        tiles, growth = pictures[: len(VIEWS)], pictures[len(VIEWS) :]
        if REAL_BLENDER.is_file():
            blend = str((folder / "shot.blend").resolve())
            subprocess.run(
                [REAL_BLENDER, "gui", "sid", *WINDOW, blend, "--python", IN_WINDOW, "--", *VIEWS], check=True
            )
            tiles += [folder / f"{row} {name}.png" for row in IN_WINDOW_ROWS for name in VIEWS]
        print(stage.contact_sheet(tiles, len(VIEWS), options.output / f"{slug}.jpg"))
        print(stage.contact_sheet(growth, GROWTH // 2, options.output / f"{slug}_growth.jpg"))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
