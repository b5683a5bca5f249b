"""Bearing of each part: low, calm and moving with the ground, with hysteresis."""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Mask
from ..numerics.intervals import hysteresis, runs
from .skin_motion import CALM_SPEED, PartTracks

TOUCH, LEAVE = 0.015, 0.018
"""A part below the first height over the ground starts to bear, one above the second has lifted, in body heights."""
LEAVE_RISE = 2.0
"""A bearing part that rises or falls faster than this many times the calm speed has lifted."""
LEAVE_SLIP = 1.5
"""The same for its slip, over the limit for touching."""
SLIP_OF_REST = 4.0
"""A bearing part slips at most this many times as fast as calm low skin does mostly, ..."""
SLIP_SHARES = 0.15, 0.4
"""... between these shares of the part's fast slip, ..."""
LEAST_SLIP = 0.15
"""... and never less than this, in H/s."""
STILL = 0.08
"""Least time for which skin that lies calm, low and still stands, though the ground moves at other times [s]: a jump on
the spot begins and ends standing."""
BLIP = 0.05
"""Longest bearing that does not count [s], except in shots of at most `FEW` samples."""
FEW = 4
GLIMPSE = 0.08
"""Bearing at an end of the shot that shows little more than one step [s]: two frames at 24 Hz."""
LANDED = TOUCH / 2
"""Largest height of a part that has landed, over the ground and over its usual height while it stands."""
DRAGS = 0.004
"""Height below which a part between two times of bearing slides on without leaving the ground, in body heights."""
HARD_RISE, HARD_SLIP = 2.5, 0.12
"""A hard step: fast, but it hardly slips; over the calm speed, and over the part's fast slip."""


def bearing(tracks: PartTracks, level: float, drift: Array) -> Mask:
    """True while each part bears.

    Parameters
    ----------
    level : float
        Height of the ground [H].
    drift : (2,) float array
        Horizontal velocity of the ground [H/s].

    Returns
    -------
    (F, P) bool array
    """
    if tracks.loops:
        turn = len(tracks.low) - 1
        around = bearing(tracks.turns(3), level, drift)
        return _without_blips(around[turn : 2 * turn + 1], round(BLIP * tracks.rate))
    height, speed, slip = tracks.low - level, tracks.rise, tracks.slip(drift)
    fast = np.percentile(slip, 90, axis=0)
    limit = np.clip(SLIP_OF_REST * _usual_slip(height, speed, slip, tracks.calm), *(np.outer(SLIP_SHARES, fast)))
    limit = np.maximum(limit, LEAST_SLIP)
    near = height < TOUCH
    touches = near & (speed < tracks.calm) & (slip < limit)
    touches |= near & (speed < HARD_RISE * tracks.calm) & (slip < np.maximum(HARD_SLIP * fast, LEAST_SLIP))
    still = near & (speed < tracks.calm) & (tracks.slip(np.zeros(2)) < LEAST_SLIP)
    still = _lasting(still, round(STILL * tracks.rate))
    touches |= still
    leaves = (height > LEAVE) | (speed > np.maximum(LEAVE_RISE, HARD_RISE * touches) * tracks.calm)
    leaves |= (slip > LEAVE_SLIP * limit) & ~still
    bears = hysteresis(touches, leaves)
    bears |= hysteresis(touches[::-1], leaves[::-1])[::-1]  # a landing is as soft as a lift-off
    # The only calm skin on the ground bears, even where it slides.
    sliding = near & (speed < tracks.calm)
    bears |= sliding & ~bears.any(axis=1, keepdims=True)
    bears = _dragged(bears, (np.abs(height) < DRAGS) & (speed < tracks.calm))
    bears = _without_gaps(bears, height < LEAVE, round(BLIP * tracks.rate))
    return _landed(_without_blips(bears, round(BLIP * tracks.rate)), height) if len(bears) > FEW else bears


def _lasting(state: Mask, longest: int) -> Mask:
    """State without the runs of at most `longest` samples."""
    lasting = state.copy()
    for part in np.flatnonzero(state.any(axis=0)):
        for first, last in zip(*runs(state[:, part]), strict=True):
            lasting[first:last, part] = last - first > longest
    return lasting


def _without_blips(bears: Mask, longest: int) -> Mask:
    lasting = bears.copy()
    for part in np.flatnonzero(bears.any(axis=0)):
        for first, last in zip(*runs(bears[:, part]), strict=True):
            # Bearing at an end of the shot may go on beyond it; at a single frame it cannot be seen to slow down.
            least = 1 if first == 0 or last == len(bears) else longest
            lasting[first:last, part] = last - first > least
    return lasting


def _without_gaps(bears: Mask, low: Mask, longest: int) -> Mask:
    """Bearing, with gaps of at most `longest` samples closed in which the part stays `low`: no foot leaves and lands so
    soon, but skin that dips through the ground shows now by one vertex, now by another."""
    without = bears.copy()
    for part in np.flatnonzero(bears.any(axis=0)):
        for first, last in zip(*runs(~bears[:, part]), strict=True):
            if first > 0 and last < len(bears) and last - first <= longest and low[first:last, part].all():
                without[first:last, part] = True
    return without


def _dragged(bears: Mask, lies: Mask) -> Mask:
    """Bearing, with gaps closed, also at the ends of the shot, in which the part stays on the ground and slides."""
    dragged = bears.copy()
    for part in np.flatnonzero(bears.any(axis=0)):
        ends = np.pad(bears[:, part], 1, constant_values=True)
        for first, last in zip(*runs(lies[:, part] & ~bears[:, part]), strict=True):
            dragged[first:last, part] = ends[first] and ends[last + 1]
    return dragged


def _landed(bears: Mask, height: Array) -> Mask:
    """Bearing, without samples at which the part is still coming down or has begun to rise."""
    landed = bears.copy()
    for part in np.flatnonzero(bears.any(axis=0)):
        for first, last in zip(*runs(bears[:, part]), strict=True):
            over = height[first:last, part]
            down = np.flatnonzero(over < max(float(np.median(over)), 0.0) + LANDED)
            if len(down) > 1:
                landed[first : first + down[0] * (first > 0), part] = False
                landed[last - (last - first - 1 - down[-1]) * (last < len(bears)) : last, part] = False
    return landed


def without_glimpses(bears: Mask, tracks: PartTracks) -> Mask:
    """Bearing, without brief contacts at the first and last frames, in which the part does not rest.

    Such a foot is about to land, or has just lifted. A part that bears only then keeps its contacts.
    """
    longest = max(round(GLIMPSE * tracks.rate), 2)
    seen, rise = bears.copy(), tracks.rise
    if tracks.loops:  # bearing that goes on beyond the seam is not seen at this end
        rise = rise.copy()
        rise[[0, -1]] = np.abs(tracks.low[[1, -2]] - tracks.low[[0, -1]]) * tracks.rate
    for part in np.flatnonzero(bears.any(axis=0)):
        intervals = list(zip(*runs(bears[:, part]), strict=True))
        for first, last in intervals if len(intervals) > 1 else ():
            at_end = last - first <= longest and (first == 0 or last == len(bears))
            rests = rise[first:last, part].min() < CALM_SPEED
            seen[first:last, part] = rests or not at_end
        if not seen[:, part].any():
            seen[:, part] = bears[:, part]
    return seen


def _usual_slip(height: Array, speed: Array, slip: Array, calm: float) -> float:
    rests = (np.abs(height) < TOUCH) & (speed < calm)
    return float(np.median(slip[rests])) if rests.any() else 0.0
