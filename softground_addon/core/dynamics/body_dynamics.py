"""Forces on a body from its motion: their sum, and the point of the ground through which they act."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..motion.motion import CharacterMotion
from ..numerics.arrays import Array, Mask
from ..numerics.intervals import runs
from ..numerics.smoothing_spline import share_of_noise, smooth_path
from .centre_of_mass import MassPoints, fitted_to_free_fall, mass_points

CUTOFF = 16.0
"""Cut-off of the low-pass in pendulum frequencies sqrt(gravity/leg length)/(2·pi): 8 Hz for an adult, as is usual for
gait (Winter 2009, "Biomechanics and Motor Control of Human Movement", chapter 3: 6 Hz and more). It holds where the
motion itself does not tell better."""
FIRST_PASS = 0.9
"""Trunk, head and arms pass the low-pass twice, for the flesh on them follows the bones slowly; the legs, which bring
the impacts, once. Cut-off of the pass that is not for the legs, in that of the body, ..."""
LAST_PASS = 1.12
"""... and of the one for all."""
BOTH_PASSES = 0.85
"""Where the two together pass half of the amplitude, in the same unit."""
LAG = 0.007
"""How long the flesh of trunk, head and arms comes after their joints in motions with flights, in times of the leg's
pendulum: 2 ms."""
SLOW_CUTOFF = 4.0
"""Cut-off that shows how a body leans while it stands, in the same unit (2 Hz)."""
CUTOFF_RANGE = 2.0
"""How far the motion may move the cut-off from there, down or up [octaves]."""
CUTOFF_DEVIATION = 0.35
"""Standard deviation of the cut-off that suits a motion with flights about the usual one [octaves]."""
CUTOFF_STEP = 0.25
"""Steps of the search for it [octaves]."""
HIGHEST_CUTOFF = 0.34
"""Highest cut-off as a fraction of the scene's frame rate: 8 Hz at 24 fps."""
FREE_FALL = 0.5
"""A body that nothing touches is in flight when its motion asks for less than this on average, in body weights.
Otherwise it hangs or flies by other means, and its motion says nothing about free fall."""
LIGHT = 0.2
"""Below this total force the point of action is not known, in body weights."""
TRUE_FALL = 0.2
"""A flight whose fall differs from gravity by less shows the error of the body's mass, not another time scale."""
RATES_OF_FALL = (0.05, 3.0)
"""Slowest and fastest fall that is taken for a flight, in gravities: slow motion by 4 falls at 1/16."""
EVEN_FALL = 0.35
"""A body falls evenly, and so in slow motion, where its acceleration varies by less than this part of itself."""
STANDING = 0.2
"""A sole stands while the body moves on over it: one of its points moves by less than this part of the body's way."""
MOST_ROUNDS = 12
"""Rounds in which a body comes to fall freely where it would be pulled down."""
MOST_PULLED = 0.2
"""A body that would fall for more than this share of the time that it touches bobs higher than it could: its bobbing
is taken for lower, ..."""
LOWER_BOB = 1.25
"""... by so much at a time."""
STEADY_ENDS = 0.01
"""How much a force of 1 body weight is expected at both ends of the action, where half of the evidence is missing."""


