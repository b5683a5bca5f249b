"""Measured forces as OpenSim users lay them out: a table (.mot, .sto) beside the markers (.trc), Y up.

References
----------
OpenSim documentation, "Storage (.sto) Files" and "Preparing Your Data: Ground reaction forces".
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ._core.capture.captured import Plate
from ._core.capture.joint_centres import UPWARD
from ._core.errors import InputError
from .readers import content_of

Array = NDArray[np.float64]

_FORCE = re.compile(r"(.*)_vx")
_CORNERS = np.array([[0.5, 0.5, 0.0], [-0.5, 0.5, 0.0], [-0.5, -0.5, 0.0], [0.5, -0.5, 0.0]])
"""Of a plate whose middle is where the laboratory's axes begin; moments are about that."""


def forces_beside(markers: Path) -> Path | None:
    """The table of forces of a file of markers: NAME.mot, NAME_grf.mot and the like, also in OpenCap's ForceData."""
    folders = (markers.parent, markers.parent.parent / "ForceData")
    files = [file for folder in folders for file in sorted(folder.glob(f"{markers.stem}*.[mMsS][oOtT][tToO]"))]
    return next((file for file in files if any(map(_FORCE.fullmatch, _table(file)[0]))), None)


def plates_of(file: Path, start: float) -> tuple[Plate, ...]:
    """The forces of a table as plates, Z up.

    Parameters
    ----------
    file : Path
    start : float
        Time of the first frame of the markers [s]; the plates' samples begin there.

    Raises
    ------
    InputError
        If the file is no such table.
    """
    labels, rows = _table(file)
    time, values = rows[:, 0], dict(zip(labels, rows.T, strict=True))
    step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    if not step > 0:
        raise InputError(f"{file} has no times that grow: export it again", "damaged_file")
    at = start + step * np.arange(max(int((time[-1] - start) / step + 1.5), 1))
    at = np.where(at > time[0] - step / 2, np.clip(at, time[0], time[-1]), at)  # times are rounded
    plates = []
    for label in filter(_FORCE.fullmatch, labels):
        name = label.removesuffix("_vx")
        force, point = (_vectors(values, [f"{name}_{kind}"]) for kind in "vp")
        torque = name.replace("force", "torque")
        moment = np.cross(point, force) + _vectors(values, [f"{name}_m", f"{torque}_", f"{torque}_m"])
        parts = [
            np.column_stack([np.interp(at, time, column, left=0.0) for column in (part @ UPWARD["Y"].T).T])
            for part in (force, moment)
        ]
        plates.append(Plate(_CORNERS, 1 / step, *parts))
    return tuple(plates)


def first_time(markers: bytes) -> float:
    """Time of the first frame of a TRC file [s]; 0 where it does not say."""
    rows = [line.split() for line in markers.decode("utf-8", errors="replace").splitlines()[5:]]
    numbers = [row for row in rows if len(row) > 1 and row[0].isdigit()]
    try:
        return float(numbers[0][1])
    except (IndexError, ValueError):
        return 0.0


def _table(file: Path) -> tuple[list[str], Array]:
    """Labels, and the numbers below them, (N, C)."""
    head, found, tail = content_of(file).decode("utf-8", errors="replace").partition("endheader")
    lines = [line.split() for line in (tail if found else head).splitlines() if line.strip()]
    try:
        rows = np.array(lines[1:], dtype=float)
    except (IndexError, ValueError) as error:
        raise InputError(f"{file} is no table of OpenSim ({error}): export it again", "wrong_format") from error
    if not len(rows) or rows.shape[1:] != (len(lines[0]),):
        raise InputError(f"{file} is no table of OpenSim: its rows and labels do not match", "wrong_format")
    return lines[0], np.nan_to_num(rows)


def _vectors(values: dict[str, Array], names: list[str]) -> Array:
    """The vectors (N, 3) of the first of some names that a table has; zeros where it has none."""
    for name in names:
        if all(f"{name}{axis}" in values for axis in "xyz"):
            return np.stack([values[f"{name}{axis}"] for axis in "xyz"], axis=-1)
    return np.zeros((len(next(iter(values.values()))), 3))
