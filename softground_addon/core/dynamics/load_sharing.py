"""Sharing of one load by several contacts: smooth transitions, and non-negative least squares on force and moment."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..motion.motion import CharacterMotion
from ..numerics.arrays import Array, Mask
from ..numerics.intervals import runs
from .body_dynamics import BodyDynamics

_EVENNESS = 1e-6
"""How much an even split counts: decides only where force and moment leave the shares open."""
_SUM_WEIGHT = 1e6
"""How much more the sum of the shares counts than their prior; the rest is normalised away."""
SHARE_DEVIATION = 1.0
"""Standard deviation of the share of a sole in the middle of its contact about an even split: not known at all."""
POINT_DEVIATION = 0.03
"""Standard deviation of the point of action of the total force at 1 body weight, in leg lengths. Where the
load passes from step to step it is known no better than it keeps between the sides of a sole that bears alone."""
ALONE = 0.5
"""A sole that bears alone tells that at loads above this, in body weights."""
EVEN_PART = 0.05
"""Part of a ramp that is even: plates show loads pass on more evenly than a cosine does."""
LONGEST_RAMP = 1.0
"""Longest time over which a sole takes its load, in sqrt(leg length/gravity) (0.3 s for an adult)."""
LONG_OVERLAP = 1.2
"""Soles that bear together for longer than this stand: the body sways over them slowly, and what seems to be faster is
error, in the same unit (0.36 s)."""


def whole_body_shares(motion: CharacterMotion, lowest: Array, touching: Mask, body: BodyDynamics) -> Array:
    """Each sole's share of the total force, from when it touches and from where the total force acts, (N, S).

    `lowest` is the motion's `lowest_points`.
    """
    point = point_of_action(motion, lowest, touching, body)
    known = np.full(len(point), POINT_DEVIATION * motion.leg_length)
    alone = motion.on_frames & (touching.sum(axis=1) == 1) & (body.force[:, 2] > ALONE)
    if alone.any():
        beside = _beside(motion, lowest, point, touching & alone[:, None])
        known[~_standing(motion, touching)] = np.hypot(known[0], np.sqrt((beside**2).mean()))
    return share_through_transitions(
        lowest[..., :2],
        point,
        touching,
        deviation=known / np.clip(body.force[:, 2], 0.1, 1.0),
        longest=max(1, round(LONGEST_RAMP * motion.pendulum_time / motion.time_step)),
    )


def point_of_action(motion: CharacterMotion, lowest: Array, touching: Mask, body: BodyDynamics) -> Array:
    """Point where the total force meets the level of the soles that touch, (N, 2) [m]."""
    count = touching.sum(axis=1)
    ground = np.einsum("ns,ns->n", lowest[..., 2], touching) / np.maximum(count, 1)
    point = body.point_of_action(ground)
    standing = np.flatnonzero(_standing(motion, touching))
    if body.slow and len(standing):
        point[standing] = body.slow.point_of_action(ground[standing], standing)
    return point


def _standing(motion: CharacterMotion, touching: Mask) -> Mask:
    """Steps at which soles bear together for longer than `LONG_OVERLAP`, (N,)."""
    standing = np.zeros(len(touching), dtype=bool)
    for first, last in zip(*runs(touching.sum(axis=1) > 1), strict=True):
        standing[first:last] = last - first > LONG_OVERLAP * motion.pendulum_time / motion.time_step
    return standing


def _beside(motion: CharacterMotion, lowest: Array, point: Array, bearing: Mask) -> Array:
    """Distance of a point (N, 2) beside each sole while it bears (N, S), one sole after the other (B,) [m]."""
    distances = []
    for index, sole in enumerate(motion.soles):
        steps = bearing[:, index]
        points = sole.landmark_positions()[steps]
        (x, y), (u, v) = (points[:, -1, :2] - points[:, 0, :2]).T, (point[steps] - lowest[steps, index, :2]).T
        distances.append((x * v - y * u) / np.maximum(np.hypot(x, y), 1e-9))
    return np.concatenate(distances)


def share_by_moment(points: Array, target: Array, touching: Mask) -> Array:
    """Shares of a unit load whose moment about `target` is least.

    For two contacts this is the corrected Eq. 5 of the paper (docs/model.md section 2, 1): the place of the target's
    projection on the segment between them, clipped to it, and one half each where they coincide.

    Parameters
    ----------
    points : (N, S, 2) float array
        Contact points on the ground plane [m].
    target : (N, 2) float array
        Where the load's line of action meets that plane, e.g. the projection of the centre of mass [m].
    touching : (N, S) bool array

    Returns
    -------
    (N, S) float array, not negative; rows sum to 1, or are 0 where nothing touches.
    """
    arm = np.where(touching[..., None], points - target[:, None, :], 0.0)
    scale = (arm**2).sum(axis=(1, 2)) / np.maximum(touching.sum(axis=1), 1)
    gram = arm @ np.swapaxes(arm, 1, 2) / np.where(scale > 0, scale, 1.0)[:, None, None]
    gram += _EVENNESS * np.eye(touching.shape[1])
    # Shares that sum to 1 and minimise share·gram·share are, up to their sum, those that minimise
    # share·gram·share/2 - sum(share): the constraint's multiplier only scales them.
    right = np.ones(touching.shape)
    return _normalised(solve_non_negative(gram, right, touching))


def share_through_transitions(points: Array, target: Array, touching: Mask, *, deviation: Array, longest: int) -> Array:
    """Shares that pass smoothly from sole to sole and agree with the moment as well as it is known.

    Each sole takes its load over a cosine ramp while others that were there before it still touch, and gives it up
    likewise (Ren et al. 2008, "Whole body inverse dynamics over a complete gait cycle based only on measured
    kinematics", the smooth transition assumption). Within a ramp and on several soles that stand, the shares follow
    the moment: the closer the ramp is to its end, the less.

    Parameters
    ----------
    points, target, touching
        As for `share_by_moment`.
    deviation : (N,) float array
        How well `target` is known, standard deviation [m].
    longest : int
        Longest ramp [steps].

    Returns
    -------
    (N, S) float array, not negative; rows sum to 1, or are 0 where nothing touches. Continuous in time while
    something touches.
    """
    share = touching.astype(float)
    several = touching.sum(axis=1) > 1
    readiness, touching = _ramps(touching, longest)[several], touching[several]
    prior = _normalised(readiness)
    variance = (SHARE_DEVIATION * np.maximum(readiness, 1e-3)) ** 2
    arm = np.where(touching[..., None], points[several] - target[several, None], 0.0) / deviation[several, None, None]
    gram = arm @ np.swapaxes(arm, 1, 2) + _SUM_WEIGHT
    gram += np.eye(touching.shape[1]) / variance[:, None, :]
    right = prior / variance + _SUM_WEIGHT
    share[several] = _normalised(solve_non_negative(gram, right, touching))
    return share


def _ramps(touching: Mask, longest: int) -> Array:
    """Nearness of each contact to its ends: 0 at an end that others bridge, 1 away from it, (N, S).

    A ramp lasts while the others bear too, and no longer than they bear without this sole: two feet that land just
    after one another do not hand over for long.
    """
    count, soles = touching.shape
    ramps = touching.astype(float)
    contacts = [np.stack(runs(touching[:, sole])) for sole in range(soles)]
    for sole, (first, last) in enumerate(contacts):
        start, end = np.concatenate([np.zeros((2, 0), int), *contacts[:sole], *contacts[sole + 1 :]], axis=1)
        # What stands at an end of the motion has stood, or will stand, for long.
        rises = _ramp_lengths(first, last, np.where(start > 0, start, -np.inf), end)
        falls = _ramp_lengths(-last[::-1], -first[::-1], np.where(end < count, -end, -np.inf), -start)[::-1]
        for begin, stop, rise, fall in zip(first, last, rises, falls, strict=True):
            most = min(stop - begin, longest)
            if begin > 0 and np.isfinite(rise):
                ramp = _cosine_ramp(int(min(rise, most)))
                ramps[begin : begin + len(ramp), sole] *= ramp
            if stop < count and np.isfinite(fall):
                ramp = _cosine_ramp(int(min(fall, most)))
                ramps[stop - len(ramp) : stop, sole] *= ramp[::-1]
    return ramps


def _ramp_lengths(first: NDArray[np.intp], last: NDArray[np.intp], start: Array, end: NDArray[np.intp]) -> Array:
    """Longest ramps [steps] at which a sole's contacts (I,) may begin while others (J,) bear; infinite beside none."""
    bridging = _within(first, start, end)
    together = np.where(bridging, end, np.inf).min(axis=1, initial=np.inf) - first
    before = np.maximum(np.where(bridging, start, np.inf).min(axis=1, initial=np.inf), np.append(-np.inf, last[:-1]))
    return np.where(bridging.any(axis=1), np.minimum(together, first - before), np.inf)


def _within(step: NDArray[np.intp], start: Array, end: NDArray[np.intp]) -> Mask:
    """Mask of the steps (I,) inside the intervals (J,), (I, J)."""
    return (start < step[:, None]) & (step[:, None] < end)


@cache
def _cosine_ramp(length: int) -> Array:
    """A ramp from 0 to 1, at the middles of so many steps."""
    phase = (np.arange(length) + 0.5) / length
    return EVEN_PART * phase + (1 - EVEN_PART) * (0.5 - 0.5 * np.cos(np.pi * phase))


def _normalised(shares: Array) -> Array:
    total = shares.sum(axis=1, keepdims=True)
    return np.divide(shares, total, out=np.zeros_like(shares), where=total > 0)


def solve_non_negative(gram: Array, right: Array, free: Mask) -> Array:
    """Minimise x·gram·x/2 - right·x over x >= 0, for many small problems at once.

    Block principal pivoting (Kim and Park 2011, "Fast nonnegative matrix factorization: an active-set-like method",
    SIAM J. Sci. Comput. 33(6)); single pivots after S rounds, so that it ends.

    Parameters
    ----------
    gram : (N, S, S) float array
        Symmetric, positive definite.
    right : (N, S) float array
    free : (N, S) bool array
        Unknowns that may differ from 0.

    Returns
    -------
    (N, S) float array
    """
    count = free.shape[1]
    passive = free.copy()
    identity = np.eye(count)
    tolerance = 1e-12 * np.abs(right).max(initial=1.0)
    solution = np.zeros(free.shape)
    for attempt in range(4 * count + 4):
        system = np.where(passive[:, :, None] & passive[:, None, :], gram, identity)
        solution = np.linalg.solve(system, np.where(passive, right, 0.0)[..., None])[..., 0]
        gradient = np.einsum("nij,nj->ni", gram, solution) - right
        wrong = free & np.where(passive, solution < 0, gradient < -tolerance)
        if not wrong.any():
            break
        if attempt >= count:
            wrong &= np.cumsum(wrong[:, ::-1], axis=1)[:, ::-1] == 1
        passive ^= wrong
    return np.where(free, np.maximum(solution, 0.0), 0.0)