@dataclass(frozen=True)
class BodyDynamics:
    """Motion of the body as a whole at each step.

    Attributes
    ----------
    centre : (N, 3) float array
        Centre of mass [m].
    force : (N, 3) float array
        Force that the motion asks for, per weight [body weights].
    moment : (N, 3) float array
        Rate of the angular momentum about the centre of mass, per weight [m].
    points : MassPoints
        The body that this holds for, at the scene frames among the steps.
    cutoff : float
        Cut-off of the low-pass that suits the motion [Hz].
    slow : BodyDynamics, optional
        What remains of it at `SLOW_CUTOFF`.
    """

    centre: Array
    force: Array
    moment: Array
    points: MassPoints
    cutoff: float
    slow: BodyDynamics | None = None

    def point_of_action(self, ground: Array, steps: slice | NDArray[np.intp] = slice(None)) -> Array:
        """Zero moment point: where the total force meets the level `ground` (...,) [m] at steps (...,).

        Where the force is too small to have one, the projection of the centre of mass.

        Returns
        -------
        (..., 2) float array [m]
        """
        centre, force, moment = self.centre[steps], self.force[steps], self.moment[steps]
        up = np.maximum(force[..., 2], LIGHT)
        height = centre[..., 2] - ground
        x = centre[..., 0] - (height * force[..., 0] + moment[..., 1]) / up
        y = centre[..., 1] - (height * force[..., 1] - moment[..., 0]) / up
        known = force[..., 2, None] > LIGHT
        return np.where(known, np.stack([x, y], axis=-1), centre[..., :2])


def body_dynamics(motion: CharacterMotion, airborne: Mask | None = None, *, cutoff_factor: float = 1.0) -> BodyDynamics:
    """Forces that the motion asks for, so far as it goes without knowing that they are 0 in flight.

    Parameters
    ----------
    motion : CharacterMotion
        On the simulation's time grid.
    airborne : (N,) bool array, optional
        Steps at which nothing seems to touch. Where they are flights and tell that contacts are brief, the cut-off is
        raised to suit them.
    cutoff_factor : float
        Of the cut-off found: what another choice would give.
    """
    sampled, frame_step = motion.on_frames, motion.frame_step
    points = mass_points(motion.at_frames())
    usual = _usual_cutoff(motion)
    turning = _angular_momentum(points, frame_step)

    def smoothed(cutoff: float) -> BodyDynamics:
        path = np.zeros((len(sampled), 6))
        path[sampled] = _calmed(points, turning, frame_step, cutoff)
        smooth, rate, acceleration = smooth_path(
            path, motion.time_step, _last_pass(points, cutoff, frame_step), sampled=sampled, steady_ends=STEADY_ENDS
        )
        force = acceleration[:, 3:] / motion.fall + motion.upward(smooth[:, 3:], rate[:, 3:])
        return BodyDynamics(smooth[:, 3:], force, rate[:, :3] / motion.fall, points, cutoff)

    body = smoothed(_cutoff_by_noise(points.centre, frame_step, usual))
    flying = flights(airborne, body, motion) if airborne is not None else np.zeros(0, dtype=bool)
    if flying.any():
        fall = _rate_of_fall(motion, body, flying)
        cutoff = max(_cutoff_in_flight(motion, body, flying, fall, roughly=True), usual)
        body = smoothed(cutoff) if cutoff > body.cutoff else body
    if cutoff_factor != 1:
        body = smoothed(body.cutoff * cutoff_factor)
    slow = smoothed(min(SLOW_CUTOFF / (2 * np.pi * motion.pendulum_time), body.cutoff))
    return dataclasses.replace(body, slow=slow)


