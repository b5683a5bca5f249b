"""What walking and running share: strides over a course, and a body carried along it.

Phases are fractions of a stride, 0 at the heel strike of the left foot; the right foot does the same half a stride
later.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sample_scenes.body import BONES, SIDES, Array, Body
from sample_scenes.carriage import Carriage
from sample_scenes.course import Course
from sample_scenes.footwork import FootCourse, FootPoses, footfall_at, leg_turns
from sample_scenes.motion import BodyMotion, Footfall, rotation

Mask = NDArray[np.bool_]

ADULT_LEG = 0.94
"""Leg length of the adults that gait was measured on [m]."""

_TOLERANCE = 0.002  # m that a leg may be longer than asked for


@dataclass(frozen=True, kw_only=True)
class Stride(Carriage):
    """What any two-legged gait needs to know.

    Attributes
    ----------
    speed : float
        [m/s].
    step_width : float
        Between the lines of the left and right ankles [m].
    toe_out : float
        Feet turned outward [degrees].
    over_foot : float
        Part of stance at which the hips pass over the ankle.
    """

    speed: float
    step_width: float
    toe_out: float
    over_foot: float

    def stride_time(self, body: Body) -> float:
        """Time from a strike to the next of the same foot [s]."""
        raise NotImplementedError

    def contact_time(self, body: Body) -> float:
        """Time that a foot is on the ground [s]."""
        raise NotImplementedError

    def step_length(self, body: Body) -> float:
        """Distance from one strike to the next [m]."""
        return self.speed * self.stride_time(body) / 2

    def mid_stance(self, body: Body) -> float:
        """Phase of the middle of the left foot's stance."""
        return self.contact_time(body) / self.stride_time(body) / 2

    def footfalls(self, body: Body, course: Course, start_phase: float, duration: float) -> tuple[Footfall, ...]:
        """All contacts from a stride before the start to a stride after the end."""
        stride, contact = self.stride_time(body), self.contact_time(body)
        falls = []
        for index in range(-3, int(2 * (duration / stride + start_phase)) + 4):
            side = "LR"[index % 2]
            strike = (index / 2 - start_phase) * stride
            along = self.speed * (strike + self.over_foot * contact)
            aside = SIDES[side] * self.step_width / 2
            falls.append(footfall_at(course, side, along, aside, np.radians(self.toe_out), strike, strike + contact))
        return tuple(falls)


def over_strides(frame_count: int, frame_rate: float, start_phase: float, stride_time: float) -> tuple[Array, Array]:
    """Times of frames (F,) [s], the first at 0, and how many strides they are from the start of one, (F,)."""
    times = np.arange(frame_count) / frame_rate
    return times, start_phase + times / stride_time


def ride(times: Array, footfalls: Sequence[Footfall]) -> Array:
    """Height of the ground under a body that goes over footfalls, (F,) [m].

    It changes its slope only while a foot is on the ground and keeps it in flight, so that a flight stays ballistic.
    """
    falls = sorted(footfalls, key=lambda fall: fall.strike)
    middle = np.array([(fall.strike + fall.leave) / 2 for fall in falls])
    height = np.array([fall.place[2] for fall in falls])
    slope = np.diff(height) / np.diff(middle)
    between = (middle[1:] + middle[:-1]) / 2
    leave = np.minimum([fall.leave for fall in falls[:-1]], between)
    strike = np.maximum([fall.strike for fall in falls[1:]], between)
    index = np.clip(np.searchsorted(middle, times) - 1, 0, len(slope) - 1)
    result = height[index] + slope[index] * (times - middle[index])
    for i in range(1, len(falls) - 1):  # the corner between two flights is rounded over the stance
        start, end = strike[i - 1], leave[i]
        u = np.clip((times - start) / (end - start), 0.0, 1.0)
        here = (times > start) & (times < end)
        ends = height[i] + slope[i - 1] * (start - middle[i]), height[i] + slope[i] * (end - middle[i])
        tangents = slope[i - 1] * (end - start), slope[i] * (end - start)
        h = u * u * (3 - 2 * u)
        cubic = (1 - h) * ends[0] + h * ends[1] + u * (1 - u) ** 2 * tangents[0] - u * u * (1 - u) * tangents[1]
        result = np.where(here, cubic, result)
    return result


def inward_lean(speed: float, curvature: Array, gravity: float = 9.81) -> Array:
    """Lean to the left that a bend at this speed asks for, (F,) [rad]: the ground's force points at the body."""
    return np.arctan(speed**2 * curvature / gravity)


