"""Four-legged gaits from a few numbers, over any course: which paw is down when, and the trunk that they carry.

Footfall patterns after Hildebrand (1965, Symmetrical gaits of horses); stride lengths at equal Froude number after
Alexander and Jayes (1983, A dynamic similarity hypothesis for the gaits of quadrupedal mammals). The vertical forces
of the legs are chosen first; the trunk bounces and pitches as they make it, the mass of the legs counted with it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from math import pi

import numpy as np

from sample_scenes.balance import GRAVITY, CyclicPath, stance_force
from sample_scenes.body import SIDES
from sample_scenes.course import STRAIGHT, Course
from sample_scenes.curves import quintic
from sample_scenes.dog import FRONT_SHARE, Dog
from sample_scenes.footwork import FootCourse, FootPoses, Roll, Swing, footfall_at
from sample_scenes.limbs import bend_to_reach, hanging
from sample_scenes.motion import Array, BodyMotion, Footfall, rotation
from sample_scenes.stride import inward_lean, over_strides, ride

LEGS = {"HL": ("hip", "paw"), "HR": ("hip", "paw"), "FL": ("shoulder", "forepaw"), "FR": ("shoulder", "forepaw")}
"""Suffix of a leg's footfalls -> its uppermost joint and that of its paw; the last letter is the side."""

_GYRATION = 0.42
"""Radius of gyration of the trunk in pitch, over the height at the withers."""


@dataclass(frozen=True, kw_only=True)
class FourLeggedGait:
    """How an animal goes on four legs.

    Attributes
    ----------
    speed : float
        [m/s].
    phases : dict of str to float
        Part of a stride after the left hind paw at which each paw of `LEGS` lands.
    duty_factor : float
        Part of a stride that a paw is on the ground.
    force_shape : float
        Shape factor of the legs' vertical force, see `balance.stance_force`.
    over_foot : float
        Part of stance at which hip or shoulder is where it is over its paw at rest.
    step_width : float
        Between the lines of left and right paws, over the height at the withers.
    lift : float
        Height of the paws in mid-swing, over the height at the withers.
    fold : float
        Bend of pastern and hock in swing [degrees].
    crouch : float
        How much lower the trunk is than at rest, over the height at the withers.
    sway : float
        Turns of pelvis and chest to either side [degrees].
    nod : float
        Nod of the head with every step of a front leg [degrees].
    neck : float
        Neck lower than at rest [degrees].
    """

    speed: float
    phases: dict[str, float] = field(hash=False)
    duty_factor: float
    force_shape: float
    over_foot: float = 0.46
    step_width: float = 0.17
    lift: float = 0.13
    fold: float = 62.0
    crouch: float = 0.04
    sway: float = 4.0
    nod: float = 4.0
    neck: float = 12.0

    def stride_time(self, body: Dog) -> float:
        """Time between landings of one paw [s]: stride over hip height is 2.4·Fr^0.34 (Alexander & Jayes 1983)."""
        froude = self.speed**2 / (GRAVITY * body.hip_height)
        return 2.4 * body.hip_height * froude**0.34 / self.speed

    def footfalls(self, body: Dog, course: Course, start_phase: float, duration: float) -> tuple[Footfall, ...]:
        """All contacts from two strides before the start to a stride after the end."""
        stride = self.stride_time(body)
        contact = self.duty_factor * stride
        aside = self.step_width * body.withers / 2
        falls = []
        for leg, (_, paw) in LEGS.items():
            ahead = body.joints[f"{paw}.L"][0] - body.centre[0]
            for index in range(-2, int(duration / stride + start_phase) + 3):
                strike = (index + self.phases[leg] - start_phase) * stride
                along = self.speed * (strike + self.over_foot * contact) + ahead
                falls.append(footfall_at(course, leg, along, SIDES[leg[-1]] * aside, 0.0, strike, strike + contact))
        return tuple(sorted(falls, key=lambda fall: fall.strike))

    def paw_course(self, body: Dog) -> FootCourse:
        """What the paws do."""
        roll = Roll(
            self.duty_factor,
            ((0.0, 0.08, 0.16, 0.62, 0.76, 0.90), (6.0, 2.0, 0.0, 0.0, -8.0, -30.0)),
            ((0.0, 0.15, 0.40, 0.65, 0.85, 0.95), (-58.0, -78.0, -62.0, -20.0, 6.0, 8.0)),
            0.0,
        )
        landing = (0.25 * self.speed, 0.0, -0.12 * self.speed)
        return FootCourse(body.paw, roll, lambda part, swing: self._swing(body, part, swing), landing)

    def _swing(self, body: Dog, part: Array, swing: Swing) -> Array:
        u = part[:, None]
        path = quintic(u, swing.start, swing.end, swing.start_slope, swing.end_slope)
        path[:, 2:] += self.lift * body.withers * 64 * (u * (1 - u)) ** 3
        return path


