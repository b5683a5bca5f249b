"""Banded systems against scipy's dense solver and a closed form."""

import tracemalloc

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st

from softground_addon.core.numerics.banded import solve_banded


def definite_band(count, reach, seed):
    """A band of the normal equations of random banded rows, scaled over eight orders, with a little on the diagonal."""
    random = np.random.default_rng(seed)
    factor = sum(
        np.diag(random.normal(size=max(count - k, 0)), k)[:count, :count] for k in range(reach + 1) if k < count
    )
    matrix = factor.T @ np.diag(10.0 ** random.uniform(-4, 4, count)) @ factor + 1e-3 * np.eye(count)
    band = np.zeros((reach + 1, count))
    for k in range(min(reach + 1, count)):
        band[k, : count - k] = np.diagonal(matrix, k)
    return band, matrix


@settings(max_examples=60)
@given(st.integers(1, 70), st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_the_solution_solves_the_system_as_well_as_a_dense_one(count, reach, seed):
    band, matrix = definite_band(count, reach, seed)
    right = np.random.default_rng(seed + 1).normal(size=(count, 3))
    solution = solve_banded(band, right)
    reference = scipy.linalg.solve(matrix, right, assume_a="pos")
    assert solution.shape == (count, 3)
    scale = np.abs(matrix).sum(axis=1).max() * np.abs(reference).max()
    assert np.abs(matrix @ solution - right).max() <= 1e-12 * scale


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 6, 7, 100, 1001])
def test_a_chain_of_springs_hangs_as_it_should(count):
    """Unit masses on unit springs between two walls: x(i) = (i + 1)·(count - i)/2."""
    band = np.array([np.full(count, 2.0), np.full(count, -1.0)])
    place = np.arange(count)
    expected = (place + 1) * (count - place) / 2
    assert solve_banded(band, np.ones((count, 1)))[:, 0] == pytest.approx(expected, rel=1e-9)


def test_the_inputs_are_left_as_they_were():
    band, _ = definite_band(20, 3, 0)
    right = np.ones((20, 2))
    before = band.copy(), right.copy()
    solve_banded(band, right)
    assert np.array_equal(band, before[0])
    assert np.array_equal(right, before[1])


def test_solving_takes_a_few_times_the_memory_of_the_system():
    count, reach = 30_000, 3
    band, right = np.zeros((reach + 1, count)), np.ones((count, 3))
    band[0], band[1] = 2.0, -1.0
    tracemalloc.start()
    try:
        solve_banded(band, right)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 6 * (band.nbytes + right.nbytes)
