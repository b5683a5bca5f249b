"""The course of a foot: rolling on the ground in stance, flying from footfall to footfall in swing.

Planted feet stay where they are and the legs are solved to reach them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sample_scenes.body import SIDES, Array, Body, Foot
from sample_scenes.course import Course
from sample_scenes.curves import monotone_cubic, periodic_cubic
from sample_scenes.limbs import bend_to_reach, hanging
from sample_scenes.motion import Footfall, rotation

_INSTANT = 1e-5
"""Part of a stance over which the foot's velocity at its ends is taken."""


@dataclass(frozen=True)
class FootPoses:
    """A foot over time: ankle (F, 3) [m]; turns of foot and toes (F, 3, 3); heading (F,) [rad]."""

    ankle: Array
    foot: Array
    toe: Array
    heading: Array


@dataclass(frozen=True)
class Swing:
    """Where a swing begins and ends, and with which velocity times duration, (3,) each [m]."""

    before: Footfall
    after: Footfall
    start: Array
    end: Array
    start_slope: Array
    end_slope: Array

    @property
    def duration(self) -> float:
        """[s]"""
        return self.after.strike - self.before.leave


SwingPath = Callable[[Array, Swing], Array]
"""Places of the ankle, (F, 3) [m], at parts (F,) of a swing."""


@dataclass(frozen=True)
class Roll:
    """Pitch of a foot over a stride, toes up positive.

    Attributes
    ----------
    duty_factor : float
        Part of a stride that the foot is on the ground.
    stance, swing : tuple of (tuple of float, tuple of float)
        Knots as parts of stance and of swing, in [0, 1), and the pitch there [degrees].
    toe_bend : float
        Bend of the toes beyond which they lift too [degrees].
    held_toes : bool
        The toes are held by something stiff (a snowshoe): level in stance, only a little tipped up in swing.
    """

    duty_factor: float
    stance: tuple[tuple[float, ...], tuple[float, ...]]
    swing: tuple[tuple[float, ...], tuple[float, ...]]
    toe_bend: float
    held_toes: bool = False

    def stance_phase(self, part: Array, fall: Footfall) -> Array:  # noqa: ARG002  (the same in every stance)
        """Phase at parts (F,) of a stance."""
        return self.duty_factor * part

    def swing_phase(self, part: Array, fall: Footfall, following: Footfall) -> Array:  # noqa: ARG002  (in every swing)
        """Phase at parts (F,) of the swing between two footfalls."""
        return self.duty_factor + (1 - self.duty_factor) * part

    def pitch(self, phase: Array) -> Array:
        """Foot pitch at phases of the stride, 0 at heel strike [rad]."""
        duty = self.duty_factor
        knots = np.concatenate([duty * np.array(self.stance[0]), duty + (1 - duty) * np.array(self.swing[0])])
        return periodic_cubic(phase, knots, np.radians(np.concatenate([self.stance[1], self.swing[1]])))

    def bend(self, phase: Array) -> Array:
        """Toes up relative to the foot [rad]: in stance they stay flat until they can bend no further."""
        if self.held_toes:
            swing = np.clip((phase - self.duty_factor) / (1 - self.duty_factor), 0.0, 1.0)
            return -self.pitch(phase) + np.radians(7.0) * np.sin(np.pi * swing) ** 2
        duty, landing_bend = self.duty_factor, np.radians(8.0)

        def planted(at: Array) -> Array:
            pitch = self.pitch(at)
            strike = max(np.radians(self.stance[1][0]), 1e-9)
            return _toes_up(-pitch, np.radians(self.toe_bend)) + landing_bend * np.clip(pitch / strike, 0.0, 1.0)

        swing = np.clip((phase - duty) / (1 - duty), 0.0, 1.0)
        relax = monotone_cubic(swing, (0.0, 0.12, 0.6, 1.0), (1.0, 0.95, 0.1, 0.0))
        landing = landing_bend * (3 * swing**2 - 2 * swing**3) * (self.stance[1][0] > 0)
        return np.where(phase < duty, planted(phase), planted(np.array([duty * (1 - 1e-12)])) * relax + landing)


