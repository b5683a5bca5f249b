"""Skin as it responds, and which of it comes near the ground."""

from __future__ import annotations

import numpy as np
import pytest

from softground_addon.core.carving.responded_skin import RespondedSkin, WornSkin, thinned
from softground_addon.core.ground.heightfield import FlatTerrain, SlopingTerrain
from softground_addon.core.legs.grounding import Response
from softground_addon.core.rig.bare_body import bare_body, recorded
from softground_addon.core.rig.mapping import RigMapping
from softground_addon.core.rig.recording import SceneUnits
from tests.core.character import character, flat_sole

CORNERS = np.array([(x, y, z) for x in (-2.0, 2.0) for y in (-0.5, 0.5) for z in (0.7, 1.7)])
FACES = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
UNITS = SceneUnits(frame_rate=24.0, time_stretch=1.0, gravity_m_s2=9.81, unit_scale_m=1.0)


@pytest.mark.parametrize(
    ("terrain", "is_near"),
    [
        (FlatTerrain(0.0), False),
        (FlatTerrain(0.4), True),
        (SlopingTerrain(0.0, np.array([0.5, 0.0])), True),  # uphill it is in the ground, far as its middle is from it
        (FlatTerrain(0.0, (-2.0, -1.0), (1.0, 1.0)), True),  # nothing is known beyond the edge
    ],
)
def test_skin_is_near_the_ground_if_any_part_of_its_bone_is(terrain, is_near):
    positions = np.repeat(CORNERS[None], 3, axis=0)
    body = bare_body(positions, FACES[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3), [("trunk", 8)])
    recording = recorded(body, positions[:, body.followed], range(3), UNITS)
    still = np.tile(np.eye(4), (3, 1, 1))
    motion = character([flat_sole(np.zeros((3, 3)))])
    worn = WornSkin("Giant", body.skin, body.bones, RigMapping(), recording)
    skin = RespondedSkin(worn, motion, Response(np.arange(3.0), still, {}, np.zeros((3, 2))))
    assert (skin.near(terrain, 0.4) == is_near).all()


def ball(around, rows=40, columns=80):
    """A closed ball of 10 cm, finer than 1 cm: vertices (V, 3), triangles (T, 3) that face out."""
    up, along = np.linspace(0, np.pi, rows)[1:-1, None], np.linspace(0, 2 * np.pi, columns, endpoint=False)
    middle = np.stack([np.sin(up) * np.cos(along), np.sin(up) * np.sin(along), np.cos(up) + 0 * along], axis=-1)
    points = np.concatenate([middle.reshape(-1, 3), [(0, 0, 1), (0, 0, -1)]]) * 0.1 + around
    number = np.arange(middle[..., 0].size).reshape(rows - 2, columns)
    a, b, c, d = (
        each.ravel() for each in (number[:-1], number[1:], np.roll(number, -1, 1)[:-1], np.roll(number, -1, 1)[1:])
    )
    top, bottom = np.full(columns, len(points) - 2), np.full(columns, len(points) - 1)
    caps = [(top, number[0], np.roll(number[0], -1)), (bottom, np.roll(number[-1], -1), number[-1])]
    return points, np.concatenate([np.stack(each, axis=1) for each in ((a, b, c), (c, b, d), *caps)])


def test_a_fine_skin_is_as_large_and_as_closed_between_fewer_vertices():
    size, two = 0.01, [ball((0.0, 0.0, 0.1)), ball((0.2, 0.0, 0.1))]  # side by side, of two bones
    count = len(two[0][0])
    points = np.concatenate([points for points, _ in two])
    parts = {number: triangles + number * count for number, (_, triangles) in enumerate(two)}
    thin = thinned(points, parts, np.repeat([0, 1], count), size)
    for number, whole in parts.items():
        assert len(np.unique(thin[number])) < 0.5 * count
        assert (thin[number] // count == number).all()
        edges = np.sort(np.concatenate([thin[number][:, [k, (k + 1) % 3]] for k in range(3)]))
        assert (np.unique(edges, axis=0, return_counts=True)[1] % 2 == 0).all()
        volumes = [
            np.linalg.det(points[triangles] - points[whole].mean(axis=(0, 1))).sum()
            for triangles in (whole, thin[number])
        ]
        assert volumes[1] == pytest.approx(volumes[0], rel=0.02)
        away = np.linalg.norm(points[whole.min() : whole.max() + 1, None] - points[np.unique(thin[number])], axis=-1)
        assert away.min(axis=1).max() < np.sqrt(3) * size


def test_a_coarse_skin_stays_as_it_is():
    points, triangles = ball((0.0, 0.0, 0.1), 6, 8)
    assert np.array_equal(thinned(points, {0: triangles}, np.zeros(len(points), dtype=int), 0.01)[0], triangles)
