"""Contacts of each sole with its ground.

Detection is scale-free: heights are compared as fractions of the leg length and speeds as fractions of
sqrt(gravity·leg length), so that the same numbers serve a mouse and a giant, metres and centimetres
(docs/model.md section 3, "Contact").
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..ground.hard_ground import up_to
from ..motion.motion import CharacterMotion
from ..motion.sole_motion import SoleMotion
from ..numerics.arrays import Array, Mask
from ..numerics.interpolation import in_stretches
from ..numerics.intervals import close_short, hysteresis, runs
from ..numerics.slices import Slices, sliced
from ..numerics.smoothing_spline import smooth_path
from ..skin import bearing
from .clearances import clearances

if TYPE_CHECKING:
    from ..ground.heightfield import Terrain

TOUCH_HEIGHT = 0.025
"""A sole lower than this starts to touch, in leg lengths (2 cm for an adult)."""
LEAVE_HEIGHT = 0.05
"""A touching sole higher than this has left, in leg lengths."""
TOUCH_SPEED = 0.25
"""A sole slower than this, or than the body, starts to touch, in sqrt(gravity·leg length) (0.8 m/s for an adult). The
foot that swings overtakes the body, the foot that stands falls behind it."""
TOUCH_SHARE = 0.2
"""The same as a part of the sole's own highest speeds, where that is less: in slow motion swings are slow."""
SLOWEST_TOUCH = 0.055
"""The least of it, in sqrt(gravity·leg length); a sole whose highest speeds are below that only shakes."""
LEAVE_SPEED = 1.5
"""A touching sole faster than this many times that speed has left."""
LANDED_HEIGHT = 0.01
"""A sole has landed when one of its landmarks is this near to where it will stand, in leg lengths."""
REST_SPEED = 0.15
"""A sole slower than this may be standing: such samples tell the float, in sqrt(gravity·leg length)."""
BELT_SHARE = 0.12
"""Speed of a belt, where that is less than `REST_SPEED`, as a part of the fastest speed of the soles on it."""
SOLID_FLOAT_LIMIT = 0.03
"""The same for what is not a foot: hands, knees and canes come near the ground without touching it, in leg lengths."""
FLOAT_PERCENTILE = 10.0
"""The clearance of a standing sole that counts as float or sink: low, but no single outlier."""
FLOAT_LIMIT = 0.15
"""A sole that never comes nearer than this to its ground does not float, it does not touch, in leg lengths."""
SHORTEST_CONTACT = 0.165
"""Gaps and blips shorter than this close, in sqrt(leg length/gravity) (0.05 s for an adult)."""
EDGE_SEARCH = 0.2
"""How far toe-off may lie from the instant that height and speed tell, in sqrt(leg length/gravity) (60 ms)."""
EDGE_CUTOFF = 24.0
"""Cut-off of the low-pass before a sole's acceleration is taken, in pendulum frequencies sqrt(gravity/leg
length)/(2·pi) (12 Hz for an adult)."""
STRIKE_SPEED = 0.17
"""A foot that comes down beside one that bears takes load once its lowest point moves along the ground more slowly
than this, in sqrt(gravity·leg length) (0.5 m/s for an adult)."""
TOE_OFF_SPEED = 0.5
"""A foot has left its load to another one when its last point moves faster than this, in sqrt(gravity·leg length)
(1.5 m/s for an adult)..."""
TOE_OFF_SHARE = 0.35
"""...or than this part of its fastest in the swing that follows: slow motion has slow toes."""
BESIDE = 0.33
"""How long another foot must have borne before, or must bear after, for a foot to land or leave beside it, and how much
later it then may, in sqrt(leg length/gravity) (0.1 s)."""
SWING = 2.0
"""Time in which a swinging foot has been at its fastest, in the same unit (0.6 s)."""
SURE = 0.6
"""Share of a contact that the skin shows, of which speed has to find as much or more; else the skin decides."""
SLOPE_PROBE = 0.02
"""Half the distance over which the ground's slope is read, in leg lengths."""


@dataclass(frozen=True)
class Contacts:
    """Soles that touch at each step.

    Attributes
    ----------
    touching : (N, S) bool array
    offset : (S,) float array
        Constant float (positive) or sink (negative) of each sole that detection removed [m].
    normal : (N, S, 3) float array
        The ground's unit normal under each sole.
    clearance : (N, S) float array
        Distance of each sole from its ground after `offset` is removed [m], infinite where nothing can bear it.
    aloft : (N, S) bool array, optional
        Where the skin shows a sole in the air, if it tells.
    hard : (N, S) bool array, optional
        Where a sole stands on something hard, which takes no print: these do not count as touching.
    """

    touching: Mask
    offset: Array
    normal: Array
    clearance: Array
    aloft: Mask | None = None
    hard: Mask | None = None

    @property
    def standing(self) -> Mask:
        """True for soles that touch the ground or something hard, (N, S)."""
        return self.touching if self.hard is None else self.touching | self.hard

    def during(self, steps: slice) -> Contacts:
        """The contacts at some of the steps."""
        aloft, hard = (None if mask is None else mask[steps] for mask in (self.aloft, self.hard))
        return Contacts(self.touching[steps], self.offset, self.normal[steps], self.clearance[steps], aloft, hard)


