"""BVH files: a skeleton at rest, and the turns of its joints frame by frame.

References
----------
Meredith, Maddock, "Motion capture file formats explained", University of Sheffield, CS-01-11 (2001), section 3.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ._core.capture.captured import check_length
from ._core.capture.joint_centres import UPWARD, axis_along
from ._core.capture.skeleton import Bone, Skeleton
from ._core.errors import InputError
from ._core.motion.units import scale_to_metres
from ._core.numerics.rigid import rotation
from ._core.rig.bones import extent
from ._core.rig.name_mapping import map_by_names
from .body import placed, rest_bones

Array = NDArray[np.float64]

_SHORTEST = 1e-3
"""Bones shorter than this, in units of the file, point along y."""

_FARTHEST = 1e9
"""An offset has smaller numbers, in units of the file."""


@dataclass
class _Joint:
    name: str
    parent: int
    offset: Array = field(default_factory=lambda: np.zeros(3))
    channels: tuple[str, ...] = ()
    end: Array | None = None


def read(content: bytes, *, up: str | None = None, scale: float | None = None) -> Skeleton:
    """The skeleton of a BVH file, Z up [m].

    Parameters
    ----------
    content : bytes
    up : str, optional
        The file's upward axis, one of `UPWARD`; by default the one along which the hips are above the feet.
    scale : float, optional
        Metres per unit of the file; by default told by the size of the body in it.

    Raises
    ------
    InputError
        If it is no BVH file, is cut short, or does not show which way is up.
    """
    if up is not None and up not in UPWARD:
        raise InputError(f"up is {up!r}: it must be one of {', '.join(UPWARD)}", "unknown_axis", up=up)
    head, found, tail = content.decode("utf-8", errors="replace").partition("MOTION")
    if not found or "HIERARCHY" not in head:
        raise InputError('this is no BVH file: it lacks "HIERARCHY" or "MOTION"', "wrong_format")
    try:
        joints = _joints(head.split())
        rate, values = _motion(tail, sum(len(joint.channels) for joint in joints))
    except (ValueError, IndexError) as error:
        raise InputError(f"the BVH file is damaged ({error}): export it again", "damaged_file", format="BVH") from error
    skeleton = _skeleton(joints, rate, values)
    turn = UPWARD[up or _upward(skeleton)]
    size = extent(np.array([bone.head for bone in skeleton.bones]), np.eye(4))
    return placed(skeleton, turn, scale_to_metres(size, captured=True) if scale is None else scale)


def _joints(words: list[str]) -> list[_Joint]:
    """The joints of the hierarchy, parents before their children."""
    joints: list[_Joint] = []
    above: list[int] = []
    place = 0
    while place < len(words):
        word = words[place]
        if word in ("ROOT", "JOINT"):
            begin = words.index("{", place)
            name = " ".join(words[place + 1 : begin])
            taken = {joint.name for joint in joints}
            name = next(each for each in (name, *(f"{name}.{n}" for n in range(1, 10_000))) if each not in taken)
            joints.append(_Joint(name, above[-1] if above else -1))
            above.append(len(joints) - 1)
            place = begin
        elif word == "End":
            place = words.index("OFFSET", place)
            joints[above[-1]].end = np.array(words[place + 1 : place + 4], dtype=float)
            place = words.index("}", place)
        elif word == "OFFSET":
            joints[above[-1]].offset = np.array(words[place + 1 : place + 4], dtype=float)
            place += 3
        elif word == "CHANNELS":
            count = int(words[place + 1])
            if count < 0:
                raise ValueError(f"a joint of {count} channels")
            joints[above[-1]].channels = tuple(words[place + 2 : place + 2 + count])
            place += 1 + count
        elif word == "}":
            above.pop()
        place += 1
    kinds = {f"{axis}{kind}" for axis in "XYZ" for kind in ("position", "rotation")}
    if not joints or any(channel not in kinds for joint in joints for channel in joint.channels):
        raise ValueError("its joints or channels have no known names")
    ends = [joint.offset if joint.end is None else joint.offset + joint.end for joint in joints]
    if any(end.shape != (3,) or not np.abs(end).max() < _FARTHEST for end in ends):
        raise ValueError("its offsets are no numbers")
    return joints


def _motion(text: str, channels: int) -> tuple[float, Array]:
    """Frames per second, and the channels at each frame, (F, C)."""
    words = text.split()
    count, step = int(words[words.index("Frames:") + 1]), float(words[words.index("Time:") + 1])
    check_length(count, 1 / step if step > 0 else 0.0)
    values = np.array(words[words.index("Time:") + 2 :], dtype=float)
    if count < 1 or len(values) < count * channels or not np.isfinite(values).all():
        raise InputError(
            f"the BVH file is cut short: {count} frames of {channels} numbers should follow, {len(values)} numbers do; "
            "copy or export it again",
            "cut_short",
        )
    return float(f"{1 / step:.6g}"), values[: count * channels].reshape(count, channels)


def _skeleton(joints: list[_Joint], rate: float, values: Array) -> Skeleton:
    """Bones and poses in the file's axes and units."""
    heads: list[Array] = []
    turns: list[Array] = []
    places: list[Array] = []
    first = 0
    for joint in joints:
        local, place = np.eye(3), np.tile(joint.offset, (len(values), 1))
        for number, channel in enumerate(joint.channels, start=first):
            axis = "XYZ".index(channel[0])
            if channel.endswith("position"):
                place[:, axis] = values[:, number]
            else:
                local = local @ rotation(np.radians(values[:, number, None]) * np.eye(3)[axis])
        first += len(joint.channels)
        root = joint.parent < 0
        heads.append(joint.offset if root else heads[joint.parent] + joint.offset)
        turn = np.broadcast_to(local, (len(values), 3, 3))
        turns.append(turn if root else turns[joint.parent] @ turn)
        moved = place if root else places[joint.parent] + (turns[joint.parent] @ place[..., None])[..., 0]
        places.append(moved)
    bones = tuple(
        Bone(
            joint.name,
            joints[joint.parent].name if joint.parent >= 0 else "",
            heads[index],
            tail,
            _across(tail - heads[index]),
        )
        for index, (joint, tail) in enumerate(zip(joints, _tails(joints, heads), strict=True))
    )
    poses = np.tile(np.eye(4), (len(values), len(joints), 1, 1))
    poses[..., :3, :3] = np.stack(turns, axis=1) @ Skeleton(bones, poses, rate).rest()[:, :3, :3]
    poses[..., :3, 3] = np.stack(places, axis=1)
    return Skeleton(bones, poses, rate)


