"""Feet that slide while they stand, as in a walk on the spot."""

from __future__ import annotations

import numpy as np

from ..motion.motion import CharacterMotion
from .contacts import REST_SPEED, Contacts


def treadmill_speed(motion: CharacterMotion, contacts: Contacts) -> float:
    """Speed of the belt that a character walks on [m/s]; 0 where its feet stand still or take it along.

    Parameters
    ----------
    motion : CharacterMotion
    contacts : Contacts
        At the motion's samples.

    Returns
    -------
    float
        Horizontal: of the soles while they touch, the median, relative to the body's way from the first sample to the
        last. Feet that slide no faster than a standing one may (`contacts.REST_SPEED`) stand still, and on skates and
        skis the body goes with them.
    """
    if motion.centre is not None or len(motion.frames) < 2:
        return 0.0
    slides = [np.zeros((0, 2))]
    for number, sole in enumerate(motion.soles):
        path = sole.landmark_positions()[..., :2].mean(axis=1)
        slides.append(np.gradient(path, motion.time_step, axis=0)[contacts.touching[:, number]])
    standing = np.concatenate(slides)
    if not len(standing):
        return 0.0
    belt = np.median(standing, axis=0)
    hips = motion.hips[[0, -1], :2]
    body = (hips[1] - hips[0]) / (motion.time_step * (len(motion.frames) - 1))
    speed = float(np.linalg.norm(belt))
    moves = speed > REST_SPEED * motion.froude_speed
    return speed if moves and np.linalg.norm(belt - body) > speed / 2 else 0.0