def along_course(course: Course, local: Array, leaning: Array) -> Array:
    """Points (F, 3) of a body's own line (along, aside, above ground) in the body's frame, without the ground's height.

    `leaning` (F,) is the lean to the left about the way [rad].
    """
    aside, above = local[:, 1], local[:, 2]
    tilted = aside * np.cos(leaning) + above * np.sin(leaning)
    place = course.place(local[:, 0], tilted)
    return np.column_stack([place, above * np.cos(leaning) - aside * np.sin(leaning)])


def facing_along(course: Course, along: Array, leaning: Array, turns: dict[str, Array]) -> dict[str, Array]:
    """Rotations that were made for a straight way, turned into the course and leant into its bends."""
    turn = rotation("z", course.heading(along)) @ rotation("x", -leaning)
    return {bone: turn @ rotations for bone, rotations in turns.items()}


def foot_poses(feet: dict[str, FootCourse], times: Array, footfalls: Sequence[Footfall]) -> dict[str, FootPoses]:
    """Both feet over time."""
    return {side: feet[side].poses(times, [fall for fall in footfalls if fall.side == side]) for side in SIDES}


def assemble(
    body: Body,
    frame_rate: float,
    hips: Array,
    upper: dict[str, Array],
    feet: dict[str, FootPoses],
    footfalls: Sequence[Footfall],
) -> BodyMotion:
    """A motion from the path of the hips, the rotations above the legs, and the feet; the legs follow."""
    turns = dict(upper)
    for side in SIDES:
        turns |= leg_turns(body, side, hips, upper["hips"], feet[side])
    end = (len(hips) - 1) / frame_rate
    seen = tuple(fall for fall in footfalls if fall.leave > 0 and fall.strike < end)
    return BodyMotion(frame_rate, hips, {bone: turns[bone] for bone in BONES}, seen)


def within_reach(body: Body, side: str, hips: Array, pelvis: Array, foot: FootPoses, stretch: float) -> FootPoses:
    """The foot drawn toward the hip where the leg would be longer than `stretch` of its length: it lifts off early."""
    hip = hips + pelvis @ (body.joints[f"hip.{side}"] - body.joints["hips"])
    reach = foot.ankle - hip
    longest, give = stretch * (body.thigh + body.shin), 0.6 * (1 - stretch) * (body.thigh + body.shin)
    distance = np.linalg.norm(reach, axis=1, keepdims=True)
    beyond = np.maximum(distance - longest, 0.0)
    drawn = np.where(beyond > 0, longest + give * (1 - np.exp(-beyond / give)), distance)
    return dataclasses.replace(foot, ankle=hip + reach * drawn / distance)


def room_above(
    body: Body, hips: Array, pelvis: Array, feet: dict[str, FootPoses], reach: float, planted: dict[str, Mask]
) -> Array:
    """How far the hips can rise before a planted leg is longer than `reach`, (F,) [m]; negative where they must sink.

    Infinite where no foot is planted.
    """
    room = np.full(len(hips), np.inf)
    for side in SIDES:
        hip = hips + pelvis @ (body.joints[f"hip.{side}"] - body.joints["hips"])
        level = np.linalg.norm((hip - feet[side].ankle)[:, :2], axis=1)
        above = feet[side].ankle[:, 2] + np.sqrt(np.maximum(reach**2 - level**2, 0.0)) - hip[:, 2]
        room = np.minimum(room, np.where(planted[side], above, np.inf))
    return room


def crouch(room: Array, frame_rate: float, stride_time: float) -> Array:
    """How far to sink so that the legs reach slopes, (F,) [m]: as the stride around asks for, changing smoothly."""
    missing = np.maximum(-np.where(np.isfinite(room), room, 0.0) - _TOLERANCE, 0.0)
    half = max(1, round(0.5 * stride_time * frame_rate))
    padded = np.pad(missing, 3 * half, mode="edge")
    deepest = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1).max(axis=1)
    window = np.hanning(2 * half + 3)[1:-1]
    smooth = np.convolve(deepest, window / window.sum(), mode="valid")
    return smooth[half:-half]


def planted_at(times: Array, footfalls: Sequence[Footfall]) -> dict[str, Mask]:
    """When each foot is on the ground, (F,) each."""
    planted = {side: np.zeros(len(times), dtype=bool) for side in SIDES}
    for fall in footfalls:
        planted[fall.side] |= (times >= fall.strike) & (times <= fall.leave)
    return planted
