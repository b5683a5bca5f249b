"""Contacts of a prop without a skeleton and what the ground does to it, from its mass and its motion.

A body in the air feels nothing. On the ground it feels its weight, and what changes its momentum: m·(g + a). What stops
a fall stops it within the ground's characteristic time, as in the paper (Eq. 8): animation and simulation stop it from
one frame to the next, which says nothing about how long the ground takes. So every change of velocity acts over that
time from when it is seen on, or over what is left of the contact; all momentum is kept and no frame rate shows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..dynamics.load_sharing import share_by_moment
from ..ground.heightfield import Terrain
from ..motion.motion import CharacterMotion
from ..motion.props import posed
from ..motion.sole_motion import SoleMotion
from ..numerics.arrays import Array, Mask
from ..numerics.interpolation import linear
from ..numerics.intervals import hysteresis, runs
from .clearances import ground_normal
from .contacts import Contacts
from .forces import UP, ContactForces

TOUCH_HEIGHT = 0.02
"""A body lower than this above its ground touches it, in its sizes."""
LEAVE_HEIGHT = 0.04
"""A touching body higher than this has left, in its sizes."""
FLOAT_LIMIT = 0.15
"""A body that is carried this near to its ground rests on it, and the rest is float or sink, in its sizes."""
FLOAT_PERCENTILE = 10.0
"""The clearance of a carried body that counts as float or sink."""
FALLING = 0.5
"""A body that is pushed up by less than this falls, in its weights."""
SHORTEST_CONTACT = 1 / 24
"""A contact lasts at least so long [s]: a bounce shows in one frame, however short."""
SLOPE_PROBE = 0.05
"""Half the distance over which the ground's slope is read, in sizes of the body."""
NEAR_LOWEST = 0.5
"""Points of a body that lie higher above its lowest one than this do not touch, in its sizes: those of a sphere on a
wall of 60° lie at 0.25 of its diameter."""
PRESSED = 0.01
"""Points this much higher than the lowest one count e times less for where a body touches, in its sizes."""
POINTS_AT_ONCE = 400_000
"""Points whose ground is looked up in one go, to bound memory."""


