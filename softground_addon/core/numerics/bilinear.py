"""Values between the four corners of a square."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from .arrays import Array


def between(corners: Iterable[Array], u: Array, v: Array) -> Array:
    """Values at u to the right and v up, 0 to 1, of arrays that broadcast against each other.

    Parameters
    ----------
    corners : four float arrays
        Below, below right, above and above right.
    u, v : float arrays

    Examples
    --------
    >>> float(between((0.0, 1.0, 2.0, 3.0), 0.5, 0.25))
    1.0
    """
    below, below_right, above, above_right = corners
    values: Array = (below * (1 - u) + below_right * u) * (1 - v)
    values += (above * (1 - u) + above_right * u) * v
    return values


def sample_map(values: Array, points: Array, origin: Array, spacing: float) -> Array:
    """Values of a map at points, bilinear between nodes and constant beyond the border.

    Parameters
    ----------
    values : (rows, columns) float array
    points : (..., 2) float array
        Positions [m].
    origin : (2,) float array
        Position of node (0, 0) [m].
    spacing : float
        Distance between nodes [m].

    Returns
    -------
    (...) float array
    """
    rows, columns = values.shape
    position = np.clip((np.asarray(points) - origin) / spacing, 0, (columns - 1, rows - 1))
    corner = np.minimum(position.astype(int), (max(columns - 2, 0), max(rows - 2, 0)))
    u, v = np.moveaxis(position - corner, -1, 0)
    column, row = np.moveaxis(corner, -1, 0)
    right, above = np.minimum(column + 1, columns - 1), np.minimum(row + 1, rows - 1)
    return between((values[row, column], values[row, right], values[above, column], values[above, right]), u, v)
