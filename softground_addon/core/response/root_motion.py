"""Root motion: the travel that a cycle on the spot lacks, by its resting pieces of soles."""

from __future__ import annotations

import numpy as np

from ..ground.heightfield import Terrain
from ..legs.foot_lock import rolled, underside_on
from ..loads.estimate import CharacterLoads
from ..loads.sliding import treadmill_speed
from ..motion.motion import CharacterMotion
from ..numerics.arrays import Array, Mask
from ..numerics.intervals import runs
from ..numerics.slices import Slices, sliced
from ..record.ground_history import GroundHistory
from .response import at_scene_frames

BOTH = 0.5
"""Pieces of a sole with this part as many points on the belt both count for its speed, as the foot rolls over them."""
AGREES = 0.05
"""Pieces rest on the belt that move as the median does, to about this part of its speed; the rest land or leave."""


@sliced
def lacking_velocity(motion: CharacterMotion, loads: CharacterLoads, terrain: Terrain) -> Slices[Array | None]:
    """Velocity (2,) that a character which walks on the spot lacks [m/s]; None for one that travels by itself.

    Parameters
    ----------
    motion : CharacterMotion
        At scene frames.
    loads : CharacterLoads
        Of the same motion, on its time grid.
    """
    if treadmill_speed(loads.motion, loads.contacts) == 0.0:
        return None
    touching = at_scene_frames(loads.contacts.touching, loads.motion.frames, motion)
    if not (touching[1:] & touching[:-1]).any():  # of contacts that last a single frame, only the time grid shows a way
        return (yield from travel_velocity.slices(loads.motion, loads.contacts.touching, terrain))
    return (yield from travel_velocity.slices(motion, touching, terrain))


@sliced
def travel_velocity(motion: CharacterMotion, touching: Mask, terrain: Terrain) -> Slices[Array]:
    """Velocity (2,) that makes the bearing skin rest: against that of the belt under it [m/s].

    A foot rolls over heel, ball and toes, so that its velocity is that of the points that bear. Each frame has one
    vote, however many feet stand: the hips of a cycle may be held where the walk would have them surge.

    Parameters
    ----------
    motion : CharacterMotion
        At scene frames.
    touching : (F, S) bool array
    """
    floor = GroundHistory(terrain)
    frames, moves = [np.zeros(0, np.intp)], [np.zeros((0, 2))]
    for number, sole in enumerate(motion.soles):
        yield
        if not touching[:, number].any():
            continue
        under = underside_on(sole, floor, motion.frames)
        weight = under.bearing(BOTH)
        for first, end in zip(*runs(touching[:, number]), strict=True):
            frames.append(np.arange(first + 1, end))
            moves.append(rolled(under.points[first:end, :, :2], weight[first:end]))
    frame, move = np.concatenate(frames), np.concatenate(moves)
    if not len(frame):
        return np.zeros(2)
    belt = np.median(move, axis=0)
    off = np.linalg.norm(move - belt, axis=1) / max(AGREES * float(np.linalg.norm(belt)), 1e-12)
    agrees = np.exp((off.min() ** 2 - off**2) / 2)  # the nearest counts, however far it is
    total, resting, count = (
        np.zeros((len(motion.frames), 2)),
        np.zeros(len(motion.frames)),
        np.zeros(len(motion.frames)),
    )
    np.add.at(total, frame, agrees[:, None] * move)
    np.add.at(resting, frame, agrees)
    np.maximum.at(count, frame, agrees)
    of_frame = total / np.maximum(resting, 1e-12)[:, None]
    return np.asarray(-(count[:, None] * of_frame).sum(axis=0) / max(float(count.sum()), 1e-12) / motion.time_step)
