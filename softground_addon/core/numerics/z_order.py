"""The order of places along a Z-order curve: neighbours lie near each other in memory."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CURVE_BITS = 24
"""Bits of a coordinate along the curve by which vertices are ordered: 6 cm of 1,000 km."""


def along_curve(place: Array) -> NDArray[np.int64]:
    """Position of each place (N, 2) along a Z-order curve."""
    if not len(place):
        return np.zeros(0, dtype=np.int64)
    extent = max(float(np.ptp(place, axis=0).max()), 1e-9)
    cell = ((place - place.min(axis=0)) * ((2**CURVE_BITS - 1) / extent)).astype(np.int64)
    code = np.zeros(len(place), dtype=np.int64)
    for bit in range(CURVE_BITS):
        code |= ((cell[:, 0] >> bit & 1) << 2 * bit) | ((cell[:, 1] >> bit & 1) << (2 * bit + 1))
    return code
