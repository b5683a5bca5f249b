"""Walks and runs over hills and round bends: feet on the ground, forces that a body could bear."""

import numpy as np
import pytest

from sample_scenes.balance import GRAVITY, mass_centre
from sample_scenes.body import SIDES, Body
from sample_scenes.course import Course
from sample_scenes.curves import clamped_spline
from sample_scenes.gait import Gait, walk
from sample_scenes.run import Run, run
from sample_scenes.stride import inward_lean
from tests.scenes.kinematics import knee_flexion, largest_slide, sole_points

RATE = 120.0


def hill(x, y):
    """0.9 m high, up to 19 degrees steep."""
    return 0.9 * np.exp(-((x - 4.0) ** 2 + (y - 1.0) ** 2) / (2 * 1.6**2))


OVER_THE_HILL = Course([(0, 0), (3, 0.3), (6, 2), (8, 5)], hill)
MOTIONS = {"walk": (walk, Gait(), 800), "run": (run, Run(), 400)}


@pytest.fixture(params=MOTIONS, scope="module")
def motion(request):
    move, gait, frames = MOTIONS[request.param]
    return move(Body(), gait, frames, RATE, course=OVER_THE_HILL)


def test_feet_stand_on_the_hill_and_stay_there(motion):
    assert largest_slide(Body(), motion, hill) < 1e-3
    for points in sole_points(Body(), motion).values():
        for path in points.values():
            assert (path[:, 2] - hill(path[:, 0], path[:, 1])).min() > -4e-3  # a sole is flat, the hill is not


def test_soles_are_parallel_to_the_ground_in_mid_stance(motion):
    times = np.arange(len(motion.hips)) / RATE
    for fall in motion.footfalls:
        middle = fall.strike + 0.35 * (fall.leave - fall.strike)
        if not 0 < middle < times[-1]:
            continue
        up = motion.turns[f"foot.{fall.side}"][round(middle * RATE)][:, 2]
        x, y = fall.place[:2]
        step = 0.05
        normal = np.array((hill(x - step, y) - hill(x + step, y), hill(x, y - step) - hill(x, y + step), 2 * step))
        assert np.degrees(np.arccos(up @ normal / np.linalg.norm(normal))) < 1.5


def test_knees_stay_bent_on_slopes(motion):
    for side in SIDES:
        assert knee_flexion(motion, side).min() > 2.0


def test_a_hill_changes_the_mean_force_by_no_more_than_its_curvature_can(motion):
    height = mass_centre(Body(), motion)[:, 2]
    force = 1 + np.diff(height, 2) * RATE**2 / GRAVITY
    assert force.mean() == pytest.approx(1.0, abs=0.03)
    assert force.min() > -0.35
    assert force.max() < 3.0


def test_the_body_follows_the_way(motion):
    places = mass_centre(Body(), motion)[:, :2]
    way = OVER_THE_HILL.place(np.arange(-2, 20, 0.01))
    distance = np.linalg.norm(places[:, None, :] - way[None], axis=2).min(axis=1)
    assert distance.max() < 0.25  # leaning into the bend
    assert np.median(distance) < 0.15


def test_a_bend_is_leant_into_so_that_the_force_points_at_the_body():
    circle = Course([(4 * np.sin(a), 4 - 4 * np.cos(a)) for a in np.linspace(0, 4.5, 30)])
    speed = 3.0
    middle = 9.0
    assert circle.curvature(middle) == pytest.approx(1 / 4.0, rel=0.01)
    lean = inward_lean(speed, circle.curvature(middle))
    assert np.tan(lean) == pytest.approx(speed**2 / 4.0 / GRAVITY, rel=0.01)
    motion = run(Body(), Run(speed=speed), 400, RATE, course=circle)
    centre = mass_centre(Body(), motion)
    inside = np.linalg.norm(centre[120:260, :2] - (0.0, 4.0), axis=1).mean()
    assert 4.0 - inside == pytest.approx(np.sin(lean) * 0.97, abs=0.04)


def test_a_course_is_measured_by_its_length_and_goes_straight_on():
    course = Course([(0, 0), (2, 0), (3, 1), (3, 3)])
    steps = np.linalg.norm(np.diff(course.place(np.arange(-1, 6, 0.05)), axis=0), axis=1)
    assert steps == pytest.approx(0.05, rel=2e-3)
    assert course.place(-2.0) == pytest.approx((-2.0, 0.0))
    assert course.heading(100.0) == pytest.approx(np.pi / 2, abs=0.02)


def test_a_clamped_spline_agrees_with_scipys():
    interpolate = pytest.importorskip("scipy.interpolate")
    rng = np.random.default_rng(3)
    knots, values = np.cumsum(rng.uniform(0.2, 1, 7)), rng.normal(size=(7, 3))
    u = np.linspace(knots[0], knots[-1], 100)
    start, end = rng.normal(size=(2, 3))
    oracle = interpolate.CubicSpline(knots, values, bc_type=((1, start), (1, end)))
    assert clamped_spline(u, knots, values, start, end) == pytest.approx(oracle(u), abs=1e-12)
