"""Pressure under a sole whose force acts off the middle, against beam theory and conservation."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.optimize
from hypothesis import example, given, settings
from hypothesis import strategies as st

from softground_addon.core.composers.prediction import matching_modulus, pressed_contacts
from softground_addon.core.composers.simulation import simulate
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.numerics.intervals import runs
from softground_addon.core.pressing.pressure import KERN, pressure_field
from softground_addon.core.record.typical_depth import typical_of
from tests.core.walkers import box_sole, equilibrium_depth, foot_sole, standing, walk

SNOW = GroundMaterial(0.25e6, 0.05, 0.2)
LENGTH, WIDTH = 0.24, 0.08


def points_of(shape, spacing=0.004):
    """Points of a contact about (3, -2) and the area of each."""
    x, y = np.meshgrid(np.arange(-0.15, 0.15, spacing), np.arange(-0.15, 0.15, spacing))
    inside = {
        "rectangle": (np.abs(x) < LENGTH / 2) & (np.abs(y) < WIDTH / 2),
        "ellipse": (x / LENGTH * 2) ** 2 + (y / WIDTH * 2) ** 2 < 1,
        "triangle": (np.abs(y) < (0.1 - x) / 3) & (x > -0.1),
        "foot": np.abs(y) < np.interp(x, [-0.13, -0.1, -0.03, 0.06, 0.13], [0.02, 0.033, 0.03, 0.046, 0.015]),
    }[shape]
    x, y = x[inside] + 3.0, y[inside] - 2.0
    return x[None], y[None], np.full((1, len(x)), spacing**2)


def in_the_kern(x, y, u, v, most=1.0):
    """A place that is `most` of the way to the edge of the kern at most, in the direction (u, v)."""
    middle = np.array([x.mean(), y.mean()])
    spread = np.cov(np.concatenate([x, y]), bias=True)
    direction = np.array([u, v]) / np.hypot(u, v) if u or v else np.array([1.0, 0.0])
    deviations = np.sqrt(direction @ np.linalg.solve(spread, direction))
    return middle + most * np.hypot(u, v) / np.sqrt(2) * KERN / deviations * direction


def test_a_force_in_the_middle_presses_evenly():
    x, y, area = points_of("rectangle")
    field = pressure_field(x, y, area, np.array([[x.mean(), y.mean()]]), 1e-6)
    assert field.at(x, y) == pytest.approx(1.0, abs=1e-3)


def test_a_force_off_the_middle_presses_like_a_beam_up_to_a_third_at_the_highest_pressure():
    """N/A·(1 + c·x) up to 1 + 0.6·6·e/L over a third of the length: worked out by hand from force and moment."""
    x, y, area = points_of("rectangle", 0.001)
    shift = LENGTH / 12
    field = pressure_field(x, y, area, np.array([[x.mean() + shift, y.mean()]]), 1e-6)
    pressure = field.at(x, y)[0]
    rise = 0.6 * 6 * shift / LENGTH
    assert pressure.max() == pytest.approx(1 + rise, abs=5e-3)
    assert (pressure > pressure.max() - 1e-6).mean() == pytest.approx(1 / 3, abs=0.05)
    assert pressure[np.abs(x[0] - 3.0 + LENGTH / 2) < 0.002] == pytest.approx(1 - 2 * rise, abs=0.06)


@settings(max_examples=25)
@example("rectangle", 0.0, 0.00195)  # hardly off the middle
@example("foot", -0.03125, 0.0)  # less than the points that the fit begins on are
@given(st.sampled_from(["rectangle", "ellipse", "triangle", "foot"]), st.floats(-1, 1), st.floats(-1, 1))
def test_within_the_kern_the_force_acts_where_it_should_and_is_kept(shape, u, v):
    x, y, area = points_of(shape)
    wanted = in_the_kern(x, y, u, v, 0.98)
    pressure = pressure_field(x, y, area, wanted[None], 1e-6).at(x, y)
    assert pressure.min() >= 0
    assert pressure.max() <= 1.6 * 1.01
    assert pressure.mean() == pytest.approx(1.0, abs=1e-6)
    assert [(pressure * x).mean(), (pressure * y).mean()] == pytest.approx(wanted, abs=1e-4)


@settings(max_examples=10)
@given(st.sampled_from(["rectangle", "triangle", "foot"]), st.floats(-1, 1), st.floats(-1, 1))
def test_no_pressure_within_the_limits_is_more_even(shape, u, v):
    """The same least squares solved by scipy."""
    x, y, area = points_of(shape, 0.02)
    wanted = in_the_kern(x, y, u, v, 0.9)
    field = pressure_field(x, y, area, wanted[None], 1e-6)
    pressure = field.at(x, y)[0]
    rows = np.stack([np.ones(x.shape[1]), (x[0] - 3.0) / LENGTH, (y[0] + 2.0) / LENGTH])
    rows = rows / x.shape[1]
    right = np.array([1.0, (wanted[0] - 3.0) / LENGTH, (wanted[1] + 2.0) / LENGTH])
    best = scipy.optimize.minimize(
        lambda p: ((p - 1) ** 2).sum(),
        np.ones(x.shape[1]),
        jac=lambda p: 2 * (p - 1),
        bounds=[(0, field.highest[0])] * x.shape[1],
        constraints={"type": "eq", "fun": lambda p: rows @ p - right, "jac": lambda _: rows},
        method="SLSQP",
        options={"maxiter": 100, "ftol": 1e-10},
    )
    if best.success:
        assert pressure == pytest.approx(best.x, abs=5e-3)


@given(st.floats(-3, 3), st.floats(-3, 3))
def test_nothing_pulls_and_the_force_is_kept_however_far_out_it_acts(u, v):
    x, y, area = points_of("rectangle", 0.008)
    pressure = pressure_field(x, y, area, np.array([[3.0 + u * LENGTH, -2.0 + v * WIDTH]]), 1e-6).at(x, y)
    assert pressure.min() >= 0
    assert pressure.max() < 1.6 * 1.01
    assert pressure.mean() == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize("shift", [np.nan, np.inf])
def test_an_unknown_centre_of_pressure_presses_evenly(shift):
    x, y, area = points_of("rectangle")
    assert pressure_field(x, y, area, np.array([[shift, 0.0]]), 1e-6).at(x, y) == pytest.approx(1.0, abs=1e-6)


def test_a_contact_on_a_line_or_on_nothing_stays_finite():
    x = np.linspace(0, 0.1, 20)[None]
    for area in (np.full((1, 20), 1e-4), np.zeros((1, 20))):
        field = pressure_field(x, 0 * x, area, np.array([[0.08, 0.3]]), 0.01)
        assert np.isfinite(field.over(x[0], np.array([-0.01, 0.0, 0.01]))).all()
        assert field.at(x, 0 * x).mean() == pytest.approx(1.0, rel=2e-3)


@settings(max_examples=100)
@given(st.integers(0, 2**32 - 1))
@example(3944644)  # pressure that rises to its limit from one point to the next
@pytest.mark.filterwarnings("error")
def test_contacts_of_any_shape_keep_the_force(seed):
    """Scattered points, some of them near a line, that touch on one side of a slanting edge."""
    random = np.random.default_rng(seed)
    x, y = random.uniform(-0.15, 0.15, (2, 1, random.integers(2, 900)))
    y, x = np.tile(y * random.uniform(0.001, 1), (8, 1)), np.tile(x, (8, 1))
    angle, edge = random.uniform(0, 2 * np.pi, (8, 1)), random.uniform(-0.2, 0.2, (8, 1))
    inside = (x * np.cos(angle) + y * np.sin(angle) - edge) / random.uniform(0.001, 0.05) + 0.5
    area = 1e-4 * np.clip(inside, 0, 1)
    pressure = pressure_field(x, y, area, random.uniform(-0.3, 0.3, (8, 2)), 0.005).at(x, y)
    force = (pressure * area).sum(axis=1)
    assert force == pytest.approx(area.sum(axis=1), rel=1e-5)
    assert pressure.min() >= 0
    assert pressure.max() < 2.5


def test_cells_have_the_pressure_of_the_points_in_them():
    x, y, area = points_of("foot")
    field = pressure_field(x, y, area, np.array([[3.03, -2.004]]), 1e-6)
    cells = field.over(x[0], y[0])[0]
    assert np.diagonal(cells) == pytest.approx(field.at(x, y)[0], abs=1e-5)


def acting_at(loads, place):
    """Loads whose centres of pressure are `place(sole, heel, toes, progress)` of each contact's flat foot."""
    centres = loads.forces.centre_of_pressure.copy()
    for number, sole in enumerate(loads.motion.soles):
        landmarks = sole.landmark_positions()
        for first, end in zip(*runs(loads.contacts.touching[:, number]), strict=True):
            flat = landmarks[(first + end) // 2]
            progress = np.linspace(0, 1, end - first)[:, None]
            centres[first:end, number] = place(flat[0], flat[-1], progress)
    return replace(loads, forces=replace(loads.forces, centre_of_pressure=centres))


def rolling(loads):
    """From a tenth of the foot at heel strike to the toes at push-off, as measured under walking feet."""
    course = ([0, 0.15, 0.4, 0.6, 0.85, 1], [0.12, 0.2, 0.4, 0.55, 0.75, 0.9])
    return acting_at(loads, lambda heel, toes, progress: heel + (toes - heel) * np.interp(progress, *course))


def pressed(loads, cell=0.01, material=SNOW):
    footprints = []
    for result in simulate([loads], SoftGround(FlatTerrain(), material, pressure="CENTRE_OF_PRESSURE"), cell):
        footprints += result.footprints
    return result.ground, footprints


@settings(max_examples=10)
@given(st.floats(-0.9, 0.9), st.floats(0, 6.3), st.sampled_from([0.005, 0.01, 0.02]))
def test_the_mean_depth_under_a_standing_foot_is_that_of_its_weight_per_area(shift, heading, cell):
    sole = box_sole(0.25, 0.09)
    loads = standing(sole, [[0.013, 0.1, 0.0]], 500.0, heading=heading)
    toward = np.array([np.cos(heading), np.sin(heading), 0.0])
    loads.forces.centre_of_pressure[:] = [0.013, 0.1, 0.0] + shift * 0.25 / 6 * toward
    _, (footprint,) = pressed(loads, cell)
    expected = equilibrium_depth(500.0, 0.25 * 0.09, SNOW)
    assert footprint.compressed_m3 == pytest.approx(expected * 0.25 * 0.09, rel=0.01)
    deepest = expected * (1 + 0.6 * abs(shift))
    assert footprint.max_depth_m == pytest.approx(deepest, rel=0.01)


def test_a_push_off_leaves_a_deeper_toe_than_an_even_pressure():
    ground, _ = pressed(rolling(walk(steps=1)))
    middle, toes = ground.sample(np.array([0.13, 0.24]), np.full(2, 0.09))[0]
    assert toes > 1.3 * middle
    even = list(simulate([rolling(walk(steps=1))], SoftGround(FlatTerrain(), SNOW), 0.01))[-1].ground
    middle, toes = even.sample(np.array([0.13, 0.24]), np.full(2, 0.09))[0]
    assert toes == pytest.approx(middle, rel=0.05)


def test_the_print_of_a_rolling_foot_does_not_depend_on_cell_size_frame_rate_or_heading():
    reference = pressed(rolling(walk(steps=2)))[0].volumes()[0]
    for cell in (0.005, 0.02, 0.04):
        assert pressed(rolling(walk(steps=2)), cell)[0].volumes()[0] == pytest.approx(reference, rel=0.01)
    for rate in (24.0, 60.0, 120.0):
        assert pressed(rolling(walk(steps=2, frame_rate=rate)))[0].volumes()[0] == pytest.approx(reference, rel=0.01)
    for heading in (0.35, 3.0):
        assert pressed(rolling(walk(steps=2, heading=heading)))[0].volumes()[0] == pytest.approx(reference, rel=0.01)


@pytest.mark.parametrize("material", [SNOW, GroundMaterial(1.2e6, 0.35, 0.05), GroundMaterial(0.6e6, 0.35, 0.15)])
def test_the_deepest_point_does_not_depend_on_cell_size_or_place(material):
    reference = max(footprint.max_depth_m for footprint in pressed(rolling(walk(steps=2)), 0.005, material)[1])
    for cell, heading, origin in ((0.0025, 0.0, 0.0), (0.01, 0.3, 0.003), (0.02, 0.0, 0.0), (0.02, 2.2, 0.007)):
        loads = rolling(walk(steps=2, heading=heading, origin=(origin, 2 * origin, 0.0)))
        deepest = max(footprint.max_depth_m for footprint in pressed(loads, cell, material)[1])
        assert deepest == pytest.approx(reference, rel=0.02)


@pytest.mark.parametrize("material", [SNOW, GroundMaterial(1.2e6, 0.35, 0.05)])
def test_the_depth_predicted_on_coarse_cells_is_that_of_the_print(material):
    loads = rolling(walk(steps=2, heading=0.4))
    contacts = pressed_contacts([loads], SoftGround(FlatTerrain(), material, "CENTRE_OF_PRESSURE"), 0.004)
    reached = typical_of(pressed(loads, 0.004, material)[1])
    assert contacts.typical == pytest.approx(reached, rel=0.02)
    stiffer = replace(material, youngs_modulus=2 * material.youngs_modulus)
    modulus = matching_modulus(contacts, stiffer, reached, "CENTRE_OF_PRESSURE")
    assert modulus == pytest.approx(material.youngs_modulus, rel=0.03)


def test_without_load_no_bit_changes():
    loads = rolling(standing(foot_sole("foot", "L"), [[0, 0, 0]], 0.0))
    ground, footprints = pressed(loads)
    assert not ground.tiles
    assert not footprints


@pytest.mark.parametrize("start", [-0.15, -0.06, -0.02, 0.02, 0.06])
def test_what_is_left_of_a_foot_bears_the_force_wherever_it_acts(start):
    x, y, area = points_of("foot")
    area = area * (x > 3.0 + start)
    touching = area[0] > 0
    middle = np.array([x[0, touching].mean(), y[0, touching].mean()])
    centre = middle + np.array([(u, v) for u in np.linspace(-0.08, 0.08, 41) for v in (0.0, 0.004)])
    count = len(centre)
    repeated = [np.repeat(values, count, axis=0) for values in (x, y, area)]
    field = pressure_field(*repeated, centre, 1e-6)
    pressure = field.at(*repeated[:2])
    share = repeated[2] / repeated[2].sum(axis=1, keepdims=True)
    assert (pressure * share).sum(axis=1) == pytest.approx(np.ones(count), abs=1e-3)
    # Toward the middle the force acts where it was asked to; beyond the kern as far out as it may.
    reached = np.stack([(pressure * share * places).sum(axis=1) for places in repeated[:2]], axis=-1) - middle
    asked = centre - middle
    near = np.abs(asked[:, 0]) < 0.3 * x[0, touching].std()
    assert reached[near] == pytest.approx(asked[near], abs=5e-4)
    assert (np.diff(reached[::2, 0]) > -5e-4).all()
