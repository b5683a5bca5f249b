"""Both force models against force plates: `python -m tests.validation.validate DIR` prints a table.

Every trial of DIR (C3D, or three files each, see `trials.read_trial`) is estimated from its joint centres, and where it
has a BVH from that through Blender with the automatic set-up. Writes build/validation.json and one plot for each trial
and path.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from library.softground import Body, InputError
from library.softground import estimate_loads as estimated_by_library
from library.softground.trials import Trial, motion_of_trial
from library.softground.validation import Told, read_trials, rows, scored_frames, table
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.loads.estimate import ForceModel, estimate_loads
from softground_addon.core.motion.motion import CharacterMotion
from tests.validation.plots import plot_trial
from tests.validation.through_blender import motion_of_bvh

Array = NDArray[np.float64]

CHARACTERISTIC_TIMES = (0.05, 0.1, 0.15, 0.2)
"""Ground times at which the impulse model is run: those of the presets [s]."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("directory", type=Path, help="folder of trials: NAME.c3d, or NAME.csv, NAME.json, NAME.bvh")
    parser.add_argument("--output", type=Path, default=Path("build"), help="folder for validation.json and the plots")
    options = parser.parse_args()
    try:
        trials = read_trials(options.directory)
    except InputError as error:
        parser.error(str(error))
    options.output.mkdir(parents=True, exist_ok=True)
    scores = [row for trial in trials for row in validate(trial, options.output)]
    (options.output / "validation.json").write_text(json.dumps(scores, indent=1))
    print(table(scores))


def validate(trial: Trial, output: Path) -> Iterator[dict[str, object]]:
    """Rows of the table for one trial, for each path and model."""
    for path, motion in motions_of(trial):
        body = Body(motion, motion)
        scored = scored_frames(trial, body)
        if not scored.any():
            print(f"{trial.name}: the plates show none of it whole, nothing to score")
            continue
        curves, estimated = dict(estimates(motion)), Told.of(estimated_by_library(body))
        yield from rows(trial, path, scored, curves, estimated)
        plot_trial(trial, path, curves, estimated.deviation, scored, output / f"{trial.name}_{path}.png")


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


if __name__ == "__main__":
    main()
