"""A kick and a dance, as scores: the steps and the angles are keyed, the centre of mass stays over the feet."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from sample_scenes.balance import rest_centre
from sample_scenes.body import Array, Body
from sample_scenes.curves import clamped_spline
from sample_scenes.motion import BodyMotion, Footfall
from sample_scenes.performance import Score, Track, perform, standing

_SHIFT_TIME = 0.32
"""Time in which the centre of mass moves from foot to foot [s]."""


def over_the_feet(body: Body, footfalls: Sequence[Footfall], bounce: Track) -> Callable[[Array], Array]:
    """A path of the centre of mass that stays over whatever feet are on the ground.

    Parameters
    ----------
    body : Body
    footfalls : sequence of Footfall
    bounce : Track
        Times [s] and heights relative to standing, in hundredths of leg length.
    """
    fine = np.arange(-1.0, max(fall.strike for fall in footfalls) + 6.0, 0.01)
    ahead = 0.35 * body.foot.ball
    places, down = [], []
    for fall in footfalls:
        direction = np.array((np.cos(fall.heading), np.sin(fall.heading)))
        places.append(fall.place[:2] + ahead * direction)
        down.append((fine >= fall.strike) & (fine <= fall.leave))
    weights = np.array(down, dtype=float)
    level = weights.T @ np.array(places) / np.maximum(weights.sum(axis=0), 1e-9)[:, None]
    # In the air it goes from foot to foot.
    grounded = weights.sum(axis=0) > 0
    level = np.column_stack([np.interp(fine, fine[grounded], level[grounded, i]) for i in (0, 1)])
    half = round(_SHIFT_TIME / 0.01)
    window = np.hanning(2 * half + 3)[1:-1]
    padded = np.pad(level, ((half, half), (0, 0)), mode="edge")
    smooth = np.column_stack([np.convolve(padded[:, i], window / window.sum(), mode="valid") for i in (0, 1)])
    knots, heights = np.transpose(bounce)
    standing_height = float(rest_centre(body)[2])

    def centre(times: Array) -> Array:
        height = clamped_spline(times, knots, heights, 0.0, 0.0)
        return np.column_stack(
            [
                *(np.interp(times, fine, smooth[:, i]) for i in (0, 1)),
                standing_height + height / 100 * body.leg_length,
            ]
        )

    return centre


def kick(body: Body, frame_count: int = 60, frame_rate: float = 24.0) -> BodyMotion:
    """A straight kick to the height of the chest with the right leg, from a fighting stance and back to it; 2.5 s."""
    leg = body.leg_length
    width, back = 0.13 * leg, 0.42 * leg
    stance = [
        standing("L", -1.0, 100.0, 0.0, width, 20.0),
        standing("R", -1.0, 0.72, -back, -width, -40.0),
        standing("R", 1.62, 100.0, -back, -width, -40.0),
    ]
    hip = 0.98 * leg
    chamber = (0.20 * leg, -0.6 * width, hip - 0.50 * leg)
    strike = (0.80 * leg, 0.1 * width, hip + 0.16 * leg)
    lifted = (-back + 0.20 * leg, -0.95 * width, body.foot.ankle_height + 0.25 * leg)
    swing = [(0.17, lifted), (0.36, chamber), (0.56, strike), (0.74, (0.22 * leg, -0.6 * width, hip - 0.46 * leg))]
    swing.append((0.93, (-back + 0.03 * leg, -width, body.foot.ankle_height + 0.09 * leg)))
    guard_l, guard_r = 38.0, 22.0
    angles: dict[str, Track] = {
        "yaw": ((0.4, -28.0), (0.95, 18.0), (1.25, 22.0), (1.9, -28.0)),
        "lean": ((0.5, 6.0), (1.0, -8.0), (1.22, -24.0), (1.7, 6.0)),
        "bend": ((0.5, 6.0), (1.22, -4.0), (1.7, 6.0)),
        "twist": ((0.4, 8.0), (0.95, -14.0), (1.25, -22.0), (1.9, 8.0)),
        "nod": ((0.5, 0.0), (1.22, 14.0), (1.7, 0.0)),
        "arm.L": ((0.5, guard_l), (1.2, 12.0), (1.7, guard_l)),
        "arm.R": ((0.5, guard_r), (1.2, -24.0), (1.7, guard_r)),
        "elbow.L": ((0.5, 112.0), (1.2, 92.0), (1.7, 112.0)),
        "elbow.R": ((0.5, 118.0), (1.2, 58.0), (1.7, 118.0)),
        "spread.L": ((0.5, 10.0), (1.2, 30.0), (1.7, 10.0)),
        "spread.R": ((0.5, 12.0), (1.2, 34.0), (1.7, 12.0)),
    }
    pitch: dict[str, Track] = {
        "L": ((0.0, 0.0), (3.0, 0.0)),
        "R": (
            (0.48, 0.0),
            (0.72, -48.0),
            (0.95, -40.0),
            (1.12, 66.0),
            (1.25, 72.0),
            (1.5, -12.0),
            (1.62, -16.0),
            (1.8, 0.0),
        ),
    }
    low = -9.0
    bounce = ((0.0, low), (0.5, low), (1.2, -3.0), (1.75, low - 2), (2.1, low))
    score = Score(tuple(stance), pitch, over_the_feet(body, stance, bounce), angles, {("R", 0): swing})
    return perform(body, score, frame_count, frame_rate)


BEAT = 0.5
"""Time of a beat of the dance: 120 a minute [s]."""


def dance(body: Body, frame_count: int = 192, frame_rate: float = 24.0) -> BodyMotion:
    """Side steps and turns in rounds of eight beats, every other round with the sides exchanged; two rounds in 8 s."""
    leg = body.leg_length
    narrow, wide = 0.12 * leg, 0.30 * leg
    # Beat, side, place (forward, left) and heading of the steps of a round.
    steps = (
        (1.0, "L", 0.0, narrow + wide, 8.0),
        (2.0, "R", 0.0, narrow + wide - 2 * narrow, -8.0),
        (3.0, "L", 0.20 * leg, narrow + 1.3 * wide, 35.0),
        (4.0, "R", 0.22 * leg, 0.4 * narrow, 10.0),
        (5.0, "R", 0.0, -narrow - 0.2 * wide, -30.0),
        (6.0, "L", 0.02 * leg, narrow - 0.2 * wide, 10.0),
        (7.0, "R", 0.0, -narrow, -8.0),
        (8.0, "L", 0.0, narrow, 8.0),
    )
    rounds = max(1, int(np.ceil(frame_count / frame_rate / (8 * BEAT))))
    falls: list[Footfall] = []
    last = {"L": (-1.0, 0.0, narrow, 8.0), "R": (-1.0, 0.0, -narrow, -8.0)}
    for number in range(rounds):
        mirrored = number % 2 == 1
        for beat, name, x, y, heading in steps:
            side = {"L": "R", "R": "L"}[name] if mirrored else name
            strike = (8 * number + beat) * BEAT
            start, *place = last[side]
            falls.append(standing(side, start, strike - 0.62 * BEAT, *place))
            sign = -1.0 if mirrored else 1.0
            last[side] = (strike, x, sign * y, sign * heading)
    falls += [standing(side, start, 1e3, *place) for side, (start, *place) in last.items()]

    beats = np.arange(0, 8 * rounds + 2) * BEAT
    bounce = tuple(sorted([(t, -6.0) for t in beats] + [(t + 0.5 * BEAT, -2.2) for t in beats]))
    pitch = {side: _heels(falls, side) for side in "LR"}
    return perform(
        body,
        Score(tuple(falls), pitch, over_the_feet(body, falls, bounce), _groove(rounds), lift=0.13 * leg),
        frame_count,
        frame_rate,
    )


def _heels(falls: Sequence[Footfall], side: str) -> Track:
    """Flat in stance, up over the ball at its end, down with the ball first."""
    keys: list[tuple[float, float]] = []
    for fall in falls:
        if fall.side != side:
            continue
        keys += [(fall.strike, -14.0), (fall.strike + 0.10, 0.0)]
        if fall.leave < 1e2:
            keys += [(max(fall.leave - 0.16, fall.strike + 0.11), 0.0), (fall.leave, -40.0)]
    return tuple(keys)


def _groove(rounds: int) -> dict[str, Track]:
    """Hips and arms to the beat."""
    beats = np.arange(0, 8 * rounds + 2)
    swing = np.where(beats % 2 == 0, 1.0, -1.0)
    times = beats * BEAT
    big = np.where((beats % 8 >= 3) & (beats % 8 <= 5), 1.0, 0.45)
    tracks = {
        "yaw": 16.0 * swing * big,
        "list": 5.0 * swing,
        "twist": -22.0 * swing * big,
        "tilt": -8.0 * swing,
        "lean": 5.0 + 3.0 * big,
        "nod": np.where(beats % 2 == 0, 4.0, -4.0),
    }
    result: dict[str, Track] = {name: tuple(zip(times, values, strict=True)) for name, values in tracks.items()}
    for side, sign in (("L", 1.0), ("R", -1.0)):
        up = np.clip(sign * swing, 0.0, 1.0) * big
        result |= {
            f"arm.{side}": tuple(zip(times, 8.0 + 60.0 * up, strict=True)),
            f"spread.{side}": tuple(zip(times, 18.0 + 42.0 * up, strict=True)),
            f"elbow.{side}": tuple(zip(times, 62.0 + 24.0 * up, strict=True)),
        }
    return result
