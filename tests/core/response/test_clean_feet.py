"""Clean Feet on what networks make: feet that skate, shake and leave the floor with their heels."""

from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.legs.foot_placement import between_contacts
from softground_addon.core.legs.grounding import leg_of, leg_soles, reach_of, responding
from softground_addon.core.motion.sole_motion import SoleMotion
from softground_addon.core.numerics.intervals import runs
from softground_addon.core.numerics.plane_fit import smoothed
from softground_addon.core.numerics.rigid import displacement, rotation
from softground_addon.core.response.clean_feet import clean, foot_faults, resting
from tests.core.legs.test_grounding import walk

FLOOR = FlatTerrain(0.0)
BALL = 1
FLOAT = 0.06
"""How high a foot has risen when its toes leave [m]: more than feet do that touch."""


def moved(motion, way, *turns):
    """The whole body moved by a way (F, 3), its feet turned by rotation vectors (F, 3) as well."""
    soles = []
    for sole, turn in zip(motion.soles, turns or np.zeros((2, *way.shape)), strict=True):
        middle = sole.landmark_positions().mean(axis=1)
        carry = displacement(rotation(turn), middle, middle + way)
        soles.append(SoleMotion(sole.sole, carry[:, None] @ sole.transforms))
    return replace(motion, soles=tuple(soles), joints={name: path + way for name, path in motion.joints.items()})


def skating(seed, travel):
    """A walk whose travel is scaled and which drifts and shakes, and when its feet touch."""
    motion, touching = walk()
    random = np.random.default_rng(seed)
    drift = 0.1 * smoothed(random.normal(size=motion.hips.shape), 6.0)
    turn = np.radians(4.0) * smoothed(random.normal(size=motion.hips.shape), 2.0)
    return moved(motion, drift + (travel - 1.0) * (motion.hips - motion.hips[0]) * (1, 0, 0), turn, turn), touching


def jerk(path):
    return np.sqrt((np.diff(path, 3, axis=0) ** 2).sum(axis=1).mean())


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("travel", [0.8, 1.0, 1.25])
def test_hips_shake_no_more_than_in_the_source_while_feet_stand_and_legs_reach(seed, travel):
    motion, touching = skating(seed, travel)
    after = responding(motion, clean(motion, touching, FLOOR))
    assert jerk(after.hips) < 1.1 * jerk(motion.hips)
    faults = foot_faults(after, touching, FLOOR)
    assert np.percentile(faults.slide, 95) < 1e-3
    assert max(faults.float_.max(), faults.penetration.max()) < 1e-3
    for side, sole in leg_soles(motion).items():
        reach = reach_of(leg_of(motion, side, sole))
        assert (leg_of(after, side, sole).span < reach + 2e-3)[touching[:, sole]].all()


def test_feet_that_turn_as_they_stand_do_not_shake_the_hips():
    motion, touching = skating(0, 1.2)
    turned = np.zeros((2, *motion.hips.shape))
    for number, turn in enumerate(turned):
        for first, end in zip(*runs(touching[:, number]), strict=True):
            turn[first:end, 2] = np.radians(40.0) * np.linspace(0.0, 1.0, end - first) ** 2
        turn[:, 2] = between_contacts(turn[:, 2], touching[:, number])
    turning = moved(motion, 0 * motion.hips, *turned)
    after = responding(turning, clean(turning, touching, FLOOR))
    assert jerk(after.hips) < 1.1 * jerk(motion.hips)


def floating(motion, touching):
    """A walk whose body rises, and whose left heel does, over the last third of each contact of its left foot, when it
    counts as leaving."""
    rises, rests = np.zeros(len(touching)), touching.copy()
    for first, end in zip(*runs(touching[:, 0]), strict=True):
        third = (end - first) // 3
        rises[end - third : end] = FLOAT * np.linspace(0.5, 1.0, third)
        rests[end - third : end, 0] = False
    rises = np.where(touching[:, 0], rises, 0.0)
    rises = smoothed(rises, 0.5)[:, None]
    turn = np.radians(12.0) * rises / FLOAT * (0, 1, 0)
    return moved(motion, rises * (0, 0, 1), turn, 0 * turn), rests


def test_toes_rest_until_they_swing_although_they_float_and_are_held_there():
    motion, touching = walk(stride=1.4)
    risen, remaining = floating(motion, touching)
    rests = resting(risen, remaining, FLOOR)
    assert rests[remaining].all()
    assert (rests != touching).sum() < (rests & ~remaining).sum() / 4, "but for what swings slowly yet"
    np.testing.assert_array_equal(rests[:, 1], touching[:, 1])
    skates = moved(risen, 0.2 * (motion.hips - motion.hips[0]) * (1, 0, 0))
    after = responding(skates, clean(skates, rests, FLOOR))
    for first, end in zip(*runs(touching[:, 0] & rests[:, 0]), strict=True):
        places = after.soles[0].landmark_positions()[first:end, BALL, :2]
        assert np.linalg.norm(places - places[0], axis=1).max() < 0.01


def test_feet_that_step_on_the_spot_do_not_rest_in_the_air():
    motion, touching = walk(stride=0.0)
    risen, remaining = floating(motion, touching)
    np.testing.assert_array_equal(resting(risen, remaining, FLOOR), remaining)
