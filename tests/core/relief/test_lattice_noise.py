"""Noise of place: its moments in closed form, no steps, and the same bytes everywhere."""

import numpy as np
import pytest

from softground_addon.core.relief.lattice_noise import DEVIATION, cells, fractal, hashed, noise

SIZE = 0.02


def field(side=600, spacing=0.005):
    x, y = np.meshgrid(np.arange(side) * spacing, np.arange(side) * spacing)
    return x.ravel(), y.ravel()


@pytest.mark.parametrize("dimensions", [2, 3])
def test_mean_and_deviation_are_those_of_the_closed_form(dimensions):
    x, y = np.random.default_rng(3).uniform(-4.0, 4.0, (2, 200_000))
    values = noise(3, SIZE, *(x, y, 0.31 * x - 0.7 * y)[:dimensions])
    assert abs(values.mean()) < 0.01
    assert values.std() == pytest.approx(DEVIATION, rel=0.02)


def test_octaves_deviate_like_one_and_leave_out_what_is_too_fine():
    x, y = field()
    assert fractal(1, SIZE, 4, 0.6, x, y).std() == pytest.approx(DEVIATION, rel=0.03)
    weight = np.sqrt(1 + 0.36 + 0.36**2 + 0.36**3)
    assert np.allclose(fractal(1, SIZE, 4, 0.6, x, y, finest=SIZE) * weight, noise(1, SIZE, x, y))


def test_places_far_apart_are_looked_up_like_places_together():
    x, y = field(40)
    far = np.concatenate([[x[7], 1e4]])
    assert noise(2, SIZE, far, np.array([y[7], -1e4]))[0] == noise(2, SIZE, x, y)[7]


def test_it_has_no_steps_and_no_bends():
    x = np.linspace(0.0, 0.1, 20_001)
    slope = np.diff(noise(5, SIZE, x, 0.3 * x)) / np.diff(x)
    assert np.abs(slope).max() < 2.0 * 1.875 * DEVIATION * np.sqrt(3 / 0.6) / SIZE  # of the quintic passage
    assert np.abs(np.diff(slope)).max() < 0.01 * np.abs(slope).max()


def test_it_depends_on_place_and_seed_alone():
    x, y = field(50)
    whole = noise(9, SIZE, x, y)
    sample = np.arange(0, len(x), 7)
    assert np.array_equal(whole[sample], noise(9, SIZE, x[sample], y[sample]))
    assert abs(np.corrcoef(whole, noise(10, SIZE, x, y))[0, 1]) < 0.2


def test_hashes_are_the_same_bytes_on_every_machine():
    assert hashed(7, np.array([0, -1, 2**40]), np.array([5, 6, -7])).tolist() == [113492253, 293706994, 3907211332]


def test_cells_are_voronoi_cells_of_their_size():
    x, y = field(200)
    near = cells(4, SIZE, x, y)
    area = 0.005**2 * len(x) / len(np.unique(near.number))
    assert area == pytest.approx(SIZE**2, rel=0.15)
    assert near.to_edge.min() >= 0
    centres = np.stack([x - near.x, y - near.y])
    for number in np.unique(near.number)[:20]:
        of_cell = centres[:, near.number == number]
        assert np.ptp(of_cell, axis=1).max() < 1e-9
