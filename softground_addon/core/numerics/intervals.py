"""Intervals of a state over time: runs, hysteresis, gaps and blips."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .arrays import Array, Indices, Mask


def in_order(place: Array | Indices, time: Array | Indices) -> Indices:
    """Order by place (N,) and at each place by time (N,); equal ones stay as they are.

    One key is sorted in place of two: where much is in order already, `np.lexsort` takes ten times as long. All times
    together are to span less than 2^52 times what tells two apart, over the number of places.

    Examples
    --------
    >>> in_order(np.array([1, 0, 1, 0]), np.array([2.0, 5.0, -1.0, 5.0])).tolist()
    [1, 3, 2, 0]
    """
    if not len(place):
        return np.zeros(0, dtype=np.intp)
    first = time.min()
    span = 2.0 ** np.ceil(np.log2(time.max() - first + 1.0))
    return np.argsort(place * span + (time - first), kind="stable")


def hysteresis(start: Mask, stop: Mask) -> Mask:
    """States that `start` switches on and `stop` switches off along the first axis, off before either."""
    step = np.arange(1, len(start) + 1).reshape(-1, *[1] * (start.ndim - 1))
    last_start = np.maximum.accumulate(np.where(start & ~stop, step, 0))
    last_stop = np.maximum.accumulate(np.where(stop, step, 0))
    return last_start > last_stop


def close_short(state: Mask, shortest: int) -> Mask:
    """A state over time without interior gaps, then without blips, of fewer than `shortest` steps.

    Gaps and blips that reach the first or the last step are of unknown length and stay.
    """
    state = state.copy()
    for value in (False, True):
        start, end = runs(state == value)
        for first, last in zip(start, end, strict=True):
            if first > 0 and last < len(state) and last - first < shortest:
                state[first:last] = not value
    return state


def runs(state: Mask) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First steps of the runs of true in `state`, and the steps just after their last."""
    edges = np.diff(np.concatenate(([0], state.astype(np.int8), [0])))
    return np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
