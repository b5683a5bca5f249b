"""Triangles in equal parts: nothing is lost, nothing tears, all parts are alike."""

import numpy as np
import pytest

from softground_addon.core.meshing.equal_parts import equal_parts
from softground_addon.core.meshing.refinement import refine
from tests.core.meshing.test_refinement import grid, positions, trail

POINTS = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 1.0], [4.0, 3.0, 0.0], [0.0, 3.0, 2.0]])
CORNER = np.array([[0, 1, 2], [0, 2, 3]])
ENDS = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]])
EDGE = np.array([[3, 1, 0], [4, 2, 1]])


def normals(points, corner):
    first, second, third = np.moveaxis(points[corner], 1, 0)
    return np.cross(second - first, third - first)


@pytest.mark.parametrize("count", [1, 2, 3, 7, 13])
def test_the_parts_are_alike_and_fill_their_triangle(count):
    parts = equal_parts(POINTS, CORNER, EDGE, ENDS, count, 2.0**-12)
    assert len(parts.corner) == len(CORNER) * count**2
    whole = normals(POINTS, CORNER)[parts.source] / count**2
    np.testing.assert_allclose(normals(parts.points, parts.corner), whole, rtol=5e-3, atol=1e-3)
    np.testing.assert_allclose(normals(parts.points, parts.corner).sum(axis=0), normals(POINTS, CORNER).sum(axis=0))
    between = np.einsum("tkn,tnc->tkc", parts.weight.astype(float), POINTS[CORNER[parts.source]])
    np.testing.assert_allclose(parts.points[parts.corner], between, atol=1e-12)
    assert (parts.weight.sum(axis=-1) == 1.0).all()


@pytest.mark.parametrize("count", [3, 13])
def test_triangles_share_the_points_of_their_edge(count):
    parts = equal_parts(POINTS, CORNER, EDGE, ENDS, count, 2.0**-12)
    assert len(np.unique(parts.points, axis=0)) == len(parts.points) == (count + 1) ** 2
    sides = np.sort(np.stack([parts.corner, np.roll(parts.corner, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    sides, faces = np.unique(sides, axis=0, return_counts=True)
    border = np.sort(parts.pieces[[0, 2, 3, 4]].reshape(-1, 2), axis=1)
    assert set(map(tuple, sides[faces == 1].tolist())) == set(map(tuple, border.tolist()))


def test_the_detail_of_a_plane_does_not_depend_on_its_size():
    counts = []
    for size in (10.0, 13.0, 21.0, 37.0, 64.0, 1000.0):
        surface = grid(1, size)
        place = positions(surface, refine(surface, trail(0.005, steps=1), 0.005))
        inside = (np.abs(place[:, :2] - (-0.35, 0.09)) < (0.14, 0.05)).all(axis=1)
        counts.append(np.count_nonzero(inside))
    expected = 0.28 * 0.10 / 0.005**2
    assert np.abs(np.array(counts) / expected - 1.0).max() < 0.12
