"""The sparse height field: exact where it is written, empty elsewhere, and as large as what was touched."""

import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softground_addon.core.errors import InputError
from softground_addon.core.ground.heightfield import FlatTerrain, HeightField, TerrainTiles
from softground_addon.core.ground.sparse_grid import PLACES_AT_ONCE, TILE, SampledGrid, SparseGrid, Window
from tests.core.walkers import memory_of

windows = st.builds(
    Window, st.integers(-100, 100), st.integers(-100, 100), st.integers(1, 3 * TILE), st.integers(1, 3 * TILE)
)


@given(windows, st.integers(0, 2**32 - 1))
def test_a_window_reads_back_what_was_written_and_nothing_else_changed(window, seed):
    values = np.random.default_rng(seed).normal(size=(2, window.rows, window.columns))
    field = HeightField(0.01)
    field.write(window, values)
    around = field.read(window.expanded(5))
    assert np.array_equal(around[:, 5:-5, 5:-5], values)
    around[:, 5:-5, 5:-5] = 0
    assert not around.any()


@given(windows, windows)
def test_windows_intersect_exactly_when_they_share_a_cell(first, other):
    cells = [
        {(i, j) for i in range(w.column, w.column + w.columns) for j in range(w.row, w.row + w.rows)}
        for w in (first, other)
    ]
    assert first.intersects(other) == bool(cells[0] & cells[1])


def test_memory_follows_the_touched_ground_and_not_the_extent():
    for distance in (100, 1_000_000):
        field = HeightField(0.01)
        for step in range(10):
            field.write(Window(step * distance, 0, 20, 20), np.ones((2, 20, 20)))
        assert memory_of(field) <= 4 * 10 * 2 * 8 * TILE**2
        assert field.volumes() == pytest.approx((10 * 400e-4, 10 * 400e-4))


def test_writing_nothing_takes_no_memory():
    field = HeightField(0.01)
    field.write(Window(-50, -50, 300, 300), np.zeros((2, 300, 300)))
    assert memory_of(field) == 0


def test_a_cell_covers_the_ground_from_its_index_times_the_cell_size():
    window = Window.around(np.array([-0.001, 0.0199]), np.array([0.0101, 0.02]), 0.01)
    assert window == (-1, 1, 3, 2)
    x, y = window.centres(0.01)
    assert x == pytest.approx([-0.005, 0.005, 0.015])
    assert y == pytest.approx([0.015, 0.025])


@given(
    st.floats(-1, 1),
    st.floats(-1, 1),
    st.floats(-1, 1),
    st.lists(st.tuples(st.floats(-2, 2), st.floats(-2, 2)), min_size=1),
)
def test_sampling_reproduces_a_plane_exactly_across_tiles(a, b, c, places):
    field = HeightField(0.1)
    window = Window(-30, -30, 60, 60)
    x, y = np.meshgrid(*window.centres(0.1))
    field.write(window, np.stack([a + b * x + c * y, x]))
    px, py = np.array(places).T
    assert field.sample(px, py) == pytest.approx(np.stack([a + b * px + c * py, px]), abs=1e-12)


def test_sampling_at_a_cell_centre_gives_that_cell_and_far_away_nothing():
    field = HeightField(0.01)
    window = Window(-5, 70, 40, 9)
    values = np.random.default_rng(1).random((2, 9, 40))
    field.write(window, values)
    x, y = np.meshgrid(*window.centres(0.01))
    assert field.sample(x, y) == pytest.approx(values, abs=1e-12)
    assert np.array_equal(field.nearest(x, y), values)
    assert not field.sample(np.array([1e3, -1e3]), np.array([0.0, 1e4])).any()
    assert not HeightField(0.01).sample(np.array([0.0]), np.array([0.0])).any()


def test_of_many_places_only_what_is_found_takes_more_memory():
    field = HeightField(0.01)
    window = Window(-40, -3, 300, 200)
    x, y = np.meshgrid(*window.centres(0.01))
    values = np.stack([x - 2 * y, 3 * y])
    field.write(window, values)

    def found_and_peak(places):
        inside = np.random.default_rng(2).integers(0, x.size, places)
        px, py = x.ravel()[inside], y.ravel()[inside]
        tracemalloc.start()
        try:
            sampled = field.sample(px, py)
            peak = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
        np.testing.assert_allclose(sampled, values.reshape(2, -1)[:, inside], rtol=0, atol=1e-12)
        return sampled.nbytes, peak

    (few, before), (more, after) = found_and_peak(PLACES_AT_ONCE), found_and_peak(3 * PLACES_AT_ONCE + 5)
    assert after - before < 1.5 * (more - few)


@pytest.mark.parametrize("size", [0.0, -0.01, np.nan, np.inf])
def test_a_cell_size_that_is_no_length_is_refused_with_a_remedy(size):
    with pytest.raises(InputError, match="set it to a positive length"):
        SparseGrid(size, channels=1)


def test_what_is_sampled_stays_beside_what_is_written_first():
    grid = SampledGrid(lambda x, y: np.full((1, *x.shape), 3.0), 0.01, channels=1)
    grid.write(Window(0, 0, 2, 2), np.zeros((1, 2, 2)))
    assert grid.read(Window(0, 0, 3, 1)).tolist() == [[[0.0, 0.0, 3.0]]]


class Counting:
    def __init__(self, function):
        self.function, self.looked_up = function, 0

    def heights(self, x, y):
        self.looked_up += x.size
        return self.function(x, y)


def test_the_terrain_is_looked_up_once_per_tile():
    terrain = Counting(lambda x, y: x + 2 * y)
    tiles = TerrainTiles(terrain, 0.01)
    for shift in range(10):
        window = Window(-shift, shift, 20, 10)
        x, y = np.meshgrid(*window.centres(0.01))
        assert tiles.heights(window) == pytest.approx(x + 2 * y)
    assert terrain.looked_up <= 4 * TILE**2


def test_slopes_are_those_of_the_terrain_and_level_at_the_brink_of_a_gap():
    tiles = TerrainTiles(Counting(lambda x, y: np.where(x > 0.1, np.nan, 0.3 * x - 0.2 * y)), 0.01)
    surface = tiles.surface(Window(0, 0, 20, 8))
    assert surface.bears.sum(axis=1) == pytest.approx(10)
    assert surface.slope_x[surface.bears] == pytest.approx(0.3)
    assert surface.slope_y[surface.bears] == pytest.approx(-0.2)


@pytest.mark.parametrize("steepness", [3.0, 6.0, 1e6])
def test_a_wall_takes_no_print_and_the_level_ground_on_both_sides_of_it_does(steepness):
    tiles = TerrainTiles(Counting(lambda x, y: np.clip(steepness * x, 0.0, 0.5) + 0 * y), 0.01)
    window = Window(-40, 0, 80, 5)
    height = np.clip(steepness * window.centres(0.01)[0], 0.0, 0.5)
    level = (height == 0) | (height == 0.5)
    assert (tiles.surface(window).bears == level).all()


def test_a_flat_terrain_is_flat_everywhere():
    x, y = np.array([[-1e6, 0.0, 3.0]]), np.array([[1.0], [2.0]])
    assert np.array_equal(FlatTerrain(0.7).heights(x, y), np.full((2, 3), 0.7))
