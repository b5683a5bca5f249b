"""From the skin to its contacts: the ground, what bears on it and when."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.intervals import runs
from ..numerics.slices import Slices, sliced
from .bearing import bearing, without_glimpses
from .ground_level import ground_of
from .merging import merged
from .skin_motion import Array, Indices, Mask, PartTracks, SkinMotion, track_parts

SHORT = 0.2
"""A contact that is never seen to last as long may be a brush [s]."""
RARE = 0.5
"""A contact of less than this share of the busiest one's time is rare."""
SLIPS = 0.5
"""A contact that slips faster than this share of the fastest slip of its parts brushes."""
ALONE = 0.5
"""What bears alone for this share of its time bears the body."""
UNEVEN = 0.0075
"""The ground lies at most this far off the level at which skin is most often, in body heights."""


@dataclass(frozen=True)
class SkinContacts:
    """What bears of a character, when, and on what.

    Attributes
    ----------
    level : float
        Height of the ground [m].
    drift : (2,) float array
        Horizontal velocity of the ground [m/s]: minus the travel that an in-place cycle lacks.
    group : (P,) int array
        Contact that each part belongs to, -1 for none.
    bears : (F, C) bool array
        When each contact bears.
    tracks : PartTracks
        Where each part is lowest.
    """

    level: float
    drift: Array
    group: Indices
    bears: Mask
    tracks: PartTracks


@sliced
def find_contacts(skin: SkinMotion, groups: Indices | None = None) -> Slices[SkinContacts]:
    """The contacts of a character.

    Parameters
    ----------
    skin : SkinMotion
    groups : (P,) int array, optional
        The contact that each part belongs to, where that is known; -1 for parts that do not bear.
    """
    parts = tracks = yield from track_parts.slices(skin)
    yield
    level, drift = yield from ground_of.slices(parts)
    if groups is None:
        assert skin.links is not None, "without them no parts can be told to be one contact"
        parts = yield from track_parts.slices(skin, floor=level)
        bears = bearing(parts, level, drift)
        groups = merged(parts, bears, skin.links)
        groups = _numbered(groups)
        if (groups >= 0).any():
            groups = yield from _without_brushes(skin, groups, level, drift)
    bears = np.zeros((len(skin.positions), 0), dtype=bool)
    if (groups >= 0).any():
        parts = yield from track_parts.slices(skin, groups, level)
        bears = without_glimpses(bearing(parts, level, drift), parts)
        level = _shared_level(parts, bears, level)
    return SkinContacts(level * skin.height, drift * skin.height, groups, bears, tracks)


def _shared_level(tracks: PartTracks, bears: Mask, level: float) -> float:
    """The ground between contacts that rest at different heights, however long each does [H]."""
    rests = [np.median(tracks.low[on, contact]) for contact, on in enumerate(bears.T) if on.any()]
    return level + float(np.clip(np.median(rests) - level, -UNEVEN, UNEVEN)) if rests else level


def _numbered(groups: Indices) -> Indices:
    values, numbers = np.unique(groups, return_inverse=True)
    return np.asarray(numbers - (values[0] == -1), dtype=np.intp)


def _without_brushes(skin: SkinMotion, groups: Indices, level: float, drift: Array) -> Slices[Indices]:
    """The groups less those that only brush the ground: short, and slipping or rare, while others bear.

    Limbs that mirror each other are contacts together: none is a brush whose twin is a contact, and a short one whose
    twin never bears is.
    """
    tracks = yield from track_parts.slices(skin, groups, level)
    bears, slip = bearing(tracks, level, drift), tracks.slip(drift)
    fast, time = np.percentile(slip, 90, axis=0), bears.sum(axis=0)
    twin = _twin_groups(groups, skin.twin, len(time))
    keeps = np.zeros(len(time), dtype=bool)
    for contact in np.flatnonzero(time):
        on = bears[:, contact]
        starts, ends = runs(on)
        alone = (bears[on].sum(axis=1) == 1).mean()
        slips = np.median(slip[on, contact]) > SLIPS * fast[contact]
        rare = time[contact] < RARE * time.max()
        lasts = (ends - starts).max() - 1 >= SHORT * skin.rate
        keeps[contact] = lasts or alone >= ALONE or not (slips or rare or not time[twin[contact]].any())
    keeps |= (time > 0) & (twin & keeps).any(axis=1)
    number = np.where(keeps, np.cumsum(keeps) - 1, -1)
    return np.where(groups >= 0, number[groups], -1)


def _twin_groups(groups: Indices, twin: Indices | None, count: int) -> Mask:
    """Which groups mirror which, (count, count); one without a mirror image mirrors itself."""
    mirrors = np.zeros((count, count), dtype=bool)
    for number in range(count):
        own = np.flatnonzero(groups == number)
        others = own if twin is None else twin[own]
        sided = others != own
        if sided.mean() > 0.5:  # most of it has a twin
            here = groups[others[sided & (others >= 0)]]
            mirrors[number, here[here >= 0]] = True
        else:
            mirrors[number, number] = True
    return mirrors
