"""What a rig did: sole poses and joints over time, as plain arrays in SI units, Z up.

This is the border between Blender and the physics. Everything that the core knows about a character is in one
`CharacterMotion`; nothing in it refers to bones or objects.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import ceil
from typing import cast

import numpy as np
from numpy.typing import NDArray

from ..numerics.interpolation import Between, cubic, in_stretches, linear, turning
from .props import Prop

Array = NDArray[np.float64]

SIMULATION_RATE = 120.0
"""Lowest rate of the internal time grid, in Hz: at 24, 30, 60 and 120 fps the steps fall on the same instants."""

STILL = 1e-6
"""What moves less does not move, in leg lengths: positions come in single precision."""

ADULT_LEG = 0.9
"""Leg length that times are given for [m]; they scale with its square root (equal Froude numbers)."""

TALLEST, SMALLEST = 20.0, 0.05
"""Bodies beyond these are mostly of a file in other units [m]: nothing on legs was taller, little is smaller."""

COARSER = 4.0
"""How much coarser the cells are at most, along the longest sole, than the preset says, for those along the shortest to
be as it says."""

_LIMB_JOINTS = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle", "ball", "toe")

JOINTS = ("hips", "spine", "neck", "head", *(f"{joint}_{side}" for side in "lr" for joint in _LIMB_JOINTS))
"""Names that `CharacterMotion.joints` may hold. `toe` is the tip of the foot; any may be missing."""


def scale_to_metres(size: float) -> float:
    """Factor that a body of such a size [m] lacks: 0.01 where its file is in centimetres, 100 the reverse, or 1."""
    return 0.01 if size > TALLEST else 100.0 if 0 < size < SMALLEST else 1.0


def shortest_length(lengths: Iterable[float]) -> float:
    """Length of the shortest of some soles by which cells are sized [m]: a fingertip beside a trunk sizes none.

    Examples
    --------
    >>> shortest_length([0.27, 0.19]), shortest_length([0.4, 0.003])
    (0.19, 0.1)
    """
    known = list(lengths)
    return max(min(known), max(known) / COARSER)


@dataclass(frozen=True)
class SolePatch:
    """The underside of one rigid piece of a sole, as two maps over a regular grid.

    The patch frame has x toward the toes, y left and z up when the foot is planted, with z = 0 at the underside's
    lowest point. Node (row, column) of a map is at x = origin[0] + column·spacing, y = origin[1] + row·spacing.

    Attributes
    ----------
    heights : (rows, columns) float array
        Height of the underside in the patch frame [m], continued smoothly outside the outline.
    signed_distance : (rows, columns) float array
        Distance to the patch's outline [m], negative inside.
    origin : (2,) float array
        Position of node (0, 0) [m].
    spacing : float
        Distance between nodes [m].
    """

    heights: Array
    signed_distance: Array
    origin: Array
    spacing: float

    @property
    def area(self) -> float:
        """Area inside the outline [m²], with edge nodes counted by their covered fraction."""
        return float(np.clip(0.5 - self.signed_distance / self.spacing, 0.0, 1.0).sum() * self.spacing**2)


@dataclass(frozen=True)
class Sole:
    """One contact shape: a foot, a hand, a snowshoe.

    Attributes
    ----------
    name : str
        What the user sees, e.g. "foot.L".
    side : str
        "L", "R" or "" for neither.
    patches : tuple of SolePatch
        Rigid pieces from back to front, e.g. (foot, toes); their seams overlap a little, so that a bend leaves no gap.
    landmarks : (L, 3) float array
        Points of the underside that contact detection follows, from back to front (heel, ball, toe tip) [m], each in
        the frame of its patch.
    landmark_patch : (L,) int array
        Index of the patch that each landmark belongs to.
    outline : (N, 2) float array
        The flat sole's outline in the frame of the first patch [m], counter-clockwise, for drawing.
    prop : Prop or None
        The whole surface, in place of patches, of what prints by whatever faces down; its frame is that of the one
        pose that it has.
    underside : (N, M) float array or None
        Heights of the flat sole's mesh from heel to toes and from left to right [m], infinite where there is none;
        None where it is of no mesh.
    bend : float
        How far behind and before the seam of two pieces the skin moves with both [m].
    """

    name: str
    side: str
    patches: tuple[SolePatch, ...]
    landmarks: Array
    landmark_patch: NDArray[np.intp]
    outline: Array
    prop: Prop | None = None
    underside: Array | None = None
    bend: float = 0.0

    @property
    def area(self) -> float:
        """Area of the flat sole [m²], from its outline (shoelace formula)."""
        x, y = self.outline.T
        return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)

    @property
    def length(self) -> float:
        """Length of the flat sole from heel to toe tip [m]."""
        return float(np.ptp(self.outline[:, 0]))

    @property
    def breadth(self) -> float:
        """Breadth of the flat sole from side to side [m]."""
        return float(np.ptp(self.outline[:, 1]))


@dataclass(frozen=True)
class SoleMotion:
    """A sole and the rigid pose of each of its patches over time.

    Attributes
    ----------
    sole : Sole
    transforms : (F, P, 4, 4) float array
        Patch frame to world, rotation and translation only [m]; of the one frame of a prop.
    bears : (F,) bool array or None
        When the skin under it bears on level ground, where that was seen.
    """

    sole: Sole
    transforms: Array
    bears: NDArray[np.bool_] | None = None

    def landmark_positions(self) -> Array:
        """World positions of the sole's landmarks, (F, L, 3) [m]; worked out once, not to be written to."""
        return self._landmark_positions

    @cached_property
    def _landmark_positions(self) -> Array:
        patch, (x, y, z) = self.sole.landmark_patch, self.sole.landmarks.T[..., None]

        def during(steps: slice) -> Array:
            pose = self.transforms[steps][:, patch, :3]
            return np.asarray(pose[..., 0] * x + pose[..., 1] * y + pose[..., 2] * z + pose[..., 3])

        positions = in_stretches(during, len(self.transforms))
        positions.flags.writeable = False
        return positions

    def lowest(self) -> Array:
        """Height of the sole's lowest point, (F,) [m]; of a foot, of its lowest landmark."""
        if self.sole.prop is None:
            return np.asarray(self.landmark_positions()[..., 2].min(axis=1))
        pose = self.transforms[:, 0]
        return np.asarray((pose[:, 2, :3] @ self.sole.prop.probes.T).min(axis=1) + pose[:, 2, 3])

    def at(self, position: Array) -> SoleMotion:
        """The motion at fractional sample indices (K,), those of its samples exactly.

        Between samples a foot moves along a C1 cubic; a prop turns evenly about the shortest way and moves straight,
        so that what rolls keeps its shape and what stops at once does not swing past.
        """
        method = turning if self.sole.prop else _rigid_cubic
        bears = None if self.bears is None else self.bears[np.rint(position).astype(np.intp)]
        return dataclasses.replace(self, transforms=_between(self.transforms, position, method), bears=bears)

    def of(self, samples: slice | NDArray[np.bool_]) -> SoleMotion:
        """Some of the samples."""
        bears = None if self.bears is None else self.bears[samples]
        return dataclasses.replace(self, transforms=self.transforms[samples], bears=bears)


