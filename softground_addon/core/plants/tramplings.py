"""Where and when soles trample the ground: passes over small cells, from the record of footprints."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ..ground.sparse_grid import Window
from ..record.footprints import Footprint
from .bending import Pass, lasting_of

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

CELL = 0.025
"""Side of a cell, about: a whole number of those of the bake [m]."""
BESIDE = 0.05
"""How far beside a sole blades are pushed aside by the shoe [m]."""
ASIDE = 40.0 / 90.0
"""Bend of those right beside it, in right angles."""
SLOWEST = 0.5
"""Least speed at which a sole comes down on plants and leaves them [m/s]."""
TALLEST = 1.5
"""Height above which soles bend nothing [m]."""
HEADS_ON = 0.01
"""Travel along its heading that a sole has beside what it moves while it touches down [m]."""
FRAMES_PER_SECOND = 24.0
"""Of footprints that were edited, which do not know."""
LIFTED = 0.015
"""Height above its lowest from which on a piece of a sole has left a place [m]."""
LOOKS_BACK = 2
"""Steps of a contact over which the sole's movement is taken."""
RIM, LEAST_CHANGE = 0.2, 2e-4
"""How far beside a sole litter moves with the ground, and from which change of its height on [m]."""
TILE, MOST_TILES = 16, 1_000_000
"""Cells along the side of a tile, and tiles of the whole map, beyond which they are larger."""

SWING = 0.04
"""Height at which a foot passes the ground on its way to the next step [m]."""
PASSING = 3.0
"""Speed at which it comes over a place and leaves it again [m/s]."""
FASTEST, LONGEST = 4.0, 3.0
"""Speed and length of a swing, beyond which a foot is far above the ground [m/s, m]."""

_OF_PASS = tuple(field.name for field in fields(Pass))
_COLUMNS = (*_OF_PASS, "x", "y", "sink", "slope_x", "slope_y")


