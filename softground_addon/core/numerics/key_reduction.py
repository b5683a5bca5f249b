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
    margin = np.full((values.shape[1], 1), tolerance)
    bend_lines(np.arange(float(len(values))), values.T, np.zeros(len(values), dtype=np.intp), keep, margin)
    return np.flatnonzero(keep)


def bend_lines(when: Array, values: Array, point: Indices, knot: NDArray[np.bool_], margin: Array) -> Array:
    """Add knots, each where a line between two knots is farthest from the values, until all lines are near enough.

    Parameters
    ----------
    when : (S,) float array
        Frames of samples, ascending for each point.
    values : (C, S) float array
        C values, which bend at the same knots.
    point : (S,) int array
        The one of K points that each sample is of, ascending.
    knot : (S,) bool array
        Where the lines of each point begin and end; gains the knots that are added.
    margin : (C, K) float array
        Largest distance from a line.

    Returns
    -------
    (C, K) float array
        The largest remaining distance.
    """
    error = np.zeros(margin.shape)
    at = np.flatnonzero(knot)
    begin, end = _with_samples_between(at[:-1], at[1:], point)
    while len(begin):
        inside = end - begin - 1
        first = np.cumsum(inside) - inside
        sample = np.arange(inside.sum()) + np.repeat(begin + 1 - first, inside)
        share = (when[sample] - np.repeat(when[begin], inside)) / np.repeat(when[end] - when[begin], inside)
        low = values.take(begin, axis=1)
        missed = np.repeat(values.take(end, axis=1) - low, inside, axis=1)
        missed *= share
        missed += np.repeat(low, inside, axis=1)
        missed -= values.take(sample, axis=1)
        np.abs(missed, out=missed)
        excess = (missed / np.repeat(margin.take(point[begin], axis=1), inside, axis=1)).max(axis=0)
        worst = np.maximum.reduceat(excess, first)
        fits = worst <= 1.0
        for of_channel, gap in zip(error, np.maximum.reduceat(missed, first, axis=1), strict=True):
            np.maximum.at(of_channel, point[begin[fits]], gap[fits])
        farthest = np.flatnonzero(excess == np.repeat(worst, inside))
        bend = sample[farthest[np.searchsorted(farthest, first[~fits])]]
        knot[bend] = True
        begin, end = _with_samples_between(
            np.concatenate([begin[~fits], bend]), np.concatenate([bend, end[~fits]]), point
        )
    return error


def _with_samples_between(begin: Indices, end: Indices, point: Indices) -> tuple[Indices, Indices]:
    """Lines between samples of one point that has others between them."""
    longer = (end - begin > 1) & (point[begin] == point[end])
    return begin[longer], end[longer]
