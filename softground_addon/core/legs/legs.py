"""Two-bone inverse kinematics of a leg over time, keeping the direction of the knee (docs/model.md section 5)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..numerics.arrays import Array
from ..numerics.plane_fit import smoothed
from ..numerics.rigid import displacement, perpendicular, rotation, turn_between, unit

_KNEE_HINT = 0.1
"""Weight of the direction of the foot for that of the knee, in leg lengths of knee offset: a bent knee keeps its own, a
straight one bends toward the toes."""
_SURE = 0.1
"""A knee that lies so far off the line from hip to ankle has a direction of its own, in leg lengths (23°)."""
_CLOSEST = 1e-6
"""Relative distance that a solved leg keeps from being quite straight or quite folded."""


@dataclass(frozen=True)
class Leg:
    """The joints of one leg over time.

    Attributes
    ----------
    hip, knee, ankle : (F, 3) float arrays [m]
    toward_toes : (F, 3) float array
        Direction of the foot.
    """

    hip: Array
    knee: Array
    ankle: Array
    toward_toes: Array

    @cached_property
    def thigh(self) -> Array:
        """Length of the thigh, (F,) [m]."""
        return _distance(self.hip, self.knee)

    @cached_property
    def shank(self) -> Array:
        """Length of the shank, (F,) [m]."""
        return _distance(self.knee, self.ankle)

    @property
    def length(self) -> Array:
        """Thigh and shank together, (F,) [m]."""
        return self.thigh + self.shank

    @property
    def span(self) -> Array:
        """Distance from hip to ankle, (F,) [m]."""
        return _distance(self.hip, self.ankle)

    @property
    def extension(self) -> Array:
        """Distance from hip to ankle over the leg's length, (F,)."""
        return np.asarray(self.span / np.maximum(self.length, 1e-12))

    @property
    def flexion(self) -> Array:
        """Angle by which the knee is bent, (F,) [rad], 0 where the leg is straight."""
        return self.flexion_at(self.span)[0]

    def flexion_at(self, span: Array, nearly_straight: float = 0.0) -> tuple[Array, Array]:
        """Flexion of the knee at a distance of the ankle from the hip, and its derivative.

        Parameters
        ----------
        span : (F,) float array
            Distance from hip to ankle [m]; the leg is straight, or folded, where it cannot be.
        nearly_straight : float
            The change is at least that of a knee bent by so much: it has no bound as the leg straightens [rad].

        Returns
        -------
        flexion : (F,) float array [rad]
        slope : (F,) float array [rad/m]
            Negative.
        """
        thigh, shank = self.thigh, self.shank
        product = np.maximum(thigh * shank, 1e-12)
        flexion = np.arccos(np.clip((span**2 - thigh**2 - shank**2) / (2 * product), -1.0, 1.0))
        sine = np.maximum(np.sin(flexion), max(np.sin(nearly_straight), 1e-9))
        return flexion, -span / (product * sine)


@dataclass(frozen=True)
class SolvedLeg:
    """Displacement of each part of a leg from the source, all (F, 4, 4) float arrays."""

    thigh: Array
    shank: Array


def solve(leg: Leg, hip: Array, ankle: Array, steady: float = 0.0) -> SolvedLeg:
    """Reach from a new hip to a new ankle with thigh and shank of the same length.

    Where the ankle is out of reach the leg points toward it, straight. Where nothing moved the result is the source,
    exactly.

    Parameters
    ----------
    leg : Leg
        The source.
    hip, ankle : (F, 3) float arrays
        Where they go [m].
    steady : float
        Standard deviation in samples of the smoothing of the direction in which a nearly straight knee lies: of a leg
        that was captured it is noise. Such a knee is not quite the source's then where nothing moved.
    """
    thigh, shank = leg.thigh, leg.shank
    farthest = np.maximum((thigh + shank) * (1 - _CLOSEST), leg.span)
    span = np.clip(_distance(hip, ankle), np.abs(thigh - shank) + _CLOSEST * (thigh + shank), farthest)
    axis, source_axis = unit(ankle - hip), unit(leg.ankle - leg.hip)

    along = (thigh**2 - shank**2 + span**2) / (2 * np.maximum(span, 1e-12))
    aside = np.sqrt(np.maximum(thigh**2 - along**2, 0.0))
    turn = rotation(turn_between(source_axis, axis))
    bend = (turn @ _bend(leg, source_axis, aside, steady)[..., None])[..., 0]
    knee = hip + along[:, None] * axis + aside[:, None] * bend
    foot = hip + span[:, None] * axis
    return SolvedLeg(
        displacement(rotation(turn_between(leg.knee - leg.hip, knee - hip)), leg.hip, hip),
        displacement(rotation(turn_between(leg.ankle - leg.knee, foot - knee)), leg.knee, knee),
    )


def _bend(leg: Leg, axis: Array, aside: Array, steady: float) -> Array:
    """Direction in which the knee lies off the source's axis: the source's, less of it the more it has to bend."""
    offset = leg.knee - leg.hip
    offset = offset - np.sum(offset * axis, axis=-1, keepdims=True) * axis
    distance = np.linalg.norm(offset, axis=-1)
    if steady:
        sure = np.clip(distance / (_SURE * leg.length), 0.0, 1.0)[:, None]
        offset = sure * offset + (1.0 - sure) * smoothed(offset, steady)
        offset -= np.sum(offset * axis, axis=-1, keepdims=True) * axis
    toes = unit(leg.toward_toes - np.sum(leg.toward_toes * axis, axis=-1, keepdims=True) * axis)
    settled = offset + _KNEE_HINT * leg.length[:, None] * toes
    forward = unit(np.where(np.linalg.norm(settled, axis=-1, keepdims=True) > 0, settled, perpendicular(axis)))
    sideways = np.cross(axis, forward)
    deviation = np.arctan2(np.sum(offset * sideways, axis=-1), np.sum(offset * forward, axis=-1))
    angle = deviation * np.minimum(1.0, distance / np.maximum(aside, 1e-12))
    return np.asarray(np.cos(angle)[:, None] * forward + np.sin(angle)[:, None] * sideways)


def _distance(start: Array, end: Array) -> Array:
    return np.asarray(np.linalg.norm(end - start, axis=-1))
