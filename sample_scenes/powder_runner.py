"""A run in powder against the sun: the same moment with what the steps throw, and without."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians
from pathlib import Path

import bpy
import numpy as np

from sample_scenes import open_air, production, stage
from sample_scenes.body import Body
from sample_scenes.production import Bake, Claim, Options
from sample_scenes.run import Run, run
from softground_addon.blender.after import debris_object

CELL_SIZE: float | None = None
"""Fitted to the soles."""

PRESET = "Snow"
POWDER = {"material.youngs_modulus": "1.5e5"}
"""A runner sinks in to the ankles [Pa]."""
SPEED = 4.2  # m/s
FRAMES = 76
START = 9.5  # m along y; the run is toward -y, and toward the camera
STEP, AFTER = -3, 2.0  # the step that is seen, and frames from its strike to the picture
PICTURE = (960, 480)
HEIGHT = open_air.rolling(swell=0.2, hills=14.0, seed=11)


@dataclass(frozen=True)
class PowderRunner:
    """One run."""

    bakes: dict[str, Bake]


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> PowderRunner:
    """A snow field, and a run toward the camera."""
    ground = open_air.add_ground(scene, "Powder", (-7.0, START + 3.0), HEIGHT, "snow")
    scene.render.resolution_x, scene.render.resolution_y = PICTURE
    open_air.add_camera(scene, (0.75, -1.55, 0.16), (-0.02, -0.5, 0.14), 40.0, (0.0, -0.5, 0.1), 8.0)
    motion = run(Body(), Run(speed=SPEED), FRAMES, scene.render.fps)
    chosen = POWDER | dict(options or {})
    return PowderRunner({PRESET: open_air.bake_walk(scene, ground, START, FRAMES, PRESET, cell_size, chosen, motion)})


def claims(built: PowderRunner) -> list[Claim]:
    """Steps ankle-deep, which throw nearly all that compaction leaves of what they press: 2·nu of it, a tenth."""
    bake = built.bakes[PRESET]
    totals = bake.report["totals"]
    return [
        Claim("Steps in the snow", len(bake.footprints), 6, 12),
        Claim("Depth of the deepest [m]", max(step.max_depth_m for step in bake.footprints), 0.12, 0.25),
        Claim("Thrown snow over what was pressed", totals["thrown_m3"] / totals["compressed_m3"], 0.05, 0.1),
    ]


def shoot(built: PowderRunner, folder: Path, samples: int) -> list[Path]:
    """From just above the snow, with the sun ahead."""
    scene = bpy.context.scene
    bake = built.bakes[PRESET]
    step = bake.footprints[STEP]
    scene.frame_set(round(step.start_frame + AFTER))
    stage.aim(scene.camera, step.position + np.array((0.79, -1.0, 0.16)), step.position + np.array((0.02, 0.05, 0.14)))
    open_air.add_low_sun(scene, radians(-72), radians(12), (1.0, 0.8, 0.6), 6.0, 0.3)
    scene.view_settings.exposure = -0.4
    debris = debris_object.of(bake.ground)
    assert debris is not None
    pictures = []
    for name, hidden in (("with", False), ("without", True)):
        debris.hide_render = hidden
        pictures.append(folder / f"powder_runner_{name}.png")
        stage.render(scene, scene.camera, pictures[-1], PICTURE, samples)
    debris.hide_render = False
    return [*pictures, stage.contact_sheet(pictures, 1, folder / "powder_runner.jpg")]


if __name__ == "__main__":
    production.main(__name__)
