"""A rig at rest, standing upright, on which its size, its sides and its soles are measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..motion.people import has_two_legs, sizes_by_legs
from ..numerics.arrays import Array
from ..numerics.rigid import rotation, turn_between, unit
from ..soles.foot_attitude import UP
from .bones import RigBones, extent, stature
from .mapping import RigMapping

_ACROSS, _ALONG = 0.6, 0.7
"""Largest cosine between the legs and a four-legged trunk, smallest between hind and front legs."""

_ALONG_LEGS = 0.8
"""An axis of the armature is its upward one when the legs lie along it with at least this cosine."""

_UPRIGHT = np.cos(np.radians(1.0))
"""Cosine of the tilt within which an armature stands upright."""


@dataclass(frozen=True)
class RestPose:
    """The rig at rest, standing upright where it is at the first frame, however its parents lie.

    Attributes
    ----------
    world : (4, 4) float array
        Armature space to world [m].
    tilts : (F, 3, 3) float array
        Rotations from upright to the armature's own upward axis in each frame.
    """

    bones: RigBones
    world: Array
    tilts: Array

    @classmethod
    def of(cls, bones: RigBones, mapping: RigMapping, placed: Array) -> RestPose:
        """The rest pose from the armature's matrices over time, (F, 4, 4) [m]."""
        ups = unit(placed[:, :3, :3] @ _own_up(bones, mapping, placed[0]))
        tilts = rotation(turn_between(np.broadcast_to(UP, ups.shape), ups))
        world = placed[0].copy()
        world[:3, :3] = tilts[0].T @ world[:3, :3]
        return cls(bones, world, tilts)

    @property
    def is_mirrored(self) -> bool:
        return bool(np.linalg.det(self.world[:3, :3]) < 0)

    @property
    def is_upright(self) -> bool:
        """True if the armature stands upright in every frame."""
        return bool(self.tilts[:, 2, 2].min() > _UPRIGHT)

    def matrix(self, bone: str) -> Array:
        return self.world @ self.bones[bone].matrix

    def end(self, bone: str, end: str) -> Array:
        return self.world[:3, :3] @ self.bones[bone].end(end) + self.world[:3, 3]

    def leg_length(self, mapping: RigMapping) -> float:
        """Thigh and shank together, or about half the rig's height where they are not mapped."""
        lengths = _leg_lengths({joint: self.end(*place) for joint, place in mapping.joints.items()})
        if lengths and min(lengths) > 0:
            return float(np.mean(lengths))
        ends = np.array([self.end(bone, end) for bone in self.bones for end in ("head", "tail")])
        return max(float(np.ptp(ends, axis=0).max()) / 2, 1e-6)

    def is_four_legged(self, mapping: RigMapping) -> bool:
        """True if the trunk lies across the legs, and the arms along them."""
        names = [f"{joint}_{side}" for joint in ("hip", "ankle", "shoulder", "wrist") for side in "lr"]
        if any(name not in mapping.joints for name in names):
            return False
        left, right = (np.array([self.end(*mapping.joints[name]) for name in names[side::2]]) for side in (0, 1))
        hip, ankle, shoulder, wrist = (left + right) / 2
        leg, trunk, arm = (unit(line) for line in (ankle - hip, shoulder - hip, wrist - shoulder))
        return bool(abs(leg @ trunk) < _ACROSS and leg @ arm > _ALONG)

    def facing(self, mapping: RigMapping) -> Array:
        """Horizontal direction in which the character faces; Blender's front where left and right do not show."""
        ahead = np.cross(self._across(mapping), (0.0, 0.0, -1.0 if self.is_mirrored else 1.0))
        length = float(np.linalg.norm(ahead))
        return ahead / length if length > 0 else np.array((0.0, -1.0, 0.0))

    def _across(self, mapping: RigMapping) -> Array:
        """Vector from a joint on the right to the same on the left."""
        for joint in ("hip", "shoulder", "knee", "ankle"):
            if f"{joint}_l" in mapping.joints and f"{joint}_r" in mapping.joints:
                across = self.end(*mapping.joints[f"{joint}_l"]) - self.end(*mapping.joints[f"{joint}_r"])
                if np.linalg.norm(across[:2]) > 0:
                    return across
        return np.zeros(3)


def sizes_at_rest(
    heads: Array, joints: Mapping[str, Array], to_world: Array, legs: int, *, has_skin: bool
) -> tuple[float, float]:
    """`CharacterMotion.stature` and `size` of a rig at rest, in the units of the world.

    Parameters
    ----------
    heads : (N, 3) float array
        Of its bones, in the armature's space.
    joints : mapping of str to (3,) float array
        Those that are mapped, there too.
    to_world : (4, 4) float array
        From there to the world.
    legs : int
        Number of legs that print.
    """
    sizes = stature(heads, to_world), extent(heads, to_world)
    if not has_two_legs(joints, legs):
        return sizes
    leg = float(np.mean(_leg_lengths({joint: to_world[:3, :3] @ place for joint, place in joints.items()})))
    return sizes_by_legs(*sizes, leg, has_skin=has_skin)


def _leg_lengths(joints: Mapping[str, Array]) -> list[float]:
    """Thigh and shank together of each leg whose joints are known."""
    legs = ([f"{joint}_{side}" for joint in ("hip", "knee", "ankle")] for side in "lr")
    lines = [np.diff([joints[joint] for joint in leg], axis=0) for leg in legs if joints.keys() >= {*leg}]
    return [float(np.linalg.norm(line, axis=1).sum()) for line in lines]


def _own_up(bones: RigBones, mapping: RigMapping, placed: Array) -> Array:
    """The axis of the armature along which its legs reach up at rest; where none shows, the one that points up most.

    An armature that stands upright itself does so whatever its rest pose: those of captured motions may lie.
    """
    if unit(placed[:3, 2]) @ UP > _UPRIGHT:
        return UP
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    legs = np.zeros(3)
    for side in "lr":
        joints = [f"ankle_{side}", f"hip_{side}"]
        if all(joint in mapping.joints for joint in joints):
            ankle, hip = (bones[bone].end(end) for bone, end in (mapping.joints[joint] for joint in joints))
            legs += hip - ankle
    along = axes @ unit(legs)
    if along.max() < _ALONG_LEGS:
        along = axes @ placed[2, :3]
    return np.asarray(axes[along.argmax()])
