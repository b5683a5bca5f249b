"""Limit of the knees' speed: hips and swinging feet give way a little, smoothly, where a knee would turn too fast.

A leg that is nearly straight turns its knee by tens of degrees for a centimetre of hip or foot. Where the response
would ask that of it, the hips and the feet in the air share the least and smoothest correction that keeps the pace: a
least-squares problem over time, solved by Gauss-Newton steps (Nocedal and Wright 2006, "Numerical Optimization",
chapters 10 and 17: quadratic penalties that grow, with a line search; a step that helps one knee and harms another is
taken again with both in view). Where no knee is too fast and every ankle is in reach, nothing is corrected.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Mask
from ..numerics.banded import solve_banded
from ..numerics.slices import Slices, sliced
from .legs import Leg

_FRAME = 1 / 30
"""The time that the pace of a knee refers to [s]."""
KNEE_PACE = np.radians(13.0) / _FRAME
"""Largest speed of a knee [rad/s], for an adult, or that of the source where it is larger."""
WADING_PACE = 2.0
"""How many times faster knees may turn in deep ground: a foot falls into it and is pulled out of it."""
SOURCE_WINDOW = 0.05
"""Time around an instant in which the source's own pace counts [s], for an adult."""
NEARLY_STRAIGHT = np.radians(8.0)
"""Least flexion at which the turn of a knee over its span is computed [rad]: it has no bound at 0."""

# A correction x(t), in leg lengths, costs cost·(T²·x'')² + MAGNITUDE·x² at each sample; the rest is weighed against it.
SMOOTHING_TIME = 0.08
"""T, the time over which a correction comes and goes [s], for an adult."""
MAGNITUDE = 0.1
HIPS_SMOOTHING_TIME = 0.2
"""T of hips that follow feet, which pay (T³·x''')² + (x - wanted)² [s], for an adult: less than it shakes them."""
FOOT_FREEDOM = 0.3
"""The cost of a correction of a foot beside one of the hips."""
LARGEST = 0.12
"""Corrections beyond this cost far more, in leg lengths: rather a fast knee than a body that drops."""
_TOO_LARGE = 30.0
_UNDERGROUND = 1e3
"""Weight of a foot that would come lower than the ground."""
_HELD = 1e6
"""Weight of a foot that stands."""
TOO_FAST = 300.0
"""Final weight of a knee that turns too far in `_FRAME` [rad]; the steps begin at a hundredth of it."""
OUT_OF_REACH = 1e3
"""Cost of an ankle out of reach over that of a knee that is too fast, per leg length and radian."""
STEPS = 14
FIRM = 1000.0
"""Factor of the cost where no knee may turn faster than the fastest of the source."""
FURTHER_STEPS = 24
"""Additional steps for this."""
_PARTS = (1.0, 0.5, 0.25, 0.1, 0.03, 0.01)
"""Parts of a step that are tried until one of them is better: nearly straight knees are far from linear."""


@dataclass(frozen=True)
class PacedLeg:
    """One leg as the response would have it.

    Attributes
    ----------
    hip, ankle : (F, 3) float arrays
        Where they would go [m].
    reach : (F,) float array
        Largest distance of the ankle from the hip [m].
    stands : (F,) bool array
        When its foot is on the ground and cannot give way.
    room : (F,) float array
        Height of its foot above the ground [m].
    """

    source: Leg
    hip: Array
    ankle: Array
    reach: Array
    stands: Mask
    room: Array


@dataclass(frozen=True)
class Relief:
    """Corrections that keep the knees' pace.

    Attributes
    ----------
    hips : (F, 3) float array
        Movement of the hips [m].
    feet : mapping of str to (F,) float array
        Movement of each foot toward its hip, by side, 0 while it stands [m].
    """

    hips: Array
    feet: Mapping[str, Array]


@dataclass(frozen=True)
class _Hips:
    """Freedom of the hips and the cost of its use.

    Attributes
    ----------
    axes : (H, 3) float array
        Directions in which they may move.
    wanted : (F, H) float array
        Their movement without constraints [m].
    order : int
        Order of the derivative of their movement that is to be small.
    smoothing : float
        Cost of this derivative, beside `magnitude`, that of the deviation: see `SMOOTHING_TIME`.
    """

    axes: Array
    wanted: Array
    order: int
    smoothing: float
    magnitude: float


@sliced
def relieve(
    legs: Mapping[str, PacedLeg],
    *,
    step: float,
    time_scale: float,
    leg_length: float,
    wading: Array | float = 0.0,
) -> Slices[Relief]:
    """The least and smoothest correction with which no knee turns too fast.

    Parameters
    ----------
    legs : mapping of str to PacedLeg
        By side; at least one.
    step : float
        Time between samples [s].
    time_scale : float
        Duration of the motion over that of an adult.
    leg_length : float [m]
    wading : (F,) float array or 0
        How much the body wades at each sample, 0 to 1.
    """
    up, count = np.array([[0.0, 0.0, 1.0]]), len(next(iter(legs.values())).stands)
    hips = _Hips(up, np.zeros((count, 1)), 2, (SMOOTHING_TIME * time_scale / step) ** 2, MAGNITUDE)
    pace = KNEE_PACE * (1.0 + (WADING_PACE - 1.0) * np.broadcast_to(wading, count)[1:])
    paces = [_allowed_turn(leg, pace, step, time_scale) for leg in legs.values()]
    weights = np.geomspace(TOO_FAST / 100.0, TOO_FAST, STEPS)
    return (yield from _relieved(legs, hips, paces, weights, step, time_scale, leg_length))


