"""Places under a sole: as the print lies, whatever its heading, the later print over the earlier one."""

import dataclasses

import numpy as np
import pytest

from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.record.sole_marks import sole_marks
from tests.core.walkers import box_sole, pressed, standing

SNOW = GroundMaterial(375e3, 0.05, 0.2)


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


def test_marks_are_where_the_sole_touched_and_nowhere_else(footprint):
    marks = sole_marks([footprint], footprint.cell_size)
    touched = np.zeros(footprint.window.cells, dtype=bool)
    touched[footprint.contact_cells] = True
    assert (marks.read(footprint.window)[2].ravel() == touched).all()


def test_the_later_print_goes_over_the_earlier_one(footprint):
    later = dataclasses.replace(footprint, heading=footprint.heading + 1.0)
    marks = sole_marks([footprint, later], footprint.cell_size)
    alone = sole_marks([later], footprint.cell_size)
    assert (marks.read(footprint.window) == alone.read(footprint.window)).all()
