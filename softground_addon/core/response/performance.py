"""Acting of a walk in deep ground, on request: feet held longer and lifted higher, knees bent, arms out, slower.

It grows with the sinkage. None of this follows from the forces: it is acting, each part with a
strength of its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Mask
from ..numerics.intervals import runs
from ..numerics.rigid import displacement, rotation

DEEP = 0.15
"""Sinkage at which feet are held and arms are out as far as they go, in leg lengths (14 cm for an adult)."""
LONGEST_HOLD = 0.25
"""Most of a swing by which a foot that is held lags behind the source."""
BENT = 0.5
"""Descent of the hips that bends the knees, in sinkages."""
ARMS_OUT = np.radians(35.0)
"""Angle by which the arms are raised sideways [rad]."""

_FIRST_CENTIMETRE, _PER_CENTIMETRE = 0.30, 0.082
"""Cost of walking in snow over that on a road, less 1: 0.30 + 0.082 per cm of sinkage (Pandolf, Haisman and Goldman
1976, "Metabolic energy expenditure and terrain coefficients for walking on snow", Ergonomics 19(6), used by ERDC)."""
_COST_TO_SPEED = -0.142
"""Exponent from cost to the speed that people choose: on dry sand the cost is 2.1 times that on a road and people walk
about 10 % slower (Lejeune, Willems and Heglund 1998, J. Exp. Biol. 201)."""


@dataclass(frozen=True)
class Performance:
    """Strength of each part, 0 (not acted) to 1.

    Attributes
    ----------
    knee_lift : float
        Feet swing higher by as much as they sank.
    hold : float
        Feet stay longer in the ground before they swing, and catch up.
    crouch : float
        Knees bend by half the sinkage.
    arms : float
        Arms go out for balance.
    """

    knee_lift: float = 0.0
    hold: float = 0.0
    crouch: float = 0.0
    arms: float = 0.0

    @property
    def is_none(self) -> bool:
        """True if nothing is acted."""
        return not (self.knee_lift or self.hold or self.crouch or self.arms)


def sinkage_over_time(sinkage: Array, touching: Mask) -> Array:
    """Largest sinkage of a foot in each contact, (F,) [m], linear from the end of one to the start of the next."""
    result = np.zeros(len(sinkage))
    known = np.zeros(len(sinkage), dtype=bool)
    for first, end in zip(*runs(touching), strict=True):
        result[first:end] = sinkage[first:end].max()
        known[first:end] = True
    if not known.any():
        return result
    at = np.flatnonzero(known)
    return np.interp(np.arange(len(result)), at, result[at])


def swing_progress(touching: Mask) -> Array:
    """Progress of each swing between two contacts, (F,) from 0 to 1; 0 while the foot stands or nothing is known."""
    progress = np.zeros(len(touching))
    for first, end in zip(*runs(~touching), strict=True):
        if first > 0 and end < len(touching):
            progress[first:end] = np.arange(1, end - first + 1) / (end - first + 1)
    return progress


def swing_change(path: Array, depth: Array, touching: Mask, performance: Performance, leg_length: float) -> Array:
    """Addition to a foot's swing, (F, 3) [m]: height, and on the level a lag that is made up for before it lands.

    Parameters
    ----------
    path : (F, 3) float array
        Of the foot in the source [m].
    depth : (F,) float array
        From `sinkage_over_time`.
    touching : (F,) bool array
    leg_length : float [m]
    """
    progress = swing_progress(touching)
    bell = np.sin(np.pi * progress) ** 2
    change = np.zeros_like(path)
    lag = performance.hold * LONGEST_HOLD * np.clip(depth / (DEEP * leg_length), 0.0, 1.0) * bell
    index = np.arange(len(path), dtype=float)
    for first, end in zip(*runs(progress > 0), strict=True):
        behind = index[first:end] - lag[first:end] * (end - first + 1)
        for axis in (0, 1):
            change[first:end, axis] = np.interp(behind, index, path[:, axis]) - path[first:end, axis]
    change[:, 2] = performance.knee_lift * depth * bell
    return change


def raised_arms(
    shoulders: Mapping[str, Array], ahead: Array, depth: Array, strength: float, leg_length: float
) -> dict[str, Array]:
    """Rotation of each upper arm sideways about its shoulder, (F, 4, 4) by side.

    Parameters
    ----------
    shoulders : mapping of str to (F, 3) float array
        By side, "l" and "r" [m].
    ahead : (F, 2) float array
        Level direction in which the body faces.
    depth : (F,) float array
        From `body_depth` [m].
    leg_length : float [m]
    """
    angle = strength * ARMS_OUT * np.clip(depth / (DEEP * leg_length), 0.0, 1.0)
    axis = np.concatenate([ahead, np.zeros((len(ahead), 1))], axis=1)
    return {
        side: displacement(rotation((angle if side == "l" else -angle)[:, None] * axis), shoulder, shoulder)
        for side, shoulder in shoulders.items()
    }


def suggested_speed(depth: float) -> float:
    """Speed that people choose on ground they sink into by so much [m], over that on a road.

    Examples
    --------
    >>> [round(suggested_speed(depth), 2) for depth in (0.0, 0.01, 0.05, 0.2)]
    [1.0, 0.96, 0.93, 0.86]
    """
    centimetres = max(depth, 0.0) * 100.0
    cost = 1.0 + _FIRST_CENTIMETRE * min(centimetres, 1.0) + _PER_CENTIMETRE * centimetres
    return float(cost**_COST_TO_SPEED)
