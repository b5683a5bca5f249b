"""What a body's motion says about the forces on it: their sum, and the point of the ground through which they act."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .centre_of_mass import MassPoints, fitted_to_free_fall, mass_points
from .contacts import runs
from .motion import CharacterMotion
from .smoothing_spline import smooth_path

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

CUTOFF = 16.0
"""Cut-off of the low-pass in pendulum frequencies sqrt(gravity/leg length)/(2·pi): 8 Hz for an adult, above the sixth
harmonic of running and far below the frame rate of motion capture."""
HIGHEST_CUTOFF = 0.34
"""Highest cut-off as a fraction of the scene's frame rate: 8 Hz at 24 fps."""
FREE_FALL = 0.5
"""A body that nothing touches is in flight when its motion asks for less than this on average, in body weights.
Otherwise it hangs or flies by other means, and its motion says nothing about free fall."""
LIGHT = 0.2
"""Below this total force the point of action is not known, in body weights."""
TRUE_FALL = 0.2
"""A flight whose fall differs from gravity by less shows the error of the body's mass, not another time scale."""
RATES_OF_FALL = (0.5, 3.0)
"""Slowest and fastest fall that is taken for a flight, in gravities."""
STEADY_ENDS = 0.04
"""How much a force of 1 body weight is expected at both ends of the action, where half of the evidence is missing."""


@dataclass(frozen=True)
class BodyDynamics:
    """Motion of the body as a whole at each step.

    Attributes
    ----------
    centre : (N, 3) float array
        Centre of mass [m].
    force : (N, 3) float array
        Force that the motion asks for, per weight [body weights].
    moment : (N, 3) float array
        Rate of the angular momentum about the centre of mass, per weight [m].
    """

    centre: Array
    force: Array
    moment: Array

    def point_of_action(self, ground: Array, steps: slice = slice(None)) -> Array:
        """Where the total force meets the level `ground` (M,) [m] at M steps, (M, 2) [m]: the zero moment point.

        Where the force is too small to have one, the projection of the centre of mass.
        """
        centre, force, moment = self.centre[steps], self.force[steps], self.moment[steps]
        up = np.maximum(force[:, 2], LIGHT)
        height = centre[:, 2] - ground
        x = centre[:, 0] - (height * force[:, 0] + moment[:, 1]) / up
        y = centre[:, 1] - (height * force[:, 1] - moment[:, 0]) / up
        known = force[:, 2] > LIGHT
        return np.where(known[:, None], np.stack([x, y], axis=1), centre[:, :2])


def body_dynamics(motion: CharacterMotion, airborne: Mask | None = None) -> BodyDynamics:
    """Forces that the motion asks for.

    Parameters
    ----------
    motion : CharacterMotion
        On the simulation's time grid.
    airborne : (N,) bool array, optional
        Steps at which nothing touches. There the force is 0 where the motion is near free fall, and the body's mass
        is fitted to that.
    """
    step, gravity = motion.time_step, motion.gravity
    points = mass_points(motion)
    count = len(points.positions)
    at_frame = np.abs((motion.frames - motion.frames[0] + 0.5) % 1.0 - 0.5) < 1e-6
    pendulum = np.sqrt(gravity / motion.leg_length) / (2 * np.pi)
    cutoff = min(CUTOFF * pendulum, HIGHEST_CUTOFF * at_frame.sum() / (count * step))

    falling, fall = None, gravity
    if airborne is not None and airborne.any():
        parts = points.part_centres()
        _, _, acceleration = smooth_path(parts.reshape(count, -1), step, cutoff, sampled=at_frame)
        acceleration = acceleration.reshape(parts.shape)
        fractions = np.bincount(points.parts, weights=points.fractions)
        downward = -np.einsum("p,npc->nc", fractions, acceleration)[:, 2]
        falling = _flights(airborne, 1 - downward / gravity)
        if falling.any():
            fall = _rate_of_fall(downward, falling, gravity, round(0.5 / (cutoff * step)))
            points = fitted_to_free_fall(points, acceleration[falling], fall)

    _, rate, _ = smooth_path(_angular_momentum(points, step), step, cutoff, sampled=at_frame)
    centre, _, acceleration = smooth_path(
        points.centre, step, cutoff, sampled=at_frame, falling=falling, fall=fall, steady_ends=STEADY_ENDS
    )
    force = acceleration / fall + (0.0, 0.0, 1.0)
    if falling is not None:
        force[falling] = 0.0
    return BodyDynamics(centre, force, rate / gravity)


def _flights(airborne: Mask, force: Array) -> Mask:
    """Those stretches without contact in which the motion asks for little force (N,) [body weights]."""
    flights = airborne.copy()
    for first, last in zip(*runs(airborne), strict=True):
        flights[first:last] = force[first:last].mean() < FREE_FALL
    return flights


def _rate_of_fall(downward: Array, falling: Mask, gravity: float, edge: int) -> float:
    """Acceleration of the body in flight [m/s²]: gravity, unless the animation's time or size is another.

    A jump made by hand, retimed or put on a larger rig hangs in the air or drops like a stone. Its forces are those
    of the same motion at the time scale at which it falls with gravity.
    """
    window = np.lib.stride_tricks.sliding_window_view(np.pad(falling, edge // 2, mode="edge"), edge // 2 * 2 + 1)
    inner = downward[window.all(axis=1)]
    if not len(inner):
        return gravity
    rate = float(np.clip(np.median(inner), *(gravity * np.array(RATES_OF_FALL))))
    return rate if abs(rate / gravity - 1) > TRUE_FALL else gravity


def _angular_momentum(points: MassPoints, step: float) -> Array:
    """Angular momentum of the point masses about their centre, per body mass, (N, 3) [m²/s]."""
    if len(points.positions) < 2:
        return np.zeros((len(points.positions), 3))
    arm = points.positions - points.centre[:, None]
    return np.einsum("k,nkc->nc", points.fractions, np.cross(arm, np.gradient(arm, step, axis=0)))
