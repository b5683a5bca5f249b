"""A sole in deep ground: it sinks early and as one plate, which the travelling pressure only tilts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..imprints.sole_points import SolePoints
from ..numerics.arrays import Array
from ..soles.deep_ground import wading

Pressure = NDArray[np.floating[Any]]

FALL_TIME = 0.06
"""Longest time in which deep ground gives way under a lasting load [s]: a foot falls in about 0.1 s as it is loaded."""
STIFF = 0.7
"""Least pressure under a sole that wades, over its highest: soles are stiff, heel and toes sink nearly together. Tried
on the sample walk at 20, 35 and 50 cm, so that standing knees straighten."""


@dataclass(frozen=True)
class Plate:
    """A sole that bears with all of its area at once: what bears less goes down with the rest.

    Attributes
    ----------
    share : float
        From 0, as on shallow ground, to 1; see `deep_ground.wading`.
    area : float
        Of the whole sole [m²].
    reach : float
        Depth over that of its largest load, lasting, to which the load gets in its time without a plate; 1 for walkers.
    """

    share: float
    area: float
    reach: float = 1.0

    def bearing(self, touching: float) -> float:
        """Area that bears the force [m²], while so much of it touches."""
        return 1.0 / ((1.0 - self.share) / touching + self.share / self.area)

    def fall_time(self, time: Any) -> Any:
        """Time in which the ground gives way [s], from that on shallow ground; at most `FALL_TIME` where it is deep."""
        return time + self.share * (np.minimum(time, FALL_TIME) - time)

    def depth(self, target: Any) -> Any:
        """Compression that a stress leads to, from that which it would lead to if it lasted [m]."""
        return target * (1.0 - self.share * (1.0 - self.reach))

    def level(self, relative: Pressure) -> None:
        """Raise a pressure over its mean (N, rows, columns), in place: to 1 and to `STIFF` of its highest."""
        least = np.maximum(1.0, STIFF * relative.max(axis=(-2, -1), keepdims=True))
        relative += self.share * (np.maximum(relative, least) - relative)


def plate_of(points: SolePoints, target: Array, rate: Any, softness: float) -> Plate | None:
    """The plate that a sole is under its load; None if that presses it no deeper than the ankle.

    Parameters
    ----------
    target : (N,) float array
        Compression that the load at each step, spread over the whole sole, leads to [m].
    rate : float or (N,) float array
        From `deformation.compression_rate`, without a plate.
    softness : float
        Compression of the ground under the sole per that of the material.
    """
    reached = float(np.minimum(np.cumsum(rate * target), target).max())
    share = float(wading(reached * softness, points.length))
    return Plate(share, points.area, reached / float(target.max())) if share else None
