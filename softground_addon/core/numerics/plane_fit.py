"""The slope of the ground under a sole or a body, and smoothing over time."""

from __future__ import annotations

import numpy as np

from .arrays import Array


def fitted_slope(places: Array, weights: Array) -> Array:
    """Angles of the plane through places on the ground, (F, 2) along x and y [rad], by weighted least squares.

    Parameters
    ----------
    places : (F, K, 3) float array
        Points of the ground [m]; those that are not finite do not count.
    weights : (F, K) float array
    """
    known = np.isfinite(places).all(axis=-1)
    weight = np.where(known, weights, 0.0)
    points = np.where(known[..., None], places, 0.0)
    total = np.maximum(weight.sum(axis=1), 1e-12)
    points = points - (np.einsum("fk,fki->fi", weight, points) / total[:, None])[:, None]
    moment = np.einsum("fk,fki,fkj->fij", weight, points, points)
    xx, xy, yy, xz, yz = (moment[:, i, j] for i, j in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2)))
    determinant = xx * yy - xy**2
    solvable = determinant > 1e-9 * np.maximum(xx + yy, 1e-12) ** 2
    safe = np.where(solvable, determinant, 1.0)
    rise = np.stack([yy * xz - xy * yz, xx * yz - xy * xz], axis=-1) / safe[:, None]
    return np.asarray(np.arctan(np.where(solvable[:, None], rise, 0.0)))


def smoothed(values: Array, width: float) -> Array:
    """Values (F, ...) under a Gaussian of a standard deviation in samples, the ends held."""
    if width <= 0 or len(values) < 2:
        return values
    reach = max(1, round(3 * width))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    return _filtered(values, kernel / kernel.sum())


def upper_envelope(values: Array, reach: int) -> Array:
    """A smooth curve nowhere below `values` (F,): their maximum over ±reach samples, under a bell as wide."""
    if reach < 1 or len(values) < 2:
        return values
    padded = np.pad(values, reach, mode="edge")
    highest = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1).max(axis=1)
    kernel = np.hanning(2 * reach + 3)[1:-1]
    return _filtered(highest, kernel / kernel.sum())


def _filtered(values: Array, kernel: Array) -> Array:
    reach = len(kernel) // 2
    padded = np.pad(values, [(reach, reach)] + [(0, 0)] * (values.ndim - 1), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, len(kernel), axis=0)
    return np.asarray(windows @ kernel)