def _toes_up(heel_up: Array, limit: float) -> Array:
    """Bend of toes that stay flat under a lifted heel until they can bend no further [rad]."""
    give = np.radians(10.0)
    beyond = np.maximum(heel_up - limit, 0.0)
    return np.where(heel_up < limit, np.maximum(heel_up, 0.0), limit + give * (1 - np.exp(-beyond / give)))


@dataclass(frozen=True)
class KeyedRoll:
    """Pitch of a foot over a motion that does not repeat; its phase is the time [s].

    Attributes
    ----------
    keys : tuple of (float, float)
        Times [s] and the pitch there, toes up positive [degrees].
    footfalls : tuple of Footfall
        When the foot is on the ground, and its toes flat.
    toe_bend : float
        Bend of the toes beyond which they lift too [degrees].
    """

    keys: tuple[tuple[float, float], ...]
    footfalls: tuple[Footfall, ...]
    toe_bend: float = 38.0

    def stance_phase(self, part: Array, fall: Footfall) -> Array:
        """Times at parts (F,) of a stance [s]."""
        return fall.strike + part * (fall.leave - fall.strike)

    def swing_phase(self, part: Array, fall: Footfall, following: Footfall) -> Array:
        """Times at parts (F,) of the swing between two footfalls [s]."""
        return fall.leave + part * (following.strike - fall.leave)

    def pitch(self, phase: Array) -> Array:
        """Foot pitch at times [rad]."""
        times, values = np.transpose(self.keys)
        return monotone_cubic(phase, times, np.radians(values))

    def bend(self, phase: Array) -> Array:
        """Toes up relative to the foot [rad]: flat in stance, relaxed in the air."""
        away = np.min([np.maximum(np.maximum(f.strike - phase, phase - f.leave), 0.0) for f in self.footfalls], axis=0)
        relaxed = np.clip(away / 0.25, 0.0, 1.0)
        flat = 1 - relaxed**2 * (3 - 2 * relaxed)
        return flat * _toes_up(-self.pitch(phase), np.radians(self.toe_bend))


class FootCourse:
    """One foot from footfall to footfall.

    Parameters
    ----------
    shape : Foot
    roll : Roll
    swing_path : callable
    touch_down : (3,) array_like
        Velocity of the ankle at landing beyond that of the rolling foot, in the footfall's frame [m/s].
    """

    def __init__(
        self, shape: Foot, roll: Roll | KeyedRoll, swing_path: SwingPath, touch_down: tuple[float, float, float]
    ) -> None:
        self.shape, self.roll, self.swing_path = shape, roll, swing_path
        self.touch_down = np.array(touch_down)

    def poses(self, times: Array, footfalls: Sequence[Footfall]) -> FootPoses:
        """The foot at times from the first strike to the last of its footfalls."""
        count = len(times)
        phase, ankle = np.zeros(count), np.zeros((count, 3))
        tilt = np.zeros((count, 3))  # heading, slope, bank
        for fall, following in pairwise(footfalls):
            here = (times >= fall.strike) & (times < following.strike)
            stance = (times[here] - fall.strike) / (fall.leave - fall.strike)
            swing = np.clip((times[here] - fall.leave) / (following.strike - fall.leave), 0.0, 1.0)
            planted = self.roll.stance_phase(np.minimum(stance, 1 - 1e-12), fall)
            phase[here] = np.where(stance < 1, planted, self.roll.swing_phase(swing, fall, following))
            ankle[here] = np.where(
                (stance < 1)[:, None],
                fall.place + self._rolling(planted) @ ground_frame(fall).T,
                self.swing_path(swing, self._swing(fall, following)),
            )
            eased = (3 * swing**2 - 2 * swing**3)[:, None]
            tilt[here] = (1 - eased) * _tilt(fall) + eased * _tilt(following)
        pitch, bend = self.roll.pitch(phase), self.roll.bend(phase)
        frame = _frame(*tilt.T)
        foot, toe = frame @ rotation("y", -pitch), frame @ rotation("y", -pitch - bend)
        return FootPoses(ankle, foot, toe, tilt[:, 0])

    def _swing(self, fall: Footfall, following: Footfall) -> Swing:
        time = following.strike - fall.leave
        here, following_frame = ground_frame(fall), ground_frame(following)
        leaving = self._rolling(self.roll.stance_phase(np.array((1 - _INSTANT, 1 - 1e-12)), fall)) @ here.T
        landing = self._rolling(self.roll.stance_phase(np.array((0.0, _INSTANT)), following)) @ following_frame.T
        leave_velocity = (leaving[1] - leaving[0]) / (_INSTANT * (fall.leave - fall.strike))
        land_velocity = (landing[1] - landing[0]) / (_INSTANT * (following.leave - following.strike))
        land_velocity = land_velocity + following_frame @ self.touch_down
        return Swing(
            fall,
            following,
            fall.place + leaving[1],
            following.place + landing[0],
            leave_velocity * time,
            land_velocity * time,
        )

    def _rolling(self, phase: Array) -> Array:
        """Ankle relative to the footfall's place while the foot rolls, in the footfall's frame: (F, 3) [m]."""
        shape = self.shape
        pitch, bend = self.roll.pitch(phase), self.roll.bend(phase)
        height = shape.ankle_height
        on_heel = _turned(pitch, -shape.heel, height) + np.array((shape.heel, 0.0, 0.0))
        toe_pitch = np.minimum(pitch + bend, 0.0)
        ball = _turned(toe_pitch, shape.ball - shape.toe, shape.ball_height) + np.array((shape.toe, 0.0, 0.0))
        on_ball = ball + _turned(pitch, -shape.ball, height - shape.ball_height)
        return np.where((pitch > 0)[:, None], on_heel, on_ball)


