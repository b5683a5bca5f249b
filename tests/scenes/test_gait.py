"""A believable walk: feet planted, hips on an inverted pendulum, knees that bend one way."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sample_scenes.body import SIDES, Body, Foot
from sample_scenes.gait import Gait, walk
from sample_scenes.motion import joint_paths, rotation
from tests.scenes.kinematics import knee_flexion, largest_slide, sole_points

RATE = 120.0

BODIES = {
    "average": Body(),
    "child": Body(stature=1.15, mass=21.0, foot=Foot(0.18, 0.07)),
    "giant": Body(stature=2.6, mass=240.0, foot=Foot(0.42, 0.15)),
}
GAITS = {"stroll": Gait(speed=0.9), "walk": Gait(), "brisk": Gait(speed=1.6)}


def scaled(gait, body):
    """The same gait at the speed that suits a body's legs (equal Froude number)."""
    return dataclasses.replace(gait, speed=gait.speed * (body.leg_length / Body().leg_length) ** 0.5)


@pytest.fixture(params=BODIES)
def body(request):
    return BODIES[request.param]


@pytest.fixture(params=GAITS)
def gait(request, body):
    return scaled(GAITS[request.param], body)


def test_planted_points_of_the_sole_do_not_slide(body, gait):
    assert largest_slide(body, walk(body, gait, 300, RATE)) < 1e-3


def test_no_part_of_a_sole_goes_below_the_ground(body, gait):
    motion = walk(body, gait, 300, RATE)
    for points in sole_points(body, motion).values():
        assert min(path[:, 2].min() for path in points.values()) > -1e-3


def test_a_foot_touches_the_ground_exactly_during_its_footfalls(body, gait):
    motion = walk(body, gait, 300, RATE)
    times = np.arange(300) / RATE
    for side, points in sole_points(body, motion).items():
        lowest = np.min([path[:, 2] for path in points.values()], axis=0)
        expected = np.zeros(300, dtype=bool)
        for fall in motion.footfalls:
            expected |= (fall.side == side) & (times > fall.strike) & (times < fall.leave)
        edge = (
            np.convolve(
                np.abs(np.diff(expected.astype(int), prepend=expected[0])),
                np.ones(2 * round(0.05 * gait.stride_time(body) * RATE) + 1),
                "same",
            )
            > 0
        )
        assert (lowest[expected] < 1e-5).all()
        assert (lowest[~expected & ~edge] > 1e-3).all()


def test_footfalls_alternate_and_lie_a_step_apart(body, gait):
    falls = sorted(walk(body, gait, 600, RATE).footfalls, key=lambda fall: fall.strike)
    assert all(a.side != b.side for a, b in pairwise(falls))
    steps = np.diff([fall.place[0] for fall in falls])
    assert steps == pytest.approx(gait.step_length(body), rel=1e-9)


def test_knees_bend_backward_only_and_never_snap_straight(body, gait):
    motion = walk(body, gait, 300, RATE)
    for side in SIDES:
        flexion = knee_flexion(motion, side)
        assert flexion.min() > 0.0
        assert flexion.max() < 90.0
        slowness = (body.leg_length / Body().leg_length) ** 0.5
        assert np.diff(flexion).min() * RATE * slowness > -600.0  # deg/s; measured walking reaches -400


def test_bones_keep_their_length_so_the_leg_reaches_the_ankle(body, gait):
    motion = walk(body, gait, 200, RATE)
    paths = joint_paths(body, motion)
    for side in SIDES:
        # The foot's pose was chosen first; forward kinematics must land on it.
        bottom = paths[f"ankle.{side}"] + motion.turns[f"foot.{side}"] @ (0, 0, -body.foot.ankle_height)
        planted = [fall for fall in motion.footfalls if fall.side == side]
        times = np.arange(200) / RATE
        for fall in planted:
            middle = fall.strike + 0.3 * (fall.leave - fall.strike)
            if 0 < middle < times[-1]:
                i = round(middle * RATE)
                assert bottom[i] == pytest.approx(fall.place, abs=1e-6)


