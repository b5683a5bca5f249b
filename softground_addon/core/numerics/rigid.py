"""Rotations and rigid displacements over time, as stacks of matrices."""

from __future__ import annotations

import numpy as np

from .arrays import Array

_SMALL = 1e-12
"""Squared lengths and angles below this are none."""


def rotation(vector: Array) -> Array:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3) [rad] (Rodrigues' formula)."""
    angle = np.linalg.norm(vector, axis=-1)[..., None, None]
    cross = cross_matrix(vector)
    squared = np.maximum(angle**2, _SMALL)
    sine = np.where(angle**2 > _SMALL, np.sin(angle) / np.sqrt(squared), 1.0)
    versine = np.where(angle**2 > _SMALL, (1.0 - np.cos(angle)) / squared, 0.5)
    return np.asarray(np.eye(3) + sine * cross + versine * (cross @ cross))


def cross_matrix(vector: Array) -> Array:
    """Matrices (..., 3, 3) of the cross product with `vector` (..., 3) from the left."""
    x, y, z = np.moveaxis(vector, -1, 0)
    zero = np.zeros_like(x)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*x.shape, 3, 3)


def turn_between(start: Array, end: Array) -> Array:
    """Rotation vectors (..., 3) of the shortest turns from the directions `start` to `end` (..., 3).

    None where one of them has no direction; opposite directions turn about any axis across them.
    """
    a, b = unit(start), unit(end)
    axis = np.cross(a, b)
    sine = np.linalg.norm(axis, axis=-1, keepdims=True)
    cosine = np.sum(a * b, axis=-1, keepdims=True)
    opposite = (sine < 1e-9) & (cosine < 0)
    direction = np.where(opposite, unit(perpendicular(a)), axis / np.maximum(sine, 1e-300))
    return np.asarray(direction * np.arctan2(sine, cosine))


def perpendicular(directions: Array) -> Array:
    """A vector across each of some unit vectors (..., 3), of no particular length or side."""
    return np.cross(directions, np.where(np.abs(directions[..., :1]) < 0.9, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))


def nearest_rotation(matrices: Array) -> Array:
    """Rotations (..., 3, 3) closest to the given matrices (polar decomposition)."""
    u, _, vh = np.linalg.svd(matrices)
    handed = np.ones(matrices.shape[:-1])
    handed[..., 2] = np.sign(np.linalg.det(u @ vh))
    return np.asarray((u * handed[..., None, :]) @ vh)


def unit(vectors: Array) -> Array:
    """Unit vectors (..., 3), 0 where there is no direction."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(np.asarray(vectors, float)), where=length > 0)


def displacement(turn: Array, start: Array, end: Array) -> Array:
    """Rigid displacements (..., 4, 4) that turn by matrices (..., 3, 3) and carry the points `start` to `end`."""
    result = np.zeros((*turn.shape[:-2], 4, 4))
    result[..., :3, :3] = turn
    result[..., :3, 3] = end - (turn @ start[..., None])[..., 0]
    result[..., 3, 3] = 1.0
    return result


def carried(motion: Array, points: Array) -> Array:
    """Points (..., 3) carried by rigid displacements (..., 4, 4)."""
    return np.asarray((motion[..., :3, :3] @ points[..., None])[..., 0] + motion[..., :3, 3])


def inverse(motion: Array) -> Array:
    """Inverses of rigid displacements (..., 4, 4)."""
    back = np.swapaxes(motion[..., :3, :3], -1, -2)
    result = np.zeros_like(motion)
    result[..., :3, :3] = back
    result[..., :3, 3] = -(back @ motion[..., :3, 3, None])[..., 0]
    result[..., 3, 3] = 1.0
    return result
