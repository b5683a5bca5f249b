"""The ground of a shot as bodies carve it, frame by frame."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, floor
from typing import NamedTuple

import numpy as np

from ..ground.hard_ground import bare
from ..ground.heightfield import TerrainTiles
from ..ground.soft_ground import SoftGround
from ..ground.sparse_grid import TILE, SampledGrid, Window
from ..ground.variation import VariationTiles
from ..numerics.arrays import Array, Indices, Mask
from ..numerics.interpolation import cubic
from ..pressing.repose import SWEEPS_TO_REST
from ..record.footprints import QUANTUM, Footprint, quantised
from ..soles.undersides import lowest_surface
from .carved_step import CarvedStep
from .carver import REACH, CarvedCells

MOST_POSES = 32
"""Most poses of a body in a frame."""
SLIDES_EVERY, SWEEPS = 1 / 8, 8
"""Loose matter slides after every so many seconds in so many sweeps (`repose.slid`); the rest goes on in the next."""
PUSHED = 1 / 24
"""Time in which loose matter that is pushed along is packed as much as what stood is by the first cut [s]."""
SETTLING, SWEEPS_TO_SETTLE = 1 / 8, 96
"""It comes to rest once the leg is on its way to its next step, within this time [s], in at most so many sweeps;
without cohesion, in as many as it takes."""
LEAST = round(3e-3 / QUANTUM)
"""Changes of a cell are recorded once they come to so much, and all of them at the end [QUANTUM]: 3 mm."""
THIN = 2e-3
"""Loose matter that comes to rest is gathered where it is thinner [m]."""


class Drawn(NamedTuple):
    """A part of a body as it passed over a frame.

    Attributes
    ----------
    underside : (rows, columns) float array
        Lowest surface over each cell [m], infinite where there is none.
    way : (2,) float array
        Along x and y, of what moves most [m].
    """

    step: CarvedStep
    window: Window
    underside: Array
    way: Array


def _lowest(parts: Sequence[Drawn], window: Window) -> Array:
    """Lowest surface of all parts over the cells of a window, (rows, columns) [m], infinite where there is none."""
    lowest = np.full((window.rows, window.columns), np.inf)
    for part in parts:
        if (shared := window.intersection(part.window)) is not None:
            here = window.slices(shared)
            lowest[here] = np.minimum(lowest[here], part.underside[part.window.slices(shared)])
    return lowest


def _numbered(triangles: Indices, count: int) -> tuple[Indices, Indices]:
    """The vertices of triangles (T, 3), of a count, and the triangles as numbers of these."""
    place = np.zeros(count, dtype=np.intp)
    place[triangles] = 1
    used = np.flatnonzero(place)
    place[used] = np.arange(len(used))
    return used, place[triangles]


class CarvedGround:
    """The ground of a shot as it is carved."""

    def __init__(self, ground: SoftGround, cell_size: float, steps: Sequence[CarvedStep], rate: float) -> None:
        self._ground, self._cell_size = ground, cell_size
        self._coming = sorted(steps, key=lambda step: step.begins, reverse=True)
        self._pressing: list[CarvedStep] = []
        """Steps whose prints are changing."""
        self._slides_every, self._frames_to_rest = (max(1, round(time * rate)) for time in (SLIDES_EVERY, SETTLING))
        self._frames_to_push = PUSHED * rate
        self._undisturbed = TerrainTiles(bare(ground.terrain), cell_size)
        self._margin = ceil(2 * REACH / cell_size) + 2
        """Cells around a body that what it cuts is laid on."""
        self._highest = 0.0
        """Highest surface over the undisturbed ground so far [m]."""
        self._variation = VariationTiles(ground.variation, cell_size) if ground.variation else None
        self._cells = SampledGrid(self._untouched, cell_size, channels=8)
        """Terrain, its openness, the layer's floor, T, K, loose matter; what is recorded of the cut and of this."""
        self._contacts: list[tuple[Window, Mask]] = []
        self._settling: dict[CarvedStep, int] = {}
        """Steps whose loose matter comes to rest, and for how many more frames."""

    def _untouched(self, x: Array, y: Array) -> Array:
        """The channels of a tile, from its cell centres."""
        window = Window(floor(x[0, 0] / self._cell_size), floor(y[0, 0] / self._cell_size), TILE, TILE)
        surface = self._undisturbed.surface(window)
        terrain, nothing = np.nan_to_num(surface.heights), np.zeros(x.shape)
        depth = self._ground.layer_depths(window, self._cell_size)
        bottom = terrain - depth * (self._variation.factors(window).depth if self._variation else 1.0)
        return np.stack([terrain, surface.bears, bottom, terrain, nothing + np.inf, nothing, nothing, nothing])

    def press(self, since: float, frame: float) -> None:
        """Go on to the ground as soles have pressed it by a frame; what is loose under them is packed."""
        while self._coming and self._coming[-1].begins <= frame:
            self._pressing.append(self._coming.pop())
        self._contacts = [(step.footprint.window, step.touches(since, frame)) for step in self._pressing]
        for step, (window, touching) in zip(self._pressing, self._contacts, strict=True):
            change = step.change(since, frame)
            if change is None and not touching.any():
                continue
            cells, channels = self._read(window)
            if change is not None:
                cells.press(cells.pressed + change)
            cells.pack()
            self._write(step, window, cells, channels, frame)
        for step in [step for step in self._pressing if step.ends <= frame]:
            self._pressing.remove(step)
            step.release()

    def low(self, around: Array) -> Mask:
        """Vertices (4, V, 3) around a frame that come near the ground in it, (V,); none of a body that is nowhere."""
        if not np.isfinite(around).all():
            return np.zeros(around.shape[1], dtype=bool)
        both = around[1:3]
        box = Window.around(both[..., :2].min(axis=(0, 1)), both[..., :2].max(axis=(0, 1)), self._cell_size)
        terrain = self._undisturbed.heights(box)
        over = both[..., 2] - terrain[box.cells_under(both[..., 0], both[..., 1], self._cell_size)]
        low: Mask = (over < self._highest).any(axis=0)
        return low

    def drawn(self, step: CarvedStep, around: Array, low: Mask, triangles: Indices) -> Drawn | None:
        """A part of a body over a frame, from its vertices (4, V, 3) around it, and which are low; None if none are."""
        triangles = triangles[np.logical_or.reduce([low[corners] for corners in triangles.T])]
        if not len(triangles):
            return None
        used, triangles = _numbered(triangles, around.shape[1])
        around = around[:, used]
        way = (around[2] - around[1])[:, :2]
        distance = np.hypot(*way.T) * low[used]
        needed = np.ceil(np.clip(distance / step.spacing, 1.0, MOST_POSES)).astype(np.int8)
        of_triangle = np.maximum.reduce([needed[corners] for corners in triangles.T])
        poses = int(needed.max())
        between = cubic(np.eye(4), 1.0 + np.arange(1, poses + 1) / poses)
        places = (between @ around.reshape(4, -1)).reshape(-1, 3)
        corners = []
        for number in np.flatnonzero(np.bincount(of_triangle)).tolist():
            part = triangles[of_triangle == number]
            corners += [part + len(used) * (-(-poses * pose // number) - 1) for pose in range(1, number + 1)]
        low_corner, high_corner = (np.array([end(along) for along in places[:, :2].T]) for end in (np.min, np.max))
        window = Window.around(low_corner, high_corner, self._cell_size).expanded(self._margin)
        origin = (np.array((window.column, window.row)) + 0.5) * self._cell_size
        shape = window.rows, window.columns
        underside = lowest_surface(places, np.concatenate(corners), origin, shape, self._cell_size)
        return Drawn(step, window, underside, way[distance.argmax()])

    def carve(self, part: Drawn, parts: Sequence[Drawn], frame: float) -> None:
        """Cut the ground to one of the parts that are drawn of bodies."""
        window, walls = part.window, part.step.walls
        cells, channels = self._read(window)
        bodies = _lowest(parts, window)
        again = 1.0 - (1.0 - walls.packing) ** (1.0 / self._frames_to_push)
        cells.cut(np.maximum(part.underside, channels[2]), part.way, walls.packing, bodies, again=again)
        if round(frame) % self._slides_every == 0:
            cells.slide(walls, bodies < cells.surface + self._cell_size, (window.row, window.column), SWEEPS)
        self._write(part.step, window, cells, channels, frame)

    def leave(self, step: CarvedStep) -> None:
        """Let what a step has carved come to rest from now on."""
        if not step.at_rest and step.recorder.frames:
            self._settling[step] = self._frames_to_rest

    def settle(self, parts: Sequence[Drawn], frame: float) -> None:
        """Let what steps have carved slide on around the parts of bodies; at the end, all of it is recorded."""
        for step, frames in list(self._settling.items()):
            holds = step.walls.strength > 0
            sweeps = SWEEPS_TO_SETTLE if holds else SWEEPS_TO_REST
            window = step.recorder.window
            cells, _ = self._read(window)
            window = window.expanded(step.walls.reach(cells.surface, cells.loose, self._cell_size))
            cells, channels = self._read(window)
            if not holds and frames == self._frames_to_rest:
                cells.gather(channels[7] * QUANTUM, THIN)  # then its edges slide as well
            body = _lowest(parts, window) < cells.surface + self._cell_size
            cells.slide(step.walls, body, (window.row, window.column), ceil(sweeps / self._frames_to_rest))
            if holds and frames == 1:
                cells.gather(channels[7] * QUANTUM, THIN)
            if frames == 1:
                del self._settling[step]
            else:
                self._settling[step] = frames - 1
            self._write(step, window, cells, channels, frame, 1 if frames == 1 else LEAST)

    def finish(self, step: CarvedStep, frame: float) -> None:
        """Record all of what a step has carved by the last frame."""
        if not step.at_rest and step.recorder.frames:
            window = step.recorder.window.expanded(self._margin)
            self._write(step, window, *self._read(window), frame, 1)

    def footprint(self, step: CarvedStep) -> Footprint:
        """What a step has carved."""
        footprint, area = step.footprint, self._cell_size**2
        frames = step.recorder.frames
        return step.recorder.footprint(
            character=footprint.character,
            sole=footprint.sole,
            start_frame=min(frames),
            end_frame=max(frames),
            position=footprint.position,
            heading=footprint.heading,
            area_m2=0.0,
            peak_force_n=0.0,
            compressed_m3=step.cut * area,
            rim_m3=(step.cut - step.packed - step.unplaced) * area,
            unplaced_rim_m3=step.unplaced * area,
            load_frames=np.zeros(0),
            load_n=np.zeros(0),
        )

    def _read(self, window: Window) -> tuple[CarvedCells, Array]:
        """The cells of a window, and their channels."""
        channels = self._cells.read(window)
        contact = np.zeros((window.rows, window.columns), dtype=bool)
        for around, touching in self._contacts:
            if (shared := around.intersection(window)) is not None:
                contact[window.slices(shared)] |= touching[around.slices(shared)]
        terrain, bears, _, pressed, lowest, loose, _, _ = channels
        return CarvedCells(self._cell_size, terrain, bears == 0, contact, pressed, lowest, loose), channels

    def _write(
        self, step: CarvedStep, window: Window, cells: CarvedCells, channels: Array, frame: float, least: int = LEAST
    ) -> None:
        """Write cells back, and record their changes that come to the least [QUANTUM]."""
        step.at_rest = least == 1
        step.cut += cells.cut_height
        step.packed += cells.packed
        step.unplaced += cells.unplaced
        self._highest = max(self._highest, float((cells.surface - cells.terrain).max()))
        carved = np.stack([np.maximum(cells.pressed - cells.lowest, 0.0), cells.loose])
        change = quantised(carved) - channels[6:].astype(np.int64)
        counts = (np.abs(change) >= least).any(axis=0)
        change *= counts
        channels[3:6] = cells.pressed, cells.lowest, cells.loose
        channels[6:] += change
        self._cells.write(window, channels)
        rows, columns = (np.flatnonzero(counts.any(axis=axis)) for axis in (1, 0))
        if not len(rows):
            return
        part = Window(
            window.column + int(columns[0]), window.row + int(rows[0]), int(np.ptp(columns)) + 1, int(np.ptp(rows)) + 1
        )
        change = change[:, *window.slices(part)]
        step.recorder.add(frame, part, change, np.zeros(change.shape[1:], bool))
