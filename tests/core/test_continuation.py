"""Stepped keys bridged and loops continued, so that derivatives mean something."""

import numpy as np
import pytest

from softground_addon.core.continuation import continued, is_loop, without_holds
from tests.core.character import character, flat_sole

RATE = 24.0


def walker(frames, *, period=24, speed=1.0, hold=1):
    """A body that bobs and moves on, its pose updated every `hold` frames."""
    time = (np.arange(frames) // hold * hold) / RATE
    phase = 2 * np.pi * time * RATE / period
    hips = np.stack([speed * time, 0.02 * np.sin(phase), 0.9 + 0.03 * np.cos(2 * phase)], axis=1)
    feet = [
        flat_sole(np.stack([speed * time + 0.2 * np.sin(phase + side), 0 * time, 0 * time], axis=1))
        for side in (0.0, np.pi)
    ]
    return character(feet, rate=RATE, hips=hips)


def test_keys_on_twos_become_the_smooth_motion_between_them():
    stepped, smooth = without_holds(walker(49, hold=2)), walker(49)
    assert np.abs(stepped.joints["hips"] - smooth.joints["hips"])[2:-3].max() < 2e-3
    assert stepped.joints["hips"][::2] == pytest.approx(smooth.joints["hips"][::2])
    assert np.allclose(stepped.soles[0].transforms[:, 0, :3, :3], np.eye(3))


def test_a_motion_without_holds_stays_what_it_is():
    motion = walker(49)
    assert without_holds(motion) is motion


def test_a_rest_is_no_hold():
    still = character([flat_sole(np.zeros((48, 3)))], hips=(0, 0, 0.9), rate=RATE)
    assert without_holds(still) is still


def test_a_whole_cycle_is_a_loop_and_a_part_of_one_is_not():
    assert is_loop(walker(25))
    assert is_loop(walker(49))
    assert not is_loop(walker(31))


@pytest.mark.parametrize("speed", [0.0, 1.3])
def test_a_continued_loop_is_the_longer_walk(speed):
    loop, margin = continued(walker(25, speed=speed))
    assert margin > 0
    longer = walker(25 + 48, speed=speed)
    begin = 24 - margin
    expected = longer.joints["hips"][begin : begin + 25 + 2 * margin] - (speed * 24 / RATE, 0, 0)
    assert loop.joints["hips"] == pytest.approx(expected, abs=1e-9)
    assert loop.frames[margin] == 1.0
    assert np.diff(loop.frames) == pytest.approx(1.0)


def test_the_given_frames_of_a_loop_stay_exactly_as_given():
    given = walker(25)
    loop, margin = continued(given)
    assert np.array_equal(loop.joints["hips"][margin:-margin], given.joints["hips"])


def test_what_does_not_loop_is_not_continued():
    motion = walker(31)
    assert continued(motion) == (motion, 0)
