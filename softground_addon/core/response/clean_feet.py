"""Feet that neither slide, float nor sink on a hard floor: the composer of locked feet, hips and legs."""

from __future__ import annotations

from collections.abc import Sequence
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
from .grounding import HIPS_TIME, Response, hips_go_along, leg_soles, settle, with_sole
from .sole_rim import posed_rim

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

LOCK_PASSES = 2
"""Times that a foot is locked: on relief, other points bear at the place that the lock before has moved it to."""


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
    floor, frames = GroundHistory(terrain), motion.frames
    placements: dict[str, tuple[int, Placement]] = {}
    offsets = []
    if stands is None:
        stands = yield from standing.slices(motion, touching, terrain, holds)
    for side, number in leg_soles(motion).items():
        sole, touches = motion.soles[number], touching[:, number]
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
        carry, lift = contacts.faded(sole, placed.carry @ locked, first.lift + placed.lift)
        placements[side] = number, Placement(carry, lift, np.zeros_like(lift), placed.room)
        ankle = motion.joints[f"ankle_{side}"]
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
