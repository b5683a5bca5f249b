"""The ground of a shot as bodies carve it, frame by frame."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, floor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..ground.hard_ground import bare
from ..ground.heightfield import TerrainTiles
from ..ground.soft_ground import SoftGround
from ..ground.sparse_grid import TILE, SampledGrid, Window
from ..ground.variation import VariationTiles
from ..numerics.arrays import Array, Indices, Mask
from ..numerics.interpolation import cubic
from ..numerics.triangles import cross
from ..pressing.repose import SWEEPS_TO_REST
from ..record.footprints import QUANTUM, Footprint, quantised
from ..soles.undersides import lowest_surface
from .carved_step import CarvedStep
from .carver import HIGHEST, REACH, SAMPLES, THICKEST, CarvedCells, Walls

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


class Part(NamedTuple):
    """A part of a body and the step that takes it.

    Attributes
    ----------
    triangles : (T, 3) int array
    sides : (T,) float array
        See `responded_skin.outsides`.
    """

    step: CarvedStep
    triangles: Indices
    sides: Array

    def below(self, around: Array, low: Mask) -> Indices:
        """Triangles (N, 3) that are low, and no upper sides, by the vertices (4, V, 3) around a frame."""
        near = np.logical_or.reduce([low[corners] for corners in self.triangles.T])
        triangles, sides = self.triangles[near], self.sides[near]
        is_above = sides != 0
        for places in around[1:3, :, :2]:
            a, b, c = (places[corners] for corners in triangles.T)
            is_above &= sides * cross(b - a, c - a) > 0
        return triangles[~is_above]


class Drawn(NamedTuple):
    """A body as it passed over a frame, or its parts in ground of one kind.

    Attributes
    ----------
    steps : list of CarvedStep
        That its parts take.
    nearest : (rows, columns) int array
        The part that each cell is nearest to.
    underside : (4, rows, columns) float array
        Lowest surface over the quarters of each cell [m], infinite where there is none.
    way : (2,) float array
        Along x and y, of what moves most [m].
    """

    steps: list[CarvedStep]
    nearest: Indices
    window: Window
    underside: Array
    way: Array


def _lowest(bodies: Sequence[Drawn], window: Window) -> Array:
    """Lowest surface of all bodies over the cells of a window, (rows, columns) [m], infinite where there is none."""
    lowest = np.full((window.rows, window.columns), np.inf)
    for body in bodies:
        if (shared := window.intersection(body.window)) is not None:
            here = window.slices(shared)
            lowest[here] = np.minimum(lowest[here], body.underside[:, *body.window.slices(shared)].min(axis=0))
    return lowest


def _numbered(triangles: Indices, count: int) -> tuple[Indices, Indices]:
    """The vertices of triangles (T, 3), of a count, and the triangles as numbers of these."""
    place = np.zeros(count, dtype=np.intp)
    place[triangles] = 1
    used = np.flatnonzero(place)
    place[used] = np.arange(len(used))
    return used, place[triangles]


def _passed(around: Array, triangles: Indices, needed: Array) -> tuple[Array, Indices]:
    """Places (N, 3) that vertices (4, V, 3) pass from the second to the third of these times [m], and triangles there.

    Each triangle is there as often as those of its vertices need (V,) that move most.
    """
    count = np.ceil(needed).astype(np.int8)
    of_triangle = np.maximum.reduce([count[corners] for corners in triangles.T])
    poses = int(of_triangle.max())
    between = cubic(np.eye(4), 1.0 + np.arange(1, poses + 1) / poses)
    corners = []
    for number in np.flatnonzero(np.bincount(of_triangle)).tolist():
        part = triangles[of_triangle == number]
        corners += [part + len(count) * (-(-poses * pose // number) - 1) for pose in range(1, number + 1)]
    return (between @ around.reshape(4, -1)).reshape(-1, 3), np.concatenate(corners)


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
        self._cells = SampledGrid(self._untouched, cell_size, channels=7 + SAMPLES**2)
        """Terrain, its openness, the layer's floor, T, loose matter, what is recorded of the cut and of this, and K."""
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
        never = [nothing + np.inf] * SAMPLES**2
        return np.stack([terrain, surface.bears, bottom, terrain, nothing, nothing, nothing, *never])

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
            self._write([step], window, cells, channels, frame)
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
        low: Mask = (over < self._highest + HIGHEST).any(axis=0)  # what is laid in this frame heaps up
        return low

    def drawn(self, parts: Sequence[Part], around: Array, low: Mask, walls: Walls) -> Drawn | None:
        """The parts of a body over a frame whose ground stands alike, None if none of them is low.

        From its vertices (4, V, 3) around the frame, and which are low (V,).
        """
        steps, middles, passed, ways = [], [], [], []
        for part in parts:
            step = part.step
            if step.is_deep and step.walls == walls and len(near := part.below(around, low)):
                steps.append(step)
                used, near = _numbered(near, len(low))
                middles.append(around[2, used, :2].mean(axis=0))
                moves = around[:, used]
                way = (moves[2] - moves[1])[:, :2]
                distance = np.hypot(*way.T) * low[used]
                passed.append(_passed(moves, near, np.clip(distance / step.spacing, 1.0, MOST_POSES)))
                ways.append((float(distance.max()), way[distance.argmax()]))
        if not steps:
            return None
        first = np.cumsum([0, *(len(places) for places, _ in passed)])
        places = np.concatenate([places for places, _ in passed])
        triangles = np.concatenate([corners + start for (_, corners), start in zip(passed, first, strict=False)])
        low_corner, high_corner = (np.array([end(along) for along in places[:, :2].T]) for end in (np.min, np.max))
        window = Window.around(low_corner, high_corner, self._cell_size).expanded(self._margin)
        apart = self._cell_size / SAMPLES
        origin = np.array((window.column, window.row)) * self._cell_size + apart / 2
        shape = window.rows * SAMPLES, window.columns * SAMPLES
        underside = lowest_surface(places, triangles, origin, shape, apart)
        of_cells = underside.reshape(window.rows, SAMPLES, window.columns, SAMPLES).transpose(1, 3, 0, 2)
        underside = of_cells.reshape(-1, window.rows, window.columns)
        x, y = window.centres(self._cell_size)
        away = [(x - middle[0]) ** 2 + (y[:, None] - middle[1]) ** 2 for middle in middles]
        return Drawn(steps, np.argmin(away, axis=0), window, underside, max(ways, key=lambda each: each[0])[1])

    def carve(self, body: Drawn, bodies: Sequence[Drawn], frame: float) -> None:
        """Cut the ground to one of the bodies that are drawn."""
        window, walls = body.window, body.steps[0].walls
        cells, channels = self._read(window)
        lowest = _lowest(bodies, window)
        again = 1.0 - (1.0 - walls.packing) ** (1.0 / self._frames_to_push)
        cut = cells.cut(np.maximum(body.underside, channels[2]), body.way, walls.packing, lowest, again=again)
        if round(frame) % self._slides_every == 0:
            cells.slide(walls, lowest < cells.surface + THICKEST, (window.row, window.column), SWEEPS)
        self._write(body.steps, window, cells, channels, frame, nearest=body.nearest, cut=cut)

    def leave(self, step: CarvedStep) -> None:
        """Let what a step has carved come to rest from now on."""
        if not step.at_rest and step.recorder.frames:
            self._settling[step] = self._frames_to_rest

    def settle(self, bodies: Sequence[Drawn], frame: float) -> None:
        """Let what steps have carved slide on around bodies; at the end, all of it is recorded."""
        for step, frames in list(self._settling.items()):
            holds = step.walls.strength > 0
            sweeps = SWEEPS_TO_SETTLE if holds else SWEEPS_TO_REST
            window = step.recorder.window
            cells, _ = self._read(window)
            window = window.expanded(step.walls.reach(cells.surface, cells.loose, self._cell_size))
            cells, channels = self._read(window)
            if not holds and frames == self._frames_to_rest:
                cells.gather(channels[6] * QUANTUM, THIN)  # then its edges slide as well
            body = _lowest(bodies, window) < cells.surface + THICKEST
            cells.slide(step.walls, body, (window.row, window.column), ceil(sweeps / self._frames_to_rest))
            if holds and frames == 1:
                cells.gather(channels[6] * QUANTUM, THIN)
            if frames == 1:
                del self._settling[step]
            else:
                self._settling[step] = frames - 1
            self._write([step], window, cells, channels, frame, 1 if frames == 1 else LEAST)

    def finish(self, step: CarvedStep, frame: float) -> None:
        """Record all of what a step has carved by the last frame."""
        if not step.at_rest and step.recorder.frames:
            window = step.recorder.window.expanded(self._margin)
            self._write([step], window, *self._read(window), frame, 1)

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
            surface=footprint.surface,
        )

    def _read(self, window: Window) -> tuple[CarvedCells, Array]:
        """The cells of a window, and their channels."""
        channels = self._cells.read(window)
        contact = np.zeros((window.rows, window.columns), dtype=bool)
        for around, touching in self._contacts:
            if (shared := around.intersection(window)) is not None:
                contact[window.slices(shared)] |= touching[around.slices(shared)]
        terrain, bears, _, pressed, loose = channels[:5]
        return CarvedCells(self._cell_size, terrain, bears == 0, contact, pressed, channels[7:], loose), channels

    def _write(
        self,
        steps: Sequence[CarvedStep],
        window: Window,
        cells: CarvedCells,
        channels: Array,
        frame: float,
        least: int = LEAST,
        *,
        nearest: Indices | None = None,
        cut: Array | None = None,
    ) -> None:
        """Write cells back, and record their changes that come to the least [QUANTUM], each with the nearest step."""
        self._highest = max(self._highest, float((cells.surface - cells.terrain).max()))
        carved = np.stack([cells.pressed - cells.standing, cells.loose])
        change = quantised(carved) - channels[5:7].astype(np.int64)
        change *= (np.abs(change) >= least).any(axis=0)
        channels[3], channels[4], channels[7:] = cells.pressed, cells.loose, cells.lowest
        channels[5:7] += change
        self._cells.write(window, channels)
        shares = np.ones(len(steps))
        if nearest is not None and cut is not None and cut.any():
            shares = np.bincount(nearest.ravel(), cut.ravel(), len(steps)).astype(float)
        shares = shares / shares.sum()
        for number, (step, share) in enumerate(zip(steps, shares.tolist(), strict=True)):
            step.at_rest = least == 1
            step.cut += share * cells.cut_height
            step.packed += share * cells.packed
            step.unplaced += share * cells.unplaced
            self._record(step, window, change if nearest is None else change * (nearest == number), frame)

    @staticmethod
    def _record(step: CarvedStep, window: Window, change: NDArray[np.int64], frame: float) -> None:
        rows, columns = (np.flatnonzero(change.any(axis=(0, axis))) for axis in (2, 1))
        if not len(rows):
            return
        part = Window(
            window.column + int(columns[0]), window.row + int(rows[0]), int(np.ptp(columns)) + 1, int(np.ptp(rows)) + 1
        )
        change = change[:, *window.slices(part)]
        step.recorder.add(frame, part, change, np.zeros(change.shape[1:], bool))
