"""The lowest of the values around each cell of a window."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from .arrays import Array


def lowest_within(values: Array, reach: int) -> Array:
    """Lowest value (rows, columns) within so many cells along both axes of each.

    Examples
    --------
    >>> lowest_within(np.array([[3.0, 1.0, 2.0, 5.0, 4.0]]), 1)
    array([[1., 1., 1., 2., 4.]])
    """
    for axis in (0, 1):
        sides = [(reach, reach) if each == axis else (0, 0) for each in (0, 1)]
        padded = np.pad(values, sides, constant_values=np.inf)
        values = sliding_window_view(padded, 2 * reach + 1, axis=axis).min(axis=-1)
    return values
