import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softground_addon.core.motion.sole_motion import orthonormal
from softground_addon.core.numerics.interpolation import STRETCH, Between, cubic, in_stretches, turning
from softground_addon.core.numerics.rigid import rotation

FRAMES, STEPS = 400, 5
POSITION = np.arange((FRAMES - 1) * STEPS + 1) / STEPS


def tumbling(count=FRAMES):
    """Poses of two pieces that turn and move by chance, (count, 2, 4, 4)."""
    chance = np.random.default_rng(1)
    poses = np.tile(np.eye(4), (count, 2, 1, 1))
    poses[..., :3, :3] = rotation(0.1 * chance.normal(size=(count, 2, 3)).cumsum(axis=0))
    poses[..., :3, 3] = chance.normal(size=(count, 2, 3)).cumsum(axis=0)
    return poses


def rigid_cubic(poses, position):
    return orthonormal(cubic(poses, position))


@pytest.mark.parametrize("method", [cubic, rigid_cubic, turning])
def test_what_lies_between_samples_is_the_same_to_the_bit_wherever_it_is_looked_at(method):
    poses = tumbling()
    between, whole = Between(poses, POSITION, method), method(poses, POSITION)
    assert len(POSITION) > 3 * STRETCH
    assert between.shape == whole.shape
    assert between.ndim == whole.ndim
    assert len(between) == len(whole)
    np.testing.assert_array_equal(between, whole)
    np.testing.assert_array_equal(between[7], whole[7])
    np.testing.assert_array_equal(between[-1, 1, :3, 3], whole[-1, 1, :3, 3])
    np.testing.assert_array_equal(between[..., :3, 3], whole[..., :3, 3])
    np.testing.assert_array_equal(between[POSITION % 1 == 0], whole[POSITION % 1 == 0])
    np.testing.assert_array_equal(between[[900, 3, 1700]], whole[[900, 3, 1700]])
    assert between[5:5].shape == (0, 2, 4, 4)


@given(st.integers(2, 40), st.integers(1, 7), st.data())
def test_any_stretch_of_steps_is_that_of_the_whole(frames, steps, data):
    poses = tumbling(frames)
    position = np.arange((frames - 1) * steps + 1) / steps
    first = data.draw(st.integers(0, len(position) - 1))
    part = slice(first, data.draw(st.integers(first, len(position))), data.draw(st.integers(1, 3)))
    np.testing.assert_array_equal(Between(poses, position, cubic)[part], cubic(poses, position)[part])


def test_one_calculates_with_it_as_with_an_array():
    path = np.random.default_rng(2).normal(size=(FRAMES, 3))
    between, whole = Between(path, POSITION, cubic), cubic(path, POSITION)
    np.testing.assert_array_equal((between + between) / 2 - (0.0, 0.0, 1.0), (whole + whole) / 2 - (0.0, 0.0, 1.0))
    np.testing.assert_array_equal(np.gradient(between, 0.1, axis=0), np.gradient(whole, 0.1, axis=0))
    np.testing.assert_array_equal(np.linalg.norm(between, axis=1), np.linalg.norm(whole, axis=1))


def test_a_few_steps_of_a_long_shot_take_little_memory():
    poses = tumbling(20_000)
    position = np.arange((len(poses) - 1) * STEPS + 1) / STEPS
    tracemalloc.start()
    try:
        between = Between(poses, position, rigid_cubic)
        between[50_000:50_100]
        few = tracemalloc.get_traced_memory()[1]
        tracemalloc.reset_peak()
        heights = between[:, 0, 2, 3]
        one_number_each = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert few < 1e6 < poses.nbytes
    assert one_number_each < heights.nbytes + 5e6 < STEPS * poses.nbytes / 4


@given(st.integers(0, 3 * STRETCH))
def test_stretches_make_the_whole(count):
    numbers = np.arange(float(2 * count)).reshape(count, 2)
    np.testing.assert_array_equal(in_stretches(lambda part: numbers[part] ** 2, count), numbers**2)


def test_the_last_step_alone_is_that_of_the_whole():
    poses = np.random.default_rng(3).normal(size=(34, 50, 4, 4))
    position = np.arange(33 * 7 + 1) / 7
    np.testing.assert_array_equal(Between(poses, position, cubic)[-1:], cubic(poses, position)[-1:])
