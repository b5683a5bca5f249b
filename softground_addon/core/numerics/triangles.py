"""Pairs of triangles and the points that may lie in them, all at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .arrays import Array, Indices

SLACK = 1e-9
"""Points on a shared edge lie in both triangles: without it rounding could let them fall between."""


class Barycentric(NamedTuple):
    """Coordinates of N points in N triangles, at a + u·(b - a) + v·(c - a); `inside` is true where they are inside."""

    u: Array
    v: Array
    inside: NDArray[np.bool_]


def barycentric(corners: Array, points: Array) -> Barycentric:
    """Barycentric coordinates in the plane.

    Parameters
    ----------
    corners : (N, 3, 2) float array
        Of a triangle for each point; those that cover no area hold no point.
    points : (N, 2) float array
    """
    a = corners[:, 0]
    ab, ac, ap = corners[:, 1] - a, corners[:, 2] - a, points - a
    area = cross(ab, ac)
    flat = area == 0
    area = np.where(flat, 1.0, area)
    u, v = cross(ap, ac) / area, cross(ab, ap) / area
    return Barycentric(u, v, ~flat & (u >= -SLACK) & (v >= -SLACK) & (u + v <= 1 + SLACK))


def cross(a: Array, b: Array) -> Array:
    """Cross products of vectors in the plane (..., 2), (...)."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def enumerated(counts: Indices) -> tuple[Indices, Indices]:
    """Owners and numbers within them: for counts (2, 3), (0, 0, 1, 1, 1) and (0, 1, 0, 1, 2)."""
    owner = np.repeat(np.arange(len(counts)), counts)
    return owner, np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
