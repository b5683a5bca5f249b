"""Attitude of a standing foot: the sole's flat attitude, found in the motion itself.

The rest pose of a rig need not have flat feet, so the attitude is taken at the instants at which the foot is planted:
low and still. Their median is robust against the few that are misjudged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array
from ..numerics.rigid import unit
from .soles import ANKLE_HEIGHT, ANKLE_POSITION, BALL_POSITION, FOOT_TO_LEG

UP = np.array((0.0, 0.0, 1.0))

_STILL_SPEED = 0.05
"""A foot slower than this, over sqrt(g·leg length), is still (0.15 m/s for a man)."""

_STILL_SHARE = 0.2
"""Slowest part of the low instants that counts for feet that never are still, at least `_FEWEST_INSTANTS`."""

_LOW_CLEARANCE = 0.05
"""Height above the foot's own lowest position within `_FLOOR_WINDOW`, over leg length, up to which a foot is low."""

_STEP_CLEARANCE = 0.3
"""Height above the lowest of all feet, over leg length: above the stair of the other foot it does not stand."""

_FLOOR_WINDOW = 2.0
"""Time over which the floor under a foot is sought [s]: a walking foot is down at least once in it."""

_MOST_SPREAD = np.radians(20.0)
"""Planted instants further than this from the median attitude are heel-off or misjudged, and are left out."""

_FEWEST_INSTANTS = 3

_HOLD = 1e-6
"""Displacement over leg length below which a pose is a hold, such as the frames beyond the last key."""

_ANKLE_HEIGHTS = (0.12, 0.55)
"""Heights of the ankle over foot length that a foot can have; outside, the bones do not reach the ground."""

_LEAST_FOOT = 0.3
"""Foot length over the one that fits the leg, below which the bones are stubs of no use."""

_TIP_TRUST = (0.8, 1.3)
"""Foot length from the toe tip over that from the ball, within which the tip is where the toes end; tips of leaf
bones are often made up by importers."""


_TIP_POINTS = (0.7, 1.3)
"""The same within which the tip shows where the foot points: the last marker of a capture is on the toes, not before
them."""


def planted_instants(
    feet: Sequence[Array], *, frame_rate: float, leg_length: float, gravity: float = 9.81
) -> list[NDArray[np.bool_]]:
    """Instants at which each foot is planted.

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
        A pose that is held without any motion counts once, at its first instant; a foot that stands for too few
        instants to be sure of is never planted.
    """
    if not feet:
        return []
    froude = np.sqrt(gravity * leg_length)
    half_window = max(1, round(_FLOOR_WINDOW / 2 * frame_rate))
    lowest = [foot[..., 2].min(axis=1) for foot in feet]
    floors = [_moving_minimum(height, half_window) for height in lowest]
    common_floor = np.minimum.reduce(floors)
    held = _held(np.concatenate(feet, axis=1), _HOLD * leg_length)
    speeds = [_fastest(foot) * frame_rate / froude for foot in feet]
    low = [
        ~held
        & (height <= floor + _LOW_CLEARANCE * leg_length)
        & (height <= common_floor + _STEP_CLEARANCE * leg_length)
        for height, floor in zip(lowest, floors, strict=True)
    ]
    planted = [near & (speed <= _STILL_SPEED) for near, speed in zip(low, speeds, strict=True)]
    if sum(int(still.sum()) for still in planted) < _FEWEST_INSTANTS:
        planted = [
            near & (speed <= _slow(speed[near])) if near.any() else near
            for near, speed in zip(low, speeds, strict=True)
        ]
    fewest = min(_FEWEST_INSTANTS, int((~held).sum()))
    return [stands & (stands.sum() >= fewest) for stands in planted]


def _slow(speeds: Array) -> float:
    """The speed up to which the slowest of some instants count, however few they are (K,)."""
    return max(float(np.quantile(speeds, _STILL_SHARE)), float(np.sort(speeds)[:_FEWEST_INSTANTS][-1]))


def _held(points: Array, tolerance: float) -> NDArray[np.bool_]:
    """Samples at which nothing has moved since the one before."""
    moved = np.abs(np.diff(points, axis=0)).max(axis=(1, 2)) > tolerance
    return np.concatenate([[False], ~moved])


def _fastest(points: Array) -> Array:
    """Largest displacement per sample among a foot's points, (F,)."""
    if len(points) < 2:
        return np.zeros(len(points))
    return np.linalg.norm(np.gradient(points, axis=0), axis=-1).max(axis=1)


def _moving_minimum(values: Array, half_window: int) -> Array:
    """Smallest value within `half_window` samples to both sides."""
    half_window = min(half_window, len(values))
    padded = np.pad(values, half_window, constant_values=np.inf)
    return np.lib.stride_tricks.sliding_window_view(padded, 2 * half_window + 1).min(axis=1)


def typical_direction(directions: Array) -> Array | None:
    """Unit vector that most of the given ones agree on, or None if they do not.

    Parameters
    ----------
    directions : (K, 3) float array
        Unit vectors.

    Returns
    -------
    (3,) float array or None
    """
    if not len(directions):
        return None
    centre = unit(np.median(directions, axis=0))
    near = directions @ centre >= np.cos(_MOST_SPREAD)
    return unit(directions[near].mean(axis=0)) if near.any() else None


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


