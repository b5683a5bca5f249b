"""A kick and a dance: feet that stay where they are set, a body over them, forces that legs can bear."""

import numpy as np
import pytest

from sample_scenes.balance import GRAVITY, mass_centre
from sample_scenes.body import SIDES, Body, Foot
from sample_scenes.motion import joint_paths
from sample_scenes.showpieces import BEAT, dance, kick
from tests.scenes.estimates import loads_in_blender, vertical_in_body_weights
from tests.scenes.kinematics import knee_flexion, largest_slide, sole_points

RATE = 120.0
BODIES = {"average": Body(), "child": Body(1.15, 21.0, Foot(0.18, 0.07)), "giant": Body(2.6, 240.0, Foot(0.42, 0.15))}
MOVES = {"kick": (kick, 300), "dance": (dance, 960)}


@pytest.fixture(params=BODIES)
def body(request):
    return BODIES[request.param]


@pytest.fixture(params=MOVES)
def motion(request, body):
    move, frames = MOVES[request.param]
    return move(body, frames, RATE)


def test_feet_stay_where_they_are_set_and_out_of_the_ground(body, motion):
    assert largest_slide(body, motion) < 1e-3
    for points in sole_points(body, motion).values():
        assert min(path[:, 2].min() for path in points.values()) > -0.004 * body.stature


def test_the_forces_are_those_of_somebody_who_stays_on_the_ground(body, motion):
    height = mass_centre(body, motion)[:, 2]
    force = 1 + np.diff(height, 2) * RATE**2 / GRAVITY
    assert force.mean() == pytest.approx(1.0, abs=0.01)
    assert force.min() > 0.3
    assert force.max() < 1.9


def test_the_body_is_over_its_feet(body, motion):
    centre = mass_centre(body, motion)
    times = np.arange(len(centre)) / RATE
    for frame in range(30, len(centre) - 30, 10):
        down = [f.place[:2] for f in motion.footfalls if f.strike <= times[frame] <= f.leave]
        assert down
        distance = min(np.linalg.norm(centre[frame, :2] - place) for place in down)
        assert distance < 0.36 * body.leg_length


def test_knees_never_bend_the_wrong_way_nor_jump(body, motion):
    for side in SIDES:
        flexion = knee_flexion(motion, side)
        assert flexion.min() > 2.0
        assert np.abs(np.diff(flexion)).max() * RATE < 1400.0


def test_the_kick_reaches_the_height_of_the_chest(body):
    motion = kick(body, 300, RATE)
    paths = joint_paths(body, motion)
    foot = paths["ankle.R"][:, 2]
    assert foot.max() > 1.0 * body.leg_length
    assert 0.9 < foot.argmax() / RATE < 1.4
    assert paths["ankle.R"][foot.argmax(), 0] > 0.6 * body.leg_length


def test_the_dance_steps_on_the_beat_with_either_foot():
    falls = [fall for fall in dance(Body(), 192).footfalls if fall.strike > 0]
    assert {fall.side for fall in falls} == {"L", "R"}
    assert len(falls) >= 15
    for fall in falls:
        assert fall.strike / BEAT == pytest.approx(round(fall.strike / BEAT), abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("move", "frames", "steps"), [(kick, 150, [1, 2]), (dance, 480, [9, 9])])
def test_the_add_on_finds_every_step_and_one_body_weight(scene, move, frames, steps):
    loads = loads_in_blender(scene, Body(), move(Body(), frames, 60.0))
    down = loads.contacts.touching
    assert (down[0] + (down[1:] & ~down[:-1]).sum(axis=0)).tolist() == steps
    assert vertical_in_body_weights(loads).sum(axis=1).mean() == pytest.approx(1.0, abs=0.02)
