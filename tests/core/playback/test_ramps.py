"""Fitting vertex_histories of heights with a few ramps per point."""

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from softground_addon.core.playback import ramps as core_ramps
from softground_addon.core.playback.ramps import QUANTUM, REST, TOLERANCE, Ramps


def staged_presses(rng, frames, points, presses):
    """Heights of points that are pressed several times, each time part of the way, with rests between; from 0."""
    heights = np.zeros((frames, points))
    for _ in range(presses):
        start = rng.uniform(1, frames - 2, points)
        length = rng.uniform(0.5, frames / 3, points)
        depth = rng.uniform(-0.03, 0.01, points)
        share = np.clip((np.arange(frames)[:, None] - start) / length, 0, 1)
        heights += depth * (1 - np.cos(np.pi * share)) / 2
    return heights


def fit(frames, heights, tolerance=TOLERANCE):
    """Heights (T, K) as ramps of one channel."""
    return core_ramps.fit(frames, heights[..., None], np.array([tolerance]))


def played(ramps, frame, points):
    return ramps.at(frame, points)[:, 0]


def at_rest(history):
    """Frames of one point from and to which nothing changes for `REST` frames, or since the first or until the last."""
    changes = np.concatenate([[-REST], np.flatnonzero(np.diff(history)), [len(history) + REST]])
    still = np.zeros(len(history), dtype=bool)
    for before, after in pairwise(changes.tolist()):
        if after - before > REST:
            still[max(before + 1, 0) : after + 1] = True
    return still


@given(st.integers(0, 2**32 - 1), st.integers(3, 60), st.integers(1, 5), st.sampled_from([5e-5, 2e-4, 1e-3]))
def test_the_error_stays_within_the_tolerance_at_every_frame(seed, frames, presses, tolerance):
    heights = staged_presses(np.random.default_rng(seed), frames, 40, presses)
    result = fit(np.arange(frames, dtype=float), heights, tolerance)
    fitted = np.stack([played(result.ramps, frame, 40) for frame in range(frames)])
    error = np.abs(fitted - heights).max(axis=0)
    assert (error <= tolerance).all()
    assert (error <= result.error[:, 0] + 1e-12).all(), "the reported error is no bound"


@given(st.integers(0, 2**32 - 1), st.integers(1, 4))
def test_points_at_rest_are_where_they_were(seed, presses):
    rng = np.random.default_rng(seed)
    frames, heights = 80, staged_presses(rng, 80, 30, presses)
    heights = np.round(heights / QUANTUM) * QUANTUM
    ramps = fit(np.arange(frames, dtype=float), heights).ramps
    fitted = np.stack([played(ramps, frame, 30) for frame in range(frames)])
    for point in range(30):
        still = at_rest(heights[:, point])
        np.testing.assert_array_equal(fitted[still, point], heights[still, point])
    np.testing.assert_array_equal(fitted[-1], heights[-1])


def test_sums_in_single_precision_are_exact_at_rest_in_any_order():
    heights = staged_presses(np.random.default_rng(5), 400, 50, 12)
    ramps = fit(np.arange(400.0), heights).ramps
    order = np.random.default_rng(6).permutation(len(ramps.point))
    total = np.zeros(50, dtype=np.float32)
    for k in order:  # one by one, as Blender adds them
        total[ramps.point[k]] += np.float32(ramps.change[k, 0])
    np.testing.assert_array_equal(total, np.round(heights[-1] / QUANTUM) * QUANTUM)


def test_between_frames_the_error_is_that_of_the_frames_around():
    heights = staged_presses(np.random.default_rng(7), 40, 60, 3)
    ramps = fit(np.arange(40.0), heights).ramps
    for frame in np.random.default_rng(8).uniform(0, 39, 50):
        before = int(frame)
        linear = heights[before] + (frame - before) * (heights[min(before + 1, 39)] - heights[before])
        assert np.abs(played(ramps, frame, 60) - linear).max() <= TOLERANCE


def test_a_straight_press_takes_one_ramp_and_an_untouched_point_none():
    heights = np.zeros((20, 3))
    heights[:, 1] = -np.clip((np.arange(20) - 4) / 8, 0, 1) * 0.02
    ramps = fit(np.arange(20.0), heights).ramps
    np.testing.assert_array_equal(ramps.point, [1])
    assert (ramps.start[0], ramps.end[0]) == (4.0, 12.0)


def test_more_steps_on_a_spot_take_more_ramps_and_more_tolerance_takes_fewer():
    rng = np.random.default_rng(9)
    counts = []
    for presses, tolerance in ((1, 2e-4), (6, 2e-4), (6, 2e-3)):
        heights = staged_presses(rng, 300, 200, presses)
        counts.append(len(fit(np.arange(300.0), heights, tolerance).ramps.point))
    assert counts[1] > 3 * counts[0]
    assert counts[2] < 0.7 * counts[1]


def test_joined_sets_add_up():
    parts = [fit(np.arange(30.0), staged_presses(np.random.default_rng(seed), 30, 20, 2)).ramps for seed in (1, 2)]
    joined = Ramps.joined(parts, 1)
    np.testing.assert_allclose(played(joined, 17.3, 20), sum(played(part, 17.3, 20) for part in parts), atol=1e-15)
    assert (np.diff(joined.point) >= 0).all()


def test_no_points_and_no_ramps_are_fine():
    result = fit(np.arange(3.0), np.zeros((3, 0)))
    assert played(result.ramps, 1.0, 0).shape == (0,)
    assert Ramps.joined([], 2).at(1.0, 4).tolist() == [[0.0, 0.0]] * 4


def test_the_values_of_a_point_bend_together_each_within_its_own_tolerance():
    rng, tolerance = np.random.default_rng(11), np.array([2e-4, 1e-3])
    values = np.stack([staged_presses(rng, 90, 50, 3), staged_presses(rng, 90, 50, 3)], axis=-1)
    result = core_ramps.fit(np.arange(90.0), values, tolerance)
    fitted = np.stack([result.ramps.at(frame, 50) for frame in range(90)])
    error = np.abs(fitted - values).max(axis=0)
    assert (error <= tolerance).all()
    assert (error <= result.error + 1e-12).all()
    alone = [core_ramps.fit(np.arange(90.0), values[..., [k]], tolerance[[k]]) for k in (0, 1)]
    assert len(result.ramps.point) < sum(len(each.ramps.point) for each in alone)


def test_a_short_pause_within_a_step_takes_no_ramp_and_a_long_one_is_kept():
    def pressed_twice(pause):
        steps = np.concatenate([np.ones(4), np.zeros(pause), np.ones(4), np.zeros(3)])
        return np.concatenate([[0.0], -np.cumsum(steps)]) * 4 * QUANTUM

    for pause, ramps in ((3, 1), (REST - 1, 1), (REST, 2), (40, 2)):
        heights = pressed_twice(pause)
        assert len(fit(np.arange(len(heights), dtype=float), heights[:, None]).ramps.point) == ramps
