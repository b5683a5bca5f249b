"""A layer on things: as thick as asked for, a quarter of a circle at edges, and nowhere on what is steep."""

import numpy as np
import pytest

from softground_addon.core.errors import InputError
from softground_addon.core.meshing.cover import LIFT, cover

BOX = np.array([(x, y, z) for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 0.5)])
SIDES = [(1, 5, 7), (1, 7, 3), (0, 2, 6), (0, 6, 4), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 1, 3), (0, 3, 2)]
SIDES = np.array([*SIDES, (4, 6, 7), (4, 7, 5)])


def test_a_box_is_covered_on_top_alone_and_rounded_as_a_quarter_of_a_circle():
    laid = cover(BOX, SIDES, 0.1, 0.02)
    x, y, z = laid.vertices.T
    assert z.min() == pytest.approx(0.5 + LIFT)
    assert z.max() == pytest.approx(0.6 + LIFT)
    from_edge = np.min([x, 1 - x, y, 1 - y], axis=0)
    circle = np.sqrt(0.1**2 - (0.1 - np.clip(from_edge, 0, 0.1)) ** 2)
    assert laid.thickness == pytest.approx(circle, abs=1e-6)
    assert z == pytest.approx(0.5 + laid.thickness + LIFT)
    volume = 1.0 * 0.1 - (1 - np.pi / 4) * 0.1**2 * 4  # and a little less where two edges meet
    corners = laid.thickness[laid.faces].mean(axis=1)
    assert corners.sum() * 0.02**2 == pytest.approx(volume, rel=0.03)
    first, second, third = (laid.vertices[laid.faces[:, k]] for k in range(3))
    assert (np.cross(second - first, third - first)[:, 2] > 0).all()


def test_on_stairs_each_tread_has_a_layer_that_ends_at_its_edge_and_leans_against_the_next():
    stair = np.concatenate([BOX, BOX * (1, 1, 2) + (1, 0, 0)])
    laid = cover(stair, np.concatenate([SIDES, SIDES + len(BOX)]), 0.1, 0.02)
    lower = laid.vertices[:, 0] < 0.99
    middle = (np.abs(laid.vertices[:, 1] - 0.5) < 0.1) & (np.abs(laid.vertices[:, 0] - 1.0) < 0.05)
    assert laid.thickness[lower & middle] == pytest.approx(0.1)
    assert laid.thickness[~lower & middle].min() == pytest.approx(0.0, abs=0.03)
    assert np.ptp(laid.vertices[laid.faces][..., 2], axis=1).max() < 0.1


def test_what_is_too_steep_or_looks_down_is_refused():
    with pytest.raises(InputError, match="no faces that look up"):
        cover(BOX, SIDES[:2, ::-1], 0.1, 0.02)
    with pytest.raises(InputError, match="no faces that look up"):
        cover(BOX, SIDES[2:4], 0.1, 0.02)


def test_a_large_roof_has_no_more_vertices_than_a_mesh_can_take():
    assert len(cover(BOX * (40, 40, 1), SIDES, 0.05, 0.02).vertices) < 410_000


@pytest.mark.parametrize("size", [(1.03, 0.47, 1.0), (0.015, 2.0, 1.0), (0.005, 0.007, 1.0)])
def test_a_box_of_any_size_is_covered_from_edge_to_edge_alike(size):
    laid = cover(BOX * size, SIDES, 0.1, 0.04)
    x, y = laid.vertices[:, 0], laid.vertices[:, 1]
    assert (x.min(), x.max(), y.min(), y.max()) == pytest.approx((0.0, size[0], 0.0, size[1]))
    from_edge = np.min([x, size[0] - x, y, size[1] - y], axis=0)
    circle = np.sqrt(0.1**2 - (0.1 - np.clip(from_edge, 0, 0.1)) ** 2)
    assert laid.thickness == pytest.approx(circle, abs=1e-6)
    assert laid.thickness.max() > 0.0


def test_what_is_too_narrow_is_refused_instead_of_covered_by_nothing():
    corner = np.array([(0.0, 0.0, 0.0), (1.0, 1.0, 0.0), (1.0, 1.0001, 0.0)])
    with pytest.raises(InputError, match="too narrow"):
        cover(corner, np.array([(0, 1, 2)]), 0.1, 0.04)


def test_a_thick_cover_is_as_coarse_as_its_edge_allows():
    laid = cover(BOX * (24, 24, 1), SIDES, 5.0, 0.04)
    assert laid.thickness.max() == pytest.approx(5.0)
    assert len(laid.vertices) < 80**2  # 0.04 m would look at 360,000 places, each with 64,000 around it
