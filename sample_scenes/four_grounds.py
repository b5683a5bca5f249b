"""Fig. 8, the four materials: the same step in snow, dry sand, mud and soil, seen from close by.

Each preset as two clicks in the panel have it, with Relief at Close-Up: rims lean ahead, dry sand lies at its angle of
repose, and the pressure rolls from the heel to the toes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, radians, sin
from pathlib import Path

import bpy
import numpy as np

from sample_scenes import production, stage
from sample_scenes.body import Body
from sample_scenes.character import copy_character, create_character
from sample_scenes.gait import Gait, walk
from sample_scenes.keys import write_action
from sample_scenes.production import Built, Claim, Options, Walker
from softground_addon.core.record.footprints import Footprint

PRESETS = ("Snow", "Dry Sand", "Mud", "Soil")

CELL_SIZE: float | None = None
"""Fitted to the soles."""

FRAMES = 48  # 2 s: four steps
SPACING, LENGTH = 1.2, 5.0  # m from ground to ground, and from row to row
PICTURE = (960, 720)
GRAINS = 24
"""Samples below which grains of soil blur."""
SUN_ELEVATION = radians(22)
"""Low, but the bottom of a print still sees the sun."""
EXPOSURE = {"Snow": -0.6, "Dry Sand": -0.25, "Mud": 0.25, "Soil": 0.6}
"""Of the pictures, in stops: snow is ten times as bright as soil."""


@dataclass(frozen=True)
class FourGrounds(Built):
    """One bake per preset, and who walked there."""

    walkers: list[bpy.types.Object]


def build(
    scene: bpy.types.Scene,
    cell_size: float | None = CELL_SIZE,
    options: Options | None = None,
    presets: Sequence[str] = PRESETS,
    row: int = 0,
) -> FourGrounds:
    """The same short walk on each preset, in a row of grounds that lies beside others."""
    body = Body()
    first = create_character("Hiker", body, scene.collection, production.COARSENESS)
    write_action(first, walk(body, Gait(), FRAMES, scene.render.fps), "Walk")
    scene.frame_start, scene.frame_end = 1, FRAMES
    bakes, walkers = {}, []
    for number, preset in enumerate(presets):
        walker = copy_character(first, f"Hiker {preset}", scene.collection)
        walker.location = (number * SPACING, row * LENGTH, 0.0)
        chosen = {"shape_keys": "false", "relief": "CLOSE_UP"} | dict(options or {})
        bakes[preset] = production.bake(scene, [Walker(walker, body.mass)], preset, cell_size, options=chosen)
        bakes[preset].ground.name = f"{preset} Ground"
        walkers.append(walker)
    production.remove_character(first)
    return FourGrounds(bakes, walkers)


def claims(built: FourGrounds) -> list[Claim]:
    """The softer the deeper; the rim is 2·nu of what was pressed, less what was thrown."""
    depth = {
        preset: float(np.mean([step.compressed_m3 / step.area_m2 for step in bake.footprints]))
        for preset, bake in built.bakes.items()
    }
    raised = {
        preset: (bake.report["totals"]["rim_m3"] + bake.report["totals"]["thrown_m3"])
        / bake.report["totals"]["compressed_m3"]
        for preset, bake in built.bakes.items()
    }
    return [
        Claim("Snow's prints over mud's, in mean depth", depth["Snow"] / depth["Mud"], 1.05, 2.5),
        Claim("Mud's prints over sand's, in mean depth", depth["Mud"] / depth["Dry Sand"], 1.2, 2.5),
        Claim("Sand's prints over soil's, in mean depth", depth["Dry Sand"] / depth["Soil"], 1.05, 2.5),
        Claim("Depth of sand's prints [m]", _deepest("Dry Sand", built), 0.02, 0.03),
        Claim("Part of the pressed snow that is raised or thrown", raised["Snow"], 0.099, 0.101),
        Claim("Part of the pressed sand that is raised or thrown", raised["Dry Sand"], 0.99, 1.01),
        Claim("Height of snow's rim over the depth of its print", _rim_height("Snow", built), 0.0, 0.1),
        *(claim for preset in PRESETS[1:] for claim in _rim_ahead(preset, built)),
    ]


def _deepest(preset: str, built: FourGrounds) -> float:
    """Deepest point of the print that is shown [m]."""
    return close_up_of(built.bakes[preset].footprints).max_depth_m


def _rim_height(preset: str, built: FourGrounds) -> float:
    """Highest point of the rim of the print that is shown, over the depth of the print."""
    step = close_up_of(built.bakes[preset].footprints)
    return float(step.tile(step.rim).max()) / step.max_depth_m


def _rim_ahead(preset: str, built: FourGrounds) -> list[Claim]:
    """Where the rim of the print that is shown is highest along the foot, and how much more of it is ahead."""
    step = close_up_of(built.bakes[preset].footprints)
    x, y = np.meshgrid(*step.window.centres(step.cell_size))
    along = (x - step.position[0]) * cos(step.heading) + (y - step.position[1]) * sin(step.heading)
    of_print, risen = along.ravel()[step.contact_cells], step.tile(step.rim) - step.tile(step.compression)
    heel, toes = of_print.min(), of_print.max()
    highest = (along.ravel()[risen.argmax()] - heel) / (toes - heel)
    ahead, behind = risen[along > toes].max(), risen[along < heel].max()
    return [
        Claim(f"Highest point of the rim in {preset.lower()}, from 0 at the heel to 1 at the toes", highest, 0.75, 1.2),
        Claim(
            f"Height of the rim ahead of the toes in {preset.lower()} over that behind the heel", ahead / behind, 1.2, 6
        ),
    ]


def shoot(built: FourGrounds, folder: Path, samples: int) -> list[Path]:
    """One print on each ground under a low sun, and all of them on one sheet."""
    light(bpy.context.scene, close_up_of(built.bakes["Snow"].footprints))
    pictures = close_ups(built, folder / "four_grounds", PICTURE, max(samples, GRAINS))
    return [*pictures, stage.contact_sheet(pictures, 2, folder / "four_grounds.jpg")]


def close_ups(built: FourGrounds, path: Path, size: tuple[int, int], samples: int) -> list[Path]:
    """One print on each ground; the pictures' names begin with a path."""
    scene = bpy.context.scene
    scene.frame_set(scene.frame_end)
    for walker in built.walkers:
        stage.hide(walker)
    camera = stage.add_camera(scene, "Close-up", lens=50.0)
    pictures = []
    for preset, bake in built.bakes.items():
        aim_at_print(camera, close_up_of(bake.footprints))
        scene.view_settings.exposure = EXPOSURE.get(preset, 0.0)
        pictures.append(path.with_name(f"{path.name}_{preset.lower().replace(' ', '_')}.png"))
        stage.render(scene, camera, pictures[-1], size, samples)
    return pictures


