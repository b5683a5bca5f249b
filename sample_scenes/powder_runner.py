"""A run in powder against the sun; also small, with what the steps throw and without."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians
from pathlib import Path

import bpy
import numpy as np

from sample_scenes import firs, open_air, production, stage
from sample_scenes.body import Body
from sample_scenes.character import crease_trousers
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
STEP, AFTER = -3, 3.0  # the step that is seen, and frames from its strike to the picture
PICTURE = (1920, 1080)
PAIR = (960, 540)
FIRS = 170
BOUNCES = 8
"""Of light, from one piece of snow to the next."""
HEIGHT = open_air.rolling(swell=0.2, hills=14.0, seed=11)


@dataclass(frozen=True)
class PowderRunner:
    """One run."""

    bakes: dict[str, Bake]


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> PowderRunner:
    """A snow field, and a run toward the camera."""
    ground = open_air.add_ground(scene, "Powder", (-7.0, START + 3.0), HEIGHT, "snow")
    scene.render.resolution_x, scene.render.resolution_y = PICTURE
    open_air.add_camera(scene, (0.56, -1.65, 0.10), (0.04, -0.5, 0.17), 40.0, (0.0, -0.5, 0.1), 6.3)
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
    """From just above the snow, against the sun; then small, with debris and without, above each other."""
    scene = bpy.context.scene
    bake = built.bakes[PRESET]
    step = bake.footprints[STEP]
    crease_trousers(bpy.data.objects["Hiker"])
    stage.go_to(scene, step.start_frame + AFTER)
    stage.aim(scene.camera, step.position + np.array((0.60, -1.10, 0.10)), step.position + np.array((0.08, 0.05, 0.17)))
    open_air.add_low_sun(scene, radians(-58), radians(8), (1.0, 0.74, 0.52), 8.0, 0.13, open_air.PALE_DUSK)
    chance = np.random.default_rng(5)
    spots = np.column_stack([chance.normal(-10.0, 40.0, FIRS), chance.uniform(28.0, 120.0, FIRS)])
    spots = spots[np.abs(spots[:, 0]) > 5.0]
    firs.add_firs(spots, chance.uniform(5.0, 12.0, len(spots)), HEIGHT, firs.WINTRY, snow=0.7)
    scene.cycles.max_bounces = scene.cycles.transmission_bounces = BOUNCES
    scene.view_settings.exposure = 0.25
    hero = folder / "powder_runner.jpg"
    stage.render(scene, scene.camera, hero, PICTURE, samples)
    debris = debris_object.of(bake.ground)
    assert debris is not None
    pair = []
    for name, hidden in (("with", False), ("without", True)):
        debris.hide_render = hidden
        pair.append(folder / f"powder_runner_{name}.png")
        stage.render(scene, scene.camera, pair[-1], PAIR, samples)
    debris.hide_render = False
    return [hero, *pair, stage.contact_sheet(pair, 1, folder / "debris.jpg")]


if __name__ == "__main__":
    production.main(__name__)