def with_flight(
    motion: CharacterMotion, body: BodyDynamics, airborne: Mask, *, cutoff_factor: float = 1.0
) -> BodyDynamics:
    """The same dynamics with the knowledge that nothing touches at the steps `airborne` (N,), and nothing ever pulls.

    In flight the force is 0: the body's mass is fitted to that, and the low-pass is the one that shows it best. Where
    the motion is nowhere near free fall while nothing touches, it stays as it was.

    A body on its feet that the motion asks to be pulled down, as when it bobs too fast by hand, falls freely there too:
    cutting the force off instead would leave it more than its weight on average. Where it would fall for most of its
    stances, and strike like a hammer between, it bobs less.
    """
    flying = flights(airborne, body, motion)
    pulled = ~airborne & (body.force[:, 2] < 0)
    if not (flying.any() or pulled.any()):
        return body
    points, level, cutoff, fall = body.points, body.points, body.cutoff, motion.fall
    if flying.any():
        points, level, cutoff, fall = _falling_freely(motion, body, flying)
        cutoff *= cutoff_factor
    sampled, low_pass = motion.on_frames, _last_pass(points, cutoff, motion.frame_step)
    path = np.zeros((len(sampled), 3))
    lag = LAG * motion.pendulum_time if flying.any() else 0.0
    path[sampled] = _calmed(points, points.centre[:, :0], motion.frame_step, cutoff, lag=lag, level=level)
    acted = fall
    while True:
        # What pulls is fallen through until nothing pulls: Newton's method on a penalty for pulling alone.
        for _ in range(MOST_ROUNDS):
            falling = _inner(flying) | pulled
            centre, velocity, acceleration = smooth_path(
                path, motion.time_step, low_pass, sampled=sampled, falling=falling, fall=fall, steady_ends=STEADY_ENDS
            )
            force = acceleration / fall + motion.upward(centre, velocity)
            pulling = ~airborne & (force[:, 2] < 0)
            if (pulling == pulled).all():
                break
            pulled = pulling
        if pulled.sum() <= MOST_PULLED * (~airborne).sum() or fall >= RATES_OF_FALL[1] * motion.fall:
            break
        fall *= LOWER_BOB
    centre[:, 2] += (acted / fall - 1) * (centre[:, 2] - centre[:, 2].mean())
    # A force that steps at the edges of a flight is between its values there: that impulse is the stance's.
    first, last = runs(~flying)
    impulse = _sums(force[:, 2], first, last)
    whole = _sums(force[:, 2], np.maximum(first - 1, 0), np.minimum(last + 1, len(force)))
    gain = np.divide(whole, impulse, out=np.ones(len(first)), where=impulse > 0)
    force[~flying] *= np.repeat(gain, last - first)[:, None]
    force[flying | pulled] = 0.0
    return dataclasses.replace(body, centre=centre, force=force, points=points, cutoff=cutoff)


def _calmed(
    points: MassPoints,
    others: Array,
    step: float,
    cutoff: float,
    *,
    lag: float = 0.0,
    level: MassPoints | None = None,
) -> Array:
    """The columns `others` (F, C), and the centre of mass (F, 3) with its trunk low-passed once: (F, C + 3).

    The trunk comes later by `lag` [s]. Along the ground the body is `level`, if that is another.

    Where nothing shows what the legs do, all is as it was.
    """
    centre, legs = points.centre, points.legs_moment()
    if level is not None and level is not points:
        centre, legs = centre.copy(), legs.copy()
        centre[:, :2], legs[:, :2] = level.centre[:, :2], level.legs_moment()[:, :2]
    path = np.concatenate([others, centre - legs], axis=1)
    if points.legs.any():
        path, rate, _ = smooth_path(path, step, min(FIRST_PASS * cutoff, HIGHEST_CUTOFF / step))
        path[:, -3:] -= lag * rate[:, -3:]
    path[:, -3:] += legs
    return path


def _last_pass(points: MassPoints, cutoff: float, frame_step: float) -> float:
    """Cut-off of the pass of the whole body to cut at `cutoff` [Hz]: the only one where nothing shows the legs."""
    return min(LAST_PASS * cutoff, HIGHEST_CUTOFF / frame_step) if points.legs.any() else cutoff


def _usual_cutoff(motion: CharacterMotion) -> float:
    """Cut-off for a body of this size at this frame rate [Hz]."""
    return min(CUTOFF / (2 * np.pi * motion.pendulum_time), HIGHEST_CUTOFF / motion.frame_step)


