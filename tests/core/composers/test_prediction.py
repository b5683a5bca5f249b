"""The depth that is predicted from few contacts on coarse cells is the one of the bake, whatever the ground does."""

from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.composers import prediction
from softground_addon.core.composers.prediction import (
    MOST_STEPS,
    SAMPLE,
    matching_modulus,
    pressed_again,
    pressed_contacts,
    typical_depth,
)
from softground_addon.core.composers.simulation import simulate
from softground_addon.core.errors import InputError
from softground_addon.core.ground.field_tests import plates, snow
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.motion.motion import LowSkin
from softground_addon.core.record.typical_depth import typical_of
from tests.core.character import Slope
from tests.core.pressing.test_prop_prints import resting
from tests.core.prop_bodies import prop_sole, sphere
from tests.core.walkers import foot_sole, standing, walk
from tests.tiers import slow_but_one

SNOW = GroundMaterial(0.25e6, 0.05, 0.2)
CELL = 0.004
"""Side of a cell of a bake [m], finer than those on which depths are predicted."""

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


def predicted(loads, material=SNOW, pressure="UNIFORM", terrain=None, variation=None, cell=CELL):
    return pressed_contacts(loads, SoftGround(terrain or FlatTerrain(), material, pressure, variation), cell)


def prints_of(loads, material, pressure, variation=None, cell=CELL):
    results = simulate(loads, SoftGround(FlatTerrain(), material, pressure, variation), cell)
    return [print_ for result in results for print_ in result.footprints]


def pressed(loads, material, pressure, variation=None):
    return max((print_.max_depth_m for print_ in prints_of(loads, material, pressure, variation)), default=0.0)


@pytest.mark.slow
@pytest.mark.parametrize("pressure", ["UNIFORM", "CENTRE_OF_PRESSURE"])
@pytest.mark.parametrize("painted", [False, True], ids=["even", "painted"])
@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS.keys())
def test_the_predicted_depth_is_the_pressed_one(options, painted, pressure):
    """In the material that is asked about first, and in one that is asked about afterwards."""
    loads, material = walk(steps=4), replace(SNOW, **options)
    variation = Stripes() if painted else None
    expected = pressed([loads], material, pressure, variation)
    assert predicted([loads], material, pressure, variation=variation).depths.max() == pytest.approx(expected, rel=0.02)
    typical = typical_of(prints_of([loads], material, pressure, variation))
    known = predicted([loads], SNOW, pressure, variation=variation)
    assert typical_depth(known, material, pressure) == pytest.approx(typical, rel=0.02)


@pytest.mark.parametrize("pressure", slow_but_one(["CENTRE_OF_PRESSURE", "UNIFORM"]))
def test_the_typical_step_is_the_median_of_those_that_are_pressed(pressure):
    """Also where it is asked of some of them alone, and in another material than the first."""
    loads, stiffer = walk(steps=3), replace(SNOW, youngs_modulus=0.5e6, firm_depth=0.05)
    weights = np.linspace(0.5, 1.5, 9)
    crowd = [replace(loads, forces=replace(loads.forces, forces=weight * loads.forces.forces)) for weight in weights]
    contacts = predicted(crowd, SNOW, pressure, cell=0.01)
    assert len(contacts.depths) > 2 * SAMPLE > len(contacts.sample)
    for material in (SNOW, stiffer):
        prints = [prints_of([each], material, pressure, cell=0.01) for each in crowd]
        expected = typical_of([print_ for each in prints for print_ in each])
        assert typical_depth(contacts, material, pressure) == pytest.approx(expected, rel=0.02)
        assert material != SNOW or contacts.typical == pytest.approx(expected, rel=0.02)


def test_a_foot_that_stands_for_long_is_predicted_from_fewer_steps():
    loads = standing(foot_sole("foot", "L"), [[0, 0, 0]], 700.0, seconds=15.0)
    swaying = np.sin(np.arange(len(loads.motion.frames)) / 40)[:, None, None]
    loads = replace(loads, forces=replace(loads.forces, forces=loads.forces.forces * (1 + 0.3 * swaying)))
    assert len(loads.motion.frames) > 5 * MOST_STEPS
    assert predicted([loads]).typical == pytest.approx(typical_of(prints_of([loads], SNOW, "UNIFORM")), rel=0.01)


@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS.keys())
@pytest.mark.parametrize("share", [0.4, 1.5])
def test_a_modulus_is_matched_to_a_depth_in_few_trials(share, options, monkeypatch):
    material = replace(SNOW, **options | {"crust_stress": 0.0})
    contacts = predicted([walk(steps=3)], material)
    monkeypatch.setattr(prediction, "MOST_TRIALS", 8)
    modulus = matching_modulus(contacts, material, share * contacts.typical, "UNIFORM")
    reached = typical_depth(contacts, replace(material, youngs_modulus=modulus), "UNIFORM")
    assert reached == pytest.approx(share * contacts.typical, rel=0.002)


def counted(work):
    """What a computation returns, and its number of slices."""
    slices = 0
    while True:
        try:
            next(work)
        except StopIteration as end:
            return end.value, slices
        slices += 1


@pytest.mark.parametrize("share", [0.4, 0.9, 1.5])
@pytest.mark.parametrize("ground", [SNOW, snow(2.16), plates(13.19e3, 692e3, 0.5)], ids=["paper", "snow", "clay"])
def test_a_typed_depth_costs_about_two_values_of_a_slider(ground, share):
    """The middle contacts are searched by the law; the others check once, and the last guess needs no more."""
    pressure = "CENTRE_OF_PRESSURE"
    contacts = predicted([walk(steps=8)], ground, pressure, cell=0.01)
    value = len(list(typical_depth.slices(contacts, ground, pressure)))
    modulus, slices = counted(matching_modulus.slices(contacts, ground, share * contacts.typical, pressure))
    assert slices < 2.1 * value
    reached = pressed_again(contacts, replace(ground, youngs_modulus=modulus), pressure).typical
    assert reached == pytest.approx(share * contacts.typical, rel=0.015)
    fresh = predicted([walk(steps=8)], ground, pressure, cell=0.01)
    assert typical_depth(fresh, ground, pressure) == typical_depth(contacts, ground, pressure) == contacts.typical


