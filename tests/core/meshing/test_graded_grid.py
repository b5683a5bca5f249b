"""A grid that is fine in places: without cracks, as large as asked, and no finer than asked."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from softground_addon.core.meshing.graded_grid import Blocks, graded_grid


def faces_of(grid):
    return np.split(grid.vertices[grid.corner_vertex], np.cumsum(grid.face_size)[:-1])


def areas(grid):
    return np.array(
        [(face[:, 0] @ np.roll(face[:, 1], -1) - face[:, 1] @ np.roll(face[:, 0], -1)) / 2 for face in faces_of(grid)]
    )


def edges(grid):
    """Every edge of every face as a pair of vertices, in the direction in which the face runs."""
    ends = [
        np.stack([face, np.roll(face, -1)]) for face in np.split(grid.corner_vertex, np.cumsum(grid.face_size)[:-1])
    ]
    return np.concatenate(ends, axis=1).T


def blocks(*cells):
    return np.array(cells, dtype=np.intp).reshape(-1, 2)


@st.composite
def layouts(draw):
    level = draw(st.integers(0, 2))
    coarsest = draw(st.integers(level, 4))
    lower = np.array(draw(st.tuples(st.integers(-40, 40), st.integers(-40, 40))))
    upper = lower + np.array(draw(st.tuples(st.integers(1, 60), st.integers(1, 60))))
    places = st.lists(st.tuples(st.integers(-20, 25), st.integers(-20, 25)), max_size=12)
    size = draw(st.integers(0, coarsest))
    coarser = Blocks(blocks(*draw(places)), draw(st.integers(size, coarsest)), size) if draw(st.booleans()) else None
    return blocks(*draw(places)), level, lower, upper, coarsest, coarser


@settings(max_examples=150)
@given(layouts())
def test_the_faces_fill_the_rectangle_without_cracks(layout):
    lower, upper, coarsest = layout[2:5]
    grid = graded_grid(*layout)
    low, high = grid.vertices.min(axis=0), grid.vertices.max(axis=0)
    assert (low <= lower).all()
    assert (high >= upper).all()
    assert (low > lower - 2**coarsest).all()
    assert (high < upper + 2**coarsest).all()
    assert areas(grid).min() > 0, "a face that runs clockwise"
    assert areas(grid).sum() == np.prod(high - low)
    directed = edges(grid)
    assert len(np.unique(directed, axis=0)) == len(directed)
    _, uses = np.unique(np.sort(directed, axis=1), axis=0, return_counts=True)
    border = np.sort(directed, axis=1)[
        np.isin(directed @ (1, len(grid.vertices)), directed @ (len(grid.vertices), 1), invert=True)
    ]
    ends = grid.vertices[border]
    assert set(uses) <= {1, 2}
    assert np.abs(ends[:, 0] - ends[:, 1]).sum() == 2 * (high - low).sum(), "an edge within that has one face only"
    assert len(np.unique(grid.vertices, axis=0)) == len(grid.vertices)


@settings(max_examples=100)
@given(layouts())
def test_it_is_fine_where_it_is_wanted_and_sizes_change_by_two_at_most(layout):
    fine, level, _, _, coarsest, coarser = layout
    grid = graded_grid(*layout)
    low, high = grid.vertices.min(axis=0), grid.vertices.max(axis=0)
    size_at = np.zeros(tuple(high - low), dtype=int)
    for face, area in zip(faces_of(grid), areas(grid), strict=True):
        first, side = face.min(axis=0) - low, round(area**0.5)
        size_at[first[0] : first[0] + side, first[1] : first[1] + side] = side
    assert (size_at > 0).all()
    if coarsest:
        for block in fine:
            first = np.maximum(block * 2**level - low, 0)
            last = np.maximum((block + 1) * 2**level - low, 0)
            assert (size_at[first[0] : last[0], first[1] : last[1]] == 1).all()
    for block in coarser.place if coarser else ():
        first, last = (np.maximum((block + end) * 2**coarser.level - low, 0) for end in (0, 1))
        assert (size_at[first[0] : last[0], first[1] : last[1]] <= 2**coarser.size).all()
    for ahead, behind in ((size_at[1:], size_at[:-1]), (size_at[:, 1:], size_at[:, :-1])):
        assert (np.maximum(ahead, behind) <= 2 * np.minimum(ahead, behind)).all()


def test_far_from_what_is_wanted_it_has_the_largest_squares():
    grid = graded_grid(blocks((0, 0)), 0, np.array([-512, -512]), np.array([512, 512]), 5)
    assert len(grid.vertices) < 1.25 * (1024 / 32 + 1) ** 2
    assert (areas(grid) == 32**2).mean() > 0.9


def test_without_coarse_squares_it_is_a_uniform_grid():
    grid = graded_grid(blocks(), 0, np.array([-3, 2]), np.array([4, 7]), 0)
    assert len(grid.vertices) == 8 * 6
    assert (grid.face_size == 4).all()


def test_the_work_follows_what_is_fine_and_not_the_area():
    trail = blocks(*[(k, k // 3) for k in range(400)])
    near = graded_grid(trail, 1, np.array([0, 0]), np.array([1000, 400]), 6)
    far = graded_grid(trail, 1, np.array([-9000, -9000]), np.array([10000, 9400]), 13)
    assert len(far.vertices) < 1.2 * len(near.vertices)
