"""A skeleton from joint centres: bones at rest, standing, and their poses over time.

Each bone starts at its joint's centre in every frame, however the markers slid, so that nothing of the capture is lost.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..numerics.arrays import Array
from ..numerics.rigid import unit
from .joint_centres import CapturedBody

_FLOOR_IS_ZERO = (-0.05, 0.15)
"""Heights of the lowest markers in leg lengths at which the laboratory's floor is where its axes begin."""
_MARKER_ABOVE_SOLE = 0.03
"""Height of a marker on the shoe, in leg lengths, where the floor has to be guessed."""
_LOW = 5.0
"""Percentile of heights at which a foot stands."""
_HEAD = 0.35
"""Length of the head over that of the trunk, where no bone shows it."""
_SHOULDER = 0.35
"""Distance from the neck to a shoulder at rest, over the length of the trunk."""
_HAND = 0.4
"""Length of the hand over that of the forearm."""


@dataclass(frozen=True)
class Bone:
    """A bone of the skeleton at rest.

    Attributes
    ----------
    name : str
        As motion capture skeletons are named.
    parent : str
        Empty for the root.
    head, tail : (3,) float arrays
        [m]
    x_axis : (3,) float array
        Which way its x axis points, across it.
    """

    name: str
    parent: str
    head: Array
    tail: Array
    x_axis: Array


@dataclass(frozen=True)
class Skeleton:
    """Bones, and where each is over time.

    Attributes
    ----------
    bones : tuple of Bone
        Parents before their children.
    poses : (F, B, 4, 4) float array
        Bone to world [m]: y from its head to its tail, x as `Bone.x_axis`.
    rate : float
        Frames per second [Hz].
    at_rest : (B, 4, 4) float array, optional
        Bone to world at rest [m], as the program knows it that the bones come from; by their ends and x axes if not
        given.
    """

    bones: tuple[Bone, ...]
    poses: Array
    rate: float
    at_rest: Array | None = None

    def rest(self) -> Array:
        """Bone to world at rest, (B, 4, 4) [m]."""
        if self.at_rest is not None:
            return self.at_rest
        return np.stack([_matrix(bone.head, bone.tail - bone.head, bone.x_axis) for bone in self.bones])

    def channels(self) -> Array:
        """Poses as Blender keys them: each bone's, relative to its rest and its parent, (F, B, 4, 4)."""
        rest, parents = self.rest(), [self._index(bone.parent) for bone in self.bones]
        channels = np.empty_like(self.poses)
        for index, parent in enumerate(parents):
            local_rest = rest[index] if parent < 0 else np.linalg.inv(rest[parent]) @ rest[index]
            local = self.poses[:, index] if parent < 0 else np.linalg.inv(self.poses[:, parent]) @ self.poses[:, index]
            channels[:, index] = np.linalg.inv(local_rest) @ local
        return channels

    def _index(self, name: str) -> int:
        return next((index for index, bone in enumerate(self.bones) if bone.name == name), -1)


def skeleton_of(body: CapturedBody) -> Skeleton:
    """The skeleton of a captured body.

    Raises
    ------
    InputError
        If its legs have no length.
    """
    rest, joints = standing(body), _with_ends(body.joints)
    across = unit(joints["hip_l"] - joints["hip_r"])
    forward = np.cross(across, unit(joints["above hips"] - joints["hips"]))
    bones, poses = [], []
    for name, parent, start, end in _segments(joints):
        left, axis = np.array([1.0, 0.0, 0.0]), across
        if name.endswith(("Foot", "ToeBase")):
            axis = _foot_axis(joints, start[-1], across)
        elif name.endswith(("Arm", "Hand")):
            left, axis = np.array([0.0, -1.0, 0.0]), forward
        bones.append(Bone(name, parent, rest[start], rest[end], left))
        poses.append(_matrix(joints[start], joints[end] - joints[start], axis))
    return Skeleton(tuple(bones), np.stack(poses, axis=1), body.rate)


