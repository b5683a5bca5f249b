"""Tread of soles as heights: what the grooves of a sole leave standing in the ground."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .lattice_noise import rise

Array = NDArray[np.float64]

LENGTH = 0.27
"""Length of the sole that the patterns are drawn for [m]."""


@dataclass(frozen=True)
class Under:
    """Places under a sole of `LENGTH`, all (N,) arrays [m].

    Attributes
    ----------
    along, across : array
        From the middle between heel and toes, and from the middle of the foot to its left.
    inward : array
        Distance to the outline.
    """

    along: Array
    across: Array
    inward: Array


GROOVE = 0.0044
"""Width of the grooves of such a sole, about [m]."""
EDGE = 0.0011
"""Width over which a groove falls off [m]."""


def _band(distance: Array, half_width: float) -> Array:
    """1 within a band around 0, 0 outside."""
    return rise((half_width - np.abs(distance)) / EDGE * 0.5 + 0.5)


def _from_line(phase: Array, pitch: float) -> Array:
    """Distance to the nearest of lines with a pitch."""
    return phase - pitch * np.round(phase / pitch)


def hiking(under: Under) -> Array:
    """Blocks around the edge, a groove along them, chevrons within, and a plain waist."""
    ring, waist = 0.0165, (under.along > -0.052) & (under.along < -0.016)
    blocks = _band(_from_line(under.along + 0.35 * np.abs(under.across), 0.021), 0.0021) * (under.inward < ring)
    groove = _band(under.inward - ring, 0.0021)
    chevrons = _band(_from_line(under.along - 0.75 * np.abs(under.across), 0.019), 0.0023) * (under.inward > ring)
    return np.where(waist, groove, np.maximum(np.maximum(blocks, chevrons), groove))


def trainer(under: Under) -> Array:
    """Waves across the foot, cut along its middle."""
    wave = under.along + 0.004 * np.abs(_from_line(under.across, 0.024)) / 0.012
    bars = _band(_from_line(wave, 0.0115), 0.0017)
    return np.asarray(np.maximum(bars * (under.inward > 0.006), _band(under.across, 0.0022) * (under.inward > 0.012)))


def bare(under: Under) -> Array:
    """The arch on the inner side, and gaps between ball and toes and from toe to toe."""
    gap = _band(under.along - 0.083 + 0.25 * np.abs(under.across), 0.004)
    toes = _band(_from_line(under.across - 0.009, 0.018), 0.0024) * (under.along > 0.085)
    return np.asarray(np.maximum(gap, toes))


PATTERNS: Mapping[str, Callable[[Under], Array]] = {"HIKING": hiking, "TRAINER": trainer, "BARE": bare}
"""Height of the ground under a sole (N,), from 0 under what presses to 1 in grooves."""
