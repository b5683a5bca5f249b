"""Contacts of the skin: the ground, the parts that bear on it and their times."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..numerics.arrays import Array, Indices, Mask
from ..numerics.intervals import runs
from ..numerics.slices import Slices, sliced
from .bearing import bearing, without_glimpses
from .footing import footing_of
from .ground_level import ground_of
from .merging import merged, moving_alike
from .skin_motion import PartTracks, SkinMotion, track_parts

SHORT = 0.2
"""A contact that is never seen to last as long may be a brush [s]."""
RARE = 0.5
"""A contact of less than this share of the busiest one's time is rare."""
SLIPS = 0.5
"""A contact that slips faster than this share of the fastest slip of its parts brushes."""
RESTS = 0.05
"""A contact that slips slower than this share of its fastest slip stands where it is, however seldom: a kick's foot."""
ALONE = 0.5
"""Share of its time for which a contact that bears the body bears alone."""
UNEVEN = 0.0075
"""The ground lies at most this far off the level at which skin is most often, in body heights."""


@dataclass(frozen=True)
class SkinContacts:
    """Contacts of a character: parts, times and ground.

    Attributes
    ----------
    level : float
        Height of the ground [m], of stairs that of the step on which skin rests most often.
    floor : (F, C) float array
        That under each contact [m].
    drift : (2,) float array
        Horizontal velocity of the ground [m/s]: minus the travel that an in-place cycle lacks.
    group : (P,) int array
        Contact that each part belongs to, -1 for none.
    bears : (F, C) bool array
        True while each contact bears.
    tracks : PartTracks
        Tracks of each part where it is lowest.
    """

    level: float
    floor: Array
    drift: Array
    group: Indices
    bears: Mask
    tracks: PartTracks


@sliced
def find_contacts(skin: SkinMotion, groups: Indices | None = None) -> Slices[SkinContacts]:
    """The contacts of a character.

    Parameters
    ----------
    groups : (P,) int array, optional
        The contact that each part belongs to, where that is known; -1 for parts that do not bear.
    """
    parts = tracks = yield from track_parts.slices(skin)
    yield
    level, drift = yield from ground_of.slices(parts)
    uneven = not drift.any() and footing_of(parts, level) is not None
    ground = _Ground(-np.inf if uneven else level, level, drift)
    if groups is None:
        assert skin.links is not None, "without them no parts can be told to be one contact"
        parts = yield from track_parts.slices(skin, floor=ground.floor)
        _, bears = ground.borne(parts)
        groups = merged(parts, bears, skin.links, moving_alike(skin), skin.twin)
        groups = _numbered(groups)
        if (groups >= 0).any():
            groups = yield from _without_brushes(skin, groups, ground)
    bears = np.zeros((len(skin.positions), 0), dtype=bool)
    footing = np.zeros(bears.shape)
    if (groups >= 0).any():
        parts = yield from track_parts.slices(skin, groups, ground.floor)
        footing, bears = ground.borne(parts)
        bears = without_glimpses(bears, parts)
        if not uneven:
            level = _shared_level(parts, bears, level)
            footing = np.full(bears.shape, level)
    return SkinContacts(level * skin.height, footing * skin.height, drift * skin.height, groups, bears, tracks)


@dataclass(frozen=True)
class _Ground:
    """Ground of a character: one level, or where that is unknown (`floor` -inf) as many as its parts rest at."""

    floor: float
    level: float
    drift: Array

    def borne(self, tracks: PartTracks) -> tuple[Array, Mask]:
        """Height of the ground under each part [H], and when it bears, (F, P)."""
        footing = None if np.isfinite(self.floor) else footing_of(tracks, self.level)
        if footing is None:
            return np.full(tracks.low.shape, self.level), bearing(tracks, self.level, self.drift)
        return footing, bearing(replace(tracks, low=np.abs(tracks.low - footing)), 0.0, self.drift)


def _shared_level(tracks: PartTracks, bears: Mask, level: float) -> float:
    """The ground between contacts that rest at different heights, however long each does [H]."""
    rests = [np.median(tracks.low[on, contact]) for contact, on in enumerate(bears.T) if on.any()]
    return level + float(np.clip(np.median(rests) - level, -UNEVEN, UNEVEN)) if rests else level


def _numbered(groups: Indices) -> Indices:
    values, numbers = np.unique(groups, return_inverse=True)
    return np.asarray(numbers - (values[0] == -1), dtype=np.intp)


def _without_brushes(skin: SkinMotion, groups: Indices, ground: _Ground) -> Slices[Indices]:
    """The groups less those that only brush the ground: short, and slipping or rare, while others bear.

    Limbs that mirror each other are contacts together: none is a brush whose twin is a contact, and a short one whose
    twin never bears is.
    """
    tracks = yield from track_parts.slices(skin, groups, ground.floor)
    (_, bears), slip = ground.borne(tracks), tracks.slip(ground.drift)
    fast, time = np.percentile(slip, 90, axis=0), bears.sum(axis=0)
    twin = _twin_groups(groups, skin.twin, len(time))
    keeps = np.zeros(len(time), dtype=bool)
    for contact in np.flatnonzero(time):
        on = bears[:, contact]
        starts, ends = runs(on)
        alone = (bears[on].sum(axis=1) == 1).mean()
        slips = np.median(slip[on, contact]) > SLIPS * fast[contact]
        rests = np.median(slip[on, contact]) < RESTS * fast[contact]
        rare = time[contact] < RARE * time.max() and not rests
        lasts = (ends - starts).max() - 1 >= SHORT * skin.rate
        keeps[contact] = lasts or alone >= ALONE or not (slips or rare or not time[twin[contact]].any())
    keeps |= (time > 0) & (twin & keeps).any(axis=1)
    number = np.where(keeps, np.cumsum(keeps) - 1, -1)
    return np.where(groups >= 0, number[groups], -1)


def _twin_groups(groups: Indices, twin: Indices | None, count: int) -> Mask:
    """True for groups that mirror each other, (count, count); one without a mirror image mirrors itself."""
    mirrors = np.zeros((count, count), dtype=bool)
    for number in range(count):
        members = np.flatnonzero(groups == number)
        others = members if twin is None else twin[members]
        sided = others != members
        if sided.mean() > 0.5:  # most of it has a twin
            here = groups[others[sided & (others >= 0)]]
            mirrors[number, here[here >= 0]] = True
        else:
            mirrors[number, number] = True
    return mirrors
