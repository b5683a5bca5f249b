"""A jump from a few numbers: countermovement, push, a flight that falls freely, a landing that the knees absorb.

Depth of the countermovement and times of the phases follow measured jumps (Linthorne 2001, Analysis of standing
vertical jumps using a force platform): the push bears a little over two body weights, the landing three.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from sample_scenes.balance import GRAVITY, rest_centre
from sample_scenes.body import Array, Body
from sample_scenes.curves import quintic_path
from sample_scenes.motion import BodyMotion
from sample_scenes.performance import Score, perform, standing


@dataclass(frozen=True, kw_only=True)
class Jump:
    """How somebody jumps.

    Attributes
    ----------
    height : float
        Rise of the centre of mass after take-off [m].
    distance : float
        From where the feet leave to where they land [m].
    depth, landing_depth : float
        How far the centre of mass sinks before and after, relative to leg length.
    stand_before, stand_after : float
        [s].
    stance_width : float
        Between the lines of the ankles [m].
    """

    height: float = 0.30
    distance: float = 0.0
    depth: float = 0.30
    landing_depth: float = 0.30
    stand_before: float = 0.5
    stand_after: float = 0.6
    stance_width: float = 0.22

    @property
    def take_off_speed(self) -> float:
        """[m/s]"""
        return sqrt(2 * GRAVITY * self.height)

    def landing_speed(self, body: Body) -> float:
        """[m/s]; knees and ankles are less stretched than at take-off."""
        return sqrt(self.take_off_speed**2 + 2 * GRAVITY * _LOWER * body.leg_length)

    def flight_time(self, body: Body) -> float:
        """[s]"""
        return (self.take_off_speed + self.landing_speed(body)) / GRAVITY

    def timing(self, body: Body) -> tuple[float, float, float, float, float]:
        """Times of the deepest crouch, take-off, landing, deepest landing and standing again [s]."""
        leg = body.leg_length
        down = 1.4 * sqrt(leg / GRAVITY)
        push = 1.75 * (self.depth + _RISE) * leg / self.take_off_speed
        absorb = 1.75 * (self.landing_depth + _RISE) * leg / self.landing_speed(body)
        crouch = self.stand_before + down
        leave = crouch + push
        land = leave + self.flight_time(body)
        return crouch, leave, land, land + absorb, land + absorb + 1.5 * down

    def duration(self, body: Body) -> float:
        """[s]"""
        return self.timing(body)[-1] + self.stand_after


_RISE = 0.085
"""Rise of the centre of mass from standing to the stretched leg on its toes, relative to leg length."""

_LOWER = 0.06
"""How much lower the centre of mass is at landing than at take-off, relative to leg length."""


def jump(body: Body, gait: Jump, frame_count: int | None = None, frame_rate: float = 24.0) -> BodyMotion:
    """A jump from standing at the origin along x, by default until standing again."""
    count = frame_count or round(gait.duration(body) * frame_rate) + 1
    crouch, leave, land, deepest, stand = gait.timing(body)
    ahead = gait.distance
    aside = gait.stance_width / 2
    falls = []
    for side, y in (("L", aside), ("R", -aside)):
        falls += [standing(side, -1.0, leave, 0.0, y, 6.0 if side == "L" else -6.0)]
        falls += [standing(side, land, stand + 100.0, ahead, y, 6.0 if side == "L" else -6.0)]
    pitch = (
        (0.0, 0.0),
        (crouch + 0.35 * (leave - crouch), 0.0),
        (leave, -56.0),
        (leave + 0.4 * (land - leave), -48.0),
        (land, -34.0 if not ahead else -6.0),
        (land + 0.30 * (deepest - land), 0.0),
        (stand, 0.0),
    )
    back, up = -38.0, 125.0
    arm = (
        (gait.stand_before, 4.0),
        (crouch, back),
        (leave, up),
        ((leave + land) / 2, 105.0),
        (deepest, 30.0),
        (stand, 4.0),
    )
    lean = ((gait.stand_before, 2.0), (crouch, 34.0), (leave, 4.0), (land, 10.0), (deepest, 34.0), (stand, 2.0))
    bend = ((gait.stand_before, 0.0), (crouch, 16.0), (leave, -4.0), (land, 6.0), (deepest, 16.0), (stand, 0.0))
    elbow = ((gait.stand_before, 15.0), (crouch, 22.0), (leave, 38.0), (land, 42.0), (stand, 15.0))
    spread = ((leave, 6.0), ((leave + land) / 2, 18.0), (deepest, 16.0), (stand, 2.0))
    angles = {"lean": lean, "bend": bend, "nod": ((crouch, -14.0), (leave, -2.0), (deepest, -14.0), (stand, 0.0))}
    for side in "LR":
        angles |= {f"arm.{side}": arm, f"elbow.{side}": elbow, f"spread.{side}": spread}
    score = Score(
        tuple(falls),
        {"L": pitch, "R": pitch},
        lambda times: _centre(body, gait, times),
        angles,
        lift=0.5 * gait.height,
    )
    return perform(body, score, count, frame_rate)


def _centre(body: Body, gait: Jump, times: Array) -> Array:
    """Path of the centre of mass, (F, 3) [m]; it falls freely between take-off and landing."""
    crouch, leave, land, deepest, stand = gait.timing(body)
    leg, x = body.leg_length, rest_centre(body)[0] + 0.25 * body.foot.ball
    height = float(rest_centre(body)[2]) - 0.012 * leg
    reach = 0.16 * gait.distance  # the body is ahead of the feet at take-off and behind them at landing
    v, rise = gait.take_off_speed, height + _RISE * leg
    across = (gait.distance - 2 * reach) / gait.flight_time(body)
    keys = np.array(
        [
            # time, x, z, their speeds, their accelerations
            (gait.stand_before, x, height, 0, 0, 0, 0),
            (crouch, x + 0.3 * reach, height - gait.depth * leg, 0.3 * across, 0, 0, 1.25 * GRAVITY),
            (leave, x + reach, rise, across, v, 0, -GRAVITY),
            (land, x + gait.distance - reach, rise - _LOWER * leg, across, -gait.landing_speed(body), 0, -GRAVITY),
            (deepest, x + gait.distance, height - gait.landing_depth * leg, 0, 0, 0, 1.0 * GRAVITY),
            (stand, x + gait.distance, height, 0, 0, 0, 0),
        ]
    )
    path = quintic_path(times, keys[:, 0], keys[:, 1:3], keys[:, 3:5], keys[:, 5:7])
    return np.column_stack([path[:, 0], np.zeros(len(times)), path[:, 1]])
