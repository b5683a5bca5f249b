"""One load shared by several contacts."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls

from softground_addon.core.dynamics.body_dynamics import body_dynamics
from softground_addon.core.dynamics.centre_of_pressure import lowest_points
from softground_addon.core.dynamics.load_sharing import (
    share_by_moment,
    share_through_transitions,
    solve_non_negative,
    whole_body_shares,
)
from tests.core.character import standing

FEET = np.array([[[0.0, 0.1], [0.6, -0.1]]])


def share(points, target):
    points = np.atleast_3d(np.asarray(points, dtype=float))
    return share_by_moment(points, np.asarray([target], dtype=float), np.ones(points.shape[:2], dtype=bool))[0]


def test_the_share_of_two_feet_is_the_place_of_the_centre_of_mass_between_them():
    """Eq. 5 corrected: (p_com - p_left)·d/|d|² = (0.15·0.6 + 0.15·0.2)/0.4 = 0.3; printed, it is 1 on the segment."""
    target = (0.15 + 0.02, 0.1 - 0.05 + 0.06)  # off the segment by (0.02, 0.06), square to it
    assert share(FEET, target) == pytest.approx([0.75, 0.25], abs=1e-5)


@pytest.mark.parametrize(("beyond", "expected"), [((-0.3, 0.2), [1, 0]), ((0.9, -0.2), [0, 1])])
def test_a_centre_of_mass_beyond_a_foot_rests_on_that_foot(beyond, expected):
    assert share(FEET, beyond) == pytest.approx(expected, abs=1e-5)


def test_feet_at_the_same_place_bear_one_half_each():
    assert share([[[0.3, 0.2], [0.3, 0.2]]], (5.0, 1.0)) == pytest.approx([0.5, 0.5])


def test_a_foot_in_the_air_bears_nothing_and_the_other_everything():
    touching = np.array([[True, False], [False, False]])
    assert share_by_moment(np.repeat(FEET, 2, axis=0), np.zeros((2, 2)), touching).tolist() == [[1, 0], [0, 0]]


def test_four_legs_under_the_centre_bear_a_quarter_each():
    corners = [[[0, 0], [1, 0], [0, 1], [1, 1]]]
    assert share(corners, (0.5, 0.5)) == pytest.approx([0.25] * 4)


@given(st.integers(0, 10_000))
@settings(max_examples=50)
def test_least_squares_agree_with_scipy(seed):
    random = np.random.default_rng(seed)
    count = random.integers(1, 7)
    rows, right = random.normal(size=(8, count)), random.normal(size=8)
    solution = solve_non_negative((rows.T @ rows)[None], (rows.T @ right)[None], np.ones((1, count), dtype=bool))
    assert solution[0] == pytest.approx(nnls(rows, right)[0], abs=1e-9)


def test_shares_change_continuously_as_the_centre_of_mass_moves():
    path = np.stack([np.linspace(-0.5, 1.5, 2000), 0.3 * np.sin(np.linspace(0, 20, 2000))], axis=1)
    corners = np.tile([[0.0, 0.0], [1.0, 0.0], [0.0, 0.4], [1.1, 0.5]], (2000, 1, 1))
    shares = share_by_moment(corners, path, np.ones((2000, 4), dtype=bool))
    assert np.abs(np.diff(shares, axis=0)).max() < 0.05


def test_feet_that_land_just_after_one_another_do_not_hand_over_for_long():
    """The second lands 3 steps after the first, the body midway between them: soon each bears a half."""
    step = np.arange(200)
    first, second = (step >= 50) & (step < 150), (step >= 53) & (step < 147)
    touching = np.stack([first, second], axis=1)
    points = np.repeat(FEET, 200, axis=0)
    shares = share_through_transitions(points, points.mean(axis=1), touching, deviation=np.full(200, 0.1), longest=40)
    assert shares[60:140] == pytest.approx(np.full((80, 2), 0.5), abs=0.01)
    assert shares.sum(axis=1) == pytest.approx(touching.any(axis=1).astype(float))


def test_a_foot_that_took_over_from_a_step_hands_over_as_long_as_before():
    """In a walk each foot bears alone for longer than both do."""
    step = np.arange(300)
    touching = np.stack([(step < 120) | (step >= 180), (step >= 90) & (step < 210)], axis=1)
    points = np.repeat(FEET, 300, axis=0)
    shares = share_through_transitions(points, points.mean(axis=1), touching, deviation=np.full(300, 10.0), longest=40)
    assert shares[105, 1] == pytest.approx(0.5, abs=0.05)
    assert np.diff(shares[90:120, 1]).min() > 0


def test_who_stands_on_both_feet_bears_evenly_however_the_markers_shake():
    random = np.random.default_rng(1)
    hips = (0.0, 0.0, 0.9) + 0.002 * random.normal(size=(600, 3))
    motion = standing(600, hips=hips, rate=100.0)
    touching = np.ones((600, 2), dtype=bool)
    shares = whole_body_shares(motion, lowest_points(motion), touching, body_dynamics(motion))
    assert shares[60:-60].std(axis=0).max() < 0.03
    assert shares.mean(axis=0) == pytest.approx([0.5, 0.5], abs=0.02)


def test_a_point_of_action_beside_the_feet_moves_the_shares_less():
    """A sole that bears alone is narrow: what is beside it is error, there and where the load passes to the next."""
    step = np.arange(200)
    touching = np.stack([step < 115, step >= 85], axis=1)

    def leading(beside):
        motion = standing(200, at=((0.0, 0.0, 0.0), (0.6, 0.0, 0.0)), hips=(0.12, beside, 0.9), rate=200.0)
        return whole_body_shares(motion, lowest_points(motion), touching, body_dynamics(motion))[100, 1]

    assert leading(0.0) < 0.25
    assert leading(0.0) < leading(0.1) < leading(0.3) < 0.5
    assert leading(0.3) > 0.4
