"""Motions of a body: rotations of its bones, the path of its root, and what it touches when.

Everything is in the body's frame (`body.py`): x forward, y left, z up.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

Bones = dict[str, tuple[str, str, str | None]]
"""Bone name -> (joint at its head, joint at its tail, parent bone); parents come before children, the root is first."""


class Skeleton(Protocol):
    """Anything with bones between joints: a person, a dog."""

    @property
    def bones(self) -> Bones:
        """The bones and how they hang together."""

    @property
    def joints(self) -> dict[str, Array]:
        """Joint places in the rest pose, (3,) each [m]."""


@dataclass(frozen=True)
class Footfall:
    """One contact of one foot: what a bake should find.

    Attributes
    ----------
    side : str
        Suffix of the foot's bones: "L" or "R"; four-legged bodies add "FL" and "FR".
    strike, leave : float
        Times of first and last touch [s].
    place : (3,) float array
        Point of the ground below the ankle while the foot stands flat [m].
    heading : float
        Direction of the toes about z, 0 along x [rad].
    slope, bank : float
        Rise of the ground under the foot toward the toes and toward its left [rad].
    """

    side: str
    strike: float
    leave: float
    place: Array
    heading: float = 0.0
    slope: float = 0.0
    bank: float = 0.0


@dataclass(frozen=True)
class BodyMotion:
    """A motion of a body, as rotations of its bones.

    Attributes
    ----------
    frame_rate : float
        [Hz].
    hips : (F, 3) float array
        Place of the joint at the root bone's head [m].
    turns : dict of str to (F, 3, 3) float array
        Rotation of each bone from its rest pose, in the body's frame.
    footfalls : tuple of Footfall
    """

    frame_rate: float
    hips: Array
    turns: dict[str, Array]
    footfalls: tuple[Footfall, ...] = field(default=())


def joint_paths(body: Skeleton, motion: BodyMotion) -> dict[str, Array]:
    """Places of all joints over time, (F, 3) each [m]: the forward kinematics of a motion."""
    rest = body.joints
    paths: dict[str, Array] = {}
    for bone, (head, tail, parent) in body.bones.items():
        if parent is None:
            paths[head] = motion.hips
        else:
            parent_head = body.bones[parent][0]
            paths[head] = paths[parent_head] + motion.turns[parent] @ (rest[head] - rest[parent_head])
        paths[tail] = paths[head] + motion.turns[bone] @ (rest[tail] - rest[head])
    return paths


def rotation(axis: str, angle: Array | float) -> Array:
    """Right-handed rotations about a coordinate axis, (..., 3, 3), for angles (...) [rad]."""
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    result = np.zeros((*np.shape(angle), 3, 3))
    result[..., i, i] = 1.0
    result[..., j, j] = result[..., k, k] = np.cos(angle)
    result[..., k, j] = np.sin(angle)
    result[..., j, k] = -result[..., k, j]
    return result
