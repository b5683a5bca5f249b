"""Pressure under a sole whose force acts off the middle, against beam theory and conservation."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softground_addon.core.contacts import runs
from softground_addon.core.deformation import GroundMaterial, equilibrium_depth
from softground_addon.core.heightfield import FlatTerrain
from softground_addon.core.pressure import pressure_slope
from softground_addon.core.simulation import simulate
from tests.core.walkers import box_sole, foot_sole, standing, walk

SNOW = GroundMaterial(0.25e6, 0.05, 0.2)
LENGTH, WIDTH = 0.24, 0.08


def strip(shift, *, spacing=0.002, cell=0.002):
    """Pressure over the cells of a rectangle whose force acts `shift` (x, y) from its middle at (3, -2)."""
    x, y = (np.arange(-extent / 2 + spacing / 2, extent / 2, spacing) for extent in (LENGTH, WIDTH))
    place = [values.ravel()[None] for values in np.meshgrid(x + 3.0, y - 2.0)]
    area = np.full_like(place[0], spacing**2)
    slope = pressure_slope(*place, area, np.array([[3.0 + shift[0], -2.0 + shift[1]]]), 1e-6)
    columns, rows = (np.arange(-extent / 2 + cell / 2, extent / 2, cell) for extent in (LENGTH, WIDTH))
    coverage = np.ones((1, len(rows), len(columns)), np.float32)
    return columns, rows, slope.over(columns + 3.0, rows - 2.0, coverage)[0]


def test_a_force_in_the_middle_presses_evenly():
    assert strip((0.0, 0.0))[2] == pytest.approx(1.0, abs=1e-5)


def test_within_the_kern_the_pressure_is_that_of_a_beam_under_an_eccentric_force():
    # N/A·(1 + 12·e·x/L²): at the edge of the kern, e = L/6, it falls to 0 at one end and doubles at the other.
    x, _, pressure = strip((LENGTH / 6, 0.0))
    assert pressure[5] == pytest.approx(1 + 2 * x / LENGTH, abs=1e-3)


@given(st.floats(-1, 1), st.floats(-1, 1))
def test_within_the_kern_the_force_acts_where_it_should(u, v):
    shift = np.array([u * LENGTH, v * WIDTH]) / 6 / max(1.0, abs(u) + abs(v))
    x, y, pressure = strip(shift)
    acts_at = [(pressure.sum(axis=0) @ x), (pressure.sum(axis=1) @ y)] / pressure.sum()
    assert acts_at == pytest.approx(shift, abs=1e-4)
    assert pressure.mean() == pytest.approx(1.0, rel=1e-5)


@given(st.floats(-3, 3), st.floats(-3, 3))
def test_nothing_pulls_and_the_force_is_kept_however_far_out_it_acts(u, v):
    _, _, pressure = strip((u * LENGTH, v * WIDTH))
    assert pressure.min() >= 0
    assert pressure.max() < 2.5
    assert pressure.mean() == pytest.approx(1.0, rel=1e-5)


@pytest.mark.parametrize("shift", [np.nan, np.inf])
def test_an_unknown_centre_of_pressure_presses_evenly(shift):
    assert strip((shift, 0.0))[2] == pytest.approx(1.0, abs=1e-6)


def test_a_contact_on_a_line_or_on_nothing_stays_finite():
    x = np.linspace(0, 0.1, 20)[None]
    for area in (np.full((1, 20), 1e-4), np.zeros((1, 20))):
        slope = pressure_slope(x, 0 * x, area, np.array([[0.08, 0.3]]), 0.01)
        pressure = slope.over(x[0], np.array([-0.01, 0.0, 0.01]), np.ones((1, 3, 20), np.float32))
        assert np.isfinite(pressure).all()
        assert pressure.mean() == pytest.approx(1.0, rel=1e-5)


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
    for result in simulate([loads], FlatTerrain(), material, cell, pressure="CENTRE_OF_PRESSURE"):
        footprints += result.footprints
    return result.ground, footprints


@settings(max_examples=10, deadline=None)
@given(st.floats(-0.9, 0.9), st.floats(0, 6.3), st.sampled_from([0.005, 0.01, 0.02]))
def test_the_mean_depth_under_a_standing_foot_is_that_of_its_weight_per_area(shift, heading, cell):
    sole = box_sole(0.25, 0.09)
    loads = standing(sole, [[0.013, 0.1, 0.0]], 500.0, heading=heading)
    toward = np.array([np.cos(heading), np.sin(heading), 0.0])
    loads.forces.centre_of_pressure[:] = [0.013, 0.1, 0.0] + shift * 0.25 / 6 * toward
    ground, (footprint,) = pressed(loads, cell)
    expected = equilibrium_depth(500.0, 0.25 * 0.09, SNOW)
    assert footprint.compressed_m3 == pytest.approx(expected * 0.25 * 0.09, rel=0.01)
    along = np.linspace(-0.08, 0.08, 9)
    depth = ground.sample(0.013 + along * toward[0], 0.1 + along * toward[1])[0]
    assert depth == pytest.approx(expected * (1 + shift * 2 * along / 0.25), rel=0.03)


def test_a_push_off_leaves_a_deeper_toe_than_an_even_pressure():
    ground, _ = pressed(rolling(walk(steps=1)))
    middle, toes = ground.sample(np.array([0.13, 0.24]), np.full(2, 0.09))[0]
    assert toes > 1.4 * middle
    even = list(simulate([rolling(walk(steps=1))], FlatTerrain(), SNOW, 0.01))[-1].ground
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


def test_without_load_no_bit_changes():
    loads = rolling(standing(foot_sole("foot", "L"), [[0, 0, 0]], 0.0))
    ground, footprints = pressed(loads)
    assert not ground.tiles
    assert not footprints
