"""Spread of the force on a sole over its contact: evenly, or so that it acts at the centre of pressure."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array

Single = NDArray[np.float32]


KERN = 1 / sqrt(3.0)
"""Edge of the kern of a rectangle, a sixth of its length from its middle, in standard deviations of its area."""
PEAK = 0.6 * sqrt(3.0)
"""How far the highest pressure is above the mean, per standard deviation of the contact that the force is off its
middle: 0.6 times as far as under a beam, which is the least, rounded up, that lets the force act anywhere in the kern
of a rectangle, an ellipse or a triangle. A third of a rectangle is then at the highest pressure."""
SAMPLE = 280
"""The fit begins on about so many of the points."""
GOLDEN = (sqrt(5.0) - 1) / 2
"""Multiples of it, less their whole parts, are spread evenly whatever the length of the rows that points come in."""
CLOSE = 1e-3
"""How far the force may act from the centre of pressure, in standard deviations of the contact."""
ASTRAY = 0.1
"""A fit that bears more or less than the force by this part of it has not found a pressure."""
MOST_ROUNDS = 30
"""Newton steps; four or five suffice."""


@dataclass(frozen=True)
class PressureField:
    """Pressure over the contact, relative to its mean: level + slope·(place - middle), from 0 to a highest value.

    Attributes
    ----------
    middle : (N, 2) float array
        Middle of the contact at each of N steps [m].
    level : (N,) float array
        What it would be there without the limits.
    slope : (N, 2) float array
        Growth of the pressure along x and y [1/m].
    highest : (N,) float array
        At least 1.
    """

    middle: Array
    level: Array
    slope: Array
    highest: Array

    def over(self, x: Array, y: Array) -> Single:
        """Pressure over the mean pressure in each cell.

        Parameters
        ----------
        x : (columns,) float array
        y : (rows,) float array
            Centres of the cells [m].

        Returns
        -------
        (N, rows, columns) float array
        """
        along_x = self.slope[:, :1] * (x - self.middle[:, :1])
        along_y = self.level[:, None] + self.slope[:, 1:] * (y - self.middle[:, 1:])
        relative = along_x.astype(np.float32)[:, None, :] + along_y.astype(np.float32)[:, :, None]
        return _limited(relative, self.highest.astype(np.float32)[:, None, None])

    def at(self, x: Array, y: Array) -> Array:
        """Pressure over the mean pressure at places (N, Q)."""
        along = self.slope[:, :1] * (x - self.middle[:, :1]) + self.slope[:, 1:] * (y - self.middle[:, 1:])
        return np.asarray(_limited(self.level[:, None] + along, self.highest[:, None]))


def pressure_field(x: Array, y: Array, area: Array, centre: Array, least_extent: float) -> PressureField:
    """The most even pressure whose force acts at the centre of pressure.

    Of all pressures from 0 to a highest one that have the given force and moments, it is the one that differs least
    from the mean in the least squares: linear over the contact, cut off at both limits. Where only the linear part
    shows, it is that of the section of a beam under an eccentric force. A beam's pressure has its peak at the very
    edge, so that the deepest point of a print would depend on the size of the cells; here the highest pressure covers
    a part of the contact, as under the effective area of Meyerhof (1953, "The bearing capacity of foundations under
    eccentric and inclined loads", 3rd Int. Conf. Soil Mechanics).

    A centre of pressure beyond the kern of the section, where a beam would have to pull, says that the contact or the
    centre is not known that well: it counts as on the edge of the kern.

    Parameters
    ----------
    x, y : (N, Q) float arrays
        Places of points of the sole at each of N steps [m], neighbours one after the other for the most part.
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
    middle = np.stack([np.einsum("nq,nq->n", share, x), np.einsum("nq,nq->n", share, y)], axis=-1)
    # 32 bits suffice for places about the middle.
    near_x, near_y = (x - middle[:, :1]).astype(np.float32), (y - middle[:, 1:]).astype(np.float32)
    part = share.astype(np.float32)
    # What a contact that is a line or a point lacks in spread: as if each of its points were spread that far.
    blunt = least_extent**2 / 12.0
    spread = _moments(part, near_x, near_y) + np.diag([0.0, blunt, blunt])
    spread[total == 0, 0, 0] = 1.0
    wanted = np.ones((len(x), 3))
    wanted[:, 1:] = np.where(loaded[:, None], centre - middle, 0.0)
    field = np.linalg.solve(spread, wanted[..., None])[..., 0]
    eccentricity = np.sqrt(np.maximum(np.einsum("ni,ni->n", field[:, 1:], wanted[:, 1:]), 0.0))
    off = np.flatnonzero(eccentricity > CLOSE)  # the others press evenly
    within = np.zeros((len(x), 1))
    within[off, 0] = np.minimum(1.0, KERN / np.maximum(eccentricity[off], KERN))
    wanted[:, 1:] *= within
    field[:, 1:] *= within
    highest = 1.0 + PEAK * np.minimum(eccentricity, KERN)
    exactly = (x - middle[:, :1])[off], (y - middle[:, 1:])[off], share[off]
    near_x, near_y, part = near_x[off], near_y[off], part[off]
    sample = np.flatnonzero(np.arange(x.shape[1]) * GOLDEN % 1.0 < SAMPLE / x.shape[1])
    few = part[:, sample]
    few /= np.maximum(few.sum(axis=1, keepdims=True), np.float32(1e-30))
    # Nearly all of the way on a sample, the rest on all points.
    linear = field[off]
    for points in ((near_x[:, sample], near_y[:, sample], few), (near_x, near_y, part)):
        field[off] = _fitted(field[off], *points, wanted[off], highest[off], spread[off], blunt)
    bearing = np.ones(len(field))
    bearing[off] = _force(field[off], highest[off], *exactly)
    astray = np.flatnonzero(~(np.abs(bearing[off] - 1.0) < ASTRAY))  # too few points to fit: the beam's section it is
    field[off[astray]] = linear[astray]
    bearing[off[astray]] = _force(linear[astray], highest[off[astray]], *(of_points[astray] for of_points in exactly))
    return PressureField(middle, field[:, 0] / bearing, field[:, 1:] / bearing[:, None], highest / bearing)


def spread_out(relative: Single, widening: Array) -> None:
    """Even out, in place, a pressure relative to its mean (N, rows, columns), as a load does on its way down.

    Its mean stays, so that the force does; its centre comes to lie nearer to the middle.

    Parameters
    ----------
    relative : (N, rows, columns) float array
    widening : (N,) float array
        How far the load has widened to each side, in lengths of the sole.
    """
    relative -= 1.0
    relative *= (1.0 / (1.0 + 2.0 * widening)).astype(np.float32)[:, None, None]
    relative += 1.0


def _force(field: Array, highest: Array, x: Array, y: Array, share: Array) -> Array:
    """Part of the force that a pressure bears, (N,); in 64 bits, as pressures that rise within a point are steep."""
    level, along_x, along_y = field.T[..., None]
    pressure = _limited(level + along_x * x + along_y * y, highest[:, None])
    return np.asarray(np.einsum("nq,nq->n", pressure, share))


def _fitted(
    field: Array, x: Single, y: Single, share: Single, wanted: Array, highest: Array, spread: Array, blunt: float
) -> Array:
    """Level and slope (N, 3) whose pressure has the `wanted` force and moments (N, 3), by Newton's method.

    A step that leads further off is halved until it does not: the pressure's kinks send whole steps to and fro.
    Moments are those of what the pressure is off the even one. An even pressure has none about the middle of the
    contact, but about that of a few of its points: where the force is hardly off the middle, they could not bear it.
    """
    fitted, rows, scale = field.copy(), np.arange(len(field)), np.sqrt(np.einsum("nii->ni", spread))
    damping, best, least = np.full(len(field), 1e-3), field, np.full(len(field), np.inf)
    kept_system, kept_miss = spread, wanted
    for _ in range(MOST_ROUNDS):
        load = _pressure(field, x, y, highest)
        free = (load > 0) & (load < highest.astype(np.float32)[:, None])
        load -= 1.0
        load *= share
        miss = np.stack([load.sum(axis=1), np.einsum("nq,nq->n", load, x), np.einsum("nq,nq->n", load, y)], axis=1)
        miss += field * (0.0, blunt, blunt) + (1.0, 0.0, 0.0) - wanted
        error = np.abs(miss / scale).max(axis=1)
        # A step that led further off is taken back and tried again, shorter.
        better = error < least
        best, least = np.where(better[:, None], field, best), np.minimum(error, least)
        # Those that are there stay, so that none depends on which others are fitted with it.
        fitted[rows] = best
        off = least > CLOSE
        if not off.any():
            break
        if not off.all():
            rows, free, better = rows[off], free[off], better[off]
            x, y, share = x[off], y[off], share[off]
            wanted, highest, scale, damping = wanted[off], highest[off], scale[off], damping[off]
            best, least, miss = best[off], least[off], miss[off]
            kept_system, kept_miss = kept_system[off], kept_miss[off]
        system = _moments(free * share, x, y) + np.diag([0.0, blunt, blunt])
        kept_system = np.where(better[:, None, None], system, kept_system)
        kept_miss = np.where(better[:, None], miss, kept_miss)
        damping = np.where(better, np.maximum(damping / 10, 1e-3), damping * 10)
        damped = kept_system + damping[:, None, None] * np.eye(3) * scale[:, :, None] ** 2
        field = best - np.linalg.solve(damped, kept_miss[..., None])[..., 0]
    return fitted


def _pressure(field: Array, x: Single, y: Single, highest: Array) -> Single:
    """The pressure of level and slope (N, 3) at places (N, Q), within its limits."""
    level, along_x, along_y = field.T.astype(np.float32)[..., None]
    pressure = along_x * x
    pressure += along_y * y
    pressure += level
    limited: Single = _limited(pressure, highest.astype(np.float32)[:, None])
    return limited


def _moments(weight: Single, x: Single, y: Single) -> Array:
    """Sums of the products of (1, x, y) over weighted points, (N, 3, 3)."""
    along_x, along_y = weight * x, weight * y
    zeroth, first, second = weight.sum(axis=1), along_x.sum(axis=1), along_y.sum(axis=1)
    xx, xy, yy = (np.einsum("nq,nq->n", *pair) for pair in ((along_x, x), (along_x, y), (along_y, y)))
    return np.moveaxis(np.array([[zeroth, first, second], [first, xx, xy], [second, xy, yy]], dtype=float), -1, 0)


def _limited(pressure: Any, highest: Any) -> Any:
    """The pressure from 0 to the highest, in place."""
    return np.minimum(np.maximum(pressure, 0.0, out=pressure), highest, out=pressure)
