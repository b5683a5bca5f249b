"""The height of the pressed ground at any place and frame, from the record of footprints and without simulating."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..ground.hard_ground import SeveralGrounds, soft_ground
from ..ground.heightfield import Terrain
from ..ground.sparse_grid import Window
from ..numerics.arrays import Array
from .footprints import QUANTUM, Changes, Footprint


@dataclass(frozen=True)
class _Print:
    """One footprint's change of height over time: `change[k]` holds from frame `frames[k]` on."""

    window: Window
    frames: Array
    change: NDArray[np.float32]  # (K + 1, cells), 0 at first


PRINTS_REMEMBERED = 256
"""Footprints that are kept laid out over time, which takes as much memory again as they do."""


class GroundHistory:
    """The ground as it stood at the scene frames of a bake.

    Parameters
    ----------
    terrain : Terrain
        The undisturbed ground.
    footprints : sequence of Footprint
        In any order.
    """

    def __init__(self, terrain: Terrain, footprints: Sequence[Footprint] = ()) -> None:
        self.terrain = terrain
        self._cell_size = footprints[0].cell_size if footprints else 1.0
        self._windows = np.array([footprint.window for footprint in footprints]).reshape(-1, 4)
        self._starts = np.array([footprint.start_frame for footprint in footprints])
        self._print = lru_cache(PRINTS_REMEMBERED)(lambda number: _series(footprints[number]))

    def heights(self, x: Array, y: Array, frame: Array) -> Array:
        """Heights at places and frames, arrays of one shape [m]; NaN where there is no ground."""
        return np.asarray(self.terrain.heights(x, y) + self.change(x, y, frame))

    def change(self, x: Array, y: Array, frame: Array) -> Array:
        """Change of height against the undisturbed ground [m], bilinear between the centres of cells."""
        shape = np.shape(x)
        column, row = np.ravel(x) / self._cell_size - 0.5, np.ravel(y) / self._cell_size - 0.5
        when = np.ravel(frame)
        total = np.zeros(len(when))
        for number in self._reached(column, row, when):
            first_column, first_row, columns, rows = self._windows[number]
            u, v = column - first_column, row - first_row
            begun = when >= self._starts[number] - 1e-6
            near = np.flatnonzero((u > -1) & (u < columns) & (v > -1) & (v < rows) & begun)
            if len(near):
                series = self._print(number)
                step = np.searchsorted(series.frames, when[near] + 1e-6, side="right")
                total[near] += _bilinear(series, step, u[near], v[near])
        return total.reshape(shape)

    def _reached(self, column: Array, row: Array, when: Array) -> list[int]:
        """Footprints that may lie at places, in cells from the centre of the first, before given frames."""
        if not len(when):
            return []
        first_column, first_row, columns, rows = self._windows.T
        return np.flatnonzero(
            (column.max() > first_column - 1)
            & (column.min() < first_column + columns)
            & (row.max() > first_row - 1)
            & (row.min() < first_row + rows)
            & (when.max() >= self._starts - 1e-6)
        ).tolist()


class SeveralHistories(GroundHistory):
    """The same of several grounds, each with footprints of its own: where one bears, its prints change it.

    Parameters
    ----------
    terrain : Terrain
        All of them, perhaps with hard objects.
    """

    def __init__(self, terrain: Terrain, grounds: SeveralGrounds, footprints: Sequence[Sequence[Footprint]]) -> None:
        super().__init__(terrain)
        self._grounds, self._parts = grounds, [GroundHistory(terrain, each) for each in footprints]

    def change(self, x: Array, y: Array, frame: Array) -> Array:
        """See `GroundHistory`."""
        numbers, total = self._grounds.numbers(x, y), np.zeros(np.shape(x))
        for number, part in enumerate(self._parts):
            on = numbers == number
            total[on] = part.change(x[on], y[on], frame[on])
        return total


def pressed_history(terrain: Terrain, footprints: Sequence[Sequence[Footprint]]) -> GroundHistory:
    """The history of the ground of a terrain, or of its several grounds, each with its footprints."""
    grounds = soft_ground(terrain)
    if isinstance(grounds, SeveralGrounds):
        return SeveralHistories(terrain, grounds, footprints)
    return GroundHistory(terrain, footprints[0])


def _series(footprint: Footprint) -> _Print:
    parts: list[Changes] = [footprint.compression, footprint.rim]
    frames = np.unique(np.concatenate([np.asarray(part.frames) for part in parts] + [[footprint.start_frame]]))
    change = np.zeros((len(frames) + 1, footprint.window.cells), dtype=np.float32)
    for part, sign in zip(parts, (-1.0, 1.0), strict=True):
        step = np.repeat(np.searchsorted(frames, part.frames) + 1, np.diff(part.first))
        at = step * footprint.window.cells + part.cells
        np.add.at(change.reshape(-1), at, (sign * QUANTUM * part.amounts).astype(np.float32))
    np.cumsum(change, axis=0, out=change)
    return _Print(footprint.window, frames, change)


def _bilinear(footprint: _Print, step: NDArray[np.intp], u: Array, v: Array) -> Array:
    window = footprint.window
    first, low = np.floor(u).astype(int), np.floor(v).astype(int)
    result = np.zeros(len(u))
    for i, part_u in ((first, 1 - (u - first)), (first + 1, u - first)):
        for j, part_v in ((low, 1 - (v - low)), (low + 1, v - low)):
            inside = (i >= 0) & (i < window.columns) & (j >= 0) & (j < window.rows)
            cell = np.where(inside, j * window.columns + i, 0)
            result += np.where(inside, part_u * part_v * footprint.change[step, cell], 0.0)
    return result
