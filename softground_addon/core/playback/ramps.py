"""Movement of the ground over time, in closed form: a few ramps per point.

A ramp changes a value by `change` between two frames, linearly, and holds it before and after. A point's value at any
time is the sum of its ramps, so that frames can be shown in any order, and between frames, without a cache.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array, Indices
from ..numerics.intervals import in_order
from ..numerics.key_reduction import bend_lines

Intervals = TypeVar("Intervals", bound=Any)

TOLERANCE = 2e-4
"""Largest error of a fitted height while it moves [m]; at rest there is none."""

QUANTUM = 2.0**-20
"""Step of fitted values [m], about a micrometre: sums of its multiples below 16 m are exact in single precision."""

REST = 12
"""Frames for which a value stays the same if it is at rest and not just between two movements of one step."""


@dataclass(frozen=True)
class Ramps:
    """Histories of points: value(t) = Σ change · clip((t - start) / (end - start), 0, 1).

    Attributes
    ----------
    point : (R,) int array
        The point that each ramp belongs to, ascending; each point's ramps are in the order of their start.
    start, end : (R,) float arrays
        Frames between which the values change; start < end.
    change : (R, C) float array
        Change of each of a point's C values.
    """

    point: Indices
    start: Array
    end: Array
    change: Array

    @classmethod
    def joined(cls, parts: Sequence[Ramps], channels: int) -> Ramps:
        """All ramps of several sets, which may share points; the number of values is needed if there is no set."""
        return joined([cls(np.zeros(0, dtype=np.intp), np.zeros(0), np.zeros(0), np.zeros((0, channels))), *parts])

    def at(self, frame: float, points: int) -> Array:
        """Values of points 0 to `points` - 1 at a frame, (points, C)."""
        share = np.clip((frame - self.start) / (self.end - self.start), 0.0, 1.0)
        values = np.zeros((points, self.change.shape[1]))
        for channel, change in enumerate(self.change.T):
            values[:, channel] += np.bincount(self.point, change * share, minlength=points)
        return values


def joined(parts: Sequence[Intervals]) -> Intervals:
    """One set of intervals of points from at least one set, by point and time."""
    whole = side_by_side(parts)
    order = in_order(whole.point, whole.start)
    return replace(whole, **{field.name: getattr(whole, field.name)[order] for field in fields(whole)})


def side_by_side(parts: Sequence[Intervals]) -> Intervals:
    """The same in the order of the sets."""
    whole = {field.name: np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(parts[0])}
    return replace(parts[0], **whole)


@dataclass(frozen=True)
class Fit:
    """Ramps and their distance from the values that they stand for.

    Attributes
    ----------
    error : (K, C) float array
        Largest difference of each value at each point, over time.
    """

    ramps: Ramps
    error: Array


def fit(frames: Array, histories: Array, tolerance: Array, ends: Array | None = None) -> Fit:
    """Stand a few ramps in for histories that change now and then.

    Each movement begins as one straight line through its ends; where the values are farther from it than the tolerance,
    it is bent to them where they are farthest, and so on (`key_reduction`). All values of a point bend at the same
    frames. Points at rest for `REST` frames are where they were, to half a `QUANTUM`.

    Parameters
    ----------
    frames : (T,) float array
        Frame numbers, ascending.
    histories : (T, K, C) float array
        Values of K points, 0 at the first frame.
    tolerance : (C,) or (K, C) float array
        Largest error of each value while it moves.
    ends : (K, C) float array, optional
        Points move from when one of their values is further than this from its first, until none is from its last.

    Returns
    -------
    Fit

    Examples
    --------
    A print that is pressed between frames 2 and 4 takes one ramp:

    >>> pressed = fit(np.arange(6.0), -np.array([0, 0, 0, 1, 2, 2])[:, None, None] / 128, np.array([TOLERANCE]))
    >>> pressed.ramps.start, pressed.ramps.end, pressed.ramps.change
    (array([2.]), array([4.]), array([[-0.015625]]))
    """
    of_channels = np.moveaxis(histories, -1, 0)
    margin = np.broadcast_to(np.maximum(tolerance - QUANTUM, QUANTUM / 2), histories.shape[1:]).T
    start, stop, off = _spans(of_channels, np.zeros_like(margin) if ends is None else ends.T)
    count = stop - start + 1
    first = np.cumsum(count) - count
    point = np.repeat(np.arange(len(count)), count)
    number = np.arange(len(point)) - np.repeat(first - start, count)
    values = np.stack([of_channel[number, point] for of_channel in of_channels])
    values[:, first] = 0.0
    values[:, first + count - 1] = of_channels[:, -1]
    values = np.round(values / QUANTUM) * QUANTUM
    knot = _ends_of_movements(values, point, (frames[number] - frames[0]) / (frames[1] - frames[0]))
    error = bend_lines(frames[number], values, point, knot, margin)
    at = np.flatnonzero(knot)
    change = np.diff(values.take(at, axis=1)).T
    ramp = np.flatnonzero((point[at[:-1]] == point[at[1:]]) & change.any(axis=1))
    when = frames[number[at]]
    return Fit(Ramps(point[at[ramp]], when[ramp], when[ramp + 1], change[ramp]), (error + off).T + QUANTUM / 2)


def _spans(histories: Array, ends: Array) -> tuple[Indices, Indices, Array]:
    """First and last sample of the movements of points, (K,) each; and how far they are off for that (C, K)."""
    samples = np.arange(histories.shape[1])[:, None]
    moved, remaining = np.abs(histories), np.abs(histories - histories[:, -1:])
    begun, going = ((far > ends[:, None]).any(axis=0) for far in (moved, remaining))
    begin = np.where(begun.any(axis=0), begun.argmax(axis=0), len(samples))
    end = np.where(going.any(axis=0), len(samples) - 1 - going[::-1].argmax(axis=0), -1)
    off = np.where(samples > end, remaining, np.where(samples < begin, moved, 0.0)).max(axis=1)
    start: Indices = np.clip(np.minimum(begin, end + 1) - 1, 0, None)
    stop: Indices = np.clip(end + 1, 1, len(samples) - 1)
    return start, stop, off


def grown(ramps: Ramps, points: Indices, change: Array, span: tuple[float, float]) -> Ramps:
    """Ramps that also bring points (N,) a change (N, C), as these points move: each ramp its part of it.

    Points without a ramp take theirs over a span of frames; theirs come last.

    Examples
    --------
    >>> pressed = Ramps(np.array([0, 0]), np.array([1.0, 3.0]), np.array([2.0, 4.0]), np.array([[-1.0], [-3.0]]))
    >>> deeper = grown(pressed, np.array([0, 5]), np.array([[-0.5], [0.25]]), (1.0, 4.0))
    >>> deeper.point.tolist(), deeper.change[:, 0].tolist(), deeper.start.tolist()
    ([0, 0, 5], [-1.125, -3.375, 0.25], [1.0, 3.0, 1.0])
    """
    path = np.abs(ramps.change).sum(axis=1)
    count = max(int(points.max(initial=-1)), int(ramps.point.max(initial=-1))) + 1
    whole = np.zeros((count, change.shape[1]))
    whole[points] = change
    length = np.bincount(ramps.point, path, minlength=count)
    share = path / np.where(length > 0, length, 1.0)[ramps.point]
    more = replace(ramps, change=ramps.change + share[:, None] * whole[ramps.point])
    still = points[length[points] == 0]
    start, end = (np.full(len(still), frame) for frame in span)
    return side_by_side([more, Ramps(still, start, end, whole[still])])


def _ends_of_movements(values: Array, point: Indices, when: Array) -> NDArray[np.bool_]:
    """True where movements of points begin or end, (S,), from their values (C, S); the others as of `bend_lines`."""
    moves = (np.diff(values) != 0).any(axis=0) & (np.diff(point) == 0)
    count = len(moves)
    before = np.maximum.accumulate(np.where(moves, np.arange(count), -1))
    after = np.minimum.accumulate(np.where(moves, np.arange(count), count)[::-1])[::-1]
    moving = np.zeros(count + 2, dtype=bool)
    is_short = when[after] - when[before] <= REST + 0.5
    moving[1:-1] = (before >= 0) & (after < count) & is_short & (point[before] == point[after])
    ends: NDArray[np.bool_] = moving[1:] != moving[:-1]
    return ends
