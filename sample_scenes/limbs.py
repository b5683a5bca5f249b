"""Legs and arms that reach for a place: two-bone inverse kinematics over all frames at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def bend_to_reach(root: Array, tip: Array, upper: float, lower: float, toward: Array) -> tuple[Array, Array]:
    """Middle joint of a limb of two bones, and the axis that it bends about.

    Parameters
    ----------
    root, tip : (F, 3) float array
        Ends of the limb [m]. A tip out of reach is reached for with a straight limb.
    upper, lower : float
        Lengths of the bones [m].
    toward : (F, 3) float array
        Direction into which the middle joint points; only its part across the limb counts.

    Returns
    -------
    joint : (F, 3) float array
        [m]
    lateral : (F, 3) float array
        Unit vectors to the left of the plane in which the limb bends.
    """
    reach = tip - root
    distance = np.linalg.norm(reach, axis=1)
    span = np.clip(distance, abs(upper - lower), upper + lower)
    cos_root = np.clip((upper**2 + span**2 - lower**2) / (2 * upper * span), -1.0, 1.0)
    along = reach / distance[:, None]
    ahead = toward - (toward * along).sum(axis=1, keepdims=True) * along
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    lateral = -np.cross(along, ahead)  # down x forward = -left
    joint = root + upper * (cos_root[:, None] * along + np.sqrt(1 - cos_root**2)[:, None] * ahead)
    return joint, lateral


def hanging(direction: Array, lateral: Array) -> Array:
    """Rotations that take down to `direction` and left to `lateral`, which is perpendicular to it, (F, 3, 3)."""
    up = -direction / np.linalg.norm(direction, axis=1, keepdims=True)
    return np.stack([np.cross(lateral, up), lateral, up], axis=-1)
