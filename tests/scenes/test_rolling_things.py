"""A wheel that rolls without slipping and a ball that falls freely."""

import numpy as np
import pytest

pytest.importorskip("bpy")

from sample_scenes.course import Course
from sample_scenes.rolling_things import (
    create_ball,
    create_wheel,
    drop,
    falling,
    roll_along,
    rolling,
    wheel_mesh,
)

RADIUS = 0.34


def matrices(scene, thing, frames):
    import bpy

    result = []
    for frame in frames:
        scene.frame_set(int(frame))
        result.append(np.array(thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world))
    return np.array(result)


def test_the_point_on_the_ground_stands_still_while_the_wheel_rolls_on():
    times = np.arange(0, 2, 1e-4)
    middle, turn = rolling(Course(), RADIUS, 3.0, times)
    velocity = np.gradient(middle, times, axis=0)
    spin = np.einsum("fij,fkj->fik", np.gradient(turn, times, axis=0), turn)  # skew matrix of the angular velocity
    contact = velocity + np.einsum("fij,j->fi", spin, (0.0, 0.0, -RADIUS))
    assert np.abs(contact[5:-5]).max() < 1e-3
    assert middle[:, 2] == pytest.approx(RADIUS)
    assert middle[-1, 0] == pytest.approx(3.0 * times[-1])


def test_it_rolls_up_a_hill_on_its_ground_and_leans_into_bends():
    def hill(x, y):
        return 0.5 * np.exp(-((x - 3.0) ** 2) / 2.0) + 0 * y

    times = np.arange(0, 3, 0.01)
    middle, _ = rolling(Course(heights=hill), RADIUS, 2.0, times)
    ground = np.arange(-1, 8, 0.001)
    points = np.column_stack([ground, hill(ground, 0 * ground)])
    gap = np.linalg.norm(middle[:, None, [0, 2]] - points[None], axis=2).min(axis=1)
    assert gap == pytest.approx(RADIUS, abs=2e-3)
    steps = np.linalg.norm(np.diff(np.column_stack([middle[:, 0], hill(middle[:, 0], 0 * times)]), axis=0), axis=1)
    assert steps.mean() / 0.01 == pytest.approx(2.0, rel=0.05)
    bend = Course([(0, 0), (3, 0), (5, 2), (5, 6)])
    _, turns = rolling(bend, RADIUS, 3.0, times)
    assert turns[:, 2, 1].min() < -0.1  # its axle points down to the left: it leans to the left


def test_a_keyed_wheel_turns_by_distance_over_radius(scene):
    wheel = create_wheel("Wheel", scene.collection, RADIUS)
    wheel.location = (2.0, 1.0, 0.0)
    scene.view_layers[0].update()
    roll_along(wheel, Course(), RADIUS, 2.4, 49, first_frame=1)
    poses = matrices(scene, wheel, (1, 25, 49))
    assert poses[:, :3, 3] == pytest.approx(np.array([(2, 1 - 2.4 * t, RADIUS) for t in (0, 1, 2)]), abs=1e-4)
    turned = np.trace(poses[0, :3, :3].T @ poses[1, :3, :3])
    assert (turned - 1) / 2 == pytest.approx(np.cos(2.4 / RADIUS), abs=1e-4)
    lowest = [
        (np.array([v.co for v in wheel.data.vertices]) @ pose[:3, :3].T + pose[:3, 3])[:, 2].min() for pose in poses
    ]
    assert lowest == pytest.approx([0, 0, 0], abs=5e-3)  # knobs of 4 mm


def test_a_wheel_is_as_large_as_asked_for():
    vertices, _ = wheel_mesh(RADIUS, 0.022)
    assert np.hypot(vertices[:, 1], vertices[:, 2]).max() == pytest.approx(RADIUS, abs=1e-3)


def test_a_ball_falls_freely_and_stops_within_its_sinkage(scene):
    ball = create_ball("Ball", scene.collection, 0.15)
    assert np.linalg.norm([v.co for v in ball.data.vertices], axis=1) == pytest.approx(0.15, abs=1e-6)
    ball.location.z = 2.5 + 0.15
    drop(ball, 2.5, 0.05, 40)
    heights = matrices(scene, ball, range(1, 41))[:, 2, 3]
    times = np.arange(40) / 24
    free = times < np.sqrt(2 * 2.5 / 9.81)
    assert heights[free] == pytest.approx(2.65 - 9.81 / 2 * times[free] ** 2, abs=1e-5)
    assert heights[-1] == pytest.approx(0.15 - 0.05, abs=1e-5)
    fine = np.arange(0, 1.2, 1e-4)
    speed = np.gradient(falling(2.5, 0.05, fine), fine)
    assert np.abs(np.diff(speed)).max() < 0.15  # no jump of the speed, at impact or at rest
