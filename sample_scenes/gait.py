"""A walk from a few numbers, foot first: planted feet stay where they are and the legs are solved to reach them.

The course of a step follows measured gait (Perry & Burnfield 2010, ch. 3-5; Winter 2009): heel strike, the foot rolls
down over the heel's edge, stands flat, rolls up over the ball while the toes stay flat, leaves over the toes. The hips
ride an inverted pendulum, highest in mid-stance, as high as the legs allow.

Everything is in the body's frame (`body.py`): x forward, y left, z up. Phases are fractions of a stride, 0 at the heel
strike of the left foot; the right foot does the same half a stride later.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import pi, sqrt

import numpy as np

from sample_scenes.body import BONES, SIDES, Array, Body
from sample_scenes.curves import monotone_cubic, periodic_cubic, quintic

WALK_RATIO = 0.0065 * 60
"""Step length over cadence [m·s], nearly the same for all adults at all free speeds (Sekiya & Nagasaki 1998)."""

WALK_RATIO_LEG = 0.94
"""Leg length of the adults that `WALK_RATIO` was measured on [m]."""

MAX_STRETCH = 0.996
"""Longest hip-ankle distance, relative to the straight leg."""


@dataclass(frozen=True)
class Gait:
    """How somebody walks.

    Attributes
    ----------
    speed : float
        [m/s].
    duty_factor : float
        Part of a stride that a foot is on the ground.
    step_width : float
        Between the lines of the left and right ankles [m].
    toe_out : float
        Feet turned outward [degrees].
    over_foot : float
        Part of stance at which the hips pass over the ankle.
    strike_pitch, leave_pitch : float
        Foot pitch at heel strike and at toe-off, toes up positive [degrees].
    toe_bend : float
        Bend of the toes beyond which they lift too [degrees].
    clearance : float
        Extra height of the ankle in mid-swing [m].
    touch_down, touch_down_forward : float
        Speed down and forward at which the heel meets the ground, relative to the speed of walking.
    bounce : float
        Vertical excursion of the hips relative to that of a stiff-legged inverted pendulum.
    sway : float
        Lateral excursion of the hips to either side [m].
    surge : float
        Forward excursion of the hips about steady progress [m].
    hip_yaw, hip_list, chest_yaw, lean : float
        Pelvis rotation and drop, counter-rotation of the chest, lean of the trunk [degrees].
    arm_swing, elbow_bend : float
        Swing of the upper arm to either side and mean bend of the elbow [degrees].
    """

    speed: float = 1.20
    duty_factor: float = 0.62
    step_width: float = 0.10
    toe_out: float = 6.0
    over_foot: float = 0.42
    strike_pitch: float = 19.0
    leave_pitch: float = -54.0
    toe_bend: float = 34.0
    clearance: float = 0.065
    touch_down: float = 0.20
    touch_down_forward: float = 0.65
    bounce: float = 0.62
    sway: float = 0.022
    surge: float = 0.008
    hip_yaw: float = 6.0
    hip_list: float = 3.5
    chest_yaw: float = 6.0
    lean: float = 3.0
    arm_swing: float = 20.0
    elbow_bend: float = 22.0

    def step_length(self, body: Body) -> float:
        """Distance from one heel strike to the next [m]."""
        size = body.leg_length / WALK_RATIO_LEG
        return sqrt(WALK_RATIO * self.speed) * size**0.75  # steps grow with the leg at equal Froude number

    def stride_time(self, body: Body) -> float:
        """Time from a heel strike to the next of the same foot [s]."""
        return 2 * self.step_length(body) / self.speed


@dataclass(frozen=True)
class Footfall:
    """One contact of one foot: what a bake should find.

    Attributes
    ----------
    side : str
        "L" or "R".
    strike, leave : float
        Times of first and last touch [s].
    place : (3,) float array
        Point of the ground below the ankle while the foot stands flat [m].
    heading : float
        Direction of the toes about z, 0 along x [rad].
    """

    side: str
    strike: float
    leave: float
    place: Array
    heading: float


@dataclass(frozen=True)
class BodyMotion:
    """A motion of a `Body`, as rotations of its bones.

    Attributes
    ----------
    frame_rate : float
        [Hz].
    hips : (F, 3) float array
        Place of the joint "hips" [m].
    turns : dict of str to (F, 3, 3) float array
        Rotation of each bone of `BONES` from its rest pose, in the body's frame.
    footfalls : tuple of Footfall
    """

    frame_rate: float
    hips: Array
    turns: dict[str, Array]
    footfalls: tuple[Footfall, ...]


def walk(body: Body, gait: Gait, frame_count: int, frame_rate: float = 24.0, start_phase: float = 0.25) -> BodyMotion:
    """A straight walk along x from the origin, in full stride from the first frame to the last."""
    stride = gait.stride_time(body)
    times = np.arange(frame_count) / frame_rate
    phase = start_phase + times / stride
    footfalls = _footfalls(body, gait, start_phase, times[-1])
    feet = {side: _Foot(body, gait, side) for side in SIDES}
    poses = {side: feet[side].poses(times, footfalls) for side in SIDES}

    pelvis = _pelvis_turn(gait, phase)
    hips = _hips_path(body, gait, phase, times)
    hips[:, 2] += _hips_height(body, gait)

    turns = {"hips": pelvis} | _trunk_turns(gait, phase)
    for side in SIDES:
        turns |= _leg_turns(body, side, hips, pelvis, poses[side])
        turns |= _arm_turns(body, gait, side, phase, turns["chest"])
    seen = tuple(fall for fall in footfalls if fall.leave > 0 and fall.strike < times[-1])
    return BodyMotion(frame_rate, hips, {bone: turns[bone] for bone in BONES}, seen)


def joint_paths(body: Body, motion: BodyMotion) -> dict[str, Array]:
    """Places of all joints over time, (F, 3) each [m]: the forward kinematics of a motion."""
    paths = {"hips": motion.hips}
    for bone, (head, tail, parent) in BONES.items():
        rest = body.joints
        if parent:
            parent_head = BONES[parent][0]
            paths[head] = paths[parent_head] + motion.turns[parent] @ (rest[head] - rest[parent_head])
        paths[tail] = paths[head] + motion.turns[bone] @ (rest[tail] - rest[head])
    return paths


def _footfalls(body: Body, gait: Gait, start_phase: float, duration: float) -> tuple[Footfall, ...]:
    """All contacts from a stride before the start to a stride after the end."""
    stride = gait.stride_time(body)
    falls = []
    for index in range(-3, int(2 * (duration / stride + start_phase)) + 4):
        side = "LR"[index % 2]
        strike = (index / 2 - start_phase) * stride
        leave = strike + gait.duty_factor * stride
        along = gait.speed * (strike + gait.over_foot * gait.duty_factor * stride)
        place = np.array((along, SIDES[side] * gait.step_width / 2, 0.0))
        falls.append(Footfall(side, strike, leave, place, SIDES[side] * np.radians(gait.toe_out)))
    return tuple(falls)


@dataclass(frozen=True)
class _FootPoses:
    """A foot over time: ankle (F, 3) [m]; turns of foot and toes (F, 3, 3); heading (F,) [rad]."""

    ankle: Array
    foot: Array
    toe: Array
    heading: Array


class _Foot:
    """One foot's course: rolling on the ground in stance, flying from footfall to footfall in swing."""

    def __init__(self, body: Body, gait: Gait, side: str) -> None:
        self.shape, self.gait, self.side = body.foot, gait, side
        self.stride = gait.stride_time(body)
        duty, strike, leave = gait.duty_factor, gait.strike_pitch, gait.leave_pitch
        swing = 1 - duty
        stance_knots = duty * np.array((0.0, 0.07, 0.16, 0.54, 0.70, 0.80, 0.90))
        stance = np.array((strike, 0.55 * strike, 0.0, 0.0, 0.06 * leave, 0.17 * leave, 0.45 * leave))
        swing_knots = duty + swing * np.array((0.0, 0.12, 0.28, 0.50, 0.68, 0.82, 0.93))
        swing_pitch = np.array((leave, leave - 10, leave - 3, leave + 27, -5.0, 0.75 * strike, 1.06 * strike))
        self._pitch_knots = np.concatenate([stance_knots, swing_knots])
        self._pitches = np.radians(np.concatenate([stance, swing_pitch]))
        self._landing_bend = np.radians(8.0)

    def poses(self, times: Array, footfalls: tuple[Footfall, ...]) -> _FootPoses:
        mine = [fall for fall in footfalls if fall.side == self.side]
        ankle, heading = np.zeros((len(times), 3)), np.zeros(len(times))
        phase = np.zeros(len(times))
        for fall, following in pairwise(mine):
            here = (times >= fall.strike) & (times < following.strike)
            local = (times[here] - fall.strike) / self.stride
            phase[here] = local
            ankle[here] = self._ankle(local, fall, following)
            turn = np.clip((local - self.gait.duty_factor) / (1 - self.gait.duty_factor), 0, 1)
            heading[here] = fall.heading + (following.heading - fall.heading) * (3 * turn**2 - 2 * turn**3)
        pitch, bend = self.pitch(phase), self.bend(phase)
        yaw = rotation("z", heading)
        return _FootPoses(ankle, yaw @ rotation("y", -pitch), yaw @ rotation("y", -pitch - bend), heading)

    def pitch(self, phase: Array) -> Array:
        """Foot pitch, toes up positive [rad]."""
        return periodic_cubic(phase, self._pitch_knots, self._pitches)

    def bend(self, phase: Array) -> Array:
        """Toes up relative to the foot [rad]: in stance they stay flat until they can bend no further."""
        duty = self.gait.duty_factor
        limit, give = np.radians(self.gait.toe_bend), np.radians(10.0)
        heel_up = np.maximum(-self.pitch(phase), 0.0)
        flat = np.where(heel_up < limit, heel_up, limit + give * (1 - np.exp(-np.maximum(heel_up - limit, 0) / give)))
        swing = np.clip((phase - duty) / (1 - duty), 0.0, 1.0)
        at_leave = float(self.bend(np.array([duty - 1e-9]))[0]) if np.any(phase > duty) else 0.0
        relax = monotone_cubic(swing, (0.0, 0.12, 0.6, 1.0), (1.0, 0.95, 0.1, 0.0))
        landing = self._landing_bend * (3 * swing**2 - 2 * swing**3)
        roll_down = self._landing_bend * np.clip(self.pitch(phase) / np.radians(self.gait.strike_pitch), 0.0, 1.0)
        return np.where(phase < duty, flat + roll_down, at_leave * relax + landing)

    def _stance_ankle(self, phase: Array) -> Array:
        """Ankle relative to the footfall's place while the foot rolls, in the foot's heading: (F, 3) [m]."""
        shape = self.shape
        pitch, bend = self.pitch(phase), self.bend(phase)
        height = shape.ankle_height
        on_heel = _turned(pitch, -shape.heel, height) + np.array((shape.heel, 0.0, 0.0))
        toe_pitch = np.minimum(pitch + bend, 0.0)
        ball = _turned(toe_pitch, shape.ball - shape.toe, shape.ball_height) + np.array((shape.toe, 0.0, 0.0))
        on_ball = ball + _turned(pitch, -shape.ball, height - shape.ball_height)
        return np.where((pitch > 0)[:, None], on_heel, on_ball)

    def _ankle(self, phase: Array, fall: Footfall, following: Footfall) -> Array:
        duty, gait = self.gait.duty_factor, self.gait
        here, there = rotation("z", np.array(fall.heading)), rotation("z", np.array(following.heading))
        stance = fall.place + self._stance_ankle(np.minimum(phase, duty - 1e-9)) @ here.T
        step = 1e-4
        leaving = self._stance_ankle(duty - step * np.array((1.0, 1e-5))) @ here.T
        landing = self._stance_ankle(step * np.array((0.0, 1.0))) @ there.T
        swing_time = (1 - duty) * self.stride
        u = np.clip((phase - duty) / (1 - duty), 0.0, 1.0)[:, None]
        scale = swing_time / (step * self.stride)
        impact = swing_time * there @ np.array((gait.touch_down_forward, 0.0, -gait.touch_down)) * gait.speed
        swing = quintic(
            u,
            fall.place + leaving[1],
            following.place + landing[0],
            (leaving[1] - leaving[0]) * scale,
            (landing[1] - landing[0]) * scale + impact,
        )
        swing[:, 2:] += gait.clearance * _early_bump(u)
        return np.where((phase < duty)[:, None], stance, swing)


