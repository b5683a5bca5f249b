"""When each sole touches its ground.

Detection is scale-free: heights are compared as fractions of the leg length and speeds as fractions of
sqrt(gravity·leg length), so that the same numbers serve a mouse and a giant, metres and centimetres
(MODEL.md section 3, "Contact").
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .motion import CharacterMotion, SoleMotion

if TYPE_CHECKING:
    from .heightfield import Terrain

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

TOUCH_HEIGHT = 0.025
"""A sole lower than this starts to touch, in leg lengths (2 cm for an adult)."""
LEAVE_HEIGHT = 0.05
"""A touching sole higher than this has left, in leg lengths."""
TOUCH_SPEED = 0.4
"""A sole slower than this starts to touch, in sqrt(gravity·leg length) (1.2 m/s for an adult)."""
LEAVE_SPEED = 0.6
"""A touching sole faster than this has left, in sqrt(gravity·leg length)."""
REST_SPEED = 0.15
"""A sole slower than this may be standing: such samples tell the float, in sqrt(gravity·leg length)."""
FLOAT_PERCENTILE = 10.0
"""The clearance of a standing sole that counts as float or sink: low, but no single outlier."""
FLOAT_LIMIT = 0.15
"""A sole that never comes nearer than this to its ground does not float, it does not touch, in leg lengths."""
SHORTEST_CONTACT = 0.165
"""Gaps and blips shorter than this close, in sqrt(leg length/gravity) (0.05 s for an adult)."""
STEEPEST_GROUND = np.cos(np.radians(60.0))
"""Vertical part of the normal of the steepest ground that bears a sole: more is a wall."""
SLOPE_PROBE = 0.02
"""Half the distance over which the ground's slope is read, in leg lengths."""


@dataclass(frozen=True)
class Contacts:
    """Which soles touch at each step.

    Attributes
    ----------
    touching : (N, S) bool array
    offset : (S,) float array
        Constant float (positive) or sink (negative) of each sole that detection removed [m].
    normal : (N, S, 3) float array
        The ground's unit normal under each sole.
    """

    touching: Mask
    offset: Array
    normal: Array


def detect_contacts(motion: CharacterMotion, terrain: Terrain) -> Contacts:
    """Find when each sole touches the terrain, by height and speed with hysteresis.

    Parameters
    ----------
    motion : CharacterMotion
        On the simulation's time grid.
    terrain : Terrain
        The undisturbed ground. Where it is missing or steeper than 60° there is no contact.

    Returns
    -------
    Contacts
    """
    touching, offset, normal = zip(*(_detect(sole, motion, terrain) for sole in motion.soles), strict=True)
    return Contacts(np.stack(touching, axis=1), np.array(offset), np.stack(normal, axis=1))


def ground_normal(terrain: Terrain, x: Array, y: Array, *, reach: float) -> Array:
    """Unit normals of the terrain at positions of any shape (...,), from central differences over ±reach [m].

    Returns
    -------
    (..., 3) float array, NaN where the ground is missing.
    """
    slope_x = (terrain.heights(x + reach, y) - terrain.heights(x - reach, y)) / (2 * reach)
    slope_y = (terrain.heights(x, y + reach) - terrain.heights(x, y - reach)) / (2 * reach)
    normal = np.stack([-slope_x, -slope_y, np.ones_like(slope_x)], axis=-1)
    return normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def clearances(sole: SoleMotion, terrain: Terrain, *, reach: float) -> tuple[Array, Array]:
    """Distances of a sole's landmarks from the ground, measured along its normal.

    Parameters
    ----------
    sole : SoleMotion
    terrain : Terrain
    reach : float
        Half the distance over which the ground's slope is read [m].

    Returns
    -------
    clearance : (N, L) float array [m]
        Infinite where the ground is missing or too steep to stand on.
    normal : (N, L, 3) float array
        The ground's unit normal, vertical where there is none.
    """
    points = sole.landmark_positions()
    x, y, z = np.moveaxis(points, -1, 0)
    normal = ground_normal(terrain, x, y, reach=reach)
    clearance = (z - terrain.heights(x, y)) * normal[..., 2]
    bears = np.isfinite(clearance) & (normal[..., 2] >= STEEPEST_GROUND)
    return np.where(bears, clearance, np.inf), np.where(np.isfinite(normal), normal, (0.0, 0.0, 1.0))


def hysteresis(start: Mask, stop: Mask) -> Mask:
    """States that `start` switches on and `stop` switches off along the first axis, off before either."""
    step = np.arange(1, len(start) + 1)
    last_start = np.maximum.accumulate(np.where(start & ~stop, step, 0))
    last_stop = np.maximum.accumulate(np.where(stop, step, 0))
    return last_start > last_stop


def close_short(state: Mask, shortest: int) -> Mask:
    """A state over time without interior gaps, then without blips, of fewer than `shortest` steps.

    Gaps and blips that reach the first or the last step are of unknown length and stay.
    """
    state = state.copy()
    for value in (False, True):
        start, end = runs(state == value)
        for first, last in zip(start, end, strict=True):
            if first > 0 and last < len(state) and last - first < shortest:
                state[first:last] = not value
    return state


def runs(state: Mask) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First steps of the runs of true in `state`, and the steps just after their last."""
    edges = np.diff(np.concatenate(([0], state.astype(np.int8), [0])))
    return np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)


def _detect(sole: SoleMotion, motion: CharacterMotion, terrain: Terrain) -> tuple[Mask, float, Array]:
    """When one sole touches, the float that was removed, and the normal under its lowest landmark."""
    leg, step = motion.leg_length, motion.time_step
    clearance, normals = clearances(sole, terrain, reach=SLOPE_PROBE * leg)
    now = np.arange(len(clearance))
    lowest = clearance.argmin(axis=1)
    height = clearance[now, lowest]
    speed = _speeds(sole.landmark_positions(), step)[now, lowest] / np.sqrt(motion.gravity * leg)
    offset = _float(height, speed, leg)
    height = (height - offset) / leg
    touching = hysteresis(
        (height < TOUCH_HEIGHT) & (speed < TOUCH_SPEED),
        (height > LEAVE_HEIGHT) | (speed > LEAVE_SPEED),
    )
    shortest = round(SHORTEST_CONTACT * np.sqrt(leg / motion.gravity) / step)
    return close_short(touching, shortest), offset, normals[now, lowest]


def _speeds(points: Array, step: float) -> Array:
    """Speed of each point, (N, L) [m/s]: the smaller of the steps before and after, so that a jump does not widen."""
    stride = np.linalg.norm(np.diff(points, axis=0), axis=-1) / step
    if not len(stride):
        return np.zeros(points.shape[:2])
    return np.minimum(np.concatenate([stride[:1], stride]), np.concatenate([stride, stride[-1:]]))


def _float(height: Array, speed: Array, leg_length: float) -> float:
    """The clearance at which a sole stands [m], 0 when it never does."""
    near = np.abs(height) < FLOAT_LIMIT * leg_length
    standing = near & (speed < REST_SPEED)
    if not standing.any():
        standing = near
    return float(np.percentile(height[standing], FLOAT_PERCENTILE)) if standing.any() else 0.0
