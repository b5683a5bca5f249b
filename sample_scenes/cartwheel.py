"""A cartwheel to the left: foot, hand, hand, foot, foot, the body turning once about the line of sight.

Order and spacing of the supports are those that are taught; the poses are our own.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sample_scenes.body import Array, Body
from sample_scenes.curves import clamped_spline
from sample_scenes.motion import BodyMotion, Footfall
from sample_scenes.performance import Score, Track, Via, perform, standing

DURATION = 2.8
"""From standing to standing [s]."""

_MIDDLE = 1.22  # s: upside down
_DRAWN_STATURE = 1.78  # m; places below are for this stature

_HIPS_BELOW = 0.095  # of the stature: hips from the centre of mass while the legs are thrown over

_CENTRE = (
    # time [s], to the left, up [m]
    (0.00, 0.00, 0.985), (0.30, 0.04, 0.980), (0.60, 0.42, 0.910), (0.78, 0.76, 0.790), (0.92, 1.03, 0.742),
    (1.07, 1.31, 0.800), (1.22, 1.575, 0.850), (1.37, 1.84, 0.800), (1.52, 2.12, 0.742), (1.66, 2.39, 0.790),
    (1.84, 2.64, 0.900), (2.14, 2.79, 0.965), (2.60, 2.81, 0.975),
)  # fmt: skip

_ROLL = (
    (0.30, 0.0), (0.60, 20.0), (0.78, 58.0), (0.92, 98.0), (1.07, 140.0), (1.22, 180.0),
    (1.37, 220.0), (1.52, 262.0), (1.66, 302.0), (1.84, 338.0), (2.14, 360.0),
)  # fmt: skip

_LEG_RIGHT = ((1.00, -105.0), (1.10, -160.0), (1.22, -228.0), (1.34, -278.0))
"""Time and direction of the right leg in its swing, from down toward the left [degrees]; the left mirrors it."""


def cartwheel(body: Body, frame_count: int | None = None, frame_rate: float = 24.0) -> BodyMotion:
    """A cartwheel along +y from standing at the origin, facing x all the while."""
    size = body.stature / _DRAWN_STATURE
    pace = size**0.5  # time scales with the pendulum
    count = frame_count or round(DURATION * pace * frame_rate) + 1

    def foot(side: str, start: float, end: float, y: float, heading: float) -> Footfall:
        return standing(side, start * pace, end * pace, 0.0, y * size, heading)

    feet = (
        foot("L", -1.0, 0.26, 0.10, 6.0),
        foot("L", 0.58, 0.98, 0.62, 35.0),
        foot("L", 1.60, 100.0, 3.10, 10.0),
        foot("R", -1.0, 0.86, -0.10, -6.0),
        foot("R", 1.46, 100.0, 2.53, -20.0),
    )
    hands = (
        Footfall("L", 0.95 * pace, 1.32 * pace, size * np.array((0.06, 1.36, 0.0)), np.pi),
        Footfall("R", 1.12 * pace, 1.49 * pace, size * np.array((0.06, 1.79, 0.0)), np.pi),
    )
    pitch: dict[str, Track] = {
        "L": _scaled(
            (
                (0.18, 0.0),
                (0.26, -18.0),
                (0.58, -8.0),
                (0.68, 0.0),
                (0.80, 0.0),
                (0.98, -48.0),
                (1.60, -42.0),
                (1.74, 0.0),
            ),
            pace,
        ),
        "R": _scaled(((0.66, 0.0), (0.86, -52.0), (1.46, -46.0), (1.60, 0.0)), pace),
    }
    spread = ((0.05, 8.0), (0.50, 160.0), (1.60, 165.0), (2.20, 12.0))
    angles = {
        "list": _scaled(tuple((time, -roll) for time, roll in _ROLL), pace),
        "tilt": _scaled(
            ((0.30, 0.0), (0.70, -18.0), (0.95, -20.0), (1.22, 0.0), (1.49, 20.0), (1.74, 18.0), (2.10, 0.0)), pace
        ),
        "spread.L": _scaled(spread, pace),
        "spread.R": _scaled(spread, pace),
    }

    def centre(times: Array) -> Array:
        knots, left, up = np.transpose(_CENTRE)
        path = size * clamped_spline(times / pace, knots, np.column_stack([left, up]), (0.0, 0.0), (0.0, 0.0))
        return np.column_stack([np.full(len(times), 0.02 * size), path])

    swings = {
        ("R", 0): _over_the_top(body, centre, _LEG_RIGHT, (0.86, 1.46), pace),
        ("L", 1): _over_the_top(body, centre, _mirrored(_LEG_RIGHT), (0.98, 1.60), pace),
    }
    score = Score(feet, pitch, centre, angles, swings, lift=0.10 * size, hands=hands, loose_feet=True)
    return perform(body, score, count, frame_rate)


def _scaled(track: Track, pace: float) -> Track:
    return tuple((time * pace, value) for time, value in track)


def _mirrored(leg: Track) -> Track:
    return tuple((2 * _MIDDLE - time, -360.0 - direction) for time, direction in reversed(leg))


def _over_the_top(
    body: Body, centre: Callable[[Array], Array], leg: Track, swing: tuple[float, float], pace: float
) -> Via:
    """The ankle's way through directions of the leg about the hips."""
    start, end = swing
    length = 0.97 * (body.thigh + body.shin)
    rolls, degrees = np.transpose(_ROLL)
    via = []
    for time, direction in leg:
        roll, angle = np.radians(np.interp(time, rolls, degrees)), np.radians(direction)
        up = np.array((0.0, np.sin(roll), np.cos(roll)))
        hips = centre(np.array([time * pace]))[0] - _HIPS_BELOW * body.stature * up
        place = hips + length * np.array((0.0, np.sin(angle), -np.cos(angle)))
        via.append(((time - start) / (end - start), tuple(place)))
    return tuple(via)
