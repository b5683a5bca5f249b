"""How the ground moves over time, in closed form: a few ramps per point.

A ramp changes a value by `change` between two frames, linearly, and holds it before and after. A point's value at any
time is the sum of its ramps, so that frames can be shown in any order, and between frames, without a cache.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

TOLERANCE = 2e-4
"""Largest error of a fitted height while it moves [m]; at rest there is none."""

QUANTUM = 2.0**-20
"""Step of fitted values [m], about a micrometre: sums of its multiples below 16 m are exact in single precision."""


@dataclass(frozen=True)
class Ramps:
    """Histories of points: value(t) = Σ change · clip((t - start) / (end - start), 0, 1).

    Attributes
    ----------
    point : (R,) int array
        The point that each ramp belongs to, ascending; each point's ramps are in the order of their start.
    start, end : (R,) float arrays
        Frames between which the value changes; start < end.
    change : (R,) float array
        By how much.
    """

    point: Indices
    start: Array
    end: Array
    change: Array

    @classmethod
    def joined(cls, parts: Sequence[Ramps]) -> Ramps:
        """All ramps of several sets, which may share points."""
        none = cls(np.zeros(0, dtype=np.intp), np.zeros(0), np.zeros(0), np.zeros(0))
        point, start, end, change = (
            np.concatenate([getattr(part, name) for part in (none, *parts)])
            for name in ("point", "start", "end", "change")
        )
        order = np.lexsort((start, point))
        return cls(point[order], start[order], end[order], change[order])

    def at(self, frame: float, points: int) -> Array:
        """Values of points 0 to `points` - 1 at a frame, (points,)."""
        share = np.clip((frame - self.start) / (self.end - self.start), 0.0, 1.0)
        values = np.zeros(points)
        values += np.bincount(self.point, self.change * share, minlength=points)
        return values

    def _without_rests(self) -> Ramps:
        kept = self.change != 0
        return Ramps(self.point[kept], self.start[kept], self.end[kept], self.change[kept])


@dataclass(frozen=True)
class Fit:
    """Ramps and how far they are from what they stand for.

    Attributes
    ----------
    ramps : Ramps
    error : (K,) float array
        Largest difference at each point, over time.
    """

    ramps: Ramps
    error: Array


def fit(frames: Array, histories: Array, tolerance: Array | float = TOLERANCE) -> Fit:
    """Stand a few ramps in for histories that change now and then.

    From the start of each movement the longest straight line that stays within the tolerance is taken, then the next
    (a funnel of slopes that narrows frame by frame). The ends of a movement are met exactly, so that points at rest
    are where they were, to half a `QUANTUM`.

    Parameters
    ----------
    frames : (T,) float array
        Frame numbers, ascending.
    histories : (T, K) float array
        Values of K points, 0 at the first frame.
    tolerance : float or (K,) float array
        Largest error while a value moves.

    Returns
    -------
    Fit

    Examples
    --------
    A print that is pressed between frames 2 and 4 takes one ramp:

    >>> pressed = fit(np.arange(6.0), -np.array([0, 0, 0, 1, 2, 2])[:, None] / 128)
    >>> pressed.ramps.start, pressed.ramps.end, pressed.ramps.change
    (array([2.]), array([4.]), array([-0.015625]))
    """
    values = np.round(histories / QUANTUM) * QUANTUM
    count = values.shape[1]
    margin = np.broadcast_to(np.maximum(np.asarray(tolerance) - QUANTUM, 0.0), count)
    moves = np.diff(values, axis=0) != 0
    rests = np.ones((len(frames), count), dtype=bool)
    rests[1:-1] = ~(moves[:-1] & moves[1:])

    begin = np.zeros(count, dtype=np.intp)
    origin, low, high = np.zeros((3, count))
    rising = np.zeros(count, dtype=bool)
    parts: list[Ramps] = []

    def close(points: Indices, at: int, value: Array) -> None:
        parts.append(Ramps(points, frames[begin[points]], np.full(len(points), frames[at]), value - origin[points]))
        begin[points], origin[points] = at, value
        low[points], high[points] = -np.inf, np.inf

    for at in range(1, len(frames)):
        fresh = moves[at - 1] & ~rising
        begin[fresh], origin[fresh] = at - 1, values[at - 1, fresh]
        low[fresh], high[fresh] = -np.inf, np.inf
        rising |= fresh
        moving = np.flatnonzero(rising)
        if not len(moving):
            continue
        slack = np.where(rests[at, moving], 0.0, margin[moving])
        lower, upper = _slopes(values[at, moving] - origin[moving], slack, frames[at] - frames[begin[moving]])
        missed = np.maximum(lower, low[moving]) > np.minimum(upper, high[moving])
        if missed.any():
            turning = moving[missed]
            run = frames[at - 1] - frames[begin[turning]]
            slope = np.clip((values[at - 1, turning] - origin[turning]) / run, low[turning], high[turning])
            close(turning, at - 1, np.round((origin[turning] + slope * run) / QUANTUM) * QUANTUM)
            rise, step = values[at, turning] - origin[turning], frames[at] - frames[at - 1]
            lower[missed], upper[missed] = _slopes(rise, slack[missed], step)
        low[moving], high[moving] = np.maximum(lower, low[moving]), np.minimum(upper, high[moving])
        settled = moving[rests[at, moving]]
        if len(settled):
            close(settled, at, values[at, settled])
            rising[settled] = False

    ramps = Ramps.joined(parts)._without_rests()
    return Fit(ramps, _largest_error(ramps, frames, values) + QUANTUM / 2)


def _slopes(rise: Array, slack: Array, run: Array | float) -> tuple[Array, Array]:
    """Least and greatest slopes of lines that pass a rise after a run, within the slack."""
    return (rise - slack) / run, (rise + slack) / run


def _largest_error(ramps: Ramps, frames: Array, values: Array) -> Array:
    """Largest difference between the ramps' sum and the values, over the frames, (K,)."""
    count = values.shape[1]
    share = np.clip((frames[:, None] - ramps.start) / (ramps.end - ramps.start), 0.0, 1.0)
    cell = (np.arange(len(frames))[:, None] * count + ramps.point).ravel()
    fitted = np.bincount(cell, (share * ramps.change).ravel(), minlength=len(frames) * count)
    error: Array = np.abs(fitted.reshape(len(frames), count) - values).max(axis=0)
    return error
