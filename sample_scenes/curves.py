"""Curves through a few numbers, for shapes and motions."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def monotone_cubic(x: ArrayLike, knots: ArrayLike, values: ArrayLike) -> Array:
    """Piecewise cubic that never overshoots its knots, so that level stretches stay level (Fritsch & Butland 1984).

    Knots must increase; outside them the end values continue.
    """
    knots, values = np.asarray(knots, float), np.asarray(values, float)
    width = np.diff(knots)
    secant = np.diff(values) / width
    same_sign = secant[:-1] * secant[1:] > 0
    w1, w2 = 2 * width[1:] + width[:-1], width[1:] + 2 * width[:-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        harmonic = (w1 + w2) / (w1 / secant[:-1] + w2 / secant[1:])
    slope = np.concatenate([secant[:1], np.where(same_sign, harmonic, 0.0), secant[-1:]])
    x = np.clip(np.asarray(x, float), knots[0], knots[-1])
    i = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, len(width) - 1)
    u = (x - knots[i]) / width[i]
    a, b, da, db = values[i], values[i + 1], slope[i] * width[i], slope[i + 1] * width[i]
    return a + u * (da + u * (3 * (b - a) - 2 * da - db + u * (2 * (a - b) + da + db)))


def periodic_cubic(phase: ArrayLike, knots: ArrayLike, values: ArrayLike) -> Array:
    """`monotone_cubic` over phases of a cycle of length 1; knots lie in [0, 1)."""
    knots, values = np.asarray(knots, float), np.asarray(values, float)
    around = np.concatenate([knots[-2:] - 1, knots, knots[:2] + 1])
    return monotone_cubic(np.mod(phase, 1.0), around, np.concatenate([values[-2:], values, values[:2]]))


def quintic(u: ArrayLike, start: ArrayLike, end: ArrayLike, start_slope: ArrayLike, end_slope: ArrayLike) -> Array:
    """Fifth-degree curve over u in [0, 1] with given ends and slopes, and no curvature at either end."""
    u = np.asarray(u, float)
    rise = u**3 * (10 - 15 * u + 6 * u**2)
    leave = u - u**3 * (6 - 8 * u + 3 * u**2)
    arrive = -(u**3) * (4 - 7 * u + 3 * u**2)
    return (1 - rise) * start + rise * end + leave * start_slope + arrive * end_slope


def clamped_spline(
    u: ArrayLike, knots: ArrayLike, values: ArrayLike, start_slope: ArrayLike, end_slope: ArrayLike
) -> Array:
    """Cubic spline with continuous curvature through values (K, ...) at increasing knots, with given end slopes.

    Outside the knots the end values continue.
    """
    u, knots, values = np.asarray(u, float), np.asarray(knots, float), np.asarray(values, float)
    shape = values.shape[1:]
    flat = values.reshape(len(knots), -1)
    width = np.diff(knots)
    secant = np.diff(flat, axis=0) / width[:, None]
    system, right = np.eye(len(knots)), np.empty_like(flat)
    right[0], right[-1] = np.ravel(start_slope), np.ravel(end_slope)
    for i in range(1, len(knots) - 1):
        before, after = width[i - 1], width[i]
        system[i, i - 1 : i + 2] = after, 2 * (before + after), before
        right[i] = 3 * (after * secant[i - 1] + before * secant[i])
    slope = np.linalg.solve(system, right)
    u = np.clip(u, knots[0], knots[-1])
    i = np.clip(np.searchsorted(knots, u, side="right") - 1, 0, len(width) - 1)
    w = width[i][..., None]
    s = (u - knots[i])[..., None] / w
    a, b, da, db = flat[i], flat[i + 1], slope[i] * w, slope[i + 1] * w
    result = a + s * (da + s * (3 * (b - a) - 2 * da - db + s * (2 * (a - b) + da + db)))
    return result.reshape(*u.shape, *shape)


def quintic_path(
    times: ArrayLike, knots: ArrayLike, values: ArrayLike, slopes: ArrayLike, curvatures: ArrayLike
) -> Array:
    """Path through values (K, ...) at increasing knots with given slopes and curvatures there, fifth degree between.

    Outside the knots the end values continue. Where slopes and curvatures are those of a fall, so is the path.
    """
    t, knots = np.asarray(times, float), np.asarray(knots, float)
    p, v, a = (np.asarray(part, float) for part in (values, slopes, curvatures))
    t = np.clip(t, knots[0], knots[-1])
    i = np.clip(np.searchsorted(knots, t, side="right") - 1, 0, len(knots) - 2)
    shape = (-1, *[1] * (p.ndim - 1))
    width = (knots[i + 1] - knots[i]).reshape(shape)
    u = (t - knots[i]).reshape(shape) / width
    p0, p1, v0, v1 = p[i], p[i + 1], v[i] * width, v[i + 1] * width
    a0, a1 = a[i] * width**2, a[i + 1] * width**2
    rise = p1 - p0
    c3 = 10 * rise - 6 * v0 - 4 * v1 - 1.5 * a0 + 0.5 * a1
    c4 = -15 * rise + 8 * v0 + 7 * v1 + 1.5 * a0 - a1
    c5 = 6 * rise - 3 * (v0 + v1) - 0.5 * (a0 - a1)
    return p0 + u * (v0 + u * (a0 / 2 + u * (c3 + u * (c4 + u * c5))))
