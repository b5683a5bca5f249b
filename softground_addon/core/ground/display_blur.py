"""The display blur: a Gaussian over the touched ground that keeps every volume. It never feeds back."""

from __future__ import annotations

from copy import copy
from typing import TypeVar

import numpy as np

from ..numerics.arrays import Array
from .sparse_grid import TILE, SparseGrid, Window

Grid = TypeVar("Grid", bound=SparseGrid)

WIDE = TILE // 4
"""Cells on each side of a kernel beyond which it costs less to blur all in one direction, and that in the other."""
CUT_OFF = 4.0
"""The Gaussian ends at so many standard deviations, where it has fallen to 0.03 % of its peak."""


def gaussian_kernel(sigma: float) -> Array:
    """Weights of a Gaussian at whole cells, summing to 1.

    Parameters
    ----------
    sigma : float
        Standard deviation in cells; far below one cell only the middle is left.

    Examples
    --------
    >>> gaussian_kernel(0.5).round(3)
    array([0.   , 0.106, 0.787, 0.106, 0.   ])
    >>> gaussian_kernel(0.0)
    array([1.])
    """
    radius = int(CUT_OFF * sigma + 0.5)
    if radius == 0:
        return np.ones(1)
    weights = np.exp(-0.5 * (np.arange(-radius, radius + 1) / sigma) ** 2)
    return np.asarray(weights / weights.sum())


def blurred_window(field: SparseGrid, window: Window, sigma: float) -> Array:
    """Blurred values of a window, as two products with banded matrices.

    Parameters
    ----------
    field : SparseGrid
        Raw values; what lies around the window is blurred into it.
    sigma : float
        Standard deviation [m].

    Returns
    -------
    (channels, rows, columns) float array
    """
    kernel = gaussian_kernel(sigma / field.cell_size)
    margin = len(kernel) // 2
    if margin == 0:
        return field.read(window)
    return blurred_inside(field.read(window.expanded(margin)), kernel)


def blurred_inside(values: Array, kernel: Array) -> Array:
    """Values (..., rows, columns) blurred with a kernel, less the margin of half a kernel on every side."""
    rows, columns = (size - len(kernel) + 1 for size in values.shape[-2:])
    blurred: Array = _band(kernel, rows) @ values @ _band(kernel, columns).T
    return blurred


def blurred(field: Grid, sigma: float) -> Grid:
    """The whole of a grid blurred; its sums, and so volumes, are those of the raw one.

    Parameters
    ----------
    sigma : float
        Standard deviation [m].
    """
    kernel = gaussian_kernel(sigma / field.cell_size)
    margin = len(kernel) // 2
    spread = -(-margin // TILE)  # tiles that a touched one blurs into
    around = range(-spread, spread + 1)
    if margin > WIDE:
        upright, result = _empty(field), _empty(field)
        band = _band(kernel, TILE)
        for column, row in sorted({(column, row + j) for column, row in field.tiles for j in around}):
            high = Window(column * TILE, row * TILE - margin, TILE, TILE + 2 * margin)
            upright.tiles[column, row] = band @ field.read(high)
        for column, row in sorted({(column + i, row) for column, row in upright.tiles for i in around}):
            wide = Window(column * TILE - margin, row * TILE, TILE + 2 * margin, TILE)
            result.write(Window(column * TILE, row * TILE, TILE, TILE), upright.read(wide) @ band.T)
        return result
    result, band = _empty(field), _band(kernel, TILE)
    places = {(column + i, row + j) for column, row in field.tiles for i in around for j in around}
    for column, row in sorted(places):
        window = Window(column * TILE, row * TILE, TILE, TILE)
        values = field.read(window.expanded(margin))
        if values.any():
            result.write(window, band @ values @ band.T)
    return result


def _empty(field: Grid) -> Grid:
    """A grid like another, with nothing in it."""
    twin = copy(field)
    twin.tiles = {}
    return twin


def _band(kernel: Array, size: int) -> Array:
    """Matrix (size, size + 2·margin) with the kernel along its diagonal."""
    width = size + len(kernel) - 1
    skewed = np.zeros((size, width + 1))  # read in rows shorter by one, each lies one to the right of the one before
    skewed[:, : len(kernel)] = kernel
    return skewed.ravel()[: size * width].reshape(size, width)
