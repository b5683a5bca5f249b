"""The ground as a height field over an endless plane, kept in sparse tiles.

Cell (i, j), column along x and row along y, covers [i·cell_size, (i+1)·cell_size) and is centred half a cell further;
the world origin is a corner of cell (0, 0). Tiles exist only where something was written, so that memory follows
the touched ground and not its extent.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from ..numerics.arrays import Array, Mask
from .sparse_grid import SampledGrid, SparseGrid, Window

STEEPEST_CELL = np.tan(np.radians(60.0))
"""Slope of the steepest cell that takes a print: more is a wall."""


class Terrain(Protocol):
    """The undisturbed ground."""

    def heights(self, x: Array, y: Array) -> Array:
        """Heights at world positions [m], NaN where there is no ground."""
        ...


@dataclass(frozen=True)
class FlatTerrain:
    """A horizontal plane, endless or a rectangle.

    Attributes
    ----------
    height : float
        Its height [m].
    low, high : (float, float)
        Corners of the rectangle [m].
    """

    height: float = 0.0
    low: tuple[float, float] = (-np.inf, -np.inf)
    high: tuple[float, float] = (np.inf, np.inf)

    def heights(self, x: Array, y: Array) -> Array:
        """Heights at world positions [m], NaN beyond the rectangle."""
        (left, near), (right, far) = self.low, self.high
        inside = (x >= left) & (x <= right) & (y >= near) & (y <= far)
        return np.where(inside, float(self.height), np.nan)


@dataclass(frozen=True, eq=False)
class SlopingTerrain:
    """An endless inclined plane.

    Attributes
    ----------
    height : float
        Its height at the origin of the world [m].
    slope : (2,) float array
        Rise along x and y.
    """

    height: float
    slope: Array

    def heights(self, x: Array, y: Array) -> Array:
        """Heights at world positions [m]."""
        return np.asarray(self.height + self.slope[0] * np.asarray(x) + self.slope[1] * np.asarray(y))


class HeightField(SparseGrid):
    """The deformed ground: compression and rim height of every cell [m], 0 where nothing happened.

    The ground's height is that of the undisturbed terrain, less the compression, plus the rim.
    """

    def __init__(self, cell_size: float) -> None:
        super().__init__(cell_size, channels=2)

    def volumes(self) -> tuple[float, float]:
        """Compressed volume and rim volume [m³]."""
        total = sum((tile.sum(axis=(1, 2)) for _, tile in sorted(self.tiles.items())), np.zeros(2))
        return float(total[0]) * self.cell_size**2, float(total[1]) * self.cell_size**2


@dataclass(frozen=True)
class Surface:
    """The undisturbed ground over a window.

    Attributes
    ----------
    cell_size : float
        Side of a cell [m].
    heights : (rows, columns) float array
        At the centres of cells [m], NaN where there is no ground.
    slope_x, slope_y : (rows, columns) float arrays
        Rise along x and y: the mean of those to both sides; where they have opposite signs or one is unknown or
        level, as at the foot of a wall and at the brink of a gap, the gentler one.
    """

    window: Window
    cell_size: float
    heights: Array
    slope_x: Array
    slope_y: Array

    @cached_property
    def bears(self) -> Mask:
        """Cells that take a print: on the ground and no wall."""
        mask: Mask = np.isfinite(self.heights) & (self.slope_x**2 + self.slope_y**2 <= STEEPEST_CELL**2)
        return mask

    def planes_at(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Heights at world positions [m]: of the cell there, and on its plane; NaN where the cell does not bear."""
        row, column = cell = self.window.cells_under(x, y, self.cell_size)
        level = np.where(self.bears, self.heights, np.nan)[cell]
        rise = self.slope_x[cell] * (x / self.cell_size - self.window.column - column - 0.5)
        rise += self.slope_y[cell] * (y / self.cell_size - self.window.row - row - 0.5)
        return level, level + rise * self.cell_size

    def beyond(self, x: Array, y: Array) -> Mask:
        """True for world positions [m] beyond the edge of the ground."""
        off: Mask = np.isnan(self.heights[self.window.cells_under(x, y, self.cell_size)])
        return off

    def mean_plane(self, x: Array, y: Array, weight: Array) -> Array:
        """Mean plane (3, ..., 1) under world positions (..., Q): height at the origin [m], and slopes along x and y.

        `weight` (..., Q) says how much each counts, 0 where the cell does not bear; no number where none counts.
        """
        cell = self.window.cells_under(x, y, self.cell_size)
        total = weight.sum(axis=-1, keepdims=True)
        share = np.divide(weight, total, out=np.full(weight.shape, np.nan), where=total > 0)
        height = np.where(weight > 0, self.planes_at(x, y)[1], 0.0)
        values = (x, y, height, self.slope_x[cell], self.slope_y[cell])
        mean_x, mean_y, level, rise_x, rise_y = ((share * value).sum(axis=-1, keepdims=True) for value in values)
        return np.stack([level - rise_x * mean_x - rise_y * mean_y, rise_x, rise_y])


class TerrainTiles:
    """A terrain's heights and slopes at cell centres, looked up once per tile.

    Parameters
    ----------
    cell_size : float
        Side of a cell [m].
    """

    def __init__(self, terrain: Terrain, cell_size: float) -> None:
        self.terrain = terrain
        self._heights = SampledGrid(lambda x, y: terrain.heights(x, y)[None], cell_size, channels=1)

    @property
    def cell_size(self) -> float:
        """Side of a cell [m]."""
        return self._heights.cell_size

    def heights(self, window: Window) -> Array:
        """Heights of a window, (rows, columns) [m], NaN where there is no ground."""
        values: Array = self._heights.read(window)[0]
        return values

    def surface(self, window: Window) -> Surface:
        """Heights and slopes of a window."""
        heights = self.heights(window.expanded(1))
        along_x = np.diff(heights[1:-1], axis=1) / self.cell_size
        along_y = np.diff(heights[:, 1:-1], axis=0) / self.cell_size
        return Surface(
            window,
            self.cell_size,
            heights[1:-1, 1:-1],
            _slope(along_x[:, :-1], along_x[:, 1:]),
            _slope(along_y[:-1], along_y[1:]),
        )


def _slope(before: Array, after: Array) -> Array:
    """Slope of cells from those to both sides, 0 where neither is known."""
    edges = np.isnan(before) | np.isnan(after)
    if edges.any():
        before, after = np.where(np.isnan(before), after, before), np.where(np.isnan(after), before, after)
    elif not (before.any() or after.any()):
        return np.zeros(before.shape)
    gentler = np.where(np.abs(before) < np.abs(after), before, after)
    return np.nan_to_num(np.where(before * after > 0, (before + after) / 2, gentler))