def _cutoff_in_flight(
    motion: CharacterMotion, body: BodyDynamics, flying: Mask, fall: float, *, roughly: bool = False
) -> float:
    """The cut-off [Hz] with which the body comes nearest to falling by `fall` [m/s²] in flight.

    `roughly`, all parts pass once, and the steps of the search are twice as long.

    One too low lets the forces of the stance before and after leak into the flight, one too high lets noise and the
    shaking of soft tissue through: both show as a force where there is none.
    """
    step, usual, legs = motion.frame_step, _usual_cutoff(motion), body.points.legs_of_parts()
    parts, flying = body.points.part_centres(), flying[motion.on_frames]
    highest = np.log2(max(HIGHEST_CUTOFF / (step * usual), 1.0))
    passes = [(~legs, BOTH_PASSES), (legs, LAST_PASS)] if legs.any() and not roughly else [(slice(None), 1.0)]

    @cache
    def misfit(octaves: float) -> float:
        cutoff = usual * 2.0**octaves
        falling = np.zeros((flying.sum(), *parts.shape[1:]))
        for part, factor in passes:
            falling[:, part] = _accelerations(parts[:, part], step, factor * cutoff)[flying]
        _, _, misfit = fitted_to_free_fall(body.points, falling, fall, independent=_independent(motion), whole=False)
        return misfit + (octaves / CUTOFF_DEVIATION) ** 2

    start = np.log2(body.cutoff / usual)
    stride = 2 * CUTOFF_STEP if roughly else CUTOFF_STEP
    best = _downhill(misfit, start, stride, (-CUTOFF_RANGE, min(highest, CUTOFF_RANGE)))
    return float(usual * 2.0**best)


def _falling_freely(
    motion: CharacterMotion, body: BodyDynamics, flying: Mask
) -> tuple[MassPoints, MassPoints, float, float]:
    """The body and the cut-off [Hz] with which it comes nearest to free fall in flight, and how its joints fall [m/s²].

    There are two bodies. Up and down, flesh moves less than joints: where only a part of the body moves with them, they
    fall faster than it. Along the ground nothing tells that part, and what is second is the body all of which does.
    """
    fall = _rate_of_fall(motion, body, flying)
    cutoff = _cutoff_in_flight(motion, body, flying, fall)
    # What leaks into the flight differs with the cut-off: fractions that are to tell masses are of parts treated alike.
    falling = _accelerations(body.points.part_centres(), motion.frame_step, cutoff)[flying[motion.on_frames]]
    independent = _independent(motion)
    points, moving, _ = fitted_to_free_fall(body.points, falling, fall, independent=independent, whole=False)
    level, _, _ = fitted_to_free_fall(body.points, falling, fall, independent=independent)
    return points, level, cutoff, fall / moving


def _accelerations(parts: Array, step: float, cutoff: float) -> Array:
    """Those of some points (F, P, 3), low-passed [m/s²]."""
    _, _, acceleration = smooth_path(parts.reshape(len(parts), -1), step, min(cutoff, HIGHEST_CUTOFF / step))
    return acceleration.reshape(parts.shape)


def _independent(motion: CharacterMotion) -> float:
    """Share of the low-passed frames that tell something new."""
    return min(2 * _usual_cutoff(motion) * motion.frame_step, 1.0)


def _cutoff_by_noise(path: Array, step: float, usual: float) -> float:
    """Cut-off that predicts each sample best from the others [Hz]: the usual one, lower for noise.

    Generalised cross-validation (Craven and Wahba 1979, "Smoothing noisy data with spline functions").
    """

    @cache
    def score(octaves: float) -> float:
        cutoff = usual * 2.0**octaves
        smooth, _, _ = smooth_path(path, step, cutoff)
        return float(((smooth - path) ** 2).sum()) / (1 - share_of_noise(cutoff * step)) ** 2

    return float(usual * 2.0 ** _downhill(score, 0.0, CUTOFF_STEP, (-CUTOFF_RANGE, 0.0)))


def _downhill(score: Callable[[float], float], start: float, stride: float, limits: tuple[float, float]) -> float:
    """Minimum of a function with one valley: from `start` on by strides, then on the parabola through three."""
    low, high = limits
    best = start
    for further in (stride, -stride):
        while low <= best + further <= high and score(best + further) < score(best):
            best += further
    if low <= best - stride and best + stride <= high:
        below, here, above = (score(best + offset) for offset in (-stride, 0.0, stride))
        curvature = below - 2 * here + above
        best += stride * (below - above) / (2 * curvature) if curvature > 0 else 0.0
    return best


