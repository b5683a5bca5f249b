"""The rim around a contact: how much of the ground rises, and where (docs/model.md section 4; the paper, Eq. 12-14)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..ground.material import GroundMaterial
from ..numerics.arrays import Array, Mask

Fraction = NDArray[np.floating[Any]]

LEANING_DISTANCE = 0.1
"""Over this distance along the ground a sole turns its rim to where it moves, but for 1/e; in its lengths."""
STANDSTILL = 1e-3
"""A sole that comes by much less than this in the step before it touches stood there already, in its lengths."""


def rim_weights(
    coverage: Fraction, contact: Mask, reach: float, room: Mask | None = None, toward: Array | None = None
) -> Array:
    """Shares of the cells that take up the volume a contact displaces, summing to 1 (Eq. 12-14).

    All cells within reach of the contact take part alike, in so far as they are not in contact themselves; or those
    ahead of a moving sole more than those behind it, in the shares 1 + b·cos(theta).

    Parameters
    ----------
    coverage : (N, rows, columns) float array
        Fraction of each cell that is in contact, at each of N steps.
    contact : (N, rows, columns) bool array
        From `in_contact`.
    reach : float
        Reach of the rim in cells; at least the next cells take part.
    room : (rows, columns) bool array, optional
        Cells that are ground at all.
    toward : (N, 2) float array, optional
        Direction along x and y that the rim leans to, of length b, at most 1; theta is the angle to it, seen from the
        middle of the contact.

    Returns
    -------
    (N, rows, columns) float array, all 0 at a step whose contact has no free cell around it.

    Examples
    --------
    >>> coverage = np.zeros((1, 5, 5))
    >>> coverage[0, 2, 2] = 1.0
    >>> rim_weights(coverage, in_contact(coverage), reach=1.0)[0, 1:4, 1:4]
    array([[0.  , 0.25, 0.  ],
           [0.25, 0.  , 0.25],
           [0.  , 0.25, 0.  ]])
    """
    free = dilate(contact, reach)
    if room is not None:
        free &= room
    weights = np.subtract(1.0, coverage, dtype=np.float64)
    weights *= free
    if toward is not None:
        weights *= _leaning(coverage, toward)
    total = weights.sum(axis=(1, 2), keepdims=True)
    return np.divide(weights, total, out=weights, where=total > 0)


def _leaning(coverage: Fraction, toward: Array) -> Fraction:
    """1 + b·cos(theta) of each cell, (N, rows, columns), seen from the middle of the contact; 32 bits suffice."""
    _, rows, columns = coverage.shape
    total = np.maximum(coverage.sum(axis=(1, 2), dtype=np.float64), 1e-300)
    x = np.arange(columns) - (coverage.sum(axis=1) @ np.arange(columns) / total)[:, None]
    y = np.arange(rows) - (coverage.sum(axis=2) @ np.arange(rows) / total)[:, None]
    (x_squared, along_x), (y_squared, along_y) = (
        ((offset**2).astype(np.float32), (toward[:, axis, None] * offset).astype(np.float32))
        for axis, offset in enumerate((x, y))
    )
    distance = x_squared[:, None, :] + y_squared[:, :, None]
    np.sqrt(distance, out=distance)
    np.maximum(distance, np.float32(1e-9), out=distance)
    leaning = along_x[:, None, :] + along_y[:, :, None]
    leaning /= distance
    leaning += np.float32(1.0)
    return leaning


def lean_of_landing(path: Array, length: float) -> Array:
    """Lean of the rim of a sole that touches down, (2,): along the way that it comes, seen from above.

    It leans to 1 under a sole that comes along the ground, to 0 under one that comes straight down.

    Parameters
    ----------
    path : (2, 3) float array
        The middle of the sole at the step before it touches, and when it does [m].
    length : float
        Of the sole [m].
    """
    way = path[1] - path[0]
    lean: Array = way[:2] / (np.linalg.norm(way) + STANDSTILL * length)
    return lean


def leaning(path: Array, length: float, start: Array) -> Array:
    """Lean of the rim of a sole at each of N steps, (N, 2), at most 1 long.

    Ground that gives way goes on in the direction in which the sole has set it moving: a sole that is planted keeps
    the lean that it landed with, and one that slides, rolls on or pushes off turns it to where it moves, over the
    distance that it moves. Whether the steps are long or short, the lean is the same.

    Parameters
    ----------
    path : (N + 1, 3) float array
        The middle of the sole at the step before and at each of these [m].
    length : float
        Of the sole [m].
    start : (2,) float array
        Lean before the first step.

    Examples
    --------
    >>> still, slide = np.zeros((3, 3)), np.array([[0.0, 0.1, 0.0]])
    >>> leaning(np.concatenate([still, slide]), 0.3, np.array([0.9, 0.0])).round(2)
    array([[0.9 , 0.  ],
           [0.9 , 0.  ],
           [0.03, 0.96]])
    """
    way = np.diff(path[:, :2], axis=0) @ np.array([1.0, 1.0j])
    distance = np.abs(way)
    toward = np.divide(way, distance, out=np.zeros_like(way), where=distance > 1e-9 * length)
    weights = np.exp(-distance / (LEANING_DISTANCE * length))
    lean = complex(*start)
    leans = []
    for direction, part in zip(toward.tolist(), weights.tolist(), strict=True):
        lean = direction + (lean - direction) * part
        leans.append(lean)
    return np.array(leans, complex).view(float).reshape(-1, 2)


def in_contact(coverage: Fraction) -> Mask:
    """Cells that count as in contact at each of N steps: those covered by half.

    A contact smaller than a cell covers none by half; then those count that it covers by half as much as any.
    """
    bound = np.minimum(0.5, 0.5 * coverage.max(axis=(1, 2), keepdims=True))
    mask: Mask = (coverage >= bound) & (coverage > 0)
    return mask


def whole_reach(reach: float) -> int:
    """Distance in cells from a contact to the end of its rim, at least one, with a reach in cells."""
    return max(1, int(reach + 1e-6))


def dilate(mask: Mask, reach: float) -> Mask:
    """Cells within `reach` cells (at least one) of a marked cell, for each of N masks (N, rows, columns)."""
    radius, count = whole_reach(reach), len(mask)
    reach_squared = max(reach + 1e-6, 1.0) ** 2
    packed = np.packbits(mask, axis=0)  # eight masks at a time
    result = np.zeros_like(packed)
    wider, half_width = packed.copy(), 0  # `wider` is the mask dilated along the row by half_width
    for offset in range(radius, -1, -1):
        reach_along_row = int(np.sqrt(reach_squared - offset**2))
        for shift in range(half_width + 1, reach_along_row + 1):
            wider[..., shift:] |= packed[..., :-shift]
            wider[..., :-shift] |= packed[..., shift:]
        half_width = reach_along_row
        if offset:
            result[:, offset:] |= wider[:, :-offset]
            result[:, :-offset] |= wider[:, offset:]
        else:
            result |= wider
    return np.unpackbits(result, axis=0, count=count).view(bool)


def displaced_volume(compressed_volume: Array | float, material: GroundMaterial, factor: Array | float = 1.0) -> Array:
    """Volume that leaves under a contact and rises around it: 2·nu·compressed volume (Eq. 12-13, correction 3).

    A factor on it, where the ground varies, cannot make it more than what was compressed.
    """
    return np.asarray(np.minimum(2.0 * material.poisson_ratio * factor, 1.0) * np.asarray(compressed_volume))
