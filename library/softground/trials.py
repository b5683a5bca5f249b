"""Measured trials: joint centres and plate forces from CSV or C3D, as the motion that the core reads."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._core.capture import c3d
from ._core.capture.captured import Plate, bridged
from ._core.capture.joint_centres import CapturedBody, captured_body
from ._core.errors import InputError
from ._core.motion.motion import CharacterMotion
from ._core.numerics.intervals import runs
from .markers import SIDES, motion_of_markers
from .readers import c3d_mass, content_of
from .scoring import LOADED

Array = NDArray[np.float64]

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
    centres : (F, 2, 3) float array, optional
        Where each force acts [m], NaN where that is not measured.
    free_moments : (F, 2) float array, optional
        Moment about the upward axis there [N·m], NaN where that is not measured.
    """

    name: str
    mass: float
    rate: float
    points: dict[str, Array]
    forces: Array
    bvh: Path
    centres: Array | None = None
    free_moments: Array | None = None

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
    about = _about(csv.with_suffix(".json"))
    table = np.genfromtxt(csv, delimiter=",", names=True)

    def vectors(name: str) -> Array:
        return np.stack([table[f"{name}_{axis}"] for axis in "xyz"], axis=-1)

    names = [column[:-2] for column in table.dtype.names if column.endswith("_x")]
    return Trial(
        csv.stem,
        about["mass_kg"],
        about["rate_hz"],
        {name: bridged(vectors(name)) for name in names if not name.startswith("grf_")},
        np.nan_to_num(np.stack([vectors(f"grf_{side}") for side in SIDES], axis=1)),
        csv.with_suffix(".bvh"),
    )


def read_marked(path: Path) -> Trial:
    """The trial in a C3D file with markers and plates; a `NAME.json` beside it with `mass_kg` comes before its own.

    A plate that is stepped on is taken to bear the foot that is nearest to its centre of pressure during that step.
    """
    content = content_of(path)
    body = captured_body(c3d.read(content))
    forces, centres, moments = _measured_on_feet(body)
    bvh = path.with_suffix(".bvh")
    return Trial(path.stem, _mass(path, content), body.rate, body.joints, forces, bvh, centres, moments)


def _about(path: Path) -> dict[str, Any]:
    """What the file beside a trial says."""
    try:
        about = json.loads(path.read_text(encoding="utf-8"))
        return {**about, "mass_kg": float(about["mass_kg"])}
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise InputError(
            f'{path} cannot be read ({error}): it must be a table such as {{"mass_kg": 70, "rate_hz": 100}}'
        ) from error


def _mass(path: Path, content: bytes) -> float:
    """Body mass [kg] by the file beside the trial, else by the trial's parameters."""
    about = path.with_suffix(".json")
    mass = _about(about)["mass_kg"] if about.exists() else c3d_mass(content)
    if mass is None:
        raise InputError(f'{path} does not say how heavy its subject is: write {{"mass_kg": ...}} to {about}')
    return mass


def _measured_on_feet(body: CapturedBody) -> tuple[Array, Array, Array]:
    """What the plates show of the left and the right foot at the frames of the markers.

    Returns
    -------
    forces : (F, 2, 3) float array [N]
    centres : (F, 2, 3) float array [m], NaN but where one plate bears the foot
    free_moments : (F, 2) float array [N·m], likewise
    """
    count = len(body.joints["heel_l"])
    forces, plates = np.zeros((count, len(SIDES), 3)), np.zeros((count, len(SIDES)))
    centres, moments = np.full((count, len(SIDES), 3), np.nan), np.full((count, len(SIDES)), np.nan)
    for plate in body.plates:
        averaged = _at_frames(plate, body.rate, count)
        force, centre, moment = averaged.force, averaged.centre_of_pressure(), free_moment(averaged)
        for first, last in zip(*runs(force[:, 2] > LOADED), strict=True):
            step = slice(first, last)
            foot = np.argmin([np.nanmean(_distance(body, side, centre[step], step)) for side in SIDES])
            forces[step, foot] += force[step]
            plates[step, foot] += 1
            centres[step, foot], moments[step, foot] = centre[step], moment[step]
    centres[plates != 1], moments[plates != 1] = np.nan, np.nan
    return forces, centres, moments


def free_moment(plate: Plate) -> Array:
    """Moment of a plate about its normal at the centre of pressure, (S,) [N·m]; NaN where nothing presses."""
    arm = plate.centre_of_pressure() - plate.corners.mean(axis=0)
    return np.asarray((plate.moment - np.cross(arm, plate.force)) @ plate.normal)


def _at_frames(plate: Plate, rate: float, count: int) -> Plate:
    """A plate whose samples are averaged over each frame."""
    samples = max(round(plate.rate / rate), 1)
    frames = [
        values[: count * samples].reshape(count, samples, 3).mean(axis=1) for values in (plate.force, plate.moment)
    ]
    return Plate(plate.corners, rate, *frames)


def _distance(body: CapturedBody, side: str, place: Array, step: slice) -> Array:
    """Along the ground from the middle of a foot, (F,) [m]."""
    middle = (body.joints[f"heel_{side}"][step] + body.joints[f"ball_{side}"][step]) / 2
    return np.asarray(np.linalg.norm((place - middle)[:, :2], axis=1))


def motion_of_trial(trial: Trial) -> CharacterMotion:
    """The motion of a trial's joint centres; see `motion_of_markers`."""
    points = {CSV_JOINTS.get(name, name): path for name, path in trial.points.items()}
    return motion_of_markers(points, trial.rate, mass=trial.mass, name=trial.name)