def standing_up(turns: Array, others: Sequence[Array] = (), *, trust_rest_within: float = 0.0) -> Array:
    """World up as a standing foot's bone has it in the rest pose.

    Parameters
    ----------
    turns : (K, 3, 3) float array
        Rotations of the bone from the rest pose to each planted instant.
    others : sequence of (K, 3, 3) float arrays
        The same of feet that are this one's mirror image, reflected; used where they do not contradict.
    trust_rest_within : float
        A rest pose that is flat within this angle is taken as flat [rad].

    Returns
    -------
    (3,) float array
        Unit vector; the rest pose's own up where the motion does not show it.
    """
    samples = turns[:, 2, :]
    up = typical_direction(samples)
    for other in others:
        image = typical_direction(other[:, 2, :])
        if image is not None and (up is None or up @ image >= np.cos(_MOST_SPREAD)):
            samples = np.concatenate([samples, other[:, 2, :]])
            up = typical_direction(samples)
    return UP if up is None or up @ UP >= np.cos(trust_rest_within) else up


def flat_foot(
    ankle: Array, ball: Array, forward: Array, *, foot_up: Array, toe_up: Array, toe_turns: Array
) -> FlatFoot:
    """The attitude of a flat sole relative to its bones.

    Parameters
    ----------
    ankle, ball : (3,) float arrays
        Joints in the rest pose [m]. The ball is where the toes bend, or else the tip of the foot.
    forward : (3,) float array
        Direction toward the toes in the rest pose.
    foot_up, toe_up : (3,) float arrays
        World up while standing, as the foot and the toe bone have it in the rest pose.
    toe_turns : (K, 3, 3) float array
        Rotations of the foot relative to the toes at planted instants, in the rest pose.

    Returns
    -------
    FlatFoot
        With the origin at the height of the ankle.
    """
    forward = unit(forward - (forward @ foot_up) * foot_up)
    foot_axes = np.column_stack([forward, np.cross(foot_up, forward), foot_up])
    carried = typical_direction(toe_turns @ forward)
    toe_forward = forward if carried is None else carried
    toe_forward = unit(toe_forward - (toe_forward @ toe_up) * toe_up)
    toe_axes = np.column_stack([toe_forward, np.cross(toe_up, toe_forward), toe_up])

    in_sole = foot_axes.T @ (ball - ankle)
    return FlatFoot(
        foot_frame=_frame(foot_axes, ankle),
        toe_frame=_frame(toe_axes, ball - toe_axes @ in_sole),
        ball=float(in_sole[0]),
    )


def reflection(normal: Array) -> Array:
    """(3, 3) matrix that mirrors in the plane across a direction."""
    across = unit(normal)
    return np.eye(3) - 2 * np.outer(across, across)


@dataclass(frozen=True)
class FootSize:
    """Size of a foot without a mesh: its length and the height of the ankle above the sole [m]."""

    length: float
    ankle_height: float


def foot_size(flat: FlatFoot, *, ankle_tip: Array, ball: Array | None, leg: float) -> FootSize:
    """Size of a foot by its bones.

    Parameters
    ----------
    ankle_tip : (3,) float array
        End of the last bone of the foot in the rest pose [m].
    ball : (3,) float array or None
        Joint of the toes in the rest pose [m]; None if they do not bend, and then the tip may turn out to be the ball.
    leg : float
        Thigh and shank together [m].

    Returns
    -------
    FootSize
    """
    frame = flat.foot_frame if ball is None else flat.toe_frame
    tip = np.linalg.inv(frame) @ np.append(ankle_tip, 1.0)
    joint = None if ball is None else np.linalg.inv(flat.foot_frame) @ np.append(ball, 1.0)
    length = _foot_length(None if joint is None else float(joint[0]), float(tip[0]), leg)
    depth = -float(tip[2] if joint is None else min(joint[2], tip[2]))
    low, high = _ANKLE_HEIGHTS
    return FootSize(length, depth if low * length <= depth <= high * length else ANKLE_HEIGHT * length)


def ends_in_toes(ankle: Array, ball: Array, tip: Array, up: Array) -> bool:
    """True if the last bone of a foot ends about where the toes of a foot with that ankle and ball do.

    Parameters
    ----------
    ankle, ball, tip : (3,) float arrays
        In the rest pose [m].
    up : (3,) float array
        World up while standing, in the rest pose.
    """
    reach, bend = (point - ankle - ((point - ankle) @ up) * up for point in (tip, ball))
    length = float(np.linalg.norm(reach))
    if length == 0:
        return False
    from_tip = length / (1 - ANKLE_POSITION)
    from_ball = float(bend @ reach) / length / (BALL_POSITION - ANKLE_POSITION)
    low, high = _TIP_POINTS
    return from_ball > 0 and low < from_tip / from_ball < high


def _foot_length(ankle_to_ball: float | None, ankle_to_tip: float, leg: float) -> float:
    """Foot length from distances along the flat sole; without any, from the length of the leg."""
    expected = FOOT_TO_LEG * leg
    from_tip = ankle_to_tip / (1 - ANKLE_POSITION)
    tip_as_ball = ankle_to_tip / (BALL_POSITION - ANKLE_POSITION)
    least = _LEAST_FOOT * expected
    if ankle_to_ball is not None:
        from_ball = ankle_to_ball / (BALL_POSITION - ANKLE_POSITION)
        if from_ball > least:
            return from_tip if _TIP_TRUST[0] < from_tip / from_ball < _TIP_TRUST[1] else from_ball
    if from_tip > least:
        return from_tip if from_tip * tip_as_ball >= expected**2 else tip_as_ball
    return expected


def _frame(axes: Array, origin: Array) -> Array:
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = axes, origin
    return frame
