"""A walk over fallen leaves toward a low sun: boots press them into the ground and tilt them."""

from __future__ import annotations

from math import radians
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from gallery import broadleaf, litter, open_air, outfit
from sample_scenes import production, stage, terrain
from sample_scenes.body import Body
from sample_scenes.production import Built, Claim, Options
from sample_scenes.stage import Array
from softground_addon.blender.ground import baked_ground

CELL_SIZE: float | None = None
"""Fitted to the soles."""

PRESET = "Soil"
FRAMES = 132
START = 2.6  # m along y; the walk is toward -y
STEP, AFTER = -4, 3.0
"""The step that is seen, and frames from its end to the picture."""
PICTURE = (960, 540)
EYE, TARGET = np.array((0.50, 0.96, 0.34)), np.array((-0.05, -0.22, 0.10))
"""Of the camera, from the step on [m]."""
DENSITY = 1000.0
"""Leaves on a square metre."""
COLOURS = {
    "ochre": ((0.20, 0.075, 0.012), (0.55, 0.27, 0.035), 0.5),
    "red": ((0.16, 0.022, 0.010), (0.42, 0.085, 0.020), 0.25),
    "brown": ((0.050, 0.022, 0.010), (0.17, 0.080, 0.030), 0.5),
}
"""Dark and light colour of leaves, and their share."""
HEIGHT = open_air.rolling(swell=0.16, hills=12.0, seed=4)
MOULD = (0.030, 0.015, 0.007), (0.15, 0.068, 0.018)
"""Dark and light colour of the ground below and beyond them."""


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> Built:
    """A forest floor, and a walk away from the camera."""
    painted = {"fallen": lambda x, y: np.ones(np.broadcast(x, y).shape)}
    ground = open_air.add_ground(scene, "Floor", (-16.0, START + 2.0), HEIGHT, "soil", painted)
    open_air.add_camera(scene, (0.5, 1.0, 0.3), (0.0, 0.0, 0.1), 38.0, (0.0, 0.0, 0.0), 5.6, picture=PICTURE)
    return open_air.bake_walk(scene, ground, START, FRAMES, PRESET, cell_size, {"relief": "OFF"} | dict(options or {}))


def claims(built: Built) -> list[Claim]:
    """A track under leaves."""
    return [Claim("Steps under leaves", len(built.bakes[PRESET].footprints), 5, 30)]


def shoot(built: Built, folder: Path, samples: int) -> list[Path]:
    """From the height of a knee, as a boot lifts off."""
    scene, step = bpy.context.scene, built.bakes[PRESET].footprints[STEP]
    dress(scene)
    strew_leaves()
    for material in baked_ground.display_mesh_of(scene.softground.ground).data.materials:
        open_air.overgrow(material, "fallen", *MOULD)
    chance = np.random.default_rng(8)
    spots = np.column_stack([chance.uniform(-80.0, 25.0, 90), -chance.uniform(42.0, 110.0, 90)])  # no shade on the way
    broadleaf.add_broadleaves(
        spots, chance.uniform(6.0, 12.0, 90), HEIGHT, (0.16, 0.06, 0.012), (0.48, 0.22, 0.03), stem=0.2, seed=40
    )
    stage.go_to(scene, step.end_frame + AFTER)
    stage.aim(scene.camera, step.position + EYE, step.position + TARGET)
    scene.camera.data.dof.focus_distance = float(np.linalg.norm(EYE))
    scene.render.image_settings.quality = 86
    path = folder / "autumn_leaves.jpg"
    stage.render(scene, scene.camera, path, PICTURE, samples)
    return [path]


def dress(scene: bpy.types.Scene) -> None:
    """Evening sun, boots and trousers."""
    hiker = bpy.data.objects["Hiker"]
    outfit.wear_boots(hiker, Body())
    outfit.wear_creased(hiker, Body())
    open_air.add_low_sun(scene, radians(36), radians(17), (1.0, 0.76, 0.52), 11.0, 0.34, open_air.PALE_DUSK)
    scene.view_settings.exposure = 1.0


def strew_leaves() -> list[bpy.types.Object]:
    """Leaves of all colours, which give way."""
    fallen = []
    for number, (name, (dark, light, share)) in enumerate(COLOURS.items()):
        leaves = litter.leaves(dark, light, name=name, through=0.45)
        for shader in leaves.objects[0].active_material.node_tree.nodes:
            if shader.type == "BSDF_PRINCIPLED":
                shader.inputs["Specular IOR Level"].default_value = 0.15
        fallen.append(_let_fall(name, leaves, DENSITY * share, number))
    return fallen


def _let_fall(name: str, leaves: bpy.types.Collection, density: float, seed: int) -> bpy.types.Object:
    """Strew leaves on the undisturbed ground, as anybody may, and let them give way."""
    x, y = terrain.spaced(-4.0, 4.0, 0.1), terrain.spaced(-9.0, START + 1.0, 0.1)
    thin = {"share": _share}
    under = terrain.add_terrain(f"Under {name}", x, y, HEIGHT, "soil", bpy.context.scene.collection, thin)
    under.hide_render = under.hide_viewport = True
    how: dict[str, Any] = {"smallest": 0.045, "largest": 0.095, "law": 2.4, "lean": 0.45, "seed": seed}
    strewn: bpy.types.Object = litter.strew(under, leaves, density, where="share", **how)
    production.make_active(strewn)
    bpy.ops.softground.give_way(kind="LITTER")
    return strewn


def _share(x: Array, y: Array) -> Array:
    """Drifts of leaves, and fewer of them far from the way."""
    near = np.clip((4.0 - np.abs(x)) / 2.5, 0.0, 1.0)
    return near * np.clip(0.75 + 0.45 * open_air.waves(x, y, 0.9, 6), 0.25, 1.3)


if __name__ == "__main__":
    production.main(__name__)
