"""Acceleration of a sampled path by a smoothing spline that knows free fall.

A discrete smoothing spline is a zero-phase low-pass (its gain is 1/(1 + (f/cut-off)^6)) that needs no data beyond the
ends of the path, takes samples at any subset of the steps, and known accelerations at others.
"""

from __future__ import annotations

from math import comb

import numpy as np

from .arrays import Array, Mask
from .banded import solve_banded

_ORDER = 3
"""The penalty is on the third derivative, so the bandwidth of the normal equations is 3."""
_FALL_WEIGHT = 1e5
"""Weight of a known fall over that of the samples near the cut-off frequency."""


def smooth_path(
    path: Array,
    step: float,
    cutoff: float,
    *,
    sampled: Mask | None = None,
    falling: Mask | None = None,
    fall: float = 0.0,
    steady_ends: float = 0.0,
) -> tuple[Array, Array, Array]:
    """Low-passed path and its first two derivatives.

    Parameters
    ----------
    path : (N, C) float array
    step : float
        Time between steps [s].
    cutoff : float
        Frequency at which half the amplitude passes [Hz].
    sampled : (N,) bool array, optional
        Steps at which `path` is known; the spline fills in the others.
    falling : (N,) bool array, optional
        Steps at which the second derivative is known: 0 but for the last column, where it is -`fall`.
    fall : float
        [unit of path/s²]
    steady_ends : float
        Weight of a second derivative of 0 at both ends, where the samples lie on one side only.

    Returns
    -------
    position, velocity, acceleration : (N, C) float arrays
    """
    count = len(path)
    if count <= _ORDER:
        return path.copy(), np.zeros_like(path), np.zeros_like(path)
    weight = np.ones(count) if sampled is None else sampled.astype(float)
    # Per step, so that the cut-off is the same however few of the steps are sampled.
    scale = 2 * np.sin(np.pi * min(cutoff * step, 0.5))
    density = weight.mean()
    band = np.zeros((_ORDER + 1, count))
    band[0] = weight
    _add_difference(band, np.full(count - _ORDER, density / scale ** (2 * _ORDER)), _ORDER)
    if steady_ends:
        ends = np.zeros(count - 2)
        ends[[0, -1]] = steady_ends * density / (scale**4 * cutoff * step)
        _add_difference(band, ends, 2)
    right = weight[:, None] * path
    if falling is not None:
        rows = np.where(falling[1:-1], _FALL_WEIGHT * density / scale**4, 0.0)
        _add_difference(band, rows, 2)
        pull = -fall * step**2 * rows
        for offset, coefficient in enumerate((1.0, -2.0, 1.0)):
            right[offset : offset + count - 2, -1] += coefficient * pull
    position = solve_banded(band, right)
    change = np.diff(position, axis=0) / step
    velocity, acceleration = np.empty_like(position), np.empty_like(position)
    velocity[[0, -1]] = change[[0, -1]]
    velocity[1:-1] = (change[1:] + change[:-1]) / 2
    acceleration[1:-1] = np.diff(change, axis=0) / step
    acceleration[0] = 2 * acceleration[1] - acceleration[2]
    acceleration[-1] = 2 * acceleration[-2] - acceleration[-3]
    return position, velocity, acceleration


def _add_difference(band: Array, weight: Array, order: int) -> None:
    """Add the normal equations of weighted differences of an order to a symmetric band matrix.

    band[k, i] is the matrix element (i, i + k).
    """
    stencil = [(-1.0) ** place * comb(order, place) for place in range(order + 1)]
    for i, a in enumerate(stencil):
        for j in range(i, order + 1):
            band[j - i, i : i + len(weight)] += a * stencil[j] * weight


def share_of_noise(cutoff: float) -> float:
    """Part of the amplitude of white noise, over all its frequencies, that a cut-off [cycles per sample] passes."""
    frequency = (np.arange(256) + 0.5) / 512
    return float(np.mean(1 / (1 + (np.sin(np.pi * frequency) / np.sin(np.pi * min(cutoff, 0.5))) ** (2 * _ORDER))))
