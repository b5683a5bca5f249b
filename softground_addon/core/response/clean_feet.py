"""Feet that neither slide, float nor sink on a hard floor: the composer of locked feet, hips and legs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..ground.heightfield import Terrain
from ..legs.foot_lock import lock, moved, slides, travelling, underside_on
from ..legs.foot_placement import Placement, place_sole
from ..legs.grounding import Response, leg_soles, stand, with_sole
from ..legs.one_piece import put_in_place
from ..legs.sole_rim import posed_rim
from ..loads.contacts import REST_SPEED
from ..motion.motion import CharacterMotion
from ..numerics.arrays import Array, Mask
from ..numerics.intervals import runs
from ..numerics.slices import Slices, sliced
from ..record.ground_history import GroundHistory
from .foot_holds import FootHold, HeldContacts

LOCK_PASSES = 2
"""Times that a foot is locked: on relief, other points bear at the place that the lock before has moved it to."""

RESTING = 0.5
"""Toes rest that are slower than this part of the body that goes on over them."""
RESTING_TIME = 0.1
"""Toes that rest no longer than this before or after a contact are landing or leaving [s], for an adult."""
HEEL_UP = 0.05
"""Toes rest while the heel is higher than they by more than this, in sole lengths."""
RESTING_HEIGHT = 0.1
"""Toes rest no higher above where the foot stands, in leg lengths: in captures, bodies bounce with their feet."""


@dataclass(frozen=True)
class FootFaults:
    """Faults of a character's feet that stand on a hard floor: slide, float, penetration.

    Attributes
    ----------
    slide : (N,) float array
        Distance of each point that bears from where it first bore, at each of its frames [m].
    float_, penetration : (K,) float arrays
        Height of the sole's lowest point above and below the floor [m].
    frames : (K,) float array
        Scene frames of those.
    """

    slide: Array
    float_: Array
    penetration: Array
    frames: Array


def resting(motion: CharacterMotion, touching: Mask, terrain: Terrain) -> Mask:
    """Contacts (F, S), with the time in which toes rest while the foot floats higher than feet do that touch.

    Where a network has made the motion, it takes feet off the floor as their heels rise. The body goes on over them.
    """
    window = max(1, round(RESTING_TIME / 2 * motion.adult_second))
    body = _level_speed(motion.hips, window)
    goes_on, rests = body > REST_SPEED * motion.froude_speed * motion.time_step, touching.copy()
    for number in leg_soles(motion).values():
        points, touches = motion.soles[number].landmark_positions(), touching[:, number]
        height = points[..., 2] - terrain.heights(points[..., 0], points[..., 1])
        lowest = np.where(np.isfinite(height), height, np.inf).min(axis=1)
        low = lowest < np.median(lowest[touches]) + RESTING_HEIGHT * motion.leg_length if touches.any() else touches
        toes_slow = _level_speed(points[:, -1], window) < RESTING * body
        heel_up = height[:, 0] - height[:, -1] > HEEL_UP * motion.soles[number].sole.length
        still = touches | (low & goes_on & toes_slow & heel_up)
        for first, end in zip(*runs(still), strict=True):
            for start, stop in zip(*runs(~touches[first:end]), strict=True):
                rests[first + start : first + stop, number] = 2 * window < stop - start < end - first
    return rests


def _level_speed(path: Array, window: int) -> Array:
    """Level speed (F,) of a path (F, 3) [m per sample], from `window` samples before to as many after."""
    now = np.arange(len(path))
    before, after = np.maximum(now - window, 0), np.minimum(now + window, len(path) - 1)
    return np.asarray(np.linalg.norm((path[after] - path[before])[:, :2], axis=1) / np.maximum(after - before, 1))


@sliced
def standing(motion: CharacterMotion, touching: Mask, terrain: Terrain, holds: Sequence[FootHold] = ()) -> Slices[Mask]:
    """True while the legs' soles are to stand still, (F, S): they touch and do not travel on purpose; see `clean`."""
    floor, stands = GroundHistory(terrain), touching.copy()
    for number in leg_soles(motion).values():
        yield
        sole, touches = motion.soles[number], touching[:, number]
        travels = travelling(underside_on(sole, floor, motion.frames), touches, motion)
        stands[:, number] = HeldContacts.of(holds, sole.sole.name, motion.frames, touches).standing(travels)
    return stands