@dataclass(frozen=True)
class LowSkin:
    """The lowest skin of each part of a body over time.

    Attributes
    ----------
    frames : (F,) float array
        Scene frames.
    position : (F, P, 3) float array
        Middle of the lowest patch of each part, at the height of its lowest point [m].
    rise : (F, P) float array
        Speed at which it rises or falls [m/s].
    calm : float
        Slower than this it may rest: the faster the body, the faster [m/s].
    height : float
        Of the body [m].
    mass : float
        That its volume suggests [kg], 0 where it suggests none.
    """

    frames: Array
    position: Array
    rise: Array
    calm: float
    height: float
    mass: float = 0.0


@dataclass(frozen=True)
class CharacterMotion:
    """Everything the core knows about one character.

    Attributes
    ----------
    name : str
        What the user sees: the armature's name.
    mass : float
        Body mass [kg].
    leg_length : float
        Hip to sole in the rest pose [m]; makes contact detection scale-free.
    frames : (F,) float array
        Scene frame numbers, evenly spaced.
    frame_rate : float
        Scene frames per second [Hz].
    soles : tuple of SoleMotion
    joints : dict of str to (F, 3) float array
        World positions of those of `JOINTS` that are mapped [m].
    gravity : float
        Magnitude of gravity [m/s²].
    centre : (F, 3) float array or None
        Centre of mass of a prop without a skeleton, which falls, rolls and slides [m]; None for a character, whose
        joints tell it.
    four_legged : bool
        An animal on four legs: its mass is distributed otherwise than a man's.
    ground_level : float or None
        Height at which its skin rests on level ground [m], where that was seen.
    skin : LowSkin or None
        Where its skin is lowest, at the frames that were read.
    """

    name: str
    mass: float
    leg_length: float
    frames: Array
    frame_rate: float
    soles: tuple[SoleMotion, ...]
    joints: dict[str, Array] = field(default_factory=dict)
    gravity: float = 9.81
    centre: Array | None = None
    four_legged: bool = False
    ground_level: float | None = None
    skin: LowSkin | None = None

    @property
    def times(self) -> Array:
        """Times of the samples [s], 0 at the first."""
        return (self.frames - self.frames[0]) / self.frame_rate

    @property
    def time_step(self) -> float:
        """Time between samples [s]."""
        return float(self.frames[1] - self.frames[0]) / self.frame_rate if len(self.frames) > 1 else 1 / self.frame_rate

    @property
    def fall(self) -> float:
        """Gravity in the units of its file, as its skin tells them [m/s²]: a file in centimetres moves as in metres."""
        return self.gravity / (scale_to_metres(self.skin.height) if self.skin else 1.0)

    @property
    def stands_still(self) -> bool:
        """Whether no joint and no sole moves from sample to sample."""
        paths = (*self.joints.values(), *(sole.transforms for sole in self.soles))
        return all(np.allclose(path, path[:1], rtol=0.0, atol=STILL * self.leg_length) for path in paths)

    @property
    def hips(self) -> Array:
        """Path of the hips (F, 3) [m]; the middle of the hip joints, or above the soles, where they are not mapped."""
        joints = self.joints
        if "hips" in joints:
            return joints["hips"]
        if "hip_l" in joints and "hip_r" in joints:
            return (joints["hip_l"] + joints["hip_r"]) / 2
        middle = np.mean([sole.landmark_positions().mean(axis=1) for sole in self.soles], axis=0)
        return np.asarray(middle + np.array((0.0, 0.0, self.leg_length)))

    @property
    def pendulum_time(self) -> float:
        """sqrt(leg length/gravity) [s], 0.3 s for an adult: times in this unit suit a mouse and a giant."""
        return float(np.sqrt(self.leg_length / self.fall))

    @property
    def froude_speed(self) -> float:
        """sqrt(gravity·leg length) [m/s], 3 m/s for an adult: the speed at a Froude number of 1."""
        return float(np.sqrt(self.fall * self.leg_length))

    @property
    def time_scale(self) -> float:
        """How much slower than an adult's a motion of the same kind is."""
        return float(np.sqrt(self.leg_length / ADULT_LEG))

    @property
    def adult_second(self) -> float:
        """Scene frames in which this body does what an adult does in a second."""
        return self.frame_rate * self.time_scale

    @cached_property
    def on_frames(self) -> NDArray[np.bool_]:
        """Which samples are at scene frames (F,): between them a resampled motion is interpolated."""
        return np.abs((self.frames - self.frames[0] + 0.5) % 1.0 - 0.5) < 1e-6

    @cached_property
    def frame_step(self) -> float:
        """Time between the samples at scene frames [s]."""
        return dataclasses.replace(self, frames=self.frames[self.on_frames]).time_step

    def at_frames(self) -> CharacterMotion:
        """The samples at scene frames alone."""
        return self.of(self.on_frames)

    def first(self, count: int) -> CharacterMotion:
        """The first `count` samples."""
        return self.of(slice(count))

    def of(self, samples: slice | NDArray[np.bool_]) -> CharacterMotion:
        """Some of the samples."""
        return dataclasses.replace(
            self,
            frames=self.frames[samples],
            soles=tuple(sole.of(samples) for sole in self.soles),
            joints={name: path[samples] for name, path in self.joints.items()},
            centre=None if self.centre is None else self.centre[samples],
        )

    def resampled(self, steps_per_frame: int) -> CharacterMotion:
        """The same motion with `steps_per_frame` samples per frame, through C1 cubic interpolation.

        The first sample of each frame is the given one, exactly.
        """
        if steps_per_frame == 1 or len(self.frames) < 2:
            return self
        count = (len(self.frames) - 1) * steps_per_frame + 1
        position = np.arange(count) / steps_per_frame
        return dataclasses.replace(
            self,
            frames=self.frames[0] + position * (self.frames[1] - self.frames[0]),
            soles=tuple(sole.at(position) for sole in self.soles),
            joints={name: _between(path, position, cubic) for name, path in self.joints.items()},
            centre=None if self.centre is None else linear(self.centre, position),
        )


