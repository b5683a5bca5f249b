"""Shuffles, jumps and dances: steps checked by eye, forces that a body could bear.

The counts were read from plots of foot heights and speeds with the detected contacts shaded in them: they guard against
change, and are no independent count. Those of gait/ agree with the force plates.

Needs Blender's module and the reference data beside the repository; skips without them.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy")

from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.loads.estimate import CharacterLoads, estimate_loads
from softground_addon.core.numerics.intervals import runs
from tests.validation.through_blender import motion_of_bvh

DATA = Path(__file__).parents[3] / "shared" / "data"
SNOW = GroundMaterial(youngs_modulus=0.25e6, poisson_ratio=0.05, characteristic_time=0.2)
MASS = 75.0
WEIGHT = MASS * 9.81

SOURCES = {
    "bvh/zombie": {"scale": 0.04, "forward": "Y", "up": "Z"},
    "bvh/jumping": {"scale": 0.04, "forward": "Y", "up": "Z"},
    "bvh/jumping_jacks": {"scale": 0.056444, "forward": "-Z", "up": "Y"},
    "bvh/jesse_dance": {},
    "gait/walk_subject01": {"rate": 60.0},
    "gait/run_rajagopal": {"rate": 100.0},
}
STEPS = {  # left, right; a foot that stands in the first frame counts
    "bvh/zombie": (15, 16),
    "bvh/jumping": (3, 3),  # standing, the landing, and a small step of each foot after it
    "bvh/jumping_jacks": (7, 7),
    "bvh/jesse_dance": (10, 11),
    "gait/walk_subject01": (3, 3),
    "gait/run_rajagopal": (7, 8),
}

pytestmark = pytest.mark.skipif(not DATA.exists(), reason=f"needs the reference data in {DATA}")


class Loads(dict[str, CharacterLoads]):
    """The loads of the sources, each worked out when it is asked for."""

    def __missing__(self, name: str) -> CharacterLoads:
        motion = motion_of_bvh(DATA / f"{name}.bvh", mass=MASS, **SOURCES[name])
        self[name] = estimate_loads(motion, FlatTerrain(), force_model="WHOLE_BODY", material=SNOW)
        return self[name]


@pytest.fixture(scope="module")
def loads() -> Loads:
    return Loads()


@pytest.mark.parametrize("name", SOURCES)
def test_the_steps_are_those_that_one_sees(loads, name):
    assert tuple(len(runs(foot)[0]) for foot in loads[name].contacts.touching.T) == STEPS[name]


@pytest.mark.parametrize("name", SOURCES)
def test_forces_vanish_in_flight_and_peak_below_five_body_weights(loads, name):
    forces = loads[name].forces.forces[..., 2] / WEIGHT
    assert np.all(forces[~loads[name].contacts.touching] == 0)
    assert forces.min() >= 0
    assert forces.sum(axis=1).max() < 5.0


@pytest.mark.parametrize("name", SOURCES)
def test_the_mean_force_is_the_weight(loads, name):
    assert loads[name].forces.total[:, 2].mean() == pytest.approx(WEIGHT, rel=0.03)


def test_one_stands_with_the_weight_before_a_jump_and_lands_with_two_to_five(loads):
    jump = loads["bvh/jumping"]
    vertical = jump.forces.total[:, 2] / WEIGHT
    time = jump.motion.times
    assert vertical[time < 1.2] == pytest.approx(np.ones((time < 1.2).sum()), abs=0.05)
    flight = runs(~jump.contacts.touching.any(axis=1))
    landing = flight[1][0]
    assert 2.0 < vertical[landing:].max() < 5.0


def test_the_feet_of_walk_and_run_alternate(loads):
    for name in ("gait/walk_subject01", "gait/run_rajagopal", "bvh/zombie"):
        strikes = sorted(
            (int(first), foot)
            for foot, touching in enumerate(loads[name].contacts.touching.T)
            for first in runs(touching)[0]
            if first > 0
        )
        assert all(a[1] != b[1] for a, b in pairwise(strikes)), name
