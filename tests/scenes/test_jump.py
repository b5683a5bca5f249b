"""A believable jump: it falls freely in the air, and the legs push and land with what people's do."""

import numpy as np
import pytest

from sample_scenes.balance import GRAVITY, mass_centre
from sample_scenes.body import SIDES, Body, Foot
from sample_scenes.jump import Jump, jump
from tests.scenes.estimates import loads_in_blender, vertical_in_body_weights
from tests.scenes.kinematics import knee_flexion, largest_slide, sole_points

RATE = 240.0
BODIES = {"average": Body(), "child": Body(1.15, 21.0, Foot(0.18, 0.07)), "giant": Body(2.6, 240.0, Foot(0.42, 0.15))}
JUMPS = {"up": Jump(), "high": Jump(height=0.45), "far": Jump(distance=1.0, height=0.28)}


@pytest.fixture(params=BODIES)
def body(request):
    return BODIES[request.param]


@pytest.mark.parametrize("gait", JUMPS.values(), ids=JUMPS.keys())
class TestOfABody:
    def test_the_flight_is_a_parabola_of_the_given_height_and_the_rest_is_borne(self, body, gait):
        gait = Jump(height=gait.height * body.stature / 1.78, distance=gait.distance * body.stature / 1.78)
        centre = mass_centre(body, jump(body, gait, frame_rate=RATE))
        force = 1 + np.diff(centre[:, 2], 2) * RATE**2 / GRAVITY
        times = np.arange(1, len(centre) - 1) / RATE
        _, leave, land, _, _ = gait.timing(body)
        flying = (times > leave + 0.01) & (times < land - 0.01)
        assert np.abs(force[flying]).max() < 1e-3
        rise = centre[:, 2].max() - centre[round(leave * RATE), 2]
        assert rise == pytest.approx(gait.height, abs=0.012)
        assert force.min() > -0.02
        assert force.mean() == pytest.approx(1.0, abs=0.005)
        assert 2.0 < force[times < leave].max() < 3.2
        assert 2.0 < force[times > land].max() < 4.0

    def test_feet_stay_where_they_stand_and_land_where_they_shall(self, body, gait):
        motion = jump(body, gait, frame_rate=RATE)
        assert largest_slide(body, motion) < 1e-3
        for points in sole_points(body, motion).values():
            assert min(path[:, 2].min() for path in points.values()) > -3e-3
        for side in SIDES:
            start, end = (fall for fall in motion.footfalls if fall.side == side)
            assert end.place[0] - start.place[0] == pytest.approx(gait.distance)
            assert knee_flexion(motion, side).min() > 0.0


def test_the_landing_is_on_the_toes_first():
    body, gait = Body(), Jump()
    motion = jump(body, gait, frame_rate=RATE)
    _, _, land, _, _ = gait.timing(body)
    points = sole_points(body, motion)["L"]
    frame = round(land * RATE) + 1
    assert points["toe"][frame, 2] < 2e-3
    assert points["heel"][frame, 2] > 0.02


def test_the_add_on_finds_the_flight_and_the_landing(scene):
    body, gait = Body(), Jump()
    loads = loads_in_blender(scene, body, jump(body, gait, frame_rate=60.0))
    total = vertical_in_body_weights(loads).sum(axis=1)
    rate = 1 / loads.motion.time_step
    assert (total == 0).sum() / rate == pytest.approx(gait.flight_time(body), abs=0.06)
    assert total[: round(0.4 * rate)].mean() == pytest.approx(1.0, abs=0.05)
    height = mass_centre(body, jump(body, gait, frame_rate=RATE))[:, 2]
    assert total.max() == pytest.approx(1 + np.diff(height, 2).max() * RATE**2 / GRAVITY, rel=0.15)
