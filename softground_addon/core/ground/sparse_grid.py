"""Values on the cells of the ground that anything happens in: tiles that exist where they are written to."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from functools import lru_cache
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..numerics import bilinear
from ..numerics.arrays import Array, Indices, Mask

TILE = 32
"""Cells along a tile's side: a footprint at 1 cm cells touches about four tiles of 16 KB."""

PLACES_AT_ONCE = 1 << 16
"""Places that are looked up together; what it takes for a moment follows this, and not how many there are."""


class Window(NamedTuple):
    """A rectangle of cells: its first column and row, and how many of each."""

    column: int
    row: int
    columns: int
    rows: int

    @classmethod
    def around(cls, low: Array, high: Array, cell_size: float) -> Window:
        """The cells that the box from `low` to `high` (world x, y [m]) reaches into."""
        first = np.floor(np.asarray(low[:2]) / cell_size).astype(int)
        last = np.floor(np.asarray(high[:2]) / cell_size).astype(int)
        return cls(int(first[0]), int(first[1]), int(last[0] - first[0]) + 1, int(last[1] - first[1]) + 1)

    @property
    def cells(self) -> int:
        """Number of cells."""
        return self.columns * self.rows

    def expanded(self, margin: int) -> Window:
        """The window with `margin` more cells on every side."""
        return Window(self.column - margin, self.row - margin, self.columns + 2 * margin, self.rows + 2 * margin)

    def around_cells(self, cells: Mask) -> Window | None:
        """The smallest window that holds those of its cells (rows, columns) that are true; None if none is."""
        rows, columns = (np.flatnonzero(cells.any(axis=axis)) for axis in (1, 0))
        if not len(rows):
            return None
        (first, last), (left, right) = ((int(of[0]), int(of[-1])) for of in (rows, columns))
        return Window(self.column + left, self.row + first, right - left + 1, last - first + 1)

    def cells_under(self, x: Array, y: Array, cell_size: float) -> tuple[Indices, Indices]:
        """Rows and columns within the window of the cells under world positions [m]; beyond it, of the nearest."""
        column = np.floor(x / cell_size).astype(np.intp) - self.column
        row = np.floor(y / cell_size).astype(np.intp) - self.row
        return np.clip(row, 0, self.rows - 1), np.clip(column, 0, self.columns - 1)

    def corners(self, cell_size: float) -> tuple[Array, Array]:
        """Lower and upper corner of its cells in the plane, (2,) each [m]."""
        first, size = np.array((self.column, self.row)), np.array((self.columns, self.rows))
        return first * cell_size, (first + size) * cell_size

    def holds(self, row: Indices, column: Indices) -> Mask:
        """True if cells lie within the window."""
        right, down = column - self.column, row - self.row
        return (right >= 0) & (right < self.columns) & (down >= 0) & (down < self.rows)

    def union(self, other: Window) -> Window:
        """The smallest window that holds both."""
        column, row = min(self.column, other.column), min(self.row, other.row)
        end_column = max(self.column + self.columns, other.column + other.columns)
        end_row = max(self.row + self.rows, other.row + other.rows)
        return Window(column, row, end_column - column, end_row - row)

    def slices(self, part: Window) -> tuple[slice, slice]:
        """Rows and columns that a part of the window takes."""
        row, column = part.row - self.row, part.column - self.column
        return slice(row, row + part.rows), slice(column, column + part.columns)

    def intersection(self, other: Window) -> Window | None:
        """The cells that both hold; None if none."""
        column, row = max(self.column, other.column), max(self.row, other.row)
        columns = min(self.column + self.columns, other.column + other.columns) - column
        rows = min(self.row + self.rows, other.row + other.rows) - row
        return Window(column, row, columns, rows) if columns > 0 and rows > 0 else None

    def intersects(self, other: Window) -> bool:
        """True if the two share a cell."""
        return self.intersection(other) is not None

    def refined(self, factor: int) -> Window:
        """The same rectangle in cells that are `factor` times smaller."""
        return Window(self.column * factor, self.row * factor, self.columns * factor, self.rows * factor)

    def centres(self, cell_size: float) -> tuple[Array, Array]:
        """World x of the columns' centres (columns,) and y of the rows' centres (rows,) [m]."""
        return (
            (self.column + 0.5 + np.arange(self.columns)) * cell_size,
            (self.row + 0.5 + np.arange(self.rows)) * cell_size,
        )


