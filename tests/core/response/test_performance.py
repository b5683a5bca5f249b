"""Acting in deep ground: nothing without a strength or without depth, and what each part promises."""

import numpy as np
import pytest

from softground_addon.core.legs.grounding import Response, responding
from softground_addon.core.response.performance import (
    ARMS_OUT,
    Performance,
    raised_arms,
    sinkage_over_time,
    suggested_speed,
    swing_change,
    swing_progress,
)
from softground_addon.core.response.response import GroundingOptions, _acted
from tests.core.legs.test_grounding import LEG, Ground, placed, walk

DEEP = Ground(lambda x, y, t: -0.12)
FLAT = Ground(lambda x, y, t: 0.0)


def acted(acting, ground=DEEP):
    motion, touching = walk()
    return motion, touching, _acted(motion, touching, placed(motion, touching, ground, FLAT), acting)


def test_nothing_is_acted_by_default_nor_on_firm_ground():
    assert GroundingOptions().performance.is_none
    _, _, (feet, crouch, arms) = acted(Performance(1, 1, 1, 1), FLAT)
    assert all(np.abs(change).max() < 2e-3 for change in feet.values())
    assert np.abs(crouch).max() < 2e-3
    for arm in arms.values():
        assert arm == pytest.approx(np.broadcast_to(np.eye(4), arm.shape), abs=0.02)


def test_feet_swing_higher_by_what_they_sank_and_stand_where_they_stood():
    _, touching, (feet, _, _) = acted(Performance(knee_lift=1.0))
    for index, change in enumerate(feet.values()):
        assert not change[touching[:, index]].any()
        assert change[:, 2].max() == pytest.approx(0.12, rel=0.1)
        assert not change[:, :2].any()


def test_held_feet_lag_behind_early_and_land_where_the_source_does():
    motion, touching, (feet, _, _) = acted(Performance(hold=1.0))
    change = feet["l"]
    assert change[:, 0].min() < -0.05
    assert change[:, 0].max() < 1e-9
    assert not change[touching[:, 0]].any()
    ahead = (motion.joints["ankle_l"] + change)[:, 0]
    assert (np.diff(ahead) > -1e-6).all(), "the foot never goes backward"


def test_knees_bend_by_half_the_sinkage():
    _, _, (_, crouch, _) = acted(Performance(crouch=1.0))
    assert crouch[20:-20] == pytest.approx(np.full(len(crouch) - 40, 0.06), rel=0.15)


def test_arms_go_out_to_both_sides_of_a_body_that_faces_anywhere():
    for heading in (0.0, 1.0, -2.5):
        ahead = np.tile([np.cos(heading), np.sin(heading)], (5, 1))
        left = np.array((-np.sin(heading), np.cos(heading), 0.0))
        shoulders = {"l": 0.2 * left + np.zeros((5, 3)), "r": -0.2 * left + np.zeros((5, 3))}
        arms = raised_arms(shoulders, ahead, np.full(5, 1.0), 1.0, LEG)
        for side, sign in (("l", 1.0), ("r", -1.0)):
            hand = shoulders[side] + (0.0, 0.0, -0.6)
            moved = (arms[side] @ np.append(hand[0], 1.0)[:, None])[0, :3, 0]
            assert (moved - hand[0]) @ left == pytest.approx(sign * 0.6 * np.sin(ARMS_OUT))
            assert np.linalg.norm(moved - shoulders[side][0]) == pytest.approx(0.6)


def test_raised_arms_are_carried_by_the_body():
    motion, _ = walk(5)
    motion.joints["shoulder_l"] = motion.joints["hips"] + np.array((0.0, 0.2, 0.5))
    motion.joints["wrist_l"] = motion.joints["shoulder_l"] - np.array((0.0, 0.0, 0.6))
    body = np.broadcast_to(np.eye(4), (5, 4, 4)).copy()
    body[:, 2, 3] = -0.1
    arms = raised_arms({"l": motion.joints["shoulder_l"]}, np.tile([1.0, 0.0], (5, 1)), np.full(5, 1.0), 1.0, LEG)
    moved = responding(motion, Response(motion.frames, body, {}, np.zeros((5, 2)), arms))
    assert moved.joints["shoulder_l"] - motion.joints["shoulder_l"] == pytest.approx(np.tile([0, 0, -0.1], (5, 1)))
    assert (moved.joints["wrist_l"] - motion.joints["wrist_l"])[:, 1] == pytest.approx(0.6 * np.sin(ARMS_OUT))


def test_swings_are_counted_between_two_contacts_only():
    touching = np.array([0, 0, 1, 1, 0, 0, 0, 1, 0, 0], bool)
    assert swing_progress(touching) == pytest.approx([0, 0, 0, 0, 0.25, 0.5, 0.75, 0, 0, 0])
    depth = sinkage_over_time(np.array([9, 9, 1, 2, 9, 9, 9, 4, 9, 9.0]), touching)
    assert depth == pytest.approx([2, 2, 2, 2, 2.5, 3, 3.5, 4, 4, 4])


def test_no_swing_no_change():
    path = np.cumsum(np.ones((20, 3)), axis=0)
    change = swing_change(path, np.ones(20), np.ones(20, bool), Performance(1, 1, 1, 1), LEG)
    assert not change.any()


def test_people_slow_down_on_sand_by_a_tenth_and_never_speed_up_with_depth():
    speeds = [suggested_speed(depth) for depth in np.linspace(0, 0.5, 60)]
    assert speeds[0] == 1.0
    assert (np.diff(speeds) <= 0).all()
    assert suggested_speed(0.10) == pytest.approx(0.90, abs=0.02)  # 2.1 times the cost, as on dry sand
