"""Feet that neither slide, float nor sink on a hard floor: the composer of locked feet, hips and legs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ground.heightfield import Terrain
from ..motion.motion import CharacterMotion
from ..numerics.rigid import carried
from ..numerics.slices import Slices, sliced
from ..record.ground_history import GroundHistory
from .foot_lock import lock, moved, rim, slides, underside_on
from .foot_placement import Placement, place_sole, posed_points
from .grounding import HIPS_TIME, Response, hips_go_along, leg_soles, settle, with_sole

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
def clean(motion: CharacterMotion, touching: Mask, terrain: Terrain) -> Slices[Response]:
    """What makes the feet stand where their contacts say that they stand.

    Parameters
    ----------
    motion : CharacterMotion
        The source, at scene frames.
    touching : (F, S) bool array
    terrain : Terrain
        The floor.
    """
    floor = GroundHistory(terrain)
    placements: dict[str, tuple[int, Placement]] = {}
    offsets = []
    for side, number in leg_soles(motion).items():
        touches = touching[:, number]
        yield
        first = place_sole(motion, number, touches, floor, floor)
        yield
        locked = first.carry
        for _ in range(LOCK_PASSES):
            lying = moved(motion.soles[number], locked)
            locked = lock(underside_on(lying, floor, motion.frames), touches) @ locked
        held = moved(motion.soles[number], locked)
        placed = place_sole(
            with_sole(motion, number, held),
            number,
            touches,
            floor,
            floor,
            align=0.0,
            points=posed_points(held, rim(held.sole)),
        )
        lift = first.lift + placed.lift
        placements[side] = number, Placement(placed.carry @ locked, lift, np.zeros_like(lift), placed.room)
        carry = placements[side][1].carry
        ankle = motion.joints[f"ankle_{side}"]
        offsets.append((carried(carry, ankle) - ankle)[:, :2])
    yield
    soles = [number for number, _ in placements.values()]
    level = hips_go_along(motion, soles, offsets, touching, HIPS_TIME)
    upright = np.zeros((len(motion.frames), 2))
    return (yield from settle.slices(motion, placements, touching, upright, level=level, source_pace=True))


@sliced
def foot_faults(motion: CharacterMotion, touching: Mask, terrain: Terrain) -> Slices[FootFaults]:
    """How far the legs' soles slide, float and sink while they touch, by all points of their rims."""
    floor = GroundHistory(terrain)
    slid, gaps, frames = [np.zeros(0)], [np.zeros(0)], [np.zeros(0)]
    for number in leg_soles(motion).values():
        yield
        sole, touches = motion.soles[number], touching[:, number]
        under = underside_on(sole, floor, motion.frames)
        slid.append(slides(under, touches))
        lowest = under.lowest()
        gaps.append(lowest[touches & np.isfinite(lowest)])
        frames.append(motion.frames[touches & np.isfinite(lowest)])
    gap = np.concatenate(gaps)
    return FootFaults(np.concatenate(slid), np.maximum(gap, 0.0), np.maximum(-gap, 0.0), np.concatenate(frames))
