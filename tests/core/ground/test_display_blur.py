"""The display blur against scipy's Gaussian filter."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from softground_addon.core.ground.display_blur import blurred, blurred_window
from softground_addon.core.ground.heightfield import HeightField
from softground_addon.core.ground.sparse_grid import Window

CELL = 0.01


def rough_field(window, seed=0):
    field = HeightField(CELL)
    field.write(window, np.random.default_rng(seed).random((2, window.rows, window.columns)))
    return field


@settings(max_examples=30)
@given(
    st.integers(-40, 40),
    st.integers(-40, 40),
    st.integers(1, 60),
    st.integers(1, 60),
    st.floats(0.0, 0.1),
    st.integers(0, 99),
)
def test_the_blur_is_scipys_gaussian_wherever_the_tiles_lie(column, row, columns, rows, sigma, seed):
    window = Window(column, row, columns, rows)
    field = rough_field(window, seed)
    wide = window.expanded(60)
    expected = [
        ndimage.gaussian_filter(channel, sigma / CELL, mode="constant") if sigma >= CELL / 8 else channel
        for channel in field.read(wide)
    ]
    assert np.abs(blurred(field, sigma).read(wide) - expected).max() < 1e-12


@pytest.mark.parametrize("sigma", [0.0, 0.005, 0.01, 0.05, 0.4])
def test_the_blur_keeps_both_volumes(sigma):
    field = rough_field(Window(-7, 25, 70, 33))
    assert blurred(field, sigma).volumes() == pytest.approx(field.volumes(), rel=1e-12)


@pytest.mark.parametrize("sigma", [0.0, 0.0005])
def test_a_blur_far_below_a_cell_changes_no_bit(sigma):
    window = Window(-7, 25, 70, 33)
    field = rough_field(window)
    assert np.array_equal(blurred(field, sigma).read(window), field.read(window))


def test_a_window_is_blurred_as_the_whole_field_is():
    field = rough_field(Window(-7, 25, 70, 33))
    part = Window(3, 30, 17, 50)
    assert blurred_window(field, part, 0.02) == pytest.approx(blurred(field, 0.02).read(part), abs=1e-14)


def test_the_raw_field_is_left_alone():
    window = Window(0, 0, 40, 40)
    field = rough_field(window)
    before = field.read(window)
    blurred(field, 0.02)
    assert np.array_equal(field.read(window), before)


def test_a_spike_spreads_by_the_standard_deviation_in_metres_at_any_cell_size():
    for cell in (0.002, 0.005, 0.01):
        field = HeightField(cell)
        field.write(Window(0, 0, 1, 1), np.ones((2, 1, 1)))
        wide = Window(-60, -60, 121, 121)
        spread = blurred(field, 0.015).read(wide)[0]
        x, _ = np.meshgrid(*wide.centres(cell))
        assert np.sqrt((spread * (x - cell / 2) ** 2).sum()) == pytest.approx(0.015, rel=0.01)
