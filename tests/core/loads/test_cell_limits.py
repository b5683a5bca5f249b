"""A cell size that no memory holds, or that swallows a foot, is refused with one that works."""

import re

import pytest

from softground_addon.core.composers.simulation import simulate
from softground_addon.core.errors import InputError
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.loads import cell_limits
from softground_addon.core.loads.cell_limits import Fineness, check_cell_size, check_frames, coverage_of, machine_memory
from softground_addon.core.pressing.contact_layout import ContactLayout
from tests.core.walkers import box_sole, foot_sole, sphere_sole, standing, walk

WEIGHT = 750.0
LOADS = standing(box_sole(0.2, 0.1), [(0.0, 0.0, 0.0)], WEIGHT)
FOR_EVER = float("inf")
SNOW = GroundMaterial(0.25e6, 0.05, 0.2)
REACH = SNOW.rim_reach
"""Of the rim [m]."""


def named_size(error):
    return float(re.search(r"at (?:least|most) ([\d.e+-]+) cm", str(error.value))[1]) / 1e2


def test_a_sole_that_stands_covers_its_area_once():
    assert coverage_of([LOADS]).area == pytest.approx(0.02, rel=0.02)


def test_cells_that_no_memory_holds_are_refused_with_a_size_that_fits():
    with pytest.raises(InputError, match="GB of memory") as error:
        check_cell_size([LOADS], Fineness(1e-5, REACH), FOR_EVER, available=1e9)
    assert named_size(error) > 1e-5
    check_cell_size([LOADS], Fineness(named_size(error), REACH), FOR_EVER, available=1e9)
    check_cell_size([LOADS], Fineness(1e-5, REACH), FOR_EVER, available=1e15)


def test_cells_that_swallow_a_sole_are_refused_with_a_size_that_shows_it():
    with pytest.raises(InputError, match="smaller than a cell") as error:
        check_cell_size([LOADS], Fineness(0.3, REACH), 60.0)
    assert named_size(error) == pytest.approx(0.02)
    check_cell_size([LOADS], Fineness(0.15, REACH), 60.0)


def test_frames_that_no_memory_holds_are_refused_with_what_they_would_take():
    with pytest.raises(InputError, match=r"2,097,149 frames from -1048574 .* 126 GB of memory and 6 hours"):
        check_frames(-1_048_574, 1_048_574, 1, FOR_EVER, available=24e9)
    check_frames(1, 100_000, 1, FOR_EVER, available=24e9)


def seconds(coverage, cell_size):
    return coverage.bake_costs(Fineness(cell_size, REACH))[1]


def test_what_a_bake_takes_grows_with_the_cells_and_with_how_long_a_sole_is_on_them():
    longer = standing(box_sole(0.2, 0.1), [(0.0, 0.0, 0.0)], WEIGHT, seconds=11.0)
    once, held = (coverage_of([loads]) for loads in (LOADS, longer))
    cells = (0.2 + 2 * REACH) * (0.1 + 2 * REACH) / 0.002**2
    assert once.cells(0.01, REACH) == pytest.approx(4 * once.cells(0.02, REACH))
    assert seconds(once, 1e-5) == pytest.approx(16 * seconds(once, 2e-5), rel=0.02)
    steps = 10.0 / LOADS.motion.time_step
    taken = seconds(held, 0.002) - seconds(once, 0.002)
    assert taken == pytest.approx(steps * cells * cell_limits.SECONDS_PER_CELL_LAID_OUT, rel=0.02)


def shrunk_foot(size):
    """A flat foot so many times as large as an adult's."""
    return box_sole(0.27 * size, 0.1 * size, spacing=0.005 * size)


@pytest.mark.parametrize(
    ("loads", "cell_size"),
    [
        *((standing(shrunk_foot(size), [(0.0, 0.0, 0.0)], WEIGHT * size**3), 0.004) for size in (0.03, 0.1, 0.3, 1, 3)),
        *((standing(shrunk_foot(0.1), [(0.0, 0.0, 0.0)], WEIGHT * 1e-3), cell) for cell in (0.001, 0.002, 0.008)),
        *((standing(foot_sole("foot", "L"), [(0.0, 0.0, 0.0)], WEIGHT, seconds=s), 0.005) for s in (0.2, 20.0)),
        (standing(sphere_sole(0.1), [(0.0, 0.0, 0.0)], WEIGHT), 0.004),
        *((walk(steps=steps), 0.006) for steps in (2, 12)),
        (walk(steps=4), 0.02),
    ],
    ids=str,
)
def test_the_cells_of_the_estimate_are_those_that_are_pressed_and_laid_out(loads, cell_size, monkeypatch):
    laid_out, lay_out = [], ContactLayout.lay_out

    def counting(*arguments):
        imprints = lay_out(*arguments)
        laid_out.append(imprints.coverage.size)
        return imprints

    monkeypatch.setattr(ContactLayout, "lay_out", counting)
    results = simulate([loads], SoftGround(FlatTerrain(), SNOW), cell_size)
    prints = [footprint for result in results for footprint in result.footprints]
    changed = sum(len({*each.compression.cells.tolist(), *each.rim.cells.tolist()}) for each in prints)
    coverage = coverage_of([loads])
    assert 0.5 < coverage.cells(cell_size, SNOW.rim_reach) / changed < 2
    assert 0.5 < coverage.laid_out(cell_size, SNOW.rim_reach) @ coverage.steps / sum(laid_out) < 2


@pytest.mark.parametrize("available", [1e15, None])
def test_cells_that_take_too_long_are_refused_with_a_size_that_does_not(available):
    took = seconds(coverage_of([LOADS]), 2e-4)
    with pytest.raises(
        InputError, match=rf"GB of memory and {int(took / 60) + 1} minutes .* 1 minutes are allowed"
    ) as error:
        check_cell_size([LOADS], Fineness(2e-4, REACH), 60.0, available)
    assert 2e-4 < named_size(error) < 2e-3
    check_cell_size([LOADS], Fineness(named_size(error), REACH), 60.0, available)
    check_cell_size([LOADS], Fineness(2e-4, REACH), took, available)


def test_no_size_is_named_where_none_helps():
    with pytest.raises(InputError, match=r"are allowed: bake fewer frames\.$"):
        check_cell_size([LOADS], Fineness(1e-3, REACH), 1e-9, 1e15)


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
