"""Stepped keys bridged and loops continued, so that derivatives mean something."""

from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.dynamics.continuation import _eased, continued, without_holds
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


def curve(keys, handle=1 / 2.5614, steps=5):
    """Keys (K, 3) with automatic handles, flat at both ends, at `steps` frames from one to the next."""
    slope = np.concatenate([[0 * keys[0]], (keys[2:] - keys[:-2]) / 2, [0 * keys[0]]]) * handle
    part = np.linspace(0.0, 1.0, 1001)
    time = 3 * part * (1 - part) * (handle * (1 - part) + (1 - handle) * part) + part**3
    s = np.interp(np.arange(steps) / steps, time, part)[:, None]
    pieces = [
        (1 - s) ** 2 * (1 + 2 * s) * a + s**2 * (3 - 2 * s) * b + 3 * s * (1 - s) * ((1 - s) * before - s * after)
        for a, b, before, after in zip(keys, keys[1:], slope, slope[1:], strict=False)
    ]
    return np.concatenate([*pieces, keys[-1:]])


def with_paths(motion, change, rate):
    feet = [flat_sole(change(sole.transforms[:, 0, :3, 3])) for sole in motion.soles]
    return character(feet, rate=rate, hips=change(motion.joints["hips"]))


@pytest.mark.parametrize("steps", [2, 5])
def test_a_take_that_eases_from_its_first_key_and_into_its_last_goes_on_there(steps):
    walk = walker(49)
    take = with_paths(walk, lambda keys: curve(keys, steps=steps), RATE * steps)
    speed = np.diff(without_holds(take).joints["hips"][:, 0]) * RATE * steps
    assert np.diff(take.joints["hips"][:, 0])[[0, -1]].max() * RATE * steps < 0.8
    assert speed == pytest.approx(np.ones(len(speed)), abs=0.03)


@pytest.mark.parametrize("order", [slice(None), slice(None, None, -1)], ids=["lands", "pushes off"])
@pytest.mark.parametrize("seconds", [0.06, 0.1, 0.2])
def test_a_body_that_lands_or_pushes_off_at_the_end_of_a_take_does_not_ease(seconds, order):
    """It falls, and its legs take up its speed evenly: its feet stand, its hips come to rest or nearly so."""
    for rest in (0.0, 0.01, 0.03):
        left = -rest - (np.arange(100) - 99) / 100  # until it has come to rest [s]
        braked = 2.0 * np.clip(left, 0.0, seconds) ** 2 / (2 * seconds)
        falls = 2.0 * np.clip(left - seconds, 0.0, None)
        hips = np.stack([0 * left, 0 * left, 0.8 + braked + falls], axis=1)[order]
        feet = [flat_sole(np.stack([0 * left, 0 * left + side, falls], axis=1)[order]) for side in (-0.1, 0.1)]
        above = {name: np.add(hips, (0, 0, up)) for name, up in {"chest": 0.4, "head": 0.7}.items()}
        motion = character(feet, rate=100.0, hips=hips, **above)
        assert not _eased(motion, np.arange(100.0)).any(), rest


def bobbing(times):
    """A body that walks, at some times in frames."""
    time = np.asarray(times) / RATE
    phase = 2 * np.pi * time
    hips = np.stack([time, 0.02 * np.sin(phase), 0.9 + 0.03 * np.cos(2 * phase)], axis=1)
    feet = [
        flat_sole(np.stack([time + 0.2 * np.sin(phase + side), 0 * time, 0 * time], axis=1)) for side in (0.0, np.pi)
    ]
    return character(feet, rate=RATE, hips=hips)


@pytest.mark.parametrize("part", [0.1, 0.4, 0.5, 0.9])
def test_keys_that_begin_and_end_within_a_frame_are_cut_and_not_held(part):
    times = np.arange(49.0)
    held = replace(bobbing(times.clip(part, 48 - part)), animated=(1.0 + part, 49.0 - part))
    smooth, walk = without_holds(held), bobbing(times)
    assert smooth.joints["hips"] == pytest.approx(walk.joints["hips"], abs=4e-3)
    for sole, true in zip(smooth.soles, walk.soles, strict=True):
        assert sole.transforms == pytest.approx(true.transforms, abs=1e-2)
    whole = replace(bobbing(times), animated=(1.0, 49.0))
    assert without_holds(whole) is whole
    longer = replace(bobbing(times.clip(8.5, 40.5)), animated=(9.5, 41.5))
    assert without_holds(longer) is longer, "a pose that stays is a rest"


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
