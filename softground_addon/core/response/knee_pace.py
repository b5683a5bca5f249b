"""No knee turns faster than knees do: hips and swinging feet give way a little, smoothly, where one would.

A leg that is nearly straight turns its knee by tens of degrees for a centimetre of hip or foot. Where the response
would ask that of it, the hips and the feet in the air share the least and smoothest correction that keeps the pace: a
least-squares problem over time, solved by Gauss-Newton steps (Nocedal and Wright 2006, "Numerical Optimization",
chapters 10 and 17: quadratic penalties that grow, with a line search; a step that helps one knee and harms another is
taken again with both in view). Where no knee is too fast and every ankle is in reach, nothing is corrected.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..numerics.banded import solve_banded
from ..numerics.slices import Slices, sliced
from .legs import Leg

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_FRAME = 1 / 30
"""The time that the pace of a knee is named for [s]."""
KNEE_PACE = np.radians(13.0) / _FRAME
"""How fast a knee may turn, or as fast as in the source where that is more [rad/s], for an adult."""
SOURCE_WINDOW = 0.05
"""Time around an instant in which the source's own pace counts [s], for an adult."""
NEARLY_STRAIGHT = np.radians(8.0)
"""Knees straighter than this count as bent by it when asked what turns them [rad]: the answer has no bound."""

# A correction x(t), in leg lengths, costs cost·(T²·x'')² + MAGNITUDE·x² at each sample; the rest is weighed against it.
SMOOTHING_TIME = 0.08
"""T, the time over which a correction comes and goes [s], for an adult."""
MAGNITUDE = 0.1
FOOT_FREEDOM = 0.3
"""The cost of a correction of a foot beside one of the hips."""
LARGEST = 0.12
"""Corrections beyond this cost far more, in leg lengths: rather a fast knee than a body that drops."""
_TOO_LARGE = 30.0
_UNDERGROUND = 1e3
"""For a foot that would come lower than the ground."""
_HELD = 1e6
"""For a foot that stands."""
TOO_FAST = 300.0
"""For a knee that turns too far in `_FRAME` [rad], in the end; the steps before it begin at a hundredth."""
OUT_OF_REACH = 1e3
"""What an ankle out of reach costs beside a knee that is too fast, per leg length and radian."""
STEPS = 14
FIRM = 100.0
"""How many times more it costs where no knee may turn faster than the fastest of the source."""
FURTHER_STEPS = 12
"""How many more steps that takes."""
_PARTS = (1.0, 0.5, 0.25, 0.1, 0.03, 0.01)
"""Parts of a step that are tried until one of them is better: nearly straight knees are far from linear."""


@dataclass(frozen=True)
class PacedLeg:
    """One leg as the response would have it.

    Attributes
    ----------
    source : Leg
    hip, ankle : (F, 3) float arrays
        Where they would go [m].
    reach : (F,) float array
        How far the ankle may be from the hip [m].
    stands : (F,) bool array
        When its foot is on the ground and cannot give way.
    room : (F,) float array
        How far its foot is above the ground [m].
    """

    source: Leg
    hip: Array
    ankle: Array
    reach: Array
    stands: Mask
    room: Array


@dataclass(frozen=True)
class Relief:
    """What keeps the knees' pace.

    Attributes
    ----------
    hips : (F,) float array
        Further height of the hips [m].
    feet : mapping of str to (F,) float array
        By side, how far the foot moves toward its hip, 0 while it stands [m].
    """

    hips: Array
    feet: Mapping[str, Array]


