"""Height of the ground under each part on stairs and slopes, with a mesh of them or without."""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Mask
from ..numerics.intervals import runs
from .bearing import LEAST_SLIP, STILL, TOUCH
from .skin_motion import PartTracks

TRAVELS = 1.0
"""Longest way of a character that stays on one level, in body heights."""
OFF_LEVEL = 0.02
"""Skin that rests this far off the level rests on another one, in body heights."""
OFF_SHARE = 0.25
"""Share of the time with skin at rest from which the ground has several levels."""


def footing_of(tracks: PartTracks, level: float) -> Array | None:
    """Height of the ground under each part, (F, P) [H], where the ground stands still but has several levels.

    It is that at which the part rests nearest in time, and the level for parts that never do. None where one level
    will do.

    Parameters
    ----------
    tracks : PartTracks
        Of a character that travels as its ground does not.
    level : float
        That at which skin rests most often [H].
    """
    if np.linalg.norm(np.ptp(np.median(tracks.place, axis=1), axis=0)) < TRAVELS:
        return None
    rests = _rests(tracks)
    off = rests & (np.abs(tracks.low - level) > OFF_LEVEL)
    if off.any(axis=1).sum() <= OFF_SHARE * rests.any(axis=1).sum():
        return None
    footing = np.full(tracks.low.shape, level)
    frames = np.arange(len(footing))
    for part in np.flatnonzero(rests.any(axis=0)):
        firsts, ends = runs(rests[:, part])
        heights = [np.median(tracks.low[first:end, part]) for first, end in zip(firsts, ends, strict=True)]
        nearest = np.searchsorted((ends[:-1] + firsts[1:] - 1) / 2, frames)
        footing[:, part] = np.array(heights)[nearest]
    return footing


def _rests(tracks: PartTracks) -> Mask:
    """True while each part rests in the world, and is the lowest of the body at some moment of it, (F, P)."""
    still = (tracks.rise < tracks.calm) & (tracks.slip(np.zeros(2)) < LEAST_SLIP)
    lowest = tracks.low < tracks.lowest[:, None] + TOUCH
    rests = np.zeros_like(still)
    longest = round(STILL * tracks.rate)
    for part in np.flatnonzero((still & lowest).any(axis=0)):
        for first, end in zip(*runs(still[:, part]), strict=True):
            low = tracks.low[first:end, part]
            at_rest = np.abs(low - np.median(low)) < TOUCH
            if at_rest.sum() > longest and (at_rest & lowest[first:end, part]).any():
                rests[first:end, part] = at_rest
    return rests
