"""Cutting coarse faces along a trail."""

import tracemalloc
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from softground_addon.core.meshing.refinement import COARSEST_LEG, Surface, refine
from softground_addon.core.meshing.region import Region
from softground_addon.core.numerics.cell_keys import keys_of


def surface_of(vertices, faces):
    """Faces of any number of corners, each shown as a fan of triangles."""
    size = np.array([len(face) for face in faces])
    start = np.concatenate([[0], np.cumsum(size)])
    corners, owner = [], []
    for number, count in enumerate(size):
        for k in range(1, count - 1):
            corners.append(start[number] + np.array([0, k, k + 1]))
            owner.append(number)
    return Surface(np.asarray(vertices, float), np.concatenate(faces), start, np.array(corners), np.array(owner))


def grid(count, size, height=lambda x, y: 0 * x):
    axis = np.linspace(-size / 2, size / 2, count + 1)
    x, y = (values.ravel() for values in np.meshgrid(axis, axis))
    corner = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).ravel()
    return surface_of(np.stack([x, y, height(x, y)], axis=-1), corner[:, None] + np.array([0, 1, count + 2, count + 1]))


def scattered(seed, count=60, size=3.0):
    """A rough terrain of irregular triangles."""
    rng = np.random.default_rng(seed)
    around = size * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    place = np.concatenate([rng.uniform(-size / 2, size / 2, (count, 2)), around])
    triangles = Delaunay(place).simplices
    side = place[triangles]
    turned = np.linalg.det(side[:, 1:] - side[:, :1]) < 0
    triangles[turned] = triangles[turned][:, ::-1]
    return surface_of(np.column_stack([place, rng.uniform(-0.3, 0.3, len(place))]), triangles)


def region_of(columns, rows, cell_size):
    return Region(np.unique(keys_of(np.stack([columns, rows], axis=-1))), cell_size)


def trail(cell_size, steps=3, origin=(0.0, 0.0)):
    """The cells of a few prints of 30 by 12 cm."""
    columns, rows = [], []
    for step in range(steps):
        x, y = origin[0] + 0.5 * step - 0.5, origin[1] + 0.09 * (-1) ** step
        i, j = (
            np.arange(int(x / cell_size), int((x + 0.3) / cell_size)),
            np.arange(int((y - 0.06) / cell_size), int((y + 0.06) / cell_size)),
        )
        columns.append(np.repeat(i, len(j)))
        rows.append(np.tile(j, len(i)))
    return region_of(np.concatenate(columns), np.concatenate(rows), cell_size)


def all_faces(surface, refinement):
    whole = [
        surface.corner_vertex[surface.face_start[face] : surface.face_start[face + 1]].tolist()
        for face in refinement.kept_faces
    ]
    return whole + new_faces(refinement)


def new_faces(refinement):
    return [face.tolist() for face in np.split(refinement.corner_vertex, refinement.face_start[1:-1])]


def quads_and_triangles(refinement, of_corners):
    """Values at the corners of the quads, (Q, 4, ...), and of the triangles, (T, 3, ...)."""
    quads = np.count_nonzero(np.diff(refinement.face_start) == 4)
    return (
        of_corners[: 4 * quads].reshape(quads, 4, *of_corners.shape[1:]),
        of_corners[4 * quads :].reshape(-1, 3, *of_corners.shape[1:]),
    )


def halves(refinement):
    """Vertices of the triangles that the new faces are made of, (T, 3)."""
    quads, triangles = quads_and_triangles(refinement, refinement.corner_vertex)
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]], triangles])


def faces_at_edges(faces):
    """How many faces each edge has, and the net direction in which they run along it."""
    count, direction = {}, {}
    for face in faces:
        for a, b in zip(face, [*face[1:], face[0]], strict=True):
            edge = (min(a, b), max(a, b))
            count[edge] = count.get(edge, 0) + 1
            direction[edge] = direction.get(edge, 0) + (1 if a < b else -1)
    return count, direction


def positions(surface, refinement):
    return refinement.at_vertices(surface, surface.vertices)


def original_faces(surface):
    return np.split(surface.corner_vertex, surface.face_start[1:-1])


def boundary_length(faces, points):
    count, _ = faces_at_edges(faces)
    edges = np.array([edge for edge, number in count.items() if number == 1])
    return np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1).sum()


SURFACES = {
    "one face of 8 m": lambda: grid(1, 8.0),
    "one face of 1 km": lambda: grid(1, 1000.0),
    "faces of 20 cm": lambda: grid(20, 4.0, lambda x, y: 0.1 * np.sin(3 * x) * np.cos(2 * y)),
    "irregular": lambda: scattered(4),
}


