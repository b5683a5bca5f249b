"""Two-bone legs: lengths, reach, the knee's side, and nothing at all where nothing moves."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softground_addon.core.legs.legs import Leg, solve
from softground_addon.core.numerics.rigid import carried

THIGH, SHANK = 0.45, 0.43


def bent_leg(flexion, count=1, heading=0.0):
    """A leg below the origin with the knee forward (x) of the line from hip to ankle."""
    flexion = np.broadcast_to(np.asarray(flexion, float), (count,))
    knee = np.stack([THIGH * np.sin(flexion / 2), np.zeros(count), -THIGH * np.cos(flexion / 2)], axis=-1)
    ankle = knee + np.stack([-SHANK * np.sin(flexion / 2), np.zeros(count), -SHANK * np.cos(flexion / 2)], axis=-1)
    turn = np.array([[np.cos(heading), -np.sin(heading), 0], [np.sin(heading), np.cos(heading), 0], [0, 0, 1]])
    toes = np.tile(turn @ (1.0, 0.0, 0.0), (count, 1))
    return Leg(np.zeros((count, 3)), knee @ turn.T, ankle @ turn.T, toes)


def flexion_of(hip, knee, ankle):
    thigh, shank = knee - hip, ankle - knee
    return np.arctan2(np.linalg.norm(np.cross(thigh, shank), axis=-1), np.sum(thigh * shank, axis=-1))


def solved_joints(leg, solved):
    """Hip, knee and ankle of a solved leg."""
    return carried(solved.thigh, leg.hip), carried(solved.thigh, leg.knee), carried(solved.shank, leg.ankle)


vectors = st.tuples(*[st.floats(-0.4, 0.4)] * 3)


@given(st.floats(0.0, 2.5), vectors, vectors, st.floats(-3, 3))
def test_bones_keep_their_length_and_reach_as_far_as_they_can(flexion, hip, ankle, heading):
    leg = bent_leg(flexion, heading=heading)
    hip, ankle = np.array([hip]), leg.ankle + np.array([ankle])
    new_hip, new_knee, new_ankle = solved_joints(leg, solve(leg, hip, ankle))
    assert new_hip == pytest.approx(hip, abs=1e-9)
    assert np.linalg.norm(new_knee - new_hip) == pytest.approx(THIGH, abs=1e-9)
    assert np.linalg.norm(new_ankle - new_knee) == pytest.approx(SHANK, abs=1e-9)
    distance = np.linalg.norm(ankle - hip)
    if abs(THIGH - SHANK) + 1e-4 < distance < THIGH + SHANK - 1e-4:
        assert new_ankle == pytest.approx(ankle, abs=1e-7)
    elif distance >= THIGH + SHANK:
        assert np.linalg.norm(new_ankle - new_hip) == pytest.approx(THIGH + SHANK, rel=1e-5)


@given(st.floats(0.0, 2.8), st.floats(-3, 3))
def test_a_leg_that_need_not_move_does_not(flexion, heading):
    leg = bent_leg(flexion, heading=heading)
    solved = solve(leg, leg.hip, leg.ankle)
    assert solved.thigh == pytest.approx(np.eye(4)[None], abs=1e-6)
    assert solved.shank == pytest.approx(np.eye(4)[None], abs=1e-6)


@given(st.floats(0.05, 2.0), st.floats(-0.3, 0.1), st.floats(-3, 3))
def test_the_knee_bends_by_the_law_of_cosines_and_stays_on_its_side(flexion, nearer, heading):
    leg = bent_leg(flexion, heading=heading)
    ankle = leg.ankle * (1 + nearer)
    span = min(np.linalg.norm(ankle), (THIGH + SHANK) * (1 - 1e-6))
    joints = solved_joints(leg, solve(leg, leg.hip, ankle))
    cosine = (span**2 - THIGH**2 - SHANK**2) / (2 * THIGH * SHANK)
    assert flexion_of(*joints)[0] == pytest.approx(np.arccos(np.clip(cosine, -1, 1)), abs=2e-3)
    assert np.sum(joints[1] * leg.toward_toes) > 0


def test_a_straight_leg_bends_toward_the_toes():
    leg = bent_leg(0.0, heading=0.7)
    _, knee, _ = solved_joints(leg, solve(leg, leg.hip, leg.ankle * 0.9))
    assert np.sum(knee * leg.toward_toes) > 0.1
    assert abs(np.linalg.det([knee[0, :2], leg.toward_toes[0, :2]])) < 1e-6


def test_a_slightly_overstretched_source_does_not_make_the_knee_flip():
    """Captured knees pass through straight to the wrong side by a degree or two."""
    flexion = np.radians(np.concatenate([np.linspace(30, -2, 40), np.linspace(-2, 30, 40)]))
    leg = bent_leg(flexion, count=80)
    hip, knee, ankle = solved_joints(leg, solve(leg, leg.hip, leg.ankle * 0.97))
    assert np.abs(np.diff(np.degrees(flexion_of(hip, knee, ankle)))).max() < 15
    assert (knee[:, 0] > 0).all()


@pytest.mark.parametrize("overstretched", [-3.0, -7.0, -12.0])
def test_a_knee_that_the_source_overstretches_bends_forward(overstretched):
    """Captured knees are straight to a few degrees, now to this side and now to that; a leg bent by 60° must not be."""
    leg = bent_leg(np.radians([overstretched, 1.0, -1.0, overstretched]), count=4)
    hip, knee, ankle = solved_joints(leg, solve(leg, leg.hip, leg.ankle * 0.85))
    assert (flexion_of(hip, knee, ankle) > np.radians(50)).all()
    assert (knee[:, 0] > 0.15).all()


@settings(max_examples=30)
@given(vectors, vectors)
def test_the_same_body_moved_as_a_whole_keeps_its_pose(shift, turn):
    from softground_addon.core.numerics.rigid import carried, displacement, rotation

    leg = bent_leg(0.6)
    move = displacement(rotation(np.array([turn])), np.zeros((1, 3)), np.array([shift]))
    joints = solved_joints(leg, solve(leg, carried(move, leg.hip), carried(move, leg.ankle)))
    assert flexion_of(*joints) == pytest.approx(flexion_of(leg.hip, leg.knee, leg.ankle), abs=1e-6)


def test_a_nearly_straight_knee_that_is_noise_from_side_to_side_bends_steadily():
    count = 40
    noise = 0.004 * np.where(np.arange(count) % 2, 1.0, -1.0)
    hip, ankle = np.tile((0.0, 0.0, 0.9), (count, 1)), np.zeros((count, 3))
    knee = np.stack([np.full(count, 0.006), noise, np.full(count, 0.45)], axis=-1)
    leg = Leg(hip, knee, ankle, np.tile((1.0, 0.0, 0.0), (count, 1)))
    lower = hip - (0.0, 0.0, 0.05)

    def sway(steady):
        return np.abs(np.diff(carried(solve(leg, lower, ankle, steady).thigh, knee)[5:-5, 1])).max()

    assert sway(3.0) < 0.3 * sway(0.0)
