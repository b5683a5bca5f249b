"""A run from a few numbers, over any course: the legs push, the centre of mass flies between.

Contact time and step frequency follow speed as measured on people; the vertical force of a step has the shape that was
measured too, and the hips are placed so that the centre of mass moves as these forces make it. So flights are ballistic
and the mean force over a stride is one body weight. Foot and leg angles follow Novacheck (1998), The biomechanics of
running, figs. 5-7.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, partial
from math import sqrt

import numpy as np

from sample_scenes.balance import GRAVITY, CyclicPath, balanced, rest_centre, stance_force
from sample_scenes.body import SIDES, Array, Body
from sample_scenes.course import STRAIGHT, Course
from sample_scenes.curves import clamped_spline
from sample_scenes.footwork import FootCourse, Roll, Swing
from sample_scenes.motion import BodyMotion
from sample_scenes.stride import (
    ADULT_LEG,
    Stride,
    along_course,
    assemble,
    crouch,
    facing_along,
    foot_poses,
    inward_lean,
    planted_at,
    ride,
    room_above,
    within_reach,
)

MAX_STRETCH = 0.985
"""Longest hip-ankle distance, relative to the straight leg: knees stay bent by 20 degrees or more."""

_COM_HEIGHT = 1.02
"""Height of a runner's centre of mass over leg length, for the direction of forces."""

_SWING = ((0.27, 0.0, 74.0), (0.48, 27.0, 98.0), (0.70, 44.0, 80.0), (0.87, 42.0, 44.0))
"""Part of the swing, thigh ahead of vertical and bend of the knee [degrees] (Novacheck 1998)."""


@dataclass(frozen=True, kw_only=True)
class Run(Stride):
    """How somebody runs; see also `Stride` and `Carriage`.

    Attributes
    ----------
    force_shape : float
        Shape factor of the vertical force, see `balance.stance_force`.
    strike_pitch, leave_pitch : float
        Foot pitch at strike and at toe-off, toes up positive [degrees].
    touch_down, touch_down_forward : float
        Speed down and forward at which the heel meets the ground, relative to the speed of running.
    """

    speed: float = 3.2
    step_width: float = 0.05
    toe_out: float = 5.0
    over_foot: float = 0.275
    force_shape: float = 0.0
    strike_pitch: float = 11.0
    leave_pitch: float = -66.0
    touch_down: float = 0.22
    touch_down_forward: float = 0.35
    hip_yaw: float = 7.0
    hip_list: float = 4.0
    chest_yaw: float = 11.0
    lean: float = 8.0
    arm_swing: float = 34.0
    elbow_bend: float = 88.0
    arm_forward: float = -14.0
    elbow_swing: float = 0.16
    arm_inward: float = 24.0

    def contact_time(self, body: Body) -> float:
        """Time that a foot is on the ground [s]: 0.25 at 3 m/s to 0.12 at 9 (Weyand et al. 2000) for an adult."""
        scale = sqrt(body.leg_length / ADULT_LEG)
        return 0.25 * scale * (self.speed / scale / 3.0) ** -0.64

    def stride_time(self, body: Body) -> float:
        """Time between strikes of one foot [s]: 2.7 steps a second at 3 m/s, 2.8 at 4 (Cavanagh & Kram 1989)."""
        scale = sqrt(body.leg_length / ADULT_LEG)
        return 2 * scale / (2.3 + 0.13 * self.speed / scale)

    def duty_factor(self, body: Body) -> float:
        """Part of a stride that a foot is on the ground; below one half, so that flights follow."""
        return self.contact_time(body) / self.stride_time(body)

    def peak_force(self, body: Body) -> float:
        """Highest vertical force of a step, in body weights."""
        return float(stance_force(np.linspace(0, 1, 201), self.force_shape).max() / (2 * self.duty_factor(body)))

    def foot_course(self, body: Body, course: Course, height: float) -> FootCourse:
        """What the feet do under hips that are at a mean `height` above the ground [m]."""
        strike, leave = self.strike_pitch, self.leave_pitch
        stance_pitch = (strike, 0.5 * strike, 0.0, 0.0, 0.10 * leave, 0.34 * leave, 0.68 * leave)
        roll = Roll(
            self.duty_factor(body),
            ((0.0, 0.10, 0.20, 0.46, 0.60, 0.76, 0.90), stance_pitch),
            (
                (0.0, 0.14, 0.30, 0.50, 0.70, 0.86, 0.95),
                (leave, leave - 16, leave - 24, leave - 6, -32.0, 2.0, 0.95 * strike),
            ),
            34.0,
        )
        landing = (self.touch_down_forward * self.speed, 0.0, -self.touch_down * self.speed)
        return FootCourse(body.foot, roll, partial(self._swing, body, course, height), landing)

    def _swing(self, body: Body, course: Course, height: float, part: Array, swing: Swing) -> Array:
        """The ankle through the angles of `_SWING` under hips that ride the bounce of the steps."""
        knots, places = [0.0], [swing.start]
        aside = SIDES[swing.before.side] * (0.3 * self.step_width + 0.7 * body.hip_half_width)
        for u, hip_angle, knee_angle in _SWING:
            thigh, shin = np.radians(hip_angle), np.radians(hip_angle - knee_angle)
            ahead = body.thigh * np.sin(thigh) + body.shin * np.sin(shin)
            below = body.thigh * np.cos(thigh) + body.shin * np.cos(shin)
            time = swing.before.leave + u * swing.duration
            bounce = _bounce(body, self)(np.array([(time - swing.before.strike) / self.stride_time(body)]))[0]
            along = self.speed * time + ahead
            ground = swing.before.place[2] + u * (swing.after.place[2] - swing.before.place[2])
            ground = max(ground, float(course.ground(along, aside)))
            knots.append(u)
            places.append(np.append(course.place(along, aside), ground + height + bounce[2] - below))
        path = clamped_spline(part, [*knots, 1.0], [*places, swing.end], swing.start_slope, swing.end_slope)
        return np.asarray(path)


