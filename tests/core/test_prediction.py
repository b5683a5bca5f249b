"""The depth that is foretold without pressing a cell is the one that pressing gives, whatever the ground does."""

from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.prediction import deepest, stance_loads
from softground_addon.core.simulation import simulate
from tests.core.pressing.test_prop_prints import resting
from tests.core.prop_bodies import prop_sole, sphere
from tests.core.walkers import walk

SNOW = GroundMaterial(0.25e6, 0.05, 0.2)
CELL = 0.01

OPTIONS = {
    "as in the paper": {},
    "crust that steps break": {"crust_stress": 15e3},
    "crust that steps break in part": {"crust_stress": 40e3},
    "crust that carries": {"crust_stress": 1e6},
    "firm ground below": {"firm_depth": 0.01},
    "time from the landing": {"shortest_time": 0.02},
    "all of them": {"crust_stress": 20e3, "firm_depth": 0.015, "shortest_time": 0.05},
}


class Stripes:
    """Ground whose stiffness and depth change along the walk."""

    def factors(self, x, y):
        wave = np.sin(2.0 * x) + 0 * y
        return np.stack([1.0 + 0.6 * wave, 1.0 - 0.3 * wave, np.ones_like(wave)])


def pressed(loads, material, pressure, variation=None):
    results = simulate([loads], SoftGround(FlatTerrain(), material, pressure, variation), CELL)
    return max((print_.max_depth_m for result in results for print_ in result.footprints), default=0.0)


@pytest.mark.parametrize("pressure", ["UNIFORM", "CENTRE_OF_PRESSURE"])
@pytest.mark.parametrize("painted", [False, True], ids=["even", "painted"])
@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS.keys())
def test_the_foretold_depth_is_the_pressed_one(options, painted, pressure):
    loads, material = walk(steps=4), replace(SNOW, **options)
    variation = Stripes() if painted else None
    stances = stance_loads([loads], FlatTerrain(), CELL, variation)
    expected = pressed(loads, material, pressure, variation)
    assert deepest(stances, material, pressure) == pytest.approx(expected, rel=0.03, abs=1e-6)


@pytest.mark.parametrize("painted", [False, True], ids=["even", "painted"])
@pytest.mark.parametrize("crust", [0.0, 2e3, 1e6])
def test_the_foretold_depth_of_a_ball_that_rests_is_the_pressed_one(crust, painted):
    loads = resting(prop_sole(*sphere(0.15, rings=32)), (0.3, 0.0, 0.15), 300.0, seconds=3.0)
    material, variation = replace(SNOW, crust_stress=crust), Stripes() if painted else None
    stances = stance_loads([loads], FlatTerrain(), CELL, variation)
    expected = pressed(loads, material, "UNIFORM", variation)
    assert (expected == 0) == (crust == 1e6)
    assert deepest(stances, material) == pytest.approx(expected, rel=0.03)