def _with_ends(joints: dict[str, Array]) -> dict[str, Array]:
    """The joints, and the ends of bones that point straight on where nothing was recorded."""
    ends = {}
    up = joints["neck"] - joints["hips"] if "neck" in joints else np.array([0.0, 0.0, 0.5])
    ends["above hips"] = joints["hips"] + up / 4
    if "head" in joints:
        ends["top"] = 2 * joints["head"] - joints["neck"]
    for s in "lr":
        if f"wrist_{s}" in joints and f"elbow_{s}" in joints:
            ends[f"hand_{s}"] = joints[f"wrist_{s}"] + _HAND * (joints[f"wrist_{s}"] - joints[f"elbow_{s}"])
    return joints | ends


def _segments(joints: dict[str, Array]) -> list[tuple[str, str, str, str]]:
    """Name, parent, joint at the start and joint at the end of each bone that there are joints for."""
    trunk = [
        ("Hips", "", "hips", "above hips"),
        ("Spine", "Hips", "above hips", "neck"),
        ("Neck", "Spine", "neck", "head"),
    ]
    limbs = [
        (
            f"{side}{name}",
            f"{side}{parent}" if parent not in ("Hips", "Spine") else parent,
            f"{start}_{s}",
            f"{end}_{s}",
        )
        for s, side in (("l", "Left"), ("r", "Right"))
        for name, parent, start, end in (
            ("UpLeg", "Hips", "hip", "knee"),
            ("Leg", "UpLeg", "knee", "ankle"),
            ("Foot", "Leg", "ankle", "ball"),
            ("ToeBase", "Foot", "ball", "toe"),
            ("Arm", "Spine", "shoulder", "elbow"),
            ("ForeArm", "Arm", "elbow", "wrist"),
            ("Hand", "ForeArm", "wrist", "hand"),
        )
    ]
    head = [("Head", "Neck", "head", "top")]
    segments: list[tuple[str, str, str, str]] = []
    for name, parent, start, end in trunk + head + limbs:
        if start in joints and end in joints and (not parent or any(bone[0] == parent for bone in segments)):
            segments.append((name, parent, start, end))
    return segments


def standing(body: CapturedBody) -> dict[str, Array]:
    """Joints (3,) of the body standing upright on z = 0, looking along -y, its arms stretched out [m]."""
    joints = body.joints
    thigh, shank = _length(joints, "hip", "knee"), _length(joints, "knee", "ankle")
    leg = thigh + shank
    if not leg > 0:
        raise InputError("the legs have no length: hips, knees and ankles are in one place", "legs_without_length")
    half = float(np.median(np.linalg.norm(joints["hip_l"] - joints["hip_r"], axis=1))) / 2
    floor = _floor(joints, leg)
    rest: dict[str, Array] = {}
    feet = {s: _flat_foot(joints, s, floor) for s in "lr"}
    for s, out in (("l", 1.0), ("r", -1.0)):
        ankle = np.array([out * half, 0.0, feet[s]["ankle"][2]])
        rest[f"ankle_{s}"] = ankle
        rest[f"knee_{s}"] = ankle + np.array([0.0, 0.0, shank])
        rest[f"hip_{s}"] = ankle + np.array([0.0, 0.0, leg])
        for part in ("heel", "ball", "toe"):
            rest[f"{part}_{s}"] = np.array([out * half, *feet[s][part][1:]])
    rest["hips"] = (rest["hip_l"] + rest["hip_r"]) / 2
    trunk = float(np.median(np.linalg.norm(joints["neck"] - joints["hips"], axis=1))) if "neck" in joints else leg * 0.6
    rest["above hips"] = rest["hips"] + (0.0, 0.0, trunk / 4)
    rest["neck"] = rest["hips"] + (0.0, 0.0, trunk)
    head = (
        float(np.median(np.linalg.norm(joints["head"] - joints["neck"], axis=1))) if "head" in joints else trunk * _HEAD
    )
    rest["head"] = rest["neck"] + (0.0, 0.0, head)
    rest["top"] = rest["head"] + (0.0, 0.0, head)
    for s, out in (("l", 1.0), ("r", -1.0)):
        if f"shoulder_{s}" in joints:
            arm = np.array([out, 0.0, 0.0])
            rest[f"shoulder_{s}"] = rest["neck"] + _SHOULDER * trunk * arm
            upper, fore = (_length(joints, a, b) for a, b in (("shoulder", "elbow"), ("elbow", "wrist")))
            rest[f"elbow_{s}"] = rest[f"shoulder_{s}"] + upper * arm
            rest[f"wrist_{s}"] = rest[f"elbow_{s}"] + fore * arm
            rest[f"hand_{s}"] = rest[f"wrist_{s}"] + _HAND * fore * arm
    return rest


