"""Flight with linear drag, in closed form: with the settling speed v_s and T = v_s/g,

x = x0 + v0·T·(1 - e^(-t/T)), and z falls besides by v_s·(t - T·(1 - e^(-t/T))).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..numerics.arrays import Array
from ..numerics.cell_keys import among, cells_of, keys_of
from ..numerics.slices import Slices, sliced

HALVINGS = 20
"""Of the time between a landing on level ground that is too early and one that is too late: to its millionth part."""
NEWTON = 8
"""Rounds in which a landing on level ground is found, to the last bits."""
ROUNDS = 6
"""In which a landing on level ground is taken to the height of where it came down; what does not settle is halved."""
SETTLED = 1e-6
"""Difference of height at which it has [m]."""
LONGEST_FLIGHT = 6.0
"""What has not come down by then is gone [s]."""


def coasting(drag_time: Array, time: Array) -> Array:
    """Time for which a piece would fly as fast as at first to get as far as it does against drag, (N,) [s].

    What is left of the time, it goes with the flow: falls as it settles, and drifts as the wind blows.

    Parameters
    ----------
    drag_time, time
        As of `position`.
    """
    return np.asarray(-drag_time * np.expm1(-time / drag_time))


def position(start: Array, velocity: Array, drag_time: Array, time: Array, gravity: float) -> Array:
    """Places after times in the air, (N, 3) [m].

    Parameters
    ----------
    start, velocity : (N, 3) float arrays
        At first [m], [m/s].
    drag_time : (N,) float array
        T: settling speed over gravity [s].
    time : (N,) float array
        In the air [s].
    gravity : float
        [m/s²]

    Examples
    --------
    >>> rise = position(np.zeros((1, 3)), np.array([[1.0, 0, 2.0]]), np.array([1e4]), np.array([0.2]), 9.81)
    >>> rise.round(3)  # without drag: 0.2 m ahead, 0.4 - 9.81/2·0.04 up
    array([[0.2  , 0.   , 0.204]])
    """
    passed = coasting(drag_time, time)
    place = start + velocity * passed[:, None]
    place[:, 2] -= gravity * drag_time * (time - passed)
    return place


@sliced
def landing_times(
    start: Array, velocity: Array, drag_time: Array, gravity: float, height: Callable[[Array, Array], Array]
) -> Slices[Array]:
    """Time until each comes down to the ground, (N,) [s], from its apex on; `LONGEST_FLIGHT` at most.

    The ground costs far more than the flight. So each first lands on level ground, at the height of where it came down
    the last time: nearly all settle in a few rounds. The others, at steep walls, are found by halving.

    Parameters
    ----------
    start, velocity, drag_time, gravity
        As of `position`.
    height : callable
        The ground's heights at places x, y (N,) [m]; NaN where there is none.
    """

    def ground(x: Array, y: Array) -> Array:
        return np.nan_to_num(height(x, y), nan=-np.inf)

    time, aloft = np.zeros(len(start)), np.arange(len(start))
    early, late = _apex(velocity, drag_time, gravity), np.full(len(start), LONGEST_FLIGHT)
    level = start[:, 2].copy()
    for _ in range(ROUNDS):
        if not len(aloft):
            return time
        yield
        flying = start[aloft], velocity[aloft], drag_time[aloft]
        time[aloft] = down = _down_to(level[aloft], *flying, gravity)
        place = position(*flying, down, gravity)
        below = ground(place[:, 0], place[:, 1])
        flies = below < level[aloft]
        early[aloft[flies]], late[aloft[~flies]] = down[flies], down[~flies]
        settled = np.isclose(below, level[aloft], rtol=0.0, atol=SETTLED)
        level[aloft] = below
        aloft = aloft[~settled]
    begin, end, flying = early[aloft], late[aloft], (start[aloft], velocity[aloft], drag_time[aloft])
    for _ in range(HALVINGS if len(aloft) else 0):
        yield
        middle = (begin + end) / 2
        place = position(*flying, middle, gravity)
        flies = place[:, 2] > ground(place[:, 0], place[:, 1])
        begin, end = np.where(flies, middle, begin), np.where(flies, end, middle)
    time[aloft] = end
    return time


class SampledHeights:
    """Heights of a ground that are looked up once for each corner of the squares that are asked for, bilinear between.

    Parameters
    ----------
    height : callable
        Heights at places x, y (N,) [m]; NaN where there is no ground.
    side : float
        Of a square [m].
    is_quick : bool
        True where looking up takes longer than working out: each corner is worked out whenever it is asked for.

    Examples
    --------
    >>> plane = SampledHeights(lambda x, y: 2.0 * x - y, 0.1)
    >>> plane(np.array([0.33, -1.0]), np.array([0.0, 0.25])).round(9).tolist()
    [0.66, -2.25]
    """

    def __init__(self, height: Callable[[Array, Array], Array], side: float, *, is_quick: bool = False) -> None:
        self._height, self._side, self._is_quick = height, side, is_quick
        self._keys, self._values = np.empty(0, np.int64), np.empty(0)

    def __call__(self, x: Array, y: Array) -> Array:
        """Heights at places x, y (N,) [m]."""
        at = np.stack([x, y], axis=-1) / self._side
        first = np.floor(at)
        u, v = (at - first).T
        low, high = 1.0 - u, 1.0 - v
        weights = (low * high, u * high, low * v, u * v)
        around = [first + shift for shift in ((0, 0), (1, 0), (0, 1), (1, 1))]
        if self._is_quick:
            heights = [self._height(*(corner * self._side).T) for corner in around]
            return np.asarray(sum(weight * value for weight, value in zip(weights, heights, strict=True)))
        corners = [keys_of(corner) for corner in around]
        wanted = np.concatenate(corners)
        new = np.unique(wanted[~among(self._keys, wanted)])
        if len(new):
            place = np.searchsorted(self._keys, new)
            self._values = np.insert(self._values, place, self._height(*(cells_of(new) * self._side).T))
            self._keys = np.insert(self._keys, place, new)
        values = (self._values[np.searchsorted(self._keys, keys)] for keys in corners)
        return np.asarray(sum(weight * value for weight, value in zip(weights, values, strict=True)))


def _down_to(level: Array, start: Array, velocity: Array, drag_time: Array, gravity: float) -> Array:
    """Times at which flights cross levels on their way down, (N,) [s], by Newton's method.

    It begins no earlier than the crossing: a fall by h from rest takes sqrt(2·h/g) + h/v_s at most.
    """
    settling, apex = gravity * drag_time, _apex(velocity, drag_time, gravity)
    rate = velocity[:, 2] + settling

    def height(time: Array) -> Array:
        return np.asarray(start[:, 2] - rate * drag_time * np.expm1(-time / drag_time) - settling * time)

    level = np.maximum(level, height(np.full(len(start), LONGEST_FLIGHT)))
    fall = np.maximum(height(apex) - level, 0.0)
    time = apex + np.sqrt(2 * fall / gravity) + fall / settling
    for _ in range(NEWTON):
        falling = settling - rate * np.exp(-time / drag_time)
        step = np.divide(height(time) - level, falling, out=np.zeros_like(time), where=falling > 0)
        time = np.clip(time + step, apex, LONGEST_FLIGHT)
    return time


def _apex(velocity: Array, drag_time: Array, gravity: float) -> Array:
    """Times at which flights are highest, (N,) [s]."""
    return np.asarray(drag_time * np.log1p(np.maximum(velocity[:, 2], 0.0) / (gravity * drag_time)))
