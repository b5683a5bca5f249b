"""What takes the slide out of a contact: planted points stay, feet roll and turn on purpose as before."""

from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.legs.foot_lock import PLANTED, Underside, lock, slides
from softground_addon.core.numerics.rigid import carried, rotation

LENGTH = 0.27
FRAMES = 24


def sole(pose):
    """The rim of a flat sole under rigid poses ((F, 3, 3) turns, (F, 3) places) on level floor."""
    x, y = np.meshgrid(np.linspace(0.0, LENGTH, 19), np.linspace(-0.04, 0.04, 9))
    rest = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=-1)
    turn, place = pose
    points = rest @ np.swapaxes(turn, -1, -2) + place[:, None]
    heights = points[..., 2] - points[..., 2].min()
    return Underside(points, heights, np.zeros(len(rest), int), LENGTH, rest[:, 0] / LENGTH)


def locked(rim, touching):
    points = carried(lock(rim, touching)[:, None], rim.points)
    return replace(rim, points=points)


def level(angle):
    return rotation(angle[:, None] * (0.0, 0.0, 1.0))


def pitched(angle):
    return rotation(angle[:, None] * (0.0, 1.0, 0.0))


PART = np.linspace(0.0, 1.0, FRAMES)
TOUCHING = np.ones(FRAMES, bool)


def test_a_flat_foot_that_slides_and_turns_a_little_stands():
    place = np.stack([0.03 * np.sin(4 * PART), 0.02 * PART**2, 0 * PART], axis=-1)
    rim = sole((level(np.radians(8.0) * PART), place))
    assert slides(rim, TOUCHING).max() > 0.03
    assert slides(locked(rim, TOUCHING), TOUCHING).max() < 5e-4


def test_a_foot_that_stands_is_left_where_it_is_to_a_micrometre():
    rim = sole((level(0 * PART), np.zeros((FRAMES, 3))))
    np.testing.assert_allclose(lock(rim, TOUCHING), np.broadcast_to(np.eye(4), (FRAMES, 4, 4)), atol=1e-6)


@pytest.mark.parametrize(("pivot", "sign"), [(0.0, -1.0), (LENGTH, 1.0)], ids=["heel", "toes"])
def test_rolling_about_heel_or_toes_is_kept(pivot, sign):
    angle = np.radians(30.0) * (1.0 - PART if pivot == 0.0 else PART)
    turn = pitched(sign * angle)
    place = np.array((pivot, 0.0, 0.0)) - turn @ (pivot, 0.0, 0.0)
    rim = sole((turn, place))
    moved = lock(rim, TOUCHING)
    assert np.abs(moved[:, :2, 3]).max() < PLANTED * LENGTH
    np.testing.assert_allclose(moved[:, :3, :3], np.broadcast_to(np.eye(3), (FRAMES, 3, 3)), atol=1e-6)


def test_a_foot_that_turns_on_purpose_keeps_its_turn_and_does_not_slide_away():
    place = np.stack([0.05 * PART, 0 * PART, 0 * PART], axis=-1)
    rim = sole((level(np.radians(80.0) * PART), place))
    moved = lock(rim, TOUCHING)
    np.testing.assert_allclose(moved[:, :3, :3], np.broadcast_to(np.eye(3), (FRAMES, 3, 3)), atol=1e-6)
    assert slides(locked(rim, TOUCHING), TOUCHING).max() < 1e-6


@pytest.mark.parametrize("pivot", [0.0, LENGTH], ids=["heel", "toes"])
@pytest.mark.parametrize("angle", [30.0, 80.0])
def test_a_foot_that_turns_on_its_heel_or_toes_and_skates_stays_where_these_first_stood(angle, pivot):
    angles = np.radians(angle) * PART**2
    about = pivot - pivot * np.cos(angles), -pivot * np.sin(angles)
    rim = sole((level(angles), np.stack([about[0] + 0.03 * PART, about[1], 0 * PART], axis=-1)))
    end = rim.along == pivot / LENGTH

    def farthest(points):
        middle = points[:, end, :2].mean(axis=1)
        return np.linalg.norm(middle - middle[0], axis=1).max()

    assert farthest(rim.points) > 0.025
    assert farthest(locked(rim, TOUCHING).points) < 0.01