@sliced
def detect_contacts(motion: CharacterMotion, terrain: Terrain) -> Slices[Contacts]:
    """Find when each sole touches the terrain, by height and speed with hysteresis.

    A contact starts when the sole has come down to where it will stand, and ends when its last landmark accelerates
    upward most (Hreljac and Marshall 2000, "Algorithms to determine event timing during normal walking using
    kinematic data", J. Biomechanics 33(6)). In double support both are told better by the sole's speed.

    Parameters
    ----------
    motion : CharacterMotion
        On the simulation's time grid.
    terrain : Terrain
        The undisturbed ground. Where it is missing or steeper than 60° there is no contact.

    Returns
    -------
    Contacts
    """
    tracks = []
    for sole in motion.soles:
        tracks.append((yield from _track(sole, motion, terrain)))
    feet = [track for track, sole in zip(tracks, motion.soles, strict=True) if sole.sole.prop is None]
    drift = _ground_drift(feet or tracks, motion)
    seen = _seen_on_skin(motion, terrain, tracks)
    # Where a whole body travels, its speed tells more finely than its skin when a foot that swings has left. A small or
    # slow one on the spot moves too slowly for that.
    on_the_spot = drift.any() or (motion.skin is not None and motion.skin.on_the_spot)
    if seen is not None and (on_the_spot or not motion.joints):
        return seen
    body_speed = np.linalg.norm(_body_velocity(motion) - drift, axis=-1)
    of_soles = [
        _detect(track, drift, body_speed, motion, FLOAT_LIMIT if sole.sole.prop is None else SOLID_FLOAT_LIMIT)
        for track, sole in zip(tracks, motion.soles, strict=True)
    ]
    sharp, offset = (np.array(values) for values in zip(*of_soles, strict=True))
    if seen is not None and np.ptp(offset) > LEAVE_HEIGHT * motion.leg_length:
        return seen  # the feet of one body stand on one ground: these heights are those of feet that swing
    dated = [
        _beside(sharp[index], np.delete(sharp, index, axis=0), track.velocity - drift, motion)
        for index, track in enumerate(tracks)
    ]
    touching = np.stack(dated, axis=1)
    normal = np.stack([track.normal for track in tracks], axis=1)
    clearance = np.stack([track.clearance for track in tracks], axis=1) - offset
    if seen is None:
        return Contacts(touching, offset, normal, clearance)
    # What a limb that rolls turns to the ground has no speed of its own; and calm skin on the ground bears where
    # nothing else does.
    limb = np.array([sole.sole.prop is not None for sole in motion.soles])
    touching = np.where(limb, touching, _shown(touching, seen))
    touching |= seen.touching & (limb | ~touching.any(axis=1, keepdims=True))
    return Contacts(touching, offset, normal, clearance, seen.aloft)


def _shown(touching: Mask, seen: Contacts) -> Mask:
    """What touches by its speed, or by its skin where feet tremble or slide too fast for their speed to tell.

    Left out is what the skin shows in the air, and contacts in which the skin of a sole never bears that bears at other
    times; but for those that an end of the shot cuts, where the sole is as low as when it bears: there the skin shows
    less.
    """
    shown = touching.copy() if seen.aloft is None else touching & ~seen.aloft
    for sole in np.flatnonzero(seen.touching.any(axis=0)):
        for first, last in zip(*runs(seen.touching[:, sole]), strict=True):
            seen_at = np.flatnonzero(shown[first:last, sole])
            if len(seen_at):  # it does not leave and land again while its skin bears on
                shown[first + seen_at[0] : first + seen_at[-1], sole] = True
            if shown[first:last, sole].mean() < SURE:
                shown[first:last, sole] = True
        bears, clearance = seen.touching[:, sole], seen.clearance[:, sole]
        low = clearance[bears].max()
        for first, last in zip(*runs(shown[:, sole]), strict=True):
            is_cut = first == 0 or last == len(shown)
            shown[first:last, sole] = bears[first:last].any() or (is_cut and clearance[first:last].min() <= low)
    return shown


