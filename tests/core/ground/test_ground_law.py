"""The law by which ground gives way: its inverse, its limits, and what soles, bodies and masks make of it."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from scipy.integrate import quad

from softground_addon.core.checks.volumes import check_volumes
from softground_addon.core.composers.simulation import simulate
from softground_addon.core.ground.field_tests import (
    boot_depth,
    hardened,
    hardness_of,
    moistened,
    moisture_of,
    plates,
    snow,
    wetness_of,
    wetted,
)
from softground_addon.core.ground.ground_law import load_at, strain
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.presets import find
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.imprints.indentation import Springs, stress
from softground_addon.core.pressing.deformation import target_compression
from softground_addon.core.pressing.pressure import spread_out
from tests.core.prop_bodies import box, prop_sole
from tests.core.walkers import box_sole, loads_of, pose, pressed, standing, walk

CLAY = plates(13.2e3, 692e3, 0.5)
PAPER = GroundMaterial(0.25e6, 0.05, 0.2)
SETTLED = snow(2.16)
LAWS = pytest.mark.parametrize("material", [CLAY, PAPER, SETTLED], ids=["n = 0.5", "n = 1", "n = 2"])


class Painted:
    """Factors that are the same everywhere."""

    def __init__(self, stiffness=1.0, depth=1.0):
        self.values = np.array([stiffness, depth, 1.0])

    def factors(self, x, y):
        return np.multiply.outer(self.values, np.ones(np.broadcast(x, y).shape))


def depth_of(loads, material, variation=None, cell=0.01, gravity=9.81):
    ground = SoftGround(FlatTerrain(), material, variation=variation, gravity=gravity)
    (footprint,) = (footprint for result in simulate([loads], ground, cell) for footprint in result.footprints)
    return footprint.max_depth_m


@LAWS
@pytest.mark.parametrize("firm", [0.0, 0.05])
def test_stress_and_strain_are_inverse(material, firm):
    material = replace(material, firm_depth=firm)
    strains = np.linspace(0, 0.999, 50) * (material.densest or 1.0)
    assert strain(load_at(strains, material), material) == pytest.approx(strains, rel=1e-6, abs=1e-12)


def test_under_any_load_the_densest_packing_is_reached_and_not_passed():
    for densest in (1e-3, 0.5, 1.0):
        crushed = strain(np.array([1e6, 1e60]), replace(CLAY, exponent=0.2, densest=densest))
        assert crushed == pytest.approx(densest, rel=1e-9)


def test_with_the_new_fields_off_the_law_is_the_papers_bit_for_bit():
    pressures, factor = np.geomspace(1, 1e7, 200), np.linspace(0.3, 2, 200)
    paper = np.minimum(pressures / (PAPER.youngs_modulus * factor), 1.0) * (PAPER.layer_depth * factor)
    assert (target_compression(pressures, PAPER, stiffness=factor, depth=factor) == paper).all()


@pytest.mark.parametrize("width", [0.02, 0.09, 0.35])
@pytest.mark.parametrize("load", [20e3, 40e3, 200e3])
def test_plates_of_any_width_sink_as_bekker_says(width, load):
    loads = standing(box_sole(3 * width, width), [[0, 0, 0]], load * 3 * width**2, seconds=2.0)
    expected = (load / (13.2e3 / width + 692e3)) ** 2
    assert depth_of(loads, CLAY, cell=width / 10) == pytest.approx(min(expected, 0.3), rel=0.03)


def test_the_depth_of_a_plate_does_not_depend_on_the_layer():
    depths = [boot_depth(plates(13.2e3, 692e3, 0.5, layer)) for layer in (0.1, 0.3, 3.0)]
    assert depths == pytest.approx([depths[0]] * 3, rel=1e-12)


@pytest.mark.parametrize("hardness", np.linspace(1.12, 5, 12))
def test_hand_hardness_says_how_deep_a_boot_sinks(hardness):
    material = snow(hardness)
    boot = standing(box_sole(0.29, 0.10), [[0, 0, 0]], 33e3 * 0.029, seconds=2.0)
    assert depth_of(boot, material) == pytest.approx(boot_depth(material), rel=0.02)
    assert hardness_of(material) == pytest.approx(hardness, abs=0.01)


def test_a_thin_layer_of_powder_bears_where_it_can_be_packed_no_further():
    thin = snow(1.12, 0.1)
    assert 0.9 * thin.deepest < boot_depth(thin) < thin.deepest
    assert boot_depth(snow(1.12, 3.0)) == pytest.approx(0.5)


def test_a_ski_sinks_less_than_half_as_deep_as_a_boot():
    boot = standing(box_sole(0.29, 0.10), [[0, 0, 0]], 33e3 * 0.029, seconds=2.0)
    ski = standing(box_sole(1.6, 0.105), [[0, 0, 0]], 5.5e3 * 0.168, seconds=2.0)
    assert 1.8 < depth_of(boot, SETTLED) / depth_of(ski, SETTLED) < 3.3


@LAWS
@pytest.mark.parametrize(("stiffness", "depth"), [(0.4, 1.0), (3.0, 1.0), (1.0, 0.6)])
def test_masks_scale_stiffness_and_layer_whatever_the_exponent(material, stiffness, depth):
    loads = standing(box_sole(0.25, 0.08), [[0, 0, 0]], 600.0, seconds=2.0)
    scaled = replace(
        material, youngs_modulus=material.youngs_modulus * stiffness, layer_depth=material.layer_depth * depth
    )
    assert depth_of(loads, material, Painted(stiffness, depth)) == pytest.approx(depth_of(loads, scaled), rel=0.01)


@LAWS
def test_nothing_is_pressed_deeper_than_can_be_packed_and_rims_hold_what_was_displaced(material):
    material = replace(material, youngs_modulus=material.youngs_modulus / 50, rim_bias=0.5, repose_angle=0.5)
    _, footprints = pressed(walk(), material)
    check_volumes(footprints, SoftGround(FlatTerrain(), material))
    deepest = max(footprint.max_depth_m for footprint in footprints)
    assert 0.5 * material.deepest < deepest <= material.deepest


@LAWS
def test_depths_do_not_depend_on_frame_rate_or_cells(material):
    rolling = {
        (rate, cell): [
            footprint.max_depth_m
            for result in simulate(
                [walk(frame_rate=rate)], SoftGround(FlatTerrain(), material, "CENTRE_OF_PRESSURE"), cell
            )
            for footprint in result.footprints
        ]
        for rate, cell in ((120.0, 0.01), (24.0, 0.01), (120.0, 0.005))
    }
    reference = rolling[120.0, 0.01]
    assert rolling[24.0, 0.01] == pytest.approx(reference, rel=0.01)
    assert rolling[120.0, 0.005] == pytest.approx(reference, rel=0.02)


def test_more_weight_or_softer_ground_presses_deeper_everywhere():
    loads = np.geomspace(1e3, 1e6, 40)
    for material in (CLAY, PAPER, SETTLED):
        depths = target_compression(loads, material)
        assert (np.diff(depths) >= 0).all()
        assert (
            target_compression(loads, replace(material, youngs_modulus=material.youngs_modulus / 2)) >= depths
        ).all()


@LAWS
@pytest.mark.parametrize("near", [0.0, 1e-4, 0.2])
def test_a_sphere_sinks_until_the_bed_of_springs_carries_it(material, near):
    radius = 0.2
    area = np.full(40_000, pi * radius**2 / 40_000)
    clearance = radius - np.sqrt(radius**2 - (np.arange(40_000) + 0.5) * area[0] / pi)
    springs = Springs(clearance, area)
    for force in (20.0, 300.0):
        sinkage = springs.sinkage(force, material, near=near)
        carried = springs.area @ stress(springs.compression(sinkage, material), material)
        assert carried == pytest.approx(force, rel=1e-7)
        whole, _ = quad(
            lambda c, sinkage=sinkage: float(stress(np.array(sinkage - c), material)) * 2 * pi * (radius - c),
            0,
            sinkage,
        )
        assert whole == pytest.approx(force, rel=1e-3)


def test_a_crate_sinks_as_deep_as_a_sole_of_its_shape():
    size, load = (0.3, 0.1, 0.1), 900.0
    crate = prop_sole(*box(*size))
    poses = np.broadcast_to(pose(np.array([0.0, 0.0, 0.05])), (240, 1, 4, 4))
    body = loads_of([crate], [poses], np.full((240, 1), load), np.ones((240, 1), bool), 120.0)
    sole = standing(box_sole(0.3, 0.1), [[0, 0, 0]], load, seconds=2.0)
    assert depth_of(body, SETTLED) == pytest.approx(depth_of(sole, SETTLED), rel=0.01)


def test_a_load_that_widens_on_its_way_down_keeps_its_force():
    relative = np.linspace(0.2, 1.8, 60, dtype=np.float32).reshape(1, 6, 10)
    even = relative.copy()
    spread_out(even, np.array([0.25]))
    assert even.mean() == pytest.approx(1.0, rel=1e-6)
    assert even - 1 == pytest.approx((relative - 1) / 1.5, abs=1e-6)


def test_loose_sand_goes_with_gravity_and_regolith_does_not():
    sand, regolith = replace(CLAY, cohesionless=1.0), CLAY
    boot = box_sole(0.29, 0.10)
    on_earth = depth_of(standing(boot, [[0, 0, 0]], 800.0, seconds=2.0), sand)
    on_the_moon = standing(boot, [[0, 0, 0]], 800.0 * 1.62 / 9.81, seconds=2.0)
    assert depth_of(on_the_moon, sand, gravity=1.62) == pytest.approx(on_earth, rel=1e-6)
    assert depth_of(on_the_moon, regolith, gravity=1.62) < 0.1 * on_earth


def test_hand_hardness_leaves_rim_and_settling_time():
    wet = replace(snow(2.83), poisson_ratio=0.1, characteristic_time=0.15)
    harder = hardened(wet, 3.5)
    assert (harder.poisson_ratio, harder.characteristic_time) == (0.1, 0.15)
    assert harder.deepest == snow(3.5).deepest
    assert boot_depth(harder) == pytest.approx(0.10)


@pytest.mark.parametrize("name", ["firm_loam", "soil", "stiff_mud", "liquid_mud"])
def test_soil_is_the_deeper_the_wetter_and_stays_what_it_is_otherwise(name):
    soil = find(name).material
    moisture = np.linspace(0, 1, 11)
    wetter = [wetted(soil, share) for share in moisture]
    assert [wetness_of(each) for each in wetter] == pytest.approx(moisture, abs=1e-6)
    assert (np.diff([boot_depth(each) for each in wetter]) > 0).all()
    assert all(replace(each, youngs_modulus=soil.youngs_modulus) == soil for each in wetter)


def test_soil_that_is_a_thin_layer_is_wetted_until_it_gives_way_no_further():
    thin = replace(find("loose_soil").material, layer_depth=0.05)
    assert boot_depth(wetted(thin, 1.0)) == pytest.approx(0.97 * thin.deepest)


@pytest.mark.parametrize("layer", [0.1, 0.3])
def test_sand_is_deep_dry_and_soaked_and_firm_between(layer):
    dune = replace(plates(0.99e3, 1528e3, 1.1, layer), cohesionless=1.0)
    assert moisture_of(dune) == 0.0
    moisture = np.linspace(0, 1, 11)
    sand = [moistened(dune, share) for share in moisture]
    assert [moisture_of(each) for each in sand] == pytest.approx(moisture, abs=0.011)
    depth = np.array([boot_depth(each) for each in sand])
    assert depth[0] == pytest.approx(boot_depth(dune), rel=0.02)
    assert (np.diff(depth[:7]) < 0).all()
    assert (np.diff(depth[6:]) > 0).all()
    assert [each.cohesionless for each in (sand[0], sand[3], sand[10])] == [1.0, 0.0, 0.0]
