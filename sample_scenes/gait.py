"""A walk from a few numbers, over any course: foot first, the hips on an inverted pendulum.

The course of a step follows measured gait (Perry & Burnfield 2010, ch. 3-5; Winter 2009): heel strike, the foot rolls
down over the heel's edge, stands flat, rolls up over the ball while the toes stay flat, leaves over the toes. The hips
ride an inverted pendulum, highest in mid-stance, as high as the legs allow.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np

from sample_scenes.body import SIDES, Array, Body
from sample_scenes.course import STRAIGHT, Course
from sample_scenes.curves import quintic
from sample_scenes.footwork import FootCourse, FootPoses, Roll, Swing
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
    over_strides,
    ride,
    room_above,
)

WALK_RATIO = 0.0065 * 60
"""Step length over cadence [m·s], nearly the same for all adults at all free speeds (Sekiya & Nagasaki 1998)."""

MAX_STRETCH = 0.996
"""Longest hip-ankle distance, relative to the straight leg."""


@dataclass(frozen=True, kw_only=True)
class Gait(Stride):
    """How somebody walks; see also `Stride` and `Carriage`.

    Attributes
    ----------
    duty_factor : float
        Part of a stride that a foot is on the ground.
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
    held_toes : bool
        See `Roll`.
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
    held_toes: bool = False

    def step_length(self, body: Body) -> float:
        """Distance from one heel strike to the next [m]."""
        size = body.leg_length / ADULT_LEG
        return sqrt(WALK_RATIO * self.speed) * size**0.75  # steps grow with the leg at equal Froude number

    def stride_time(self, body: Body) -> float:
        """Time from a heel strike to the next of the same foot [s]."""
        return 2 * self.step_length(body) / self.speed

    def contact_time(self, body: Body) -> float:
        """Time that a foot is on the ground [s]."""
        return self.duty_factor * self.stride_time(body)

    def foot_course(self, body: Body) -> FootCourse:
        """What the feet do."""
        strike, leave = self.strike_pitch, self.leave_pitch
        stance_pitch = (strike, 0.55 * strike, 0.0, 0.0, 0.06 * leave, 0.17 * leave, 0.45 * leave)
        swing_pitch = (leave, leave - 10, leave - 3, leave + 27, -5.0, 0.75 * strike, 1.06 * strike)
        roll = Roll(
            self.duty_factor,
            ((0.0, 0.07, 0.16, 0.54, 0.70, 0.80, 0.90), stance_pitch),
            ((0.0, 0.12, 0.28, 0.50, 0.68, 0.82, 0.93), swing_pitch),
            self.toe_bend,
            self.held_toes,
        )
        landing = (self.touch_down_forward * self.speed, 0.0, -self.touch_down * self.speed)
        return FootCourse(body.foot, roll, self._swing, landing)

    def _swing(self, part: Array, swing: Swing) -> Array:
        u = part[:, None]
        path = quintic(u, swing.start, swing.end, swing.start_slope, swing.end_slope)
        path[:, 2:] += self.clearance * _early_bump(u)
        return path


def walk(
    body: Body,
    gait: Gait,
    frame_count: int,
    frame_rate: float = 24.0,
    start_phase: float = 0.25,
    course: Course = STRAIGHT,
) -> BodyMotion:
    """A walk along a course, by default along x from the origin; in full stride from the first frame to the last."""
    times, phase = over_strides(frame_count, frame_rate, start_phase, gait.stride_time(body))
    local = _hips_path(body, gait, phase, times)
    local[:, 2] += _hips_height(body, gait)
    footfalls = gait.footfalls(body, course, start_phase, times[-1])
    leaning = inward_lean(gait.speed, course.curvature(local[:, 0]))
    hips = along_course(course, local, leaning)
    hips[:, 2] += ride(times, footfalls)
    foot = gait.foot_course(body)
    feet = foot_poses(dict.fromkeys(SIDES, foot), times, footfalls)

    upper = {"hips": gait.pelvis(phase)} | gait.trunk(phase, gait.mid_stance(body))
    for side in SIDES:
        upper |= gait.arm(body, side, phase, upper["chest"])
    upper = facing_along(course, local[:, 0], leaning, upper)
    hips[:, 2] -= crouch(_room(body, hips, upper["hips"], feet), frame_rate, gait.stride_time(body))
    return assemble(body, frame_rate, hips, upper, feet, footfalls)


def _early_bump(u: Array) -> Array:
    """A bump over [0, 1] of height 1 at 3/8, where a swinging ankle is highest; both ends are smooth."""
    return (8 / 3 * u) ** 3 * (8 / 5 * (1 - u)) ** 5


def _hips_path(body: Body, gait: Gait, phase: Array, times: Array) -> Array:
    """Hips over time, (F, 3) [m]; z is relative to the mean."""
    top = gait.mid_stance(body)
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
    feet = foot_poses(dict.fromkeys(SIDES, gait.foot_course(body)), times, gait.footfalls(body, STRAIGHT, 0.0, stride))
    path = _hips_path(body, gait, phase, times)
    return float(_room(body, path, gait.pelvis(phase), feet).min())


def _room(body: Body, hips: Array, pelvis: Array, feet: dict[str, FootPoses]) -> Array:
    """How far the hips can rise before any leg, planted or not, is too long, (F,) [m]."""
    always = dict.fromkeys(SIDES, np.ones(len(hips), dtype=bool))
    return room_above(body, hips, pelvis, feet, MAX_STRETCH * (body.thigh + body.shin), always)
