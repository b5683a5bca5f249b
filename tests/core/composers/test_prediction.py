"""The depth that is predicted without pressing a cell is the one that pressing gives, whatever the ground does."""

from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.composers.prediction import FEW, TYPICAL, contact_loads
from softground_addon.core.composers.simulation import simulate
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.motion.motion import LowSkin
from softground_addon.core.record.typical_depth import main_contacts, typical_of
from tests.core.character import Slope
from tests.core.pressing.test_prop_prints import resting
from tests.core.prop_bodies import prop_sole, sphere
from tests.core.walkers import walk
from tests.tiers import slow_but_one

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


def prints_of(loads, material, pressure):
    results = simulate(loads, SoftGround(FlatTerrain(), material, pressure), CELL)
    return [print_ for result in results for print_ in result.footprints]


def pressed(loads, material, pressure, variation=None):
    results = simulate(loads, SoftGround(FlatTerrain(), material, pressure, variation), CELL)
    return max((print_.max_depth_m for result in results for print_ in result.footprints), default=0.0)


@pytest.mark.parametrize("pressure", ["UNIFORM", "CENTRE_OF_PRESSURE"])
@pytest.mark.parametrize("painted", [False, True], ids=["even", "painted"])
@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS.keys())
def test_the_predicted_depth_is_the_pressed_one(options, painted, pressure):
    loads, material = walk(steps=4), replace(SNOW, **options)
    variation = Stripes() if painted else None
    contacts = contact_loads([loads], FlatTerrain(), CELL, variation)
    expected = pressed([loads], material, pressure, variation)
    assert contacts.deepest(material, pressure) == pytest.approx(expected, rel=0.03, abs=1e-6)


@pytest.mark.parametrize("pressure", slow_but_one(["CENTRE_OF_PRESSURE", "UNIFORM"]))
def test_the_typical_step_is_the_median_of_those_that_are_pressed(pressure):
    """Also where it is told from some of them alone."""
    loads = walk(steps=5)
    weights = np.linspace(0.5, 1.5, 9)
    crowd = [replace(loads, forces=replace(loads.forces, forces=weight * loads.forces.forces)) for weight in weights]
    contacts = contact_loads(crowd, FlatTerrain(), CELL)
    assert len(contacts.soles) > 1.5 * TYPICAL
    depths = np.concatenate([[p.max_depth_m for p in prints_of([one], SNOW, pressure)] for one in crowd])
    impulse = np.concatenate([[p.load_n.sum() for p in prints_of([one], SNOW, pressure)] for one in crowd])
    expected = np.median(depths[main_contacts(impulse)])
    assert contacts.typical(SNOW, pressure) == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("painted", [False, True], ids=["even", "painted"])
@pytest.mark.parametrize("crust", [0.0, 2e3, 1e6])
def test_the_predicted_depth_of_a_ball_that_rests_is_the_pressed_one(crust, painted):
    loads = resting(prop_sole(*sphere(0.15, rings=32)), (0.3, 0.0, 0.15), 300.0, seconds=3.0)
    material, variation = replace(SNOW, crust_stress=crust), Stripes() if painted else None
    contacts = contact_loads([loads], FlatTerrain(), CELL, variation)
    expected = pressed([loads], material, "UNIFORM", variation)
    assert (expected == 0) == (crust == 1e6)
    assert contacts.deepest(material) == pytest.approx(expected, rel=0.03)


def sliding(speed, loads):
    """The same contacts with feet that slide along x [m/s] all the time."""
    moved = []
    for sole in loads.motion.soles:
        transforms = sole.transforms.copy()
        transforms[..., 0, 3] += (speed * loads.motion.time_step * np.arange(len(transforms)))[:, None]
        moved.append(replace(sole, transforms=transforms))
    return replace(loads, motion=replace(loads.motion, soles=tuple(moved)))


@pytest.mark.parametrize("pressure", ["UNIFORM", "CENTRE_OF_PRESSURE"])
@pytest.mark.parametrize("speed", [0.1, 0.4, 1.5])
def test_a_foot_that_slides_is_predicted_as_shallow_as_it_prints(speed, pressure):
    loads = sliding(speed, walk(steps=4))
    expected = pressed([loads], SNOW, pressure)
    assert contact_loads([loads], FlatTerrain(), CELL).deepest(SNOW, pressure) == pytest.approx(expected, rel=0.03)


