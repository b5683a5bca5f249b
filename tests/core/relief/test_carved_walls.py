"""Where a leg has carved beside a print, its relief moves no wall that is not there."""

import numpy as np
import pytest
from scipy.ndimage import maximum_filter, minimum_filter

from softground_addon.core.ground.display_blur import blurred
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.places import Places
from softground_addon.core.record.footprints import FootprintRecorder, quantised, recompose
from softground_addon.core.relief import amounts
from softground_addon.core.relief.carved_walls import REACH, ROUGHNESS, room
from softground_addon.core.relief.steps import ReliefSettings, all_together, relief_of_steps
from tests.core.walkers import pressed, walk

CELL, SPACING, CUT = 0.005, 0.0025, 0.2
POWDER = GroundMaterial(40e3, 0.0, 0.2, blur_sigma=0.005, layer_depth=0.6)


@pytest.fixture(scope="module")
def steps():
    return tuple(pressed(walk(steps=2), POWDER, CELL)[1])


def carve_around(print):
    """A leg that has cut all around a print, 20 cm deep."""
    window = print.window
    heights = np.zeros((2, window.rows, window.columns))
    heights[0] = np.maximum(CUT - recompose([print]).read(window)[0], 0.0)
    recorder = FootprintRecorder(CELL, 1.0)
    recorder.add(print.end_frame + 1.0, window, quantised(heights), np.zeros(heights.shape[1:], bool))
    return recorder.footprint(
        character=print.character, sole=print.sole, start_frame=print.end_frame, end_frame=print.end_frame + 1.0,
        position=print.position, heading=0.0, area_m2=0.0, peak_force_n=0.0, compressed_m3=0.0, rim_m3=0.0,
        unplaced_rim_m3=0.0, load_frames=np.zeros(0), load_n=np.zeros(0),
    )  # fmt: skip


def relief(footprints, x, y):
    shown = relief_of_steps(footprints, x, y, ReliefSettings(amounts.of_look("snow")), blur_sigma=POWDER.blur_sigma)
    return all_together(shown, len(x))


def test_no_wall_is_moved_that_a_leg_has_cut_away(steps):
    first = steps[0]
    assert first.max_depth_m > CUT + 0.05
    low, high = (corner - end * CELL for corner, end in zip(first.window.corners(CELL), (-4, 4), strict=True))
    grid = np.meshgrid(*(np.arange(a + SPACING / 2, b, SPACING) for a, b in zip(low, high, strict=True)))
    x, y = (axis.ravel() for axis in grid)
    footprints = [first, carve_around(first)]
    field = blurred(recompose(footprints), POWDER.blur_sigma)
    compression, rim = field.sample(x, y)
    shown = ((rim - compression) + relief(footprints, x, y)[:, 0]).reshape(grid[0].shape)
    ground = (rim - compression).reshape(shown.shape)
    around = 2 * round((REACH + 2 * CELL) / SPACING) + 1
    assert (shown - maximum_filter(ground, around)).max() < ROUGHNESS + 1e-3, "no needle stands up"
    assert (minimum_filter(ground, around) - shown).max() < ROUGHNESS + 1e-3, "nor is one pressed in"
    bent = np.abs(relief([first], x, y)[:, 0]).max()
    assert bent > CUT / 2, "the wall of the print alone is bent"


def test_what_rises_less_is_compressed_more(steps):
    first, _ = steps
    x, y = (axis.ravel() for axis in np.meshgrid(*first.window.centres(CELL)))
    alone, carved = relief([first], x, y), relief([first, carve_around(first)], x, y)
    np.testing.assert_allclose((carved - alone).sum(axis=1), 0.0, atol=1e-5)
    assert np.abs(carved - alone).max() > 0.05


def test_beyond_the_carve_relief_is_what_it_was(steps):
    first, second = steps
    x, y = (axis.ravel() for axis in np.meshgrid(*second.window.centres(CELL)))
    carve = carve_around(first)
    beyond = np.ones(len(x), bool)
    beyond[Places(x, y).within(carve.window.expanded(4), CELL)] = False
    assert beyond.any()
    before, after = relief([first, second], x, y), relief([first, second, carve], x, y)
    np.testing.assert_array_equal(after[beyond], before[beyond])
    low, high = room([first, second], Places(x, y), 0.005)
    assert np.isinf(low).all()
    assert np.isinf(high).all()


def test_tread_on_the_floor_of_a_print_is_what_it_was(steps):
    first = steps[0]
    x, y = (axis.ravel() for axis in np.meshgrid(*first.window.centres(CELL)))
    footprints = [first, carve_around(first)]
    compression, rim = blurred(recompose(footprints), POWDER.blur_sigma).read(first.window)
    around = 2 * round(REACH / CELL + 1) + 1
    flat = np.ptp([f(rim - compression, around) for f in (minimum_filter, maximum_filter)], axis=0).ravel() < ROUGHNESS
    pressed = flat & (compression.ravel() > CUT)
    assert pressed.sum() > 20
    settings = ReliefSettings(amounts.of_look("snow"), strength=5.0)
    shown = [
        all_together(relief_of_steps(each, x, y, settings, blur_sigma=POWDER.blur_sigma), len(x))
        for each in (footprints[:1], footprints)
    ]
    np.testing.assert_array_equal(shown[1][pressed], shown[0][pressed])