class SparseGrid:
    """Values per cell over an endless plane, in square tiles that are made on demand.

    Parameters
    ----------
    cell_size : float
        Side of a cell [m].
    channels : int
        Number of values per cell.
    fill : float
        Value of cells that were never written.

    Raises
    ------
    InputError
        If the cell size is not a positive number.
    """

    def __init__(self, cell_size: float, *, channels: int, fill: float = 0.0) -> None:
        if not (np.isfinite(cell_size) and cell_size > 0):
            raise InputError(f"The cell size is {cell_size!r} m: set it to a positive length.", "cell_size")
        self.cell_size = float(cell_size)
        self.channels = channels
        self.fill = fill
        self.tiles: dict[tuple[int, int], Array] = {}

    def copy(self) -> Self:
        """The same values, to be worked on apart."""
        twin = copy(self)
        twin.tiles = {key: tile.copy() for key, tile in self.tiles.items()}
        return twin

    def tile_windows(self) -> list[Window]:
        """The windows of all tiles, in the order of their place."""
        return [Window(column * TILE, row * TILE, TILE, TILE) for column, row in sorted(self.tiles)]

    def read(self, window: Window) -> Array:
        """A copy of the values of a window, (channels, rows, columns)."""
        values = np.full((self.channels, window.rows, window.columns), self.fill)
        for key, in_tile, in_window in overlaps(window):
            tile = self.tiles.get(key)
            if tile is not None:
                values[in_window] = tile[in_tile]
        return values

    def write(self, window: Window, values: Array) -> None:
        """Set the values of a window, (channels, rows, columns). Tiles that would stay untouched are not made."""
        for key, in_tile, in_window in overlaps(window):
            tile = self.tiles.get(key)
            if tile is None:
                if not (values[in_window] != self.fill).any():
                    continue
                tile = self.tiles[key] = np.full((self.channels, TILE, TILE), self.fill)
            tile[in_tile] = values[in_window]

    def sample(self, x: Array, y: Array) -> Array:
        """Values at world positions of any shape, bilinear between cell centres: (channels, ...)."""
        return self._in_parts(self._between, x, y)

    def _in_parts(self, look_up: Callable[[Array, Array], Array], x: Array, y: Array) -> Array:
        x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        values = np.empty((self.channels, x.size))
        for first in range(0, x.size, PLACES_AT_ONCE):
            part = slice(first, first + PLACES_AT_ONCE)
            values[:, part] = look_up(x.ravel()[part], y.ravel()[part])
        return values.reshape(self.channels, *x.shape)

    def _between(self, x: Array, y: Array) -> Array:
        column, row = x / self.cell_size - 0.5, y / self.cell_size - 0.5
        left, low = np.floor(column), np.floor(row)
        u, v = column - left, row - low
        left, low = left.astype(int), low.astype(int)
        around = self._gather(np.concatenate([left, left + 1] * 2), np.concatenate([low, low, low + 1, low + 1]))
        return bilinear.between(np.split(around, 4, axis=1), u, v)

    def nearest(self, x: Array, y: Array) -> Array:
        """Values of the cells that hold the world positions of any shape: (channels, ...)."""
        return self._in_parts(self._holding, x, y)

    def _holding(self, x: Array, y: Array) -> Array:
        column, row = np.floor(x / self.cell_size), np.floor(y / self.cell_size)
        return self._gather(column.astype(int), row.astype(int))

    def _gather(self, column: NDArray[np.intp], row: NDArray[np.intp]) -> Array:
        """Values of single cells, (channels, N)."""
        if not self.tiles or not column.size:
            return np.full((self.channels, column.size), self.fill)
        keys = sorted(self.tiles)
        slot_of = np.array(keys)
        first = slot_of.min(axis=0)
        columns, rows = (slot_of.max(axis=0) - first + 1).tolist()
        order = (slot_of - first) @ (rows, 1)
        tile_column, tile_row = column // TILE - first[0], row // TILE - first[1]
        inside = (tile_column >= 0) & (tile_column < columns) & (tile_row >= 0) & (tile_row < rows)
        known = np.flatnonzero(inside)
        wanted = tile_column[known] * rows + tile_row[known]
        slot = np.minimum(np.searchsorted(order, wanted), len(keys) - 1)
        held = order[slot] == wanted
        known, slot = known[held], slot[held]
        values = np.full((self.channels, column.size), self.fill)
        used = np.zeros(len(keys), dtype=bool)
        used[slot] = True
        if used.any():
            stack = np.stack([self.tiles[keys[number]] for number in np.flatnonzero(used).tolist()], axis=1)
            place = ((np.cumsum(used) - 1)[slot] * TILE + row[known] % TILE) * TILE + column[known] % TILE
            values[:, known] = stack.reshape(self.channels, -1).take(place, axis=1)
        return values