WALK = FourLeggedGait(
    speed=1.0, phases={"HL": 0.0, "FL": 0.22, "HR": 0.5, "FR": 0.72}, duty_factor=0.65, force_shape=0.15, fold=52.0
)
"""Lateral sequence: left hind, left fore, right hind, right fore."""

TROT = FourLeggedGait(
    speed=2.0,
    phases={"HL": 0.0, "FR": 0.0, "HR": 0.5, "FL": 0.5},
    duty_factor=0.42,
    over_foot=0.44,
    force_shape=0.0,
    lift=0.17,
    fold=75.0,
    crouch=0.045,
    sway=2.5,
    nod=1.5,
    neck=4.0,
    step_width=0.13,
)
"""Diagonal pairs, with a short flight between them."""


def go_on_four_legs(
    body: Dog,
    gait: FourLeggedGait,
    frame_count: int,
    frame_rate: float = 24.0,
    start_phase: float = 0.25,
    course: Course = STRAIGHT,
) -> BodyMotion:
    """A walk (`WALK`) or trot (`TROT`) along a course, by default along x; in full stride from first to last frame."""
    times, phase = over_strides(frame_count, frame_rate, start_phase, gait.stride_time(body))
    footfalls = gait.footfalls(body, course, start_phase, times[-1])
    trunk, centre = _trunk(body, gait, course, times, phase, footfalls)

    turns = {"hips": trunk} | _spine(gait, phase, trunk)
    hips = centre + np.einsum("fij,j->fi", trunk, body.joints["hips"] - body.centre)
    chest = hips.copy()
    for bone in ("hips", "spine"):
        head, tail, _ = body.bones[bone]
        chest += turns[bone] @ (body.joints[tail] - body.joints[head])
    paws = gait.paw_course(body)
    for leg in LEGS:
        poses = paws.poses(times, [fall for fall in footfalls if fall.side == leg])
        swing = _swing_part(times, [fall for fall in footfalls if fall.side == leg])
        fold = np.radians(gait.fold) * np.sin(pi * swing) ** 2
        if leg[0] == "H":
            turns |= _hind_leg(body, leg[-1], hips, trunk, poses, fold)
        else:
            turns |= _front_leg(body, leg[-1], chest, turns["chest"], poses, fold)
    seen = tuple(fall for fall in footfalls if fall.leave > 0 and fall.strike < times[-1])
    return BodyMotion(frame_rate, hips, {bone: turns[bone] for bone in body.bones}, seen)


