"""Feet of one piece with their shanks, as of figures made of blocks: a leg that is solved tips them."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ..motion.motion import CharacterMotion
from ..numerics.arrays import Array, Mask
from ..numerics.orientation import rotation_vectors
from ..numerics.rigid import carried, displacement, rotation
from ..numerics.slices import Slices, sliced
from .foot_placement import between_contacts
from .grounding import Response, has_ankle, leg_of, leg_soles

PASSES = 32
"""Most times that such feet are put where they belong anew: as the knee bends, they tip, and stand on other points.
Each begins midway between where the last began and ended, as points take turns at bearing."""
IN_PLACE = 3e-4
"""Feet that move less than this from one time to the next are where they belong, in leg lengths."""


@sliced
def put_in_place(
    motion: CharacterMotion, touching: Mask, solve: Callable[[Mapping[str, Array]], Slices[Response]]
) -> Slices[Response]:
    """The response in which feet of one piece with their shanks stand where they belong; other feet do at once.

    Parameters
    ----------
    touching : (F, S) bool array
    solve : callable
        The response, from the displacements of feet so far (F, 4, 4), by side; feet without one start from the source.
    """
    response = yield from solve({})
    soles = {side: sole for side, sole in leg_soles(motion).items() if not has_ankle(motion, side)}
    touches = {side: touching[:, sole] for side, sole in soles.items() if touching[:, sole].any()}
    middles = {side: leg_of(motion, side, soles[side]).ankle for side in touches}
    so_far = {side: _eased(touches[side], middles[side], response.legs[side].foot) for side in touches}
    settled, least = response, np.inf
    for _ in range(PASSES if touches else 0):
        response = yield from solve(so_far)
        moves = [
            (carried(response.legs[side].foot, middles[side]) - carried(so_far[side], middles[side]))[touches[side]]
            for side in touches
        ]
        largest = max(float(np.abs(move).max()) for move in moves)
        settled, least = (response, largest) if largest < least else (settled, least)
        if largest < IN_PLACE * motion.leg_length:
            break
        so_far = {
            side: _eased(touches[side], middles[side], so_far[side], response.legs[side].foot) for side in touches
        }
    return settled


def _eased(touching: Mask, middle: Array, *carries: Array) -> Array:
    """The mean of displacements (F, 4, 4) of a foot with its middle at (F, 3) in its contacts, passing smoothly between
    them."""
    turns = np.mean([rotation_vectors(carry[:, :3, :3]) for carry in carries], axis=0)
    moves = np.mean([carried(carry, middle) - middle for carry in carries], axis=0)
    turns, moves = between_contacts(turns, touching), between_contacts(moves, touching)
    return displacement(rotation(turns), middle, middle + moves)