def flights(airborne: Mask, body: BodyDynamics, motion: CharacterMotion) -> Mask:
    """Those of the stretches without contact `airborne` (N,) in which the body falls.

    Either it asks for little force, or it falls slowly but evenly, as in slow motion. A body borne by feet that float
    does neither, but for one that walks: over a foot it falls as evenly, and that foot stays where it is.
    """
    flying = airborne.copy()
    edge, fall = _leak(body, motion.time_step), 1 - body.force[:, 2]
    first, last = runs(airborne)
    free = _sums(fall, first, last) > (1 - FREE_FALL) * (last - first)
    long = last - first > 3 * edge
    begin, end = np.where(long, first + edge, first), np.where(long, last - edge, last)
    mean, square = (_sums(values, begin, end) / (end - begin) for values in (fall, fall**2))
    even = long & (mean > RATES_OF_FALL[0]) & (square - mean**2 < (EVEN_FALL * mean) ** 2)
    slow = np.flatnonzero(even & ~free)
    even[slow] = ~_walks_over(motion, first[slow], last[slow] - 1)
    flying[airborne] = np.repeat(free | even, last - first)
    return flying


def _walks_over(motion: CharacterMotion, first: NDArray[np.intp], last: NDArray[np.intp]) -> Mask:
    """True if the body moves on from step `first` to `last` (I,) while a point of a sole hardly does, (I,)."""
    if not len(first):
        return np.zeros(0, dtype=bool)
    hips = motion.hips
    travelled = np.linalg.norm((hips[last] - hips[first])[:, :2], axis=1)
    points = [sole.landmark_positions() for sole in motion.soles]
    moved = np.stack([np.linalg.norm(path[last] - path[first], axis=-1).min(axis=1) for path in points], axis=1)
    return np.asarray(moved.min(axis=1) < STANDING * travelled)


def _sums(values: Array, first: NDArray[np.intp], last: NDArray[np.intp]) -> Array:
    """Sums of values (N,) over the intervals (I,) from `first` to before `last`, (I,)."""
    total: Array = np.append(0.0, np.cumsum(values))
    return total[last] - total[first]


def _leak(body: BodyDynamics, step: float) -> int:
    """Steps over which the force of a stance leaks into the flight beside it."""
    return max(1, round(0.25 / (body.cutoff * step)))


def _rate_of_fall(motion: CharacterMotion, body: BodyDynamics, flying: Mask) -> float:
    """Acceleration of the body in flight [m/s²]: gravity, unless the animation's time or size is another.

    A jump made by hand, retimed or put on a larger rig hangs in the air or drops like a stone. Its forces are those
    of the same motion at the time scale at which it falls with gravity.
    """
    edge, gravity = _leak(body, motion.time_step), motion.fall
    window = np.lib.stride_tricks.sliding_window_view(np.pad(flying, edge, mode="edge"), 2 * edge + 1)
    inner = 1 - body.force[window.all(axis=1), 2]
    if not len(inner):
        return gravity
    ratio = float(np.clip(np.median(inner), *RATES_OF_FALL))
    return ratio * gravity if abs(ratio - 1) > TRUE_FALL else gravity


def _angular_momentum(points: MassPoints, step: float) -> Array:
    """Angular momentum of the point masses about their centre, per body mass, (N, 3) [m²/s]."""
    if len(points.positions) < 2:
        return np.zeros((len(points.positions), 3))
    x, y, z = arm = (points.positions - points.centre[:, None]).transpose(2, 0, 1)
    u, v, w = np.gradient(arm, step, axis=1)
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u]).dot(points.fractions).T


def _inner(state: Mask) -> Mask:
    """Steps whose neighbours are in the same state."""
    return state & np.append(state[1:], state[-1:]) & np.append(state[:1], state[:-1])
