"""The motion of joint centres, with soles below the markers of each foot, by which forces are found."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ._core.motion.motion import JOINTS, CharacterMotion
from ._core.motion.sole_motion import Sole, SoleMotion

Array = NDArray[np.float64]

SIDES = ("l", "r")
LANDMARKS = ("heel", "ball", "toe")


def motion_of_markers(points: Mapping[str, Array], rate: float, *, mass: float, name: str) -> CharacterMotion:
    """The motion of joint centres and foot markers.

    Markers sit on skin or shoe, each some centimetres above the sole: a landmark is put below its marker by the
    marker's own height while the foot is on the ground, a low percentile over the motion.

    Parameters
    ----------
    points : mapping of str to (F, 3) float array
        By the names of `Body.from_joints` [m].
    rate : float
        [Hz]
    mass : float
        [kg]
    name : str
    """
    return CharacterMotion(
        name=name,
        mass=mass,
        leg_length=_leg_length(points),
        frames=np.arange(len(points["heel_l"]), dtype=float),
        frame_rate=rate,
        soles=tuple(_sole(points, side) for side in SIDES),
        joints={joint: path for joint, path in points.items() if joint in JOINTS},
    )


def _leg_length(points: Mapping[str, Array]) -> float:
    """Thigh, shank and ankle height, the mean of both legs [m]."""

    def between(a: str, b: str, side: str) -> float:
        return float(np.median(np.linalg.norm(points[f"{a}_{side}"] - points[f"{b}_{side}"], axis=-1)))

    lengths = [
        between("hip", "knee", side)
        + between("knee", "ankle", side)
        + float(np.percentile(points[f"ankle_{side}"][:, 2], 5))
        for side in SIDES
    ]
    return float(np.mean(lengths))


def _sole(points: Mapping[str, Array], side: str) -> SoleMotion:
    markers = np.stack([points[f"{landmark}_{side}"] for landmark in LANDMARKS], axis=1)
    transforms = np.tile(np.eye(4), (*markers.shape[:2], 1, 1))
    transforms[..., :3, 3] = markers
    landmarks = np.zeros((len(LANDMARKS), 3))
    landmarks[:, 2] = -np.percentile(markers[..., 2], 5, axis=0)
    sole = Sole(f"foot.{side.upper()}", side.upper(), (), landmarks, np.arange(len(LANDMARKS)), np.zeros((0, 2)))
    return SoleMotion(sole, transforms)