def ground_frame(fall: Footfall) -> Array:
    """Axes of a footfall as columns: toward the toes, to their left, off the ground."""
    return _frame(*_tilt(fall))


def _tilt(fall: Footfall) -> Array:
    return np.array((fall.heading, fall.slope, fall.bank))


def _frame(heading: Array, slope: Array, bank: Array) -> Array:
    return rotation("z", heading) @ rotation("y", -slope) @ rotation("x", bank)


def _turned(pitch: Array, forward: float, up: float) -> Array:
    """A point (forward, 0, up) turned toes-up by `pitch` (F,), as (F, 3)."""
    cos, sin = np.cos(pitch), np.sin(pitch)
    return np.stack([forward * cos - up * sin, np.zeros_like(pitch), forward * sin + up * cos], axis=-1)


def footfall_at(
    course: Course, side: str, along: float, aside: float, toe_out: float, strike: float, leave: float
) -> Footfall:
    """A footfall beside a way, flat on its ground.

    Parameters
    ----------
    course : Course
    side : str
    along, aside : float
        Place on the way, and to its left [m].
    toe_out : float
        Toes turned away from the way [rad].
    strike, leave : float
        [s]
    """
    place = course.place(along, aside)
    heading = float(course.heading(along)) + SIDES[side[-1]] * toe_out
    slope, bank = course.slope(place, heading)
    ground = float(course.ground(along, aside))
    return Footfall(side, strike, leave, np.append(place, ground), heading, float(slope), float(bank))


def leg_turns(body: Body, side: str, hips: Array, pelvis: Array, foot: FootPoses) -> dict[str, Array]:
    """Thigh and shin that join hip and ankle; the knee bends about the left of foot and pelvis."""
    hip = hips + pelvis @ (body.joints[f"hip.{side}"] - body.joints["hips"])
    left = pelvis[:, :, 1] + rotation("z", foot.heading)[:, :, 1]
    knee, lateral = bend_to_reach(hip, foot.ankle, body.thigh, body.shin, np.cross(left, hip - foot.ankle))
    return {
        f"thigh.{side}": hanging(knee - hip, lateral),
        f"shin.{side}": hanging(foot.ankle - knee, lateral),
        f"foot.{side}": foot.foot,
        f"toe.{side}": foot.toe,
    }