@sliced
def follow(
    legs: Mapping[str, PacedLeg], wanted: Array, *, step: float, time_scale: float, leg_length: float
) -> Slices[Relief]:
    """Hips that follow feet with the least jerk, while every ankle that stands is in reach.

    No knee turns faster than the fastest of the source. See `relieve`.

    Parameters
    ----------
    wanted : (F, 3) float array
        Movement of the hips that follows the feet [m].
    """
    smoothing = (HIPS_SMOOTHING_TIME * time_scale / step) ** 3
    hips = _Hips(np.eye(3), wanted, 3, smoothing, 1.0)
    fastest = max(float(np.abs(np.diff(leg.source.flexion)).max(initial=0.0)) for leg in legs.values())
    paces = [np.full(len(wanted) - 1, fastest) for _ in legs]
    weights = np.geomspace(TOO_FAST / 100.0, FIRM * TOO_FAST, STEPS + FURTHER_STEPS)
    return (yield from _relieved(legs, hips, paces, weights, step, time_scale, leg_length))


def _relieved(
    legs: Mapping[str, PacedLeg],
    hips: _Hips,
    paces: Sequence[Array],
    weights: Array,
    step: float,
    time_scale: float,
    leg_length: float,
) -> Generator[None, None, Relief]:
    """See `relieve`; constraints of knees and legs get weights that grow."""
    paced, axes = list(legs.values()), len(hips.axes)
    bends = (SMOOTHING_TIME * time_scale / step) ** 2
    per_frame = _FRAME * time_scale / step
    change = np.concatenate([hips.wanted, np.zeros((len(hips.wanted), len(paced)))], axis=1)

    def violated(change: Array, weight: float, ahead: Array | None = None) -> list[_Equations]:
        equations = []
        for number, (leg, pace) in enumerate(zip(paced, paces, strict=True), start=axes):
            equations += _pace_and_reach(change, number, leg, hips, pace, leg_length, weight * per_frame**2, ahead)
        return equations

    def proper(change: Array) -> list[_Equations]:
        return _small_and_smooth(change, paced, hips, bends, leg_length)

    def largest_better(toward: Array, weight: float, cost: float) -> float:
        for parts in (_PARTS[:1], _PARTS[1:]):  # those after the first, which is often taken, all at once
            tried = change + np.multiply.outer(parts, toward)
            is_better = _cost(violated(tried, weight) + proper(tried)) < cost
            if is_better.any():
                return parts[int(np.argmax(is_better))]
        return 0.0

    if hips.wanted.any():
        change = change + _solution(proper(change), change)
    if any(np.any(each.weight) for each in violated(change, 1.0)):
        for weight in weights:
            yield
            costs, asked = proper(change), violated(change, weight)
            cost = float(_cost(asked + costs))
            toward = _solution(asked + costs, change)
            part = largest_better(toward, weight, cost)
            if not part:
                toward = _solution(violated(change, weight, change + toward) + costs, change)
                part = largest_better(toward, weight, cost)
            change = change + part * toward
    feet = {side: change[:, number] for number, side in enumerate(legs, start=axes)}
    return Relief(change[:, :axes] @ hips.axes, feet)


@dataclass(frozen=True)
class _Equations:
    """Weighted linear equations of a step, or of several that are compared (...): one for each of R samples.

    Attributes
    ----------
    unknowns : sequence of T ints
        Unknowns of the first equation, ascending; those of the next lie one sample later.
    gradient : (..., T, R) float array
    wanted : (..., R) float array
        Remaining value of each, of any size where it does not count.
    weight : (..., R) float array
        0 where an equation does not count.
    """

    unknowns: Sequence[int]
    gradient: Array
    wanted: Array
    weight: Array

    @property
    def remaining(self) -> Array:
        """What is wanted where it counts, 0 elsewhere: feet over no ground have infinite room."""
        return np.where(self.weight, self.wanted, 0.0)


def _solution(equations: Sequence[_Equations], change: Array) -> Array:
    """Least-squares step from a correction."""
    count, width = change.shape
    apart = max(each.unknowns[-1] - each.unknowns[0] for each in equations)
    band, right = np.zeros((max(apart, 1) + 1, count * width)), np.zeros(count * width)
    for each in equations:
        weighted, rows = each.weight * each.gradient, each.wanted.shape[-1]
        for i, column in enumerate(each.unknowns):
            columns = slice(column, column + rows * width, width)
            right[columns] += weighted[i] * each.remaining
            for j in range(i, len(each.unknowns)):
                band[each.unknowns[j] - column, columns] += weighted[i] * each.gradient[j]
    return solve_banded(band, right[:, None]).reshape(change.shape)