def _early_bump(u: Array) -> Array:
    """A bump over [0, 1] of height 1 at 3/8, where a swinging ankle is highest; both ends are smooth."""
    return (8 / 3 * u) ** 3 * (8 / 5 * (1 - u)) ** 5


def _turned(pitch: Array, forward: float, up: float) -> Array:
    """A point (forward, 0, up) turned toes-up by `pitch` (F,), as (F, 3)."""
    cos, sin = np.cos(pitch), np.sin(pitch)
    return np.stack([forward * cos - up * sin, np.zeros_like(pitch), forward * sin + up * cos], axis=-1)


def _mid_stance(gait: Gait) -> float:
    """Phase at which the hips stand highest: the middle between toe-off and heel strike of the other foot."""
    return (gait.duty_factor - 0.5 + 0.5) / 2


def _hips_path(body: Body, gait: Gait, phase: Array, times: Array) -> Array:
    """Hips over time, (F, 3) [m]; z is relative to the mean."""
    top = _mid_stance(gait)
    step, leg = gait.step_length(body), body.leg_length
    pendulum = leg - sqrt(leg**2 - (step / 2) ** 2)
    twice = 4 * pi * (phase - top)
    return np.stack(
        [
            gait.speed * times - gait.surge * np.sin(twice),
            gait.sway * np.cos(2 * pi * (phase - top - 0.02)),
            gait.bounce * pendulum / 2 * np.cos(twice),
        ],
        axis=-1,
    )


