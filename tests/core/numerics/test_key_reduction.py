"""Keys that are left out are not missed, and rotations come back from quaternions and Euler angles."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from softground_addon.core.numerics.key_reduction import kept_samples
from softground_addon.core.numerics.orientation import euler_angles, quaternions, rotation_matrices
from softground_addon.core.numerics.plane_fit import fitted_slope, smoothed, upper_envelope
from softground_addon.core.numerics.rigid import carried, displacement, inverse, rotation, turn_between

curves = st.lists(st.floats(-1, 1), min_size=2, max_size=80)
turns = st.tuples(*[st.floats(-3.1, 3.1)] * 3)


@given(curves, curves, st.floats(1e-4, 0.5))
def test_lines_between_the_kept_samples_stay_within_the_tolerance(first, other, tolerance):
    count = min(len(first), len(other))
    values = np.stack([first[:count], other[:count]], axis=1)
    samples = kept_samples(values, tolerance)
    assert samples[0] == 0
    assert samples[-1] == count - 1
    for channel in range(2):
        line = np.interp(np.arange(count), samples, values[samples, channel])
        assert np.abs(line - values[:, channel]).max() <= tolerance + 1e-12


def test_a_straight_line_needs_two_keys_and_a_sine_a_few():
    assert list(kept_samples(np.linspace(0, 5, 200)[:, None], 1e-6)) == [0, 199]
    sine = np.sin(np.linspace(0, 2 * np.pi, 1000))[:, None]
    assert 10 < len(kept_samples(sine, 1e-3)) < 100


@given(turns, turns)
def test_quaternions_hold_the_rotation(first, other):
    matrices = Rotation.from_rotvec([first, other]).as_matrix()
    quaternion = quaternions(matrices)
    assert rotation_matrices(quaternion) == pytest.approx(matrices, abs=1e-9)
    assert (quaternion[:, 0] >= 0).all()


@given(turns, turns, st.sampled_from(["".join(order) for order in itertools.permutations("XYZ")]))
def test_euler_angles_hold_the_rotation_and_stay_near(angles, wander, order):
    exact = np.array([angles])
    matrix = Rotation.from_euler(order.lower(), exact[:, ["XYZ".index(axis) for axis in order]]).as_matrix()
    near = exact + 0.02 * np.array([wander])
    result = euler_angles(matrix, order, near)
    back = Rotation.from_euler(order.lower(), result[:, ["XYZ".index(axis) for axis in order]]).as_matrix()
    assert back == pytest.approx(matrix, abs=1e-6)
    middle = exact[0, "XYZ".index(order[1])]
    if abs(np.cos(middle)) > 0.3:
        assert result == pytest.approx(exact, abs=1e-6)


@given(turns, turns)
def test_rotation_vectors_are_those_of_an_independent_implementation(first, other):
    vectors = np.array([first, other, (0, 0, 0), (1e-9, 0, 0)])
    assert rotation(vectors) == pytest.approx(Rotation.from_rotvec(vectors).as_matrix(), abs=1e-9)
    start, end = np.array([first]), np.array([other])
    if np.linalg.norm(start) > 1e-3 and np.linalg.norm(end) > 1e-3:
        turned = (rotation(turn_between(start, end)) @ (start / np.linalg.norm(start))[..., None])[..., 0]
        assert turned == pytest.approx(end / np.linalg.norm(end), abs=1e-6)


@given(turns, turns, turns)
def test_a_displacement_carries_its_point_and_its_inverse_carries_back(turn, start, end):
    move = displacement(rotation(np.array([turn])), np.array([start]), np.array([end]))
    assert carried(move, np.array([start])) == pytest.approx(np.array([end]), abs=1e-9)
    assert move @ inverse(move) == pytest.approx(np.eye(4)[None], abs=1e-9)


@given(curves, st.integers(1, 12))
def test_an_envelope_is_nowhere_below_its_values(values, reach):
    values = np.array(values)
    assert (upper_envelope(values, reach) >= values - 1e-12).all()


def test_smoothing_keeps_what_is_constant_and_the_mean_of_what_is_not():
    values = np.random.default_rng(0).normal(size=(400, 2))
    assert smoothed(np.ones((50, 2)), 4.0) == pytest.approx(np.ones((50, 2)))
    assert smoothed(values, 4.0)[50:-50].mean(axis=0) == pytest.approx(values[50:-50].mean(axis=0), abs=0.02)


@given(st.floats(-0.8, 0.8), st.floats(-0.8, 0.8))
def test_the_fitted_slope_of_a_plane_is_the_planes_whatever_is_missing(a, b):
    rng = np.random.default_rng(3)
    places = rng.uniform(-1, 1, (1, 12, 3)) + 5.0
    places[..., 2] = a * places[..., 0] + b * places[..., 1]
    places[0, :3, 2] = np.nan
    slope = fitted_slope(places, rng.uniform(0.1, 1, (1, 12)))
    assert np.tan(slope) == pytest.approx(np.array([[a, b]]), abs=1e-9)
