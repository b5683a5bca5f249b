"""A walk out of mud up two steps with snow on them: three grounds, each an object with prints of its own."""

from __future__ import annotations

from math import radians
from pathlib import Path

import bpy
import numpy as np

from gallery import open_air, outfit
from gallery.stone_floor import slab, stone
from sample_scenes import production, stage
from sample_scenes.body import Body
from sample_scenes.production import Built, Claim, Options
from softground_addon.blender import settings
from softground_addon.blender.ground import baked_ground

CELL_SIZE: float | None = None
"""Fitted to the soles."""

PRESET, SNOW = "Mud", "Fresh Snow"
FRAMES, SHOWN = 112, 104
START = 1.5  # m along y; the walk is toward -y
STEPS = ((-1.55, -0.35, 0.08), (-3.4, -1.55, 0.18))
"""Where each step ends and begins along the way, and its height without snow [m]."""
HALF_WIDTH, SNOW_CM = 0.8, 8.0
PICTURE = (720, 480)


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> Built:
    """Mud, two steps of stone that are covered with snow, and a walk up."""
    ground = open_air.add_ground(scene, "Yard", (-5.0, START + 2.0), open_air.rolling(0.0, 0.02, seed=5), "mud")
    scene.softground.ground = ground
    bpy.ops.softground.load_preset(name=SNOW)  # of which covers are made; what the yard is made of follows
    for number, (end, begin, top) in enumerate(STEPS, 1):
        production.make_active(slab(scene, f"Step {number}", (end, begin), top, stone(), HALF_WIDTH))
        bpy.ops.softground.cover(thickness_cm=SNOW_CM)
    open_air.add_camera(scene, (1.9, 1.55, 1.6), (-0.25, -1.25, 0.4), 27.0, (0.0, -0.6, 0.0), 11.0, picture=PICTURE)
    chosen = {"relief_vertices": "120000"} | dict(options or {})
    return open_air.bake_walk(scene, ground, START, FRAMES, PRESET, cell_size, chosen)


def claims(built: Built) -> list[Claim]:
    """Each ground has prints of its own, at its own height."""
    grounds = settings.grounds_of(bpy.context.scene.softground)
    prints = [baked_ground.record_of(ground).footprints for ground in grounds]
    tops = [0.0, *(top + SNOW_CM / 100 for *_, top in STEPS)]
    off = [
        float(np.abs([step.position[2] - top for step in of_ground]).max())
        for of_ground, top in zip(prints, tops, strict=True)
    ]
    deepest = [max(step.max_depth_m for step in of_ground) for of_ground in prints]
    return [
        *(Claim(f"Prints on {ground.name}", len(each), 1, 5) for ground, each in zip(grounds, prints, strict=True)),
        Claim("Prints off the height of their ground [m]", max(off), 0.0, 0.03),
        Claim("Deepest print in snow over its thickness", max(deepest[1:]) / (SNOW_CM / 100), 0.3, 1.0 + 1e-6),
        Claim("Prints on all together", len(built.bakes[PRESET].footprints), 5, 12),
    ]


def shoot(_built: Built, folder: Path, samples: int) -> list[Path]:
    """The steps from behind, under a low sun from the side."""
    scene = bpy.context.scene
    open_air.add_low_sun(scene, radians(-155), radians(19), (1.0, 0.90, 0.78), 4.2, 0.4, open_air.PALE_DUSK)
    scene.view_settings.exposure = 0.3
    scene.frame_set(SHOWN)
    outfit.wear_boots(bpy.data.objects["Hiker"], Body())
    path = folder / "snowed_steps.jpg"
    stage.render(scene, scene.camera, path, PICTURE, samples)
    return [path]


if __name__ == "__main__":
    production.main(__name__)