def test_a_depth_to_which_nothing_can_be_packed_is_refused_at_once(monkeypatch):
    material = replace(SNOW, exponent=2.0, densest=0.5)
    contacts = predicted([walk(steps=3)], material)
    monkeypatch.setattr(prediction, "MOST_TRIALS", 0)
    with pytest.raises(InputError, match=f"{50 * material.layer_depth:.3g} cm"):
        matching_modulus(contacts, material, 0.6 * material.layer_depth, "UNIFORM")


@pytest.mark.parametrize("painted", [False, True], ids=["even", "painted"])
@pytest.mark.parametrize("crust", [0.0, 2e3, 1e6])
def test_the_predicted_depth_of_a_ball_that_rests_is_the_pressed_one(crust, painted):
    loads = resting(prop_sole(*sphere(0.15, rings=32)), (0.3, 0.0, 0.15), 300.0, seconds=1.0)
    material, variation = replace(SNOW, crust_stress=crust), Stripes() if painted else None
    expected = pressed([loads], material, "UNIFORM", variation)
    assert (expected == 0) == (crust == 1e6)
    assert predicted([loads], material, variation=variation).depths.max() == pytest.approx(expected, rel=0.03)


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
    assert predicted([loads], SNOW, pressure).depths.max() == pytest.approx(expected, rel=0.03)


@pytest.mark.parametrize("hardening", [0.0, 4.0])
@pytest.mark.parametrize("speed", [1.0, 2.0])
def test_a_gait_on_the_spot_is_predicted_by_the_prints_into_which_its_tracks_are_cut(speed, hardening):
    loads, material = sliding(speed, walk(steps=4)), replace(SNOW, hardening=hardening)
    frames = loads.motion.frames
    skin = LowSkin(frames, np.zeros((len(frames), 1, 3)), np.zeros((len(frames), 1)), 0.3, 1.0)
    known = replace(loads, motion=replace(loads.motion, skin=skin))
    prints = prints_of([known], material, "UNIFORM")
    assert len(prints) > len(prints_of([loads], material, "UNIFORM"))
    contacts = predicted([known], material)
    assert contacts.typical == pytest.approx(typical_of(prints), rel=0.02)
    assert typical_depth(contacts, material, "UNIFORM") == pytest.approx(typical_of(prints), rel=0.02)


def test_the_typical_step_is_of_feet_whatever_else_prints():
    loads, ball = walk(steps=4), resting(prop_sole(*sphere(0.2)), (9.0, 9.0, 0.2), 5000.0)
    both = prints_of([loads, ball], SNOW, "UNIFORM", cell=0.01)
    assert typical_of(both) == typical_of(prints_of([loads], SNOW, "UNIFORM", cell=0.01))
    assert max(each.max_depth_m for each in both) > 2 * typical_of(both)
    contacts = predicted([loads, ball], cell=0.01)
    assert contacts.typical == pytest.approx(typical_of(both), rel=0.02)
    assert contacts.depths.max() > 2 * contacts.typical


@pytest.mark.parametrize("hardening", [0.0, 4.0])
def test_feet_that_come_down_on_their_own_prints_add_as_much_as_is_predicted(hardening):
    loads, material = walk(steps=8, speed=1e-3), replace(SNOW, hardening=hardening)
    first = pressed([walk(steps=1, speed=1e-3)], material, "UNIFORM")
    expected = pressed([loads], material, "UNIFORM")
    assert predicted([loads], material).depths.max() == pytest.approx(expected, rel=0.03)
    assert expected < 1.2 * first


@pytest.mark.parametrize("pressure", ["UNIFORM", "CENTRE_OF_PRESSURE"])
@pytest.mark.parametrize("speed", [0.004, 0.006, 0.008, 0.01])
def test_feet_that_come_down_a_little_beside_their_prints_are_predicted_by_what_they_add(speed, pressure):
    """Cells of about the size of a bake that the step before has covered in part take the rest of a print."""
    loads, cell = walk(steps=8, speed=speed), 0.005
    contacts = predicted([loads], SNOW, pressure, cell=cell)
    for material in (SNOW, replace(SNOW, youngs_modulus=0.15e6)):
        expected = typical_of(prints_of([loads], material, pressure, cell=cell))
        assert typical_depth(contacts, material, pressure) == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("pressure", ["UNIFORM", "CENTRE_OF_PRESSURE"])
def test_steps_on_the_edge_of_the_ground_are_predicted_like_those_beside_it(pressure):
    loads = walk()
    whole = predicted([loads], SNOW, pressure).depths.max()
    edge = float(loads.motion.soles[0].transforms[-1, 0, 0, 3]) / 2
    terrain = Slope(edge=edge)
    results = simulate([loads], SoftGround(terrain, SNOW, pressure), CELL)
    baked = max(footprint.max_depth_m for result in results for footprint in result.footprints)
    deepest = predicted([loads], SNOW, pressure, terrain).depths.max()
    assert deepest == pytest.approx(baked, rel=0.03)
    assert deepest <= whole * 1.001


def test_cells_of_a_hair_s_breadth_are_not_pressed():
    depths = [predicted([walk(steps=2)], cell=size).depths for size in (1e-3, 1e-6)]
    assert np.array_equal(*depths)