def _tails(joints: list[_Joint], heads: list[Array]) -> list[Array]:
    """Ends of the bones: the middle of the joints that hang on them, or where the file ends them."""
    tails = []
    for index, joint in enumerate(joints):
        below = [heads[other] for other, child in enumerate(joints) if child.parent == index]
        end = np.mean(below, axis=0) if below else heads[index] + (0.0 if joint.end is None else joint.end)
        short = np.linalg.norm(end - heads[index]) < _SHORTEST
        tails.append(heads[index] + (0.0, 0.1, 0.0) if short else end)
    return tails


def _across(along: Array) -> Array:
    """The axis that lies most across a bone."""
    return np.asarray(np.eye(3)[np.abs(along).argmin()])


def _upward(skeleton: Skeleton) -> str:
    """The axis of the file along which hips are above ankles most of the time."""
    bones = rest_bones(skeleton)
    mapping = map_by_names(bones, bones.keys())
    names = [bone.name for bone in skeleton.bones]

    def middle(joint: str) -> Array:
        ends = [mapping.joints[f"{joint}_{side}"][0] for side in "lr"] if mapping else []
        return np.asarray(np.mean([skeleton.poses[:, names.index(end), :3, 3] for end in ends], axis=0))

    if (
        mapping is None
        or not {f"{joint}_{side}" for joint in ("hip", "ankle") for side in "lr"} <= mapping.joints.keys()
    ):
        raise InputError("no bones of the BVH file are called legs: give its upward axis as up", "unknown_axis")
    return axis_along(middle("hip") - middle("ankle"))
