"""Flight with linear drag, in closed form: with the settling speed v_s and T = v_s/g,

x = x0 + v0·T·(1 - e^(-t/T)), and z falls besides by v_s·(t - T·(1 - e^(-t/T))).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

HALVINGS = 24
"""Of the time in which something lands: to a ten-millionth of the longest flight."""
ROUNDS = 6
"""In which a landing on level ground is taken to the height of where it came down; what does not settle is halved."""
SETTLED = 1e-6
"""Difference of height at which it has [m]."""
LONGEST_FLIGHT = 6.0
"""What has not come down by then is gone [s]."""


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
    passed = -drag_time * np.expm1(-time / drag_time)
    place = start + velocity * passed[:, None]
    place[:, 2] -= gravity * drag_time * (time - passed)
    return place


def landing_times(
    start: Array, velocity: Array, drag_time: Array, gravity: float, height: Callable[[Array, Array], Array]
) -> Array:
    """When each comes down to the ground, (N,) [s], from its apex on; `LONGEST_FLIGHT` at most.

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

    time, left = np.zeros(len(start)), np.arange(len(start))
    level = start[:, 2].copy()
    for _ in range(ROUNDS):
        if not len(left):
            return time
        flying = start[left], velocity[left], drag_time[left], gravity
        time[left] = _crossing(*flying, _level(level[left]))
        place = position(*flying[:3], time[left], gravity)
        found = ground(place[:, 0], place[:, 1])
        settled = np.isclose(found, level[left], rtol=0.0, atol=SETTLED)
        level[left] = found
        left = left[~settled]
    if len(left):
        time[left] = _crossing(start[left], velocity[left], drag_time[left], gravity, ground)
    return time


def _level(heights: Array) -> Callable[[Array, Array], Array]:
    """Ground at one height for each, wherever it comes down."""
    return lambda *_: heights


def _crossing(
    start: Array, velocity: Array, drag_time: Array, gravity: float, ground: Callable[[Array, Array], Array]
) -> Array:
    """When flights cross heights on their way down, (N,) [s], by halving."""
    up = np.maximum(velocity[:, 2], 0.0)
    early = drag_time * np.log1p(up / (gravity * drag_time))  # at the apex
    late = np.full(len(start), LONGEST_FLIGHT)
    for _ in range(HALVINGS):
        middle = (early + late) / 2
        place = position(start, velocity, drag_time, middle, gravity)
        flies = place[:, 2] > ground(place[:, 0], place[:, 1])
        early, late = np.where(flies, middle, early), np.where(flies, late, middle)
    return late