def steps_per_frame(frame_rate: float) -> int:
    """Number of simulation steps in a frame, so that a step is at most 1/`SIMULATION_RATE` s long."""
    return max(1, ceil(SIMULATION_RATE / frame_rate - 1e-6))


def _between(samples: Array, position: Array, method: Callable[[Array, Array], Array]) -> Array:
    """Samples at positions between them, for all who look at them an array."""
    return cast(Array, Between(samples, position, method))


def _rigid_cubic(poses: Array, position: Array) -> Array:
    """Rigid poses along cubics."""
    return orthonormal(cubic(poses, position))


def orthonormal(transforms: Array) -> Array:
    """Nearly rigid transforms made rigid: one Newton step of the polar decomposition."""
    rotation = transforms[..., :3, :3]
    gram = np.swapaxes(rotation, -1, -2) @ rotation
    rigid = transforms.copy()
    rigid[..., :3, :3] = rotation @ (1.5 * np.eye(3) - 0.5 * gram)
    rigid[..., 3, :] = (0.0, 0.0, 0.0, 1.0)
    return rigid


def shortest_sole(motions: Sequence[CharacterMotion]) -> float:
    """Length of the shortest sole of all characters [m]."""
    return shortest_length(sole.sole.length for motion in motions for sole in motion.soles)
