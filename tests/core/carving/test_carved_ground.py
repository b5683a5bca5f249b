"""The ground of a shot as bodies carve it: walls on either side of a border stand as their own ground does."""

import numpy as np
import pytest

from softground_addon.core.carving.carved_ground import CarvedGround, Drawn
from softground_addon.core.carving.carved_step import CarvedStep
from softground_addon.core.carving.carver import TOLERANCE, Walls, of_ground
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.regions import GroundKind
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.ground.sparse_grid import Window
from softground_addon.core.ground.surfaces import SURFACES
from softground_addon.core.record.footprints import FootprintRecorder, recompose
from tests.core.ground.test_regions import pressed, stripes
from tests.core.walkers import walk

CELL = 0.01
DEEP = GroundMaterial(youngs_modulus=3e5, poisson_ratio=0.0, characteristic_time=0.2, layer_depth=0.6)


@pytest.mark.parametrize("surfaces", [("snow", "mud"), ("mud", "snow")])
@pytest.mark.parametrize("of_step", ["snow", "mud"])
def test_walls_crumble_as_the_region_that_they_are_in_whoever_carves_them(surfaces, of_step):
    ground = stripes([0.0], [GroundKind(surface, DEEP) for surface in surfaces])
    footprint = pressed(walk(steps=1), ground)[1][0]
    walls = Walls.of(SURFACES[of_step], DEEP, ground.gravity)
    step = CarvedStep(footprint, True, FootprintRecorder(CELL, 1.0), walls)
    carving, frame = CarvedGround(ground, CELL, [step], 24.0), footprint.end_frame + 2.0
    carving.press(-np.inf, frame)
    trench = Window(-40, 120, 80, 20)
    carving.carve(Drawn(step, trench, np.full((4, trench.rows, trench.columns), -0.3), np.zeros(2)), [], frame)
    carving.leave(step)
    for later in range(1, 4):
        carving.settle([], frame + later)
    carve = carving.footprint(step)
    cut = carve.tile(carve.compression)
    beside = slice(trench.row - 5 - carve.window.row, trench.row - carve.window.row)
    x = carve.window.centres(CELL)[0]
    sides = zip(surfaces, (x < -0.05, x > 0.05), strict=True)
    broken = {surface: (cut[beside, side] > 1e-6).mean() for surface, side in sides}
    assert broken["mud"] == 0.0
    assert broken["snow"] > 0.02


def test_a_fine_ground_is_carved_in_cells_of_2_x_2_yet_to_each_of_its_own():
    cell, ground = CELL / 2, SoftGround(FlatTerrain(), DEEP)
    footprint = pressed(walk(steps=1), ground, cell)[1][0]
    walls = Walls(0.25, np.inf, np.radians(40.0))
    step = CarvedStep(footprint, True, FootprintRecorder(cell, 1.0), walls)
    carving, frame = CarvedGround(ground, cell, [step], 24.0), footprint.end_frame + 2.0
    carving.press(-np.inf, frame)
    row, column = footprint.window.row // 2 + 3, footprint.window.column // 2 - 4
    hole = Window(column, row, footprint.window.columns // 2, 12)  # half of it beside the print
    underside = np.full((4, hole.rows, hole.columns), np.inf)
    underside[:2, 3:], underside[2:, :-2] = -0.3, -0.35
    carving.carve(Drawn(step, hole, underside, np.zeros(2)), [], frame)
    carving.finish(step, frame + 1.0)
    carve, shown = carving.footprint(step), of_ground(underside)
    assert carve.cell_size == cell
    here = carve.window.slices(hole.refined(2))
    before = recompose([footprint]).read(hole.refined(2))
    standing = (before[1] - before[0]) - carve.tile(carve.compression)[here]
    assert (before[0] > 0.05).any(), "it meets the print"
    assert standing == pytest.approx(np.minimum(before[1] - before[0], shown), abs=2 * TOLERANCE)
    assert carve.tile(carve.compression).sum() * cell**2 == pytest.approx(carve.compressed_m3, rel=1e-6)
    assert carve.tile(carve.rim).sum() * cell**2 == pytest.approx(carve.rim_m3, rel=1e-6)
    assert carve.rim_m3 == pytest.approx(0.75 * carve.compressed_m3, rel=1e-9)