@sliced
def clean(
    motion: CharacterMotion,
    touching: Mask,
    terrain: Terrain,
    holds: Sequence[FootHold] = (),
    stands: Mask | None = None,
) -> Slices[Response]:
    """Response that makes the feet stand still during their contacts.

    Parameters
    ----------
    motion : CharacterMotion
        The source, at scene frames.
    touching : (F, S) bool array
    terrain : Terrain
        The floor.
    holds : sequence of FootHold
        Contacts that are held in another way than by their bearing points.
    stands : (F, S) bool array, optional
        Result of `standing` for these, if known.
    """
    if stands is None:
        stands = yield from standing.slices(motion, touching, terrain, holds)
    solve = partial(_cleaned.slices, motion, touching, terrain, holds, stands)
    return (yield from put_in_place.slices(motion, touching, solve))


@sliced
def _cleaned(
    motion: CharacterMotion,
    touching: Mask,
    terrain: Terrain,
    holds: Sequence[FootHold],
    stands: Mask,
    so_far: Mapping[str, Array],
) -> Slices[Response]:
    """See `clean`; feet start from where they are so far, (F, 4, 4) by side, or from the source."""
    floor, frames = GroundHistory(terrain), motion.frames
    placements: dict[str, tuple[int, Placement]] = {}
    for side, number in leg_soles(motion).items():
        source, touches = motion.soles[number], touching[:, number]
        start = so_far.get(side, np.eye(4))
        sole = moved(source, np.broadcast_to(start, (len(frames), 4, 4)))
        contacts = HeldContacts.of(holds, sole.sole.name, frames, touches)
        held = contacts.held(frames, stands[:, number])
        yield
        turned = contacts.attitude(sole, floor, frames, held)
        first = place_sole(with_sole(motion, number, moved(sole, turned)), number, touches, floor, floor)
        yield
        locked = first.carry @ turned
        for _ in range(LOCK_PASSES):
            lying = moved(sole, locked)
            under = underside_on(lying, floor, frames)
            locked = lock(under, held, contacts.bearing(under, lying)) @ locked
        lying = moved(sole, locked)
        placed = place_sole(
            with_sole(motion, number, lying),
            number,
            touches,
            floor,
            floor,
            align=0.0,
            points=posed_rim(lying),
        )
        carry = contacts.faded(source, placed.carry @ locked @ start)
        placements[side] = number, replace(placed, carry=carry)
    yield
    return (yield from stand.slices(motion, placements, touching, stands))


def missed_holds(motion: CharacterMotion, touching: Mask, holds: Sequence[FootHold]) -> tuple[FootHold, ...]:
    """Holds without effect: no leg stands on such a foot, or it does not touch in that frame."""
    feet = {motion.soles[number].sole.name: touching[:, number] for number in leg_soles(motion).values()}
    missed = [hold for hold in holds if hold.foot not in feet]
    for foot, touches in feet.items():
        missed += HeldContacts.of(holds, foot, motion.frames, touches).missed
    return tuple(missed)


@sliced
def foot_faults(
    motion: CharacterMotion, touching: Mask, terrain: Terrain, stands: Mask | None = None
) -> Slices[FootFaults]:
    """Distances that the legs' soles float and sink while they touch (F, S), and slide while they stand (F, S), by
    default all that time; by all points of their rims."""
    floor = GroundHistory(terrain)
    slid, gaps, frames = [np.zeros(0)], [np.zeros(0)], [np.zeros(0)]
    for number in leg_soles(motion).values():
        yield
        sole, touches = motion.soles[number], touching[:, number]
        under = underside_on(sole, floor, motion.frames)
        slid.append(slides(under, touches if stands is None else stands[:, number]))
        lowest = under.lowest()
        gaps.append(lowest[touches & np.isfinite(lowest)])
        frames.append(motion.frames[touches & np.isfinite(lowest)])
    gap = np.concatenate(gaps)
    return FootFaults(np.concatenate(slid), np.maximum(gap, 0.0), np.maximum(-gap, 0.0), np.concatenate(frames))
