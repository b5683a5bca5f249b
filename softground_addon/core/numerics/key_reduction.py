"""Which frames of sampled curves need keys, so that straight lines between them stay within a tolerance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def kept_samples(values: Array, tolerance: float) -> NDArray[np.intp]:
    """Samples to keep so that all channels, joined by straight lines, stay within the tolerance (Douglas-Peucker).

    Parameters
    ----------
    values : (F, C) float array
        Channels that share their keys, evenly sampled.
    tolerance : float
        Largest distance of a channel from its line, in the channels' unit.

    Returns
    -------
    (K,) int array, ascending; the first and the last sample are always among them.

    Examples
    --------
    >>> kept_samples(np.array([[0.0], [1.0], [2.0], [2.0], [2.0]]), 0.01)
    array([0, 2, 4])
    """
    count = len(values)
    keep = np.zeros(count, dtype=bool)
    keep[[0, -1]] = True
    spans = [(0, count - 1)]
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        part = np.arange(1, last - first)[:, None] / (last - first)
        line = values[first] + part * (values[last] - values[first])
        off = np.abs(values[first + 1 : last] - line).max(axis=1)
        worst = int(off.argmax())
        if off[worst] > tolerance:
            middle = first + 1 + worst
            keep[middle] = True
            spans += [(first, middle), (middle, last)]
    return np.flatnonzero(keep)
