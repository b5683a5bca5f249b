"""How the force on a sole spreads over its contact: evenly, or so that it acts at the centre of pressure."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

Pressure = Literal["UNIFORM", "CENTRE_OF_PRESSURE"]
"""Evenly, as in the paper; or linearly over the contact, so that it acts where the force does."""

KERN = 1 / sqrt(3.0)
"""Edge of the kern of a rectangle, a sixth of its length from its middle, in standard deviations of its area."""


@dataclass(frozen=True)
class PressureSlope:
    """Pressure over the contact, relative to its mean: 1 + slope·(place - middle), where that is positive.

    Attributes
    ----------
    middle : (N, 2) float array
        Middle of the contact at each of N steps [m].
    slope : (N, 2) float array
        Growth of the pressure along x and y [1/m].
    """

    middle: Array
    slope: Array

    def over(self, x: Array, y: Array, coverage: NDArray[np.floating[Any]]) -> NDArray[np.float32]:
        """Pressure over the mean pressure in each cell.

        Clipping what would pull leaves too much pressure; all is scaled down so that the force is kept.

        Parameters
        ----------
        x : (columns,) float array
        y : (rows,) float array
            Centres of the cells [m].
        coverage : (N, rows, columns) float array
            Fraction of each cell that is in contact.

        Returns
        -------
        (N, rows, columns) float array, whose mean over the contact is 1.
        """
        along_x = self.slope[:, :1] * (x - self.middle[:, :1])
        along_y = 1.0 + self.slope[:, 1:] * (y - self.middle[:, 1:])
        relative = along_x.astype(np.float32)[:, None, :] + along_y.astype(np.float32)[:, :, None]
        np.maximum(relative, 0.0, out=relative)
        contact = np.einsum("nij->n", coverage, dtype=np.float64)
        pressed = np.einsum("nij,nij->n", relative, coverage, dtype=np.float64)
        scale = np.divide(contact, pressed, out=np.ones_like(pressed), where=pressed > 0)
        relative *= scale[:, None, None]
        return relative


def pressure_slope(x: Array, y: Array, area: Array, centre: Array, least_extent: float) -> PressureSlope:
    """The linear pressure over a contact whose middle is the centre of pressure.

    As in the section of a beam under an eccentric force, the slope is the eccentricity over the second moments of the
    contact. A centre of pressure so far out that one side would have to pull, beyond the kern of the section, says that
    the contact or the centre is not known that well: it counts as on the edge of the kern, where the pressure falls to
    nothing on one side and doubles on the other.

    Parameters
    ----------
    x, y : (N, Q) float arrays
        Places of points of the sole at each of N steps [m].
    area : (N, Q) float array
        Area in contact that each stands for [m²].
    centre : (N, 2) float array
        Centre of pressure [m]; where it is no number, the pressure is even.
    least_extent : float
        Smallest extent that a contact is taken to have [m], for those that are a line or a point.
    """
    total = area.sum(axis=1)
    loaded = (total > 0) & np.isfinite(centre).all(axis=1)
    share = np.divide(area, total[:, None], out=np.zeros_like(area), where=total[:, None] > 0)
    middle = np.stack([(share * x).sum(axis=1), (share * y).sum(axis=1)], axis=-1)
    from_middle = np.stack([x - middle[:, :1], y - middle[:, 1:]], axis=1)
    spread = np.einsum("niq,njq->nij", from_middle * share[:, None], from_middle)
    spread += np.eye(2) * (least_extent**2 / 12.0)
    eccentricity = np.where(loaded[:, None], centre - middle, 0.0)
    slope = np.linalg.solve(spread, eccentricity[..., None])[..., 0]
    deviations = np.sqrt(np.maximum(np.einsum("ni,ni->n", slope, eccentricity), 0.0))
    return PressureSlope(middle, slope * np.minimum(1.0, KERN / np.maximum(deviations, KERN))[:, None])