def _length(joints: dict[str, Array], start: str, end: str) -> float:
    """Length of a segment, the mean of both sides, 0 where it was not recorded [m]."""
    sides = [s for s in "lr" if f"{start}_{s}" in joints and f"{end}_{s}" in joints]
    lengths = [np.median(np.linalg.norm(joints[f"{start}_{s}"] - joints[f"{end}_{s}"], axis=1)) for s in sides]
    return float(np.mean(lengths)) if lengths else 0.0


def _floor(joints: dict[str, Array], leg: float) -> float:
    """Height of the floor in the laboratory's axes: 0 unless the feet are elsewhere [m]."""
    lowest = min(float(np.percentile(joints[f"{part}_{s}"][:, 2], _LOW)) for part in ("heel", "ball") for s in "lr")
    low, high = _FLOOR_IS_ZERO
    return 0.0 if low * leg < lowest < high * leg else lowest - _MARKER_ABOVE_SOLE * leg


def _flat_foot(joints: dict[str, Array], side: str, floor: float) -> dict[str, Array]:
    """Ankle, heel, ball and toe while the foot stands flat: y from the ankle backward, z from the floor [m]."""
    heel, ball = joints[f"heel_{side}"], joints[f"ball_{side}"]
    along = unit((ball - heel) * (1.0, 1.0, 0.0))
    low = sum(path[:, 2] - np.percentile(path[:, 2], _LOW) for path in (heel, ball))
    flat = low <= np.percentile(low, 2 * _LOW)
    ankle = joints[f"ankle_{side}"]

    def placed(path: Array) -> Array:
        behind = -((path - ankle) * along).sum(axis=1)
        return np.array([0.0, np.median(behind[flat]), np.median(path[flat, 2]) - floor])

    return {part: placed(joints[f"{part}_{side}"]) for part in ("ankle", "heel", "ball", "toe")}


def _foot_axis(joints: dict[str, Array], side: str, across: Array) -> Array:
    """Across a foot, toward the left: perpendicular to the plane of ankle, heel and ball."""
    ankle, heel, ball = (joints[f"{part}_{side}"] for part in ("ankle", "heel", "ball"))
    normal = np.cross(ball - heel, ankle - heel)
    return unit(normal * np.sign((normal * across).sum(axis=1, keepdims=True)))


def _matrix(head: Array, along: Array, x_axis: Array) -> Array:
    """Bone to world (..., 4, 4): y along the bone, x as near to `x_axis` as it goes."""
    y = unit(along)
    x = x_axis - (np.asarray(x_axis) * y).sum(axis=-1, keepdims=True) * y
    fallback = np.cross(y, (0.0, 0.0, 1.0)) + 1e-9
    x = unit(np.where(np.linalg.norm(x, axis=-1, keepdims=True) > 1e-6, x, fallback))
    matrix = np.zeros((*y.shape[:-1], 4, 4))
    matrix[..., :3, 0], matrix[..., :3, 1], matrix[..., :3, 2] = x, y, np.cross(x, y)
    matrix[..., :3, 3] = head
    matrix[..., 3, 3] = 1.0
    return matrix
