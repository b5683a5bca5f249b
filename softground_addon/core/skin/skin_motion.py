"""The deformed skin of a character over time, and what each part of it does where it is lowest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..numerics.slices import Slices, sliced

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
Mask = NDArray[np.bool_]

PATCH = 0.008
"""What lies this near above the lowest point of a part moves with it as one patch, in body heights."""

CALM_SPEED = 0.15
"""Skin that rises or falls slower than this may rest, in body heights per second."""

CALM_SHARE = 0.12
"""The same as a share of how fast low parts move: on tiptoe in a sprint nothing is quite still."""

BURIED = 0.015
"""Skin deeper than this below the ground is in it, not on it, in body heights."""

LOW = 0.15
"""A part lower than this above the lowest skin is low, in body heights."""

_SLICE = 300_000
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
        The median vertical extent of the body [m], H: lengths are told in it.
    """

    positions: NDArray[np.floating]
    part: Indices
    links: Mask | None
    rate: float
    height: float


@dataclass(frozen=True)
class PartTracks:
    """Where each part is lowest and how it moves there; lengths in body heights H, speeds in H/s.

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
    """

    low: Array
    place: Array
    rise: Array
    ways: Array
    calm: float
    rate: float

    @property
    def lowest(self) -> Array:
        """Height of the lowest skin, (F,)."""
        return np.asarray(self.low.min(axis=1))

    def slip(self, drift: Array) -> Array:
        """Horizontal speed against a ground that moves with `drift`, the slower of both steps, (F, P)."""
        return np.asarray(np.linalg.norm(self.ways - drift, axis=-1).min(axis=0))

    def of(self, parts: Mask) -> PartTracks:
        """Some of the parts."""
        return PartTracks(
            self.low[:, parts], self.place[:, parts], self.rise[:, parts], self.ways[:, :, parts], self.calm, self.rate
        )


@sliced
def track_parts(skin: SkinMotion, group: Indices | None = None, floor: float = -np.inf) -> Slices[PartTracks]:
    """What the lowest patch of each part does.

    Parameters
    ----------
    skin : SkinMotion
    group : (P,) int array, optional
        Number of the group that each part is in, to track groups in place of parts; -1 for none.
    floor : float
        Height of the ground [H]: of a part that dips below it, what counts is where its skin meets the ground.
    """
    part = skin.part if group is None else group[skin.part]
    used = np.flatnonzero(part >= 0)
    used = used[np.argsort(part[used], kind="stable")]
    part = part[used]
    first = np.flatnonzero(np.diff(part, prepend=-1))
    number = np.repeat(np.arange(len(first)), np.diff(np.append(first, len(part))))
    count = len(skin.positions)
    low, rise = np.empty((2, count, len(first)))
    middle, ways = np.empty((count, len(first), 2)), np.empty((2, count, len(first), 3))
    frames = max(_SLICE // max(len(used), 1), 1)
    for start in range(0, count, frames):
        here = slice(start, start + frames)
        height = skin.positions[here, used, 2].astype(float) / skin.height
        lowest = np.minimum.reduceat(np.where(height < floor - BURIED, np.inf, height), first, axis=1)
        lowest = np.where(np.isfinite(lowest), lowest, np.maximum.reduceat(height, first, axis=1))
        frame, point = np.nonzero(~(np.abs(height - lowest[:, number]) > PATCH))
        patch = np.flatnonzero(np.diff(frame * len(first) + number[point], prepend=-1))
        size = np.diff(np.append(patch, len(frame)))[:, None]
        frame, point = frame + start, used[point]
        before, place, after = (
            skin.positions[np.clip(frame + step, 0, count - 1), point].astype(float) / skin.height
            for step in (-1, 0, 1)
        )
        low[here] = lowest
        middle[here] = (np.add.reduceat(place[:, :2], patch) / size).reshape(*lowest.shape, 2)
        # The first sample has no step before it and the last none after it: each has its one step on both sides.
        before, after = (place - before) * skin.rate, (after - place) * skin.rate
        steps = np.where((frame > 0)[:, None], before, after), np.where((frame < count - 1)[:, None], after, before)
        for side, step in enumerate(steps):
            ways[side, here] = (np.add.reduceat(step, patch) / size).reshape(*lowest.shape, 3)
        rises = np.minimum(*(np.abs(step[:, 2]) for step in steps))
        rise[here] = np.minimum.reduceat(rises, patch).reshape(lowest.shape)
        yield
    near = low < low.min() + LOW
    speed = np.linalg.norm(ways, axis=-1).min(axis=0)
    calm = max(CALM_SPEED, CALM_SHARE * float(np.percentile(speed[near], 95)))
    return PartTracks(low, middle, rise, ways[..., :2], calm, skin.rate)