def test_left_and_right_are_mirror_images_half_a_stride_apart():
    body = Body()
    gait = Gait(speed=1.2)
    stride = gait.stride_time(body)
    rate = 100 / stride  # a whole number of frames in half a stride
    motion = walk(body, gait, 201, rate, start_phase=0.0)
    mirror = np.diag((1.0, -1.0, 1.0))
    for bone, turns in motion.turns.items():
        other = bone[:-1] + {"L": "R", "R": "L"}.get(bone[-1], bone[-1])
        assert motion.turns[other][50:] == pytest.approx((mirror @ turns @ mirror)[:-50], abs=1e-9)
    assert motion.hips[50:, 1:] == pytest.approx(motion.hips[:-50, 1:] * (-1, 1), abs=1e-9)


def test_the_hips_repeat_every_stride_and_advance_at_the_gaits_speed():
    body, gait = Body(), Gait()
    rate = 90 / gait.stride_time(body)
    motion = walk(body, gait, 271, rate)
    advance = motion.hips[90:] - motion.hips[:-90]
    assert advance == pytest.approx(
        np.broadcast_to((gait.speed * gait.stride_time(body), 0, 0), advance.shape), abs=1e-9
    )


def test_hips_ride_two_to_five_centimetres_and_stand_highest_in_single_support():
    body, gait = Body(), Gait()
    stride = gait.stride_time(body)
    rate = 200 / stride
    motion = walk(body, gait, 401, rate, start_phase=0.0)
    height = motion.hips[:200, 2]
    assert 0.02 < np.ptp(height) < 0.05
    support = np.zeros((400, 2), dtype=bool)
    times = np.arange(400) / rate
    for fall in motion.footfalls:
        support[:, "LR".index(fall.side)] |= (times >= fall.strike) & (times < fall.leave)
    assert support[height.argmax()].sum() == 1
    assert support[height.argmin()].sum() == 2


def test_mean_acceleration_over_a_stride_is_zero_so_mean_force_is_body_weight():
    body, gait = Body(), Gait()
    rate = 240 / gait.stride_time(body)
    height = walk(body, gait, 481, rate).hips[:, 2]
    acceleration = (height[2:] - 2 * height[1:-1] + height[:-2]) * rate**2
    assert acceleration[:240].mean() == pytest.approx(0.0, abs=1e-3)
    assert acceleration.min() > -9.81 * 0.6  # walking never comes near flight
    assert acceleration.max() < 9.81 * 0.6


def test_the_poses_do_not_depend_on_the_frame_rate():
    body, gait = Body(), Gait()
    slow, fast = walk(body, gait, 49, 24.0), walk(body, gait, 241, 120.0)
    assert fast.hips[::5] == pytest.approx(slow.hips, abs=1e-12)
    for bone in slow.turns:
        assert fast.turns[bone][::5] == pytest.approx(slow.turns[bone], abs=1e-9)


@settings(max_examples=30)
@given(
    speed=st.floats(0.7, 1.8),
    stature=st.floats(1.0, 2.5),
    step_width=st.floats(0.0, 0.25),
    toe_out=st.floats(-5, 25),
)
@pytest.mark.slow
def test_any_sensible_walk_keeps_its_legs_within_reach(speed, stature, step_width, toe_out):
    body = Body(stature=stature, foot=Foot(0.157 * stature, 0.055 * stature))
    gait = Gait(
        speed=speed * (body.leg_length / Body().leg_length) ** 0.5,
        step_width=step_width * stature,
        toe_out=toe_out,
    )
    motion = walk(body, gait, 150, 60.0)
    paths = joint_paths(body, motion)
    for side in SIDES:
        leg = np.linalg.norm(paths[f"hip.{side}"] - paths[f"ankle.{side}"], axis=1)
        assert leg.max() < body.thigh + body.shin
    for points in sole_points(body, motion).values():
        assert min(path[:, 2].min() for path in points.values()) > -2e-3


def test_rotations_are_right_handed():
    quarter = np.array(np.pi / 2)
    assert rotation("z", quarter) @ (1, 0, 0) == pytest.approx((0, 1, 0), abs=1e-12)
    assert rotation("x", quarter) @ (0, 1, 0) == pytest.approx((0, 0, 1), abs=1e-12)
    assert rotation("y", quarter) @ (0, 0, 1) == pytest.approx((1, 0, 0), abs=1e-12)
