"""Both force models against force plates: `python -m tests.validation.validate DIR` prints a table.

Every trial of DIR (C3D, or three files each, see `trials.read_trial`) is estimated from its joint centres, and where it
has a BVH from that through Blender with the automatic set-up. Writes build/validation.json and one plot for each trial
and path.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from library.softground.scoring import PointScore, plates_saw_everything, score, score_points
from library.softground.trials import Trial, motion_of_trial, read_marked, read_trial
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.loads.contacts import detect_contacts
from softground_addon.core.loads.deviation import force_deviation
from softground_addon.core.loads.estimate import ForceModel, estimate_loads
from softground_addon.core.loads.free_moments import free_moments
from softground_addon.core.motion.motion import CharacterMotion
from tests.validation.plots import plot_trial
from tests.validation.through_blender import motion_of_bvh

Array = NDArray[np.float64]

GRAVITY = 9.81
CHARACTERISTIC_TIMES = (0.05, 0.1, 0.15, 0.2)
"""Ground times at which the impulse model is run: those of the presets [s]."""
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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("directory", type=Path, help="folder of trials: NAME.c3d, or NAME.csv, NAME.json, NAME.bvh")
    parser.add_argument("--output", type=Path, default=Path("build"), help="folder for validation.json and the plots")
    options = parser.parse_args()
    trials = [read_trial(csv) for csv in sorted(options.directory.glob("*.csv"))]
    trials += [read_marked(file) for file in sorted(options.directory.glob("*.[cC]3[dD]"))]
    if not trials:
        parser.error(
            f"{options.directory} holds no trial: give a folder of C3D files, or of NAME.csv, .json and .bvh files"
        )
    options.output.mkdir(parents=True, exist_ok=True)
    rows = [row for trial in trials for row in validate(trial, options.output)]
    (options.output / "validation.json").write_text(json.dumps(rows, indent=1))
    print_table(rows)


def validate(trial: Trial, output: Path) -> Iterator[dict[str, object]]:
    """Rows of the table for one trial, for each path and model."""
    for path, motion in motions_of(trial):
        touching = detect_contacts(motion, FlatTerrain()).touching
        scored = plates_saw_everything(trial.forces[..., 2], touching, weight=trial.mass * GRAVITY, rate=trial.rate)
        if not scored.any():
            print(f"{trial.name}: the plates show none of it whole, nothing to score")
            continue
        curves, shown = dict(estimates(motion)), whole_body(motion)
        points = score_points(shown.centres, shown.free_moments, (trial.centres, trial.free_moments), scored)
        for model, forces in curves.items():
            result = score(forces, trial.forces, scored, weight=trial.mass * GRAVITY, rate=trial.rate)
            about = {"trial": trial.name, "subject": trial.subject, "kind": trial.kind, "path": path, "model": model}
            told = points if model == "WHOLE_BODY" else PointScore()
            yield about | dataclasses.asdict(result) | dataclasses.asdict(told)
        plot_trial(trial, path, curves, shown.deviation, scored, output / f"{trial.name}_{path}.png")


def motions_of(trial: Trial) -> Iterator[tuple[str, CharacterMotion]]:
    """The trial's motion, from its joint centres and through Blender, on the frames of the plates."""
    yield "joints", motion_of_trial(trial)
    if trial.bvh.exists():
        yield "bvh", motion_of_bvh(trial.bvh, mass=trial.mass, rate=trial.rate)


def estimates(motion: CharacterMotion) -> Iterator[tuple[str, Array]]:
    """Forces of each model at the motion's frames, (F, 2, 3) [N], left foot first."""
    models: list[tuple[str, ForceModel, float]] = [("WHOLE_BODY", "WHOLE_BODY", CHARACTERISTIC_TIMES[0])]
    models += [(f"IMPULSE tau={tau:.2f}", "IMPULSE", tau) for tau in CHARACTERISTIC_TIMES]
    order = [[sole.sole.side for sole in motion.soles].index(side) for side in "LR"]
    for name, model, tau in models:
        material = GroundMaterial(youngs_modulus=1e6, poisson_ratio=0.3, characteristic_time=tau)
        loads = estimate_loads(motion, FlatTerrain(), force_model=model, material=material)
        steps = (len(loads.motion.frames) - 1) // (len(motion.frames) - 1)
        yield name, loads.forces.forces[::steps, order]


@dataclass(frozen=True)
class Shown:
    """What the whole-body model tells beside the forces at the motion's frames, left foot first.

    Attributes
    ----------
    deviation : (F, 2) float array
        Standard deviation of the vertical force [N].
    centres : (F, 2, 3) float array
        Centres of pressure [m].
    free_moments : (F, 2) float array
        [N·m]
    """

    deviation: Array
    centres: Array
    free_moments: Array


def whole_body(motion: CharacterMotion) -> Shown:
    """What the whole-body model tells of a motion beside its forces."""
    material = GroundMaterial(youngs_modulus=1e6, poisson_ratio=0.3, characteristic_time=CHARACTERISTIC_TIMES[0])
    loads = estimate_loads(motion, FlatTerrain(), force_model="WHOLE_BODY", material=material)
    steps = (len(loads.motion.frames) - 1) // (len(motion.frames) - 1)
    order = [[sole.sole.side for sole in motion.soles].index(side) for side in "LR"]
    told = (force_deviation(loads), loads.forces.centre_of_pressure, free_moments(loads))
    return Shown(*(values[::steps, order] for values in told))


def print_table(rows: list[dict[str, object]]) -> None:
    """Errors in body weights (vertical; AP along the progress, ML across it), of timing in ms.

    Those of the centre of pressure in mm and of the free moment in N·m stay empty where the plates do not tell.
    """
    print("{:<18} {:<7} {:<17} ".format(*HEADINGS[:3]) + " ".join(f"{heading:>7}" for heading in HEADINGS[3:]))
    for row in rows:
        cells = ((form, row[key]) for key, form in COLUMNS.items())
        print(" ".join(form.format(value) if value is not None else f"{'':>7}" for form, value in cells))


if __name__ == "__main__":
    main()
