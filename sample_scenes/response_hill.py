"""Fig. 9, with and without response: a walk over a soft hill as it was made for level ground, and answering it."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians
from pathlib import Path

import bpy
import numpy as np

from sample_scenes import production, stage, terrain
from sample_scenes.body import Body
from sample_scenes.character import copy_character, create_character
from sample_scenes.gait import Gait, walk
from sample_scenes.keys import write_action
from sample_scenes.production import Built, Claim, Options, Walker

CELL_SIZE = 0.025  # m
FRAMES = 96  # 4 s
APART = 3.2  # m between the two hills
HALF_WIDTH, LENGTH = 0.7, (-6.2, 1.4)  # m; of a hill across the way and along it
SHOWN = (14, 36, 58, 82)
PICTURE = (960, 320)

_RESPONSE: Options = {"tilt.use": "true", "tilt.strength": "0.8", "grounding.use": "true"}


@dataclass(frozen=True)
class ResponseHill(Built):
    """The walk without and with the response, each on its own hill."""

    walkers: dict[str, bpy.types.Object]


def hill(x: terrain.Array, y: terrain.Array) -> terrain.Array:
    """A rise of half a metre across the way of the walk [m]."""
    return 0.5 * np.exp(-(((y + 2.3) / 1.25) ** 2)) + 0 * x


def build(scene: bpy.types.Scene, cell_size: float = CELL_SIZE, options: Options | None = None) -> ResponseHill:
    """The same walk over two equal hills."""
    body = Body()
    first = create_character("Without", body, scene.collection, production.COARSENESS)
    write_action(first, walk(body, Gait(), FRAMES, scene.render.fps), "Walk")
    scene.frame_start, scene.frame_end = 1, FRAMES
    walkers = {"without": first, "with": copy_character(first, "With", scene.collection)}
    walkers["with"].location.x = APART
    bakes = {}
    for (name, walker), answer in zip(walkers.items(), ({}, _RESPONSE), strict=True):
        x = terrain.spaced(walker.location.x - HALF_WIDTH, walker.location.x + HALF_WIDTH, cell_size)
        y = terrain.spaced(*LENGTH, cell_size)
        ground = terrain.add_terrain(f"Hill {name}", x, y, hill, "soil", scene.collection)
        chosen = {"shape_keys": "false", "material.youngs_modulus": "4e5"} | dict(options or {}) | answer
        bakes[name] = production.bake(
            scene, [Walker(walker, body.mass)], "Paper Soil", cell_size, ground=ground, options=chosen
        )
    return ResponseHill(bakes, walkers)


def claims(built: ResponseHill) -> list[Claim]:
    """Feet stand on the ground that they pressed, hips follow the hill, and the body leans into it."""
    gaps = {
        when: max(size["p95"] for size in built.bakes["with"].report["gaps_mm"][when]["With"].values())
        for when in ("before", "after")
    }
    rise = {name: np.ptp(_path(walker)[:, 2]) for name, walker in built.walkers.items()}
    lean = {name: _uphill_lean(walker) for name, walker in built.walkers.items()}
    return [
        Claim("Distance of standing soles from the ground without response, 95 % [mm]", gaps["before"], 15, 600),
        Claim("Distance of standing soles from the ground with response, 95 % [mm]", gaps["after"], 0, 2),
        Claim("Rise of the hips without response [m]", float(rise["without"]), 0.0, 0.06),
        Claim("Rise of the hips with response [m]", float(rise["with"]), 0.35, 0.7),
        Claim("Lean into the rise that the response adds [degrees]", lean["with"] - lean["without"], 2, 20),
    ]


def _path(walker: bpy.types.Object) -> np.ndarray:
    """Hips over the shot, (F, 3) [m]."""
    scene, places = bpy.context.scene, []
    for frame in range(scene.frame_start, scene.frame_end + 1):
        scene.frame_set(frame)
        places.append(walker.matrix_world @ walker.pose.bones["hips"].head)
    return np.array(places)


def _uphill_lean(walker: bpy.types.Object) -> float:
    """How far the trunk leans forward on the way up, on average [degrees]."""
    scene, leans = bpy.context.scene, []
    for frame in range(scene.frame_start, scene.frame_end + 1):
        scene.frame_set(frame)
        hips, neck = (np.array(walker.matrix_world @ walker.pose.bones[bone].head) for bone in ("hips", "neck"))
        if -2.1 < hips[1] < -0.9:  # the way up; the walk goes toward -y
            leans.append(np.degrees(np.arctan2(hips[1] - neck[1], neck[2] - hips[2])))
    return float(np.mean(leans))


def shoot(built: ResponseHill, folder: Path, samples: int) -> list[Path]:
    """Four moments of each walk from the side, without response above, with it below."""
    scene = bpy.context.scene
    copies = {name: stage.freeze(walker, SHOWN, scene.collection) for name, walker in built.walkers.items()}
    stage.add_sun(scene, radians(-150), radians(30))
    sides = {
        name: _add_side(walker.location.x + HALF_WIDTH, scene.collection) for name, walker in built.walkers.items()
    }
    stage.add_floor(-0.24, scene.collection)
    camera = stage.add_camera(scene, "Side", lens=60.0)
    pictures = []
    for name, bake in built.bakes.items():
        for other in built.bakes:
            for thing in (*copies[other], sides[other], built.bakes[other].display_mesh):
                thing.hide_render = other != name
        middle = np.array((built.walkers[name].location.x, -2.35, 0.95))
        stage.aim(camera, middle + np.array((11.8, 0.0, 2.4)), middle)
        pictures.append(folder / f"response_hill_{name}.png")
        stage.render(scene, camera, pictures[-1], PICTURE, samples)
        bake.display_mesh.hide_render = False
    return [*pictures, stage.contact_sheet(pictures, 1, folder / "response_hill.jpg")]


def _add_side(x: float, collection: bpy.types.Collection) -> bpy.types.Object:
    """A cut through the hill at x, down to below level ground: what would be hollow under a mesh."""
    y = terrain.spaced(*LENGTH, 0.05)
    top = np.column_stack([np.full(len(y), x), y, hill(x, y) - 0.002])
    mesh = bpy.data.meshes.new("Side")
    count = len(y)
    quads = [(i, i + 1, count + i + 1, count + i) for i in range(count - 1)]
    mesh.from_pydata(np.concatenate([top, top * (1, 1, 0) + (0, 0, -0.25)]).tolist(), [], quads)
    mesh.materials.append(stage.plain_material("SoftGround Sample cut", (0.075, 0.045, 0.028), 0.9))
    side = bpy.data.objects.new("Side", mesh)
    collection.objects.link(side)
    return side


if __name__ == "__main__":
    production.main(__name__)
