"""The undisturbed ground under a place, from a triangle mesh."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import LinearNDInterpolator
from scipy.spatial import Delaunay

from softground_addon.core.errors import InputError
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.terrain import MeshTerrain, plane_of


def counter_clockwise(vertices, triangles):
    a, b, c = (vertices[triangles[:, k], :2] for k in range(3))
    turned = np.linalg.det(np.stack([b - a, c - a], axis=1)) < 0
    triangles[turned] = triangles[turned][:, ::-1]
    return triangles


@settings(max_examples=25)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(4, 300), scale=st.floats(0.01, 1000))
def test_heights_are_those_of_scipys_linear_interpolation(seed, count, scale):
    random = np.random.default_rng(seed)
    vertices = random.uniform(-1, 1, (count, 3)) * [scale, scale, scale * 0.1]
    delaunay = Delaunay(vertices[:, :2])
    terrain = MeshTerrain.from_mesh(vertices, counter_clockwise(vertices, delaunay.simplices.astype(np.intp)))
    x, y = random.uniform(-1.2, 1.2, (2, 400)) * scale
    expected = LinearNDInterpolator(delaunay, vertices[:, 2])(x, y)
    clear_of_slivers = ~np.isnan(terrain.heights(x, y))  # walls (near-vertical slivers) are no ground
    assert np.allclose(terrain.heights(x, y)[clear_of_slivers], expected[clear_of_slivers], atol=1e-6 * scale)
    assert np.isnan(terrain.heights(x, y)[np.isnan(expected)]).all()


def test_any_number_of_places_is_looked_up(monkeypatch):
    vertices = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 1.0], [0.0, 4.0, 2.0]])
    terrain = MeshTerrain.from_mesh(vertices, np.array([[0, 1, 2]]))
    x, y = np.random.default_rng(5).uniform(-1, 5, (2, 3, 40))
    monkeypatch.setattr("softground_addon.core.ground.terrain.PLACES_AT_ONCE", 7)
    expected = np.where((x >= 0) & (y >= 0) & (x + y <= 4), x / 4 + y / 2, np.nan)
    np.testing.assert_allclose(terrain.heights(x, y), expected, atol=1e-12)
    assert terrain.heights(x[:0], y[:0]).shape == (0, 40)


def test_slivers_do_not_crowd_the_bins():
    spokes = np.linspace(0, 2 * np.pi, 301)[:-1]
    rim = np.stack([5 * np.cos(spokes), 5 * np.sin(spokes), np.full(300, -1.0)], axis=-1)
    number = np.arange(300)
    fan = np.stack([np.full(300, 300), number, (number + 1) % 300], axis=-1)
    terrain = MeshTerrain.from_mesh(np.vstack([rim, [[0.0, 0.0, 0.0]]]), fan)
    angle, radius = np.random.default_rng(6).uniform([0, 0.5], [2 * np.pi, 4.9], (500, 2)).T
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    np.testing.assert_allclose(terrain.heights(x, y), -radius / 5, atol=1e-3)
    at_bin = np.floor((np.stack([x, y], axis=-1) - terrain.origin) / terrain.bin_size).astype(int)
    number = at_bin[:, 1] * terrain.shape[0] + at_bin[:, 0]
    assert (terrain.first[number + 1] - terrain.first[number]).mean() < 50


def test_a_trail_that_is_fine_does_not_crowd_the_bins_of_what_is_coarse_beside_it():
    x = np.concatenate([np.linspace(-10.0, -0.5, 40), np.linspace(-0.45, 0.45, 181), np.linspace(0.5, 10.0, 40)])
    y = np.linspace(0.0, 1.0, 201)
    vertices = np.stack([*map(np.ravel, np.meshgrid(x, y)), np.zeros(len(x) * len(y))], axis=-1)
    corner = (np.arange(len(y) - 1)[:, None] * len(x) + np.arange(len(x) - 1)).ravel()
    right, above = corner + 1, corner + len(x)
    triangles = np.concatenate([np.stack([corner, right, above], -1), np.stack([right, above + 1, above], -1)])
    terrain = MeshTerrain.from_mesh(vertices, triangles)
    at = np.floor((vertices[np.abs(vertices[:, 0]) < 0.4, :2] - terrain.origin) / terrain.bin_size).astype(int)
    number = at[:, 1] * terrain.shape[0] + at[:, 0]
    assert (terrain.first[number + 1] - terrain.first[number]).mean() < 50


def test_bins_over_a_long_trail_hold_no_more_than_those_over_a_square():
    """Bins as long as the trail over its breadth would hold a row of triangles each."""
    x, y = np.linspace(0.0, 1.0, 51), np.linspace(0.0, 100.0, 5001)
    vertices = np.stack([*map(np.ravel, np.meshgrid(x, y)), np.zeros(len(x) * len(y))], axis=-1)
    corner = (np.arange(len(y) - 1)[:, None] * len(x) + np.arange(len(x) - 1)).ravel()
    right, above = corner + 1, corner + len(x)
    triangles = np.concatenate([np.stack([corner, right, above], -1), np.stack([right, above + 1, above], -1)])
    terrain = MeshTerrain.from_mesh(vertices, triangles)
    assert np.diff(terrain.first).mean() < 15


@settings(max_examples=25)
@given(seed=st.integers(0, 2**32 - 1))
def test_places_on_corners_and_edges_are_on_the_surface(seed):
    random = np.random.default_rng(seed)
    vertices = random.uniform(-1, 1, (60, 3)) * [1.0, 1.0, 0.1]
    triangles = counter_clockwise(vertices, Delaunay(vertices[:, :2]).simplices.astype(np.intp))
    terrain = MeshTerrain.from_mesh(vertices, triangles)
    corners = terrain.corners
    share = random.uniform(0, 1, (len(corners), 1))
    for places in (*np.moveaxis(corners, 1, 0), corners[:, 0] + share * (corners[:, 1] - corners[:, 0])):
        np.testing.assert_array_less(places[:, 2] - 1e-9, terrain.heights(*places[:, :2].T))


def slab(z):
    vertices = np.array([[x, y, h] for h in (z - 1.0, z) for y in (0.0, 2.0) for x in (0.0, 2.0)])
    top, bottom = [[4, 5, 7], [4, 7, 6]], [[0, 3, 1], [0, 2, 3]]
    return vertices, np.array(top + bottom)


def test_the_underside_of_a_slab_is_no_second_layer():
    terrain = MeshTerrain.from_mesh(*slab(0.5))
    x, y = np.array([1.0, 0.3, 5.0]), np.array([1.0, 1.7, 1.0])
    assert np.array_equal(terrain.heights(x, y), [0.5, 0.5, np.nan], equal_nan=True)
    assert terrain.is_height_field(x, y).all()


def test_a_bridge_over_the_ground_is_found():
    (v1, t1), (v2, t2) = slab(0.0), slab(3.0)
    terrain = MeshTerrain.from_mesh(np.concatenate([v1, v2 * [0.5, 1, 1]]), np.concatenate([t1, t2 + len(v1)]))
    x, y = np.array([0.5, 1.5]), np.array([1.0, 1.0])
    assert np.array_equal(terrain.heights(x, y), [3.0, 0.0])
    assert np.array_equal(terrain.is_height_field(x, y), [False, True])


def test_only_triangles_within_the_bounds_are_kept():
    vertices, triangles = slab(0.0)
    far = np.concatenate([vertices, np.add(vertices, [100, 0, 0])])
    both = np.concatenate([triangles, triangles + len(vertices)])
    terrain = MeshTerrain.from_mesh(far, both, bounds=np.array([[0.0, 0.0], [3.0, 3.0]]))
    assert len(terrain.corners) == 2


def test_a_ground_whose_normals_are_flipped_is_the_same_ground():
    vertices, triangles = slab(0.0)
    flipped = MeshTerrain.from_mesh(vertices, triangles[:2, ::-1])
    upright = MeshTerrain.from_mesh(vertices, triangles[:2])
    x, y = np.random.default_rng(1).uniform(-0.5, 1.5, (2, 50))
    np.testing.assert_array_equal(flipped.heights(x, y), upright.heights(x, y))


def test_a_ground_of_walls_alone_is_refused_with_the_remedy():
    vertices, triangles = slab(0.0)
    with pytest.raises(InputError, match="move it under the feet"):
        MeshTerrain.from_mesh(vertices[:, [2, 0, 1]], triangles[:2])


def test_values_of_vertices_are_interpolated_as_scipy_does():
    random = np.random.default_rng(5)
    vertices = random.uniform(-1, 1, (200, 3)) * [1, 1, 0.1]
    values = random.uniform(0, 3, (200, 2))
    delaunay = Delaunay(vertices[:, :2])
    triangles = counter_clockwise(vertices, delaunay.simplices.astype(np.intp))
    terrain = MeshTerrain.from_mesh(vertices, triangles, values=values)
    x, y = random.uniform(-1.2, 1.2, (2, 20, 20))
    expected = np.moveaxis(LinearNDInterpolator(delaunay, values)(x, y), -1, 0)
    heights = terrain.interpolated(x, y)
    on_ground = np.isfinite(terrain.heights(x, y))
    assert heights.shape == (2, 20, 20)
    assert np.allclose(heights[:, on_ground], expected[:, on_ground])
    assert np.isnan(heights[:, ~on_ground]).all()


def test_where_surfaces_lie_one_above_the_other_the_values_are_those_of_the_highest():
    (v1, t1), (v2, t2) = slab(0.0), slab(3.0)
    values = np.repeat([[1.0], [2.0]], 8, axis=0)
    for order in (1, -1):
        triangles = np.concatenate([t1, t2 + len(v1)][::order])
        terrain = MeshTerrain.from_mesh(np.concatenate([v1, v2 * [0.5, 1, 1]]), triangles, values=values)
        assert np.array_equal(terrain.interpolated(np.array([0.5, 1.5]), np.array([1.0, 1.0])), [[2.0, 1.0]])


SQUARE = np.array([(0.0, 0.0, 1.5), (2.0, 0.0, 1.5), (2.0, 1.0, 1.5), (0.0, 1.0, 1.5), (1.0, 0.5, 1.5)])
FANS = np.array([(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)])
HOLE = np.array([(1.0, 1.0, 0.0), (2.0, 1.0, 0.0), (2.0, 2.0, 0.0), (1.0, 2.0, 0.0)])
CORNERS = np.array([(0.0, 0.0, 0.0), (3.0, 0.0, 0.0), (3.0, 3.0, 0.0), (0.0, 3.0, 0.0)])
AROUND = np.array([(4, 5, 1), (4, 1, 0), (5, 6, 2), (5, 2, 1), (6, 7, 3), (6, 3, 2), (7, 4, 0), (7, 0, 3)])


def test_a_level_rectangle_is_the_plane_that_it_shows():
    plane = plane_of(SQUARE, FANS)
    assert plane == FlatTerrain(1.5, (0.0, 0.0), (2.0, 1.0))
    x, y = np.random.default_rng(0).uniform(-1.0, 3.0, (2, 1000))
    np.testing.assert_array_equal(plane.heights(x, y), MeshTerrain.from_mesh(SQUARE, FANS).heights(x, y))


def test_a_close_up_of_a_whole_walk_is_known_as_the_plane_that_it_is():
    """As a mesh it would be another terrain than the one that its prints were pressed into, which are pressed again."""
    count = 800
    place = np.stack(np.meshgrid(np.arange(count), np.arange(count)), axis=-1).reshape(-1, 2) * 0.0025
    first = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
    triangles = np.concatenate([first[:, None] + (0, 1, count + 1), first[:, None] + (0, count + 1, count)])
    vertices = np.column_stack([place, np.zeros(len(place))])
    assert plane_of(vertices, triangles) is not None
    assert plane_of(vertices, np.delete(triangles, len(first) // 2 + count // 2, axis=0)) is None


@pytest.mark.parametrize(
    ("vertices", "triangles"),
    [
        (SQUARE, FANS[:3]),  # a gap
        (SQUARE, FANS[:, ::-1]),  # turned over
        (SQUARE, np.concatenate([FANS[:3], FANS[:1]])),  # as large as if it had none
        (  # a hole whose edges belong to two triangles each, on one side
            np.concatenate([HOLE, CORNERS, CORNERS]),
            np.concatenate([AROUND, np.where(AROUND < 4, AROUND, AROUND + 4)]),
        ),
        (SQUARE + np.array([(0, 0, 0)] * 4 + [(0, 0, 1e-6)]), FANS),
        *((np.where(at, np.nan, SQUARE), FANS) for at in np.eye(15, dtype=bool).reshape(15, 5, 3)),
        (SQUARE * (1.0, 1.0, np.nan), FANS),
        (SQUARE * (1.0, 1.0, np.inf), FANS),
        (SQUARE @ [[0.8, 0.6, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.0, 1.0]], FANS),
    ],
)
def test_what_is_no_level_rectangle_is_no_plane(vertices, triangles):
    assert plane_of(vertices, triangles) is None