def side_by_side(grids: Sequence[SparseGrid]) -> SparseGrid:
    """The channels of grids of one cell size, in one grid, where they are looked up together; 0 where nothing is."""
    first = np.cumsum([0, *(grid.channels for grid in grids)]).tolist()
    together = SparseGrid(grids[0].cell_size, channels=first[-1])
    for grid, channel in zip(grids, first, strict=False):
        for key, tile in grid.tiles.items():
            if key not in together.tiles:
                together.tiles[key] = np.zeros((together.channels, TILE, TILE))
            together.tiles[key][channel : channel + grid.channels] = tile
    return together


class SampledGrid(SparseGrid):
    """A function of place at cell centres, looked up once per tile.

    Parameters
    ----------
    sample : callable
        Values (channels, ...) at world positions x and y [m] of any one shape.
    cell_size : float
        Side of a cell [m].
    channels : int
        Number of values per cell.
    """

    def __init__(self, sample: Callable[[Array, Array], Array], cell_size: float, *, channels: int) -> None:
        super().__init__(cell_size, channels=channels)
        self._sample = sample

    def read(self, window: Window) -> Array:
        """A copy of the values of a window, (channels, rows, columns)."""
        values = np.empty((self.channels, window.rows, window.columns))
        for key, in_tile, in_window in overlaps(window):
            values[in_window] = self._tile(key)[in_tile]
        return values

    def write(self, window: Window, values: Array) -> None:
        """Set the values of a window, (channels, rows, columns); those beside it are as they were sampled."""
        for key, in_tile, in_window in overlaps(window):
            self._tile(key)[in_tile] = values[in_window]

    def _tile(self, key: tuple[int, int]) -> Array:
        if key not in self.tiles:
            tile = Window(key[0] * TILE, key[1] * TILE, TILE, TILE)
            self.tiles[key] = self._sample(*np.meshgrid(*tile.centres(self.cell_size)))
        return self.tiles[key]


@lru_cache(maxsize=16)
def overlaps(window: Window) -> list[tuple[tuple[int, int], tuple[slice, ...], tuple[slice, ...]]]:
    """Each tile that a window reaches into, with the shared cells as slices of the tile and of the window."""
    columns, rows = list(_parts(window.column, window.columns)), _parts(window.row, window.rows)
    every, both = slice(None), [(row, column) for row in rows for column in columns]
    return [((right[0], up[0]), (every, up[1], right[1]), (every, up[2], right[2])) for up, right in both]


def _parts(first: int, cells: int) -> Iterator[tuple[int, slice, slice]]:
    """Each tile along an axis that a window reaches into, with the shared cells of either."""
    for tile in range(first // TILE, (first + cells - 1) // TILE + 1):
        low, high = max(first, tile * TILE), min(first + cells, (tile + 1) * TILE)
        yield tile, slice(low - tile * TILE, high - tile * TILE), slice(low - first, high - first)
