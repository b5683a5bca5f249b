"""A body that a cut or a constant key puts elsewhere takes no steps on the way, and presses as it does without it."""

from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.loads.estimate import estimate_loads
from softground_addon.core.loads.jumps import STAYS
from softground_addon.core.motion.motion import steps_per_frame
from tests.core.walkers import walk

SNOW = GroundMaterial(youngs_modulus=375e3, poisson_ratio=0.05, characteristic_time=0.2)


def walked(rate):
    """A walk at scene frames."""
    return walk(frame_rate=rate).motion.at_frames()


def at_samples(motion, samples):
    """The samples of a motion as a motion of their own."""
    return replace(motion.of(samples), frames=np.arange(len(samples), dtype=float))


def loads_of(motion):
    return estimate_loads(motion, FlatTerrain(), force_model="WHOLE_BODY", material=SNOW)


@pytest.mark.parametrize("rate", [24.0, 30.0, 120.0])
def test_a_loop_without_offset_presses_as_its_turns_do_each_alone(rate):
    """It ends in the middle of a contact: what bears before the jump has left after it."""
    once = walked(rate)
    count = len(once.frames) * 3 // 4
    twice = at_samples(once, np.tile(np.arange(count), 2))
    assert list(twice.starts) == [0, count]
    alone, both = loads_of(once.first(count)), loads_of(twice)
    steps = steps_per_frame(rate)
    assert len(both.contacts.touching) == len(both.motion.frames) == (2 * count - 1) * steps + 1
    turn, second = slice(0, (count - 1) * steps), slice(count * steps, None)
    assert alone.contacts.touching[-1].any()
    for here, samples in ((turn, turn), (second, slice(None))):
        np.testing.assert_array_equal(both.contacts.touching[here], alone.contacts.touching[samples])
        np.testing.assert_allclose(both.forces.forces[here], alone.forces.forces[samples], atol=1e-6)
    between = slice(turn.stop + (steps > 1), second.start)
    assert not both.contacts.touching[between].any()
    assert not both.forces.forces[between].any()
    np.testing.assert_allclose(both.forces.total, both.forces.forces.sum(axis=1), atol=1e-9)
    for sole, other in zip(both.motion.soles, alone.motion.soles, strict=True):
        np.testing.assert_allclose(sole.transforms[second], other.transforms[:], atol=0.05)
        np.testing.assert_allclose(sole.transforms[second][::steps], other.transforms[::steps], atol=1e-12)


@pytest.mark.parametrize("rate", [24.0, 30.0])
def test_a_fifth_of_a_second_that_is_cut_out_of_a_walk_is_a_jump(rate):
    once = walked(rate)
    first, count = len(once.frames) // 2, len(once.frames)
    brisk = np.arange(count)[:, None] * (1.4 / rate, 0.0, 0.0) + (0.0, 0.0, 0.9)
    once = replace(once, joints=dict.fromkeys(("hips", "neck", "head"), brisk))
    assert list(once.starts) == [0]
    cut = at_samples(once, np.concatenate([np.arange(first), np.arange(first + round(rate / 5), count)]))
    assert list(cut.starts) == [0, first]


def test_no_pose_lies_between_two_places():
    once = walked(24.0)
    count = len(once.frames)
    away = at_samples(once, np.tile(np.arange(count), 2))
    path = away.resampled(5).soles[0].transforms[:, 0, 0, 3]
    far = np.abs(np.diff(path)).max()
    moved = abs(once.soles[0].transforms[-1, 0, 0, 3] - once.soles[0].transforms[0, 0, 0, 3])
    assert far > 0.95 * moved


@pytest.mark.parametrize("hold", [2, 3])
def test_stepped_keys_are_no_jumps(hold):
    motion = walked(12.0)
    stepped = at_samples(motion, np.arange(len(motion.frames)) // hold * hold)
    assert list(stepped.starts) == [0]
    assert list(motion.starts) == [0]


def test_a_foot_that_stays_through_a_jump_of_the_body_bears_on():
    """As in blocked-out animation: each pose stands for a third of a second."""
    motion = walked(24.0)
    blocked = at_samples(motion, np.repeat(np.arange(0, len(motion.frames), 4), 8))
    assert len(blocked.starts) > 4
    loads = loads_of(blocked)
    bears_on = set()
    for start in blocked.starts[1:]:
        for sole in range(2):
            place = blocked.soles[sole].landmark_positions()[start - 1 : start + 1]
            between = loads.contacts.touching[(start - 1) * 5 + 1 : start * 5, sole]
            stays = np.ptp(place, axis=0).max() < STAYS * motion.leg_length
            assert between.all() if stays else not between.any()
            bears_on.add(bool(stays))
    assert bears_on == {False, True}
