"""Several soft grounds of a shot: each contact is on the one that most of the sole is over."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..ground.hard_ground import SeveralGrounds, up_to
from ..motion.sole_motion import SoleMotion
from ..numerics.arrays import Array
from ..numerics.interpolation import in_stretches
from ..numerics.intervals import runs
from .contacts import LEAVE_HEIGHT, TOUCH_HEIGHT
from .estimate import CharacterLoads
from .missing_ground import spots

NO_GROUND = -1


def loads_on(loads: CharacterLoads, on: NDArray[np.intp], number: int) -> CharacterLoads:
    """The loads of a character on one of several grounds, where its contacts are `on` them as `grounds_under` says."""
    contacts = loads.contacts
    elsewhere = contacts.touching & (on != number)
    touching, clearance = contacts.touching & ~elsewhere, np.where(elsewhere, np.inf, contacts.clearance)
    return replace(loads, contacts=replace(contacts, touching=touching, clearance=clearance))


def grounds_under(loads: CharacterLoads, grounds: SeveralGrounds) -> NDArray[np.intp]:
    """Number of the ground under each touching sole at each step, (N, S); `NO_GROUND` where none touches.

    A contact is all of it on one ground, but for soles that slide or roll: these may change with each of their lengths.
    """
    motion, contacts = loads.motion, loads.contacts
    on = np.full(contacts.touching.shape, NO_GROUND)
    for index, sole in enumerate(motion.soles):
        level = float(contacts.offset[index]) + TOUCH_HEIGHT * motion.leg_length
        middle = sole.landmark_positions().mean(axis=1)[:, :2]
        way = np.linalg.norm(np.diff(middle, axis=0, prepend=middle[:1]), axis=1).cumsum() / max(sole.sole.length, 1e-9)
        for first, last in zip(*runs(contacts.touching[:, index]), strict=True):
            cuts = first + 1 + np.flatnonzero(np.diff(np.floor(way[first:last] - way[first])))
            for start, end in zip((first, *cuts), (*cuts, last), strict=True):
                votes = _votes(sole, np.arange(start, end), grounds, level, LEAVE_HEIGHT * motion.leg_length)
                before = on[start - 1, index] if start > first else 0
                on[start:end, index] = votes.argmax() if votes.any() else before
    return on


def _votes(
    sole: SoleMotion, steps: NDArray[np.intp], grounds: SeveralGrounds, level: float, limit: float
) -> NDArray[np.intp]:
    """Spots of a sole over each ground, at most at a level above it, and no further below than a limit [m], (G,)."""

    def numbers(part: slice) -> Array:
        x, y, z = np.moveaxis(spots(sole, steps[part], axes=3), -1, 0)
        under = up_to(grounds, z + limit)
        assert isinstance(under, SeveralGrounds)
        return np.where(z - under.heights(x, y) <= level, under.numbers(x, y), NO_GROUND).astype(float)

    under = in_stretches(numbers, len(steps))
    return np.array([np.count_nonzero(under == number) for number in range(len(grounds.grounds))])