@pytest.mark.parametrize("name", SURFACES)
def test_the_result_is_watertight(name):
    surface = SURFACES[name]()
    refinement = refine(surface, trail(0.02), 0.02)
    faces, points = all_faces(surface, refinement), positions(surface, refinement)
    count, direction = faces_at_edges(faces)
    assert max(count.values()) == 2
    assert all(direction[edge] == 0 for edge, number in count.items() if number == 2), "a face is turned over"
    assert boundary_length(faces, points) == pytest.approx(boundary_length(original_faces(surface), points), rel=1e-9)
    assert set(np.unique(np.concatenate(faces)).tolist()) == set(range(len(points))), "a vertex belongs to no face"


@settings(max_examples=15)
@given(st.integers(0, 2**16), st.floats(-1, 1), st.floats(-1, 1))
def test_any_terrain_stays_watertight_and_keeps_its_area(seed, x, y):
    surface = scattered(seed)
    refinement = refine(surface, trail(0.03, 2, (x, y)), 0.03)
    faces, points = all_faces(surface, refinement), positions(surface, refinement)
    count, _ = faces_at_edges(faces)
    assert max(count.values()) <= 2
    assert boundary_length(faces, points) == pytest.approx(boundary_length(original_faces(surface), points), rel=1e-9)

    def area(faces):
        corner = points[[(face[0], *side) for face in faces for side in pairwise(face[1:])]]
        return np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1).sum() / 2

    assert area(faces) == pytest.approx(area(original_faces(surface)), rel=1e-9)


def regular(size=6.0):
    """Two triangles of equal sides, of which any could be the base."""
    return surface_of(
        size * np.array([[0, 0, 0], [1, 0, 0.3], [0.5, 0.75**0.5, 0], [1.5, 0.75**0.5, 1]]) - 1, [[0, 1, 2], [1, 3, 2]]
    )


def doubled(size=5.0):
    """One triangle, once from each of its sides."""
    return surface_of(size * np.array([[-1, -1, 0], [1, -0.8, 0.1], [0.2, 1, 0.3]]), [[0, 1, 2], [0, 2, 1]])


@settings(max_examples=30)
@given(
    st.one_of(
        st.integers(0, 2**16).map(scattered),
        st.builds(scattered, st.integers(0, 2**16), st.sampled_from([0, 3, 10]), st.floats(2, 500)),
        st.floats(3, 50).map(regular),
        st.floats(3, 50).map(doubled),
        st.floats(3, 2000).map(lambda size: grid(1, size)),
    )
)
def test_quads_are_parallelograms_in_one_triangle_and_turned_like_it(surface):
    refinement = refine(surface, trail(0.03, 2), 0.03)
    place, _ = quads_and_triangles(refinement, positions(surface, refinement)[refinement.corner_vertex])
    diagonal, other = place[:, 2] - place[:, 0], place[:, 3] - place[:, 1]
    apart = np.linalg.norm(place[:, [0, 2]].sum(axis=1) - place[:, [1, 3]].sum(axis=1), axis=-1) / 2
    assert (apart < 0.03 * np.linalg.norm(diagonal, axis=-1)).all(), "the diagonals do not halve each other"
    first, second, third = np.moveaxis(
        surface.vertices[surface.triangle_vertices[refinement.source[: len(place)]]], 1, 0
    )
    normal = np.cross(second - first, third - first)
    across = np.cross(diagonal, other)
    np.testing.assert_allclose(
        np.einsum("ni,ni->n", across, normal),
        np.linalg.norm(across, axis=-1) * np.linalg.norm(normal, axis=-1),
        rtol=1e-6,
    )


def test_no_two_triangles_that_could_be_a_quad_are_left_in_a_region():
    refinement = refine(grid(1, 8.0), region_of(*np.mgrid[-100:100, -100:100].reshape(2, -1), 0.02), 0.02)
    assert np.mean(np.diff(refinement.face_start) == 4) > 0.9


@pytest.mark.parametrize("name", SURFACES)
def test_corners_lie_in_their_triangle_of_the_surface_at_their_weights(name):
    surface = SURFACES[name]()
    refinement = refine(surface, trail(0.02), 0.02)
    points = positions(surface, refinement)
    weights = np.concatenate([refinement.weights, 1 - refinement.weights.sum(axis=-1, keepdims=True)], axis=-1)
    assert (weights >= 0).all()
    of_corner = np.repeat(refinement.source, np.diff(refinement.face_start))
    source = surface.vertices[surface.triangle_vertices[of_corner]]
    placed = np.einsum("nk,nki->ni", weights.astype(float), source)
    np.testing.assert_allclose(placed, points[refinement.corner_vertex], atol=1e-9 * np.abs(points).max())


