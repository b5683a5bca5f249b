"""The phases of each contact, from touching down to leaving, as the motion shows them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from ..loads import contacts, estimate
from ..motion import sole_motion
from ..numerics.arrays import Array
from ..numerics.intervals import runs

Kind = Literal["heel_strike", "foot_flat", "heel_off", "toe_off", "slide_start", "slide_end", "scuff", "land", "wade"]
KINDS: tuple[Kind, ...] = get_args(Kind)

FLAT = float(np.sin(np.radians(5.0)))
"""A foot is flat while heel and ball are level to this slope."""
LOADED = 0.03
"""A sole stands while it carries at least this: of an adult's weight, the 20 N from which on force plates count."""
TOGETHER = 0.05
"""Soles that come down within this time of each other, out of flight, land from a jump [s, of an adult]."""
FLIGHT = 0.1
"""Shortest time off the ground that is a flight [s, of an adult]."""
SHORTEST_SLIDE = 0.04
"""A sole that moves for less than this has not slid [s, of an adult]."""
LEAVING = 0.06
"""Within this time of touching down and of leaving, a foot that moves lands or rolls off [s, of an adult]."""
SCUFF_HEIGHT = 0.003
"""A swinging foot that comes this near to the ground brushes it, in leg lengths."""
SCUFF_SPEED = 0.3
"""It must swing at least this fast, in sqrt(gravity·leg length)."""
SCUFF_APART = 0.08
"""Least time from touching down and from leaving [s, of an adult]."""
APPROACH = 0.03
"""The landing speed is the largest within this time before the contact [s, of an adult]."""


@dataclass(frozen=True)
class Phase:
    """One phase of a contact.

    Attributes
    ----------
    kind : str
        Event at its begin; `toe_off`, `slide_end` and `scuff` are moments that end their phase.
    sole : int
        Number of the character's sole.
    at : int
        Step of the loads at which it happens, or has just happened.
    moment : float
        When it happens, in steps and their fractions.
    first, last : int
        Steps of the phase, from first to before last.
    hard : bool
        True of a contact with hard ground, which takes no print.
    """

    kind: Kind
    sole: int
    at: int
    moment: float
    first: int
    last: int
    hard: bool = False


def phases(loads: estimate.CharacterLoads) -> list[Phase]:
    """All phases of a character's contacts, in the order of time.

    A contact that has begun before the loads has no landing, and one that goes on after them no leaving.
    """
    soles = range(len(loads.motion.soles))
    unsorted = [phase for sole in soles for phase in (*_of_contacts(loads, sole), *_of_scuffs(loads, sole))]
    return sorted(unsorted, key=lambda phase: (phase.moment, phase.sole))


def normal_force(loads: estimate.CharacterLoads, sole: int) -> Array:
    """Force of the ground on a sole along its normal, (N,) [N]."""
    along = np.einsum("ni,ni->n", loads.forces.forces[:, sole], loads.contacts.normal[:, sole])
    return np.asarray(np.maximum(along, 0.0))


def slide_speed(loads: estimate.CharacterLoads, sole: int) -> Array:
    """Speed along the ground of a sole's slowest point, (N,) [m/s]: 0 of one that rolls from heel to toe."""
    motion, normal = loads.motion.soles[sole], loads.contacts.normal[:, sole]
    if len(motion.transforms) < 2:
        return np.zeros(len(motion.transforms))
    velocity = _velocities(loads, sole)
    along = velocity - np.einsum("nli,ni->nl", velocity, normal)[..., None] * normal[:, None]
    return np.asarray(np.linalg.norm(along, axis=2).min(axis=1))


def landing_speed(loads: estimate.CharacterLoads, sole: int, at: int) -> float:
    """Speed into the ground of a sole's first touching point, shortly before a step [m/s]."""
    before = max(1, round(APPROACH * loads.motion.time_scale / loads.motion.time_step))
    steps = slice(max(0, at - before), at + 1)
    points = _points(loads.motion.soles[sole], steps) @ loads.contacts.normal[at, sole]
    if len(points) < 2:
        return 0.0
    return float(max(0.0, -np.diff(points[:, points[-1].argmin()]).min() / loads.motion.time_step))


