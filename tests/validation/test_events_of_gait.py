"""Heel strike and toe-off events against force plates. Needs the reference data beside the repository."""

import numpy as np
import pytest

from library.softground.scoring import crossings, plates_saw_everything
from library.softground.trials import motion_of_trial
from softground_addon.core.events.events import events
from tests.validation.test_forces_of_gait import DATA, loads_of, read

pytestmark = pytest.mark.skipif(not DATA.exists(), reason=f"needs the reference data in {DATA}")


BAR_MS = 15
"""As of the forces."""


@pytest.mark.parametrize("name", ["walk_subject01", "opencap4_walking1", "opencap4_walking2", "run_rajagopal"])
def test_strikes_and_leaves_are_as_near_to_the_plates_as_the_forces(name):
    trial = read(name)
    loads = loads_of(motion_of_trial(trial))
    rows = events([loads], [], surface="snow", first_frame=0)
    touching = loads.contacts.touching[:: (len(loads.motion.frames) - 1) // (len(trial.forces) - 1)]
    weight = trial.mass * 9.81
    saw = plates_saw_everything(trial.forces[..., 2], touching, weight=weight, rate=trial.rate)
    errors = {"strike": [], "toe_off": []}
    for foot, sole in enumerate(loads.motion.soles):
        measured = dict(zip(errors, crossings(trial.forces[:, foot, 2]), strict=True))
        for kind, collected in errors.items():
            wanted = ("heel_strike", "land") if kind == "strike" else ("toe_off",)
            times = np.array([r["time_s"] for r in rows if r["phase"] in wanted and r["contact"] == sole.sole.name])
            true = measured[kind][saw[np.rint(measured[kind]).astype(int)]] / trial.rate
            collected += [np.abs(times - each).min() for each in true]
    for kind, collected in errors.items():
        assert collected, kind
        assert np.mean(collected) * 1e3 <= BAR_MS, kind
