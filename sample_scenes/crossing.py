"""Tracks crossing: two walkers cross each other's way in snow, and step into each other's prints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import radians
from pathlib import Path

import bpy
import numpy as np

from sample_scenes import plates, production
from sample_scenes.body import Body
from sample_scenes.character import copy_character, create_character
from sample_scenes.gait import Gait, walk
from sample_scenes.keys import write_action
from sample_scenes.production import Bake, Built, Claim, Options, Walker
from softground_addon.core.ground.heightfield import HeightField
from softground_addon.core.record.footprints import Footprint, recompose

CELL_SIZE = 0.012  # m
FRAMES = 84  # 3.5 s


@dataclass(frozen=True)
class Crossing(Built):
    """One ground with the tracks of two walkers, and what each does to it alone."""

    alone: list[Bake]
    walkers: list[bpy.types.Object]


def build(scene: bpy.types.Scene, cell_size: float = CELL_SIZE, options: Options | None = None) -> Crossing:
    """The second walker crosses the first one's way at an angle, a step behind."""
    body = Body()
    walk_of = walk(body, Gait(), FRAMES, scene.render.fps)
    first = create_character("East", body, scene.collection, production.COARSENESS)
    write_action(first, walk_of, "Walk")
    scene.frame_start, scene.frame_end = 1, FRAMES
    second = copy_character(first, "West", scene.collection)
    angle = radians(75)
    # Both ways meet where each has put a left foot: there the one treads on the other's print.
    fall = sorted((f for f in walk_of.footfalls if f.side == "L"), key=lambda f: f.strike)[1].place
    meeting = np.array((fall[1], -fall[0]))
    turn = np.array(((np.cos(angle), -np.sin(angle)), (np.sin(angle), np.cos(angle))))
    second.rotation_euler.z = angle
    second.location.xy = meeting - turn @ meeting
    walkers = [Walker(first, body.mass), Walker(second, body.mass)]
    options = {"shape_keys": "false"} | dict(options or {})
    alone = [
        production.bake(scene, [walker], "Paper Snow", cell_size, options=options, write=False) for walker in walkers
    ]
    bake = production.bake(scene, walkers, "Paper Snow", cell_size, options=options)
    return Crossing({"Snow": bake}, alone, [first, second])


def claims(built: Crossing) -> list[Claim]:
    """A trodden place takes on only what exceeds it, and the order of walkers does not matter elsewhere."""
    bake = built.bakes["Snow"]
    tracks = [each.footprints for each in built.alone]
    trodden, deeper = _overlap(tracks, recompose(bake.footprints))
    forward, backward = recompose(bake.footprints), recompose(bake.footprints[::-1])
    remaining = _volume(bake.of(built.walkers[1].name)) / _volume(tracks[1])
    return [
        Claim("Prints that tread on a print of the other walker", float(len(trodden)), 1, 8),
        Claim("Depth where both trod, over the deeper of their lone prints", deeper, 1.0, 1.15),
        Claim("Volume of the second walker's track, over what it is alone", remaining, 0.8, 0.999),
        Claim("Difference of the ground put together in either order [m]", _difference(forward, backward), 0, 0),
    ]


def _volume(track: Sequence[Footprint]) -> float:
    return sum(step.compressed_m3 for step in track)


def _overlap(tracks: Sequence[Sequence[Footprint]], together: HeightField) -> tuple[list[Footprint], float]:
    """Prints of the second track on prints of the first, and the mean depth there over the deeper one's alone."""
    alone = [recompose(track) for track in tracks]
    depths, growth = [], []
    for step in tracks[1]:
        for other in tracks[0]:
            shared = _cells(step) & _cells(other) if step.window.intersects(other.window) else None
            if shared:
                depths.append(step)
                places = (np.array(sorted(shared)).T + 0.5) * step.cell_size
                deeper = np.maximum(*(ground.sample(*places)[0] for ground in alone))
                growth.append(together.sample(*places)[0].sum() / deeper.sum())
    return depths, float(np.max(growth, initial=0.0))


def _cells(step: Footprint) -> set[tuple[int, int]]:
    """Columns and rows of the cells that a print touched."""
    row, column = np.divmod(step.contact_cells, step.window.columns)
    return set(zip((column + step.window.column).tolist(), (row + step.window.row).tolist(), strict=True))


def _difference(a: HeightField, b: HeightField) -> float:
    return max(float(np.abs(a.tiles[key] - b.tiles[key]).max()) for key in a.tiles)


def shoot(built: Crossing, folder: Path, _samples: int) -> list[Path]:
    """Both tracks from above."""
    return [plates.draw_plate({"": built.bakes["Snow"].footprints}, folder / "crossing.png")]


if __name__ == "__main__":
    production.main(__name__)
