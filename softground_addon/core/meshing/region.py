"""Where detail is wanted on the plane."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..numerics.cell_keys import Keys, among, keys_of, parents_of

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


class Region:
    """The part of the plane where detail is wanted, as cells, with a pyramid of coarser ones above them.

    Parameters
    ----------
    cells : (N,) int array
        `cell_keys` of the cells, ascending.
    cell_size : float
        Side of a cell [m].
    """

    def __init__(self, cells: Keys, cell_size: float) -> None:
        self.cell_size = cell_size
        self._levels = [cells]

    def touches(self, low: Array, high: Array) -> Mask:
        """Which of the boxes from `low` to `high`, (N, 2) [m], reach into the region, to about a cell."""
        if not len(self._levels[0]):
            return np.zeros(len(low), dtype=bool)
        extent = (high - low).max(axis=1) / (2 * self.cell_size)
        level = np.ceil(np.log2(np.maximum(extent, 1.0))).astype(int)
        touched = np.zeros(len(low), dtype=bool)
        for number in np.unique(level):
            boxes = np.flatnonzero(level == number)
            size = self.cell_size * 2.0**number
            first, last = (np.floor(corner[boxes] / size).astype(np.int64) for corner in (low, high))
            found = np.zeros(len(boxes), dtype=bool)
            for row in (first[:, 1], (first[:, 1] + last[:, 1]) // 2, last[:, 1]):
                for column in (first[:, 0], (first[:, 0] + last[:, 0]) // 2, last[:, 0]):
                    found |= self._holds(keys_of(np.stack([column, row], axis=-1)), int(number))
            touched[boxes] = found
        return touched

    def _holds(self, cells: Keys, level: int) -> Mask:
        while len(self._levels) <= level:
            self._levels.append(parents_of(self._levels[-1]))
        return among(self._levels[level], cells)
