"""Measured trials: joint centres and plate forces from CSV, as the motion that the core reads."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from softground_addon.core.motion.motion import JOINTS, CharacterMotion, Sole, SoleMotion

Array = NDArray[np.float64]

SIDES = ("l", "r")
LANDMARKS = ("heel", "ball", "toe")
CSV_JOINTS = {"mid_hip": "hips"}
"""Joints that the files call otherwise than `JOINTS`."""
KINDS = {"walk": "walk", "run": "run", "dj": "drop jump", "jump": "jump", "squat": "squat", "sts": "chair"}
"""Kinds of motion by a word in a trial's name; where there is none, the name says nothing ("other")."""


@dataclass(frozen=True)
class Trial:
    """One measured trial.

    Attributes
    ----------
    name : str
        Of its subject and of what is done, joined by an underscore, in either order.
    mass : float
        Body mass [kg].
    rate : float
        Samples per second [Hz].
    points : dict of str to (F, 3) float array
        Joint centres and foot markers by their name in the file [m].
    forces : (F, 2, 3) float array
        Plate force on the left and the right foot [N].
    bvh : Path
        The same motion as a skeleton.
    """

    name: str
    mass: float
    rate: float
    points: dict[str, Array]
    forces: Array
    bvh: Path

    @property
    def kind(self) -> str:
        """What is done: one of `KINDS`, or "other"."""
        return next((kind for word, kind in KINDS.items() if word in self.name.lower()), "other")

    @property
    def subject(self) -> str:
        """Who does it: the part of the name that does not tell the kind."""
        return "_".join(part for part in self.name.split("_") if not any(word in part.lower() for word in KINDS))


def read_trial(csv: Path) -> Trial:
    """The trial whose three files share the name of `csv`; gaps of the markers are bridged, lost forces are none."""
    about = json.loads(csv.with_suffix(".json").read_text())
    table = np.genfromtxt(csv, delimiter=",", names=True)

    def vectors(name: str) -> Array:
        return np.stack([table[f"{name}_{axis}"] for axis in "xyz"], axis=-1)

    names = [column[:-2] for column in table.dtype.names if column.endswith("_x")]
    return Trial(
        csv.stem,
        about["mass_kg"],
        about["rate_hz"],
        {name: _bridged(vectors(name)) for name in names if not name.startswith("grf_")},
        np.nan_to_num(np.stack([vectors(f"grf_{side}") for side in SIDES], axis=1)),
        csv.with_suffix(".bvh"),
    )


def _bridged(path: Array) -> Array:
    """A path (F, 3) with straight lines where the marker was lost."""
    seen = np.isfinite(path).all(axis=1)
    if seen.all() or not seen.any():
        return path
    index = np.arange(len(path))
    return np.stack([np.interp(index, index[seen], column[seen]) for column in path.T], axis=1)


def motion_of_trial(trial: Trial) -> CharacterMotion:
    """The motion of the joint centres, with a sole below the heel, ball and toe markers of each foot.

    Markers sit on skin or shoe, each some centimetres above the sole: a landmark is put below its marker by the
    marker's own height while the foot is on the ground, a low percentile over the trial.
    """
    joints = {CSV_JOINTS.get(name, name): path for name, path in trial.points.items()}
    return CharacterMotion(
        name=trial.name,
        mass=trial.mass,
        leg_length=_leg_length(trial),
        frames=np.arange(len(trial.forces), dtype=float),
        frame_rate=trial.rate,
        soles=tuple(_sole(trial, side) for side in SIDES),
        joints={name: path for name, path in joints.items() if name in JOINTS},
    )


def _leg_length(trial: Trial) -> float:
    """Thigh, shank and ankle height, the mean of both legs [m]."""

    def between(a: str, b: str, side: str) -> float:
        return float(np.median(np.linalg.norm(trial.points[f"{a}_{side}"] - trial.points[f"{b}_{side}"], axis=-1)))

    return float(
        np.mean(
            [
                between("hip", "knee", side)
                + between("knee", "ankle", side)
                + np.percentile(trial.points[f"ankle_{side}"][:, 2], 5)
                for side in SIDES
            ]
        )
    )


def _sole(trial: Trial, side: str) -> SoleMotion:
    markers = np.stack([trial.points[f"{landmark}_{side}"] for landmark in LANDMARKS], axis=1)
    transforms = np.tile(np.eye(4), (*markers.shape[:2], 1, 1))
    transforms[..., :3, 3] = markers
    landmarks = np.zeros((len(LANDMARKS), 3))
    landmarks[:, 2] = -np.percentile(markers[..., 2], 5, axis=0)
    sole = Sole(f"foot.{side.upper()}", side.upper(), (), landmarks, np.arange(len(LANDMARKS)), np.zeros((0, 2)))
    return SoleMotion(sole, transforms)
