"""The smoothing spline as a low-pass without edges that knows free fall."""

import numpy as np
import pytest
from scipy.linalg import solve

from softground_addon.core.numerics.smoothing_spline import share_of_noise, smooth_path

RATE = 120.0


def wave(frequency, seconds=8.0):
    time = np.arange(int(seconds * RATE)) / RATE
    return np.sin(2 * np.pi * frequency * time)[:, None]


def gain(frequency, cutoff):
    signal = wave(frequency)
    smooth, _, _ = smooth_path(signal, 1 / RATE, cutoff)
    middle = slice(len(signal) // 4, -len(signal) // 4)
    return float((smooth[middle, 0] @ signal[middle, 0]) / (signal[middle, 0] @ signal[middle, 0]))


@pytest.mark.parametrize("frequency", [1.0, 4.0, 8.0, 16.0])
def test_the_gain_is_that_of_a_zero_phase_filter_of_sixth_order(frequency):
    assert gain(frequency, 8.0) == pytest.approx(1 / (1 + (frequency / 8.0) ** 6), abs=0.02)


def test_a_parabola_passes_unchanged_up_to_both_ends():
    time = np.arange(200)[:, None] / RATE
    path = 1 + 2 * time - 4.905 * time**2
    position, velocity, acceleration = smooth_path(path, 1 / RATE, 8.0)
    assert position == pytest.approx(path, abs=1e-9)
    assert acceleration == pytest.approx(np.full_like(path, -9.81), abs=1e-4)
    assert velocity[1:-1] == pytest.approx((2 - 9.81 * time)[1:-1], abs=1e-6)


def test_the_banded_solution_is_the_dense_one():
    random = np.random.default_rng(0)
    path = random.normal(size=(101, 2)).cumsum(axis=0)
    sampled = random.random(101) < 0.5
    falling = np.zeros(101, dtype=bool)
    falling[40:60] = True
    smooth, _, _ = smooth_path(path, 1 / RATE, 8.0, sampled=sampled, falling=falling, fall=9.81)
    scale, weight = 2 * np.sin(np.pi * 8.0 / RATE), np.diag(sampled.astype(float))
    third, second = np.diff(np.eye(101), 3, axis=0), np.diff(np.eye(101), 2, axis=0)[39:59]
    fall = 1e5 * sampled.mean() / scale**4
    system = weight + sampled.mean() / scale**6 * third.T @ third + fall * second.T @ second
    right = weight @ path
    right[:, -1] -= fall * 9.81 / RATE**2 * second.sum(axis=0)
    assert smooth == pytest.approx(solve(system, right, assume_a="pos"), abs=1e-7)


def test_free_fall_comes_out_where_it_is_known():
    _, _, acceleration = smooth_path(wave(2.0), 1 / RATE, 8.0, falling=np.arange(int(8 * RATE)) % 50 < 20, fall=9.81)
    assert acceleration[205:215, 0] == pytest.approx(np.full(10, -9.81), abs=0.1)


def test_a_spline_through_every_fifth_step_follows_the_path_between():
    path = wave(2.0)
    smooth, _, _ = smooth_path(path, 1 / RATE, 8.0, sampled=np.arange(len(path)) % 5 == 0)
    assert np.abs(smooth - path)[20:-20].max() < 2e-3


def test_a_few_steps_are_no_error():
    for count in range(1, 6):
        assert smooth_path(np.ones((count, 3)), 1 / RATE, 8.0)[2] == pytest.approx(np.zeros((count, 3)), abs=1e-8)


@pytest.mark.parametrize("cutoff", [0.02, 0.1, 0.34])
def test_the_share_of_noise_that_passes_is_the_mean_of_the_smoother_s_diagonal(cutoff):
    smoother, _, _ = smooth_path(np.eye(600), 1.0, cutoff)
    assert share_of_noise(cutoff) == pytest.approx(np.diagonal(smoother)[200:400].mean(), rel=2e-3)


@pytest.mark.parametrize("cutoff", [0.05, 0.2, 0.34])
def test_half_the_amplitude_passes_at_the_cutoff_up_to_the_frame_rate(cutoff):
    assert gain(cutoff * RATE, cutoff * RATE) == pytest.approx(0.5, abs=0.02)
