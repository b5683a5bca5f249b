"""The deformed skin of a character over time, and the movement of each part where it is lowest."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array, Indices, Mask
from ..numerics.slices import Slices, sliced

PATCH = 0.008
"""Height of the lowest patch of a part above its lowest point, in body heights."""

CALM_SPEED = 0.15
"""Skin that rises or falls slower than this may rest, in body heights per second."""

CALM_SHARE = 0.12
"""The same as a share of the speed of low parts: on tiptoe in a sprint nothing is quite still."""

BURIED = 0.015
"""Skin deeper than this below the ground is in it, not on it, in body heights."""

LOW = 0.15
"""A part lower than this above the lowest skin is low, in body heights."""

LOOPS = 0.001
"""A shot whose last pose is its first one to within this is one turn of a loop, in body heights."""

MOST_SAMPLES = 3000
"""Samples of the longest shots in which the skin is followed."""

_SLICE = 100_000
"""Places that are looked at in one slice."""


@dataclass(frozen=True)
class SkinMotion:
    """Points of the skin over time, in parts that move as one.

    Attributes
    ----------
    positions : (F, V, 3) float array
        Z up [m], the points of each part together.
    part : (V,) int array
        Part of each point, rising; every part has one.
    links : (P, P) bool array
        Which parts hang together: welded skin, parent and child. Not needed where the parts of each contact are known.
    rate : float
        Samples per second [Hz].
    height : float
        The median vertical extent of the body [m], H, the unit of lengths.
    twin : (P,) int array, optional
        The part that mirrors each, itself where none does, and -1 where that is not followed.
    beside : (P, P) bool array, optional
        Which parts lie against each other as the body was modelled.
    """

    positions: NDArray[np.floating]
    part: Indices
    links: Mask | None
    rate: float
    height: float
    twin: Indices | None = None
    beside: Mask | None = None


@dataclass(frozen=True)
class PartTracks:
    """Place and movement of each part where it is lowest; lengths in body heights H, speeds in H/s.

    Attributes
    ----------
    low : (F, P) float array
        Height of the lowest point.
    place : (F, P, 2) float array
        Where that is.
    rise : (F, P) float array
        Vertical speed of the calmest point of the lowest patch, the slower of the steps before and after.
    ways : (2, F, P, 2) float array
        Horizontal velocity of the lowest patch over the step before and the step after.
    calm : float
        A part that rises or falls slower than this may rest.
    rate : float
        [Hz]
    loops : bool
        True if the shot is one turn of a loop: bearing at its end goes on at its beginning.
    """

    low: Array
    place: Array
    rise: Array
    ways: Array
    calm: float
    rate: float
    loops: bool = False

    @property
    def lowest(self) -> Array:
        """Height of the lowest skin, (F,)."""
        return np.asarray(self.low.min(axis=1))

    def slip(self, drift: Array) -> Array:
        """Horizontal speed against a ground that moves with `drift`, the slower of both steps, (F, P)."""
        return np.asarray(np.linalg.norm(self.ways - drift, axis=-1).min(axis=0))

    def of(self, parts: Mask) -> PartTracks:
        """Some of the parts."""
        return replace(
            self,
            low=self.low[:, parts],
            place=self.place[:, parts],
            rise=self.rise[:, parts],
            ways=self.ways[:, :, parts],
        )

    def turns(self, count: int) -> PartTracks:
        """Some turns of a loop in a row, (count·(F - 1), P)."""
        return replace(
            self,
            low=np.tile(self.low[:-1], (count, 1)),
            place=np.tile(self.place[:-1], (count, 1, 1)),
            rise=np.tile(self.rise[:-1], (count, 1)),
            ways=np.tile(self.ways[:, :-1], (1, count, 1, 1)),
            loops=False,
        )


@sliced
def track_parts(skin: SkinMotion, group: Indices | None = None, floor: float = -np.inf) -> Slices[PartTracks]:
    """Tracks of the lowest patch of each part.

    Parameters
    ----------
    group : (P,) int array, optional
        Number of the group that each part is in, to track groups in place of parts; -1 for none.
    floor : float
        Height of the ground [H]: of a part that dips below it, the skin that meets the ground counts.
    """
    part = skin.part if group is None else group[skin.part]
    used = np.flatnonzero(part >= 0)
    used = used[np.argsort(part[used], kind="stable")]
    part = part[used]
    first = np.flatnonzero(np.diff(part, prepend=-1))
    number = np.repeat(np.arange(len(first)), np.diff(np.append(first, len(part))))
    count = len(skin.positions)
    loops = count > 2 and bool(np.abs(skin.positions[-1] - skin.positions[0]).max() < LOOPS * skin.height)
    low, rise = np.empty((2, count, len(first)))
    middle, ways = np.empty((count, 2, len(first))), np.empty((2, count, 3, len(first)))
    frames = max(_SLICE // max(len(used), 1), 1)
    for start in range(0, count, frames):
        samples = np.arange(start - 1, min(start + frames, count) + 1)  # with the one before and the one after
        sampled = (samples - 1) % (count - 1) + 1 if loops else np.clip(samples, 0, count - 1)
        around = np.swapaxes(skin.positions, 1, 2)[sampled]
        positions = np.take(around, used, axis=2) / skin.height
        steps = np.diff(positions, axis=0) * skin.rate
        # The first sample has no step before it and the last none after it: each has its one step on both sides.
        if start == 0 and not loops:
            steps[0] = steps[1]
        if samples[-1] == count and not loops:
            steps[-1] = steps[-2]
        here, positions = samples[1:-1], positions[1:-1]
        height = positions[:, 2]
        lowest = np.minimum.reduceat(np.where(height < floor - BURIED, np.inf, height), first, axis=1)
        lowest = np.where(np.isfinite(lowest), lowest, np.maximum.reduceat(height, first, axis=1))
        patch = np.abs(height - lowest[:, number]) <= PATCH
        size = np.add.reduceat(patch, first, axis=1, dtype=float)[:, None]
        low[here] = lowest
        middle[here] = _sums(positions[:, :2], patch, first) / size
        ways[0, here] = _sums(steps[:-1], patch, first) / size
        ways[1, here] = _sums(steps[1:], patch, first) / size
        rises = np.minimum(*np.abs([steps[:-1, 2], steps[1:, 2]]))
        rise[here] = np.minimum.reduceat(np.where(patch, rises, np.inf), first, axis=1)
        yield
    near = low < low.min() + LOW
    speed = np.linalg.norm(ways, axis=2).min(axis=0)
    calm = max(CALM_SPEED, CALM_SHARE * float(np.percentile(speed[near], 95)))
    return PartTracks(low, np.swapaxes(middle, 1, 2), rise, np.swapaxes(ways[:, :, :2], 2, 3), calm, skin.rate, loops)


def _sums(values: NDArray[np.floating], patch: Mask, first: Indices) -> Array:
    """Sums over the points of each part's patch, (F, axes, P)."""
    return np.asarray(np.add.reduceat(values * patch[:, None], first, axis=2, dtype=float))
