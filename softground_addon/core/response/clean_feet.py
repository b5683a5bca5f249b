"""Feet that neither slide, float nor sink on a hard floor: the composer of locked feet, hips and legs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ground.heightfield import Terrain
from ..motion.motion import CharacterMotion
from ..numerics.rigid import carried
from ..numerics.slices import Slices, sliced
from ..record.ground_history import GroundHistory
from .foot_holds import FootHold, HeldContacts
from .foot_lock import lock, moved, slides, travelling, underside_on
from .foot_placement import Placement, place_sole
from .grounding import HIPS_TIME, Response, has_ankle, hips_go_along, leg_of, leg_soles, settle, with_sole
from .sole_rim import posed_rim

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

LOCK_PASSES = 2
"""Times that a foot is locked: on relief, other points bear at the place that the lock before has moved it to."""
ONE_PIECE_PASSES = 16
"""Most times that feet of one piece with their shanks are put where they belong anew: as the knee bends, they tip, and
stand on other points."""
IN_PLACE = 1e-4
"""Feet that move less than this from one time to the next are where they belong, in leg lengths."""


@dataclass(frozen=True)
class FootFaults:
    """What a character's feet do on a hard floor while they stand that feet do not.

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


@sliced
def standing(motion: CharacterMotion, touching: Mask, terrain: Terrain, holds: Sequence[FootHold] = ()) -> Slices[Mask]:
    """When the legs' soles are to stand still, (F, S): while they touch and do not travel on purpose; see `clean`."""
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
    """What makes the feet stand where their contacts say that they stand.

    Parameters
    ----------
    motion : CharacterMotion
        The source, at scene frames.
    touching : (F, S) bool array
    terrain : Terrain
        The floor.
    holds : sequence of FootHold
        Contacts that are held in another way than by what bears.
    stands : (F, S) bool array, optional
        What `standing` tells of these, where it is known.
    """
    if stands is None:
        stands = yield from standing.slices(motion, touching, terrain, holds)
    response = yield from _cleaned.slices(motion, touching, terrain, holds, stands, {})
    middles = {side: leg_of(motion, side, sole).ankle for side, sole in leg_soles(motion).items()}
    of_one_piece = [side for side in middles if not has_ankle(motion, side)]
    for _ in range(ONE_PIECE_PASSES if of_one_piece else 0):
        so_far = {side: response.legs[side].foot for side in of_one_piece}
        response = yield from _cleaned.slices(motion, touching, terrain, holds, stands, so_far)
        moves = [
            carried(response.legs[side].foot, middles[side]) - carried(so_far[side], middles[side]) for side in so_far
        ]
        if np.abs(moves).max() < IN_PLACE * motion.leg_length:
            break
    return response


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
    offsets = []
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
        ankle = leg_of(motion, side, number).ankle
        lift = first.lift + placed.lift
        if side in so_far:
            lift = lift + (carried(start, ankle) - ankle)[:, 2]
        carry, lift = contacts.faded(source, placed.carry @ locked @ start, lift)
        placements[side] = number, Placement(carry, lift, np.zeros_like(lift), placed.room)
        offsets.append((carried(carry, ankle) - ankle)[:, :2])
    yield
    soles = [number for number, _ in placements.values()]
    level = hips_go_along(motion, soles, offsets, stands, HIPS_TIME)
    upright = np.zeros((len(motion.frames), 2))
    return (yield from settle.slices(motion, placements, touching, upright, level=level, source_pace=True))


def missed_holds(motion: CharacterMotion, touching: Mask, holds: Sequence[FootHold]) -> tuple[FootHold, ...]:
    """Those of some holds that hold nothing: no leg stands on such a foot, or it does not touch in that frame."""
    feet = {motion.soles[number].sole.name: touching[:, number] for number in leg_soles(motion).values()}
    found = [hold for hold in holds if hold.foot not in feet]
    for foot, touches in feet.items():
        found += HeldContacts.of(holds, foot, motion.frames, touches).missed
    return tuple(found)


@sliced
def foot_faults(
    motion: CharacterMotion, touching: Mask, terrain: Terrain, stands: Mask | None = None
) -> Slices[FootFaults]:
    """How far the legs' soles float and sink while they touch (F, S), and slide while they stand (F, S), by default all
    that time; by all points of their rims."""
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