@dataclass(frozen=True)
class Tramplings:
    """Passes over cells, which are found by tiles.

    Attributes
    ----------
    cell_size : float
        [m]
    origin : (2,) float array
        Lower corner of the first cell [m].
    tile : int
        Cells along the side of a tile.
    tiles : (rows, columns) int array
        First of the slots of each tile; tiles at the edge of the map are empty.
    first : (S + 1,) int array
        First pass of each slot, a cell of a tile; those of a slot follow each other in time.
    active : (P,) float array
        Scene frame from which on each pass may act; within a slot they ascend.
    by : Pass
        Of arrays (P,).
    direction : (P, 2) float array
        Unit vectors in which blades lean.
    sink, slope : (P,) and (P, 2) float arrays
        Change of the ground's height at the middle of the cell after the pass [m], and its slope.
    """

    cell_size: float
    origin: Array
    tile: int
    tiles: Indices
    first: Indices
    active: Array
    by: Pass
    direction: Array
    sink: Array
    slope: Array

    def latest(self, x: Array, y: Array, frame: float = np.inf) -> Indices:
        """Number of the latest pass over places (N,) [m] that acts at a frame; -1 without any."""
        side = self.tile
        rows, columns = self.tiles.shape
        column = np.clip((np.asarray(x) - self.origin[0]) // self.cell_size, 0, columns * side - 1).astype(np.int64)
        row = np.clip((np.asarray(y) - self.origin[1]) // self.cell_size, 0, rows * side - 1).astype(np.int64)
        slot = self.tiles[row // side, column // side] + row % side * side + column % side
        before = np.concatenate([[0], np.cumsum(self.active <= frame)])
        begun = before[self.first[slot + 1]] - before[self.first[slot]]
        return np.where(begun > 0, self.first[slot] + begun - 1, -1)


def tramplings(footprints: Iterable[Footprint]) -> Tramplings | None:
    """Passes of the soles that left footprints; None without any.

    Parameters
    ----------
    footprints : iterable of Footprint
    """
    steps = sorted((step for step in footprints if len(step.contact_cells)), key=lambda step: step.start_frame)
    if not steps:
        return None
    fine = steps[0].cell_size
    side = fine * max(1, round(CELL / fine))
    parts = [*(_passes(step, side) for step in steps), *_swings(steps, side)]
    cells = np.concatenate([part[0] for part in parts])
    table = {name: np.concatenate([part[1][name] for part in parts]) for name in _COLUMNS}
    origin, tile, tiles, slot = _tiled(cells)
    order = np.lexsort((table["start"], slot))
    slot, table = slot[order], {name: values[order] for name, values in table.items()}
    kept, table = _in_turn(slot, table)
    slot = slot[kept]
    first = np.concatenate([[0], np.cumsum(np.bincount(slot, minlength=int(tiles.max()) + tile**2))])
    is_next = np.concatenate([[False], slot[1:] == slot[:-1]])
    active = table["start"] - TALLEST / table["down"]
    active[is_next] = np.maximum(active[is_next], table["start"][:-1][is_next[1:]])
    return Tramplings(
        side,
        origin * side,
        tile,
        tiles,
        first,
        active,
        Pass(*(table[name] for name in _OF_PASS)),
        np.column_stack([table["x"], table["y"]]),
        table["sink"],
        np.column_stack([table["slope_x"], table["slope_y"]]),
    )


def _tiled(cells: Indices) -> tuple[Indices, int, Indices, Indices]:
    """Cell at the map's corner, side of a tile, the map, and the slot of each cell (N, 2) of column and row.

    The first tile of the slots is empty: that of all places without a pass.
    """
    tile = TILE
    while np.prod(np.ptp(cells // tile, axis=0) + 3.0) > MOST_TILES:
        tile *= 2
    corner = (cells // tile).min(axis=0) - 1
    columns, rows = np.ptp(cells // tile, axis=0) + 3
    cells = cells - corner * tile
    of_tile = cells[:, 1] // tile * columns + cells[:, 0] // tile
    known = np.unique(of_tile)
    tiles = np.zeros(rows * columns, np.int64)
    tiles[known] = np.arange(1, len(known) + 1) * tile**2
    slot = tiles[of_tile] + cells[:, 1] % tile * tile + cells[:, 0] % tile
    return corner * tile, tile, tiles.reshape(rows, columns), slot


def _in_turn(slot: Indices, table: dict[str, Array]) -> tuple[Indices, dict[str, Array]]:
    """Passes that act, with what they and all before them over their cell add up to.

    Where a sole has trodden, only soles act on; what later ones do beside them to the height comes with these.
    """
    begins = np.flatnonzero(np.concatenate([[True], slot[1:] != slot[:-1]]))
    of_slot = np.repeat(np.arange(len(begins)), np.diff(np.append(begins, len(slot))))

    def summed(values: Array) -> Array:
        sums = np.cumsum(values)
        return np.asarray(sums - (sums[begins] - values[begins])[of_slot])

    trodden = summed(table["passes"])
    kept = np.flatnonzero((table["passes"] > 0) | (trodden == 0))
    last = np.append(kept[1:], len(slot)) - 1
    result = {name: values[kept] for name, values in table.items()}
    for name in ("lasting", "passes"):
        result[name] = summed(table[name])[kept]
    for name in ("sink", "slope_x", "slope_y"):
        result[name] = summed(table[name])[last]
    return kept, result


def _passes(step: Footprint, side: float) -> tuple[Indices, dict[str, Array]]:
    """Cells (N, 2) that a step acts on, and what it does to each."""
    window = Window.around(*step.window.corners(step.cell_size), side).expanded(int(np.ceil(BESIDE / side)))
    x, y = (values.ravel() for values in np.meshgrid(*step.window.centres(step.cell_size)))
    row, column = window.cells_under(x, y, side)
    coarse = row * window.columns + column

    touched = coarse[step.contact_cells]
    start, end = np.full(window.cells, np.inf), np.full(window.cells, -np.inf)
    np.minimum.at(start, touched, step.contact_start[:])
    np.maximum.at(end, touched, step.contact_end[:])
    change = (step.tile(step.rim) - step.tile(step.compression)).ravel()
    count = np.bincount(coarse, minlength=window.cells)
    sink = np.bincount(coarse, change, window.cells) / np.maximum(count, 1)
    shape = (window.rows, window.columns)
    slope_y, slope_x = (values.ravel() for values in np.gradient(sink.reshape(shape), side))

    under = np.flatnonzero(np.isfinite(start))
    centre = np.stack([values.ravel() for values in np.meshgrid(*window.centres(side))], axis=1)
    owner = _nearest(np.isfinite(start).reshape(shape), int(np.ceil(max(BESIDE, RIM) / side))).ravel()
    gap = np.linalg.norm(centre - centre[owner], axis=1) - 0.5 * side
    acted = (gap < BESIDE) | (np.abs(sink) > LEAST_CHANGE)
    others = np.flatnonzero(~np.isfinite(start) & (owner >= 0) & acted)
    gap = gap[others]

    movement = _movement(step, centre[under], start[under], end[under])
    outward = centre[others] - centre[owner[others]]
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    cell = np.concatenate([under, others])
    source = np.searchsorted(under, owner[cell])
    is_under = np.arange(len(cell)) < len(under)
    direction = np.concatenate([movement.along, outward])
    table = {
        "start": start[under][source],
        "end": movement.end[source],
        "down": movement.down[source],
        "up": movement.up[source],
        "reach": np.concatenate([np.ones(len(under)), ASIDE * np.clip(1.0 - gap / BESIDE, 0.0, 1.0)]),
        "lasting": is_under * lasting_of(step.peak_force_n / max(step.area_m2, side**2)),
        "passes": is_under.astype(float),
        "above": np.zeros(len(cell)),
        "x": direction[:, 0],
        "y": direction[:, 1],
        "sink": sink[cell],
        "slope_x": slope_x[cell],
        "slope_y": slope_y[cell],
    }
    row, column = np.divmod(cell, window.columns)
    return np.stack([column + window.column, row + window.row], axis=1).astype(np.int64), table


def _nearest(marked: NDArray[np.bool_], rings: int) -> Indices:
    """Number of the marked cell that is nearest to each, about; -1 of cells that are further than some rings."""
    rows, columns = marked.shape
    number = np.arange(marked.size).reshape(rows, columns)
    row, column = np.mgrid[:rows, :columns]
    owner = np.where(marked, number, -1)
    best = np.where(marked, 0, np.iinfo(np.int64).max)
    for _ in range(rings):
        padded = np.pad(owner, 1, constant_values=-1)
        for down, right in ((i, j) for i in range(3) for j in range(3) if (i, j) != (1, 1)):
            other = padded[down : down + rows, right : right + columns]
            apart = (row - other // columns) ** 2 + (column - other % columns) ** 2
            nearer = (other >= 0) & (apart < best)
            owner, best = np.where(nearer, other, owner), np.where(nearer, apart, best)
    return owner


def _swings(steps: Sequence[Footprint], side: float) -> Iterator[tuple[Indices, dict[str, Array]]]:
    """What soles brush on their way from each print to their next one, as `_passes` has it."""
    latest: dict[tuple[str, str], Footprint] = {}
    for step in steps:
        before = latest.get((step.character, step.sole))
        latest[step.character, step.sole] = step
        if before is None or step.start_frame <= before.end_frame:
            continue
        way = step.position[:2] - before.position[:2]
        length, frames = float(np.hypot(*way)), step.start_frame - before.end_frame
        second = _frames_per_second(step)
        if not side < length < min(LONGEST, FASTEST * frames / second):
            continue
        ahead = way / length
        half_length, half_width = _half_sizes(before, ahead)
        ends = np.array((before.position[:2], step.position[:2]))
        window = Window.around(ends.min(axis=0) - half_width, ends.max(axis=0) + half_width, side)
        place = np.stack([values.ravel() for values in np.meshgrid(*window.centres(side))], axis=1)
        along, across = (place - ends[0]) @ ahead, (place - ends[0]) @ (-ahead[1], ahead[0])
        passed = np.flatnonzero((along > 0.0) & (along < length) & (np.abs(across) < half_width))
        share = np.linspace(0.0, 1.0, 65)
        travel = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)  # of minimum jerk
        when = [
            before.end_frame + frames * np.interp((along[passed] + part) / length, travel, share)
            for part in (-half_length, half_length)
        ]
        constants = {"down": PASSING / second, "up": PASSING / second, "reach": 1.0, "above": SWING}
        table = {name: np.full(len(passed), constants.get(name, 0.0)) for name in _COLUMNS}
        table |= {"start": when[0], "end": when[1]}
        table |= {name: np.full(len(passed), part) for name, part in zip("xy", ahead, strict=True)}
        row, column = np.divmod(passed, window.columns)
        yield np.stack([column + window.column, row + window.row], axis=1).astype(np.int64), table


def _half_sizes(step: Footprint, ahead: Array) -> tuple[float, float]:
    """Half of a print's length and width along and across a direction [m]."""
    x, y = (values.ravel()[step.contact_cells] for values in np.meshgrid(*step.window.centres(step.cell_size)))
    return 0.5 * float(np.ptp(x * ahead[0] + y * ahead[1])), 0.5 * float(np.ptp(y * ahead[0] - x * ahead[1]))


def _frames_per_second(step: Footprint) -> float:
    by = step.pressed_by
    return step.load_spacing / by.time_step if by else FRAMES_PER_SECOND


@dataclass(frozen=True)
class _Movement:
    """A sole over places: its travel, unit vectors (N, 2), speeds [m per frame] and the frames it stays to."""

    along: Array
    down: Array
    up: Array
    end: Array


def _movement(step: Footprint, place: Array, start: Array, end: Array) -> _Movement:
    """Movement of the sole over places (N, 2) that it touches from one frame to another, (N,) each.

    It stays until it has left the place by `LIFTED`: the arch of a foot hardly touches, and lies over plants too.
    """
    heading = np.array((np.cos(step.heading), np.sin(step.heading)))
    if step.pressed_by is None:  # of a print that was edited
        slow = np.full(len(place), SLOWEST / FRAMES_PER_SECOND)
        return _Movement(np.tile(heading, (len(place), 1)), slow, slow, end)
    frames = np.asarray(step.load_frames)
    steps = step.pressed_by.steps(frames)
    poses, before = np.concatenate([steps.approach, steps.poses]), len(steps.approach)
    slowest, last, each = SLOWEST * step.pressed_by.time_step, len(poses) - 1, np.arange(len(place))
    came = before + np.clip(np.searchsorted(frames, start), 0, last - before)
    point = np.column_stack([place, np.full(len(place), step.position[2])])
    patch = _patch_over(step, poses, came, point)
    there, earlier = poses[came, patch], np.maximum(came - LOOKS_BACK, 0)
    local = np.ones((len(place), 4))  # of what touches there, in its patch
    local[:, :3] = np.einsum("nji,nj->ni", there[:, :3, :3], point - there[:, :3, 3])
    way = point - np.einsum("nij,nj->ni", poses[earlier, patch], local)[:, :3]
    along = way[:, :2] + HEADS_ON * heading
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    down = np.maximum(-way[:, 2] / np.maximum(came - earlier, 1), slowest)
    height = np.empty((len(poses), len(place)))
    for number in range(poses.shape[1]):
        height[:, patch == number] = poses[:, number, 2] @ local[patch == number].T
    is_low = height <= height[before:].min(axis=0) + LIFTED
    left = last - is_low[::-1].argmax(axis=0)
    later, at = np.minimum(left + LOOKS_BACK, last), np.minimum(left, np.maximum(last - 1, 0))
    rise = (height[later, each] - height[at, each]) / np.maximum(later - at, 1)
    stays = np.maximum(end, frames[np.maximum(left - before, 0)])
    return _Movement(along, down / step.load_spacing, np.maximum(rise, slowest) / step.load_spacing, stays)


def _patch_over(step: Footprint, poses: Array, at: Indices, point: Array) -> Indices:
    """Number of the sole's patch whose middle is nearest to each point at its time."""
    assert step.pressed_by is not None
    middles = np.zeros((poses.shape[1], 3))
    for number, patch in enumerate(step.pressed_by.pressing.sole.patches):
        middles[number, :2] = patch.origin + 0.5 * patch.spacing * (np.array(patch.heights.shape[::-1]) - 1)
    placed = np.einsum("npij,pj->npi", poses[at][..., :3, :3], middles) + poses[at][..., :3, 3]
    return np.linalg.norm(placed - point[:, None], axis=2).argmin(axis=1)
