"""Places under a sole: as the print lies, whatever its heading, the later print over the earlier one."""

import dataclasses

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view

from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.record.footprints import QUANTUM, Changes
from softground_addon.core.relief.sole_marks import sole_marks
from tests.core.walkers import box_sole, pressed, standing

SNOW = GroundMaterial(375e3, 0.05, 0.2)
NOTHING = Changes(np.zeros(0), np.zeros(1, np.int32), np.zeros(0, np.int32), np.zeros(0, np.int32))


@pytest.fixture(scope="module")
def footprint():
    return pressed(standing(box_sole(0.26, 0.09), (0.1, 0.2, 0.0), 800.0), SNOW)[1][0]


@pytest.mark.parametrize("heading", [0.0, 0.7, -2.5])
def test_a_spot_ahead_of_the_middle_lies_ahead_under_the_sole(footprint, heading):
    turned = dataclasses.replace(footprint, heading=heading)
    marks = sole_marks([turned], footprint.cell_size)
    ahead, left = np.array((np.cos(heading), np.sin(heading))), np.array((-np.sin(heading), np.cos(heading)))
    for along, across in ((0.0, 0.0), (0.02, 0.0), (0.0, 0.015), (-0.03, -0.01)):
        place = footprint.position[:2] + along * ahead + across * left
        assert marks.sample(*place[:, None])[:2, 0] == pytest.approx((along, across), abs=1e-9)


def touched_and_marks(footprint):
    """Cells of a footprint's window that the sole touched, and how much of a mark it left on each."""
    touched = np.zeros(footprint.window.cells, dtype=bool)
    touched[footprint.contact_cells] = True
    marks = sole_marks([footprint], footprint.cell_size).read(footprint.window)[2]
    return touched.reshape(marks.shape), marks


def test_marks_are_where_the_sole_touched_and_nowhere_else(footprint):
    touched, marks = touched_and_marks(footprint)
    assert not marks[~touched].any()
    inside = sliding_window_view(np.pad(touched, 3), (7, 7)).all(axis=(2, 3))
    assert inside.sum() > 20
    assert (marks[inside] == 1).all()


@pytest.mark.parametrize(("slope", "share"), [(0.3, 1.0), (0.6, 0.5), (1.0, 0.0)])
def test_walls_bear_no_marks(footprint, slope, share):
    window, cell_size = footprint.window, footprint.cell_size
    depths = slope * cell_size * (np.arange(window.cells) % window.columns)
    changes = Changes(
        np.array([footprint.end_frame]),
        np.array([0, window.cells], dtype=np.int32),
        np.arange(window.cells, dtype=np.int32),
        np.rint(depths / QUANTUM).astype(np.int32),
    )
    touched, marks = touched_and_marks(dataclasses.replace(footprint, compression=changes))
    assert marks[touched] == pytest.approx(share, abs=1e-4)


def test_the_later_print_goes_over_the_earlier_one(footprint):
    later = dataclasses.replace(footprint, heading=footprint.heading + 1.0)
    marks = sole_marks([dataclasses.replace(footprint, compression=NOTHING), later], footprint.cell_size)
    alone = sole_marks([later], footprint.cell_size)
    assert (marks.read(footprint.window) == alone.read(footprint.window)).all()
