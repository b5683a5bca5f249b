"""Parts of a body that are mirror images of each other: left and right, without their names."""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Indices
from ..numerics.rigid import unit

AS_MANY = 0.2
"""Numbers of vertices of a part and its twin differ by less than this share."""

MOST_MIRRORS = 200
"""Pairs of parts, the largest, between which the mirror is looked for."""

BESIDE = 0.05
"""A twin's middle is this near to the mirror image of a part's, over the largest extent of the body."""


def twins(points: Array, part: Indices, count: int) -> Indices:
    """The part that mirrors each, (count,): itself where none does.

    The mirror is the plane half-way between two parts of one size in which most of the body has its image.

    Parameters
    ----------
    points : (V, 3) float array
        The body as it was modelled.
    part : (V,) int array
        Part of each point.
    count : int
        Number of parts.
    """
    best = itself = np.arange(count)
    mirrored = 0.0
    size = np.bincount(part, minlength=count)
    middle = np.stack([np.bincount(part, along, count) for along in points.T], axis=-1) / np.maximum(size, 1)[:, None]
    most = np.maximum.outer(size, size)
    unlike = (np.abs(np.subtract.outer(size, size)) > AS_MANY * most) | (most == 0)
    part_a, part_b = np.nonzero(np.triu(~unlike, 1))
    largest = np.argsort(-size[part_a], kind="stable")[:MOST_MIRRORS]
    near = BESIDE * np.ptp(points, axis=0).max()
    for first, second in zip(part_a[largest], part_b[largest], strict=True):
        across = unit(middle[second] - middle[first])
        off = (middle - (middle[first] + middle[second]) / 2) @ across
        gap = np.linalg.norm((middle - 2 * np.outer(off, across))[:, None] - middle, axis=-1)
        gap[unlike] = np.inf
        twin = gap.argmin(axis=1)
        fit = np.clip(1 - gap.min(axis=1) / near, 0.0, None) * (twin[twin] == itself)  # its image's image is itself
        if fit @ size > mirrored:
            best, mirrored = np.where(fit > 0, twin, itself), fit @ size
    return best