def test_what_corners_carry_goes_along_with_the_places_of_their_vertices():
    surface = scattered(7)
    refinement = refine(surface, trail(0.02), 0.02)
    corners = np.flatnonzero(np.isin(np.repeat(np.arange(len(surface.face_start) - 1), 3), refinement.kept_faces))
    carried = refinement.at_corners(surface, surface.vertices[surface.corner_vertex], corners)
    vertex = np.concatenate([surface.corner_vertex[corners], refinement.corner_vertex])
    np.testing.assert_allclose(carried, positions(surface, refinement)[vertex], atol=1e-9)
    names = refinement.at_corners(surface, surface.corner_vertex, corners)
    assert set(names[len(corners) :].tolist()) <= set(surface.corner_vertex.tolist()), "whole numbers are not mixed"


def test_vertices_are_about_a_cell_apart_in_the_region_and_few_elsewhere():
    cell = 0.01
    for size in (7.0, 8.0, 9.0, 10.0, 11.0):
        surface, region = grid(1, size), trail(cell, 3)
        refinement = refine(surface, region, cell)
        corner = positions(surface, refinement)[halves(refinement)]
        side = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=-1)
        inside = region.touches(corner[..., :2].min(axis=1), corner[..., :2].max(axis=1))
        assert side[inside].max() <= COARSEST_LEG * np.sqrt(2) * cell * 1.0001
        assert side[inside].min() >= 0.8 * cell
        cells = 3 * 30 * 12
        assert 0.5 * cells < len(refinement.new_vertex) < 2.6 * cells


def test_sizes_fall_off_gradually():
    refinement = refine(grid(1, 64.0), trail(0.01), 0.01)
    surface = grid(1, 64.0)
    corner = positions(surface, refinement)[halves(refinement)]
    longest = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=-1).max(axis=1)
    owner = {}
    for number, face in enumerate(halves(refinement).tolist()):
        for a, b in zip(face, [*face[1:], face[0]], strict=True):
            owner.setdefault((min(a, b), max(a, b)), []).append(number)
    ratios = [longest[pair[0]] / longest[pair[1]] for pair in owner.values() if len(pair) == 2]
    assert max(*ratios, *(1 / ratio for ratio in ratios)) <= np.sqrt(2) * 1.001


def test_faces_away_from_the_trail_are_kept():
    surface = grid(200, 40.0)
    refinement = refine(surface, trail(0.02), 0.02)
    assert len(refinement.kept_faces) > 0.99 * 200**2
    assert len(np.intersect1d(refinement.kept_faces, surface.triangle_face[refinement.source])) == 0
    assert len(np.union1d(refinement.kept_faces, surface.triangle_face[refinement.source])) == 200**2


def test_new_edges_know_the_edges_they_are_parts_of():
    surface = grid(4, 4.0)
    refinement = refine(surface, trail(0.05), 0.05)
    points = positions(surface, refinement)
    parts = np.linalg.norm(np.diff(points[refinement.edges], axis=1)[:, 0], axis=1)
    whole, first = np.unique(refinement.edge_of, axis=0, return_inverse=True)
    length = np.linalg.norm(np.diff(points[whole], axis=1)[:, 0], axis=1)
    np.testing.assert_allclose(np.bincount(first.ravel(), parts), length, rtol=1e-9)


def test_a_surface_that_is_fine_enough_or_far_away_stays_as_it_is():
    for surface, region in ((grid(200, 2.0), trail(0.02)), (grid(3, 3.0), trail(0.01, 2, (50.0, 0.0)))):
        refinement = refine(surface, region, 0.02)
        assert not len(refinement.corner_vertex)
        assert refinement.face_start.tolist() == [0]
        assert len(refinement.kept_faces) == len(surface.face_start) - 1


def test_the_work_does_not_grow_with_the_size_of_the_ground():
    def vertices_and_memory(size):
        surface, region = grid(1, size), trail(0.005, 6)
        tracemalloc.start()
        try:
            count = len(refine(surface, region, 0.005).new_vertex)
            return np.array([count, tracemalloc.get_traced_memory()[1]])
        finally:
            tracemalloc.stop()

    # 8 m and 1024 m halve to the same final size, so that the same work is left on the trail.
    assert np.all(vertices_and_memory(1024.0) < 1.1 * vertices_and_memory(8.0))


@given(st.integers(0, 2**16), st.sampled_from([0.01, 0.3, 7.0]))
def test_a_region_finds_every_box_that_reaches_into_it(seed, size):
    rng = np.random.default_rng(seed)
    columns, rows = rng.integers(-300, 300, (2, 40))
    region = region_of(columns, rows, 0.01)
    low = rng.uniform(-4, 4, (60, 2))
    high = low + rng.uniform(0, size, (60, 2))
    cells = np.stack([columns, rows], axis=-1) * 0.01
    overlap = ((low[:, None] < cells + 0.01) & (high[:, None] > cells)).all(axis=-1).any(axis=1)
    assert region.touches(low, high)[overlap].all()
