"""How a foot lies when it stands: the sole's flat attitude, found in the motion itself.

The rest pose of a rig need not have flat feet, so the attitude is taken at the instants at which the foot is planted:
low and still. Their median is robust against the few that are misjudged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .motion import Array
from .soles import ANKLE_HEIGHT, ANKLE_POSITION, BALL_POSITION, FOOT_TO_LEG

UP = np.array((0.0, 0.0, 1.0))

_STILL_SPEED = 0.05
"""A foot slower than this, over sqrt(g·leg length), is still (0.15 m/s for a man)."""

_STILL_SHARE = 0.2
"""Of a foot that never is still, the slowest part of its low instants counts."""

_LOW_CLEARANCE = 0.05
"""Height above the foot's own lowest position within `_FLOOR_WINDOW`, over leg length, up to which a foot is low."""

_STEP_CLEARANCE = 0.3
"""Height above the lowest of all feet, over leg length: above the stair of the other foot it does not stand."""

_FLOOR_WINDOW = 2.0
"""Time over which the floor under a foot is sought [s]: a walking foot is down at least once in it."""

_MOST_SPREAD = np.radians(20.0)
"""Planted instants further than this from the median attitude are heel-off or misjudged, and are left out."""

_FEWEST_INSTANTS = 3

_ANKLE_HEIGHTS = (0.12, 0.55)
"""Heights of the ankle over foot length that a foot can have; outside, the bones do not reach the ground."""

_TIP_TRUST = (0.7, 1.45)
"""Foot length from the toe tip over that from the ball, within which the tip is where the toes end; tips of leaf
bones are often made up by importers."""


def planted_instants(
    feet: Sequence[Array], *, frame_rate: float, leg_length: float, gravity: float = 9.81
) -> list[NDArray[np.bool_]]:
    """When each foot is planted.

    Parameters
    ----------
    feet : sequence of (F, K, 3) float arrays
        Paths of points of each foot, such as ankle and ball [m].
    frame_rate : float
        Samples per second [Hz].
    leg_length : float
        [m]
    gravity : float
        [m/s²]

    Returns
    -------
    list of (F,) bool arrays
    """
    if not feet:
        return []
    froude = np.sqrt(gravity * leg_length)
    half_window = max(1, round(_FLOOR_WINDOW / 2 * frame_rate))
    lowest = [foot[..., 2].min(axis=1) for foot in feet]
    floors = [_moving_minimum(height, half_window) for height in lowest]
    common_floor = np.minimum.reduce(floors)
    planted = []
    for foot, height, floor in zip(feet, lowest, floors, strict=True):
        if len(foot) > 1:
            speed = np.linalg.norm(np.gradient(foot, axis=0), axis=-1).max(axis=1) * frame_rate / froude
        else:
            speed = np.zeros(len(foot))
        low = (height <= floor + _LOW_CLEARANCE * leg_length) & (height <= common_floor + _STEP_CLEARANCE * leg_length)
        limit = max(_STILL_SPEED, float(np.quantile(speed[low], _STILL_SHARE))) if low.any() else 0.0
        planted.append(low & (speed <= limit))
    return planted


def _moving_minimum(values: Array, half_window: int) -> Array:
    """Smallest value within `half_window` samples to both sides."""
    half_window = min(half_window, len(values))
    padded = np.pad(values, half_window, constant_values=np.inf)
    return np.lib.stride_tricks.sliding_window_view(padded, 2 * half_window + 1).min(axis=1)


def typical_direction(directions: Array) -> Array | None:
    """Unit vector that most of the given ones agree on, or None if there are too few of them.

    Parameters
    ----------
    directions : (K, 3) float array
        Unit vectors.

    Returns
    -------
    (3,) float array or None
    """
    if len(directions) < 1:
        return None
    centre = _unit(np.median(directions, axis=0))
    near = directions @ centre >= np.cos(_MOST_SPREAD)
    if near.sum() < min(_FEWEST_INSTANTS, len(directions)):
        return None
    return _unit(directions[near].mean(axis=0))


@dataclass(frozen=True)
class FlatFoot:
    """The sole frame as the foot bone and the toe bone carry it.

    Both frames coincide when the foot stands flat. They are given in the rest pose.

    Attributes
    ----------
    foot_frame, toe_frame : (4, 4) float arrays
        Sole frame to rest pose [m]; x toward the toes, y left, z up, the ankle over the origin.
    ball : float
        x of the joint of the toes [m].
    """

    foot_frame: Array
    toe_frame: Array
    ball: float