def place_of(loads: estimate.CharacterLoads, sole: int, at: int) -> Array:
    """The lowest point of a sole at a step, where it would be without the source's float or sink, (3,) [m]."""
    points, normal = _points(loads.motion.soles[sole], slice(at, at + 1))[0], loads.contacts.normal[at, sole]
    lowest: Array = points[(points @ normal).argmin()] - loads.contacts.offset[sole] * normal
    return lowest


def sole_points_at(loads: estimate.CharacterLoads, sole: int, steps: NDArray[np.intp]) -> tuple[Array, Array]:
    """Tracked points of a sole at K steps, and their velocities there: (K, L, 3) [m] and [m/s]."""
    first = np.clip(steps, 0, max(0, len(loads.motion.frames) - 2))
    motion = loads.motion.soles[sole]
    now, later = (_places(motion, at) for at in (first, np.minimum(first + 1, len(loads.motion.frames) - 1)))
    lift = loads.contacts.offset[sole] * loads.contacts.normal[first, sole]
    return now - lift[:, None], (later - now) / loads.motion.time_step


def sole_velocity(loads: estimate.CharacterLoads, sole: int, step: int) -> Array:
    """Velocity of the middle of a sole after a step, (3,) [m/s]."""
    return np.asarray(sole_points_at(loads, sole, np.array([step]))[1][0].mean(axis=0))


