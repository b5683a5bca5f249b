"""Tracks under weather: snowfall, thaw, wind on a dune, a drying beach, each as a sheet of four moments.

One bake each; only the weather's sliders act afterwards.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from math import pi, radians
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from gallery import litter, open_air
from sample_scenes import production, stage, terrain
from sample_scenes.body import Body
from sample_scenes.character import create_character
from sample_scenes.gait import Gait, walk
from sample_scenes.keys import write_action
from sample_scenes.production import Bake, Built, Claim, Options, Walker
from sample_scenes.stage import Array
from softground_addon.blender import compat
from softground_addon.blender.playback import weather_modifier
from softground_addon.blender.playback.weather_nodes import WETNESS
from softground_addon.blender.weather import ground_weather as weather
from softground_addon.blender.weather import weather_keys
from softground_addon.core.record.footprints import Footprint

CELL_SIZE: float | None = None
"""Fitted to the soles."""

WEATHER = {"SNOWFALL": "Snow", "THAW": "Snow", "WINDY_DUNES": "Dry Sand", "DRYING_BEACH": "Wet Sand"}
"""Presets of weather, and the ground that each goes over."""

FRAMES = 60
LASTS = 264
"""Frames from the last step to the last picture: eleven seconds."""
MOMENTS = {
    "SNOWFALL": (0.0, 0.05, 0.11, 0.45),
    "THAW": (0.0, 0.15, 0.62, 0.9),
    "WINDY_DUNES": (0.0, 0.06, 0.105, 0.9),
    "DRYING_BEACH": (0.0, 0.25, 0.38, 1.0),
}
"""When the pictures of a sheet are taken, as shares of that time."""
COLUMNS = 2
BARE = ("THAW", "DRYING_BEACH")
"""Presets without debris: what was thrown would melt or dry first."""
SUN = {"SNOWFALL": (-12.0, 29.0), "THAW": (6.0, 12.0), "WINDY_DUNES": (8.0, 13.0), "DRYING_BEACH": (-20.0, 13.0)}
"""Where the light goes and how high it comes from [deg]: low and across the prints."""
SUNLIGHT, WARM = 6.5, (1.0, 0.84, 0.66)
"""Strength [W/m²] and colour of the sun."""
SKYLIGHT = {"SNOWFALL": 0.14, "THAW": 0.14, "WINDY_DUNES": 0.25, "DRYING_BEACH": 0.09}
"""Strength of the sky, which fills shadows blue."""
EXPOSURE = {"SNOWFALL": 0.4, "THAW": 0.45, "WINDY_DUNES": 0.3, "DRYING_BEACH": 0.75}
"""In stops."""
DUSK = (radians(8.0), 2.4)
"""Sun and ozone of the sky."""
FLAKES = 9000
"""In the air while it snows."""
LENS, F_STOP = 58.0, 8.0
EYE, TARGET = (0.56, 0.92, 0.40), (-0.06, -0.20, 0.0)
"""Where the camera is and where it looks, from a step on [m]."""
SOIL, HUMPS = -0.225, 0.10
"""Mean height of the soil below the snow that thaws, and about how far its humps rise above it [m]."""
STRAW, ROOTED = 900, -0.24
"""Tufts of dead grass that are tried, and the height of soil from which on they grow [m]."""
PICTURE = (960, 540)
"""Size of each picture of a sheet."""
APART = 30.0
"""Distance of the tracks [m]."""


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> Built:
    """The same walk on each ground, far from the others."""
    return Built({preset: track(scene, preset, cell_size, options) for preset in WEATHER})


def track(scene: bpy.types.Scene, preset: str, cell_size: float | None, options: Options | None) -> Bake:
    """The walk on the ground that a preset of weather goes over, and the weather."""
    number, body = list(WEATHER).index(preset), Body()
    scene.frame_start, scene.frame_end = 1, FRAMES
    walker = create_character(f"Hiker {number + 1}", body, scene.collection, production.COARSENESS)
    walker.location = (APART * number, 0.0, 0.0)
    write_action(walker, walk(body, Gait(), FRAMES, scene.render.fps), "Walk")
    relief = "FINE" if preset == "DRYING_BEACH" else "CLOSE_UP"  # tread in wet sand is sharp, in low light
    chosen = {"shape_keys": "false", "relief": relief, "relief_vertices": "600000", "ground_margin": "2.0"}
    if preset in BARE:
        chosen["debris"] = "false"
    chosen |= options or {}
    bake = production.bake(scene, [Walker(walker, body.mass)], WEATHER[preset], cell_size, options=chosen)
    modifier = weather.add(bake.ground)
    weather.set_preset(modifier, preset)
    if preset != "THAW":  # to which steps of different ages are more to look at
        _set_in(modifier, FRAMES)
    if preset == "THAW":
        _add_soil(walker.location.x)
    stage.hide(walker)
    return bake


def _add_soil(middle: float) -> None:
    """Wet soil and dead grass below a track along x = `middle` [m], which come out of the snow as that melts."""
    chance = np.random.default_rng(4)
    waves = [(length, *chance.uniform(0.0, 2.0 * pi, 2)) for length in np.geomspace(1.5, 0.06, 14)]

    def height(x: Array, y: Array) -> Array:
        humps = sum(
            length**0.8 * np.sin((x * np.cos(way) + y * np.sin(way)) * 2.0 * pi / length + phase)
            for length, way, phase in waves
        ) / np.linalg.norm([length**0.8 for length, *_ in waves])
        return SOIL + HUMPS * (0.7 * humps - 0.5 * np.exp(-(((x - middle) / 0.3) ** 2)))

    x, y = (terrain.spaced(low, high, 0.015) for low, high in ((middle - 2.6, middle + 2.4), (-5.5, 1.0)))
    rained = {WETNESS: lambda x, _y: np.full_like(x, 0.6)}
    terrain.add_terrain("Soil", x, y, height, "soil", bpy.context.scene.collection, rained)
    spots = np.column_stack([middle + chance.uniform(-2.4, 1.6, STRAW), chance.uniform(-5.2, 0.0, STRAW)])
    spots = spots[height(*spots.T) > ROOTED]
    blades = litter.blades(open_air.tufts(chance), *litter.STRAW)
    open_air.add_grass(spots, chance.uniform(0.03, 0.13, len(spots)), height, shapes=blades)


def _set_in(modifier: Any, frame: int) -> None:
    """Let weather begin at a frame: before it, no time passes for it."""
    name = weather_modifier.inputs_of(modifier)["Time Scale"]
    path, scale = compat.input_path(modifier, name), compat.read_input(modifier, name)
    for at, value in ((frame - 1, 0.0), (frame, scale)):
        compat.write_input(modifier, name, value)
        modifier.id_data.keyframe_insert(path, frame=at)
    weather_keys.follow(modifier.id_data)


def claims(built: Built) -> list[Claim]:
    """What the weather does to the hollow of a step, from the end of the walk to the last picture."""
    shares = {preset: hollow_left(bake) for preset, bake in built.bakes.items()}
    return [
        Claim("Hollow left by a night of snow", shares["SNOWFALL"], 0.0, 0.7),
        Claim("Hollow left by a thaw: trodden snow melts last and stands up", shares["THAW"], -3.0, 0.7),
        Claim("Hollow left by ten minutes of wind", shares["WINDY_DUNES"], 0.0, 0.9),
        Claim("Hollow left by a drying beach", shares["DRYING_BEACH"], 0.5, 1.01),
    ]


def hollow_left(bake: Bake) -> float:
    """The share of a step's depth that is left in the last picture."""
    before, after = (_hollow(bake, frame) for frame in (FRAMES, FRAMES + LASTS))
    return after / before