def _seen_on_skin(motion: CharacterMotion, terrain: Terrain, tracks: list[_Track]) -> Contacts | None:
    """The contacts that the skin shows, at one offset for the character, where the ground is level under them."""
    level, bears = motion.ground_level, [sole.bears for sole in motion.soles]
    if level is None or any(seen is None for seen in bears):
        return None
    touching = np.stack([seen for seen in bears if seen is not None], axis=1)
    clearance = np.stack([track.clearance for track in tracks], axis=1)
    touching &= np.isfinite(clearance)
    under = [sole.landmark_positions()[on, :, :2] for sole, on in zip(motion.soles, touching.T, strict=True)]
    places = np.concatenate([points.reshape(-1, 2) for points in under])
    heights = terrain.heights(*places.T)
    heights = heights[np.isfinite(heights)]
    if not len(heights) or np.ptp(heights) > TOUCH_HEIGHT * motion.leg_length:
        return None
    offset = level - float(np.median(heights))
    if abs(offset) > FLOAT_LIMIT * motion.leg_length:
        return None
    normal = np.stack([track.normal for track in tracks], axis=1)
    clearance -= offset
    aloft = clearance > bearing.LEAVE * motion.skin.height if motion.skin else None
    return Contacts(touching, np.full(len(tracks), offset), normal, clearance, aloft)


@dataclass(frozen=True)
class _Track:
    """One sole over its ground: clearance, velocity and height of the ground's normal at its lowest landmark."""

    clearance: Array  # (N,) [m]
    velocity: Array  # (N, 3) [m/s]
    rise: Array  # (N, L) clearance of every landmark [m]
    normal: Array  # (N, 3)


def _track(sole: SoleMotion, motion: CharacterMotion, terrain: Terrain) -> Slices[_Track]:
    points = sole.landmark_positions()

    def during(steps: slice) -> Array:
        under = up_to(terrain, points[steps, :, 2] + LEAVE_HEIGHT * motion.leg_length)
        clearance, normals = clearances(points[steps], under, reach=SLOPE_PROBE * motion.leg_length)
        lowest = clearance.argmin(axis=1)[:, None]
        return np.concatenate([clearance, np.take_along_axis(normals, lowest[..., None], axis=1)[:, 0]], axis=1)

    rise, normal = np.split((yield from in_stretches.slices(during, len(points))), [points.shape[1]], axis=1)
    lowest = rise.argmin(axis=1)
    velocity = _velocities(points, lowest, motion.time_step)
    return _Track(rise.min(axis=1), velocity, rise, normal)


def _velocities(points: Array, chosen: NDArray[np.intp], step: float) -> Array:
    """Velocity at each step of the chosen one (N,) of some points (N, L, 3), (N, 3) [m/s]: the slower of the steps
    before and after, so that a jump of the pose does not widen."""
    if len(points) < 2:
        return np.zeros_like(points[:, 0])
    now, last = np.arange(len(points)), len(points) - 2
    before, after = (
        (points[start + 1, chosen] - points[start, chosen]) / step
        for start in (np.maximum(now - 1, 0), np.minimum(now, last))
    )
    slower = np.linalg.norm(before, axis=-1, keepdims=True) < np.linalg.norm(after, axis=-1, keepdims=True)
    return np.where(slower, before, after)


def _body_velocity(motion: CharacterMotion) -> Array:
    """Horizontal velocity of the body, (N, 3) [m/s]: that of its hips."""
    path = motion.hips
    if len(path) < 2:
        return np.zeros_like(path)
    return np.gradient(path, motion.time_step, axis=0) * (1.0, 1.0, 0.0)


def _ground_drift(tracks: list[_Track], motion: CharacterMotion) -> Array:
    """Horizontal velocity that the soles have while they stand, (3,) [m/s].

    0 in a sound animation; the belt's in a walk on the spot.
    """
    low = [track.velocity[track.clearance < _low(track.clearance, motion.leg_length)] for track in tracks]
    drift = np.median(np.concatenate(low), axis=0) * (1.0, 1.0, 0.0) if any(map(len, low)) else np.zeros(3)
    return drift * (np.linalg.norm(drift) > slowest_belt([track.velocity for track in tracks], motion))


def slowest_belt(velocities: Sequence[Array], motion: CharacterMotion) -> float:
    """Speed below which soles that slide while they stand are on no belt [m/s].

    Parameters
    ----------
    velocities : sequence of (N, 2 or 3) float array
        Of each sole [m/s].
    """
    fastest = max(float(np.percentile(np.linalg.norm(velocity[:, :2], axis=1), 95)) for velocity in velocities)
    unit = motion.froude_speed
    return min(REST_SPEED * unit, max(BELT_SHARE * fastest, SLOWEST_TOUCH * unit))


def _low(clearance: Array, leg_length: float) -> float:
    """The clearance below which a sole may well be standing [m]."""
    finite = clearance[np.isfinite(clearance)]
    return float(np.percentile(finite, FLOAT_PERCENTILE)) + TOUCH_HEIGHT * leg_length if len(finite) else 0.0


