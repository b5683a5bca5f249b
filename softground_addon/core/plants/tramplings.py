"""Where and when soles trample the ground: passes over small cells, from the record of footprints."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ground.sparse_grid import Window
from ..record.footprints import Footprint
from .bending import Pass, lasting_of

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

CELL = 0.025
"""Side of a cell, unless the bake's are larger [m]."""
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
LOOKS_BACK = 2
"""Steps of a contact over which the sole's movement is taken."""
LEAST_CHANGE = 2e-4
"""Change of height beside prints from which on litter moves with the ground [m]."""
TILE, MOST_TILES = 16, 1_000_000
"""Cells along the side of a tile, and tiles of the whole map, beyond which they are larger."""

_COLUMNS = ("start", "end", "down", "up", "reach", "lasting", "passes", "x", "y", "sink", "slope_x", "slope_y")


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
    side = max(CELL, *(step.cell_size for step in steps))
    parts = [_passes(step, side) for step in steps]
    cells = np.concatenate([part[0] for part in parts])
    table = {name: np.concatenate([part[1][name] for part in parts]) for name in _COLUMNS}
    origin, tile, tiles, slot = _tiled(cells)
    order = np.lexsort((table["start"], slot))
    slot, table = slot[order], {name: values[order] for name, values in table.items()}
    kept, table = _in_turn(slot, table)
    slot = slot[kept]
    first = np.concatenate([[0], np.cumsum(np.bincount(slot, minlength=(len(np.unique(tiles))) * tile**2))])
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
        Pass(*(table[name] for name in _COLUMNS[:7])),
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
    known, number = np.unique(of_tile, return_inverse=True)
    tiles = np.zeros(rows * columns, np.int64)
    tiles[known] = (1 + np.arange(len(known))) * tile**2
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
    others = np.setdiff1d(np.arange(window.cells), under)
    apart = np.linalg.norm(centre[others, None] - centre[under], axis=2)
    nearest, gap = apart.argmin(axis=1), apart.min(axis=1) - 0.5 * side
    acted = (gap < BESIDE) | (np.abs(sink[others]) > LEAST_CHANGE)
    others, nearest, gap = others[acted], nearest[acted], gap[acted]

    along, down, up = _movement(step, centre[under], start[under], end[under])
    outward = centre[others] - centre[under][nearest]
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    source, cell = np.concatenate([np.arange(len(under)), nearest]), np.concatenate([under, others])
    is_under = np.arange(len(cell)) < len(under)
    direction = np.concatenate([along, outward])
    table = {
        "start": start[under][source],
        "end": end[under][source],
        "down": down[source],
        "up": up[source],
        "reach": np.concatenate([np.ones(len(under)), ASIDE * np.clip(1.0 - gap / BESIDE, 0.0, 1.0)]),
        "lasting": is_under * lasting_of(step.peak_force_n / max(step.area_m2, side**2)),
        "passes": is_under.astype(float),
        "x": direction[:, 0],
        "y": direction[:, 1],
        "sink": sink[cell],
        "slope_x": slope_x[cell],
        "slope_y": slope_y[cell],
    }
    row, column = np.divmod(cell, window.columns)
    return np.stack([column + window.column, row + window.row], axis=1).astype(np.int64), table


def _movement(step: Footprint, place: Array, start: Array, end: Array) -> tuple[Array, Array, Array]:
    """Where the sole travels as it presses on places (N, 2), unit vectors (N, 2), and how fast it comes down and leaves.

    Speeds are in metres per frame.
    """
    heading = np.array((np.cos(step.heading), np.sin(step.heading)))
    if step.pressed_by is None:  # edited by an artist: it is put down, and lifted again, in a second per metre
        slow = SLOWEST / _FRAMES_PER_SECOND
        return np.tile(heading, (len(place), 1)), np.full(len(place), slow), np.full(len(place), slow)
    steps = step.pressed_by.steps(np.asarray(step.load_frames))
    poses, before = np.concatenate([steps.approach, steps.poses]), len(steps.approach)
    slow = SLOWEST * step.pressed_by.time_step
    point = np.column_stack([place, np.full(len(place), step.position[2])])
    last = len(poses) - 1
    came = before + np.clip(np.searchsorted(step.load_frames, start), 0, last - before)
    left = before + np.clip(np.searchsorted(step.load_frames, end), 0, last - before)
    patch = _patch_over(step, poses, came, point)

    def moved(at: Indices, to: Indices) -> Array:
        """Way of the piece of the sole that is on each place at one step, to another step."""
        here, there = poses[at, patch], poses[to, patch]
        local = np.einsum("nji,nj->ni", here[:, :3, :3], point - here[:, :3, 3])
        way: Array = np.einsum("nij,nj->ni", there[:, :3, :3], local) + there[:, :3, 3] - point
        return way

    earlier = np.maximum(came - LOOKS_BACK, 0)
    way = -moved(came, earlier)
    along = way[:, :2] + HEADS_ON * heading
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    down = np.maximum(-way[:, 2] / np.maximum(came - earlier, 1), slow)
    later = np.minimum(left + LOOKS_BACK, last)
    rise = np.where(later > left, moved(left, later)[:, 2], -moved(left, np.maximum(left - 1, 0))[:, 2])
    up = np.maximum(rise / np.maximum(later - left, 1), slow)
    return along, down / step.load_spacing, up / step.load_spacing


_FRAMES_PER_SECOND = 24.0
"""Where a step does not know."""


def _patch_over(step: Footprint, poses: Array, at: Indices, point: Array) -> Indices:
    """Number of the sole's patch whose middle is nearest to each point at its time."""
    assert step.pressed_by is not None
    middles = np.zeros((poses.shape[1], 3))
    for number, patch in enumerate(step.pressed_by.pressing.sole.patches):
        middles[number, :2] = patch.origin + 0.5 * patch.spacing * (np.array(patch.heights.shape[::-1]) - 1)
    placed = np.einsum("npij,pj->npi", poses[at][..., :3, :3], middles) + poses[at][..., :3, 3]
    return np.linalg.norm(placed - point[:, None], axis=2).argmin(axis=1)
