"""Forces on things without a skeleton: momentum, flight and rest, at any frame rate."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.terrain import MeshTerrain
from softground_addon.core.loads.estimate import estimate_loads
from softground_addon.core.loads.free_bodies import SHORTEST_CONTACT
from softground_addon.core.motion.motion import CharacterMotion
from softground_addon.core.motion.props import mass_properties
from softground_addon.core.motion.sole_motion import SoleMotion
from tests.core.prop_bodies import box, prop_sole, sphere
from tests.core.walkers import pose, pressed

GRAVITY = 9.81
RADIUS = 0.25
BALL = prop_sole(*sphere(RADIUS, rings=32), name="ball")
MATERIAL = GroundMaterial(1e6, 0.25, 0.2)
MODELS = ("WHOLE_BODY", "IMPULSE")


def thing(path, frame_rate, *, sole=BALL, mass=50.0, turn=None):
    """A body whose middle follows a path (F, 3)."""
    poses = pose(path)
    if turn is not None:
        poses[:, :3, :3] = turn
    frames = 1.0 + np.arange(len(path))
    motions = (SoleMotion(sole, poses[:, None]),)
    return CharacterMotion("thing", mass, sole.prop.size, frames, frame_rate, motions, gravity=GRAVITY, centre=path)


def dropped(frame_rate, *, height=2.5, start=0.3, seconds=2.0, bounce=0.0, mass=50.0):
    """A ball let go at a height, which stops on the ground from one frame to the next or bounces once."""
    time = np.arange(round(seconds * frame_rate) + 1) / frame_rate
    landing = start + np.sqrt(2 * height / GRAVITY)
    since = time - landing
    back = bounce * np.sqrt(2 * GRAVITY * height)
    falling = height - GRAVITY * np.maximum(time - start, 0) ** 2 / 2
    z = np.where(since < 0, falling, np.maximum(back * since - GRAVITY * since**2 / 2, 0.0))
    return thing(np.stack([0.1 + 0 * z, 0 * z, z + RADIUS], -1), frame_rate, mass=mass)


def loads(motion, model="WHOLE_BODY", terrain=None):
    return estimate_loads(motion, terrain or FlatTerrain(), force_model=model, material=MATERIAL)


def impulse_beyond_weight(of_thing):
    weight = of_thing.motion.mass * GRAVITY * of_thing.contacts.touching[:, 0]
    return float((of_thing.forces.total[:, 2] - weight).sum() * of_thing.motion.time_step)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("frame_rate", [24, 25, 30, 60, 120])
def test_a_drop_ends_in_the_papers_force_and_then_in_the_weight(frame_rate, model):
    estimated = loads(dropped(frame_rate), model)
    speed = np.sqrt(2 * GRAVITY * 2.5)
    force = estimated.forces.total[:, 2]
    assert force.max() == pytest.approx(50 * (GRAVITY + speed / MATERIAL.characteristic_time), rel=1e-6)
    assert impulse_beyond_weight(estimated) == pytest.approx(50 * speed, rel=1e-6)
    assert force[-1] == pytest.approx(50 * GRAVITY, rel=1e-9)
    assert (force[~estimated.contacts.touching[:, 0]] == 0).all()


def test_a_crater_is_the_same_at_any_frame_rate():
    depths = [pressed(loads(dropped(rate)), MATERIAL)[1][0].max_depth_m for rate in (24, 30, 60, 120)]
    assert depths == pytest.approx(np.full(4, depths[0]), rel=1e-3)


def test_flight_is_exactly_without_force_and_a_bounce_keeps_the_momentum():
    for frame_rate in (24, 30, 60, 120):
        estimated = loads(dropped(frame_rate, bounce=0.5, seconds=1.6))
        speed = np.sqrt(2 * GRAVITY * 2.5)
        touching = estimated.contacts.touching[:, 0]
        landing = 0.3 + np.sqrt(5 / GRAVITY)
        airborne = (estimated.motion.times < landing - 0.05) | (
            estimated.motion.times > landing + SHORTEST_CONTACT + 0.05
        )
        assert not touching[airborne].any()
        assert (estimated.forces.total[airborne] == 0).all()
        # From falling at v to rising at v/2; the weight counts for the moment of contact.
        assert impulse_beyond_weight(estimated) == pytest.approx(50 * 1.5 * speed, rel=0.07), frame_rate


@settings(max_examples=10)
@given(height=st.floats(0.3, 5.0), mass=st.floats(0.1, 1e4), frame_rate=st.sampled_from([24, 30, 60]))
def test_a_landing_keeps_the_momentum_of_any_fall(height, mass, frame_rate):
    estimated = loads(dropped(frame_rate, height=height, mass=mass, seconds=2.5))
    assert impulse_beyond_weight(estimated) == pytest.approx(mass * np.sqrt(2 * GRAVITY * height), rel=0.015)


def test_a_stop_over_several_frames_keeps_the_momentum_too():
    frame_rate, speed, stop = 60, 2.0, 0.25
    time = np.arange(2 * frame_rate) / frame_rate
    since = time - 0.5
    # It meets the ground at 2 m/s and is slowed down evenly, sinking into it as it was animated to.
    slowing = np.where(since < stop, speed * since - speed / stop * since**2 / 2, speed * stop / 2)
    z = np.where(since < 0, -speed * since, -slowing)
    estimated = loads(thing(np.stack([0 * z, 0 * z, z + RADIUS], -1), frame_rate))
    assert impulse_beyond_weight(estimated) == pytest.approx(50 * speed, rel=0.02)


def test_a_body_that_rests_from_the_beginning_feels_its_weight_throughout():
    estimated = loads(thing(np.tile([0.0, 0.0, RADIUS], (30, 1)), 24))
    assert estimated.forces.total == pytest.approx(np.tile([0, 0, 50 * GRAVITY], (len(estimated.forces.total), 1)))


@pytest.mark.parametrize("above", [-0.02, 0.02])
def test_a_ball_that_is_animated_a_little_above_or_in_the_ground_rests_on_it_all_the_same(above):
    time = np.arange(49) / 24
    path = np.stack([time, 0 * time, 0 * time + RADIUS + above], -1)
    estimated = loads(thing(path, 24))
    assert estimated.contacts.touching.all()
    assert estimated.contacts.offset == pytest.approx([above], abs=1e-3)


def test_a_thing_that_hovers_or_flies_past_leaves_nothing():
    time = np.arange(49) / 24
    estimated = loads(thing(np.stack([time, 0 * time, 0 * time + 1.0], -1), 24))
    assert not estimated.contacts.touching.any()
    assert (estimated.forces.forces == 0).all()


def test_a_ball_on_a_slope_is_carried_where_it_touches():
    corners = np.array([[-5.0, -5, -2.5], [5, -5, 2.5], [5, 5, 2.5], [-5, 5, -2.5]])
    slope = MeshTerrain.from_mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    normal = np.array([-0.5, 0, 1]) / np.sqrt(1.25)
    estimated = loads(thing(np.tile(RADIUS * normal, (30, 1)), 24), terrain=slope)
    assert estimated.contacts.touching.all()
    assert estimated.contacts.normal[0, 0] == pytest.approx(normal)
    assert estimated.forces.centre_of_pressure[0, 0, 0] == pytest.approx(0.0, abs=0.03)


def test_two_wheels_share_the_weight_by_where_the_mass_is():
    frames = np.arange(30)
    wheels = []
    for x in (-0.5, 0.7):
        poses = pose(np.tile([x, 0.0, RADIUS], (len(frames), 1)))
        wheels.append(SoleMotion(BALL, poses[:, None]))
    centre = np.tile([0.0, 0.0, 0.8], (len(frames), 1))
    bicycle = CharacterMotion("bicycle", 80.0, 0.5, 1.0 + frames, 24, tuple(wheels), gravity=GRAVITY, centre=centre)
    vertical = loads(bicycle).forces.forces[-1, :, 2]
    assert vertical == pytest.approx(80 * GRAVITY * np.array([0.7, 0.5]) / 1.2, rel=1e-3)


def test_volume_and_centre_of_closed_bodies():
    vertices, triangles = box(0.2, 0.3, 0.5)
    properties = mass_properties(vertices + np.array([1.0, 2.0, 3.0]), triangles)
    assert properties.volume == pytest.approx(0.03)
    assert properties.centre == pytest.approx([1, 2, 3])
    inside_out = mass_properties(vertices + np.array([1.0, 2.0, 3.0]), triangles[:, ::-1])
    assert (inside_out.volume, *inside_out.centre) == pytest.approx((0.03, 1, 2, 3))
    ball = mass_properties(*sphere(0.5))
    assert ball.volume == pytest.approx(4 / 3 * np.pi * 0.5**3, rel=0.002)
    sheet = mass_properties(np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]]))
    assert (sheet.volume, *sheet.centre) == pytest.approx((0, 0.5, 0.5, 0))