def _hips_height(body: Body, gait: Gait) -> float:
    """Mean height at which no leg is stretched beyond `MAX_STRETCH` over one full stride [m]."""
    # The stride is looked at finely and on its own, so that the height does not depend on frame rate or length.
    phase = np.arange(400) / 400
    stride = gait.stride_time(body)
    times = phase * stride
    path = _hips_path(body, gait, phase, times)
    turn = _pelvis_turn(gait, phase)
    falls = _footfalls(body, gait, 0.0, stride)
    reach = MAX_STRETCH * (body.thigh + body.shin)
    room = []
    for side in SIDES:
        ankle = _Foot(body, gait, side).poses(times, falls).ankle
        hip = path + turn @ (body.joints[f"hip.{side}"] - body.joints["hips"])
        level = np.linalg.norm((hip - ankle)[:, :2], axis=1)
        room.append(ankle[:, 2] + np.sqrt(np.maximum(reach**2 - level**2, 0.0)) - hip[:, 2])
    return float(np.min(room))


def _pelvis_turn(gait: Gait, phase: Array) -> Array:
    yaw = -np.radians(gait.hip_yaw) * np.cos(2 * pi * phase)
    drop = np.radians(gait.hip_list) * np.sin(2 * pi * (phase - 0.03))
    return rotation("z", yaw) @ rotation("x", drop) @ rotation("y", np.full_like(phase, np.radians(gait.lean)))