def _trunk(
    body: Dog, gait: FourLeggedGait, course: Course, times: Array, phase: Array, footfalls: tuple[Footfall, ...]
) -> tuple[Array, Array]:
    """Rotation of the trunk and path of the centre of mass: where the paws' ground and the legs' forces take it."""
    ends = []
    for legs, joint in (("H", "paw"), ("F", "forepaw")):
        along = gait.speed * times + body.joints[f"{joint}.L"][0] - body.centre[0]
        rise = ride(times, [fall for fall in footfalls if fall.side[0] == legs])
        ends.append(np.column_stack([course.place(along), rise]))
    line = ends[1] - ends[0]
    heading = np.arctan2(line[:, 1], line[:, 0])
    slope = np.arctan2(line[:, 2], np.hypot(line[:, 0], line[:, 1]))
    bounce = _bounce(body, gait)(phase)  # up [m], pitch [rad]
    lean = inward_lean(gait.speed, course.curvature(gait.speed * times))
    trunk = rotation("z", heading) @ rotation("x", -lean) @ rotation("y", -0.7 * slope - bounce[:, 1])
    height = body.centre[2] - gait.crouch * body.withers + bounce[:, 0]
    centre = (1 - FRONT_SHARE) * ends[0] + FRONT_SHARE * ends[1]
    centre += height[:, None] * np.column_stack(
        [-np.sin(heading) * np.sin(lean), np.cos(heading) * np.sin(lean), np.cos(lean)]
    )
    return trunk, centre


def _bounce(body: Dog, gait: FourLeggedGait) -> CyclicPath:
    """Excursions of the trunk, up [m] and pitch nose-up [rad], that the vertical forces of the legs cause."""
    phase = np.arange(480) / 480
    acceleration = np.zeros((len(phase), 2))
    for leg, (_, paw) in LEGS.items():
        share = (FRONT_SHARE if leg[0] == "F" else 1 - FRONT_SHARE) / 2
        part = np.mod(phase - gait.phases[leg], 1.0) / gait.duty_factor
        force = share / gait.duty_factor * stance_force(part, gait.force_shape)
        arm = body.joints[f"{paw}.L"][0] - body.centre[0]
        acceleration += GRAVITY * force[:, None] * (1.0, arm / (_GYRATION * body.withers) ** 2)
    return CyclicPath(acceleration, gait.stride_time(body))


def _spine(gait: FourLeggedGait, phase: Array, trunk: Array) -> dict[str, Array]:
    """Rotations before and behind the pelvis; the spine bends sideways with the hind legs, the head stays ahead."""
    yaw = np.radians(gait.sway) * np.cos(2 * pi * phase)
    front = gait.phases["FL"]
    nod = np.radians(gait.nod) * np.cos(4 * pi * (phase - front - 0.5 * gait.duty_factor))
    lower = np.full_like(phase, np.radians(gait.neck))
    wag = np.radians(14.0) * np.sin(2 * pi * phase)
    return {
        "spine": trunk @ rotation("z", 0.5 * yaw),
        "chest": trunk @ rotation("z", yaw),
        "neck": trunk @ rotation("z", 0.5 * yaw) @ rotation("y", lower + nod),
        "head": trunk @ rotation("y", 0.6 * lower + 0.4 * nod),
        "tail.1": trunk @ rotation("z", 0.6 * wag) @ rotation("y", np.full_like(phase, -0.15)),
        "tail.2": trunk @ rotation("z", wag) @ rotation("y", np.full_like(phase, -0.25)),
    }


def _swing_part(times: Array, footfalls: list[Footfall]) -> Array:
    """How far each swing has come, 0 in stance, (F,)."""
    part = np.zeros(len(times))
    for fall, following in pairwise(footfalls):
        flying = (times > fall.leave) & (times < following.strike)
        part[flying] = (times[flying] - fall.leave) / (following.strike - fall.leave)
    return part


def _hind_leg(body: Dog, side: str, hips: Array, pelvis: Array, paw: FootPoses, fold: Array) -> dict[str, Array]:
    joints = body.joints
    hip = hips + pelvis @ (joints[f"hip.{side}"] - joints["hips"])
    hock = _above_paw(joints, (f"hip.{side}", f"hock.{side}", f"paw.{side}"), hip, paw, 0.55, -0.5 * fold)
    ahead = _heading(paw)
    upper, lower = (_length(joints, *body.bones[f"{bone}.{side}"][:2]) for bone in ("thigh", "shin"))
    knee, lateral = bend_to_reach(hip, hock, upper, lower, ahead)
    places = (hip, knee, hock, paw.ankle)
    bones = ("thigh", "shin", "hock")
    return _turned(body, side, bones, places, lateral) | {f"foot.{side}": paw.foot}


