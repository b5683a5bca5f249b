"""Where a gait goes: a path in the plane and the height of the ground under it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sample_scenes.curves import clamped_spline

Array = NDArray[np.float64]
Heights = Callable[[Array, Array], Array]
"""Ground height [m] at places x and y [m] in the body's frame."""

_SPACING = 0.01  # m between the samples of a path
_FORESIGHT = 1.0  # m
_REACH = 0.12  # m over which the slope under a foot is taken: half a foot to either side


def level(x: Array, y: Array) -> Array:  # noqa: ARG001  (a height everywhere)
    """Level ground."""
    return np.zeros_like(np.asarray(x, float))


class Course:
    """A way over the ground by its length; straight on beyond both ends.

    Parameters
    ----------
    points : sequence of (x, y), optional
        Points that the way leads through smoothly [m]; by default it runs along x from the origin.
    heights : callable, optional
        Height of the ground [m] at x, y; must take arrays. Level by default.
    """

    def __init__(self, points: Sequence[ArrayLike] = ((0.0, 0.0), (1.0, 0.0)), heights: Heights = level) -> None:
        corners = np.asarray(points, float)
        chords = np.linalg.norm(np.diff(corners, axis=0), axis=1)
        knots = np.concatenate([[0.0], np.cumsum(chords)])
        ends = np.diff(corners, axis=0) / chords[:, None]
        fine = np.linspace(0.0, knots[-1], max(2, round(knots[-1] / _SPACING) + 1))
        path = clamped_spline(fine, knots, corners, ends[0], ends[-1])
        self.heights = heights
        self._length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
        self._path = path
        tangent = np.gradient(path, self._length, axis=0)
        tangent[0], tangent[-1] = ends[0], ends[-1]
        self._heading = np.unwrap(np.arctan2(tangent[:, 1], tangent[:, 0]))
        # People lean into a bend before it begins: its curvature counts for a metre to either side.
        half = round(_FORESIGHT / _SPACING)
        self._around = np.linspace(-_FORESIGHT, knots[-1] + _FORESIGHT, len(fine) + 2 * half)
        window = np.hanning(2 * half + 1)
        bends = np.pad(np.gradient(self._heading, self._length), 2 * half)
        self._curvature = np.convolve(bends, window / window.sum(), mode="valid")

    def heading(self, along: ArrayLike) -> Array:
        """Direction of the way about z, 0 along x, at lengths (...) [rad]."""
        return np.interp(along, self._length, self._heading)

    def curvature(self, along: ArrayLike) -> Array:
        """Turn to the left per length, smoothed over a metre to either side [1/m]."""
        return np.interp(along, self._around, self._curvature)

    def place(self, along: ArrayLike, aside: ArrayLike = 0.0) -> Array:
        """Points of the plane at lengths along and distances to the left of the way, (..., 2) [m]."""
        along, aside = np.broadcast_arrays(np.asarray(along, float), np.asarray(aside, float))
        heading = self.heading(along)
        ahead = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
        left = np.stack([-ahead[..., 1], ahead[..., 0]], axis=-1)
        on = np.stack([np.interp(along, self._length, self._path[:, i]) for i in (0, 1)], axis=-1)
        beyond = along - np.clip(along, 0.0, self._length[-1])
        return on + beyond[..., None] * ahead + aside[..., None] * left

    def ground(self, along: ArrayLike, aside: ArrayLike = 0.0) -> Array:
        """Height of the ground at lengths along and distances to the left of the way, (...) [m]."""
        place = self.place(along, aside)
        return np.asarray(self.heights(place[..., 0], place[..., 1]), float)

    def slope(self, place: ArrayLike, heading: ArrayLike) -> tuple[Array, Array]:
        """Rise of the ground at points (..., 2) toward a heading and toward its left, (...) each [rad]."""
        place, heading = np.asarray(place, float), np.asarray(heading, float)
        rises = []
        for turn in (0.0, np.pi / 2):
            step = _REACH * np.stack([np.cos(heading + turn), np.sin(heading + turn)], axis=-1)
            ahead, behind = place + step, place - step
            rise = self.heights(ahead[..., 0], ahead[..., 1]) - self.heights(behind[..., 0], behind[..., 1])
            rises.append(np.arctan2(rise, 2 * _REACH))
        return rises[0], rises[1]


STRAIGHT = Course()
"""Along x over level ground."""
