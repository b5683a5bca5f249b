"""Compression and rim of single steps, against numbers worked out by hand and independent implementations."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import ndimage

from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.imprints.sole_points import touching_fraction
from softground_addon.core.pressing.deformation import (
    compress,
    compression_rate,
    sink,
    target_compression,
)
from softground_addon.core.pressing.rim import dilate, displaced_volume, in_contact, rim_weights
from tests.core.walkers import equilibrium_depth

SNOW = GroundMaterial(youngs_modulus=0.25e6, poisson_ratio=0.05, characteristic_time=0.2)
coverages = arrays(
    float, st.tuples(st.integers(1, 4), st.integers(1, 12), st.integers(1, 12)), elements=st.floats(0, 1)
)


def test_the_static_character_sinks_as_deep_as_its_weight_per_area_says():
    # 77.5 kg · 9.81 m/s² = 760.275 N on 347 cm²: 21.910 kPa; of 250 kPa, 8.764 %; of 30 cm, 2.629 cm.
    assert equilibrium_depth(760.275, 0.0347, SNOW) == pytest.approx(0.026292, rel=1e-4)


def test_correction_2_a_stress_beyond_the_modulus_presses_the_layer_flat_instead_of_leaving_no_print():
    assert target_compression(np.array([0.25e6, 0.5e6, 1e9]), SNOW) == pytest.approx([0.3, 0.3, 0.3])


def test_correction_2_the_last_step_does_not_overshoot():
    # 30 fps, tau = 0.1 s: a step is a third of the target, so that three steps reach it and a fourth may add nothing.
    # As printed, the rule goes on while the compression is below the target and rounding leaves it a hair below: +33 %.
    mud = GroundMaterial(0.5e6, 0.35, 0.1)
    rate = compression_rate(1 / 30, mud)
    assert rate == pytest.approx(1 / 3)
    depth = np.zeros(1)
    course = []
    for _ in range(5):
        depth = compress(depth, np.ones(1), 0.03, rate)
        course.append(float(depth[0]))
    assert course == pytest.approx([0.01, 0.02, 0.03, 0.03, 0.03], abs=1e-12)
    # From halfway between, the last step is cut.
    assert compress(np.array([0.025]), np.ones(1), 0.03, rate) == pytest.approx([0.03])


def test_correction_3_the_displaced_volume_is_twice_poissons_ratio_of_the_compressed():
    # 200 cm² pressed by 3 cm: 600 cm³; of them 0 rise at nu = 0, 420 at 0.35 and all at 0.5.
    volumes = [float(displaced_volume(600e-6, GroundMaterial(1e6, nu, 0.1))) for nu in (0.0, 0.35, 0.5)]
    assert volumes == pytest.approx([0.0, 420e-6, 600e-6])


def test_correction_4_soles_of_ten_square_centimetres_would_press_a_character_through_the_layer():
    # 760.275 N on 10 cm²: 0.760 MPa. A layer of 30 cm at 0.25 MPa would have to give way by 91 cm; one ten times as
    # deep and stiff does.
    assert equilibrium_depth(760.275, 10e-4, GroundMaterial(2.5e6, 0.05, 0.2, layer_depth=3.0)) == pytest.approx(
        0.9123, abs=1e-4
    )
    assert equilibrium_depth(760.275, 10e-4, SNOW) == 0.3


@given(
    arrays(float, 20, elements=st.floats(0, 0.3)),
    arrays(float, 20, elements=st.floats(0, 1)),
    st.floats(0, 0.3),
    st.floats(0.001, 3),
)
def test_compression_only_grows_never_passes_its_target_and_never_by_more_than_its_rate(before, coverage, target, rate):
    after = compress(before, coverage, target, rate)
    assert (after >= before).all()
    assert (after <= np.maximum(before, coverage * target)).all()
    assert (after - before <= rate * coverage * target + 1e-15).all()


def test_a_cell_that_is_half_covered_is_pressed_half_as_far_on_average():
    assert compress(np.zeros(2), np.array([1.0, 0.5]), 0.02, rate=0.25) == pytest.approx([0.005, 0.0025])


@given(coverages, st.floats(0, 5))
def test_dilation_reaches_every_cell_within_its_reach_and_no_other(coverage, reach):
    mask = coverage > 0.6
    radius = max(reach + 1e-6, 1.0)
    y, x = np.mgrid[-6:7, -6:7]
    disc = x**2 + y**2 <= radius**2
    expected = np.array([ndimage.binary_dilation(each, disc) for each in mask])
    assert np.array_equal(dilate(mask, reach), expected)


@given(coverages, st.floats(0, 5))
def test_the_shares_of_the_rim_sum_to_one_and_fall_outside_the_contact(coverage, reach):
    weights = rim_weights(coverage, in_contact(coverage), reach)
    assert (weights >= 0).all()
    for share, contact in zip(weights, coverage, strict=True):
        free = (contact < 1) & (contact > 0)
        if share.any():
            assert share.sum() == pytest.approx(1.0)
            assert not share[contact == 1].any()
        else:
            assert not contact.any() or not free.any() or contact[free].min() > 0


def test_the_rim_is_uniform_over_free_cells_within_reach():
    contact = np.zeros((1, 21, 21))
    contact[0, 9:12, 9:12] = 1.0
    weights = rim_weights(contact, in_contact(contact), 4.0)[0]
    distance = ndimage.distance_transform_edt(contact[0] == 0)
    ring = (distance > 0) & (distance <= 4.0)
    assert weights[ring] == pytest.approx(1 / ring.sum())
    assert not weights[~ring].any()


def test_no_rim_rises_where_there_is_no_ground():
    contact = np.zeros((2, 9, 9))
    contact[:, 4, 4] = 1.0
    room = np.zeros((9, 9), bool)
    room[:, :4] = True
    weights = rim_weights(contact, in_contact(contact), 2.0, room)
    assert weights.sum(axis=(1, 2)) == pytest.approx(1.0)
    assert not weights[:, :, 4:].any()
    assert not rim_weights(contact, in_contact(contact), 2.0, np.zeros((9, 9), bool)).any()


def test_touching_fades_over_one_tolerance_in_the_middle_of_which_it_is_half():
    heights = np.array([0.0, 0.005, 0.010, 0.015, 0.1])
    assert touching_fraction(heights, 0.0, 0.01) == pytest.approx([1, 1, 0.5, 0, 0])
    assert touching_fraction(heights + 0.02, 0.02, 0.01) == pytest.approx([1, 1, 0.5, 0, 0])


def test_a_flat_sole_sinks_in_a_straight_line_until_the_ground_carries_it():
    # 500 N on 200 cm²: 25 kPa, 3 cm in snow; at 100 steps a second and tau = 0.2 s, 1.5 mm a step.
    count = 30
    sinking = sink(
        np.zeros((count, 4)),
        np.full((count, 4), 50e-4),
        np.full(count, 500.0),
        tolerance=0.01,
        step=0.01,
        material=SNOW,
    )
    assert sinking.area == pytest.approx(0.02)
    assert sinking.target == pytest.approx(0.03)
    assert sinking.sinkage == pytest.approx(np.minimum(np.arange(count) * 0.0015, 0.03))
    assert sinking.reached == pytest.approx(0.03)


def test_the_area_of_a_rounded_sole_grows_as_it_sinks_and_its_target_falls():
    heights = np.linspace(0, 0.1, 400)
    count = 40
    sinking = sink(
        np.tile(heights, (count, 1)),
        np.full((count, 400), 1e-4),
        np.full(count, 300.0),
        tolerance=0.005,
        step=0.01,
        material=SNOW,
    )
    assert (np.diff(sinking.area) >= 0).all()
    assert sinking.area[-1] > 3 * sinking.area[0]
    assert (np.diff(sinking.target) <= 0).all()
    assert sinking.reached <= sinking.target[0]


def test_without_force_or_without_contact_nothing_sinks():
    for force, area in ((0.0, 1e-2), (100.0, 0.0)):
        sinking = sink(
            np.zeros((5, 1)), np.full((5, 1), area), np.full(5, force), tolerance=0.01, step=0.01, material=SNOW
        )
        assert sinking.reached == 0
        assert not sinking.target.any()
