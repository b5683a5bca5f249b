"""AMASS files: the poses of the SMPL family of bodies as NumPy archives.

The body's shape is not in the file but in a model that may not be passed on: every body has average proportions here.

References
----------
Loper, Mahmood, Romero, Pons-Moll, Black, "SMPL: a skinned multi-person linear model" (2015), 10.1145/2816795.2818013.
Mahmood, Ghorbani, Troje, Pons-Moll, Black, "AMASS: archive of motion capture as surface shapes" (2019),
10.1109/ICCV.2019.00554.
"""

from __future__ import annotations

import io
import zipfile
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..numerics.rigid import rotation
from .captured import MOST_FRAMES_PER_SECOND
from .joint_centres import CapturedBody

Array = NDArray[np.float64]

_TREE: tuple[tuple[str, int, tuple[float, float, float]], ...] = (
    ("hips", -1, (0.0, -0.22, 0.03)),
    ("hip_l", 0, (0.06, -0.09, -0.015)),
    ("hip_r", 0, (-0.06, -0.09, -0.015)),
    ("spine 1", 0, (0.0, 0.12, -0.04)),
    ("knee_l", 1, (0.043, -0.385, 0.0)),
    ("knee_r", 2, (-0.043, -0.385, 0.0)),
    ("spine 2", 3, (0.0, 0.14, 0.03)),
    ("ankle_l", 4, (-0.017, -0.423, -0.036)),
    ("ankle_r", 5, (0.017, -0.423, -0.036)),
    ("spine 3", 6, (0.0, 0.06, 0.0)),
    ("ball_l", 7, (0.038, -0.061, 0.126)),
    ("ball_r", 8, (-0.038, -0.061, 0.126)),
    ("neck", 9, (0.0, 0.21, -0.03)),
    ("collar_l", 9, (0.08, 0.11, -0.02)),
    ("collar_r", 9, (-0.08, 0.11, -0.02)),
    ("head", 12, (0.01, 0.09, 0.05)),
    ("shoulder_l", 13, (0.12, 0.045, -0.015)),
    ("shoulder_r", 14, (-0.12, 0.045, -0.015)),
    ("elbow_l", 16, (0.258, -0.015, -0.027)),
    ("elbow_r", 17, (-0.258, -0.015, -0.027)),
    ("wrist_l", 18, (0.267, 0.01, -0.007)),
    ("wrist_r", 19, (-0.267, 0.01, -0.007)),
)
"""Joints in the order of the poses, their parent, and where they are from it at rest, y up, of the average body [m]."""

_POINTS = tuple(
    (f"{name}_{side}", joint, (out * x, y, z))
    for side, out, ankle, ball in (("l", 1.0, 7, 10), ("r", -1.0, 8, 11))
    for name, joint, (x, y, z) in (("heel", ankle, (0.0, -0.06, -0.05)), ("toe", ball, (0.0, 0.0, 0.06)))
)
"""Points of the feet that move with a joint: name, joint, and where they are from it at rest [m]."""

_RATES = ("mocap_framerate", "mocap_frame_rate", "fps")
_LARGEST = 2**31
"""Size of what an archive holds [bytes]."""


def read(content: bytes) -> CapturedBody:
    """The body of an AMASS file, Z up as they are.

    Parameters
    ----------
    content : bytes
        The archive.

    Raises
    ------
    InputError
        If it is no such archive.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            if sum(member.file_size for member in archive.infolist()) > _LARGEST:
                raise InputError("the archive unpacks to more than 2 GB: it is not an AMASS file")
        with np.load(io.BytesIO(content), allow_pickle=False) as held:
            poses, way, rate = _poses(held), np.asarray(held["trans"], float), _rate(held)
    except InputError:
        raise
    except Exception as error:  # NumPy and zlib raise of every kind at damaged archives
        raise InputError(f"this is not an AMASS file ({error}): it needs poses, trans and mocap_framerate") from error
    if way.shape != (len(poses), 3) or not (np.isfinite(way).all() and np.isfinite(poses).all()):
        raise InputError("the AMASS file contradicts itself: poses and trans differ in length, or hold no numbers")
    return CapturedBody(_joints(poses, way), rate)


def _poses(held: Any) -> Array:
    """Rotation vectors of the body's joints, (F, 22, 3) [rad]."""
    if "poses" in held:
        poses = np.asarray(held["poses"], float)
    else:
        poses = np.concatenate([np.asarray(held[name], float) for name in ("root_orient", "pose_body")], axis=1)
    if poses.ndim != 2 or poses.shape[1] < 3 * len(_TREE) or not len(poses):
        raise InputError(f"the AMASS file has poses of shape {poses.shape}: (frames, 66 or more) are needed")
    return poses[:, : 3 * len(_TREE)].reshape(len(poses), -1, 3)


def _rate(held: Any) -> float:
    rate = next((float(held[name]) for name in _RATES if name in held), np.nan)
    if not 0 < rate <= MOST_FRAMES_PER_SECOND:
        raise InputError("the AMASS file has no frame rate (mocap_framerate): save it with one")
    return rate


def _joints(poses: Array, way: Array) -> dict[str, Array]:
    """Joint centres by forward kinematics, (F, 3) each [m]."""
    turns, places = [], []
    for index, (_, parent, offset) in enumerate(_TREE):
        turn = rotation(poses[:, index])
        if parent < 0:
            turns.append(turn)
            places.append(way + np.array(offset))
        else:
            turns.append(turns[parent] @ turn)
            places.append(places[parent] + turns[parent] @ np.array(offset))
    joints = {
        name: places[index] for index, (name, _, _) in enumerate(_TREE) if " " not in name and "collar" not in name
    }
    return joints | {name: places[joint] + turns[joint] @ np.array(offset) for name, joint, offset in _POINTS}
