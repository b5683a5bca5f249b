"""A farm track after rain: the wheels of a car went along it in a bend, and then boots, partly in their prints."""

from __future__ import annotations

from math import pi, radians
from pathlib import Path

import bpy
import numpy as np

from gallery import broadleaf, firs, litter, open_air
from gallery.tyre import RADIUS, create_tyre
from sample_scenes import production, stage
from sample_scenes.course import Course, Heights
from sample_scenes.curves import clamped_spline
from sample_scenes.production import Built, Claim, Options, Walker
from sample_scenes.rolling_things import roll_along
from sample_scenes.stage import Array
from softground_addon.blender import compat
from softground_addon.blender.ground import baked_ground
from softground_addon.blender.nodes.shader_graph import Graph
from softground_addon.blender.playback import weather_modifier
from softground_addon.blender.playback.own_data import RIM
from softground_addon.blender.playback.weather_nodes import WATER
from softground_addon.blender.weather import ground_weather as weather

CELL_SIZE = 0.006
"""Fine enough for lugs [m]."""

PRESET = "Soil"
FRAMES = 220
START = 2.6  # m along y; all go toward -y
RUTS = (-0.38, -1.79)  # m along x, where the wheels start
AXLES = 26
"""Frames by which the rear wheels are behind."""
MASS = 1360.0  # kg on four wheels
SPEED = 2.6  # m/s: the car is out of sight when the picture is taken
RAIN = 9.0  # mm/h: wets the ground, and leaves treads in places
WATER_TABLE = 1.15  # cm below the brims: water stands in the deep parts of the ruts
SOAKED = 0.55
"""What is left of the colour of the ground."""
PICTURE = (1920, 1080)
HEIGHT = open_air.rolling(swell=0.18, hills=10.0, seed=4)
_KNOTS = np.array([(0, 0), (1.5, 0.02), (3.5, 0.1), (5.5, 0.34), (8, 0.9), (11, 1.8), (15, 3.3), (20, 5.4), (26, 8)])
"""How far the bend leads along -y, and aside to +x [m]."""


def aside(along: Array, wander: float = 0.0) -> Array:
    """How far a wheel has gone aside after a way along the track [m]; it wanders by some centimetres."""
    bend = clamped_spline(np.clip(along, 0.0, 26.0), _KNOTS[:, 0], _KNOTS[:, 1:], np.zeros(1), np.array((-0.5,)))[
        ..., 0
    ]
    return bend + wander * np.sin(1.7 * along + 0.5) + 0.5 * wander * np.sin(3.9 * along)


def _apart(x: Array, y: Array) -> Array:
    """Distance to the middle of the nearer rut [m]."""
    bend = aside(START + 0.4 - y)
    return np.minimum(np.abs(x - RUTS[0] - bend), np.abs(x - RUTS[1] - bend))


def _stiffness(x: Array, y: Array) -> Array:
    """Soft and hard places: ruts are uneven in depth; boots went where the ground bears them, at first."""
    trodden = 1.0 + 1.1 * (np.abs(x) < 0.3) * np.clip((y + 1.9) / 0.8, 0.0, 1.0)
    return trodden * np.exp(0.55 * open_air.waves(x, y, 1.3, 3) + 0.25 * open_air.waves(x, y, 0.5, 8))


def _rim(x: Array, y: Array) -> Array:
    """Rims that break off here and swell there."""
    return np.clip(0.9 + 0.8 * open_air.waves(x, y, 0.55, 5), 0.15, 1.4)


def _seen(x: Array, y: Array) -> Array:
    return (np.abs(x) < 30.0) * (y < 2.4) * np.clip((y + 60.0) / 12.0, 0.0, 1.0)


def _meadow(x: Array, y: Array) -> Array:
    """How much of the ground is overgrown: beside the track, between the ruts in patches, all of it far away."""
    apart = _apart(x, y) + 0.10 * open_air.waves(x, y, 0.9, 1) + 0.05 * open_air.waves(x, y, 0.4, 2)
    between = (x < RUTS[0] + aside(START + 0.4 - y)) & (x > RUTS[1] + aside(START + 0.4 - y))
    beside = np.clip((apart - np.where(between, 0.36, 0.62)) / 0.45, 0.0, 1.0)
    walked = np.clip((np.abs(x) - 0.35) / 0.3, 0.0, 1.0)
    near = beside * np.maximum(walked, np.clip((-4.0 - y) / 4.0, 0.0, 1.0))
    return np.maximum(near, np.clip((-11.0 - y) / 7.0, 0.0, 1.0))


def _growth(x: Array, y: Array) -> Array:
    """Grass of a square metre."""
    patches = np.clip(0.55 + 0.75 * open_air.waves(x, y, 1.5, 6), 0.0, 1.6)
    return 650.0 * _seen(x, y) * _meadow(x, y) * patches / (1.0 + (0.12 * y) ** 2)


