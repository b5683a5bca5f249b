"""Noise that depends on place alone: values of an integer lattice, hashed, with smooth passages between them.

Whole numbers are hashed and polynomials interpolate, so that every platform gives the same bytes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array

Whole = NDArray[np.int64] | NDArray[np.uint32]
Lattice = NDArray[np.uint32]

DEVIATION = 0.65
"""Standard deviation of the noise: most of it is within one amplitude."""

ALONG_AN_AXIS = 181 / 231
"""Part of the variance of a lattice that remains between its values, for each axis: the mean of (1 - p)² + p² over the
`_passage` p."""


def hashed(seed: int, *lattice: Whole) -> Lattice:
    """A random number for each place of a lattice, from 0 to 2³² - 1.

    The mixing steps are those of a 32-bit integer hash found by search [1]_.

    References
    ----------
    .. [1] Wellons, C. (2018). Prospecting for Hash Functions. nullprogram.com/blog/2018/07/31 (lowbias32).
    """
    value = np.asarray(seed & 0xFFFFFFFF, dtype=np.uint32)
    for axis, step in zip(lattice, (0x9E3779B1, 0x85EBCA77, 0xC2B2AE3D), strict=False):
        value = value ^ axis.astype(np.uint32) * np.uint32(step)
        value ^= value >> np.uint32(16)
        value = value * np.uint32(0x7FEB352D)
        value ^= value >> np.uint32(15)
        value = value * np.uint32(0x846CA68B)
        value ^= value >> np.uint32(16)
    return value


def uniform(seed: int, *lattice: Whole) -> Array:
    """A random number for each place of a lattice, from 0 to 1."""
    return np.asarray(hashed(seed, *lattice) * 2.0**-32)


def _passage(share: Array) -> Array:
    """Smooth step from 0 to 1 whose ends do not bend either (Perlin 2002, doi:10.1145/566654.566636, eq. 1)."""
    return np.asarray(share * share * share * (share * (share * 6.0 - 15.0) + 10.0))


def noise(seed: int, size: float, *place: Array) -> Array:
    """Noise whose features are about `size` [m] large.

    Parameters
    ----------
    size : float
        From one value of the lattice to the next [m].
    *place : (N,) float arrays
        World x and y, for noise in space also z [m].

    Returns
    -------
    (N,) float array
        Of mean 0 and standard deviation `DEVIATION`.

    Examples
    --------
    >>> at = np.array([0.1, 0.1, 0.1 + 1e-9])
    >>> value = noise(7, 0.02, at, at)
    >>> bool(value[0] == value[1]), bool(abs(value[0] - value[2]) < 1e-6), bool(value[0] == noise(8, 0.02, at, at)[0])
    (True, True, False)
    """
    if not len(place[0]):
        return np.zeros(0)
    at = [axis / size for axis in place]
    cell = [np.floor(axis) for axis in at]
    values = _corners(seed, [axis.astype(np.int64) for axis in cell])
    for axis, first in zip(at[::-1], cell[::-1], strict=True):  # between the corners, along one axis after the other
        low, high = values[..., 0, :], values[..., 1, :]
        values = low + _passage(axis - first) * (high - low)
    return np.asarray(values * (DEVIATION * np.sqrt(3.0 / ALONG_AN_AXIS ** len(place))))


def _corners(seed: int, cells: list[NDArray[np.int64]]) -> Array:
    """A lattice's values, from -1 to 1, at the corners of cells (N,): (2, ..., 2, N), low and high along each axis.

    They are looked up in a box around the cells if it is small, else each is hashed.
    """
    both = [np.arange(2).reshape(-1, *[1] * (len(cells) - k)) for k in range(len(cells))]
    low, size = [int(axis.min()) for axis in cells], [int(np.ptp(axis)) + 2 for axis in cells]
    if np.prod(size, dtype=float) > 8 * len(cells[0]):
        return uniform(seed, *(axis + ends for axis, ends in zip(cells, both, strict=True))) * 2.0 - 1.0
    axes = [np.arange(first, first + count, dtype=np.int64) for first, count in zip(low, size, strict=True)]
    box = uniform(seed, *np.meshgrid(*axes, indexing="ij", sparse=True)) * 2.0 - 1.0
    strides = np.cumprod([1, *size[:0:-1]])[::-1].tolist()
    at = sum((axis - first) * stride for axis, first, stride in zip(cells, low, strides, strict=True))
    return box.take(at + sum(ends * stride for ends, stride in zip(both, strides, strict=True)))


def fractal(seed: int, size: float, octaves: int, gain: float, *place: Array, finest: float = 0.0) -> Array:
    """Octaves of noise, each of half the size; those finer than `finest` [m] are left out. Deviates as `noise`."""
    total, weight = np.zeros(len(place[0])), 0.0
    for octave in range(octaves):
        scale, part = size / 2.0**octave, gain**octave
        weight += part * part
        if scale >= finest:
            total += part * noise(seed + octave, scale, *place)
    return np.asarray(total / np.sqrt(weight))


@dataclass(frozen=True)
class Cells:
    """Voronoi cells at N places, all (N,) arrays.

    Attributes
    ----------
    number : uint32 array
        The cell that each place is in, as a random number.
    to_edge : array
        Distance to the second nearest centre, less that to the nearest [m]: 0 on edges.
    x, y : array
        From the centre of its cell [m].
    """

    number: Lattice
    to_edge: Array
    x: Array
    y: Array


def cells(seed: int, size: float, x: Array, y: Array) -> Cells:
    """Voronoi cells of about `size` [m], a centre in each square of a lattice.

    After Worley, S. (1996). A Cellular Texture Basis Function. doi:10.1145/237170.237267.
    """
    u, v = x / size, y / size
    column, row = np.floor(u).astype(np.int64), np.floor(v).astype(np.int64)
    i, j = (beside.reshape(-1, 1) for beside in np.meshgrid(*[np.arange(-1, 2)] * 2))  # of the squares around, (9, 1)
    value = hashed(seed, column + i, row + j)
    dx = u - column - i - (value & np.uint32(0xFFFF)) * 2.0**-16
    dy = v - row - j - (value >> np.uint32(16)) * 2.0**-16
    distance = dx * dx + dy * dy
    closest = np.argmin(distance, axis=0), np.arange(len(u))
    nearest = distance[closest]
    distance[closest] = np.inf
    to_edge = np.sqrt(distance.min(axis=0)) - np.sqrt(nearest)
    return Cells(value[closest], to_edge * size, dx[closest] * size, dy[closest] * size)
