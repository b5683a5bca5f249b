"""Ground that slides down to its angle of repose: volume, slopes, rest."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from softground_addon.core.pressing.repose import AT_REST, SWEEPS_TO_REST, slid

ANGLE = np.radians(32.0)
NOTHING_FIXED = np.zeros((80, 80), bool)


def steepest(heights, cell):
    """Steepest slope between neighbours, also across corners."""
    down = [heights[1:] - heights[:-1], heights[:, 1:] - heights[:, :-1]]
    across = [heights[1:, 1:] - heights[:-1, :-1], heights[1:, :-1] - heights[:-1, 1:]]
    return max(*(abs(d).max() for d in down), *(abs(d).max() / np.sqrt(2) for d in across)) / cell


def settled(rim, compression=None, terrain=None, *, cell=0.01, angle=ANGLE, fixed=None, sweeps=SWEEPS_TO_REST):
    zero = np.zeros_like(rim)
    return slid(
        rim,
        zero if compression is None else compression,
        zero if terrain is None else terrain,
        angle=angle,
        cell_size=cell,
        fixed=zero.astype(bool) if fixed is None else fixed,
        sweeps=sweeps,
    )


@pytest.mark.parametrize("cell", [0.02, 0.01, 0.005])
def test_a_tower_becomes_a_cone_of_the_angle_of_repose_and_of_the_same_volume(cell):
    # A cone of slope t and volume V is (3·V·t²/pi)^(1/3) high.
    size = round(0.8 / cell)
    place = (np.arange(size) + 0.5) * cell - 0.4
    x, y = np.meshgrid(place, place)
    tower = np.where(np.hypot(x, y) < 0.06, 0.1, 0.0)
    cone = settled(tower, cell=cell, sweeps=5000)
    volume = tower.sum() * cell**2
    assert cone.sum() == pytest.approx(tower.sum(), rel=1e-12)
    height = (3 * volume * np.tan(ANGLE) ** 2 / np.pi) ** (1 / 3)
    assert cone.max() == pytest.approx(height, abs=0.06 * height + 0.5 * cell * np.tan(ANGLE))
    assert steepest(cone, cell) <= np.tan(ANGLE) * (1 + 1.01 * AT_REST)
    # Round: as far along the axes as along the diagonals.
    reach = [np.hypot(x, y)[line & (cone > 0.01)].max() for line in (abs(y) < cell, abs(x - y) < cell)]
    assert reach[0] == pytest.approx(reach[1], rel=0.15)


@settings(max_examples=40)
@given(
    arrays(float, (12, 17), elements=st.floats(-0.05, 0.1)),
    arrays(float, (12, 17), elements=st.floats(0, 0.1)),
    arrays(bool, (12, 17)),
    st.floats(0.05, 1.5),
)
def test_the_volume_is_kept_and_fixed_cells_are_left_alone(rim, compression, fixed, angle):
    after = settled(rim, compression, angle=angle, fixed=fixed)
    assert after.sum() == pytest.approx(rim.sum(), abs=1e-12)
    assert (after[fixed] == rim[fixed]).all()
    free = ~fixed
    if free.any():
        assert (after - compression)[free].max() <= (rim - compression)[free].max() + 1e-12
        assert (after - compression)[free].min() >= (rim - compression)[free].min() - 1e-12


def test_what_is_no_steeper_keeps_every_bit():
    x, y = np.meshgrid(np.arange(40), np.arange(30))
    gentle = 0.5 * np.tan(ANGLE) * 0.01 * np.hypot(x - 20, y - 15)
    assert (settled(gentle) == gentle).all()


def test_the_undisturbed_terrain_holds_however_steep_and_what_is_piled_on_it_slides_down():
    x, _ = np.meshgrid(np.arange(60) * 0.01, np.arange(40))
    slope = 1.2 * x
    nothing = np.zeros_like(slope)
    assert (settled(nothing, terrain=slope) == 0).all()
    pile = nothing.copy()
    pile[15:25, 40:45] = 0.05
    after = settled(pile, terrain=slope)
    assert after.sum() == pytest.approx(pile.sum())
    assert (after * x).sum() / after.sum() < (pile * x).sum() / pile.sum() - 0.01


def test_the_walls_of_a_print_slide_into_it_once_the_sole_is_gone_and_not_before():
    compression = np.zeros((40, 40))
    compression[15:25, 12:28] = 0.04
    nothing = np.zeros_like(compression)
    under_sole = compression > 0
    assert (settled(nothing, compression, fixed=under_sole) == 0).all()
    after = settled(nothing, compression)
    assert after[under_sole].sum() > 0
    assert after[~under_sole].min() < 0
    assert steepest(after - compression, 0.01) <= np.tan(ANGLE) * (1 + 1.01 * AT_REST)
    assert abs(after.sum()) < 1e-12


def test_ground_that_is_none_neither_takes_nor_gives():
    terrain = np.zeros((20, 20))
    terrain[:, 10:] = np.nan
    rim = np.zeros((20, 20))
    rim[:, 9] = 0.1
    after = settled(rim, terrain=terrain, fixed=np.isnan(terrain))
    assert np.isfinite(after).all()
    assert not after[:, 10:].any()
    assert after.sum() == pytest.approx(rim.sum())


@settings(max_examples=30)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(0, 7),
    st.integers(0, 7),
    st.sampled_from([1, 4, SWEEPS_TO_REST]),
)
def test_what_lies_still_around_it_does_not_change_how_ground_slides_by_a_bit(seed, above, columns, sweeps):
    """The same cells pair up wherever a window starts, and only the box around what is too steep is swept."""
    chance = np.random.default_rng(seed)
    heap = np.zeros((61, 58))
    row, column = chance.integers(24, 32, 2)
    heap[row : row + 3, column : column + 4] = chance.uniform(-0.04, 0.06, (3, 4))
    wide = np.pad(heap, ((above, 9), (columns, 3)))
    corner = (10, -7)
    options = {"angle": ANGLE, "cell_size": 0.01, "sweeps": sweeps}
    here = slid(heap, 0 * heap, 0 * heap, fixed=np.zeros(heap.shape, bool), corner=corner, **options)
    inner = slid(
        wide,
        0 * wide,
        0 * wide,
        fixed=np.zeros(wide.shape, bool),
        corner=(corner[0] - above, corner[1] - columns),
        **options,
    )
    assert (inner[above : above + 61, columns : columns + 58] == here).all()
    assert (here != heap).any()
