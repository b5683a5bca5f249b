"""Moving ground pushes bodies as mechanics in a frame that moves says."""

import numpy as np
import pytest

from softground_addon.core.motion.ground_ride import GroundRide

RATE, GRAVITY, UP = 24.0, 9.81, np.array([0.0, 0.0, 1.0])
FRAMES = np.arange(1.0, 193.0)
TIMES = (FRAMES - 1) / RATE
INNER = slice(24, -24)


def ride(turn=None, place=None):
    to_world = np.tile(np.eye(4), (len(FRAMES), 1, 1))
    if turn is not None:
        to_world[:, :3, :3] = turn
    if place is not None:
        to_world[:, :3, 3] = place
    return GroundRide.of(FRAMES, to_world.astype(np.float32).astype(float), RATE, UP, GRAVITY)


def about_y(angle):
    turn = np.zeros((len(angle), 3, 3))
    turn[:, 0, 0] = turn[:, 2, 2] = np.cos(angle)
    turn[:, 0, 2], turn[:, 2, 0], turn[:, 1, 1] = np.sin(angle), -np.sin(angle), 1.0
    return turn


def upward(of, centre=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0)):
    shape = (len(FRAMES), 3)
    return of.upward(FRAMES, np.broadcast_to(centre, shape), np.broadcast_to(velocity, shape))


def test_even_motion_asks_for_nothing_to_the_last_bit():
    sailing = ride(place=np.array((300.0, 20.0, 1.0)) + np.outer(TIMES, (7.3, -1.1, 0.2)))
    assert (upward(sailing, (3.0, 2.0, 1.0), (1.0, 1.0, 0.0)) == UP).all()


def test_a_lift_that_speeds_up_makes_heavier():
    lift = ride(place=np.outer(TIMES**2, (0.0, 0.0, 1.0)))
    assert upward(lift)[INNER] == pytest.approx(np.tile((0.0, 0.0, 1 + 2 / GRAVITY), (144, 1)), abs=1e-4)


def test_a_deck_that_rolls_pulls_and_throws_as_mechanics_says():
    swing, rate, height = 0.15, 2 * np.pi / 5.0, 4.0
    angle, spin = swing * np.sin(rate * TIMES), swing * rate * np.cos(rate * TIMES)
    gain = -(rate**2) * angle
    asked = upward(ride(turn=about_y(angle)), (0.0, 0.0, height))
    # Gravity in the axes of the deck; at a height above its axis, which turns by `spin`, tangential and centripetal.
    along = -np.sin(angle) + gain * height / GRAVITY
    away = np.cos(angle) - spin**2 * height / GRAVITY
    assert asked[INNER, 0] == pytest.approx(along[INNER], abs=1e-4)
    assert asked[INNER, 2] == pytest.approx(away[INNER], abs=1e-4)


def test_who_walks_on_a_carousel_feels_centripetal_and_coriolis_acceleration():
    spin, radius, speed = 0.8, 3.0, 1.2
    turn = np.zeros((len(FRAMES), 3, 3))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(spin * TIMES)
    turn[:, 1, 0], turn[:, 0, 1], turn[:, 2, 2] = np.sin(spin * TIMES), -np.sin(spin * TIMES), 1.0
    asked = upward(ride(turn=turn), (radius, 0.0, 0.0), (0.0, speed, 0.0))[INNER] * GRAVITY
    assert asked[:, 0] == pytest.approx(np.full(144, -(spin**2) * radius - 2 * spin * speed), abs=2e-3)
    assert asked[:, 1] == pytest.approx(np.zeros(144), abs=2e-3)
