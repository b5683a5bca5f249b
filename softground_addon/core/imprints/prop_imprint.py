"""Underside of a posed rigid body by a z-buffer, sample by sample above the ground."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..ground.heightfield import Surface
from ..ground.variation import Factors
from ..motion.props import Prop, posed
from ..numerics.arrays import Array
from ..soles.undersides import lowest_surface
from .indentation import Springs

SAMPLES_ACROSS = 48
"""Samples along the side of a square as large as what may touch: areas are then known to about 1 %."""
FEWEST_DIVISIONS, MOST_DIVISIONS = 2, 64
"""Parts of a cell along each side: at least so many that edges count by their covered fraction."""


@dataclass(frozen=True)
class GroundUnder:
    """The ground under a posed body.

    Attributes
    ----------
    rows, columns : slice
        The cells of the window that the body is over.
    divisions : int
        Samples along each side of a cell.
    over : (rows·divisions, columns·divisions) bool array
        Samples where the body is over ground, or beyond its edge, where what lies there bears its part of the load.
    bears : (number of those,) bool array
        Which of them are over ground.
    springs : Springs
        Of those samples.
    """

    rows: slice
    columns: slice
    divisions: int
    over: NDArray[np.bool_]
    bears: NDArray[np.bool_]
    springs: Springs

    def by_cell(self, samples: NDArray[Any]) -> Array:
        """Mean of the samples in each cell, (rows, columns)."""
        rows, columns = (size // self.divisions for size in samples.shape)
        return np.asarray(samples.reshape(rows, self.divisions, columns, self.divisions).mean(axis=(1, 3)))


def ground_under(prop: Prop, pose: Array, cells: Surface, reach: float, factors: Factors | None) -> GroundUnder | None:
    """The ground that a body presses at a pose; None if it is over none.

    Parameters
    ----------
    pose : (4, 4) float array
    cells : Surface
        Of all cells that the body is over, at least.
    reach : float
        How far the body sinks in at most: what lies higher above its lowest point is left out [m].
    factors : Factors, optional
        How the ground varies over the window.
    """
    window, size = cells.window, cells.cell_size
    vertices, (a, b, c) = posed(prop.vertices, pose), prop.triangles.T
    whole = _continued(cells, vertices)
    _, ground = whole.planes_at(vertices[:, 0], vertices[:, 1])
    height = np.where(np.isnan(ground), np.inf, vertices[:, 2] - ground)
    above = np.minimum(np.minimum(height[a], height[b]), height[c])
    if not np.isfinite(above.min()):
        return None
    triangles = prop.triangles[above <= above.min() + prop.give + reach]
    near = vertices[triangles.ravel(), :2].T
    low, high = near.min(axis=1), near.max(axis=1)
    corner = np.array([window.column, window.row])
    first = np.maximum(np.floor(low / size).astype(int) - corner, 0)
    last = np.minimum(np.floor(high / size).astype(int) - corner, (window.columns - 1, window.rows - 1))
    if (last < first).any():
        return None
    columns, rows = (slice(int(a), int(b) + 1) for a, b in zip(first, last, strict=True))
    across = np.sqrt(float(np.prod(np.maximum(high - low, 1e-9)))) / SAMPLES_ACROSS
    divisions = int(np.clip(ceil(size / across), FEWEST_DIVISIONS, MOST_DIVISIONS))
    spacing = size / divisions
    shape = ((rows.stop - rows.start) * divisions, (columns.stop - columns.start) * divisions)
    lower = lowest_surface(vertices, triangles, (first + corner) * size + spacing / 2, shape, spacing)
    clearance = lower - _finer(whole, rows, columns, divisions)
    over = np.isfinite(clearance)
    bears = _repeated(cells.bears[rows, columns], divisions)[over]
    if not bears.any():
        return None
    clearance = np.maximum(clearance[over] - clearance[over].min() - prop.give, 0.0)
    area = np.full(len(clearance), spacing**2)
    if factors is None:
        return GroundUnder(rows, columns, divisions, over, bears, Springs(clearance, area))
    varying = (field[rows, columns] for field in (factors.stiffness, factors.depth))
    stiffness, depth = (_repeated(field, divisions)[over] for field in varying)
    return GroundUnder(rows, columns, divisions, over, bears, Springs(clearance, area, stiffness, depth))


def _continued(cells: Surface, vertices: Array) -> Surface:
    """The ground with what lies beyond its edge, taken to go on as it is under the rest of a body."""
    off = np.isnan(cells.heights)
    x, y = vertices[:, 0], vertices[:, 1]
    on = ~np.isnan(cells.planes_at(x, y)[1])
    if not (off.any() and on.any()):
        return cells
    level, rise_x, rise_y = cells.mean_plane(x, y, on.astype(float))
    x, y = np.meshgrid(*cells.window.centres(cells.cell_size))
    return replace(
        cells,
        heights=np.where(off, level + rise_x * x + rise_y * y, cells.heights),
        slope_x=np.where(off, rise_x, cells.slope_x),
        slope_y=np.where(off, rise_y, cells.slope_y),
    )


def _finer(cells: Surface, rows: slice, columns: slice, divisions: int) -> Array:
    """Heights of the ground at samples within some cells, on each cell's plane [m]; -inf where nothing bears."""
    within = ((np.arange(divisions) + 0.5) / divisions - 0.5) * cells.cell_size
    heights = np.where(cells.bears, cells.heights, -np.inf)[rows, columns][:, None, :, None]
    heights = heights + cells.slope_x[rows, columns][:, None, :, None] * within
    heights = heights + cells.slope_y[rows, columns][:, None, :, None] * within[:, None, None]
    return np.asarray(heights.reshape(heights.shape[0] * divisions, -1))


def _repeated(values: NDArray[Any], divisions: int) -> NDArray[Any]:
    return values.repeat(divisions, axis=0).repeat(divisions, axis=1)
