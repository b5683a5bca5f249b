"""Soles that rest well above the ground, and how high they reach: what hard objects are looked for by."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..ground.hard_ground import HardOnSoft, Reach, SeveralGrounds, soft_ground, up_to
from ..ground.heightfield import Terrain
from ..motion.motion import CharacterMotion
from ..numerics.arrays import Array
from ..numerics.intervals import runs
from .contacts import LEAVE_HEIGHT, SHORTEST_CONTACT, TOUCH_HEIGHT
from .missed_steps import rests

STEP_UP = 0.4
"""Soles stand on a surface that is up to this far above them, in leg lengths: below the knee."""


@dataclass(frozen=True)
class RaisedRest:
    """A sole that rests well above the ground.

    Attributes
    ----------
    frame : float
        Of the scene, at which the rest begins.
    place : (3,) float array
        Lowest landmark in the middle of it [m].
    near : float
        An object that is no further below or above that carries it [m].
    over : float
        The least height of that object above the ground [m].
    """

    character: str
    sole: str
    frame: float
    place: Array
    near: float
    over: float


def reach_of(motions: Sequence[CharacterMotion]) -> Reach:
    """Up to where the soles of some motions stand on hard objects."""
    points = [
        sole.landmark_positions().reshape(-1, 3) + np.array((0.0, 0.0, STEP_UP * motion.leg_length))
        for motion in motions
        for sole in motion.soles
    ]
    return Reach.of(np.concatenate(points), STEP_UP * max(motion.leg_length for motion in motions))


def raised_rests(motion: CharacterMotion, terrain: Terrain) -> Iterator[RaisedRest]:
    """Places where soles of a body rest well above a terrain."""
    if motion.centre is not None:
        return  # a prop may lie anywhere
    shortest = SHORTEST_CONTACT * motion.pendulum_time / motion.time_step
    near, over = LEAVE_HEIGHT * motion.leg_length, TOUCH_HEIGHT * motion.leg_length
    for sole in motion.soles:
        points, calm = sole.landmark_positions(), np.flatnonzero(rests(sole, motion, np.zeros(2)))
        lowest = points[calm, points[calm, :, 2].argmin(axis=1)]
        raised = np.zeros(len(points), dtype=bool)
        raised[calm] = lowest[:, 2] - terrain.heights(*lowest[:, :2].T) > near
        for first, last in zip(*runs(raised), strict=True):
            if last - first >= shortest:
                landmarks = points[(first + last) // 2]
                place = landmarks[landmarks[:, 2].argmin()]
                yield RaisedRest(motion.name, sole.sole.name, float(motion.frames[first]), place, near, over)


def carried_by(
    heights: Callable[[Array, Array, Array], Array], rests_above: Sequence[RaisedRest], ground: Terrain
) -> list[RaisedRest]:
    """The rests that an object carries: its `heights` up to a limit are near the soles, well above the ground."""
    if not rests_above:
        return []
    x, y, z = np.array([rest.place for rest in rests_above]).T
    near, over = (np.array([getattr(rest, name) for rest in rests_above]) for name in ("near", "over"))
    height = heights(x, y, z + near)
    carries = (z - height <= near) & (height - ground.heights(x, y) > over)
    return [rest for rest, is_carried in zip(rests_above, carries, strict=True) if is_carried]


def stands_on_hard(motion: CharacterMotion, terrain: Terrain) -> bool:
    """True if a motion was made for the hard objects of a terrain, or the further of several grounds: soles rest on
    them as it is."""
    soft = soft_ground(terrain)
    if isinstance(soft, SeveralGrounds):

        def highest(x: Array, y: Array, limit: Array) -> Array:
            return up_to(terrain, limit).heights(x, y)

        return any(carried_by(highest, list(raised_rests(motion, ground)), ground) for ground in soft.grounds)
    if not isinstance(terrain, HardOnSoft):
        return False
    return bool(carried_by(terrain.hard.heights, list(raised_rests(motion, terrain.ground)), terrain.ground))