def _step(bake: Bake) -> Footprint:
    return bake.footprints[len(bake.footprints) // 2]


def _hollow(bake: Bake, frame: int) -> float:
    """How much lower the middle of a step lies than the ground a foot away, in a frame [m]."""
    scene = bpy.context.scene
    scene.frame_set(frame)
    shown = bake.display_mesh.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    places = np.empty(3 * len(shown.vertices), np.float32)
    shown.attributes["position"].data.foreach_get("vector", places)
    places = places.reshape(-1, 3) + np.array(bake.display_mesh.matrix_world.translation)
    away = np.linalg.norm(places[:, :2] - _step(bake).position[:2], axis=1)
    return float(np.median(places[(away > 0.3) & (away < 0.6), 2]) - np.median(places[away < 0.04, 2]))


def shoot(built: Built, folder: Path, samples: int) -> list[Path]:
    """Four moments of each."""
    made = []
    for preset, bake in built.bakes.items():
        light(preset)
        _show(built, [preset])
        path = folder / f"time_lapse_{preset.lower()}"
        moments = take(bake, MOMENTS[preset], PICTURE, path, samples, snow=preset == "SNOWFALL")
        made.append(stage.contact_sheet(moments, COLUMNS, path.with_suffix(".jpg")))
    _show(built, built.bakes)
    return made


def _show(built: Built, presets: Collection[str]) -> None:
    """Only the tracks under these presets: the weather of the others need not be computed."""
    for preset, bake in built.bakes.items():
        bake.display_mesh.hide_viewport = bake.display_mesh.hide_render = preset not in presets


def light(preset: str) -> None:
    """The sun and the exposure of a preset's pictures, in place of another's."""
    scene = bpy.context.scene
    scene.view_settings.exposure = EXPOSURE[preset]
    toward, elevation = SUN[preset]
    open_air.add_low_sun(scene, radians(toward), radians(elevation), WARM, SUNLIGHT, SKYLIGHT[preset], DUSK)


def take(
    bake: Bake, moments: Sequence[float], size: tuple[int, int], path: Path, samples: int, *, snow: bool = False
) -> list[Path]:
    """Pictures of a track under its weather, low over a step; their names begin with a path. It may snow in all but
    the first."""
    scene = bpy.context.scene
    step = np.array(_step(bake).position)
    pictures = []
    camera = open_air.add_camera(scene, EYE, TARGET, LENS, (0.0, 0.0, 0.0), F_STOP)
    for number, frame in enumerate((FRAMES + LASTS * np.asarray(moments)).round().astype(int)):
        scene.frame_set(int(frame))
        ground = np.array((step[0], step[1], _level(bake)))
        stage.aim(camera, ground + EYE, ground + TARGET)
        pictures.append(path.with_name(f"{path.name}_{number:02d}.png"))
        snowing = [open_air.add_snowfall(camera, FLAKES, size[0] / size[1], number)] if number and snow else []
        stage.render(scene, camera, pictures[-1], size, samples)
        for flakes in snowing:
            bpy.data.meshes.remove(flakes.data)  # and the object with it
    return pictures


def _level(bake: Bake) -> float:
    """Height of the open ground in this frame [m]."""
    shown = bake.display_mesh.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    places = np.empty(3 * len(shown.vertices), np.float32)
    shown.attributes["position"].data.foreach_get("vector", places)
    return float(np.median(places[2::3]))


if __name__ == "__main__":
    production.main(__name__)