def _detect(
    track: _Track, drift: Array, body_speed: Array, motion: CharacterMotion, float_limit: float
) -> tuple[Mask, float]:
    """Steps at which a sole touches, and the float that was removed."""
    leg = motion.leg_length
    speed = np.linalg.norm(track.velocity - drift, axis=-1)
    offset = _float(track.clearance, speed / motion.froude_speed, float_limit * leg)
    limit = np.maximum(_touch_speed(track.velocity - drift, motion), body_speed)
    height = (track.clearance - offset) / leg
    touching = hysteresis(
        (height < TOUCH_HEIGHT) & (speed < limit), (height > LEAVE_HEIGHT) | (speed > LEAVE_SPEED * limit)
    )
    unit = motion.pendulum_time / motion.time_step
    touching = close_short(touching, round(SHORTEST_CONTACT * unit))
    return _sharpened(touching, track, motion), offset


def _touch_speed(velocity: Array, motion: CharacterMotion) -> float:
    """Speed below which a sole may touch [m/s]: by its own way over time, in which jitter counts for nothing."""
    window = max(1, round(BESIDE * motion.pendulum_time / motion.time_step))
    way = np.diff(np.cumsum(np.pad(velocity, ((window, 0), (0, 0))), axis=0)[window - 1 :: window], axis=0) / window
    if not len(way):
        return TOUCH_SPEED * motion.froude_speed
    highest = float(np.percentile(np.linalg.norm(way, axis=1), 95)) / motion.froude_speed
    rests = highest < SLOWEST_TOUCH
    return motion.froude_speed * (TOUCH_SPEED if rests else np.clip(TOUCH_SHARE * highest, SLOWEST_TOUCH, TOUCH_SPEED))


def _sharpened(touching: Mask, track: _Track, motion: CharacterMotion) -> Mask:
    """Contacts from landing to toe-off: later starts, and ends where the last landmark accelerates upward most."""
    unit = motion.pendulum_time / motion.time_step
    search = round(EDGE_SEARCH * unit)
    rise = np.where(np.isfinite(track.rise), track.rise, 0.0)
    cutoff = EDGE_CUTOFF / (2 * np.pi * motion.pendulum_time)
    _, _, acceleration = smooth_path(rise, motion.time_step, cutoff)
    sharp = np.zeros_like(touching)
    for first, last in zip(*runs(touching), strict=True):
        start, end = first, last
        if first > 0:
            height, at = np.sort(rise[first:last], axis=0), FLOAT_PERCENTILE / 100 * (last - first - 1)
            below, above = height[int(at)], height[min(int(at) + 1, last - first - 1)]
            standing = below + at % 1 * (above - below)  # which np.percentile works out in ten times the time
            landed = (rise[first:last] < standing + LANDED_HEIGHT * motion.leg_length).any(axis=1)
            start += int(landed.argmax())
        if last < len(touching):
            landmark = rise[last].argmin()
            begin = max(last - search, start + 1)
            end = begin + int(np.argmax(acceleration[begin : last + max(search, 1), landmark]))
        sharp[start:end] = True
    return sharp


def _beside(touching: Mask, others: Mask, velocity: Array, motion: CharacterMotion) -> Mask:
    """One sole's contacts (N,), their ends dated by its `velocity` (N, 3) [m/s] where one of `others` (K, N) bears on.

    Beside a foot that bears, the other one comes down flat and gently and touches while it still moves on; it leaves
    long after it has begun to rise, as its toes speed away.
    """
    unit = motion.pendulum_time / motion.time_step
    overlap, beside, swing = (max(round(time * unit), 1) for time in (SHORTEST_CONTACT, BESIDE, SWING))
    along, speed = np.linalg.norm(velocity[:, :2], axis=1), np.linalg.norm(velocity, axis=1)
    dated = touching.copy()
    for first, last in zip(*runs(touching), strict=True):
        if first > 0 and others[:, max(first - beside, 0) : first + overlap].all(axis=1).any():
            stop = min(first + beside, last)
            late = along[first:stop] > STRIKE_SPEED * motion.froude_speed
            dated[first : first + int((~late).argmax())] = False
        if last < len(touching) and others[:, max(last - overlap, 0) : last + beside].all(axis=1).any():
            limit = min(TOE_OFF_SPEED * motion.froude_speed, TOE_OFF_SHARE * float(speed[last : last + swing].max()))
            begin = max(last - overlap, first + 1)
            fast = speed[begin : last + beside] > limit
            if fast.any():
                end = begin + int(fast.argmax())
                dated[min(end, last) : max(end, last)] = end > last
    return dated


def _float(height: Array, speed: Array, limit: float) -> float:
    """The clearance at which a sole stands [m], 0 when it never does."""
    near = np.abs(height) < limit
    standing = near & (speed < REST_SPEED)
    if not standing.any():
        standing = near
    return float(np.percentile(height[standing], FLOAT_PERCENTILE)) if standing.any() else 0.0