def run(
    body: Body,
    gait: Run,
    frame_count: int,
    frame_rate: float = 24.0,
    start_phase: float = 0.25,
    course: Course = STRAIGHT,
) -> BodyMotion:
    """A run along a course, by default along x from the origin; in full stride from the first frame to the last."""
    times = np.arange(frame_count) / frame_rate
    motion, _ = _run(body, gait, times, frame_rate, start_phase, course, _centre_height(body, gait))
    return motion


def _run(
    body: Body, gait: Run, times: Array, frame_rate: float, start_phase: float, course: Course, height: float
) -> tuple[BodyMotion, float]:
    """The motion with the centre of mass at a mean height [m], and how much higher it could be."""
    phase = start_phase + times / gait.stride_time(body)
    local = _bounce(body, gait)(phase)
    local += np.column_stack([gait.speed * times, np.zeros_like(times), np.full_like(times, height)])
    footfalls = gait.footfalls(body, course, start_phase, times[-1])
    leaning = inward_lean(gait.speed, course.curvature(local[:, 0]))
    centre = along_course(course, local, leaning)
    centre[:, 2] += ride(times, footfalls)

    upper = {"hips": gait.pelvis(phase)} | gait.trunk(phase, gait.mid_stance(body))
    for side in SIDES:
        upper |= gait.arm(body, side, phase, upper["chest"])
    upper = facing_along(course, local[:, 0], leaning, upper)
    above_hips = rest_centre(body) - body.joints["hips"]
    feet = foot_poses(dict.fromkeys(SIDES, gait.foot_course(body, course, height - above_hips[2])), times, footfalls)

    def pose(hips: Array) -> BodyMotion:
        reached = {side: within_reach(body, side, hips, upper["hips"], feet[side], MAX_STRETCH) for side in SIDES}
        return assemble(body, frame_rate, hips, upper, reached, footfalls)

    def room(motion: BodyMotion) -> Array:
        reach = MAX_STRETCH * (body.thigh + body.shin)
        return room_above(body, motion.hips, upper["hips"], feet, reach, planted_at(times, footfalls))

    motion = balanced(body, pose, centre, centre - above_hips)
    free = room(motion)
    centre[:, 2] -= crouch(free, frame_rate, gait.stride_time(body))
    motion = balanced(body, pose, centre, motion.hips)
    return motion, float(free.min())


@cache
def _centre_height(body: Body, gait: Run) -> float:
    """Mean height of the centre of mass at which no leg is stretched beyond `MAX_STRETCH` over one full stride [m]."""
    height = _COM_HEIGHT * body.leg_length
    samples = 160
    times = gait.stride_time(body) * np.arange(samples) / samples
    for _ in range(6):
        height += _run(body, gait, times, samples / gait.stride_time(body), 0.0, STRAIGHT, height)[1]
    return height


@cache
def _bounce(body: Body, gait: Run) -> CyclicPath:
    """Excursions of the centre of mass about steady progress (forward, left, up) that the legs' forces cause."""
    stride, duty = gait.stride_time(body), gait.duty_factor(body)
    phase = np.arange(960) / 960
    centre_height = _COM_HEIGHT * body.leg_length
    forces = np.zeros((len(phase), 3))  # in body weights
    for side, start in (("L", 0.0), ("R", 0.5)):
        part = np.mod(phase - start, 1.0) / duty
        vertical = stance_force(part, gait.force_shape) / (2 * duty)
        # The force points from the foot, under which its centre moves from heel to toes, at the centre of mass.
        arm = gait.speed * (part - gait.over_foot) * duty * stride
        pressure = body.foot.heel + part * (body.foot.toe - body.foot.heel)
        ahead = arm - pressure
        ahead -= (vertical * ahead).sum() / vertical.sum()
        aside = -SIDES[side] * gait.step_width / 2
        forces += vertical[:, None] * np.column_stack(
            [ahead, np.full_like(ahead, aside), np.full_like(ahead, centre_height)]
        )
    return CyclicPath(GRAVITY * forces / centre_height, stride)
