"""Region of the plane where detail is wanted."""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Mask
from ..numerics.cell_keys import Keys, among, cells_of, keys_of, parents_of


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
        """True for boxes from `low` to `high`, (N, 2) [m], that reach into the region, to about a cell."""
        if not len(self._levels[0]):
            return np.zeros(len(low), dtype=bool)
        extent = (high - low).max(axis=1) / (2 * self.cell_size)
        level = np.ceil(np.log2(np.maximum(extent, 1.0))).astype(int)
        touched = np.zeros(len(low), dtype=bool)
        for number in np.unique(level):
            boxes = np.flatnonzero(level == number)
            size = self.cell_size * 2.0**number
            first, last = (np.floor(corner[boxes] / size).astype(np.int64) for corner in (low, high))
            cells = cells_of(self._at(int(number)))
            near = ((last >= cells.min(axis=0)) & (first <= cells.max(axis=0))).all(axis=1)
            boxes, first, last = boxes[near], first[near], last[near]
            reached = np.zeros(len(boxes), dtype=bool)
            for row in (first[:, 1], (first[:, 1] + last[:, 1]) // 2, last[:, 1]):
                for column in (first[:, 0], (first[:, 0] + last[:, 0]) // 2, last[:, 0]):
                    others = np.flatnonzero(~reached)
                    keys = keys_of(np.stack([column[others], row[others]], axis=-1))
                    reached[others] = among(self._at(int(number)), keys)
            touched[boxes] = reached
        return touched

    def _at(self, level: int) -> Keys:
        """The cells of the pyramid's level."""
        while len(self._levels) <= level:
            self._levels.append(parents_of(self._levels[-1]))
        return self._levels[level]
