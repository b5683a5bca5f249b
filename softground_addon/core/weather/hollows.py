"""Hollows of a surface, in which water stands, and the height of the water for the volume that has run in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Indices
from ..numerics.components import components

SHALLOWEST = 1e-3
"""Hollows that hold less water than this at their deepest are none [m]."""


def filled(heights: Array) -> Array:
    """A surface (rows, columns) with its hollows full to where they spill; its border is open.

    Examples
    --------
    >>> filled(np.array([[2.0, 2.0, 2.0], [2.0, 0.0, 1.0], [2.0, 2.0, 2.0]]))[1]
    array([2., 1., 1.])
    """
    straight = [np.maximum.accumulate(heights, axis=axis) for axis in (0, 1)]
    straight += [np.maximum.accumulate(heights[::-1, ::-1], axis=axis)[::-1, ::-1] for axis in (0, 1)]
    around = np.pad(np.min(straight, axis=0), 1, constant_values=np.inf)
    level = around[1:-1, 1:-1]
    while True:
        lowest = np.minimum(around[:-2, 1:-1], around[2:, 1:-1])
        np.minimum(lowest, around[1:-1, :-2], out=lowest)
        np.minimum(lowest, around[1:-1, 2:], out=lowest)
        np.maximum(lowest, heights, out=lowest)
        np.minimum(lowest, level, out=lowest)
        if (lowest == level).all():
            return lowest
        level[:] = lowest


@dataclass(frozen=True)
class Hollow:
    """One hollow of a surface.

    Attributes
    ----------
    cells : (N,) int array
        Its cells, row·columns + column.
    heights : (N,) float array
        Heights of these, in no order [m].
    cell_area : float
        [m²].
    spill : float
        Height at which it runs over [m].
    """

    cells: Indices
    heights: Array
    cell_area: float
    spill: float

    @property
    def bottom(self) -> float:
        """Its lowest height [m]."""
        return float(self.heights.min())

    @property
    def capacity(self) -> float:
        """Volume of water that it holds [m³]."""
        return float(self.volume(self.spill))

    @property
    def catchment(self) -> float:
        """Area whose rain it gathers [m²]: its own."""
        return len(self.cells) * self.cell_area

    def volume(self, level: float) -> float:
        """Water in it up to a height [m³]: the volume curve V(z)."""
        return float(np.maximum(level - self.heights, 0.0).sum() * self.cell_area)

    def level(self, volume: Array) -> Array:
        """Height of the water [m] for volumes (...) [m³]: the inverse of V(z), up to where it spills.

        Examples
        --------
        >>> hollow = Hollow(np.arange(2), np.array([0.0, 0.1]), 1.0, 0.2)
        >>> hollow.level(np.array([0.0, 0.1, 0.2, 0.3, 9.0])).round(3)
        array([0.  , 0.1 , 0.15, 0.2 , 0.2 ])
        """
        steps = np.append(np.sort(self.heights), self.spill)
        wet = np.arange(len(steps))
        volumes = (wet * steps - np.concatenate([[0.0], np.cumsum(steps[:-1])])) * self.cell_area
        return np.asarray(np.interp(volume, volumes, steps))


def hollows(heights: Array, cell_area: float) -> list[Hollow]:
    """The hollows of a surface (rows, columns) [m] of cells [m²]."""
    level = filled(heights)
    wet = level - heights > 0
    number = np.full(wet.size, -1)
    cells = np.flatnonzero(wet)
    number[cells] = np.arange(len(cells))
    grid = number.reshape(wet.shape)
    pairs = [
        np.stack([a[both], b[both]])
        for a, b in ((grid[:, :-1], grid[:, 1:]), (grid[:-1], grid[1:]))
        for both in [(a >= 0) & (b >= 0)]
    ]
    cell, neighbour = np.concatenate(pairs, axis=1)
    label = components(len(cells), cell, neighbour)
    deep_enough = []
    for part in range(int(label.max(initial=-1)) + 1):
        part_cells = cells[label == part]
        hollow = Hollow(part_cells, heights.ravel()[part_cells], cell_area, float(level.ravel()[part_cells].max()))
        if hollow.spill - hollow.bottom > SHALLOWEST:
            deep_enough.append(hollow)
    return deep_enough
