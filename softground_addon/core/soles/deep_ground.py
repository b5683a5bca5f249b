"""Deep ground: a foot that sinks beyond its ankle wades, smoothly more the deeper it goes."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..numerics.interpolation import smooth_step

ANKLE = 0.35
"""Height of the ankle, in sole lengths: 10 cm for an adult. Down to it, a step is what it is on shallow ground."""
WADES = 0.5
"""Depth from which on a foot wades altogether, in sole lengths."""


def wading(depth: Any, sole_length: float) -> Any:
    """Share of wading in a step: 0 down to the ankle, 1 from `WADES` on, smooth in between.

    Parameters
    ----------
    depth : float or float array
        Sinkage of the sole [m].
    sole_length : float
        [m]

    Examples
    --------
    >>> [round(float(wading(depth, 0.28)), 3) for depth in (0.05, 0.098, 0.15, 0.5)]
    [0.0, 0.0, 1.0, 1.0]
    """
    return smooth_step((np.asarray(depth) / sole_length - ANKLE) / (WADES - ANKLE))
