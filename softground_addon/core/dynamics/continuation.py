"""Motions made fit for derivatives: stepped keys bridged, loops and gaits continued beyond their ends.

Only the estimate of contacts and forces uses these; the ground is pressed by the motion as it is shown.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from math import ceil

import numpy as np
from numpy.typing import NDArray

from ..motion.motion import CharacterMotion
from ..motion.sole_motion import orthonormal
from ..numerics.arrays import Array, Mask
from ..numerics.interpolation import cubic, in_stretches, linear
from ..numerics.intervals import runs

SAME_POSE = 1e-5
"""Poses that differ by less are the same, in leg lengths."""
LONGEST_HOLD = 0.25
"""A pose that stays longer is a rest and not a stepped key [s]: keys on threes at 12 frames a second."""
EASE = 1 / 24
"""Time between keys [s]: those of most actions, which ease from the first key and into the last."""
WHOLE = 0.3
"""Part of a frame by which it may be longer than whole frames: at 30 a second, keys of 24 are seen in no second one."""
LATE = 0.0, 0.25, 0.5, 0.75
"""Part of a frame after which the first key may come where that is not known: it is held until then."""
SAME_TIME = 1e-3
"""Keys that are nearer to a frame are on it, in frames."""
HANDLE = 1 / 2.5614
"""Length of an automatic handle, in times between keys."""
NEAREST = 0.5
"""Frames from the first key, or to the last, within which the next sample tells no speed."""
FEW = 4
"""Samples of motions that are too short for that."""
STARTS = 0.01
"""A body that moves less in that time stands or stops, in leg lengths (0.2 m/s for an adult)."""
STEADY = 0.6
"""Share of its speed between the next two keys that a body that eases has on average before: cut walks have about 1,
what lands or starts with an even force less than 0.5."""
NEARER = 0.3
"""It eases if it is nearer by this to what lies between such keys than to what would go on as beyond them: cut walks
come to 0.07 to 0.23, landings and push-offs between force plates to 0.8 and more."""
LIKE_POSE = 0.05
"""Poses are alike when joints and soles are this near on average, in leg lengths (5 cm for an adult)."""
VELOCITY_WEIGHT = 0.3
"""A difference of velocity counts as one of position after this time, in sqrt(leg length/gravity) (0.1 s)."""
CONTINUATION = 1.0
"""How far a motion is continued beyond each end, in the same unit (0.3 s)."""


def without_holds(motion: CharacterMotion) -> CharacterMotion:
    """The motion between stepped keys, where poses are held for a few frames each.

    Every pose stays at the frame where it first shows; the frames that repeat it are interpolated, and those between
    the keys at both ends of the action. Soles alone do not tell held poses from feet that all stand while their body
    goes on: without joints, skin bears when it did.
    """
    every, places = np.arange(len(motion.frames), dtype=float), _places(motion)
    held = _held(motion) | _eased(motion, places)
    for end, beside in ((0, 1), (-1, -2)) if len(held) > FEW else ():
        held[beside] |= abs(places[end] - places[beside]) < NEAREST
    known = np.flatnonzero(~held)
    if len(known) == len(held) and (places == every).all():
        return motion

    def bridged(samples: Array) -> Array:
        shown = samples[known].copy()
        shown[0] = _beyond(samples[known[:3]], places[known[:3]], 0.0)
        shown[-1] = _beyond(samples[known[:-4:-1]], places[known[:-4:-1]], every[-1])
        return cubic(shown, every, every[known])

    smooth = _mapped(motion, bridged)
    if motion.joints:
        return smooth
    pairs = zip(smooth.soles, motion.soles, strict=True)
    return dataclasses.replace(smooth, soles=tuple(dataclasses.replace(new, bears=sole.bears) for new, sole in pairs))


def continued(motion: CharacterMotion) -> tuple[CharacterMotion, slice]:
    """A motion that goes on for a moment beyond both of its ends, where it has been in the same pose before.

    After the last pose comes what followed the pose most like it, before the first one what preceded its like: exact
    for loops, near for a few strides of a gait and for standing still. Where no pose is like it, the motion ends.

    Returns
    -------
    motion : CharacterMotion
    given : slice
        Which of its frames are those of the given motion.
    """
    count = len(motion.frames)
    margin = max(1, round(CONTINUATION * motion.pendulum_time / motion.time_step))
    if count < 2 * margin:
        return motion, slice(0, count)
    before = _most_like(motion, 0, np.arange(margin, count))
    after = _most_like(motion, count - 1, np.arange(count - margin))

    def extended(samples: Array) -> Array:
        pieces = [samples]
        if before is not None:
            pieces.insert(0, samples[before - margin : before] + _offset(samples, 0, before))
        if after is not None:
            pieces.append(samples[after + 1 : after + 1 + margin] + _offset(samples, count - 1, after))
        return np.concatenate(pieces)

    longer = _mapped(motion, extended)
    first = 0 if before is None else margin
    frame = motion.frames[1] - motion.frames[0]
    total = len(next(iter(longer.soles)).transforms)
    frames = motion.frames[0] + frame * (np.arange(total) - first)
    return dataclasses.replace(longer, frames=frames), slice(first, first + count)


def _most_like(motion: CharacterMotion, frame: int, others: NDArray[np.intp]) -> int | None:
    """The one of `others` whose pose and velocity are most like those at an end of the motion, if any are alike."""
    paths = [*motion.joints.values(), *(sole.landmark_positions().mean(axis=1) for sole in motion.soles)]
    count = len(motion.frames)

    def points(frames: NDArray[np.intp]) -> Array:
        places = np.stack([path[frames] for path in paths], axis=1)
        return places - places.mean(axis=1, keepdims=True) * (1.0, 1.0, 0.0)

    def velocity(frames: NDArray[np.intp]) -> Array:
        # One-sided, as at the end itself: from the step after the first frame, from the step before the last.
        start = np.clip(frames - (frame > 0), 0, count - 2)
        return (points(start + 1) - points(start)) / motion.time_step

    here = np.array([frame])
    weight = VELOCITY_WEIGHT * motion.pendulum_time

    def distances(part: slice) -> Array:
        frames = others[part]
        moved = weight * (velocity(frames) - velocity(here))
        return np.sqrt(((points(frames) - points(here)) ** 2 + moved**2).sum(axis=-1).mean(axis=-1))

    distance = in_stretches(distances, len(others))
    best = int(distance.argmin())
    return int(others[best]) if distance[best] < LIKE_POSE * motion.leg_length else None


def _offset(samples: Array, frame: int, other: int) -> Array:
    """Offset of the samples near `other` so that they go on from `frame`; poses only move, not turn."""
    offset = samples[frame] - samples[other]
    if samples.ndim == 4:  # poses (F, P, 4, 4)
        offset[..., :3, :3] = 0.0
    return offset


def _held(motion: CharacterMotion) -> Mask:
    """Frames that repeat the pose of the frame before, in holds too short to be rests."""
    held = np.ones(len(motion.frames), dtype=bool)
    held[0] = False
    for path in (*(sole.transforms for sole in motion.soles), *motion.joints.values()):
        moved = np.abs(np.diff(path, axis=0)).reshape(len(path) - 1, -1).max(axis=1)
        held[1:] &= moved < SAME_POSE * motion.leg_length
    for first, last in zip(*runs(held), strict=True):
        if (last - first + 1) * motion.time_step > LONGEST_HOLD or last == len(held):
            held[first:last] = False
    return held


def _places(motion: CharacterMotion) -> Array:
    """Places of the samples among themselves: of the first and the last, where keys begin and end within a frame of
    them, that of the key; its pose is held from there."""
    count = len(motion.frames)
    places = np.arange(count, dtype=float)
    if motion.animated and count > 1:
        first, last = (np.array(motion.animated) - motion.frames[0]) / (motion.frames[1] - motion.frames[0])
        if SAME_TIME < first < 1:
            places[0] = first
        if SAME_TIME < count - 1 - last < 1:
            places[-1] = last
    return places


def _beyond(samples: Array, places: Array, at: float) -> Array:
    """Value at a place, by the parabola through three samples (3, ...) at theirs; the first one at its own."""
    if len(places) < 3 or at == places[0]:
        return np.asarray(samples[0])
    shares = [np.prod([(at - other) / (place - other) for other in places if other != place]) for place in places]
    return np.tensordot(shares, samples, 1)


def _eased(motion: CharacterMotion, places: Array) -> Mask:
    """Frames within `EASE` of an end at which the whole body eases as between keys.

    The first and the last key of a cut take have flat handles: what walks on in the take seems to stand there, the more
    so the more frames there are between keys. Bodies that start, land or stop in that time do not move like that.
    """
    paths = [*motion.joints.values(), *(sole.landmark_positions().mean(axis=1) for sole in motion.soles)]
    eased, between = np.zeros(len(motion.frames), dtype=bool), EASE / motion.time_step
    if not 1 < ceil(between - WHOLE) < len(eased) / 4:
        return eased
    for order, known in ((slice(None), places[0]), (slice(None, None, -1), len(eased) - 1 - places[-1])):
        path = np.stack([path[order][: ceil(3 * between) + 2] for path in paths], axis=1)
        late = (float(known),) if known else LATE
        ends = [ceil(held + between - WHOLE) for held in late if _eases(path, between, held, motion.leg_length)]
        eased[order][1 : max(ends, default=1)] = True
    return eased


def _eases(path: Array, between: float, late: float, leg_length: float) -> bool:
    """True of joints (F, J, 3) that ease from a key `late` frames after the first to the next, `between` frames on."""
    count = ceil(late + between - WHOLE)
    place = np.clip((np.arange(1, count) - late) / between, 0.0, 1.0)
    keys = np.concatenate([path[:1], linear(path, late + between * np.arange(1, 4))])
    way, after = keys[1] - keys[0], keys[2] - keys[1]
    if np.linalg.norm(way, axis=1).mean() <= STARTS * leg_length or (way * after).sum() < STEADY * (after**2).sum():
        return False
    part = np.linspace(0.0, 1.0, 101)
    time = 3 * part * (1 - part) * (HANDLE * (1 - part) + (1 - HANDLE) * part) + part**3
    part = np.interp(place, time, part)[:, None, None]
    handle = keys[1] - HANDLE * (keys[2] - keys[0]) / 2
    ease = keys[0] + 3 * part**2 * (1 - part) * (handle - keys[0]) + part**3 * way
    return bool(np.linalg.norm(path[1:count] - ease) < NEARER * np.linalg.norm(path[1:count] - cubic(keys, place)))


def _mapped(motion: CharacterMotion, change: Callable[[Array], Array]) -> CharacterMotion:
    """The motion with every pose and joint path changed likewise."""
    soles = tuple(
        dataclasses.replace(
            sole,
            transforms=orthonormal(change(sole.transforms)),
            bears=None if sole.bears is None else change(sole.bears.astype(float)) > 0.5,
        )
        for sole in motion.soles
    )
    return dataclasses.replace(motion, soles=soles, joints={name: change(path) for name, path in motion.joints.items()})
