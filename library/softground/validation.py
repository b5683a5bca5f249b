"""Estimated forces against force plates: a row for each trial, as the table of docs/forces.md has it."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ._core.errors import InputError
from ._core.ground.heightfield import FlatTerrain
from ._core.loads.contacts import detect_contacts
from .body import GRAVITY, Body
from .forces import Loads, estimate_loads
from .readers import read_bvh
from .scoring import PointScore, plates_saw_everything, score, score_points
from .storage import forces_beside
from .trials import Trial, motion_of_trial, read_marked, read_trial

Array = NDArray[np.float64]

COLUMNS = {
    "trial": "{:<18}",
    "path": "{:<7}",
    "model": "{:<17}",
    "rms_bw_foot": "{:>7.3f}",
    "rms_bw_left": "{:>7.3f}",
    "rms_bw_right": "{:>7.3f}",
    "rms_bw_total": "{:>7.3f}",
    "share_rms_bw": "{:>7.3f}",
    "peak_ratio": "{:>7.2f}",
    "heel_strike_ms": "{:>7.1f}",
    "heel_strike_bias_ms": "{:>7.1f}",
    "toe_off_ms": "{:>7.1f}",
    "toe_off_bias_ms": "{:>7.1f}",
    "rms_bw_anterior_posterior": "{:>7.3f}",
    "rms_bw_foot_anterior_posterior": "{:>7.3f}",
    "rms_bw_foot_medio_lateral": "{:>7.3f}",
    "mean_cycle_bw": "{:>7.3f}",
    "rms_centre_mm": "{:>7.0f}",
    "rms_free_moment_nm": "{:>7.1f}",
    "frames_scored": "{:>7d}",
}
HEADINGS = (
    *("trial", "path", "model", "foot", "left", "right", "total", "share", "peak"),
    *("HS ms", "bias", "TO ms", "bias", "AP", "AP foot", "ML foot", "mean", "CoP mm", "FM Nm", "frames"),
)


@dataclass(frozen=True)
class Told:
    """What is told of a body at its frames, left foot first.

    Attributes
    ----------
    forces : (F, 2, 3) float array
        [N]
    deviation : (F, 2) float array
        Standard deviation of the vertical force [N].
    centres : (F, 2, 3) float array
        Centres of pressure [m].
    free_moments : (F, 2) float array
        [N·m]
    """

    forces: Array
    deviation: Array
    centres: Array
    free_moments: Array

    @classmethod
    def of(cls, loads: Loads) -> Told:
        """What loads tell of a left and a right foot."""
        feet = {sole.side: number for number, sole in enumerate(loads.soles)}
        order = [feet[side] for side in "LR"]
        soles, shown = [loads.soles[number] for number in order], loads.steps.motion.on_frames
        return cls(
            np.stack([sole.force for sole in soles], axis=1),
            np.stack([sole.deviation for sole in soles], axis=1),
            loads.steps.forces.centre_of_pressure[shown][:, order],
            np.stack([sole.free_moment for sole in soles], axis=1),
        )


def read_trials(directory: Path, static: Path | None = None) -> list[Trial]:
    """The trials of a folder: C3D files, TRC files with forces, or NAME.csv and NAME.json.

    A NAME.bvh beside either is the same motion. A static trial of the subject of all files of markers gives those that
    they lack; it may lie in the folder, and is no trial itself.

    Raises
    ------
    InputError
        If there is none, or one cannot be read.
    """
    trials = [read_trial(csv) for csv in sorted(directory.glob("*.csv"))]
    marked = sorted(directory.glob("*.[cC]3[dD]"))
    marked += [file for file in sorted(directory.glob("*.[tT][rR][cC]")) if forces_beside(file)]
    trials += [read_marked(file, static) for file in marked if static is None or file.resolve() != static.resolve()]
    if not trials:
        raise InputError(
            f"{directory} holds no trial: give a folder of C3D files, of TRC files with forces as NAME_grf.mot, or of "
            "NAME.csv, .json and .bvh files",
            "no_trials",
        )
    return trials


def validate(trial: Trial) -> Iterator[dict[str, object]]:
    """Rows of the table for one trial: from its joint centres, and from its BVH where it has one."""
    motion = motion_of_trial(trial)
    bodies = {"joints": Body(motion, motion)}
    if trial.bvh.exists():
        bodies["bvh"] = read_bvh(trial.bvh, mass=trial.mass)
    for path, body in bodies.items():
        scored = scored_frames(trial, body)
        if scored.any():
            told = Told.of(estimate_loads(body))
            yield from rows(trial, path, scored, {"WHOLE_BODY": told.forces}, told)


def scored_frames(trial: Trial, body: Body) -> NDArray[np.bool_]:
    """Frames of a trial at which the plates show all that bears its body, (F,)."""
    if len(body.times) != len(trial.forces):
        raise InputError(f"{trial.name}: {len(body.times)} frames, {len(trial.forces)} forces", "frames_differ")
    touching = detect_contacts(body.motion, FlatTerrain()).touching
    weight = trial.mass * GRAVITY
    return plates_saw_everything(trial.forces[..., 2], touching, weight=weight, rate=trial.rate)


def rows(
    trial: Trial, path: str, scored: NDArray[np.bool_], curves: Mapping[str, Array], told: Told
) -> Iterator[dict[str, object]]:
    """Rows of the table for one motion of a trial.

    Parameters
    ----------
    trial : Trial
    path : str
        From what the motion was read.
    scored : (F,) bool array
        Frames that count.
    curves : mapping of str to (F, 2, 3) float array
        Forces by each model [N]; "WHOLE_BODY" is what `told` is of.
    told : Told
    """
    points = score_points(told.centres, told.free_moments, (trial.centres, trial.free_moments), scored)
    for model, forces in curves.items():
        result = score(forces, trial.forces, scored, weight=trial.mass * GRAVITY, rate=trial.rate)
        about = {"trial": trial.name, "subject": trial.subject, "kind": trial.kind, "path": path, "model": model}
        of_model = points if model == "WHOLE_BODY" else PointScore()
        yield about | dataclasses.asdict(result) | dataclasses.asdict(of_model)


def table(rows: Sequence[Mapping[str, object]]) -> str:
    """Errors in body weights (vertical; AP along the progress, ML across it), of timing in ms.

    Those of the centre of pressure in mm and of the free moment in N·m stay empty where the plates do not tell.
    """
    lines = ["{:<18} {:<7} {:<17} ".format(*HEADINGS[:3]) + " ".join(f"{heading:>7}" for heading in HEADINGS[3:])]
    for row in rows:
        cells = ((form, row[key]) for key, form in COLUMNS.items())
        lines.append(" ".join(form.format(value) if value is not None else f"{'':>7}" for form, value in cells))
    return "\n".join(lines)