@sliced
def relieve(
    legs: Mapping[str, PacedLeg], *, step: float, time_scale: float, leg_length: float, as_source: bool = False
) -> Slices[Relief]:
    """The least and smoothest correction with which no knee turns too fast.

    Parameters
    ----------
    legs : mapping of str to PacedLeg
        By side; at least one.
    step : float
        Time between samples [s].
    time_scale : float
        How much slower than an adult's the motion is.
    leg_length : float [m]
    as_source : bool
        Whether a knee may turn as fast as the fastest of the source at any time, and no faster.
    """
    paced = list(legs.values())
    if as_source:
        fastest = max(float(np.abs(np.diff(leg.source.flexion)).max(initial=0.0)) for leg in paced)
        paces = [np.full(len(leg.stands) - 1, fastest) for leg in paced]
    else:
        paces = [_allowed_turn(leg, step, time_scale) for leg in paced]
    bends = (SMOOTHING_TIME * time_scale / step) ** 2
    per_frame = _FRAME * time_scale / step
    change = np.zeros((len(paced[0].stands), 1 + len(paced)))  # of the hips, then of each foot

    def violated(change: Array, weight: float, ahead: Array | None = None) -> list[_Equations]:
        found = []
        for number, (leg, pace) in enumerate(zip(paced, paces, strict=True), start=1):
            found += _pace_and_reach(change, number, leg, pace, leg_length, weight * per_frame**2, ahead)
        return found

    if any(len(one.wanted) for one in violated(change, 1.0)):
        steps, most = (STEPS + FURTHER_STEPS, FIRM * TOO_FAST) if as_source else (STEPS, TOO_FAST)
        for weight in np.geomspace(TOO_FAST / 100.0, most, steps):
            yield
            own, asked = _small_and_smooth(change, paced, bends, leg_length), violated(change, weight)
            cost = _cost(asked + own)

            def is_better(there: Array, weight: float = weight, cost: float = cost) -> bool:
                return _cost(violated(there, weight) + _small_and_smooth(there, paced, bends, leg_length)) < cost

            toward = _solution(asked + own, change)
            part = next((part for part in _PARTS if is_better(change + part * toward)), 0.0)
            if not part:
                toward = _solution(violated(change, weight, change + toward) + own, change)
                part = next((part for part in _PARTS if is_better(change + part * toward)), 0.0)
            change = change + part * toward
    return Relief(change[:, 0], {side: change[:, number] for number, side in enumerate(legs, start=1)})


@dataclass(frozen=True)
class _Equations:
    """Weighted linear equations of a step.

    Attributes
    ----------
    unknowns : (T, R) int array
        What each is about, ascending.
    gradient : (T, R) float array
    wanted : (R,) float array
        What each should still amount to.
    weight : (R,) float array or float
    """

    unknowns: NDArray[np.intp]
    gradient: Array
    wanted: Array
    weight: Array | float


def _solution(equations: Sequence[_Equations], change: Array) -> Array:
    """Least-squares step from a correction; no equation is about samples that are more than two apart."""
    count, width = change.shape
    band, right = np.zeros((2 * width + 1, count * width)), np.zeros((count * width, 1))
    for one in equations:
        for i, column in enumerate(one.unknowns):
            np.add.at(right[:, 0], column, one.weight * one.gradient[i] * one.wanted)
            for j in range(i, len(one.unknowns)):
                np.add.at(band, (one.unknowns[j] - column, column), one.weight * one.gradient[i] * one.gradient[j])
    return solve_banded(band, right).reshape(change.shape)


def _cost(equations: Sequence[_Equations]) -> float:
    return float(sum(np.sum(one.weight * one.wanted**2) for one in equations))


def _allowed_turn(leg: PacedLeg, step: float, time_scale: float) -> Array:
    """How far a knee may turn from each sample to the next, (F - 1,) [rad]."""
    source = np.abs(np.diff(leg.source.flexion))
    reach = max(1, round(SOURCE_WINDOW * time_scale / step))
    around = np.lib.stride_tricks.sliding_window_view(np.pad(source, reach, mode="edge"), 2 * reach + 1).max(axis=1)
    return np.maximum(KNEE_PACE * step / time_scale, around)


