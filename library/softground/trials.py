"""Measured trials: joint centres and plate forces from CSV or C3D, as the motion that the core reads."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._core.capture import c3d, trc
from ._core.capture.captured import bridged
from ._core.errors import InputError
from ._core.motion.motion import CharacterMotion
from .body import Body
from .markers import SIDES, motion_of_markers
from .plates import plates_on_feet
from .readers import body_of_markers, c3d_mass, content_of
from .storage import first_time, forces_beside, plates_of

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
    """The trial whose three files share the name of `csv`; gaps of the markers are bridged, lost forces are none.

    Raises
    ------
    InputError
        If a file is missing, or lacks what a trial has.
    """
    about = _about(csv.with_suffix(".json"))
    try:
        return _of_table(csv, about, np.genfromtxt(csv, delimiter=",", names=True))
    except (OSError, KeyError, ValueError) as error:
        raise InputError(f"{csv} ({error}) needs <joint>_<x|y|z> and grf_<l|r>_<x|y|z>", "wrong_format") from error


def _of_table(csv: Path, about: Mapping[str, Any], table: NDArray[Any]) -> Trial:
    def vectors(name: str) -> Array:
        return np.stack([table[f"{name}_{axis}"] for axis in "xyz"], axis=-1)

    names = [column[:-2] for column in table.dtype.names or () if column.endswith("_x")]
    return Trial(
        csv.stem,
        about["mass_kg"],
        float(about["rate_hz"]),
        {name: bridged(vectors(name)) for name in names if not name.startswith("grf_")},
        np.nan_to_num(np.stack([vectors(f"grf_{side}") for side in SIDES], axis=1)),
        csv.with_suffix(".bvh"),
    )


def read_marked(path: Path, static: Path | None = None) -> Trial:
    """The trial in a C3D file with plates, or in a TRC file with a table of forces beside it (`storage.forces_beside`).

    A `NAME.json` beside it with `mass_kg` comes before what the file says of the mass. A static trial gives the markers
    that it lacks, as for `readers.read_c3d`.

    Raises
    ------
    InputError
        If a file cannot be read, or nothing tells the mass.
    """
    content, is_c3d = content_of(path), path.suffix.lower() == ".c3d"
    about = path.with_suffix(".json")
    mass = _about(about)["mass_kg"] if about.exists() else c3d_mass(content) if is_c3d else None
    if mass is None:
        raise InputError(f'{path} does not say what its subject weighs: write {{"mass_kg": ...}} to {about}', "no_mass")
    capture = (c3d if is_c3d else trc).read(content)
    captured = body_of_markers(capture, None if is_c3d else "Y", static)
    table = None if is_c3d else forces_beside(path)
    plates = plates_of(table, first_time(content)) if table else captured.plates
    body = Body.from_joints(captured.joints, captured.rate, up="Z", mass=mass, name=path.stem, plates=plates)
    shown = plates_on_feet(body)
    return Trial(
        path.stem,
        mass,
        body.rate,
        captured.joints,
        shown.force,
        path.with_suffix(".bvh"),
        shown.centre_of_pressure,
        shown.free_moment,
    )


def _about(path: Path) -> dict[str, Any]:
    """What the file beside a trial says."""
    try:
        about = json.loads(path.read_text(encoding="utf-8"))
        return {**about, "mass_kg": float(about["mass_kg"])}
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise InputError(
            f'{path} cannot be read ({error}): it must be a table such as {{"mass_kg": 70, "rate_hz": 100}}',
            "unreadable_file",
            path=path,
        ) from error


def motion_of_trial(trial: Trial) -> CharacterMotion:
    """The motion of a trial's joint centres; see `motion_of_markers`."""
    points = {CSV_JOINTS.get(name, name): path for name, path in trial.points.items()}
    return motion_of_markers(points, trial.rate, mass=trial.mass, name=trial.name)
