"""A cell size that no memory holds, or that swallows a foot, is refused with one that works."""

import re

import pytest

from softground_addon.core.errors import InputError
from softground_addon.core.loads import cell_limits
from softground_addon.core.loads.cell_limits import (
    bake_time,
    check_cell_size,
    check_frames,
    machine_memory,
    pressed_area,
)
from tests.core.walkers import box_sole, standing

WEIGHT = 750.0
LOADS = standing(box_sole(0.2, 0.1), [(0.0, 0.0, 0.0)], WEIGHT)
FOR_EVER = float("inf")


def named_size(error):
    return float(re.search(r"at (?:least|most) ([\d.e+-]+) cm", str(error.value))[1]) / 1e2


def test_a_sole_that_stands_covers_its_area_once():
    assert pressed_area([LOADS]) == pytest.approx(0.02, rel=0.02)


def test_cells_that_no_memory_holds_are_refused_with_a_size_that_fits():
    with pytest.raises(InputError, match="GB of memory") as error:
        check_cell_size([LOADS], 1e-5, FOR_EVER, available=1e9)
    assert named_size(error) > 1e-5
    check_cell_size([LOADS], named_size(error), FOR_EVER, available=1e9)
    check_cell_size([LOADS], 1e-5, FOR_EVER, available=1e15)


def test_cells_that_swallow_a_sole_are_refused_with_a_size_that_shows_it():
    with pytest.raises(InputError, match="smaller than a cell") as error:
        check_cell_size([LOADS], 0.3, 60.0)
    assert named_size(error) == pytest.approx(0.02)
    check_cell_size([LOADS], 0.15, 60.0)


def test_frames_that_no_memory_holds_are_refused_with_what_they_would_take():
    with pytest.raises(InputError, match=r"2,097,149 frames from -1048574 .* 126 GB of memory and 6 hours"):
        check_frames(-1_048_574, 1_048_574, 1, FOR_EVER, available=24e9)
    check_frames(1, 100_000, 1, FOR_EVER, available=24e9)


def test_what_a_bake_takes_grows_with_the_cells_and_with_how_long_a_sole_is_on_them():
    longer = standing(box_sole(0.2, 0.1), [(0.0, 0.0, 0.0)], WEIGHT, seconds=11.0)
    cells = pressed_area([LOADS]) / 0.002**2
    assert bake_time([LOADS], 0.01) == pytest.approx(4 * bake_time([LOADS], 0.02), rel=0.02)
    assert bake_time([LOADS], 1e-5) == pytest.approx(16 * bake_time([LOADS], 2e-5), rel=0.02)
    held = bake_time([longer], 0.002) - bake_time([LOADS], 0.002)
    assert held == pytest.approx(10.0 * cells * cell_limits.SECONDS_PER_CELL_HELD, rel=0.02)


@pytest.mark.parametrize("available", [1e15, None])
def test_cells_that_take_too_long_are_refused_with_a_size_that_does_not(available):
    took = bake_time([LOADS], 2e-4)
    with pytest.raises(
        InputError, match=rf"GB of memory and {int(took / 60) + 1} minutes .* 1 minutes are allowed"
    ) as error:
        check_cell_size([LOADS], 2e-4, 60.0, available)
    assert 2e-4 < named_size(error) < 2e-3
    check_cell_size([LOADS], named_size(error), 60.0, available)
    check_cell_size([LOADS], 2e-4, took, available)


def test_no_size_is_named_where_none_helps():
    with pytest.raises(InputError, match=r"are allowed .*: bake fewer frames\.$"):
        check_cell_size([LOADS], 1e-3, 1e-9, 1e15)


def test_frames_that_take_too_long_are_refused():
    with pytest.raises(InputError, match=r"and 17 minutes, and 10 minutes are allowed"):
        check_frames(1, 100_000, 1, 600.0, available=1e15)
    check_frames(1, 100_000, 1, 1200.0, available=1e15)


@pytest.mark.parametrize(
    ("groups", "files", "limits"),
    [
        ("0::/user/bake\n", {"user/bake/memory.max": "max", "user/memory.max": "3000"}, {3000.0}),
        ("0::/elsewhere\n", {"memory.max": "2000"}, {2000.0}),
        ("9:cpu:/\n4:hugetlb,memory:/a/b\n", {"memory/a/b/memory.limit_in_bytes": "5000"}, {5000.0}),
        ("3:cpu:/\n", {"memory.max": "1"}, set()),
        (None, {}, set()),
    ],
)
def test_the_limits_of_containers_are_heeded(tmp_path, groups, files, limits):
    if groups is not None:
        (tmp_path / "proc/self").mkdir(parents=True)
        (tmp_path / "proc/self/cgroup").write_text(groups)
    for name, text in files.items():
        place = tmp_path / "sys/fs/cgroup" / name
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text)
    assert set(cell_limits._container_limits(tmp_path)) == limits


def test_the_machine_tells_its_memory_and_no_more_than_its_container_allows(monkeypatch):
    assert (machine_memory() or 1e9) > 1e8
    monkeypatch.setattr(cell_limits, "_container_limits", lambda: iter([3e12, 1e6]))
    assert machine_memory() == 1e6
