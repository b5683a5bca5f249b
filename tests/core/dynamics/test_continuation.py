"""Stepped keys bridged and loops continued, so that derivatives mean something."""

from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.dynamics.continuation import continued, without_holds
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


@pytest.mark.parametrize("known", [True, False])
def test_feet_bear_as_their_skin_does_where_they_all_stand_and_no_joint_tells_whether_the_pose_is_held(known):
    path = np.repeat([0.0, 0.0, 0.1, 0.2, 0.2, 0.3], [6, 1, 1, 1, 5, 1])[:, None] * (1, 0, 0)
    bears = np.repeat([True, False, True, False], [7, 1, 6, 1])
    sole = replace(flat_sole(path), bears=bears)
    motion = character([sole], rate=RATE, hips=path + np.array((0, 0, 0.9)))
    smooth = without_holds(motion if known else replace(motion, joints={}))
    assert (smooth.soles[0].bears == bears).all() != known


def test_a_rest_is_no_hold():
    still = character([flat_sole(np.zeros((48, 3)))], hips=(0, 0, 0.9), rate=RATE)
    assert without_holds(still) is still


@pytest.mark.parametrize("speed", [0.0, 1.3])
@pytest.mark.parametrize("frames", [25, 49, 61])
def test_a_loop_and_a_gait_go_on_as_the_longer_walk(frames, speed):
    """One cycle, two, and two and a half of a gait of 24 frames."""
    longer, given = continued(walker(frames, speed=speed))
    assert given.stop - given.start == frames
    start, after = given.start, len(longer.frames) - given.stop
    assert start > 0
    assert after > 0
    walk = walker(frames + 48, speed=speed)
    expected = walk.joints["hips"][24 - start : 24 + frames + after] - (speed * 24 / RATE, 0, 0)
    assert longer.joints["hips"] == pytest.approx(expected, abs=1e-9)
    assert longer.frames[given][0] == 1.0
    assert np.diff(longer.frames) == pytest.approx(1.0)


def test_the_given_frames_stay_as_given():
    motion = walker(49)
    longer, given = continued(motion)
    assert np.array_equal(longer.joints["hips"][given], motion.joints["hips"])
    assert longer.soles[0].transforms[given] == pytest.approx(motion.soles[0].transforms)


def test_standing_still_goes_on():
    still = character([flat_sole(np.zeros((48, 3)))], hips=(0, 0, 0.9), rate=RATE)
    longer, given = continued(still)
    assert given.start > 0
    assert len(longer.frames) > given.stop
    assert np.all(longer.joints["hips"] == (0, 0, 0.9))


def test_what_never_returns_to_a_pose_is_not_continued():
    rising = np.stack([0 * np.arange(48.0), 0 * np.arange(48.0), 0.3 + 0.02 * np.arange(48.0)], axis=1)
    motion = character([flat_sole(np.zeros((48, 3)))], hips=rising, rate=RATE)
    longer, given = continued(motion)
    assert given == slice(0, 48)
    assert np.array_equal(longer.joints["hips"], rising)


def test_very_short_motions_are_left_alone():
    for frames in (1, 2, 5):
        motion = walker(frames)
        assert continued(motion) == (motion, slice(0, frames))