def _front_leg(body: Dog, side: str, chest: Array, turn: Array, paw: FootPoses, fold: Array) -> dict[str, Array]:
    joints = body.joints
    withers = chest + turn @ (joints[f"withers.{side}"] - joints["chest"])
    blade = joints[f"shoulder.{side}"] - joints[f"withers.{side}"]
    # The shoulder blade takes much of the leg's swing about the withers.
    swing = _lean(paw.ankle - withers, paw) - _rest_lean(joints, f"withers.{side}", f"forepaw.{side}")
    scapula = turn @ rotation("y", -0.45 * swing)
    shoulder = withers + scapula @ blade
    names = (f"shoulder.{side}", f"wrist.{side}", f"forepaw.{side}")
    wrist = _above_paw(joints, names, shoulder, paw, 0.8, -fold)
    upper, lower = (_length(joints, *body.bones[f"{bone}.{side}"][:2]) for bone in ("upper_arm", "forearm"))
    elbow, lateral = bend_to_reach(shoulder, wrist, upper, lower, -_heading(paw))
    places = (shoulder, elbow, wrist, paw.ankle)
    bones = ("upper_arm", "forearm", "pastern")
    turned = _turned(body, side, bones, places, -lateral)
    return {f"shoulder.{side}": scapula} | turned | {f"hand.{side}": paw.foot}


def _above_paw(
    joints: dict[str, Array], names: tuple[str, str, str], root: Array, paw: FootPoses, follow: float, fold: Array
) -> Array:
    """Place of hock or wrist: the bone above the paw leans with the leg, and folds in swing."""
    top, joint, bottom = names
    swing = _lean(paw.ankle - root, paw) - _rest_lean(joints, top, bottom)
    lean = _rest_lean(joints, joint, bottom) + follow * swing + fold
    down = np.sin(lean)[:, None] * _heading(paw) - np.cos(lean)[:, None] * np.array((0.0, 0.0, 1.0))
    return paw.ankle - _length(joints, joint, bottom) * down


def _lean(line: Array, paw: FootPoses) -> Array:
    """Angle of a leg's line ahead of vertical, (F,) [rad]."""
    return np.arctan2((line * _heading(paw)).sum(axis=1), -line[:, 2])


def _rest_lean(joints: dict[str, Array], top: str, bottom: str) -> float:
    line = joints[bottom] - joints[top]
    return float(np.arctan2(line[0], -line[2]))


def _heading(paw: FootPoses) -> Array:
    return np.column_stack([np.cos(paw.heading), np.sin(paw.heading), np.zeros_like(paw.heading)])


def _length(joints: dict[str, Array], start: str, end: str) -> float:
    return float(np.linalg.norm(joints[end] - joints[start]))


def _turned(
    body: Dog, side: str, bones: tuple[str, ...], places: tuple[Array, ...], lateral: Array
) -> dict[str, Array]:
    """Rotations that lay a chain of bones through places."""
    turns = {}
    for bone, start, end in zip(bones, places, places[1:], strict=False):
        head, tail, _ = body.bones[f"{bone}.{side}"]
        rest = (body.joints[tail] - body.joints[head])[None]
        now = end - start
        turns[f"{bone}.{side}"] = _hung(now, lateral) @ np.swapaxes(_hung(rest, np.array([[0.0, 1.0, 0.0]])), 1, 2)
    return turns


def _hung(direction: Array, lateral: Array) -> Array:
    along = direction / np.linalg.norm(direction, axis=1, keepdims=True)
    across = lateral - (lateral * along).sum(axis=1, keepdims=True) * along
    return hanging(direction, across / np.linalg.norm(across, axis=1, keepdims=True))