def _trunk_turns(gait: Gait, phase: Array) -> dict[str, Array]:
    lean = np.radians(gait.lean)
    yaw = np.radians(gait.chest_yaw) * np.cos(2 * pi * phase)
    tilt = np.radians(gait.hip_list) * np.sin(2 * pi * (phase - 0.03))
    nod = np.radians(1.0) * np.cos(4 * pi * (phase - _mid_stance(gait)))

    def turn(yaw_share: float, tilt_share: float, pitch: Array) -> Array:
        return rotation("z", yaw_share * yaw) @ rotation("x", tilt_share * tilt) @ rotation("y", pitch)

    chest = turn(1.0, -0.35, lean + nod)
    turns = {
        "spine": turn(0.2, 0.1, lean + 0.5 * nod),
        "chest": chest,
        "neck": turn(0.5, -0.15, 0.9 * lean + nod),
        "head": turn(0.1, 0.0, 0.3 * lean),
    }
    return turns | {f"shoulder.{side}": chest for side in SIDES}


def _leg_turns(body: Body, side: str, hips: Array, pelvis: Array, foot: _FootPoses) -> dict[str, Array]:
    """Thigh and shin that join hip and ankle, the knee pointing where foot and pelvis face: two-bone IK."""
    hip = hips + pelvis @ (body.joints[f"hip.{side}"] - body.joints["hips"])
    reach = foot.ankle - hip
    distance = np.linalg.norm(reach, axis=1)
    a, b = body.thigh, body.shin
    straight = np.minimum(distance, a + b)
    cos_hip = np.clip((a**2 + straight**2 - b**2) / (2 * a * straight), -1.0, 1.0)
    along = reach / distance[:, None]
    facing = pelvis[:, :, 0] + np.stack([np.cos(foot.heading), np.sin(foot.heading), np.zeros_like(distance)], axis=-1)
    ahead = facing - (facing * along).sum(axis=1, keepdims=True) * along
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    lateral = np.cross(along, ahead) * -1.0  # left: down x forward = -left
    knee = hip + a * (cos_hip[:, None] * along + np.sqrt(1 - cos_hip**2)[:, None] * ahead)
    return {
        f"thigh.{side}": _hanging(knee - hip, lateral),
        f"shin.{side}": _hanging(foot.ankle - knee, lateral),
        f"foot.{side}": foot.foot,
        f"toe.{side}": foot.toe,
    }


