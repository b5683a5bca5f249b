"""Cells that a body carves: nothing is lost, nothing heals, sand lies at its angle and mud stands."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softground_addon.core.carving.carver import EDGE, REACH, CarvedCells, Walls, pieces
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.sparse_grid import Window
from softground_addon.core.ground.surfaces import SURFACES
from softground_addon.core.pressing.repose import NEIGHBOURS, SWEEPS_TO_REST

CELL = 0.01
MATERIAL = GroundMaterial(youngs_modulus=1e5, poisson_ratio=0.1, characteristic_time=0.2, layer_depth=0.6)
NOBODY = np.zeros(2)


def walls_of(surface, angle=None):
    walls = Walls.of(SURFACES[surface], MATERIAL, 9.81)
    return walls if angle is None else Walls(walls.packing, walls.strength, np.radians(angle))


def level(rows=60, columns=60, quarters=1):
    """Level ground, whose quarters may be cells of their own."""
    nothing, flat = np.zeros((rows, columns), bool), np.zeros((rows, columns))
    pressed = np.zeros((4, rows, columns)) if quarters > 1 else flat.copy()
    return CarvedCells(CELL, flat, nothing, nothing.copy(), pressed, np.full((4, *flat.shape), np.inf), flat.copy())


def block(cells, low, high, bottom):
    """The underside of an upright block between two corners (row, column)."""
    underside = np.full((4, *cells.loose.shape), np.inf)
    underside[:, low[0] : high[0], low[1] : high[1]] = bottom
    return underside


def steepest(surface):
    """Steepest slope between neighbouring cells [degrees]."""
    ways = [np.abs(surface[each] - surface[other]).max() / np.hypot(*way) for each, other, way in NEIGHBOURS]
    return np.degrees(np.arctan(max(ways) / CELL))


@pytest.mark.parametrize("surface", SURFACES)
def test_a_block_cuts_its_own_volume_of_which_the_wall_takes_its_part(surface):
    cells, walls = level(), walls_of(surface)
    cells.cut(block(cells, (20, 25), (30, 40), -0.2), NOBODY, walls.packing)
    assert cells.cut_height == pytest.approx(10 * 15 * 0.2, rel=1e-12)
    assert cells.packed == pytest.approx(walls.packing * cells.cut_height, rel=1e-12)
    assert cells.loose.sum() == pytest.approx((1.0 - walls.packing) * cells.cut_height, rel=1e-12)
    assert cells.unplaced == 0.0
    assert (cells.surface[20:30, 25:40] == -0.2).all(), "nothing is laid where the block is"
    laid = np.argwhere(cells.loose > 0)
    assert laid.min() > 20 - REACH / CELL - 1
    assert laid.max() < 40 + REACH / CELL + 1


def test_what_is_cut_goes_ahead_of_the_body():
    cells = level()
    cells.cut(block(cells, (25, 25), (35, 35), -0.1), np.array([0.05, 0.0]), 0.0)
    rows, columns = np.indices(cells.loose.shape)
    middle_row, middle_column = ((cells.loose * index).sum() / cells.loose.sum() for index in (rows, columns))
    assert middle_row == pytest.approx(29.5, abs=0.05)
    assert middle_column > 31.0


def test_what_a_wide_body_cuts_is_laid_beyond_it_and_towers_nowhere():
    """A belly that hovers all around a leg leaves one cell of room beside it: all of it came to lie there."""
    cells, leg = level(), block(level(), (25, 25), (35, 35), -0.05)
    bodies = np.minimum(leg, block(cells, (17, 17), (43, 43), 0.0))[0]
    bodies[24, 30] = np.inf
    cells.cut(leg, NOBODY, 0.0, bodies)
    assert cells.loose.sum() == pytest.approx(10 * 10 * 0.05, rel=1e-12)
    assert cells.loose.max() < 0.09, "no higher than beside a leg alone"
    assert walls_of("snow").reach(cells.surface, cells.loose, CELL) < 20


def test_what_slides_off_a_spike_comes_no_farther_than_a_heap_of_it_does():
    loose = np.zeros((40, 40))
    loose[20, 20] = 11.0
    heap = np.cbrt(3 * 11.0 * CELL**2 / (np.pi * np.tan(walls_of("sand").repose)))
    assert walls_of("sand").reach(loose, loose, CELL) <= np.ceil(heap / CELL) + 1


def test_nothing_is_laid_higher_than_what_hovers_over_it():
    cells = level()
    over = block(cells, (0, 0), (60, 60), 0.05)
    cells.cut(
        block(cells, (10, 10), (50, 50), -0.5), NOBODY, 0.0, np.minimum(over, block(cells, (10, 10), (50, 50), -0.5))[0]
    )
    assert cells.unplaced > 0
    assert cells.surface.max() <= 0.05


def test_thin_layers_are_gathered_and_nothing_of_them_is_lost():
    cells = level()
    cells.loose[5:15, 5:15], cells.loose[20:30, 20:40] = 0.01, 0.0004
    shown = np.zeros_like(cells.loose)
    shown[25:30, 20:40] = 0.0006
    total = cells.loose.sum()
    cells.gather(shown, 0.001)
    assert cells.loose.sum() == pytest.approx(total, rel=1e-12)
    assert np.array_equal(cells.loose[20:30, 20:40], shown[20:30, 20:40])
    assert cells.loose[5:15, 5:15] == pytest.approx(0.01 - 100 * 0.0002 / 100 + 100 * 0.0004 / 100, rel=1e-9)


def test_without_room_what_is_cut_is_counted_as_unplaced():
    cells = level(8, 8)
    cells.cut(block(cells, (0, 0), (8, 8), -0.1), NOBODY, 0.25)
    assert cells.unplaced == pytest.approx(0.75 * 64 * 0.1, rel=1e-12)
    assert not cells.loose.any()


def test_a_sole_that_presses_packs_what_lies_under_it_and_is_not_cut_by_its_own_skin():
    cells = level()
    cells.contact[10:20, 10:20] = True
    cells.loose[:] = 0.01
    cells.cut(block(cells, (10, 10), (20, 20), 0.004), NOBODY, 0.5)
    assert cells.cut_height == 0.0
    cells.pack()
    assert cells.packed == pytest.approx(100 * 0.01, rel=1e-12)
    assert not cells.loose[10:20, 10:20].any()


@given(seed=st.integers(0, 2**32 - 1), surface=st.sampled_from(list(SURFACES)), quarters=st.sampled_from([1, 4]))
@settings(max_examples=40, deadline=None)
def test_whatever_bodies_do_nothing_is_lost_and_no_cut_heals(seed, surface, quarters):
    rng = np.random.default_rng(seed)
    cells, walls = level(40, 50, quarters), walls_of(surface)
    cells.terrain = rng.normal(0, 0.02, (40, 1)).cumsum(axis=0) + np.zeros((40, 50))
    cells.pressed = cells.pressed + cells.terrain
    cells.closed[:, 45:] = rng.random() < 0.5
    volume, pressed = cells.surface.sum(), 0.0
    for _ in range(6):
        low = rng.integers(0, 30, 2)
        high = low + rng.integers(1, 15, 2)
        bottom = cells.terrain.min() - rng.uniform(-0.1, 0.4)
        before, standing = cells.lowest.copy(), cells.standing.copy()
        cells.cut(block(cells, low, high, bottom), rng.normal(0, 0.03, 2), walls.packing)
        assert (cells.standing <= standing).all()
        cells.slide(walls, np.zeros_like(cells.closed), (3, 4), 24)
        if rng.random() < 0.5:
            earlier = cells.surface.sum()
            sole = np.zeros_like(cells.pressed)
            sole[..., low[0] : high[0], low[1] : high[1]] = -rng.uniform(0, 0.3, (*sole.shape[:-2], 1, 1))
            cells.press(cells.pressed + sole + rng.uniform(0, 0.01))
            pressed += cells.surface.sum() - earlier
        cells.contact = rng.random(cells.contact.shape) < 0.05
        cells.pack()
        assert (cells.lowest <= before).all()
        assert (cells.loose >= 0).all()
    assert cells.surface.sum() == pytest.approx(volume + pressed - cells.packed - cells.unplaced, rel=1e-9, abs=1e-9)


def test_a_hole_in_dry_sand_becomes_a_funnel_no_steeper_than_its_angle():
    cells, walls = level(120, 120), walls_of("sand", angle=32.0)
    cells.cut(block(cells, (55, 55), (65, 65), -0.3), NOBODY, walls.packing)
    cells.slide(walls, np.zeros_like(cells.closed), (0, 0), 20 * SWEEPS_TO_REST)
    assert steepest(cells.surface) < 33.0
    assert cells.surface.min() > -0.25, "its bottom fills"
    assert cells.surface.sum() == pytest.approx(-cells.packed, rel=1e-9)


@pytest.mark.parametrize(("surface", "depth"), [("mud", 0.4), ("snow", 0.5), ("soil", 0.4)])
def test_walls_stand_that_their_cohesion_holds(surface, depth):
    cells, walls = level(), walls_of(surface)
    cells.cut(block(cells, (25, 25), (35, 35), -depth), NOBODY, 1.0)
    before = cells.surface
    cells.slide(walls, np.zeros_like(cells.closed), (0, 0), SWEEPS_TO_REST)
    assert np.array_equal(cells.surface, before)


def test_a_wall_falls_that_is_higher_than_its_cohesion_holds():
    cells, walls = level(), walls_of("mud")
    cells.cut(block(cells, (25, 25), (35, 35), -walls.strength - 0.2), NOBODY, 1.0)
    cells.slide(walls, np.zeros_like(cells.closed), (0, 0), 4 * SWEEPS_TO_REST)
    highest = max(np.abs(cells.surface[each] - cells.surface[other]).max() for each, other, _ in NEIGHBOURS)
    assert highest < walls.strength + 0.02
    assert cells.loose.sum() == pytest.approx(cells.cut_height - cells.packed, rel=1e-9), "what fell was cut"
    assert cells.surface.sum() == pytest.approx(-cells.packed, rel=1e-9)


@pytest.mark.parametrize("quarters", [1, 4])
def test_the_rim_of_a_later_print_rises_on_carved_ground(quarters):
    cells = level(quarters=quarters)
    cells.cut(block(cells, (20, 20), (30, 30), -0.2), NOBODY, 1.0)
    volume = cells.surface.sum()
    rim = np.zeros_like(cells.pressed)
    rim[..., 18:32, 18:32] = 0.01
    cells.press(cells.pressed + rim)
    assert cells.surface.sum() == pytest.approx(volume + rim.sum() / quarters, rel=1e-12)
    assert cells.cut_height == pytest.approx(cells.packed + cells.loose.sum(), rel=1e-12), "what rose there is loose"


def test_a_cell_is_cut_by_the_share_that_is_covered_and_no_further_when_that_passes_again():
    cells = level()
    underside = block(cells, (20, 20), (30, 30), -0.2)
    underside[:2, 29] = np.inf
    for _ in range(3):
        cells.cut(underside, NOBODY, 1.0)
    assert cells.cut_height == pytest.approx((90 + 10 * 0.5) * 0.2, rel=1e-12)
    assert cells.surface[29, 20:30] == pytest.approx(-0.1, abs=1e-12)


def test_a_wall_is_as_high_as_a_vertical_cut_may_be():
    """Terzaghi: Hc = 4·c/(rho·g)·tan(45° + phi/2); of mud of 2 kPa and 1,700 kg/m³ at 15°, 0.625 m."""
    assert walls_of("mud").strength == pytest.approx(4 * 2000 / (1700 * 9.81) * np.tan(np.radians(52.5)), rel=1e-12)
    assert walls_of("sand").strength == 0.0


def trench(cell_size, surface, bottom=-0.3):
    """A trench of 0.2 m in a square of 0.6 m, with its walls."""
    count = round(0.6 / cell_size)
    nothing, flat = np.zeros((count, count), bool), np.zeros((count, count))
    quarters = np.full((4, count, count), np.inf)
    cells = CarvedCells(cell_size, flat, nothing, nothing.copy(), flat.copy(), quarters, flat.copy())
    quarters[:, :, round(0.2 / cell_size) : round(0.4 / cell_size)] = bottom
    return cells, walls_of(surface), Window(7, -3, count, count)


@pytest.mark.parametrize("cell_size", [0.01, 0.005])
def test_edges_of_walls_break_off_and_nothing_is_lost(cell_size):
    cells, walls, window = trench(cell_size, "snow")
    surface, standing = cells.surface, cells.standing
    nobody = np.zeros(surface.shape, bool)
    cells.crumble(pieces(window, cell_size, walls.crumbling), nobody)
    np.testing.assert_allclose(cells.surface, surface, atol=1e-12)  # what broke off has not fallen yet
    assert cells.loose.sum() == pytest.approx(cells.cut_height, rel=1e-12)
    fallen = standing - cells.standing
    assert fallen.min() >= 0.0
    away = np.abs(window.centres(cell_size)[0] - (window.column * cell_size + 0.3)) - 0.1
    assert not fallen[:, (away > EDGE + cell_size) | (away < 0)].any(), "only the edges break"
    assert 0.3 < (fallen[:, (away > 0) & (away < EDGE / 3)] > 0).mean() < 0.7, "in pieces"
    cells.slide(walls, nobody, (window.row, window.column), 300)
    floor = np.flatnonzero(away < 0)
    assert cells.loose[:, floor].sum() > 0.3 * cells.cut_height, "much of it lies on the floor"
    assert cells.loose.sum() == pytest.approx(cells.cut_height, rel=1e-9)


def test_pieces_do_not_depend_on_cells_or_windows():
    volumes = []
    for cell_size in (0.01, 0.005):
        cells, walls, window = trench(cell_size, "snow")
        window = Window(round(0.07 / cell_size), round(-0.03 / cell_size), window.rows, window.columns)
        cells.crumble(pieces(window, cell_size, walls.crumbling), np.zeros(cells.loose.shape, bool))
        volumes.append(cells.cut_height * cell_size**2)
    assert volumes[0] == pytest.approx(volumes[1], rel=0.1)
    small, large = Window(4, 5, 10, 12), Window(0, 0, 30, 40)
    np.testing.assert_array_equal(pieces(large, 0.01, 0.06)[large.slices(small)], pieces(small, 0.01, 0.06))


def test_a_body_in_the_ground_holds_the_wall_and_mud_flows():
    cells, walls, window = trench(0.01, "snow")
    cells.crumble(pieces(window, 0.01, walls.crumbling), np.ones(cells.loose.shape, bool))
    assert cells.cut_height == 0.0
    assert walls_of("mud").crumbling == walls_of("sand").crumbling == 0.0


def test_walls_recede_hardly_further_however_many_go_by():
    cells, walls, window = trench(0.01, "snow")
    nobody = np.zeros(cells.loose.shape, bool)
    cells.crumble(pieces(window, 0.01, walls.crumbling), nobody)
    cells.slide(walls, nobody, (window.row, window.column), 300)
    once = cells.cut_height
    for _ in range(8):
        cells.crumble(pieces(window, 0.01, walls.crumbling), nobody)
        cells.slide(walls, nobody, (window.row, window.column), 300)
    assert cells.cut_height < 1.3 * once


def test_a_ridge_between_two_holes_breaks_off_once_though_a_leg_has_cut_it_down():
    cells, walls, window = trench(0.01, "snow")
    nobody, ridge = np.zeros(cells.loose.shape, bool), slice(27, 33)
    cells.lowest[:, :, ridge] = -0.15
    before = cells.standing
    for _ in range(2):
        cells.crumble(pieces(window, 0.01, walls.crumbling), nobody)
    fallen = (before - cells.standing)[:, ridge]
    assert 0.3 < (fallen > 0).mean() < 0.7, "in pieces"
    assert (fallen <= pieces(window, 0.01, walls.crumbling)[:, ridge] + 1e-12).all()
    assert cells.loose.sum() == pytest.approx(cells.cut_height, rel=1e-12)


@pytest.mark.parametrize("height", [0.0, 5.0])
def test_neither_the_edge_of_a_ground_nor_a_bank_that_nobody_cut_breaks(height):
    cells, walls, window = trench(0.01, "snow", bottom=np.inf)
    cells.terrain = np.full_like(cells.terrain, height)
    cells.terrain[:, 30:] -= 0.2
    cells.pressed = cells.terrain.copy()
    cells.closed[:10], cells.terrain[:10], cells.pressed[:10] = True, 0.0, 0.0
    cells.crumble(pieces(window, 0.01, walls.crumbling), np.zeros(cells.loose.shape, bool))
    assert cells.cut_height == 0.0


def test_nothing_breaks_below_the_floor_of_the_layer():
    cells, walls, window = trench(0.01, "snow")
    floor = np.full(cells.loose.shape, -0.3)
    floor[:30] = -0.02
    cells.crumble(pieces(window, 0.01, walls.crumbling), np.zeros(cells.loose.shape, bool), floor)
    uncut = cells.lowest[0] > -0.29
    assert (cells.standing[:30][uncut[:30]] >= -0.02 - 1e-12).all()
    assert cells.cut_height > 0.0


@pytest.mark.parametrize("slope", [0.6, 1.0])
@pytest.mark.parametrize("depth", [0.02, 0.12])
def test_a_hillside_is_no_wall(slope, depth):
    broken = []
    for rise in (0.0, slope):
        cells, walls, window = trench(0.01, "snow", bottom=-depth)
        hill = rise * window.centres(0.01)[0] + np.zeros_like(cells.terrain)
        cells.terrain, cells.pressed, cells.lowest = hill, hill.copy(), cells.lowest + hill
        cells.crumble(pieces(window, 0.01, walls.crumbling), np.zeros(cells.loose.shape, bool))
        broken.append(cells.loose)
    np.testing.assert_allclose(broken[1], broken[0], atol=1e-12)
    assert broken[0].any() == (depth > 0.06)