def free_loads(
    motion: CharacterMotion,
    terrain: Terrain,
    *,
    steps: int,
    characteristic_time: float,
    force_model: Literal["WHOLE_BODY", "IMPULSE"] = "WHOLE_BODY",
) -> tuple[CharacterMotion, Contacts, ContactForces]:
    """A body's motion, contacts and forces on the simulation's time grid.

    Parameters
    ----------
    motion : CharacterMotion
        At scene frames, with a `centre`; its soles are props.
    terrain : Terrain
        The undisturbed ground.
    steps : int
        Steps of the simulation in a frame.
    characteristic_time : float
        tau of the ground [s].
    force_model : 'WHOLE_BODY' or 'IMPULSE'
        The impulse model is the paper's: the weight, and m·v/tau for tau after each landing.

    Returns
    -------
    motion : CharacterMotion
        Resampled.
    contacts : Contacts
    forces : ContactForces
        0 where nothing touches. With the whole-body model, their impulse over a contact is the change of momentum
        from the speed of the fall to that of what follows, and the weight meanwhile.
    """
    assert motion.centre is not None, motion.name
    velocity = np.diff(motion.centre, axis=0) / motion.time_step  # between frame i and i + 1
    approaches = [_approach(sole, terrain) for sole in motion.soles]
    offset = np.array([_offset(approach, velocity, motion) for approach in approaches])
    normal = np.stack([approach.normal for approach in approaches], axis=1)
    clearance = np.stack([approach.clearance for approach in approaches], axis=1) - offset
    size = np.array([approach.size for approach in approaches])
    touching = hysteresis(clearance < TOUCH_HEIGHT * size, clearance > LEAVE_HEIGHT * size)
    touching |= _bounces(clearance, velocity, motion) & ~_with_neighbours(touching)
    seen = Contacts(touching, offset, normal, clearance)

    fine = motion.resampled(steps)
    frame_of = np.minimum(np.arange(len(fine.frames)) // steps, len(motion.frames) - 1)
    shortest = round(SHORTEST_CONTACT / fine.time_step)
    shown = touching[frame_of]
    for number in range(len(approaches)):
        for start in runs(shown[:, number])[0]:
            shown[start : start + shortest, number] = True
    pushed = _pushed(
        velocity,
        seen,
        motion,
        steps=steps,
        shortest=shortest,
        lasting=max(1, round(characteristic_time / fine.time_step)),
        landing_only=force_model == "IMPULSE",
    )
    assert fine.centre is not None
    upward = fine.upward(fine.centre, np.gradient(fine.centre, fine.time_step, axis=0)) if fine.ride else UP
    weight = motion.mass * motion.gravity * upward * shown.any(axis=1)[:, None]
    total = weight + motion.mass * pushed
    total[total[:, 2] <= 0] = 0.0
    along = np.arange(len(fine.frames)) / steps
    place = linear(np.stack([approach.place for approach in approaches], axis=1), along)
    share = share_by_moment(place[..., :2], linear(motion.centre, along)[:, :2], shown)
    forces = share[..., None] * total[:, None]
    carried = np.minimum(share * weight[:, 2:], forces[..., 2])
    return (
        fine,
        Contacts(shown, offset, normal[frame_of], clearance[frame_of]),
        ContactForces(forces, total, place, carried, forces[..., 2] - carried),
    )


def _pushed(
    velocity: Array,
    seen: Contacts,
    motion: CharacterMotion,
    *,
    steps: int,
    shortest: int,
    lasting: int,
    landing_only: bool,
) -> Array:
    """Acceleration of a body by the ground's push beyond its weight at each of N steps, (N, 3) [m/s²].

    Parameters
    ----------
    velocity : (F - 1, 3) float array
        Of the centre from each frame to the next [m/s].
    seen : Contacts
        At the frames.
    steps, shortest, lasting : int
        Steps in a frame, of the shortest contact, and over which a change of velocity acts.
    landing_only : bool
        Only what stops the fall, over that time even where the contact ends before.
    """
    pushed = np.zeros((len(velocity) * steps + 1, 3))
    for first, last in zip(*runs(seen.touching.any(axis=1)), strict=True):
        end = min(max(int(last) * steps, int(first) * steps + shortest), len(pushed))
        changes = _velocity_changes(velocity, seen, int(first), int(last), motion, landing_only=landing_only)
        for frame, change in changes.items():
            start = frame * steps
            over = lasting if landing_only else min(lasting, end - start)
            pushed[start : min(start + over, end)] += change * steps / (over * motion.time_step)
    return pushed


@dataclass(frozen=True)
class _Approach:
    """Place of a prop over its ground at each of F frames.

    Attributes
    ----------
    clearance : (F,) float array
        Height of its lowest point above the ground [m], infinite off the ground.
    place : (F, 3) float array
        Where it touches or would [m].
    normal : (F, 3) float array
        The ground's unit normal there, vertical where there is none.
    size : float [m]
    """

    clearance: Array
    place: Array
    normal: Array
    size: float


def _approach(sole: SoleMotion, terrain: Terrain) -> _Approach:
    prop = sole.sole.prop
    assert prop is not None, sole.sole.name
    probes, size = prop.probes, prop.size
    clearance, place = [], []
    at_once = max(1, POINTS_AT_ONCE // len(probes))
    for first in range(0, len(sole.transforms), at_once):
        points = posed(probes, sole.transforms[first : first + at_once, 0])
        height = np.full(points.shape[:2], np.inf)
        near = points[..., 2] < points[..., 2].min(axis=1, keepdims=True) + NEAR_LOWEST * size
        ground = terrain.heights(points[near][:, 0], points[near][:, 1])
        height[near] = np.where(np.isfinite(ground), points[near][:, 2] - ground, np.inf)
        lowest = height.min(axis=1)
        above = np.where(np.isfinite(height), height - np.where(np.isfinite(lowest), lowest, 0.0)[:, None], np.inf)
        nearness = np.exp(-above / (PRESSED * size))
        nearness[~np.isfinite(lowest)] = 1.0
        clearance.append(lowest)
        place.append(np.einsum("fq,fqi->fi", nearness, points) / nearness.sum(axis=1)[:, None])
    where = np.concatenate(place)
    normal = ground_normal(terrain, where[:, 0], where[:, 1], reach=SLOPE_PROBE * size)
    normal = np.where(np.isfinite(normal), normal, (0.0, 0.0, 1.0))
    return _Approach(np.concatenate(clearance), where, normal, size)


def _offset(approach: _Approach, velocity: Array, motion: CharacterMotion) -> float:
    """The clearance at which a body that is carried stands [m], 0 when it never does."""
    carried = np.zeros(len(approach.clearance), bool)
    if len(carried) > 2:
        excess = np.diff(velocity[:, 2]) / motion.time_step / motion.gravity
        carried[1:-1] = np.abs(excess) < FALLING
    standing = carried & (np.abs(approach.clearance) < FLOAT_LIMIT * approach.size)
    return float(np.percentile(approach.clearance[standing], FLOAT_PERCENTILE)) if standing.any() else 0.0


def _bounces(clearance: Array, velocity: Array, motion: CharacterMotion) -> Mask:
    """Frames at which the nearest sole hits the ground between two frames, (F, S)."""
    hits = np.zeros(clearance.shape, bool)
    if len(clearance) < 3:
        return hits
    before, after = velocity[:-1, 2], velocity[1:, 2]
    lowest = clearance[1:-1].min(axis=1)
    back = (before < 0) & (after > 0) & (after - before > 2 * motion.gravity * motion.time_step)
    reach = np.maximum(np.abs(before), np.abs(after)) * motion.time_step
    frame = 1 + np.flatnonzero(back & (lowest < reach))
    hits[frame, clearance[frame].argmin(axis=1)] = True
    return hits


def _with_neighbours(mask: Mask) -> Mask:
    """Frames (F, S) that are marked or next to one that is."""
    wider = mask.copy()
    wider[1:] |= mask[:-1]
    wider[:-1] |= mask[1:]
    return wider


def _velocity_changes(
    velocity: Array, seen: Contacts, first: int, last: int, motion: CharacterMotion, *, landing_only: bool
) -> dict[int, Array]:
    """Changes of velocity beyond gravity's during a contact from frame `first` to before `last`, by frame [m/s]."""
    changes: dict[int, Array] = {}
    if 0 < first < len(velocity):
        up = seen.normal[first, int(seen.clearance[first].argmin())]
        falling = _landing_velocity(velocity, first, up, float(seen.clearance[first - 1].min()), motion)
        changes[first] = -min(float(falling @ up), 0.0) * up if landing_only else velocity[first] - falling
    if not landing_only:
        for frame in range(first + 1, min(last, len(velocity))):
            changes[frame] = velocity[frame] - velocity[frame - 1]
    return changes


def _landing_velocity(velocity: Array, first: int, up: Array, height: float, motion: CharacterMotion) -> Array:
    """Velocity with which a body meets the ground between frame `first` - 1 and `first` (3,) [m/s].

    The mean over that frame is of a body that fell for a part of it and lay still for the rest; what it fell with is
    continued from the frames before.
    """
    step = motion.time_step
    mean: Array = velocity[first - 1]
    if first < 2:
        return mean
    pull = np.array([0.0, 0.0, -motion.gravity])
    if first > 2:
        pull = (velocity[first - 2] - velocity[first - 3]) / step
    start = velocity[first - 2] + pull * step / 2
    speed, faster = -float(start @ up), -float(pull @ up)
    # The time until it has fallen by `height`, at most until the frame is over.
    reached = speed**2 + 2 * faster * max(height, 0.0)
    whole = speed + np.sqrt(max(reached, 0.0))
    time = min(2 * max(height, 0.0) / whole, step) if whole > 0 else step
    landing: Array = start + pull * time
    return landing if landing @ up < mean @ up else mean
