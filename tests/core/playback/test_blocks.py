"""A footprint's changes in blocks, against the record itself."""

import numpy as np
import pytest

from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.sparse_grid import Window
from softground_addon.core.numerics.packed import PackedArray
from softground_addon.core.playback import blocks, playback_curves, vertex_histories
from softground_addon.core.playback.blocks import ChangesInBlocks
from tests.core.walkers import box_sole, pressed, standing

SNOW = GroundMaterial(375e3, 0.05, 0.2, blur_sigma=0.0)


def print_of(cell_size):
    _, footprints = pressed(standing(box_sole(0.2, 0.08), [(0.0, 0.0, 0.0)], 400.0, seconds=0.3), SNOW, cell_size)
    return footprints[0]


@pytest.fixture(scope="module")
def footprint():
    return print_of(0.002)


@pytest.mark.parametrize(
    ("column", "row", "columns", "rows"),
    [(-5, -7, 400, 300), (0, 0, 64, 64), (60, 62, 9, 5), (63, 0, 1, 40), (17, -30, 50, 60), (-90, -90, 100, 100)],
)
def test_what_changes_within_a_window_is_what_the_record_says_at_each_frame(footprint, column, row, columns, rows):
    extent = footprint.window
    window = Window(extent.column + column, extent.row + row, columns, rows)
    frames, changes = ChangesInBlocks(footprint).within(window)
    assert np.diff(frames) == pytest.approx(footprint.frame_step)
    top, left = max(row, 0), max(column, 0)
    seen = slice(top, min(row + rows, extent.rows)), slice(left, min(column + columns, extent.columns))
    grown = np.zeros((2, rows, columns))
    for frame, change in zip(frames, changes, strict=True):
        grown += change
        expected = np.zeros_like(grown)
        for channel, of_channel in enumerate((footprint.compression, footprint.rim)):
            tile = footprint.tile(of_channel, frame)[seen]
            down, right = top - row, left - column
            expected[channel, down : down + tile.shape[0], right : right + tile.shape[1]] = tile
        assert np.array_equal(grown, expected)
    assert grown.any()


@pytest.mark.parametrize("place", [(-50, 0), (0, 5000), (5000, 0), (0, -50)])
def test_beside_a_footprint_nothing_changes(footprint, place):
    window = footprint.window
    frames, changes = ChangesInBlocks(footprint).within(Window(window.column + place[0], window.row + place[1], 50, 50))
    assert not len(frames)
    assert changes.shape == (0, 2, 50, 50)


def test_what_is_unpacked_grows_with_the_number_of_cells_and_not_with_its_square(monkeypatch):
    monkeypatch.setattr(playback_curves, "CONTACTS_AT_ONCE", 200)
    for module in (blocks, vertex_histories):
        monkeypatch.setattr(module, "BLOCK", 8)
    sizes = []
    unpacked = PackedArray.unpacked
    monkeypatch.setattr(PackedArray, "unpacked", lambda array: sizes.append(unpacked(array).size) or unpacked(array))

    def looked_at(cell_size):
        footprint = print_of(cell_size)
        x, y = (centres.ravel() for centres in np.meshgrid(*footprint.window.centres(cell_size)))
        sizes.clear()
        playback_curves.playback_curves_at([footprint], x, y, blur_sigma=0.0, frame_rate=30.0)
        return sum(sizes)

    assert looked_at(0.0025) <= 8 * looked_at(0.005)  # 4 times as many cells, 16 their square
