"""Places in the plane, found by window."""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Indices
from ..numerics.intervals import in_order
from .sparse_grid import Window


class Places:
    """Places in the plane, found by window.

    Parameters
    ----------
    x, y : (K,) float arrays
        World positions [m].
    """

    BIN = 0.5
    """Side of the bins [m]."""

    def __init__(self, x: Array, y: Array) -> None:
        self.x, self.y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
        column, row = np.floor(self.x / self.BIN), np.floor(self.y / self.BIN)
        self._order = in_order(row, column)
        row, column = row[self._order], column[self._order]
        first = np.flatnonzero((np.diff(row, prepend=np.nan) != 0) | (np.diff(column, prepend=np.nan) != 0))
        self._rows, self._columns = row[first], column[first]
        self._first = np.append(first, len(self._order))

    def at(self, points: Indices) -> Array:
        """Positions of some of them, (N, 2) [m]."""
        return np.column_stack([self.x[points], self.y[points]])

    def within(self, window: Window, cell_size: float) -> Indices:
        """Places in the cells of a window, (N,), ascending."""
        low = np.floor(np.array([window.column, window.row]) * cell_size / self.BIN)
        high = np.floor(np.array([window.column + window.columns, window.row + window.rows]) * cell_size / self.BIN)
        near = (self._columns >= low[0]) & (self._columns <= high[0]) & (self._rows >= low[1]) & (self._rows <= high[1])
        runs = [self._order[self._first[k] : self._first[k + 1]] for k in np.flatnonzero(near)]
        points = np.sort(np.concatenate([np.zeros(0, dtype=np.intp), *runs]))
        column, row = np.floor(self.at(points) / cell_size).astype(np.intp).T
        return points[window.holds(row, column)]

    def window(self, points: Indices, cell_size: float) -> Window:
        """The cells around some of the places."""
        place = self.at(points)
        return Window.around(place.min(axis=0), place.max(axis=0), cell_size)
