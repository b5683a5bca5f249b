"""Motions made fit for derivatives: stepped keys bridged, loops continued beyond their ends.

Only the estimate of contacts and forces uses these; the ground is pressed by the motion as it is shown.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .contacts import runs
from .motion import CharacterMotion, orthonormal

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SAME_POSE = 1e-5
"""Poses that differ by less are the same, in leg lengths."""
LONGEST_HOLD = 0.25
"""A pose that stays longer is a rest and not a stepped key [s]: keys on threes at 12 frames a second."""
LOOP_POSE = 0.01
"""How well the last pose of a loop matches its first, in leg lengths."""
LOOP_VELOCITY = 0.1
"""How well its velocity does, in sqrt(gravity·leg length)."""
CONTINUATION = 3.0
"""How far a loop is continued beyond each end, in sqrt(leg length/gravity) (1 s for an adult)."""


def without_holds(motion: CharacterMotion) -> CharacterMotion:
    """The motion between stepped keys, where poses are held for a few frames each.

    Every pose stays at the frame where it first shows; the frames that repeat it are interpolated.
    """
    held = _held(motion)
    if not held.any():
        return motion
    known = np.flatnonzero(~held)
    return _mapped(motion, lambda samples: _hermite(samples[known], known.astype(float), len(held)))


def continued(motion: CharacterMotion) -> tuple[CharacterMotion, int]:
    """A loop with parts of the cycles before and after it; any other motion as it is.

    Returns
    -------
    motion : CharacterMotion
    margin : int
        Frames added at each end.
    """
    count = len(motion.frames)
    if not is_loop(motion):
        return motion, 0
    seconds = CONTINUATION * np.sqrt(motion.leg_length / motion.gravity)
    margin = min(count - 1, round(seconds / motion.time_step))
    progress = _progress(motion)
    order = np.arange(-margin, count + margin)
    cycle, within = np.divmod(order, count - 1)
    cycle[-margin - 1], within[-margin - 1] = 0, count - 1  # the last frame itself, exactly as given

    def extended(samples: Array) -> Array:
        longer = samples[within].copy()
        if samples.ndim == 4:  # poses (F, P, 4, 4)
            longer[..., :3, 3] += cycle[:, None, None] * progress
        else:
            longer += cycle[:, None] * progress
        return longer

    frame = motion.frames[1] - motion.frames[0]
    longer = _mapped(motion, extended)
    return dataclasses.replace(longer, frames=motion.frames[0] + frame * order), margin


def is_loop(motion: CharacterMotion) -> bool:
    """Whether the last frame is the first one again, moved on by the distance of a cycle."""
    if len(motion.frames) < 4:
        return False
    points = np.concatenate(
        [path[:, None] for path in motion.joints.values()] + [sole.landmark_positions() for sole in motion.soles],
        axis=1,
    )
    gap = points[-1] - points[0] - _progress(motion)
    start, end = points[1] - points[0], points[-1] - points[-2]
    speed = np.sqrt(motion.gravity * motion.leg_length)
    same_pose = np.linalg.norm(gap, axis=-1).max() < LOOP_POSE * motion.leg_length
    return bool(same_pose and np.linalg.norm(start - end, axis=-1).max() < LOOP_VELOCITY * speed * motion.time_step)


def _progress(motion: CharacterMotion) -> Array:
    """How far the motion carries the body from its first to its last frame, (3,) [m]."""
    path = motion.joints.get("hips", motion.soles[0].transforms[:, 0, :3, 3])
    return path[-1] - path[0]


def _held(motion: CharacterMotion) -> Mask:
    """Frames that repeat the pose of the frame before, in holds too short to be rests."""
    poses = np.concatenate(
        [sole.transforms.reshape(len(motion.frames), -1) for sole in motion.soles] + list(motion.joints.values()),
        axis=1,
    )
    held = np.zeros(len(poses), dtype=bool)
    held[1:] = np.abs(np.diff(poses, axis=0)).max(axis=1) < SAME_POSE * motion.leg_length
    for first, last in zip(*runs(held), strict=True):
        if (last - first + 1) * motion.time_step > LONGEST_HOLD or last == len(held):
            held[first:last] = False
    return held


def _mapped(motion: CharacterMotion, change: Callable[[Array], Array]) -> CharacterMotion:
    """The motion with every pose and joint path changed likewise."""
    soles = tuple(dataclasses.replace(sole, transforms=orthonormal(change(sole.transforms))) for sole in motion.soles)
    return dataclasses.replace(motion, soles=soles, joints={name: change(path) for name, path in motion.joints.items()})


def _hermite(samples: Array, places: Array, count: int) -> Array:
    """C1 cubic interpolation of samples at uneven places, at 0, 1, ... count - 1."""
    at = np.arange(count, dtype=float)
    index = np.clip(np.searchsorted(places, at, side="right") - 1, 0, max(len(places) - 2, 0))
    if len(places) < 2:
        return np.repeat(samples, count, axis=0)
    slope = np.gradient(samples, places, axis=0)
    width = places[index + 1] - places[index]
    shape = (-1, *[1] * (samples.ndim - 1))
    u, width = np.clip((at - places[index]) / width, 0.0, 1.0).reshape(shape), width.reshape(shape)
    a, b, da, db = samples[index], samples[index + 1], slope[index] * width, slope[index + 1] * width
    return a + u * (da + u * (3 * (b - a) - 2 * da - db + u * (2 * (a - b) + da + db)))
