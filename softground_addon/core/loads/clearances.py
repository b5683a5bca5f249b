"""Distances of points from the ground, along its normal."""

from __future__ import annotations

import numpy as np

from ..ground.heightfield import Terrain
from ..numerics.arrays import Array

STEEPEST_GROUND = np.cos(np.radians(60.0))
"""Vertical part of the normal of the steepest ground that bears a sole: more is a wall."""


def ground_normal(terrain: Terrain, x: Array, y: Array, *, reach: float) -> Array:
    """Unit normals of the terrain at positions of any shape (...,), from central differences over ±reach [m].

    Returns
    -------
    (..., 3) float array, NaN where the ground is missing.
    """
    slope_x = (terrain.heights(x + reach, y) - terrain.heights(x - reach, y)) / (2 * reach)
    slope_y = (terrain.heights(x, y + reach) - terrain.heights(x, y - reach)) / (2 * reach)
    normal = np.stack([-slope_x, -slope_y, np.ones_like(slope_x)], axis=-1)
    return normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def clearances(points: Array, terrain: Terrain, *, reach: float) -> tuple[Array, Array]:
    """Distances of a sole's landmarks from the ground, measured along its normal.

    Parameters
    ----------
    points : (N, L, 3) float array
        World positions of the landmarks [m].
    reach : float
        Half the distance over which the ground's slope is read [m].

    Returns
    -------
    clearance : (N, L) float array [m]
        Infinite where the ground is missing or too steep to stand on.
    normal : (N, L, 3) float array
        The ground's unit normal, vertical where there is none.
    """
    x, y, z = np.moveaxis(points, -1, 0)
    normal = ground_normal(terrain, x, y, reach=reach)
    clearance = (z - terrain.heights(x, y)) * normal[..., 2]
    bears = np.isfinite(clearance) & (normal[..., 2] >= STEEPEST_GROUND)
    return np.where(bears, clearance, np.inf), np.where(np.isfinite(normal), normal, (0.0, 0.0, 1.0))
