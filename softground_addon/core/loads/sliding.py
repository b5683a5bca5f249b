"""Feet that slide while they stand, as in a walk on the spot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..motion.motion import CharacterMotion
from .contacts import Contacts, slowest_belt


def treadmill_velocity(motion: CharacterMotion, contacts: Contacts) -> NDArray[np.float64]:
    """Velocity of the belt that a character walks on [m/s]; 0 where its feet stand still or take it along.

    Parameters
    ----------
    contacts : Contacts
        At the motion's samples.

    Returns
    -------
    (2,) float array
        Horizontal: of the soles while they touch, the median. Feet that slide no faster than a standing one may
        (`contacts.slowest_belt`) stand still; on skates and skis the body goes with them, in a sprint ahead of them.
        Where the body travels by more than half of what its feet slide back against it, as with Root Motion, they slip.
    """
    if motion.centre is not None or len(motion.frames) < 2:
        return np.zeros(2)
    paths = [sole.landmark_positions()[..., :2].mean(axis=1) for sole in motion.soles]
    velocities = [np.gradient(path, motion.time_step, axis=0) for path in paths]
    slides = [velocity[on] for velocity, on in zip(velocities, contacts.touching.T, strict=True)]
    standing = np.concatenate([np.zeros((0, 2)), *slides])
    if not len(standing):
        return np.zeros(2)
    belt = np.median(standing, axis=0)
    hips = motion.hips[[0, -1], :2]
    body = (hips[1] - hips[0]) / (motion.time_step * (len(motion.frames) - 1))
    moves = np.linalg.norm(belt) > slowest_belt(velocities, motion)
    walked = belt - body
    return belt * (moves and walked @ belt > max(belt @ belt, walked @ walked) / 2)


def treadmill_speed(motion: CharacterMotion, contacts: Contacts) -> float:
    """Speed of that belt [m/s]."""
    return float(np.linalg.norm(treadmill_velocity(motion, contacts)))