@pytest.mark.parametrize("beyond", [1, 9, 60])
def test_a_foot_that_turns_as_it_stands_stays_though_a_part_of_it_is_beyond_the_floor(beyond):
    angles, pivot = np.radians(110.0) * PART, 0.3 * LENGTH
    rim = sole((level(angles), pivot * np.stack([1 - np.cos(angles), -np.sin(angles), 0 * PART], axis=-1)))
    heights = rim.heights.copy()
    heights[:, np.argsort(rim.along, kind="stable")[-beyond:]] = np.inf
    near = np.abs(rim.along - 0.3) < 0.06
    middle = locked(replace(rim, heights=heights), TOUCHING).points[:, near, :2].mean(axis=1)
    assert np.linalg.norm(middle - middle[0], axis=1).max() < 0.003


def rounded(turn, radius=0.08):
    """The rim of a sole with a rounded toe, turned (F, 3, 3) about where the round begins, on level floor."""
    angle = np.linspace(0.0, 0.5 * np.pi, 40)
    toe = np.stack([radius * np.sin(angle), 0 * angle, radius * (1.0 - np.cos(angle))], axis=-1)
    flat = np.stack([np.linspace(radius - LENGTH, 0.0, 60), np.zeros(60), np.zeros(60)], axis=-1)
    rest = np.concatenate([part + np.array((0.0, y, 0.0)) for part in (flat, toe) for y in (-0.04, 0.04)])
    points = rest @ np.swapaxes(turn, -1, -2)
    heights = points[..., 2] - points[..., 2].min(axis=1, keepdims=True)
    return Underside(points, heights, np.zeros(len(rest), int), LENGTH, (rest[:, 0] + LENGTH - radius) / LENGTH)


@pytest.mark.parametrize("place", [0.7, 0.85])
def test_a_foot_that_turns_on_its_ball_as_its_heel_rises_stays_there_and_not_with_its_tip(place):
    """As of a step that turns the body about: it rolls over its rounded toes meanwhile, and has skated before."""
    rim = rounded(level(np.radians(84.0) * PART**2) @ pitched(np.radians(35.0) * PART**2))
    ball = np.abs(rim.along - place).argmin()
    skates = np.stack([0.01 * (1.0 - PART) ** 3, 0.03 * (1.0 - PART) ** 3, 0 * PART], axis=-1)
    points = rim.points + (skates - rim.points[:, ball] * (1, 1, 0))[:, None]
    rim = replace(rim, points=points)
    near = np.abs(rim.along - place) < 0.06

    def farthest(points):
        middle = points[:, near, :2].mean(axis=1)
        return np.linalg.norm(middle - middle[0], axis=1).max()

    assert farthest(rim.points) > 0.02
    assert farthest(locked(rim, TOUCHING).points) < 0.01


def test_between_contacts_the_correction_passes_smoothly_from_one_to_the_next():
    touching = (PART < 0.3) | (PART > 0.7)
    rim = sole((level(0 * PART), np.stack([0.1 * PART, 0 * PART, 0 * PART], axis=-1)))
    along = lock(rim, touching)[:, 0, 3]
    swing = ~touching
    assert np.abs(np.diff(along)).max() < 0.03
    assert along[swing].min() > along[touching].min() - 0.01
    assert along[swing].max() < along[touching].max() + 0.01


def test_without_a_contact_nothing_moves():
    rim = sole((level(PART), np.zeros((FRAMES, 3))))
    np.testing.assert_array_equal(lock(rim, ~TOUCHING), np.broadcast_to(np.eye(4), (FRAMES, 4, 4)))


@pytest.mark.parametrize("frames", [4, 8, 16])
def test_a_sole_that_rolls_over_a_rounded_toe_does_not_creep(frames):
    touching = np.ones(frames, bool)
    rolling = rounded(pitched(np.radians(60.0) * np.linspace(0.0, 1.0, frames) ** 2))
    assert slides(locked(rolling, touching), touching).max() < 3e-4
