"""A run in powder at evening: a boot leaves its print; also a strike, small, with what it throws and without."""

from __future__ import annotations

from math import radians
from pathlib import Path

import bpy
import numpy as np

from gallery import firs, open_air, outfit
from sample_scenes import production, stage
from sample_scenes.body import Body
from sample_scenes.production import Built, Claim, Options
from sample_scenes.run import Run, run
from softground_addon.blender.debris import debris_object

CELL_SIZE: float | None = None
"""Fitted to the soles."""

PRESET = "Snow"
POWDER = {"material.youngs_modulus": "1.5e5"}
"""A runner sinks in to the ankles [Pa]."""
SPEED = 4.2  # m/s
FRAMES = 76
START = 9.5  # m along y; the run is toward -y
STEP = -3  # the step that is seen
STRIKE, LEAVE = 2.5, 4.6  # frames from its strike to the pictures
PICTURE = (1920, 1080)
PAIR = (960, 540)
FIRS = 150
SHUTTER = 0.06
"""Frames that a picture is exposed for."""
BOUNCES = 8
"""Of light, from one piece of snow to the next."""
HEIGHT = open_air.rolling(swell=0.2, hills=14.0, seed=11)
Place = tuple[float, float, float]
"""Beside the step [m]."""


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> Built:
    """A snow field, and a run away from the camera."""
    ground = open_air.add_ground(scene, "Powder", (-7.0, START + 3.0), HEIGHT, "snow")
    open_air.add_camera(scene, (0.54, 0.24, 0.32), (-0.04, -0.72, 0.115), 34.0, (0.0, -0.5, 0.0), 9.0, picture=PICTURE)
    motion = run(Body(), Run(speed=SPEED), FRAMES, scene.render.fps)
    chosen = POWDER | dict(options or {})
    return open_air.bake_walk(scene, ground, START, FRAMES, PRESET, cell_size, chosen, motion)


def claims(built: Built) -> list[Claim]:
    """Steps ankle-deep, which throw nearly all that compaction leaves of what they press: 2·nu of it, a tenth."""
    bake = built.bakes[PRESET]
    totals = bake.report["totals"]
    return [
        Claim("Steps in the snow", len(bake.footprints), 6, 12),
        Claim("Depth of the deepest [m]", max(step.max_depth_m for step in bake.footprints), 0.12, 0.25),
        Claim("Thrown snow over what was pressed", totals["thrown_m3"] / totals["compressed_m3"], 0.05, 0.1),
    ]


def shoot(built: Built, folder: Path, samples: int) -> list[Path]:
    """From behind, as a boot leaves the snow; then its strike from ahead, with debris and without, above each other."""
    scene = bpy.context.scene
    bake = built.bakes[PRESET]
    step, hiker = bake.footprints[STEP], bpy.data.objects["Hiker"]
    outfit.wear_boots(hiker, Body())
    outfit.wear_creased(hiker, Body())
    chance = np.random.default_rng(5)
    away = chance.uniform(26.0, 130.0, 2 * FIRS) * np.repeat((-1.0, 1.0), FIRS)  # seen from either side
    spots = np.column_stack([chance.normal(-10.0, 45.0, 2 * FIRS), away])
    spots = spots[np.abs(spots[:, 0]) > 5.0]
    firs.add_firs(spots, chance.uniform(3.0, 13.0, len(spots)), HEIGHT, firs.WINTRY, snow=0.7)
    scene.cycles.max_bounces = scene.cycles.transmission_bounces = BOUNCES
    scene.view_settings.exposure = 0.25
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, SHUTTER
    light = {"elevation": radians(10), "colour": (1.0, 0.74, 0.52), "sun": 8.0, "of_sky": open_air.PALE_DUSK}

    def take(after: float, eye: Place, target: Place, path: Path, size: tuple[int, int]) -> Path:
        stage.go_to(scene, step.start_frame + after)
        stage.aim(scene.camera, step.position + np.array(eye), step.position + np.array(target))
        scene.camera.data.dof.focus_distance = float(np.linalg.norm(eye))
        stage.render(scene, scene.camera, path, size, samples)
        return path

    open_air.add_low_sun(scene, radians(34), sky=0.26, **light)
    hero = take(LEAVE, (0.54, 0.72, 0.28), (0.0, -0.12, 0.115), folder / "powder_runner.jpg", PICTURE)
    open_air.add_low_sun(scene, radians(-150), sky=0.3, **light)
    debris = debris_object.of(bake.ground)
    assert debris is not None
    pair = []
    for name, hidden in (("with", False), ("without", True)):
        debris.hide_render = hidden
        path = folder / f"powder_runner_{name}.png"
        pair.append(take(STRIKE, (0.84, -0.47, 0.16), (0.01, 0.13, 0.15), path, PAIR))
    debris.hide_render = False
    return [hero, *pair, stage.contact_sheet(pair, 1, folder / "debris.jpg")]


if __name__ == "__main__":
    production.main(__name__)