@pytest.mark.parametrize("hardening", [0.0, 4.0])
@pytest.mark.parametrize("speed", [1.0, 2.0])
def test_a_gait_on_the_spot_is_predicted_by_the_prints_into_which_its_tracks_are_cut(speed, hardening):
    loads, material = sliding(speed, walk(steps=4)), replace(SNOW, hardening=hardening)
    frames = loads.motion.frames
    skin = LowSkin(frames, np.zeros((len(frames), 1, 3)), np.zeros((len(frames), 1)), 0.3, 1.0)
    known = replace(loads, motion=replace(loads.motion, skin=skin))
    prints = prints_of([known], material, "UNIFORM")
    assert len(prints) > len(prints_of([loads], material, "UNIFORM"))
    contacts = contact_loads([known], FlatTerrain(), CELL)
    assert contacts.typical(material) == pytest.approx(typical_of(prints), rel=0.02)


def test_the_typical_step_is_of_feet_whatever_else_prints():
    loads, ball = walk(steps=4), resting(prop_sole(*sphere(0.2)), (9.0, 9.0, 0.2), 5000.0)
    both = prints_of([loads, ball], SNOW, "UNIFORM")
    assert typical_of(both) == typical_of(prints_of([loads], SNOW, "UNIFORM"))
    assert max(one.max_depth_m for one in both) > 2 * typical_of(both)
    contacts = contact_loads([loads, ball], FlatTerrain(), CELL)
    assert contacts.typical(SNOW) == pytest.approx(typical_of(both), rel=0.02)


@pytest.mark.parametrize("pressure", slow_but_one(["CENTRE_OF_PRESSURE", "UNIFORM"]))
def test_few_contacts_tell_the_deepest_of_many(pressure):
    loads = walk(steps=4)
    weights = np.random.default_rng(2).uniform(0.5, 1.5, 30)
    crowd = [replace(loads, forces=replace(loads.forces, forces=weight * loads.forces.forces)) for weight in weights]
    contacts = contact_loads(crowd, FlatTerrain(), CELL)
    assert len(crowd) * 4 > 3 * FEW
    assert contacts.deepest(SNOW, pressure, most=FEW) == contacts.deepest(SNOW, pressure)


@pytest.mark.parametrize("hardening", [0.0, 4.0])
@pytest.mark.parametrize("most", [FEW, None])
def test_feet_that_come_down_on_their_own_prints_add_as_much_as_is_predicted(hardening, most):
    loads, material = walk(steps=8, speed=1e-3), replace(SNOW, hardening=hardening)
    first = pressed([walk(steps=1, speed=1e-3)], material, "UNIFORM")
    expected = pressed([loads], material, "UNIFORM")
    assert contact_loads([loads], FlatTerrain(), CELL).deepest(material, most=most) == pytest.approx(expected, rel=0.03)
    assert expected < 1.2 * first


@pytest.mark.parametrize("pressure", ["UNIFORM", "CENTRE_OF_PRESSURE"])
@pytest.mark.parametrize("speed", [0.004, 0.006, 0.008, 0.01])
def test_feet_that_come_down_a_little_beside_their_prints_are_predicted_by_what_they_add(speed, pressure):
    """Cells that the step before has covered in part take the rest of a print."""
    loads = walk(steps=8, speed=speed)
    expected = typical_of(prints_of([loads], SNOW, pressure))
    assert contact_loads([loads], FlatTerrain(), CELL).typical(SNOW, pressure) == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("pressure", ["UNIFORM", "CENTRE_OF_PRESSURE"])
def test_steps_on_the_edge_of_the_ground_are_predicted_like_those_beside_it(pressure):
    loads = walk()
    whole = contact_loads([loads], FlatTerrain(), CELL).deepest(SNOW, pressure)
    edge = float(loads.motion.soles[0].transforms[-1, 0, 0, 3]) / 2
    terrain = Slope(edge=edge)
    results = simulate([loads], SoftGround(terrain, SNOW, pressure), CELL)
    baked = max(footprint.max_depth_m for result in results for footprint in result.footprints)
    predicted = contact_loads([loads], terrain, CELL).deepest(SNOW, pressure)
    assert predicted == pytest.approx(baked, rel=0.03)
    assert predicted <= whole * 1.001


def test_cells_of_a_hair_s_breadth_take_no_more_squares_than_a_sole_shows():
    loads = walk(steps=2)
    few, fine = (contact_loads([loads], FlatTerrain(), size) for size in (1e-3, 1e-5))
    assert fine.typical(SNOW) == pytest.approx(few.typical(SNOW), rel=0.01)
    assert sum(len(one.squares) for one in fine.soles) <= 1.1 * sum(len(one.squares) for one in few.soles)
