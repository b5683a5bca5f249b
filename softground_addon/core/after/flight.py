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
    """When each comes down to the ground, (N,) [s], by halving from its apex on; `LONGEST_FLIGHT` at most.

    Parameters
    ----------
    start, velocity, drag_time, gravity
        As of `position`.
    height : callable
        The ground's heights at places x, y (N,) [m]; NaN where there is none.
    """
    up = np.maximum(velocity[:, 2], 0.0)
    early = drag_time * np.log1p(up / (gravity * drag_time))  # at the apex
    late = np.full(len(start), LONGEST_FLIGHT)
    for _ in range(HALVINGS):
        middle = (early + late) / 2
        place = position(start, velocity, drag_time, middle, gravity)
        flies = place[:, 2] > np.nan_to_num(height(place[:, 0], place[:, 1]), nan=-np.inf)
        early, late = np.where(flies, middle, early), np.where(flies, late, middle)
    return late
