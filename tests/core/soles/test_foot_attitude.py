"""How a foot stands is found from when it stands."""

import numpy as np
import pytest

from softground_addon.core.soles.foot_attitude import (
    FlatFoot,
    ends_in_toes,
    flat_foot,
    foot_size,
    planted_instants,
    reflection,
    standing_up,
    typical_direction,
)
from softground_addon.core.soles.soles import ANKLE_POSITION, BALL_POSITION

RATE = 60.0


def pitch(angle):
    """Rotation about y, toes down for positive angles; (F, 3, 3)."""
    angle = np.atleast_1d(angle)
    c, s = np.cos(angle), np.sin(angle)
    zero, ones = np.zeros_like(c), np.ones_like(c)
    return np.stack([np.stack([c, zero, s], -1), np.stack([zero, ones, zero], -1), np.stack([-s, zero, c], -1)], -2)


def stepping(cycles=4, stance=36, swing=24):
    """A foot that stands, lifts its heel, swings and lands; path of ankle and ball, and the truth."""
    path, stands = [], []
    ball = np.array([0.13, 0.0, 0.03])
    for _ in range(cycles):
        path += [ball] * stance
        stands += [True] * stance
        for u in (np.arange(swing) + 1) / (swing + 1):
            path.append(ball + np.array((0.8 * u, 0, 0.15 * np.sin(np.pi * u))))
            stands.append(False)
        ball = ball + np.array((0.8, 0, 0))
    ball = np.array(path)
    return np.stack([ball + np.array((-0.13, 0, 0.06)), ball], axis=1), np.array(stands)


def test_a_walking_foot_is_planted_only_while_it_stands():
    path, stands = stepping()
    (planted,) = planted_instants([path], frame_rate=RATE, leg_length=0.9)
    assert not (planted & ~stands).any()
    assert planted.sum() > 0  # the ankle and the ball stand exactly still, so most of it is one held pose


def test_a_still_foot_in_the_air_is_not_planted():
    standing = np.tile([[[0.0, 0, 0.09], [0.13, 0, 0.03]]], (300, 1, 1))
    standing[:, :, 0] += 1e-4 * np.sin(np.arange(300))[:, None]  # nobody stands like a stone
    lifted = standing + np.array((0.0, 0.2, 0.4))
    down, up = planted_instants([standing, lifted], frame_rate=RATE, leg_length=0.9)
    assert down.mean() > 0.95
    assert not up.any()


def test_a_foot_that_is_down_for_a_few_frames_of_a_sprint_is_planted_in_them():
    path, stands = stepping(cycles=1, stance=6, swing=14)
    path[..., 0] += 1e-3 * (np.arange(len(path))[:, None] + 5.0) ** 2  # never still: it slides, ever faster
    other = path[::-1] + np.array((0, 0.2, 0))
    for planted, down in zip(
        planted_instants([path, other], frame_rate=RATE, leg_length=0.9), (stands, stands[::-1]), strict=True
    ):
        assert planted.sum() >= 3
        assert not (planted & ~down).any()


@pytest.mark.parametrize("scale", [0.05, 1.0, 20.0])
def test_being_planted_does_not_depend_on_size(scale):
    path, _ = stepping()
    path = path + 1e-4 * np.sin(np.arange(len(path)))[:, None, None]
    (reference,) = planted_instants([path], frame_rate=RATE, leg_length=0.9)
    (scaled,) = planted_instants([path * scale], frame_rate=RATE / np.sqrt(scale), leg_length=0.9 * scale)
    assert (reference != scaled).mean() < 0.1  # only the window over which the floor is sought has a length in seconds


def test_frames_beyond_the_last_key_do_not_outvote_the_motion():
    path, stands = stepping()
    path = path + 1e-4 * np.sin(np.arange(len(path)))[:, None, None]
    held = np.concatenate([path, np.tile(path[-12:-11], (500, 1, 1))])
    (planted,) = planted_instants([held], frame_rate=RATE, leg_length=0.9)
    assert not planted[len(path) + 1 :].any()
    assert (planted[: len(path)] & stands).sum() > 50


def test_the_typical_direction_ignores_a_third_of_outliers():
    rng = np.random.default_rng(3)
    good = np.array((0.1, -0.2, 1.0)) + 0.03 * rng.normal(size=(60, 3))
    bad = np.array((1.0, 0.3, 0.4)) + 0.1 * rng.normal(size=(30, 3))
    samples = np.concatenate([good, bad])
    samples /= np.linalg.norm(samples, axis=1, keepdims=True)
    truth = np.array((0.1, -0.2, 1.0)) / np.linalg.norm((0.1, -0.2, 1.0))
    assert np.degrees(np.arccos(typical_direction(samples) @ truth)) < 3
    assert typical_direction(np.empty((0, 3))) is None


