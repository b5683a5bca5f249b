"""What a body's motion says about the forces on it: their sum, and the point of the ground through which they act."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .centre_of_mass import MassPoints, fitted_to_free_fall, mass_points
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
"""A body that nothing touches is in flight when its motion asks for less than this, in body weights. Otherwise it
hangs or flies by other means, and its motion says nothing about free fall."""
LIGHT = 0.2
"""Below this total force the point of action is not known, in body weights."""
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

    falling = None
    if airborne is not None and airborne.any():
        parts = points.part_centres()
        _, _, acceleration = smooth_path(parts.reshape(count, -1), step, cutoff, sampled=at_frame)
        acceleration = acceleration.reshape(parts.shape)
        fractions = np.bincount(points.parts, weights=points.fractions)
        falling = airborne & (np.einsum("p,npc->nc", fractions, acceleration)[:, 2] / gravity + 1 < FREE_FALL)
        if falling.any():
            points = fitted_to_free_fall(points, acceleration[falling], gravity)

    _, rate, _ = smooth_path(_angular_momentum(points, step), step, cutoff, sampled=at_frame)
    centre, _, acceleration = smooth_path(
        points.centre, step, cutoff, sampled=at_frame, falling=falling, fall=gravity, steady_ends=STEADY_ENDS
    )
    force = acceleration / gravity + (0.0, 0.0, 1.0)
    if falling is not None:
        force[falling] = 0.0
    return BodyDynamics(centre, force, rate / gravity)


def _angular_momentum(points: MassPoints, step: float) -> Array:
    """Angular momentum of the point masses about their centre, per body mass, (N, 3) [m²/s]."""
    if len(points.positions) < 2:
        return np.zeros((len(points.positions), 3))
    arm = points.positions - points.centre[:, None]
    return np.einsum("k,nkc->nc", points.fractions, np.cross(arm, np.gradient(arm, step, axis=0)))
