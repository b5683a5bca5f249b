"""Figures of blocks, whose feet are the ends of their shanks: legs without an ankle."""

from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.legs.grounding import leg_soles, responding
from softground_addon.core.motion.sole_motion import SoleMotion
from softground_addon.core.numerics.rigid import carried, displacement, rotation, turn_between, unit
from softground_addon.core.response.clean_feet import clean, foot_faults
from softground_addon.core.response.foot_holds import FootHold
from tests.core.legs.test_grounding import ANKLE, LEG, walk
from tests.tiers import slow_but_one

FLOOR = FlatTerrain(0.0)


def blocks(slide=0.0, turn=0.0):
    """The walk of a figure without ankles whose soles slide and turn to and fro (m, rad), and when they touch."""
    motion, touching = walk()
    joints = {name: path for name, path in motion.joints.items() if not name.startswith(("ankle", "ball"))}
    swing = np.sin(2 * np.pi * np.arange(len(motion.frames)) / 17.0)[:, None]
    soles = []
    for side, sole in zip("lr", motion.soles, strict=True):
        hip, knee, ankle = (motion.joints[f"{joint}_{side}"] for joint in ("hip", "knee", "ankle"))
        end = knee + (LEG + ANKLE) / 2 * unit(ankle - knee)
        upright = rotation(turn_between(np.array((0.0, 0.0, -1.0)), end - knee))
        middle = sole.sole.landmarks.mean(axis=0) * (1, 1, 0)
        pose = displacement(upright, np.broadcast_to(middle, end.shape), end)
        spoil = displacement(rotation(turn * swing * (0.0, 0.0, 1.0)), hip, hip + slide * swing * (1.0, 0.4, 0.0))
        joints |= {f"hip_{side}": carried(spoil, hip), f"knee_{side}": carried(spoil, knee)}
        soles.append(SoleMotion(sole.sole, np.repeat((spoil @ pose)[:, None], 2, axis=1)))
    return replace(motion, joints=joints, soles=tuple(soles)), touching


def test_a_sole_that_keeps_its_place_as_seen_from_the_knee_is_the_end_of_the_shank():
    motion, _ = blocks()
    assert leg_soles(motion) == {"l": 0, "r": 1}
    whole, _ = walk()
    footless = {name: path for name, path in whole.joints.items() if not name.startswith("ankle")}
    assert leg_soles(replace(whole, joints=footless)) == {}, "feet that turn in their ankles are another piece"


def test_a_foot_that_hangs_from_a_shin_is_no_shank():
    motion, _ = blocks()
    joints = dict(motion.joints)
    for side, number in leg_soles(motion).items():
        end = motion.soles[number].landmark_positions().mean(axis=1)
        joints[f"knee_{side}"] = end + 0.25 * (joints[f"knee_{side}"] - end)
    assert leg_soles(replace(motion, joints=joints)) == {}


@pytest.mark.slow
@pytest.mark.parametrize(("slide", "turn"), slow_but_one([(0.02, 0.1), (0.0, 0.0), (0.03, 0.0)]))
def test_their_feet_stand_without_slide_or_gap_and_their_parts_stay_whole(slide, turn):
    motion, touching = blocks(slide, turn)
    after = responding(motion, clean(motion, touching, FLOOR))
    faults = foot_faults(after, touching, FLOOR)
    assert np.percentile(faults.slide, 95) < 1e-3
    assert faults.slide.max() < 3e-3
    assert max(faults.float_.max(), faults.penetration.max()) < 1e-3
    for side, number in leg_soles(motion).items():
        for bone in (("hip", "knee"), ("knee", "sole")):
            lengths = []
            for each in (motion, after):
                ends = each.joints | {f"sole_{side}": each.soles[number].landmark_positions()[:, 0]}
                lengths.append(np.linalg.norm(ends[f"{bone[0]}_{side}"] - ends[f"{bone[1]}_{side}"], axis=1))
            np.testing.assert_allclose(lengths[1], lengths[0], atol=1e-6)


@pytest.mark.slow
def test_a_foot_lock_without_strength_leaves_them_where_they_are():
    motion, touching = blocks(0.03)
    first = np.flatnonzero(touching[:, 0])[0]
    hold = FootHold(motion.soles[0].sole.name, motion.frames[first], strength=0.0)
    after = responding(motion, clean(motion, touching, FLOOR, (hold,)))
    end = first + int(np.argmin(touching[first:, 0]))
    places = [each.soles[0].landmark_positions().mean(axis=1)[first:end] for each in (motion, after)]
    np.testing.assert_allclose(places[1], places[0], atol=1e-3)
