"""A cell size that no memory holds, or that swallows a foot, is refused with one that works."""

import re

import pytest

from softground_addon.core.errors import InputError
from softground_addon.core.loads.cell_limits import check_cell_size, machine_memory, pressed_area
from tests.core.walkers import box_sole, standing

WEIGHT = 750.0
LOADS = standing(box_sole(0.2, 0.1), [(0.0, 0.0, 0.0)], WEIGHT)


def named_size(error):
    return float(re.search(r"at (?:least|most) ([\d.e+-]+) mm", str(error.value))[1]) / 1e3


def test_a_sole_that_stands_covers_its_area_once():
    assert pressed_area([LOADS]) == pytest.approx(0.02, rel=0.02)


def test_cells_that_no_memory_holds_are_refused_with_a_size_that_fits():
    with pytest.raises(InputError, match="GB of memory") as error:
        check_cell_size([LOADS], 1e-5, available=1e9)
    assert named_size(error) > 1e-5
    check_cell_size([LOADS], named_size(error), available=1e9)
    check_cell_size([LOADS], 1e-5, available=1e15)


def test_cells_that_swallow_a_sole_are_refused_with_a_size_that_shows_it():
    with pytest.raises(InputError, match="smaller than a cell") as error:
        check_cell_size([LOADS], 0.3)
    assert named_size(error) == pytest.approx(0.02)
    check_cell_size([LOADS], 0.15)


def test_the_machine_tells_its_memory():
    assert (machine_memory() or 1e9) > 1e8
