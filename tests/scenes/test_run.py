"""A believable run: flights that fall freely, forces as measured on runners, feet that stay where they land."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sample_scenes.balance import GRAVITY, mass_centre, stance_force
from sample_scenes.body import SIDES, Body, Foot
from sample_scenes.motion import joint_paths
from sample_scenes.run import Run, run
from tests.scenes.estimates import loads_in_blender, vertical_in_body_weights, whole_strides
from tests.scenes.kinematics import knee_flexion, largest_slide, sole_points

RATE = 240.0
BODIES = {
    "average": Body(),
    "child": Body(stature=1.15, mass=21.0, foot=Foot(0.18, 0.07)),
    "giant": Body(stature=2.6, mass=240.0, foot=Foot(0.42, 0.15)),
}


@pytest.fixture(params=BODIES)
def body(request):
    return BODIES[request.param]


def at_equal_froude(speed, body):
    return Run(speed=speed * (body.leg_length / Body().leg_length) ** 0.5)


@pytest.mark.parametrize("speed", [2.5, 3.2, 4.5])
def test_in_flight_the_centre_of_mass_falls_freely_and_in_stance_a_leg_bears_two_to_three_body_weights(body, speed):
    gait = at_equal_froude(speed, body)
    motion = run(body, gait, 300, RATE)
    height = mass_centre(body, motion)[:, 2]
    force = 1 + np.diff(height, 2) * RATE**2 / GRAVITY
    times = np.arange(1, 299) / RATE
    edge = 2.5 / RATE
    grounded = np.zeros(len(times), dtype=bool)
    airborne = np.ones(len(times), dtype=bool)
    for fall in motion.footfalls:
        grounded |= (times > fall.strike + edge) & (times < fall.leave - edge)
        airborne &= (times < fall.strike - edge) | (times > fall.leave + edge)
    assert airborne.sum() > 20
    assert np.abs(force[airborne]).max() < 0.02
    assert force[grounded].min() > 0.05
    assert force.max() == pytest.approx(gait.peak_force(body), rel=0.01)
    assert 2.0 < force.max() < 3.3


def test_contact_and_cadence_are_those_of_measured_runners():
    body = Body()
    # Contacts of 0.25 s at 3 m/s to 0.12 s at 9 (Weyand et al. 2000); 2.7 to 2.9 steps a second (Cavanagh & Kram 1989).
    assert Run(speed=3.0).contact_time(body) == pytest.approx(0.25, abs=0.01)
    assert Run(speed=9.0).contact_time(body) == pytest.approx(0.12, abs=0.01)
    assert 2.6 < 2 / Run(speed=3.0).stride_time(body) < 2.9
    assert Run(speed=4.0).duty_factor(body) < Run(speed=2.5).duty_factor(body) < 0.5


def test_feet_stay_where_they_land_and_never_go_through_the_ground(body):
    motion = run(body, at_equal_froude(3.2, body), 300, RATE)
    assert largest_slide(body, motion) < 1e-3
    for points in sole_points(body, motion).values():
        assert min(path[:, 2].min() for path in points.values()) > -1e-3


def test_the_sole_strikes_with_the_heel_stands_flat_and_leaves_over_the_toes():
    body = Body()
    motion = run(body, Run(), 300, RATE)
    times = np.arange(300) / RATE
    points = sole_points(body, motion)
    fall = next(fall for fall in motion.footfalls if fall.strike > 0.1)

    def heights(part):
        frame = np.abs(times - fall.strike - part * (fall.leave - fall.strike)).argmin()
        return {name: path[frame, 2] for name, path in points[fall.side].items()}

    strike, middle, leave = heights(0.03), heights(0.35), heights(0.97)
    assert strike["heel"] < 1e-4 < strike["ball"]
    assert max(middle.values()) < 1e-4
    assert leave["toe"] < 1e-3 < leave["ball"] < leave["heel"]


def test_knees_bend_backward_only_and_fold_in_swing(body):
    motion = run(body, at_equal_froude(3.2, body), 300, RATE)
    paths = joint_paths(body, motion)
    for side in SIDES:
        flexion = knee_flexion(motion, side)
        assert flexion.min() > 5.0
        assert 85.0 < flexion.max() < 130.0
        leg = np.linalg.norm(paths[f"hip.{side}"] - paths[f"ankle.{side}"], axis=1)
        assert leg.max() < body.thigh + body.shin


def test_hips_advance_at_the_gaits_speed_and_repeat_every_stride():
    body, gait = Body(), Run()
    rate = 90 / gait.stride_time(body)
    hips = run(body, gait, 271, rate).hips
    advance = hips[90:] - hips[:-90]
    assert advance == pytest.approx(
        np.broadcast_to((gait.speed * gait.stride_time(body), 0, 0), advance.shape), abs=1e-6
    )


@pytest.mark.slow
@settings(max_examples=8)
@given(speed=st.floats(2.2, 6.0), stature=st.floats(1.0, 2.5), long_foot=st.floats(0.8, 1.5))
def test_any_sensible_run_keeps_its_feet_down_and_its_knees_bent(speed, stature, long_foot):
    body = Body(stature=stature, foot=Foot(0.157 * stature * long_foot, 0.055 * stature * long_foot))
    motion = run(body, at_equal_froude(speed, body), 120, 120.0)
    assert largest_slide(body, motion) < 1e-3
    for side in SIDES:
        assert knee_flexion(motion, side).min() > 0.0


def test_the_force_of_a_stance_has_mean_one_and_two_humps_for_a_large_shape_factor():
    part = (np.arange(2000) + 0.5) / 2000
    for shape in (0.0, 0.2, 0.5):
        assert stance_force(part, shape).mean() == pytest.approx(1.0, rel=1e-5)
    assert stance_force(np.array([-0.1, 1.1]), 0.3) == pytest.approx(0.0)
    humps = stance_force(part, 0.5)
    assert humps[1000] < 0.9 * humps.max()


def test_the_add_on_finds_the_runs_contacts_and_forces(scene):
    body, gait = Body(), Run()
    motion = run(body, gait, 100, 60.0)
    loads = loads_in_blender(scene, body, motion)
    assert not loads.motion.four_legged
    vertical = vertical_in_body_weights(loads)
    total = vertical.sum(axis=1)
    strides = whole_strides(loads, gait.stride_time(body))
    assert total[strides].mean() == pytest.approx(1.0, abs=0.03)
    assert total[strides].max() == pytest.approx(gait.peak_force(body), rel=0.12)
    flight = (total[strides] == 0).mean()
    assert flight == pytest.approx(1 - 2 * gait.duty_factor(body), abs=0.06)
    assert not (vertical > 0.1).all(axis=1).any()