def _hanging(direction: Array, lateral: Array) -> Array:
    """Rotation that takes down to `direction` and left to `lateral`, which is perpendicular to it."""
    up = -direction / np.linalg.norm(direction, axis=1, keepdims=True)
    return np.stack([np.cross(lateral, up), lateral, up], axis=-1)


def _arm_turns(body: Body, gait: Gait, side: str, phase: Array, chest: Array) -> dict[str, Array]:
    """Arms swing against the legs of their side."""
    sign = SIDES[side]
    own = phase + (0.0 if sign > 0 else 0.5)
    swing = np.radians(6.0 - gait.arm_swing * np.cos(2 * pi * (own - 0.02)))
    elbow = np.radians(gait.elbow_bend * (1 - 0.45 * np.cos(2 * pi * (own - 0.07))))
    droop = np.radians(90.0 - body.arm_droop - 9.0)  # from the rest pose down to nine degrees off the body
    hang = rotation("x", np.full_like(phase, -sign * droop))
    inward = rotation("z", np.full_like(phase, -sign * np.radians(14.0)))
    upper = chest @ rotation("y", -swing)
    fore = upper @ inward @ rotation("y", -elbow)
    wrist = fore @ rotation("y", np.full_like(phase, np.radians(4.0)))
    return {
        f"upper_arm.{side}": upper @ hang,
        f"forearm.{side}": fore @ hang,
        f"hand.{side}": wrist @ hang,
    }


def rotation(axis: str, angle: Array) -> Array:
    """Right-handed rotations about a coordinate axis, (..., 3, 3), for angles (...) [rad]."""
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    result = np.zeros((*np.shape(angle), 3, 3))
    result[..., i, i] = 1.0
    result[..., j, j] = result[..., k, k] = np.cos(angle)
    result[..., k, j] = np.sin(angle)
    result[..., j, k] = -result[..., k, j]
    return result
