"""Tread of soles as heights: ridges that the grooves of a sole leave in the ground.

Patterns are those of right feet.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..numerics.arrays import Array
from ..numerics.interpolation import smooth_step
from .tread_map import height_at

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
    breadth : float
        From side to side.
    """

    along: Array
    across: Array
    inward: Array
    breadth: float


Pattern = Callable[[Under], Array]
"""Height of the ground under a sole (N,), from 0 under pressing parts to 1 in the grooves of shoes."""


GROOVE = 0.0044
"""Width of the grooves of such a sole, about [m]."""
EDGE = 0.0011
"""Width over which a groove falls off [m]."""


def _band(distance: Array, half_width: float) -> Array:
    """1 within a band around 0, 0 outside."""
    return smooth_step((half_width - np.abs(distance)) / EDGE * 0.5 + 0.5)


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


PADS = np.array(
    [
        (-0.365, 0.005, 0.125, 0.37), (-0.13, -0.24, 0.25, 0.20), (0.13, -0.17, 0.14, 0.30), (0.165, 0.22, 0.125, 0.28),
        (0.405, 0.27, 0.080, 0.150), (0.425, 0.04, 0.044, 0.068), (0.395, -0.115, 0.038, 0.062),
        (0.350, -0.255, 0.035, 0.060), (0.295, -0.38, 0.034, 0.060),
    ]
)  # fmt: skip
"""Heel, outer side, ball and toes of a bare right foot as ellipses: middle over length and over breadth from the middle
of the foot, ahead and to the left, and half axes. Drawn after prints on paper."""
_FLESH = 0.009
"""Width over which pads of flesh fall off, and over which they run together [m]."""


def bare(under: Under) -> Array:
    """Pads of heel, ball and toes; the arch, and the gaps before and between the toes, stand."""
    along, across = under.along / LENGTH, under.across / under.breadth
    far = np.full(len(along), -1.0)
    for ahead, left, half_length, half_breadth in PADS:
        share = np.hypot((along - ahead) / half_length, (across - left) / half_breadth)
        pad = (1.0 - share) * min(half_length * LENGTH, half_breadth * under.breadth)
        width = min(_FLESH, 0.4 * half_length * LENGTH)  # toes stay apart
        both = np.maximum(1.0 - np.abs(far - pad) / width, 0.0)
        far = np.maximum(far, pad) + 0.25 * width * both * both
    return np.asarray(1.0 - smooth_step(far / _FLESH + 0.5))


PATTERNS: Mapping[str, Pattern] = {"HIKING": hiking, "TRAINER": trainer, "BARE": bare}
"""Patterns that are drawn by formulas."""


def of_map(of_sole: Array) -> Pattern:
    """The pattern of a sole from a map of its heights; see `tread_map`."""

    def mapped(under: Under) -> Array:
        return 1.0 - height_at(of_sole, 0.5 + under.along / LENGTH, 0.5 - under.across / under.breadth)

    return mapped


@dataclass(frozen=True)
class SoleTread:
    """The tread of one sole.

    Attributes
    ----------
    is_mirrored : bool
        True for left feet.
    """

    pattern: Pattern
    is_mirrored: bool = False

    @property
    def is_flesh(self) -> bool:
        """True if it is that of a bare foot: its ridges are high and go on into the wall."""
        return self.pattern is bare

    def __call__(self, under: Under) -> Array:
        """See `Pattern`."""
        return self.pattern(replace(under, across=-under.across) if self.is_mirrored else under)
