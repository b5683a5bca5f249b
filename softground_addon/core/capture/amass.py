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

from ..errors import InputError
from ..numerics.arrays import Array
from ..numerics.rigid import rotation
from .captured import check_length
from .joint_centres import CapturedBody

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
_LARGEST = 2**29
"""Size of an array in the archive [bytes]; 100,000 poses are 130 MB."""


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
            if any(member.file_size > _LARGEST for member in archive.infolist()):
                raise InputError("the archive holds arrays of more than 500 MB: this is no AMASS file", "wrong_format")
        with np.load(io.BytesIO(content), allow_pickle=False) as held:
            rate = next((float(held[name]) for name in _RATES if name in held), np.nan)
            poses, way = _poses(held, rate), _table(held["trans"], rate, 3)
    except InputError:
        raise
    except Exception as error:  # NumPy and zlib raise of every kind at damaged archives
        raise InputError(f"not an AMASS file ({error}): it lacks poses, trans or their rate", "wrong_format") from error
    if way.shape != (len(poses), 3) or not (np.isfinite(way).all() and np.isfinite(poses).all()):
        raise InputError(
            "the AMASS file contradicts itself: poses and trans differ, or hold no numbers", "damaged_file"
        )
    return CapturedBody(_joints(poses, way), rate)


def _poses(held: Any, rate: float) -> Array:
    """Rotation vectors of the body's joints, (F, 22, 3) [rad]."""
    values = 3 * len(_TREE)
    parts = ["poses"] if "poses" in held else ["root_orient", "pose_body"]
    poses = np.concatenate([_table(held[part], rate, values) for part in parts], axis=1)
    if poses.shape[1] < values or not len(poses):
        raise InputError(f"the AMASS file has poses of shape {poses.shape}, not (frames, 66 or more)", "wrong_format")
    return poses[:, :values].reshape(len(poses), -1, 3)


def _table(held: Any, rate: float, columns: int) -> Array:
    """The first columns of an array with a row for each frame."""
    check_length(len(held), rate)
    return np.asarray(held[:, :columns], float)


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