def _cost(equations: Sequence[_Equations]) -> Array:
    return np.sum([np.sum(each.weight * each.remaining**2, axis=-1) for each in equations], axis=0)


def _allowed_turn(leg: PacedLeg, pace: Array, step: float, time_scale: float) -> Array:
    """Largest turn of a knee from each sample to the next, (F - 1,) [rad], at a pace [rad/s] or the source's."""
    source = np.abs(np.diff(leg.source.flexion))
    reach = max(1, round(SOURCE_WINDOW * time_scale / step))
    around = np.lib.stride_tricks.sliding_window_view(np.pad(source, reach, mode="edge"), 2 * reach + 1).max(axis=1)
    return np.maximum(pace * step / time_scale, around)


def _pace_and_reach(
    change: Array,
    number: int,
    leg: PacedLeg,
    hips: _Hips,
    pace: Array,
    leg_length: float,
    weight: float,
    ahead: Array | None = None,
) -> list[_Equations]:
    """Constraints of a leg where its knee turns too fast or its ankle is out of reach: with a correction (..., F, U),
    or also with another, `ahead`."""
    width = change.shape[-1]
    axis, span = _hip_to_ankle(change, number, leg, hips)
    by_hips = (axis / np.maximum(np.linalg.norm(axis, axis=-1, keepdims=True), 1e-9)) @ hips.axes.T
    by_foot = np.broadcast_to(np.where(leg.stands, 0.0, -1.0)[:, None], (*span.shape, 1))
    by = np.moveaxis(np.concatenate([by_hips, by_foot], axis=-1), -1, -2)
    unknowns = [*range(len(hips.axes)), number]
    flexion, slope = leg.source.flexion_at(span, NEARLY_STRAIGHT)
    turn = np.diff(flexion)
    limit, is_far = np.clip(turn, -pace, pace), span > leg.reach
    is_fast = np.abs(turn) > pace
    if ahead is not None:
        span_ahead = _hip_to_ankle(ahead, number, leg, hips)[1]
        turn_ahead = np.diff(leg.source.flexion_at(span_ahead)[0])
        limit = np.where(is_fast, limit, np.copysign(pace, turn_ahead))
        is_fast, is_far = is_fast | (np.abs(turn_ahead) > pace), is_far | (span_ahead > leg.reach)
    slope = slope[..., None, :]
    return [
        _Equations(
            [*unknowns, *(width + unknown for unknown in unknowns)],
            np.concatenate([-slope[..., :-1] * by[..., :-1], slope[..., 1:] * by[..., 1:]], axis=-2),
            limit - turn,
            weight * is_fast,
        ),
        _Equations(unknowns, by / leg_length, (leg.reach - span) / leg_length, OUT_OF_REACH * weight * is_far),
    ]


def _hip_to_ankle(change: Array, number: int, leg: PacedLeg, hips: _Hips) -> tuple[Array, Array]:
    """Vectors from the ankle to the hip (..., F, 3), and their lengths less the movement of the foot (..., F) [m]."""
    axis = leg.hip + change[..., : len(hips.axes)] @ hips.axes - leg.ankle
    return axis, np.linalg.norm(axis, axis=-1) - change[..., number]


def _small_and_smooth(
    change: Array, legs: Sequence[PacedLeg], hips: _Hips, bends: float, leg_length: float
) -> list[_Equations]:
    """Equations that keep corrections (..., F, U) small and smooth, and zero for feet that stand or would be
    underground."""
    count, width = change.shape[-2:]
    axes, terms = len(hips.axes), []
    for number in range(width):
        moved = change[..., number] / leg_length
        if number < axes:
            size, cost = moved - hips.wanted[:, number] / leg_length, 1.0
            order, smoothing, magnitude = hips.order, hips.smoothing, hips.magnitude
        else:
            size, cost = moved, FOOT_FREEDOM
            order, smoothing, magnitude = 2, bends, MAGNITUDE
        stencil = smoothing * np.diff(np.eye(order + 1), order, axis=0).T * np.ones(max(count - order, 0))
        samples = [number + width * i for i in range(order + 1)]
        rough = smoothing * np.diff(moved, order)
        terms.append(_Equations(samples, stencil / leg_length, -rough, np.full(rough.shape[-1], cost)))
        terms.append(_pulled(number, -size, np.full(count, magnitude * cost), leg_length))
        beyond = np.clip(size, -LARGEST, LARGEST) - size
        terms.append(_pulled(number, beyond, _TOO_LARGE * (beyond != 0.0), leg_length))
        if number >= axes:
            leg = legs[number - axes]
            room = leg.room / leg_length
            terms.append(_pulled(number, -size, _HELD * leg.stands, leg_length))
            terms.append(_pulled(number, -room - size, _UNDERGROUND * (~leg.stands & (size < -room)), leg_length))
    return terms


def _pulled(unknown: int, wanted: Array, weight: Array, leg_length: float) -> _Equations:
    """Single corrections that should change by so many leg lengths."""
    return _Equations([unknown], np.full((1, wanted.shape[-1]), 1.0 / leg_length), wanted, weight)
