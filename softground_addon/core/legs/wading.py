"""Depth in which a body wades, over its strides, and what its feet plough through on the way."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..numerics.arrays import Array, Mask
from ..numerics.interpolation import smooth_step
from ..numerics.intervals import runs
from ..numerics.plane_fit import smoothed
from ..soles.deep_ground import wading

DEPTH_TIME = 0.4
"""Standard deviation of the smoothing of the sinkage that the body responds to [s], for an adult."""
PLOUGH = 0.65
"""Most that a swinging foot ploughs through the top of a deep layer, in sole lengths: an adult ploughs 9 cm deep of 20,
15 of 50 (tried on the sample walk: people plough where they can and lift over the rest)."""

DRAGS, LIFTS = 0.6, 1.1
"""Depths up to which a swinging foot is dragged through the layer, and from which on it is lifted out, in sole lengths:
people drag their feet through 20 cm of snow, and leave single holes in 40 (own estimate)."""


def depth_of_contacts(sinkage: Array, touching: Mask) -> Array:
    """Sinkage of a foot in the middle of each contact, (F,) [m], linear from one to the next."""
    first, end = runs(touching)
    if not len(first):
        return np.zeros(len(sinkage))
    now, middle = np.arange(len(sinkage)), (first + end - 1) / 2
    return np.interp(now, middle, np.interp(middle, now, sinkage))


def body_depth(depths: Mapping[Any, Array], width: float) -> Array:
    """Sinkage that the whole body responds to (F,) [m]: the mean of its feet's, smooth over `width` samples."""
    return smoothed(np.mean(list(depths.values()), axis=0), width)


def ploughed(depth: Any, sole_length: float) -> Any:
    """Depth below the surface at which a foot swings [m]: a lesser part of a deeper layer, 0 in a shallow one.

    Parameters
    ----------
    depth : float or float array
        Sinkage of the foot [m].
    sole_length : float
        [m]

    Examples
    --------
    >>> [round(float(ploughed(depth, 0.28)), 3) for depth in (0.05, 0.2, 0.35, 0.5)]
    [0.0, 0.093, 0.13, 0.151]
    """
    return PLOUGH * sole_length * wading(depth, sole_length) * -np.expm1(-np.asarray(depth) / sole_length)


def dragged(depth: Any, sole_length: float) -> Any:
    """Share of dragging in a swing: 1 where a foot stays in the top of the layer, 0 where it is lifted out of it.

    Parameters
    ----------
    depth : float or float array
        Sinkage of the foot [m].
    sole_length : float
        [m]

    Examples
    --------
    >>> [round(float(dragged(depth, 0.28)), 3) for depth in (0.05, 0.15, 0.25, 0.5)]
    [0.0, 1.0, 0.373, 0.0]
    """
    lifted = smooth_step((np.asarray(depth) / sole_length - DRAGS) / (LIFTS - DRAGS))
    return wading(depth, sole_length) * (1.0 - lifted)