def _places(motion: sole_motion.SoleMotion, steps: NDArray[np.intp]) -> Array:
    """Matter of a sole at steps, (K, L, 3) [m]: a foot's landmarks; of a prop, points of its surface."""
    if motion.sole.prop is None:
        return motion.landmark_positions()[steps]
    pose, probes = motion.transforms[steps, 0], motion.sole.prop.probes[:: max(1, len(motion.sole.prop.probes) // 16)]
    return np.asarray(np.einsum("kij,lj->kli", pose[:, :3, :3], probes) + pose[:, None, :3, 3])


def is_foot(motion: sole_motion.SoleMotion) -> bool:
    """True if a sole has a heel and a ball to roll over."""
    return motion.sole.prop is None and len(motion.sole.landmarks) > 1


def _points(motion: sole_motion.SoleMotion, steps: slice) -> Array:
    """Tracked points of a sole, (N, L, 3) [m]: a foot's landmarks; the lowest point of a prop."""
    if motion.sole.prop is None:
        return motion.landmark_positions()[steps]
    pose, probes = motion.transforms[steps, 0], motion.sole.prop.probes
    lowest = probes[(pose[:, 2, :3] @ probes.T).argmin(axis=1)]
    return np.asarray(np.einsum("nij,nj->ni", pose[:, :3, :3], lowest) + pose[:, :3, 3])[:, None]


def _velocities(loads: estimate.CharacterLoads, sole: int) -> Array:
    """Velocities of the matter at `_points`, (N, L, 3) [m/s]."""
    motion, step = loads.motion.soles[sole], loads.motion.time_step
    if motion.sole.prop is None:
        return np.asarray(np.gradient(motion.landmark_positions(), step, axis=0))
    pose, probes = motion.transforms[:, 0], motion.sole.prop.probes
    lowest = probes[(pose[:, 2, :3] @ probes.T).argmin(axis=1)]
    change = np.gradient(pose, step, axis=0)
    return np.asarray(np.einsum("nij,nj->ni", change[:, :3, :3], lowest) + change[:, :3, 3])[:, None]


def _of_contacts(loads: estimate.CharacterLoads, sole: int) -> Iterator[Phase]:
    touching, hard = loads.contacts.standing[:, sole], loads.contacts.hard
    speed, force = slide_speed(loads, sole), normal_force(loads, sole)
    least = LOADED * loads.motion.mass * loads.motion.gravity
    for touched, lifted in zip(*(ends.tolist() for ends in runs(touching)), strict=True):
        loaded = touched + np.flatnonzero(force[touched:lifted] > least)
        if not len(loaded):
            continue
        begin, stop = int(loaded[0]), int(loaded[-1]) + 1
        landed, leaves, on_hard = begin > 0, stop < len(touching), hard is not None and bool(hard[begin, sole])
        marks = [(begin, _landing(loads, sole, begin))] if landed else []
        if is_foot(loads.motion.soles[sole]):
            marks += _rolling(loads, sole, begin, stop)
        ends = [*(at for at, _ in marks[1:]), stop]
        for (at, kind), end in zip(marks, ends, strict=False):
            yield Phase(kind, sole, at, _crossing(force, at, least) if at == begin else at, at, end, on_hard)
        if leaves:
            lifted_at = _crossing(force, stop, least)
            yield Phase("toe_off", sole, stop, lifted_at, marks[-1][0] if marks else begin, stop, on_hard)
        yield from (replace(slide, hard=on_hard) for slide in _slides(loads, sole, speed, begin, stop))


def _crossing(force: Array, step: int, level: float) -> float:
    """Moment between the step before and this one at which a force crosses a level."""
    before, after = force[step - 1], force[step]
    return step - 1 + float((level - before) / (after - before)) if before != after else float(step)


def _landing(loads: estimate.CharacterLoads, sole: int, begin: int) -> Kind:
    """Kind of a contact's begin: a foot that walks or runs strikes; both feet out of a jump, and all else, land."""
    if not is_foot(loads.motion.soles[sole]):
        return "land"
    touching, scale = loads.contacts.standing, loads.motion.time_scale / loads.motion.time_step
    near, flight = round(TOGETHER * scale), round(FLIGHT * scale)
    others = np.delete(touching, sole, axis=1)
    start = max(0, begin - near)
    in_flight = begin - near - flight >= 0 and not touching[begin - near - flight : start].any()
    together = others[start : begin + near + 1].any()
    return "land" if in_flight and together else "heel_strike"


def _rolling(loads: estimate.CharacterLoads, sole: int, begin: int, stop: int) -> list[tuple[int, Kind]]:
    """Steps at which a foot gets flat and its heel leaves, if both happen within the contact."""
    motion = loads.motion.soles[sole]
    points = motion.landmark_positions()[begin:stop]
    heel, ball = points[:, 0], points[:, 1 if points.shape[1] > 2 else -1]
    length = max(float(np.linalg.norm(motion.sole.landmarks[0] - motion.sole.landmarks[1])), 1e-6)
    lean = np.einsum("ni,ni->n", heel - ball, loads.contacts.normal[begin:stop, sole]) / length
    flat = np.flatnonzero(np.abs(lean) < FLAT)
    if not len(flat):
        return []
    rolling: list[tuple[int, Kind]] = []
    if flat[0] > 0:
        rolling.append((begin + int(flat[0]), "foot_flat"))
    if flat[-1] + 1 < len(lean) and lean[flat[-1] + 1] > 0:
        rolling.append((begin + int(flat[-1]) + 1, "heel_off"))
    return rolling


def _slides(loads: estimate.CharacterLoads, sole: int, speed: Array, begin: int, stop: int) -> Iterator[Phase]:
    """Slides of a standing sole: faster than rest allows, and not as it lands or leaves."""
    scale = loads.motion.time_scale / loads.motion.time_step
    sliding = speed[begin:stop] > contacts.REST_SPEED * loads.motion.froude_speed
    edge = round(LEAVING * scale) if is_foot(loads.motion.soles[sole]) else 0
    for first, last in zip(*(ends.tolist() for ends in runs(sliding)), strict=True):
        if min(last, stop - begin - edge) - max(first, edge) >= SHORTEST_SLIDE * scale:
            span = begin + first, begin + last
            yield Phase("slide_start", sole, span[0], span[0], *span)
            if begin + last < len(speed):
                yield Phase("slide_end", sole, span[1], span[1], *span)


def _of_scuffs(loads: estimate.CharacterLoads, sole: int) -> Iterator[Phase]:
    """Scuffs: a swinging foot brushes the ground."""
    motion = loads.motion
    if not is_foot(motion.soles[sole]):
        return
    clearance, speed = loads.contacts.clearance[:, sole], slide_speed(loads, sole)
    apart = round(SCUFF_APART * motion.time_scale / motion.time_step)
    low = clearance < SCUFF_HEIGHT * motion.leg_length
    swinging = ~loads.contacts.standing[:, sole]
    low &= swinging & (speed > SCUFF_SPEED * motion.froude_speed)
    for first, last in zip(*(ends.tolist() for ends in runs(swinging)), strict=True):
        inner = slice(first + apart, max(first + apart, last - apart))
        for begin, stop in zip(*(ends.tolist() for ends in runs(low[inner])), strict=True):
            span = inner.start + begin, inner.start + stop
            at = span[0] + int(clearance[slice(*span)].argmin())
            yield Phase("scuff", sole, at, at, *span)
