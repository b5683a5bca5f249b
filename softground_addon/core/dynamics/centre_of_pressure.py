"""Centre of pressure on each sole: from the heel to the toes as the foot rolls."""

from __future__ import annotations

import numpy as np

from ..motion.motion import CharacterMotion
from ..numerics.arrays import Array

PRESSED_DEPTH = 0.01
"""Landmarks this much higher than the lowest one bear e times less of the pressure, in leg lengths."""


def lowest_points(motion: CharacterMotion) -> Array:
    """The middle of each sole's landmarks, the lowest ones counting most, (N, S, 3) [m].

    It tells where a sole can press: the heel at heel strike, the whole sole in mid-stance, the toes at toe-off.
    """
    centres = []
    for sole in motion.soles:
        points = sole.landmark_positions()
        centres.append(np.einsum("nl,nlc->nc", _nearness(points, motion), points))
    return np.stack(centres, axis=1)


def extents(motion: CharacterMotion, lowest: Array) -> Array:
    """Spread of each sole's pressure about its `lowest_points` (N, S, 3), on the level: standard deviation, (N, S) [m].

    Little on the heel or on the toes, most on a flat foot.
    """
    spread = []
    for index, sole in enumerate(motion.soles):
        points = sole.landmark_positions()
        off = points[..., :2] - lowest[:, index, None, :2]
        spread.append(np.einsum("nl,nlc,nlc->n", _nearness(points, motion), off, off))
    return np.sqrt(np.stack(spread, axis=1))


def _nearness(points: Array, motion: CharacterMotion) -> Array:
    """Shares of the pressure that a sole's landmarks (N, L, 3) can bear by their height, (N, L)."""
    height = points[..., 2] - points[..., 2].min(axis=1, keepdims=True)
    nearness = np.exp(-height / (PRESSED_DEPTH * motion.leg_length))
    shares: Array = nearness / nearness.sum(axis=1, keepdims=True)
    return shares


def centres_of_pressure(motion: CharacterMotion, lowest: Array, share: Array, target: Array, trust: Array) -> Array:
    """Centres of pressure of the soles when the loads' common point of action is known, (N, S, 3) [m].

    Each sole's centre moves along the sole from its `lowest_points` toward the place at which the loads' moment
    agrees with the point of action, as far as landmarks are low enough to bear: from the heel at heel strike to the
    toes at toe-off.

    Parameters
    ----------
    lowest : (N, S, 3) float array
        Its `lowest_points` [m].
    share : (N, S) float array
        Each sole's share of the total force.
    target : (N, 2) float array
        Point of action of the total force on the ground [m].
    trust : (N,) float array
        How far `target` is followed, 0 to 1.
    """
    centres = lowest.copy()
    missing = trust[:, None] * (target - np.einsum("ns,nsc->nc", share, centres[..., :2]))
    emphasis = share / np.maximum(np.einsum("ns,ns->n", share, share), 1e-9)[:, None]
    for index, sole in enumerate(motion.soles):
        points = sole.landmark_positions()
        along = points[:, -1, :2] - points[:, 0, :2]
        length = np.linalg.norm(along, axis=1, keepdims=True)
        along = np.divide(along, length, out=np.zeros_like(along), where=length > 0)
        place = np.einsum("nlc,nc->nl", points[..., :2] - centres[:, index, None, :2], along)
        height = points[..., 2] - points[..., 2].min(axis=1, keepdims=True)
        place *= np.exp(-height / (PRESSED_DEPTH * motion.leg_length))
        wanted = np.einsum("nc,nc->n", missing, along) * emphasis[:, index]
        centres[:, index, :2] += np.clip(wanted, place.min(axis=1), place.max(axis=1))[:, None] * along
    return centres
