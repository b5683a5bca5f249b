"""Where on each sole the ground presses: from the heel to the toes as the foot rolls."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .motion import CharacterMotion

Array = NDArray[np.float64]

PRESSED_DEPTH = 0.01
"""Landmarks this much higher than the lowest one bear e times less of the pressure, in leg lengths."""


def lowest_points(motion: CharacterMotion) -> Array:
    """The middle of each sole's landmarks, the lowest ones counting most, (N, S, 3) [m].

    It tells where a sole can press: the heel at heel strike, the whole sole in mid-stance, the toes at toe-off.
    """
    centres = []
    for sole in motion.soles:
        points = sole.landmark_positions()
        height = points[..., 2] - points[..., 2].min(axis=1, keepdims=True)
        nearness = np.exp(-height / (PRESSED_DEPTH * motion.leg_length))
        centres.append((nearness[..., None] * points).sum(axis=1) / nearness.sum(axis=1)[:, None])
    return np.stack(centres, axis=1)