def light(scene: bpy.types.Scene, step: Footprint) -> None:
    """A low sun from ahead and aside: walls throw shadows, wet ground shines toward the camera."""
    stage.add_sun(scene, step.heading - radians(125), SUN_ELEVATION)
    scene.view_settings.exposure = -0.5


def aim_at_print(camera: bpy.types.Object, step: Footprint) -> None:
    """From behind and above, the toes pointing up in the picture."""
    reach = 2.0 * np.sqrt(step.area_m2)  # length of the foot, about
    ahead = np.array((cos(step.heading), sin(step.heading), 0.0))
    aside = np.array((ahead[1], -ahead[0], 0.0))
    stage.aim(camera, step.position + reach * (-1.45 * ahead + 0.35 * aside + (0.0, 0.0, 1.25)), step.position)


def close_up_of(footprints: tuple[Footprint, ...]) -> Footprint:
    """A print to look at from close by: whole, from the middle of the walk, and clear of all others."""
    quarter = len(footprints) // 4
    middle = footprints[quarter : len(footprints) - quarter] or footprints
    largest = max(step.area_m2 for step in middle)
    whole = [step for step in middle if step.area_m2 > 0.8 * largest]

    def clearance(step: Footprint) -> float:
        others = [np.linalg.norm(step.position - other.position) for other in footprints if other is not step]
        return float(min(others, default=np.inf))

    return max(whole, key=clearance)


if __name__ == "__main__":
    production.main(__name__)