def _straw(x: Array, y: Array) -> Array:
    """Dead grass of a square metre, thick where little else grows."""
    patches = np.clip(0.35 - 0.8 * open_air.waves(x, y, 1.5, 6) + 0.4 * open_air.waves(x, y, 0.7, 7), 0.0, 1.5)
    return 400.0 * _seen(x, y) * _meadow(x, y) * patches / (1.0 + (0.12 * y) ** 2)


def _short(x: Array, y: Array) -> Array:
    """Low grass and weeds of a square metre, also at the edge of what is trodden."""
    patches = np.clip(0.3 + 0.9 * open_air.waves(x, y, 0.8, 9), 0.0, 1.5)
    fringe = np.clip(_meadow(x, y) * 3.0, 0.0, 1.0) + 0.05
    return 600.0 * (np.abs(x) < 4.0) * (y < 1.8) * np.clip((y + 10.0) / 7.0, 0.0, 1.0) * fringe * patches


def _bare(x: Array, y: Array) -> Array:
    """Crumbs and stones lie where little grows."""
    seen = (np.abs(x) < 3.0) * (y < 1.6) * np.clip((y + 9.0) / 7.0, 0.0, 1.0) ** 2
    return 380.0 * seen * (1.0 - 0.8 * _meadow(x, y)) * np.clip(0.8 + 0.6 * open_air.waves(x, y, 0.6, 4), 0.1, 2.0)


def _broken(x: Array, y: Array) -> Array:
    """Clods of a square metre that broke out of the walls of the ruts."""
    beside = np.exp(-(((_apart(x, y) - 0.20) / 0.08) ** 2))
    patches = np.clip(0.25 + 1.0 * open_air.waves(x, y, 0.7, 12), 0.0, 1.6)
    return 330.0 * (y < 1.6) * np.clip((y + 13.0) / 8.0, 0.0, 1.0) * beside * patches


PAINTED = {
    "softground_stiffness": _stiffness,
    "softground_rim_factor": _rim,
    "meadow": _meadow,
    "growth": _growth,
    "straw": _straw,
    "short": _short,
    "bare": _bare,
    "broken": _broken,
}


def build(scene: bpy.types.Scene, cell_size: float = CELL_SIZE, options: Options | None = None) -> Built:
    """A wide ground, four wheels that roll along it in two ruts, and a walk after them."""
    ground = open_air.add_ground(scene, "Track", (-20.0, START + 3.0), HEIGHT, "soil", PAINTED)
    open_air.add_camera(scene, (0.34, 1.42, 0.40), (-0.10, -1.4, 0.06), 28.0, (0.05, 0.1, 0.0), 9.0, picture=PICTURE)
    along = np.linspace(0.0, 26.0, 53)
    car = []
    for rut in RUTS:
        for axle, wander in enumerate((0.025, -0.02)):
            wheel = create_tyre(f"Wheel {len(car) + 1}", scene.collection)
            wheel.location = (rut, START + 0.4, 0.0)
            bpy.context.view_layer.update()
            course = Course(np.column_stack([along, aside(along, wander)]), _under(rut))
            roll_along(wheel, course, RADIUS, SPEED, FRAMES, scene.render.fps, 1 + AXLES * axle)
            car.append(Walker(wheel, MASS / 4))
    chosen = {"relief_strength": "1.4", "tread": "0.006"} | dict(options or {})
    built = open_air.bake_walk(scene, ground, START, FRAMES, PRESET, cell_size, chosen, beside=car)
    modifier = weather.add(built.bakes[PRESET].ground)
    weather.set_preset(modifier, "SHOWER")
    for name, value in {"Rain": RAIN, "Water Table": WATER_TABLE}.items():
        compat.write_input(modifier, weather_modifier.inputs_of(modifier)[name], value)
    return built


def _under(rut: float) -> Heights:
    """The ground as a wheel meets it, by the way from its start and how far it has gone aside."""
    return lambda along, aside: HEIGHT(rut + aside, START + 0.4 - along)


def claims(built: Built) -> list[Claim]:
    """Prints of both kinds, of depths that wet soil takes."""
    bake = built.bakes[PRESET]
    boots, tyres = bake.of("Hiker"), [step for step in bake.footprints if step.character != "Hiker"]
    return [
        Claim("Steps of the boots", len(boots), 12, 40),
        Claim("Depth of the deepest [m]", max(step.max_depth_m for step in boots), 0.01, 0.08),
        Claim("Depth of the ruts [m]", max(step.max_depth_m for step in tyres), 0.01, 0.10),
    ]


