"""Movement of a sole during a contact, stored with its footprint so that an edited step can be pressed again.

Poses and loads are stored as whole multiples of small units, and of those the second differences over time: smooth
motion then takes a byte or two a value. Values are rounded once and then stay the same, in the session of the bake and
in the file alike.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..motion.props import Prop
from ..motion.sole_motion import Sole, SolePatch
from ..numerics.arrays import Array
from ..numerics.orientation import quaternions, rotation_matrices
from ..numerics.packed import Packed

Whole = NDArray[np.int32]

LENGTH = 2.0**-20
"""Unit of lengths [m]: a micrometre."""
TURN = 2.0**-22
"""Unit of the parts of quaternions and unit vectors: a quarter of a micrometre at the tip of a foot."""
PARTS_OF_PEAK = 2**20
"""Units that the largest force of a contact is kept in."""
_POSE = 7
"""Values of a pose: location and rotation."""
_LOAD = 9
"""Values of a load: force, normal, centre of pressure."""
_LARGEST = 2**31 - 1


@dataclass(frozen=True)
class Steps:
    """Movement of a sole at N steps in a row.

    Attributes
    ----------
    first : int
        Number of the first of them.
    frames : (N,) float array
        Scene frame of each.
    poses : (N, P, 4, 4) float array
        Of the sole's patches.
    approach : (K, P, 4, 4) float array
        Those of one or two steps before.
    forces, normals : (N, 3) float arrays
        Ground reaction force [N] and the ground's unit normal.
    centres : (N, 3) float array
        Centre of pressure [m].
    """

    first: int
    frames: Array
    poses: Array
    approach: Array
    forces: Array
    normals: Array
    centres: Array


@dataclass(frozen=True)
class PressingSole:
    """A sole as it is stored, and the poses of its patches while it is flat.

    Attributes
    ----------
    flat : (P, 4, 4) float array
        Poses of its patches.
    """

    sole: Sole
    flat: Array


def kept_sole(sole: Sole, flat: Array) -> PressingSole:
    """A sole rounded as the record stores it."""
    patches = tuple(
        replace(patch, heights=_rounded(patch.heights, LENGTH), signed_distance=_rounded(patch.signed_distance, LENGTH))
        for patch in sole.patches
    )
    prop = sole.prop
    if prop is not None:
        prop = Prop(_rounded(prop.vertices, LENGTH), np.asarray(prop.triangles, np.int32), prop.give)
    return PressingSole(replace(sole, patches=patches, prop=prop), flat)


@dataclass(frozen=True)
class ContactSteps:
    """The steps of one contact as they are stored.

    Attributes
    ----------
    pressing : PressingSole
        Shared by all contacts of a sole.
    first, approach : int
        Number of the first step, and of steps before it whose poses are known.
    time_step : float
        Duration of a step [s].
    origin : (3,) float array
        Origin of lengths [m].
    peak : float
        Largest part of a force [N].
    coded : (K + N, P·7 + 9) int array, flat
        Second differences over time of poses and loads, in their units; before the contact the loads are 0.
    """

    pressing: PressingSole
    first: int
    approach: int
    time_step: float
    origin: Array
    peak: float
    coded: Packed[np.int32] = Packed()

    @property
    def count(self) -> int:
        """Number of steps, with those of the approach."""
        return len(self.coded) // width_of(self.pressing)

    def steps(self, frames: Array) -> Steps:
        """The steps, at these scene frames (N,)."""
        values = decoded(self.coded.reshape(-1, width_of(self.pressing)))
        parts, before = len(self.pressing.flat), self.approach
        of_poses = values[:, : _POSE * parts].reshape(len(values), parts, _POSE)
        poses = np.zeros((len(values), parts, 4, 4))
        poses[..., :3, 3] = of_poses[..., :3] * LENGTH + self.origin
        turned = of_poses[..., 3:].reshape(-1, 4)
        poses[..., :3, :3] = rotation_matrices(turned).reshape(len(values), parts, 3, 3)
        poses[..., 3, 3] = 1.0
        forces, normals, centres = np.moveaxis(values[before:, _POSE * parts :].reshape(-1, 3, 3), 1, 0)
        normals = normals * TURN
        length = np.linalg.norm(normals, axis=-1, keepdims=True)
        return Steps(
            self.first,
            frames,
            poses[before:],
            poses[:before],
            forces * (self.peak / PARTS_OF_PEAK),
            np.divide(normals, length, out=np.tile([0.0, 0.0, 1.0], (len(normals), 1)), where=length > 0),
            centres * LENGTH + self.origin,
        )


def width_of(pressing: PressingSole) -> int:
    """Values that are kept of each step of a sole's contact."""
    return _POSE * len(pressing.flat) + _LOAD


def kept_steps(pressing: PressingSole, steps: Steps, time_step: float) -> ContactSteps:
    """The steps of a contact, rounded as the record stores them."""
    poses = np.concatenate([steps.approach, steps.poses])
    origin = np.round(steps.poses[0, 0, :3, 3])
    peak = float(np.abs(steps.forces).max()) or 1.0
    turned = quaternions(poses[..., :3, :3].reshape(-1, 3, 3)).reshape(*poses.shape[:2], 4)
    of_poses = np.concatenate([(poses[..., :3, 3] - origin) / LENGTH, turned / TURN], axis=-1)
    loads = [steps.forces * (PARTS_OF_PEAK / peak), steps.normals / TURN, (steps.centres - origin) / LENGTH]
    of_loads = np.concatenate([np.zeros((len(steps.approach), _LOAD)), np.concatenate(loads, axis=1)])
    values = np.concatenate([of_poses.reshape(len(poses), -1), of_loads], axis=1)
    return ContactSteps(pressing, steps.first, len(steps.approach), time_step, origin, peak, coded(values).reshape(-1))


def coded(values: Array) -> Whole:
    """Rounded values (N, ...) as their second differences along the first axis.

    Examples
    --------
    >>> coded(np.array([3.0, 5.0, 7.1, 9.0])).tolist()
    [3, -1, 0, 0]
    """
    whole = np.clip(np.rint(np.nan_to_num(values)), -_LARGEST, _LARGEST).astype(np.int64)
    zero = np.zeros((1, *whole.shape[1:]), np.int64)
    for _ in range(2):
        whole = np.diff(whole, axis=0, prepend=zero)
    return _wrapped(whole)


def decoded(differences: NDArray[Any]) -> Array:
    """Values (N, ...) from the result of `coded`.

    Examples
    --------
    >>> decoded(np.array([3, -1, 0, 0], np.int32)).tolist()
    [3.0, 5.0, 7.0, 9.0]
    """
    sums = differences
    for _ in range(2):
        sums = _wrapped(np.cumsum(sums, axis=0, dtype=np.int64))
    return np.asarray(sums, np.float64)


def _wrapped(values: NDArray[np.int64]) -> Whole:
    """Whole numbers modulo 2^32: sums of differences come back whatever their size."""
    return (values & 0xFFFFFFFF).astype(np.uint32).view(np.int32)


def _rounded(values: Array, unit: float) -> Array:
    return decoded(coded(values / unit)) * unit


def patch_of(maps: NDArray[Any], origin: Array, spacing: float) -> SolePatch:
    """A patch from its coded maps (2, rows, columns)."""
    heights, distance = (decoded(part) * LENGTH for part in maps)
    return SolePatch(heights, distance, origin, spacing)
