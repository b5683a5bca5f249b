"""Motion of a rig: sole poses and joints over time, as plain arrays in SI units, Z up.

This is the border between Blender and the physics. Everything that the core knows about a character is in one
`CharacterMotion`; nothing in it refers to bones or objects.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import ceil

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array
from ..numerics.interpolation import cubic, linear
from .ground_ride import GroundRide
from .people import has_two_legs
from .sole_motion import SoleMotion, _between, shortest_length
from .units import scale_to_metres

SIMULATION_RATE = 120.0
"""Lowest rate of the internal time grid, in Hz: at 24, 30, 60 and 120 fps the steps fall on the same instants."""

STILL = 1e-6
"""What moves less does not move, in leg lengths: positions come in single precision."""

ADULT_LEG = 0.9
"""Leg length that times are given for [m]; they scale with its square root (equal Froude numbers)."""


JUMP = 0.25
"""A body that moves farther between two frames may jump, in leg lengths, ..."""

JUMPS_AHEAD = 4.0
"""... if that is so many times as far as between any other two frames nearby (1.6 in clips that do not; five frames of
a walk that are cut come to five), ..."""

AROUND_JUMP = 0.25
"""... as long before and after: keys on threes at 12 frames a second are poses that are held, each [s]."""


_LIMB_JOINTS = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle", "ball", "toe")

JOINTS = ("hips", "spine", "neck", "head", *(f"{joint}_{side}" for side in "lr" for joint in _LIMB_JOINTS))
"""Names that `CharacterMotion.joints` may hold. `toe` is the tip of the foot; any may be missing."""

CENTRE = "centre"
"""Beside these, the middle of the body's volume, where nothing else tells where its upper half is."""


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
    on_the_spot : bool
        True if what rests slides back, as on a belt.
    bones, soles : tuple of str
        Bone and sole of each part, empty for none; without parts where they are not known.
    """

    frames: Array
    position: Array
    rise: Array
    calm: float
    height: float
    mass: float = 0.0
    on_the_spot: bool = False
    bones: tuple[str, ...] = ()
    soles: tuple[str, ...] = ()


UP = np.array([0.0, 0.0, 1.0])


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
    joints : dict of str to (F, 3) float array
        World positions of those of `JOINTS` that are mapped, and of `CENTRE` [m].
    gravity : float
        Magnitude of gravity [m/s²].
    centre : (F, 3) float array or None
        Centre of mass of a prop without a skeleton, which falls, rolls and slides [m]; None for a character, whose
        joints tell it.
    four_legged : bool
        An animal on four legs: its mass is distributed otherwise than a man's.
    legs : int or None
        How many of its soles are those of legs; None for all.
    ground_level : float or None
        Height at which its skin rests on level ground [m], where that was seen.
    skin : LowSkin or None
        Where its skin is lowest, at the frames that were read.
    stature : float
        Height of its bones at rest [m], or a third of their length if it is low; on two legs without a skin, by the
        length of its legs. 0 without a rig.
    size : float
        Largest extent of its bones at rest, or on two legs the height that suits these if that is more [m]; 0 without
        a rig.
    bones_move : bool
        True if some bone that was read moves, though it may carry no joint and no sole: a head that nods.
    ride : GroundRide or None
        Of the ground, in whose frame all of this is, where that moves.
    animated : (float, float) or None
        Scene frames of the first key and the last, where that is known: before and after, poses are held. Infinite
        where they are not.
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
    legs: int | None = None
    ground_level: float | None = None
    skin: LowSkin | None = None
    stature: float = 0.0
    size: float = 0.0
    bones_move: bool = False
    ride: GroundRide | None = None
    animated: tuple[float, float] | None = None

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
        """Gravity in the units of its file, as its stature tells them [m/s²]: one in centimetres moves as in metres."""
        return self.gravity / scale_to_metres(self.stature)

    def upward(self, centre: Array, velocity: Array) -> Array:
        """Support of the body per weight at each sample, at places [m] with velocities [m/s]: (3,) or (F, 3)."""
        return self.ride.upward(self.frames, centre, velocity) if self.ride else UP

    @property
    def two_legs(self) -> bool:
        """True if it stands on two legs, as people do."""
        return not self.four_legged and has_two_legs(self.joints, len(self.soles) if self.legs is None else self.legs)

    @property
    def stands_still(self) -> bool:
        """True if no bone, no joint and no sole moves from sample to sample."""
        if self.bones_move:
            return False
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
        """Ratio of its times to those of an adult's motion of the same kind."""
        return float(np.sqrt(self.leg_length / ADULT_LEG))

    @property
    def adult_second(self) -> float:
        """Scene frames in which this body does what an adult does in a second."""
        return self.frame_rate * self.time_scale

    @cached_property
    def on_frames(self) -> NDArray[np.bool_]:
        """Indices of the samples at scene frames (F,): between them a resampled motion is interpolated."""
        return np.abs((self.frames - self.frames[0] + 0.5) % 1.0 - 0.5) < 1e-6

    @cached_property
    def frame_step(self) -> float:
        """Time between the samples at scene frames [s]."""
        return dataclasses.replace(self, frames=self.frames[self.on_frames]).time_step

    @cached_property
    def starts(self) -> NDArray[np.intp]:
        """The first sample, and the first after each jump: a cut or a constant key has put the body elsewhere.

        Nothing is known of what lies between it and the sample before.
        """
        if len(self.frames) < 2:
            return np.zeros(1, dtype=np.intp)
        paths = [*self.joints.values(), *(sole.transforms[:, 0, :3, 3] for sole in self.soles)]
        around = max(round(AROUND_JUMP / self.time_step), 1)
        moved = np.median([np.linalg.norm(np.diff(path, axis=0), axis=-1) for path in paths], axis=0)
        beside = np.lib.stride_tricks.sliding_window_view(np.pad(moved, around), 2 * around + 1)
        nearby = np.delete(beside, around, axis=1).max(axis=1)
        jumps = moved > np.maximum(JUMP * self.leg_length, JUMPS_AHEAD * nearby)
        return np.append(0, np.flatnonzero(jumps) + 1)

    def at_frames(self) -> CharacterMotion:
        """The samples at scene frames alone."""
        return self.of(self.on_frames)

    def first(self, count: int) -> CharacterMotion:
        """The first `count` samples."""
        return self.of(slice(count))

    def of(self, samples: slice | NDArray[np.bool_] | NDArray[np.intp]) -> CharacterMotion:
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

        The first sample of each frame is the given one, exactly. Between a jump and the frame before is the pose after.
        """
        if steps_per_frame == 1 or len(self.frames) < 2:
            return self
        count, jumps = (len(self.frames) - 1) * steps_per_frame + 1, self.starts[1:]
        position = np.arange(count) / steps_per_frame
        source, at = self, position
        if len(jumps):  # poses beside a jump come twice, so that no cubic sees beyond it
            source = self.of(np.sort(np.concatenate([np.arange(len(self.frames)), jumps - 1, jumps])))
            part = np.searchsorted(self.starts - 1, position) - 1
            at = np.maximum(position, self.starts[part]) + 2 * part
        return dataclasses.replace(
            self,
            frames=self.frames[0] + position * (self.frames[1] - self.frames[0]),
            soles=tuple(sole.at(at) for sole in source.soles),
            joints={name: _between(path, at, cubic) for name, path in source.joints.items()},
            centre=None if source.centre is None else linear(source.centre, at),
        )


def steps_per_frame(frame_rate: float) -> int:
    """Number of simulation steps in a frame, so that a step is at most 1/`SIMULATION_RATE` s long."""
    return max(1, ceil(SIMULATION_RATE / frame_rate - 1e-6))


def shortest_sole(motions: Sequence[CharacterMotion]) -> float:
    """Length of the shortest sole of all characters [m]."""
    return shortest_length(sole.sole.length for motion in motions for sole in motion.soles)
