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
CUTOFF_CHOICES = np.array([1.0, 0.7, 0.5])
"""Cut-offs to choose from, as fractions of the highest."""
PASSED_BAND = np.pi / 3
"""Integral of the low-pass's gain over frequency in cut-offs: the share of white noise that passes."""
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
STEADY_ENDS = 0.01
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
    points : MassPoints
        The body that this holds for, at the scene frames among the steps.
    cutoff : float
        Cut-off of the low-pass that suits the motion [Hz].
    """

    centre: Array
    force: Array
    moment: Array
    points: MassPoints
    cutoff: float

    def point_of_action(self, ground: Array, steps: slice | NDArray[np.intp] = slice(None)) -> Array:
        """Where the total force meets the level `ground` (...,) [m] at steps (...,): the zero moment point.

        Where the force is too small to have one, the projection of the centre of mass.

        Returns
        -------
        (..., 2) float array [m]
        """
        centre, force, moment = self.centre[steps], self.force[steps], self.moment[steps]
        up = np.maximum(force[..., 2], LIGHT)
        height = centre[..., 2] - ground
        x = centre[..., 0] - (height * force[..., 0] + moment[..., 1]) / up
        y = centre[..., 1] - (height * force[..., 1] - moment[..., 0]) / up
        known = force[..., 2, None] > LIGHT
        return np.where(known, np.stack([x, y], axis=-1), centre[..., :2])


def body_dynamics(motion: CharacterMotion) -> BodyDynamics:
    """Forces that the motion asks for, before anything is known about flight.

    Parameters
    ----------
    motion : CharacterMotion
        On the simulation's time grid.
    """
    step, gravity = motion.time_step, motion.gravity
    sampled = motion.on_frames
    points, frame_step = mass_points(motion.at_frames()), step * len(sampled) / sampled.sum()
    pendulum = np.sqrt(gravity / motion.leg_length) / (2 * np.pi)
    highest = min(CUTOFF * pendulum, HIGHEST_CUTOFF / frame_step)
    cutoff = _suited_cutoff(points.centre, frame_step, highest)
    path = np.zeros((len(sampled), 6))
    path[sampled] = np.concatenate([_angular_momentum(points, frame_step), points.centre], axis=1)
    smooth, rate, acceleration = smooth_path(path, step, cutoff, sampled=sampled, steady_ends=STEADY_ENDS)
    force = acceleration[:, 3:] / gravity + (0.0, 0.0, 1.0)
    return BodyDynamics(smooth[:, 3:], force, rate[:, :3] / gravity, points, cutoff)


def with_flight(motion: CharacterMotion, body: BodyDynamics, airborne: Mask) -> BodyDynamics:
    """The same dynamics with the knowledge that nothing touches at the steps `airborne` (N,).

    In flight the force is 0, and the body's mass is fitted to that; where the motion is nowhere near free fall while
    nothing touches, it stays as it was.
    """
    flying = _flights(airborne, body.force[:, 2])
    if not flying.any():
        return body
    step, sampled = motion.time_step, motion.on_frames
    frame_step = step * len(sampled) / sampled.sum()
    parts = body.points.part_centres()
    _, _, acceleration = smooth_path(parts.reshape(len(parts), -1), frame_step, body.cutoff)
    fall = _rate_of_fall(body, flying, motion.gravity, round(0.5 / (body.cutoff * step)))
    falling = acceleration.reshape(parts.shape)[flying[sampled]]
    points = fitted_to_free_fall(body.points, falling, fall, independent=min(2 * body.cutoff * frame_step, 1.0))
    path = np.zeros((len(sampled), 3))
    path[sampled] = points.centre
    centre, _, acceleration = smooth_path(
        path, step, body.cutoff, sampled=sampled, falling=flying, fall=fall, steady_ends=STEADY_ENDS
    )
    force = acceleration / fall + (0.0, 0.0, 1.0)
    force[flying] = 0.0
    return BodyDynamics(centre, force, body.moment, points, body.cutoff)


def _suited_cutoff(path: Array, step: float, highest: float) -> float:
    """Cut-off that predicts each sample best from the others [Hz]: lower for noise, higher for a lively motion.

    Generalised cross-validation (Craven and Wahba 1979, "Smoothing noisy data with spline functions").
    """
    cutoffs = highest * CUTOFF_CHOICES
    unexplained = [((smooth_path(path, step, cutoff)[0] - path) ** 2).sum() for cutoff in cutoffs]
    passed = np.minimum(2 * cutoffs * step * PASSED_BAND, 0.9)
    return float(cutoffs[np.argmin(unexplained / (1 - passed) ** 2)])


def _flights(airborne: Mask, force: Array) -> Mask:
    """Those stretches without contact in which the motion asks for little force (N,) [body weights]."""
    flights = airborne.copy()
    for first, last in zip(*runs(airborne), strict=True):
        flights[first:last] = force[first:last].mean() < FREE_FALL
    return flights


def _rate_of_fall(body: BodyDynamics, flying: Mask, gravity: float, edge: int) -> float:
    """Acceleration of the body in flight [m/s²]: gravity, unless the animation's time or size is another.

    A jump made by hand, retimed or put on a larger rig hangs in the air or drops like a stone. Its forces are those
    of the same motion at the time scale at which it falls with gravity.
    """
    window = np.lib.stride_tricks.sliding_window_view(np.pad(flying, edge // 2, mode="edge"), edge // 2 * 2 + 1)
    inner = 1 - body.force[window.all(axis=1), 2]
    if not len(inner):
        return gravity
    ratio = float(np.clip(np.median(inner), *RATES_OF_FALL))
    return ratio * gravity if abs(ratio - 1) > TRUE_FALL else gravity


def _angular_momentum(points: MassPoints, step: float) -> Array:
    """Angular momentum of the point masses about their centre, per body mass, (N, 3) [m²/s]."""
    if len(points.positions) < 2:
        return np.zeros((len(points.positions), 3))
    x, y, z = arm = (points.positions - points.centre[:, None]).transpose(2, 0, 1)
    u, v, w = np.gradient(arm, step, axis=1)
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u]).dot(points.fractions).T
