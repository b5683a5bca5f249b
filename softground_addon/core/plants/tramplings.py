"""Where and when soles trample the ground: passes over small cells, from the record of footprints."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array
from ..numerics.slices import Slices, sliced
from ..record.footprints import Footprint
from .bending import Pass
from .sole_passes import COLUMNS, OF_PASS, passes_of
from .swings import swings

Indices = NDArray[np.int64]

CELL = 0.025
"""Side of a cell, about: a whole number of those of the bake [m]."""
TALLEST = 1.5
"""Height above which soles bend nothing [m]."""
TILE, MOST_TILES = 16, 1_000_000
"""Cells along the side of a tile, and tiles of the whole map, beyond which they are larger."""
SHUTTER = 0.5
"""Frames before the first of a shot from which on plants give way to feet that stand there: motion blur shows them."""


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
    settled : (P,) float array
        Scene frame from which on they do not change any more, about.
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
    settled: Array

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


def side_of(fine: float) -> float:
    """Side of a cell [m], from that of a cell of the bake; from its own side the same.

    Examples
    --------
    >>> side_of(0.01), side_of(side_of(0.01)), side_of(0.004)
    (0.02, 0.02, 0.024)
    """
    return fine * max(1, round(CELL / fine))


@sliced
def tramplings(footprints: Iterable[Footprint]) -> Slices[Tramplings | None]:
    """Passes of the soles that left footprints; None without any."""
    steps = sorted((step for step in footprints if len(step.contact_cells)), key=lambda step: step.start_frame)
    if not steps:
        return None
    side = side_of(steps[0].cell_size)
    parts = []
    for step in steps:
        parts.append(passes_of(step, side))
        yield
    for part in swings(steps, side):
        parts.append(part)
        yield
    cells = np.concatenate([part[0] for part in parts])
    table = {name: np.concatenate([part[1][name] for part in parts]) for name in COLUMNS}
    origin, tile, tiles, slot = _tiled(cells)
    order = np.lexsort((table["start"], slot))
    slot, table = slot[order], {name: values[order] for name, values in table.items()}
    chosen, table = _in_turn(slot, table)
    slot = slot[chosen]
    first = np.concatenate([[0], np.cumsum(np.bincount(slot, minlength=int(tiles.max()) + tile**2))])
    is_next = np.concatenate([[False], slot[1:] == slot[:-1]])
    active = table["start"] - TALLEST / table["down"]
    active[is_next] = np.maximum(active[is_next], table["start"][:-1][is_next[1:]])
    active = np.maximum(active, _first_frame(steps) - SHUTTER)
    return Tramplings(
        side,
        origin * side,
        tile,
        tiles,
        first,
        active,
        Pass(*(table[name] for name in OF_PASS)),
        np.column_stack([table["x"], table["y"]]),
        table["sink"],
        np.column_stack([table["slope_x"], table["slope_y"]]),
        table["settled"],
    )


def _first_frame(steps: Sequence[Footprint]) -> float:
    """First frame of the shot, in which the steps of contacts are numbered."""
    pressed = [(step, step.pressed_by) for step in steps if step.pressed_by is not None]
    return min((step.load_frames[0] - by.first * step.load_spacing for step, by in pressed), default=-np.inf)


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
    taken = np.flatnonzero((table["passes"] > 0) | (trodden == 0))
    last = np.append(taken[1:], len(slot)) - 1
    result = {name: values[taken] for name, values in table.items()}
    for name in ("lasting", "passes"):
        result[name] = summed(table[name])[taken]
    for name in ("sink", "slope_x", "slope_y"):
        result[name] = summed(table[name])[last]
    return taken, result
