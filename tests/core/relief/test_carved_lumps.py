"""Lumps where bodies carve: of all sizes, in loose matter alone, of no volume, each in its place."""

import numpy as np
import pytest

from softground_addon.core.ground.sparse_grid import Window
from softground_addon.core.record.footprints import FootprintRecorder, quantised
from softground_addon.core.relief import amounts
from softground_addon.core.relief.steps import ReliefSettings, all_together, relief_of_steps

CELL, SPACING = 0.005, 0.0025
WINDOW = Window(-40, -30, 80, 60)


def carve(columns, thickness=0.02):
    """A trench with loose matter beside it, between two columns of the window."""
    recorder = FootprintRecorder(CELL, 1.0)
    heights = np.zeros((2, WINDOW.rows, WINDOW.columns))
    heights[0, 20:30, slice(*columns)] = 0.3
    heights[1, 30:50, slice(*columns)] = thickness
    recorder.add(3.0, WINDOW, quantised(heights), np.zeros(heights.shape[1:], bool))
    what = {"character": "Walker", "sole": "foot.L", "start_frame": 3.0, "end_frame": 3.0, "position": np.zeros(3),
            "heading": 0.0, "area_m2": 0.0, "peak_force_n": 0.0, "compressed_m3": 0.0, "rim_m3": 0.0,
            "unplaced_rim_m3": 0.0, "load_frames": np.zeros(0), "load_n": np.zeros(0)}  # fmt: skip
    return recorder.footprint(**what)


def relief(carves, look="snow"):
    low, high = WINDOW.corners(CELL)
    x, y = np.meshgrid(*(np.arange(a + SPACING / 2, b, SPACING) for a, b in zip(low, high, strict=True)))
    steps = relief_of_steps(carves, x.ravel(), y.ravel(), ReliefSettings(amounts.of_look(look)), blur_sigma=0.005)
    return steps, all_together(steps, x.size)[:, 0].reshape(x.shape)


def test_lumps_lie_in_what_is_loose_and_take_no_volume():
    steps, height = relief([carve((10, 70))])
    assert steps[0].change.shape[1] == 2
    loose = np.zeros(height.shape, bool)
    loose[2 * 29 : 2 * 51, 2 * 9 : 2 * 71] = True
    assert not height[~loose].any()
    assert 0.003 < height.max() < 0.024
    assert height.min() > -0.02, "nothing sinks below the loose matter"
    volume, moved = height.sum() * SPACING**2, np.abs(height).sum() * SPACING**2
    assert abs(volume) < 0.02 * moved


def test_small_lumps_are_more_than_large_ones():
    _, height = relief([carve((0, 80))])
    tops = (height[1:-1, 1:-1] >= np.max([np.roll(np.roll(height, i, 0), j, 1)[1:-1, 1:-1]
                                          for i in (-1, 0, 1) for j in (-1, 0, 1)], axis=0))  # fmt: skip
    heights = height[1:-1, 1:-1][tops & (height[1:-1, 1:-1] > 0.001)]
    small, large = (np.count_nonzero((heights > low) & (heights <= 2 * low)) for low in (0.002, 0.004))
    assert small > large > 0


def test_two_carves_over_each_other_show_the_lumps_of_one():
    _, once = relief([carve((0, 80), 0.04)])
    _, twice = relief([carve((0, 80)), carve((0, 80))])
    assert twice == pytest.approx(once, abs=1e-5)


def test_where_nothing_is_loose_nothing_changes():
    steps, height = relief([carve((0, 80), 0.0)])
    assert not height.any()
    assert not len(steps[0].point)