def shoot(_built: Built, folder: Path, samples: int) -> list[Path]:
    """From the height of a knee, toward the evening sun at the side."""
    scene = bpy.context.scene
    scene.frame_set(scene.frame_end)
    for thing in bpy.data.objects:
        if thing.name.startswith("Wheel"):
            thing.hide_render = True  # the car is long gone, and the walker out of sight
    stage.hide(bpy.data.objects["Hiker"])
    open_air.add_low_sun(scene, radians(124), radians(19), (1.0, 0.76, 0.52), 9.0, 0.15, (radians(11.0), 1.3))
    _add_trees()
    ground = baked_ground.display_mesh_of(scene.softground.ground)
    for material in ground.data.materials:
        open_air.darken(material, SOAKED)
        graph = Graph(material.node_tree)
        under_water = graph.ramp(graph.attribute(WATER), 0.0, 0.002)
        open_air.dull(graph, material.node_tree, graph.blend(under_water, 0.3, 1.0))
        open_air.overgrow(material, "meadow", (0.016, 0.014, 0.006), (0.060, 0.055, 0.022))
    _add_litter(ground)
    scene.view_settings.exposure, scene.render.image_settings.quality = 1.05, 82
    path = folder / "tyre_and_boot.jpg"
    stage.render(scene, scene.camera, path, PICTURE, samples)
    return [path]


def _add_trees() -> None:
    """The edge of a forest in groups, with a gap and bushes; none between the sun and the track."""
    chance = np.random.default_rng(11)

    def groups(count: int, each: float, near: float, far: float, spread: float) -> Array:
        middle = np.column_stack([chance.uniform(-95.0, 75.0, count), -chance.uniform(near, far, count)])
        members = np.repeat(middle, chance.poisson(each, count) + 1, axis=0)
        return members + chance.normal(0.0, spread, members.shape)

    def clear(spots: Array) -> Array:
        way = np.arctan2(spots[:, 0], -spots[:, 1])
        return spots[(way < radians(34.0)) & (np.abs(way - radians(4.0)) > radians(3.5) * (spots[:, 1] > -75.0))]

    spots = clear(groups(60, 6.0, 48.0, 95.0, 4.0))
    firs.add_firs(spots, chance.lognormal(2.0, 0.45, len(spots)), HEIGHT, (0.034, 0.056, 0.030))
    spots = clear(groups(26, 3.0, 40.0, 80.0, 5.0))
    leaves = (0.045, 0.050, 0.010), (0.16, 0.13, 0.030)
    broadleaf.add_broadleaves(spots, chance.lognormal(1.95, 0.35, len(spots)), HEIGHT, *leaves, stem=0.22, seed=20)
    spots = clear(groups(60, 3.0, 32.0, 70.0, 3.0))
    broadleaf.add_broadleaves(spots, chance.uniform(0.8, 2.6, len(spots)), HEIGHT, *leaves, stem=0.02, seed=40)


def _add_litter(ground: bpy.types.Object) -> None:
    """Grass green and dead, weeds, clods beside the ruts, crumbs and stones."""
    chance = np.random.default_rng(5)
    upright = {"lean": 0.35, "bend": 1.4, "bury": 0.05}
    green = (0.036, 0.056, 0.012), (0.12, 0.14, 0.042)
    grass = litter.pieces_of("Grass", litter.blades(open_air.tufts(chance), *green))
    litter.strew(ground, grass, "growth", smallest=0.03, largest=0.20, law=1.5, seed=6, **upright)
    dead = litter.pieces_of("Straw", litter.blades(open_air.tufts(chance), *litter.STRAW, "straw"))
    litter.strew(ground, dead, "straw", smallest=0.03, largest=0.17, law=1.3, seed=7, lean=1.0, bend=1.4, bury=0.05)
    litter.strew(ground, grass, "short", smallest=0.012, largest=0.05, law=1.4, seed=8, **upright)
    crumbs = litter.stones((0.045, 0.028, 0.018), (0.125, 0.080, 0.050), 0.9)
    stones = litter.stones((0.10, 0.085, 0.07), (0.24, 0.21, 0.175), 0.5, rough=0.2)
    clods = litter.clods((0.040, 0.025, 0.016), (0.100, 0.062, 0.038))
    lying = {"lean": pi, "bend": pi / 2, "depth": 0.1, "bury": 0.9}
    fallen = {"law": 1.8, "lean": pi, "bend": pi, "depth": 0.12}
    litter.strew(ground, clods, 1.1e4, where=RIM, smallest=0.006, largest=0.045, seed=10, **fallen)
    litter.strew(ground, clods, 2.5, where="broken", smallest=0.010, largest=0.065, seed=9, **fallen)
    litter.strew(ground, crumbs, "bare", smallest=0.005, largest=0.028, seed=3, **lying)
    litter.strew(ground, stones, "bare", smallest=0.003, largest=0.026, law=2.4, seed=4, **lying)


if __name__ == "__main__":
    production.main(__name__)
