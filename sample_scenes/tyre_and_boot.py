"""A farm track after rain: the tyres of a car went along it, and then boots, partly in their prints."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, radians
from pathlib import Path

import bpy
import numpy as np

from sample_scenes import firs, litter, open_air, production, stage
from sample_scenes.course import STRAIGHT
from sample_scenes.production import Bake, Claim, Options, Walker
from sample_scenes.rolling_things import roll_along
from sample_scenes.stage import Array
from sample_scenes.tyre import RADIUS, create_tyre
from softground_addon.blender import compat
from softground_addon.blender.ground import baked_ground, weather, weather_modifier

CELL_SIZE = 0.006
"""Fine enough for lugs [m]."""

PRESET = "Soil"
FRAMES = 220
START = 2.6  # m along y; all go toward -y
RUTS = (0.11, -1.30)  # m along x: left boots step into the first
MASS = 680.0  # kg on both wheels
SPEED = 2.6  # m/s: the car is out of sight when the picture is taken
RAIN = 50.0  # mm/h: water stands in the ruts, between the lugs
SOAKED = 0.55
"""What is left of the colour of the ground."""
PICTURE = (1920, 1080)
HEIGHT = open_air.rolling(swell=0.18, hills=18.0, seed=4)


def _growth(x: Array, y: Array) -> Array:
    """Grass of a square metre: between the ruts and beside the track, in patches."""
    edge = 0.12 * np.sin(2.3 * y) + 0.06 * np.sin(6.1 * y + 1.0)
    apart = np.minimum(np.abs(x - RUTS[0] + edge), np.abs(x - RUTS[1] - edge))
    seen = (np.abs(x) < 30.0) * (y < 2.4) * np.clip((y + 60.0) / 12.0, 0.0, 1.0) / (1.0 + (0.12 * y) ** 2)
    patches = 0.75 + 0.5 * np.sin(1.9 * x + 0.7 * y) * np.sin(0.8 * y - 1.1 * x + 2.0)
    overgrown = np.clip((-10.0 - y) / 6.0, 0.0, 1.0) ** 2  # far away, so that nobody sees where the tracks end
    return 300.0 * seen * patches * np.maximum(np.clip((apart - 0.44) / 0.40, 0.0, 1.0), overgrown)


def _bare(x: Array, y: Array) -> Array:
    """Crumbs and stones lie where little grows."""
    seen = (np.abs(x) < 3.0) * (y < 1.4) * np.clip((y + 9.0) / 7.0, 0.0, 1.0) ** 2
    return seen * (420.0 - _growth(x, y))


@dataclass(frozen=True)
class TyreAndBoot:
    """A car's wheels, and one long walk."""

    bakes: dict[str, Bake]


def build(scene: bpy.types.Scene, cell_size: float = CELL_SIZE, options: Options | None = None) -> TyreAndBoot:
    """A wide ground, two wheels that roll along it, and a walk after them."""
    painted = {"growth": _growth, "bare": _bare}
    ground = open_air.add_ground(scene, "Track", (-20.0, START + 3.0), HEIGHT, "soil", painted)
    scene.render.resolution_x, scene.render.resolution_y = PICTURE
    open_air.add_camera(scene, (0.46, 1.38, 0.44), (-0.04, -1.4, 0.05), 28.0, (0.1, 0.2, 0.0), 9.0)
    wheels = []
    for number, rut in enumerate(RUTS):
        wheel = create_tyre(f"Wheel {number + 1}", scene.collection)
        wheel.location = (rut, START + 0.4, 0.0)
        bpy.context.view_layer.update()
        roll_along(wheel, STRAIGHT, RADIUS, SPEED, FRAMES, scene.render.fps)
        wheels.append(wheel)
    car = [Walker(wheel, MASS / len(wheels)) for wheel in wheels]
    bake = open_air.bake_walk(scene, ground, START, FRAMES, PRESET, cell_size, options, beside=car)
    modifier = weather.add(bake.ground)
    weather.set_preset(modifier, "SHOWER")
    compat.write_input(modifier, weather_modifier.inputs_of(modifier)["Rain"], RAIN)
    return TyreAndBoot({PRESET: bake})


def claims(built: TyreAndBoot) -> list[Claim]:
    """Prints of both kinds, of depths that wet soil takes."""
    bake = built.bakes[PRESET]
    boots, tyres = bake.of("Hiker"), [step for step in bake.footprints if step.character != "Hiker"]
    return [
        Claim("Steps of the boots", len(boots), 12, 40),
        Claim("Depth of the deepest [m]", max(step.max_depth_m for step in boots), 0.01, 0.08),
        Claim("Depth of the ruts [m]", max(step.max_depth_m for step in tyres), 0.01, 0.10),
    ]


def shoot(_built: TyreAndBoot, folder: Path, samples: int) -> list[Path]:
    """From the height of a knee, with the sun low at the side."""
    scene = bpy.context.scene
    scene.frame_set(scene.frame_end)
    for name in ("Wheel 1", "Wheel 2"):
        bpy.data.objects[name].hide_render = True  # the car is long gone, and the walker out of sight
    stage.hide(bpy.data.objects["Hiker"])
    open_air.add_low_sun(scene, radians(22), radians(17), (1.0, 0.80, 0.60), 6.5, 0.14, (radians(14.0), 1.2))
    chance = np.random.default_rng(5)
    spots = np.column_stack([chance.normal(0.0, 70.0, 520), -chance.uniform(42.0, 130.0, 520)])
    spots = spots[np.abs(spots[:, 0]) > 4.0]
    firs.add_firs(spots, chance.uniform(5.0, 14.0, len(spots)), HEIGHT, (0.034, 0.056, 0.030))
    ground = baked_ground.display_mesh_of(scene.softground.ground)
    for material in ground.data.materials:
        open_air.darken(material, SOAKED)
    grass = litter.pieces_of("Grass", litter.blades(open_air.tufts(chance), (0.040, 0.062, 0.012), (0.13, 0.15, 0.045)))
    litter.strew(ground, grass, "growth", smallest=0.04, largest=0.22, law=1.4, lean=0.2, bend=1.4, bury=0.05, seed=6)
    crumbs = litter.stones((0.045, 0.028, 0.018), (0.125, 0.080, 0.050), 0.9)
    stones = litter.stones((0.13, 0.11, 0.09), (0.34, 0.30, 0.25), 0.5, rough=0.2)
    lying = {"lean": pi, "bend": pi / 2, "depth": 0.1, "bury": 0.9}
    litter.strew(ground, crumbs, "bare", smallest=0.005, largest=0.028, seed=3, **lying)
    litter.strew(ground, stones, "bare", smallest=0.003, largest=0.03, law=2.3, seed=4, **lying)
    scene.view_settings.exposure, scene.render.image_settings.quality = 0.75, 82
    path = folder / "tyre_and_boot.jpg"
    stage.render(scene, scene.camera, path, PICTURE, samples)
    return [path]


if __name__ == "__main__":
    production.main(__name__)