def _pace_and_reach(
    change: Array,
    number: int,
    leg: PacedLeg,
    pace: Array,
    leg_length: float,
    weight: float,
    ahead: Array | None = None,
) -> list[_Equations]:
    """What is asked of a leg where its knee turns too fast or its ankle is out of reach: with a correction, or also
    with another, `ahead`."""
    count, width = change.shape
    axis, span = _hip_to_ankle(change, number, leg)
    by_hips, by_foot = axis[:, 2] / np.maximum(np.linalg.norm(axis, axis=1), 1e-9), np.where(leg.stands, 0.0, -1.0)
    hips = np.arange(count) * width
    flexion, slope = leg.source.flexion_at(span, NEARLY_STRAIGHT)
    turn = np.diff(flexion)
    limit, is_far = np.clip(turn, -pace, pace), span > leg.reach
    is_fast = np.abs(turn) > pace
    if ahead is not None:
        span_ahead = _hip_to_ankle(ahead, number, leg)[1]
        turn_ahead = np.diff(leg.source.flexion_at(span_ahead)[0])
        limit = np.where(is_fast, limit, np.copysign(pace, turn_ahead))
        is_fast, is_far = is_fast | (np.abs(turn_ahead) > pace), is_far | (span_ahead > leg.reach)
    fast, far = np.flatnonzero(is_fast), np.flatnonzero(is_far)
    then = fast + 1
    gradient = [
        -slope[fast] * by_hips[fast],
        -slope[fast] * by_foot[fast],
        slope[then] * by_hips[then],
        slope[then] * by_foot[then],
    ]
    return [
        _Equations(
            np.stack([hips[fast], hips[fast] + number, hips[then], hips[then] + number]),
            np.stack(gradient),
            (limit - turn)[fast],
            weight,
        ),
        _Equations(
            np.stack([hips[far], hips[far] + number]),
            np.stack([by_hips[far], by_foot[far]]) / leg_length,
            (leg.reach[far] - span[far]) / leg_length,
            OUT_OF_REACH * weight,
        ),
    ]


def _hip_to_ankle(change: Array, number: int, leg: PacedLeg) -> tuple[Array, Array]:
    """From the ankle to the hip (F, 3), and how far the foot is then from the hip (F,) [m]."""
    axis = leg.hip + change[:, :1] * (0.0, 0.0, 1.0) - leg.ankle
    return axis, np.linalg.norm(axis, axis=1) - change[:, number]


def _small_and_smooth(change: Array, legs: Sequence[PacedLeg], bends: float, leg_length: float) -> list[_Equations]:
    """What is asked of the corrections: to be small and smooth, and none of feet that stand or would be underground."""
    count, width = change.shape
    found = []
    for number in range(width):
        own, cost = np.arange(count) * width + number, FOOT_FREEDOM if number else 1.0
        size = change[:, number] / leg_length
        stencil = bends * np.array([1.0, -2.0, 1.0])[:, None] * np.ones(max(count - 2, 0)) / leg_length
        found.append(_Equations(np.stack([own[:-2], own[1:-1], own[2:]]), stencil, -bends * np.diff(size, 2), cost))
        found.append(_pulled(own, -size, MAGNITUDE * cost, leg_length))
        beyond = np.abs(size) > LARGEST
        found.append(_pulled(own[beyond], np.sign(size[beyond]) * LARGEST - size[beyond], _TOO_LARGE, leg_length))
        if number:
            leg = legs[number - 1]
            found.append(_pulled(own[leg.stands], -size[leg.stands], _HELD, leg_length))
            low = ~leg.stands & (change[:, number] < -leg.room)
            found.append(_pulled(own[low], -leg.room[low] / leg_length - size[low], _UNDERGROUND, leg_length))
    return found


def _pulled(unknowns: NDArray[np.intp], wanted: Array, weight: float, leg_length: float) -> _Equations:
    """Single corrections that should change by so many leg lengths."""
    return _Equations(unknowns[None], np.full((1, len(unknowns)), 1.0 / leg_length), wanted, weight)
