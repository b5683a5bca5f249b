"""Quaternions and Euler angles of rotations over time, as Blender stores them."""

from __future__ import annotations

import numpy as np

from .arrays import Array


def quaternions(matrices: Array) -> Array:
    """Unit quaternions (F, 4), w first and not negative, of rotation matrices (F, 3, 3)."""
    m = matrices
    trace = np.trace(m, axis1=1, axis2=2)
    diagonal = np.diagonal(m, axis1=1, axis2=2)
    squares = np.concatenate([1 + trace[:, None], 1 + 2 * diagonal - trace[:, None]], axis=1)
    products = np.empty((len(m), 4, 4))  # row c: four times component c times (w, x, y, z) (Shepperd 1978)
    products[:, range(4), range(4)] = squares
    skew = np.stack([m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]], axis=1)
    products[:, 0, 1:] = products[:, 1:, 0] = skew
    symmetric = m + np.swapaxes(m, 1, 2)
    for i, j in ((0, 1), (0, 2), (1, 2)):
        products[:, 1 + i, 1 + j] = products[:, 1 + j, 1 + i] = symmetric[:, i, j]
    result = products[np.arange(len(m)), squares.argmax(axis=1)]
    result /= np.linalg.norm(result, axis=1, keepdims=True)
    return np.asarray(np.where(result[:, :1] < 0, -result, result))


def rotation_vectors(matrices: Array) -> Array:
    """Rotation vectors (F, 3) [rad], no longer than pi, of rotation matrices (F, 3, 3)."""
    quaternion = quaternions(matrices)
    sine = np.linalg.norm(quaternion[:, 1:], axis=1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, quaternion[:, :1])
    return np.asarray(quaternion[:, 1:] * np.where(sine > 1e-12, angle / np.maximum(sine, 1e-300), 2.0))


def rotation_matrices(quaternion: Array) -> Array:
    """Rotation matrices (F, 3, 3) of quaternions (F, 4) of any length but 0, w first."""
    w, x, y, z = (quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def euler_rotations(angles: Array, order: str) -> Array:
    """Rotation matrices (F, 3, 3) of Euler angles (F, 3) about x, y and z [rad].

    Parameters
    ----------
    angles : (F, 3) float array
    order : str
        Axes in the order in which they are applied, e.g. "XYZ".
    """
    result = np.tile(np.eye(3), (len(angles), 1, 1))
    for axis in map("XYZ".index, order):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        turn = np.tile(np.eye(3), (len(angles), 1, 1))
        turn[:, u, u] = turn[:, v, v] = np.cos(angles[:, axis])
        turn[:, v, u] = np.sin(angles[:, axis])
        turn[:, u, v] = -turn[:, v, u]
        result = turn @ result
    return result


def without_leaps(quaternion: Array) -> Array:
    """The same turns (F, 4) with signs that change nowhere from one sample to the next."""
    same = (quaternion[1:] * quaternion[:-1]).sum(axis=1) >= 0
    return quaternion * np.cumprod(np.append(1.0, np.where(same, 1.0, -1.0)))[:, None]


def axis_angles(quaternion: Array) -> Array:
    """Angles [rad] and axes (F, 4) of unit quaternions (F, 4), w first; y is the axis of no turn."""
    sine = np.linalg.norm(quaternion[:, 1:], axis=1, keepdims=True)
    angle = 2 * np.arctan2(sine, quaternion[:, :1])
    axis = np.divide(quaternion[:, 1:], sine, out=np.tile((0.0, 1.0, 0.0), (len(sine), 1)), where=sine > 1e-9)
    return np.concatenate([angle, axis], axis=1)


def euler_angles(matrices: Array, order: str, near: Array) -> Array:
    """Euler angles (F, 3) about x, y and z [rad] of rotation matrices (F, 3, 3), the nearest to given ones.

    Parameters
    ----------
    matrices : (F, 3, 3) float array
    order : str
        Axes in the order in which they are applied, e.g. "XYZ".
    near : (F, 3) float array
        Angles to stay close to: every rotation has many sets of angles.
    """
    i, j, k = ("XYZ".index(axis) for axis in order)
    sign = 1.0 if (i, j, k) in ((0, 1, 2), (1, 2, 0), (2, 0, 1)) else -1.0
    m = matrices
    middle = np.arcsin(np.clip(-sign * m[:, k, i], -1.0, 1.0))
    first = np.arctan2(sign * m[:, k, j], m[:, k, k])
    last = np.arctan2(sign * m[:, j, i], m[:, i, i])
    # Near gimbal lock only first -/+ last is known: keep the first as it was.
    locked = np.abs(m[:, k, i]) > 1 - 1e-9
    held = near[:, i]
    turned = np.arctan2(-sign * m[:, i, j], m[:, j, j])
    first = np.where(locked, held, first)
    last = np.where(locked, turned + np.where(m[:, k, i] < 0, held, -held), last)
    direct, flipped = np.empty((len(m), 3)), np.empty((len(m), 3))
    direct[:, i], direct[:, j], direct[:, k] = first, middle, last
    flipped[:, i], flipped[:, j], flipped[:, k] = first + np.pi, np.pi - middle, last + np.pi
    candidates = np.stack([direct, flipped])
    candidates -= 2 * np.pi * np.rint((candidates - near) / (2 * np.pi))
    nearer = np.abs(candidates - near).sum(axis=2).argmin(axis=0)
    return np.asarray(candidates[nearer, np.arange(len(m))])
