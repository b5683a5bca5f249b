"""Constants of the forces, each chosen without who judges it: `python -m tests.validation.leave_one_out DIR`.

Each constant is scaled by some factors while the others stay. For every person of DIR (see `trials.read_trial`) the
factor is taken that is best for the other people, and this person is scored with it. A constant that was made for one
person shows: chosen on the others it leaves that one worse than as shipped.
"""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from library.softground.scoring import plates_saw_everything, score
from library.softground.trials import Trial, motion_of_trial, read_trial
from softground_addon.core.dynamics import body_dynamics, centre_of_mass, centre_of_pressure, load_sharing
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.loads import contact_timing, contacts
from softground_addon.core.loads.contacts import detect_contacts
from softground_addon.core.loads.estimate import estimate_loads

Array = NDArray[np.float64]

GRAVITY = 9.81
FACTORS = (0.7, 0.85, 1.0, 1.2, 1.4)
SOIL = GroundMaterial(youngs_modulus=1e6, poisson_ratio=0.3, characteristic_time=0.1)
MODULES = (body_dynamics, centre_of_mass, centre_of_pressure, contact_timing, contacts, load_sharing)
CONSTANTS: dict[ModuleType, tuple[str, ...]] = {
    body_dynamics: (
        *("CUTOFF", "CUTOFF_DEVIATION", "FIRST_PASS", "LAST_PASS", "BOTH_PASSES"),
        *("LAG", "SLOW_CUTOFF", "STANDING", "STEADY_ENDS"),
    ),
    centre_of_mass: ("_FRACTION_DEVIATION", "_FALL_DEVIATION"),
    centre_of_pressure: ("PRESSED_DEPTH",),
    contacts: (
        *("TOUCH_HEIGHT", "LEAVE_HEIGHT", "TOUCH_SPEED", "TOUCH_SHARE", "LANDED_HEIGHT", "REST_SPEED", "EDGE_SEARCH"),
        *("EDGE_CUTOFF", "STRIKE_SPEED", "TOE_OFF_SPEED", "TOE_OFF_SHARE", "BESIDE"),
    ),
    contact_timing: (
        *("SEARCH", "TIMING_DEVIATION", "SHARE_DEVIATION", "WANDER", "SURE", "SHARE_MEMORY"),
        *("LANDING_DEVIATION", "ONSET_DEVIATION", "IDLE_LOAD"),
    ),
    load_sharing: ("SHARE_DEVIATION", "POINT_DEVIATION", "EVEN_PART", "LONGEST_RAMP", "LONG_OVERLAP"),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("directory", type=Path, help="folder of trials: NAME.csv, NAME.json and NAME.bvh")
    trials = [read_trial(csv) for csv in sorted(parser.parse_args().directory.glob("*.csv"))]
    people = sorted({trial.subject for trial in trials})
    shipped = errors(trials)
    print(f"{'as shipped':<36}" + "".join(f"{by_person(trials, shipped)[who]:>18.4f}" for who in people))
    print(f"{'constant':<36}" + "".join(f"{who:>18}" for who in people))
    for module, names in CONSTANTS.items():
        for name in names:
            tried = {factor: errors(trials, module, name, factor) for factor in FACTORS if factor != 1.0}
            print(row(f"{module.__name__.rpartition('.')[-1]}.{name}", trials, tried | {1.0: shipped}, people))


def row(label: str, trials: list[Trial], tried: dict[float, Array], people: list[str]) -> str:
    """For each person the factor that is best for all others, and this person's change with it."""
    cells = []
    for who in people:
        best = min(tried, key=lambda factor: mean_without(who, by_person(trials, tried[factor])))
        change = by_person(trials, tried[best])[who] - by_person(trials, tried[1.0])[who]
        cells.append(f"{f'x{best} {change:+.4f}':>18}")
    return f"{label:<36}" + "".join(cells)


def by_person(trials: list[Trial], error: Array) -> dict[str, float]:
    """Mean error of each person's trials (T,)."""
    subjects = np.array([trial.subject for trial in trials])
    return {who: float(error[subjects == who].mean()) for who in np.unique(subjects).tolist()}


def mean_without(who: str, error: dict[str, float]) -> float:
    """Mean over the other people."""
    return float(np.mean([value for person, value in error.items() if person != who]))


def errors(trials: list[Trial], module: ModuleType | None = None, name: str = "", factor: float = 1.0) -> Array:
    """Root mean square error of the vertical force per foot on each trial [body weights], (T,), one constant scaled."""
    with scaled(module, name, factor):
        return np.array([error_of(trial) for trial in trials])


@contextmanager
def scaled(module: ModuleType | None, name: str, factor: float) -> Iterator[None]:
    """A constant times a factor in its module, and where others have it from there."""
    value = getattr(module, name, None)
    holders = [other for other in MODULES if other is module or (value is not None and imports(other, module, name))]
    for holder in holders:
        setattr(holder, name, value * factor)
    try:
        yield
    finally:
        for holder in holders:
            setattr(holder, name, value)


def imports(module: ModuleType, source: ModuleType | None, name: str) -> bool:
    """True if `module` has its `name` from `source`: the same object."""
    return getattr(module, name, None) is getattr(source, name)


def error_of(trial: Trial) -> float:
    """Error per foot of one trial from its joint centres [body weights]; scored are the frames as shipped."""
    motion, weight = motion_of_trial(trial), trial.mass * GRAVITY
    loads = estimate_loads(motion, FlatTerrain(), force_model="WHOLE_BODY", material=SOIL)
    steps = (len(loads.motion.frames) - 1) // (len(motion.frames) - 1)
    touching = detect_contacts(motion, FlatTerrain()).touching
    seen = plates_saw_everything(trial.forces[..., 2], touching, weight=weight, rate=trial.rate)
    result = score(loads.forces.forces[::steps], trial.forces, seen, weight=weight, rate=trial.rate)
    return float(dataclasses.asdict(result)["rms_bw_foot"])


if __name__ == "__main__":
    main()