def flat_foot(
    ankle: Array,
    ball: Array,
    forward: Array,
    foot_rotations: Array,
    toe_rotations: Array,
    planted: NDArray[np.bool_],
    *,
    trust_rest_within: float = 0.0,
) -> FlatFoot:
    """The attitude of a flat sole relative to its bones.

    Parameters
    ----------
    ankle, ball : (3,) float arrays
        Joints in the rest pose [m]. The ball is where the toes bend, or else the tip of the foot.
    forward : (3,) float array
        Direction toward the toes in the rest pose.
    foot_rotations, toe_rotations : (F, 3, 3) float arrays
        Rotations from the rest pose to each sample.
    planted : (F,) bool array
        When the foot stands.
    trust_rest_within : float
        A rest pose that is flat within this angle is taken as flat [rad].

    Returns
    -------
    FlatFoot
        With the origin at the height of the ankle.
    """
    foot_up = _standing_up(foot_rotations[planted], trust_rest_within)
    toe_up = _standing_up(toe_rotations[planted], trust_rest_within)
    forward = _unit(forward - (forward @ foot_up) * foot_up)
    foot_axes = np.column_stack([forward, np.cross(foot_up, forward), foot_up])

    carried = typical_direction(
        np.einsum("fji,fjk,k->fi", toe_rotations[planted], foot_rotations[planted], foot_axes[:, 0])
    )
    toe_forward = foot_axes[:, 0] if carried is None or np.allclose(toe_up, foot_up) else carried
    toe_forward = _unit(toe_forward - (toe_forward @ toe_up) * toe_up)
    toe_axes = np.column_stack([toe_forward, np.cross(toe_up, toe_forward), toe_up])

    in_sole = foot_axes.T @ (ball - ankle)
    return FlatFoot(
        foot_frame=_frame(foot_axes, ankle),
        toe_frame=_frame(toe_axes, ball - toe_axes @ in_sole),
        ball=float(in_sole[0]),
    )


def _standing_up(rotations: Array, trust_rest_within: float) -> Array:
    """World up as seen from the rest pose while standing; the rest pose's own up where the motion does not tell."""
    up = typical_direction(rotations[:, 2, :])
    if up is None or up @ UP >= np.cos(trust_rest_within):
        return UP
    return up


def foot_length(ankle_to_ball: float | None, ankle_to_tip: float | None, leg: float) -> float:
    """Length of a foot from what its bones tell.

    Parameters
    ----------
    ankle_to_ball, ankle_to_tip : float or None
        Distances along the flat sole [m]; None or not positive where the rig does not have the joint. A tip without a
        ball may turn out to be the ball.
    leg : float
        Thigh and shank together [m].

    Returns
    -------
    float
        [m]
    """
    expected = FOOT_TO_LEG * leg
    to_tip = 1 - ANKLE_POSITION
    to_ball = BALL_POSITION - ANKLE_POSITION
    smallest = 0.25 * expected
    from_ball = ankle_to_ball / to_ball if ankle_to_ball and ankle_to_ball > smallest * to_ball else None
    from_tip = ankle_to_tip / to_tip if ankle_to_tip and ankle_to_tip > smallest * to_tip else None
    if from_ball and from_tip:
        return from_tip if _TIP_TRUST[0] < from_tip / from_ball < _TIP_TRUST[1] else from_ball
    if from_ball:
        return from_ball
    if from_tip:
        as_ball = from_tip * to_tip / to_ball
        return min(from_tip, as_ball, key=lambda length: abs(np.log(length / expected)))
    return expected


def ankle_height(lowest_joint: float, length: float) -> float:
    """Height of the ankle above the sole [m], from the depth of the lowest joint of the foot below it."""
    low, high = _ANKLE_HEIGHTS
    return lowest_joint if low * length <= lowest_joint <= high * length else ANKLE_HEIGHT * length


def _frame(axes: Array, origin: Array) -> Array:
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = axes, origin
    return frame


def _unit(vector: Array) -> Array:
    return vector / max(float(np.linalg.norm(vector)), np.finfo(float).tiny)
