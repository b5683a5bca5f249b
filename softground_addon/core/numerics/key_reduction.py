"""Fewest samples of curves between which straight lines stay within a tolerance (Douglas-Peucker).

References
----------
Douglas, D., Peucker, T. (1973). Algorithms for the reduction of the number of points required to represent a digitized
line or its caricature. Cartographica 10(2), 112-122. https://doi.org/10.3138/FM57-6770-U75U-7727
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .arrays import Array, Indices


def kept_samples(values: Array, tolerance: float) -> Indices:
    """Samples to keep so that all channels, joined by straight lines, stay within the tolerance.

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
    keep = np.zeros(len(values), dtype=bool)
    keep[[0, -1]] = True
    bend_lines(np.arange(float(len(values))), values[:, None], keep[:, None], np.full((1, values.shape[1]), tolerance))
    return np.flatnonzero(keep)


def bend_lines(frames: Array, values: Array, knot: NDArray[np.bool_], margin: Array) -> Array:
    """Add knots, each where a line between two knots is farthest from the values, until all lines are near enough.

    Parameters
    ----------
    frames : (T,) float array
        When the samples are.
    values : (T, K, C) float array
        C values of K points, which bend at the same knots.
    knot : (T, K) bool array
        Where the lines of each point begin and end; gains the knots that are added.
    margin : (K, C) float array
        Largest distance from a line.

    Returns
    -------
    (K, C) float array
        The largest remaining distance.
    """
    count, points, channels = values.shape
    # Channel by channel, and in each one point after the other, so that samples between two knots are contiguous.
    rows, when = np.ascontiguousarray(values.T).reshape(channels, -1), np.tile(frames, points)
    error = np.zeros((channels, points))
    at = np.flatnonzero(knot.T)
    begin, end = _with_samples_between(at[:-1], at[1:], count)
    while len(begin):
        inside = end - begin - 1
        first = np.cumsum(inside) - inside
        sample = np.arange(inside.sum()) + np.repeat(begin + 1 - first, inside)
        share = (when[sample] - np.repeat(when[begin], inside)) / np.repeat(when[end] - when[begin], inside)
        low = rows.take(begin, axis=1)
        missed = np.repeat(rows.take(end, axis=1) - low, inside, axis=1)
        missed *= share
        missed += np.repeat(low, inside, axis=1)
        missed -= rows.take(sample, axis=1)
        np.abs(missed, out=missed)
        excess = (missed / np.repeat(margin.T[:, begin // count], inside, axis=1)).max(axis=0)
        worst = np.maximum.reduceat(excess, first)
        fits = worst <= 1.0
        for of_channel, gap in zip(error, np.maximum.reduceat(missed, first, axis=1), strict=True):
            np.maximum.at(of_channel, begin[fits] // count, gap[fits])
        farthest = np.flatnonzero(excess == np.repeat(worst, inside))
        bend = sample[farthest[np.searchsorted(farthest, first[~fits])]]
        knot[bend % count, bend // count] = True
        begin, end = _with_samples_between(
            np.concatenate([begin[~fits], bend]), np.concatenate([bend, end[~fits]]), count
        )
    return error.T


def _with_samples_between(begin: Indices, end: Indices, count: int) -> tuple[Indices, Indices]:
    """Lines between rows of points, `count` each, that have rows between their ends."""
    longer = (end - begin > 1) & (begin // count == end // count)
    return begin[longer], end[longer]
