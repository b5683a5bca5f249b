"""Boots come out of mud onto a stone floor and up a stair, and leave less of it with each step."""

from __future__ import annotations

from math import radians
from pathlib import Path

import bpy
import numpy as np

from gallery import open_air, outfit
from gallery.stone_floor import END, PICTURE, START, TOP, booked, crossed, slab, stone
from sample_scenes import production, stage
from sample_scenes.body import Body
from sample_scenes.course import Course
from sample_scenes.gait import Gait
from sample_scenes.production import Built, Claim, Options
from sample_scenes.stage import Array
from softground_addon.blender.carried import marks_object

CELL_SIZE: float | None = None
"""Fitted to the soles."""

PRESET = "Mud"
FRAMES, SHOWN = 120, 116
RISE, STAIRS, FIRST = 0.12, 4, 5
"""Height of each stair [m], how many there are, and the footfall that is on the first."""
CAMERA = (0.5, 1.35, 0.86), (-0.1, -0.8, 0.0), 34.0
"""Where it is and looks [m], and its lens [mm]."""


def stairs() -> Array:
    """Where stairs begin along the way, between the footfalls of a walk [m]."""
    falls = Gait().footfalls(Body(), Course(), 0.25, FRAMES / 24.0)
    along = np.array([fall.place[0] for fall in falls if fall.strike > 0])
    return (along[FIRST - 1 : FIRST + STAIRS - 1] + along[FIRST : FIRST + STAIRS]) / 2 + 0.05  # toes reach ahead


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> Built:
    """A floor of stone beside a muddy yard, a stair on it, and a walk over all of them."""
    edges, hard = stairs(), scene.softground.hard_grounds
    for number, along in enumerate(edges, 1):
        hard.add().object = slab(scene, f"Stair {number}", (END, START - along), TOP + number * RISE, stone())
    course = Course(heights=lambda ahead, _: RISE * np.searchsorted(edges, np.asarray(ahead, float)))
    chosen = {"relief_vertices": "300000", "tread": "0.005"} | dict(options or {})
    return crossed(scene, PRESET, "mud", CAMERA, FRAMES, cell_size, chosen, course=course)


def claims(built: Built) -> list[Claim]:
    """Each foot leaves less with each step, on the floor and on the stairs."""
    marks = marks_object.of(built.bakes[PRESET].ground)
    up = np.array([marks.matrix_world @ vertex.co for vertex in marks.data.vertices])[:, 2]
    shown = marks_object.values(marks.data, "mass") > 0
    on_stairs = np.unique(np.rint((up[shown] - TOP) / RISE)).max()
    return [*booked(built, (5, 12), (10, 150)), Claim("Stairs with marks", float(on_stairs), 2, STAIRS)]


def shoot(built: Built, folder: Path, samples: int) -> list[Path]:
    """Floor and stair from behind, and one mark from above."""
    scene = bpy.context.scene
    open_air.add_low_sun(scene, radians(-150), radians(28), (1.0, 0.93, 0.84), 3.8, 0.2, open_air.DAY)
    scene.frame_set(SHOWN)
    hiker = bpy.data.objects["Hiker"]
    outfit.wear_boots(hiker, Body())
    whole = folder / "muddy_boots.jpg"
    stage.render(scene, scene.camera, whole, PICTURE, samples)
    marks = marks_object.of(built.bakes[PRESET].ground)
    place = np.array([marks.matrix_world @ vertex.co for vertex in marks.data.vertices])
    step, mass = (marks_object.values(marks.data, name) for name in ("step", "mass"))
    middle = place[step == step[mass > 0].min()].mean(axis=0)
    stage.hide(hiker)
    near = open_air.add_camera(scene, middle + np.array((0.15, 0.25, 0.42)), middle, 45.0, middle, 16.0)
    close = folder / "muddy_boots_close.jpg"
    stage.render(scene, near, close, PICTURE, samples)
    return [whole, close]


if __name__ == "__main__":
    production.main(__name__)