def test_the_attitude_of_a_tilted_rest_pose_comes_from_the_planted_instants():
    tilt = np.radians(35)
    turns = pitch(np.full(20, tilt) + np.radians(np.linspace(-3, 3, 20)))
    truth = pitch(tilt)[0, 2]
    assert np.degrees(np.arccos(np.clip(standing_up(turns) @ truth, -1, 1))) < 1
    np.testing.assert_allclose(standing_up(np.empty((0, 3, 3))), (0, 0, 1))
    np.testing.assert_allclose(standing_up(pitch(np.radians([4.0, 4, 4])), trust_rest_within=np.radians(10)), (0, 0, 1))


def test_the_other_foot_lends_its_attitude_unless_it_contradicts():
    nothing = np.empty((0, 3, 3))
    roll = np.radians(25)
    image = np.tile(np.array([[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]]), (9, 1, 1))
    mirror = reflection(np.array((0.0, 0.2, 0.0)))
    lent = standing_up(nothing, [image @ mirror])
    np.testing.assert_allclose(lent, image[0, 2] * (1, -1, 1), atol=1e-12)
    pitches = pitch(np.full(9, np.radians(-30)))
    np.testing.assert_allclose(standing_up(pitches, [image @ mirror]), pitches[0, 2], atol=1e-12)


def test_both_frames_of_a_flat_foot_coincide_when_it_stands():
    ankle, ball = np.array((0.2, 0.1, 0.3)), np.array((0.28, 0.12, 0.18))
    foot_turn, toe_turn = pitch(np.radians(-40))[0], pitch(np.radians(-15))[0]
    flat = flat_foot(
        ankle,
        ball,
        ball - ankle,
        foot_up=foot_turn[2],
        toe_up=toe_turn[2],
        toe_turns=(toe_turn.T @ foot_turn)[None],
    )
    # put both bones into the standing pose, joined at the ball
    foot_pose = np.eye(4)
    foot_pose[:3, :3] = foot_turn
    toe_pose = np.eye(4)
    toe_pose[:3, :3] = toe_turn
    toe_pose[:3, 3] = foot_turn @ ball - toe_turn @ ball
    np.testing.assert_allclose(foot_pose @ flat.foot_frame, toe_pose @ flat.toe_frame, atol=1e-12)
    np.testing.assert_allclose((foot_pose @ flat.foot_frame)[:3, 2], (0, 0, 1), atol=1e-12)
    assert flat.ball == pytest.approx(((foot_turn @ (ball - ankle))[:2] ** 2).sum() ** 0.5)


def flat_at(ball):
    return FlatFoot(np.eye(4), np.eye(4), ball)


def test_foot_length_follows_the_toe_tip_and_distrusts_made_up_ones():
    ball = np.array(((BALL_POSITION - ANKLE_POSITION) * 0.27, 0, -0.07))
    tip = np.array(((1 - ANKLE_POSITION) * 0.26, 0, -0.07))
    true = foot_size(flat_at(ball[0]), ankle_tip=tip, ball=ball, leg=0.9)
    assert true.length == pytest.approx(0.26)
    assert true.ankle_height == pytest.approx(0.07)
    made_up = foot_size(flat_at(ball[0]), ankle_tip=tip * (5, 1, 1), ball=ball, leg=0.9)
    assert made_up.length == pytest.approx(0.27)


@pytest.mark.parametrize("reach", [BALL_POSITION - ANKLE_POSITION, 1 - ANKLE_POSITION])
def test_a_foot_bone_may_end_at_the_ball_or_at_the_toes(reach):
    size = foot_size(flat_at(0.1), ankle_tip=np.array((reach * 0.28, 0, -0.07)), ball=None, leg=0.9)
    assert size.length == pytest.approx(0.28)


def test_stubs_take_the_size_that_fits_the_leg():
    size = foot_size(flat_at(0.0), ankle_tip=np.array((0.001, 0, 0)), ball=None, leg=0.884)
    assert size.length == pytest.approx(0.2737, rel=0.01)
    assert 0.05 < size.ankle_height < 0.1


@pytest.mark.parametrize(
    ("tip", "is_toe"),
    [
        ((0.2, 0.0, -0.05), True),  # straight ahead
        ((0.15, -0.03, -0.02), True),  # on the great toe, with the ball on the outer side
        ((0.15, 0.0, 0.3), True),  # heights do not matter
        ((0.12, 0.0, -0.07), False),  # a stub
        ((0.6, 0.0, -0.07), False),  # made up by an importer
        ((-0.1, 0.0, -0.07), False),
        ((0.0, 0.0, 0.2), False),
    ],
)
def test_a_tip_tells_where_a_foot_points_if_toes_end_there(tip, is_toe):
    ankle, ball = np.zeros(3), np.array((0.11, 0.04, -0.07))
    assert ends_in_toes(ankle, ball, np.array(tip), np.array((0.0, 0.0, 1.0))) == is_toe
