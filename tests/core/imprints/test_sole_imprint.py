"""Where posed soles meet the ground, against areas known in closed form."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from softground_addon.core.ground.heightfield import FlatTerrain, TerrainTiles
from softground_addon.core.imprints.sole_imprint import cell_coverage, patches_over_cells
from softground_addon.core.imprints.sole_points import TOLERANCE, centroid, contact_window, point_contact, sole_points
from softground_addon.core.motion.sole_motion import Sole
from tests.core.walkers import box_sole, foot_sole, pose, sphere_sole

LENGTH, WIDTH = 0.25, 0.09


class Ground:
    """A terrain from a function of x and y."""

    def __init__(self, function):
        self.function = function

    def heights(self, x, y):
        return self.function(x, y)


def lay(sole, transforms, cell_size, *, terrain=None, sinkage=0.0):
    """Points over the ground, the cells' coverage and their window, for poses (N, P, 4, 4)."""
    terrain = terrain or FlatTerrain()
    points = sole_points(sole, transforms)
    divisions = points.cell_divisions(cell_size)
    window = contact_window(points, transforms, cell_size)
    ground = TerrainTiles(terrain, cell_size / divisions).surface(window.refined(divisions))
    contact = point_contact(points, transforms, ground)
    coverage = cell_coverage(
        patches_over_cells(sole, transforms, ground, lowest=contact.lowest, tolerance=points.tolerance),
        ground.window,
        sinkage=np.full(len(transforms), sinkage),
        tolerance=points.tolerance,
        divisions=divisions,
    )
    return points, contact, coverage, window


def flat(sole, position=(0, 0, 0), heading=0.0, pitch=0.0):
    return np.tile(pose(position, heading, pitch), (1, len(sole.patches), 1, 1))


@settings(max_examples=40)
@given(
    st.floats(-1e4, 1e4),
    st.floats(-1e4, 1e4),
    st.floats(-np.pi, np.pi),
    st.sampled_from([0.04, 0.02, 0.01, 0.005]),
)
@example(1.3125, 1.3125, 2.34375, 0.04)
def test_a_flat_sole_covers_its_area_at_any_place_heading_and_cell_size(x, y, heading, cell):
    sole = box_sole(LENGTH, WIDTH)
    _, contact, coverage, _ = lay(sole, flat(sole, (x, y, 0.3), heading), cell)
    assert contact.area.sum() == pytest.approx(LENGTH * WIDTH, rel=0.005)
    # Edges at 45 degrees may fall in step with the cells, which then count them wrong by 1.15 % at worst.
    assert coverage.sum() * cell**2 == pytest.approx(LENGTH * WIDTH, rel=0.0115)
    assert contact.lowest == pytest.approx(0.3)
    assert contact.clearance == pytest.approx(np.zeros_like(contact.clearance), abs=1e-9)


@pytest.mark.parametrize("heading", [0.0, 0.5, 2.0])
def test_cells_inside_the_outline_are_covered_whole_and_those_outside_not_at_all(heading):
    sole = box_sole(LENGTH, WIDTH)
    _, _, coverage, window = lay(sole, flat(sole, (0.4, -0.2, 0), heading), 0.01)
    x, y = np.meshgrid(*window.centres(0.01))
    along = (x - 0.4) * np.cos(heading) + (y + 0.2) * np.sin(heading)
    across = -(x - 0.4) * np.sin(heading) + (y + 0.2) * np.cos(heading)
    margin = np.minimum(LENGTH / 2 - np.abs(along), WIDTH / 2 - np.abs(across))
    assert (coverage[0][margin > 0.0071] == 1).all()
    assert (coverage[0][margin < -0.0071] == 0).all()


def test_the_seam_between_overlapping_patches_counts_once():
    sole = foot_sole("foot", "R")
    transforms = flat(sole)
    whole = Sole("whole", "R", sole.patches, sole.landmarks, sole.landmark_patch, sole.outline)
    _, contact, coverage, _ = lay(whole, transforms, 0.005, sinkage=1.0)
    assert sum(patch.area for patch in sole.patches) > 1.03 * sole.area
    assert contact.area.sum() == pytest.approx(sole.area, rel=0.01)
    assert coverage.sum() * 0.005**2 == pytest.approx(sole.area, rel=0.01)


@pytest.mark.parametrize("pitch", [10, 20, 40])
@pytest.mark.parametrize("sinkage", [0.0, 0.02])
def test_a_pitched_sole_touches_with_the_strip_that_lies_within_reach_of_its_lowest_edge(pitch, sinkage):
    # Up to the tolerance and the sinkage above the lowest edge, seen from above: (tolerance + sinkage)/tan(pitch).
    sole = box_sole(LENGTH, WIDTH)
    points, contact, coverage, _ = lay(sole, flat(sole, heading=0.4, pitch=np.radians(pitch)), 0.005, sinkage=sinkage)
    tolerance = TOLERANCE * LENGTH
    assert points.tolerance == tolerance
    strip = (tolerance + sinkage) / np.tan(np.radians(pitch)) * WIDTH
    # The lowest point is known to half a node of 5 mm.
    slack = 0.0025 * np.cos(np.radians(pitch)) * WIDTH + 0.02 * strip
    assert coverage.sum() * 0.005**2 == pytest.approx(strip, abs=slack)
    assert contact.area.sum() == pytest.approx(LENGTH * WIDTH * np.cos(np.radians(pitch)), rel=0.01)


def test_a_sphere_touches_with_the_cap_within_reach():
    # A cap of height h has a circle of pi·(2·r·h - h²); the band's ramp averages it over half a tolerance either side.
    radius, sinkage = 0.2, 0.05
    sole = sphere_sole(radius)
    points, contact, coverage, _ = lay(sole, flat(sole), 0.01, sinkage=sinkage)
    height = sinkage + points.tolerance + np.linspace(-0.5, 0.5, 101) * points.tolerance
    circle = np.pi * (2 * radius * height - height**2).mean()
    assert coverage.sum() * 1e-4 == pytest.approx(circle, rel=0.01)
    assert contact.clearance.min() == 0


def test_the_middle_of_pressure_of_a_flat_sole_is_its_middle():
    sole = foot_sole("foot", "L")
    transforms = flat(sole, (3.0, -2.0, 0.5), 1.1)
    points, contact, coverage, window = lay(sole, transforms, 0.005, sinkage=1.0)
    middle = centroid(points, transforms, contact.area)[0]
    x, y = np.meshgrid(*window.centres(0.005))
    by_cells = [(coverage[0] * x).sum(), (coverage[0] * y).sum()] / coverage[0].sum()
    assert middle[:2] == pytest.approx(by_cells, abs=5e-4)
    assert middle[2] == pytest.approx(0.5, abs=0.005)


@pytest.mark.parametrize("slope", [0.1, 0.4, 1.0])
def test_a_sole_aligned_with_a_slope_touches_all_over(slope):
    sole = box_sole(LENGTH, WIDTH)
    transforms = flat(sole, pitch=np.arctan(slope))
    terrain = Ground(lambda x, y: slope * x + 0 * y)
    _, contact, coverage, _ = lay(sole, transforms, 0.01, terrain=terrain)
    level = LENGTH * WIDTH * np.cos(np.arctan(slope))
    assert contact.clearance == pytest.approx(np.zeros_like(contact.clearance), abs=1e-9)
    assert contact.area.sum() == pytest.approx(level, rel=0.005)
    assert coverage.sum() * 1e-4 == pytest.approx(level, rel=0.02)


@pytest.mark.parametrize(
    "beyond", [lambda x: np.nan * x, lambda x: 3.0 * x], ids=["off the ground", "on a wall of 72 degrees"]
)
def test_a_sole_over_an_edge_touches_only_what_bears(beyond):
    sole = box_sole(LENGTH, WIDTH)
    terrain = Ground(lambda x, y: np.where(x < 0, 0 * y, beyond(x)))
    _, contact, coverage, window = lay(sole, flat(sole), 0.01, terrain=terrain)
    x, _ = window.centres(0.01)
    assert not coverage[:, :, x > 0.01].any()
    one_column = 0.01 * WIDTH
    assert coverage.sum() * 1e-4 == pytest.approx(LENGTH / 2 * WIDTH, abs=1.1 * one_column)
    assert contact.area.sum() == pytest.approx(LENGTH / 2 * WIDTH, abs=1.1 * one_column)


def test_a_sole_over_a_ledge_touches_the_upper_level_only():
    sole = box_sole(LENGTH, WIDTH)
    terrain = Ground(lambda x, y: np.where(x < 0, 0.0, -0.5) + 0 * y)
    _, _, coverage, window = lay(sole, flat(sole), 0.01, terrain=terrain, sinkage=0.05)
    x, _ = window.centres(0.01)
    assert not coverage[:, :, x > 0].any()
    assert coverage[:, :, x < 0].any()


@pytest.mark.parametrize("pitch", [85, 95, 180])
def test_a_sole_on_its_edge_or_upside_down_touches_nothing(pitch):
    sole = box_sole(LENGTH, WIDTH)
    _, contact, coverage, _ = lay(sole, flat(sole, pitch=np.radians(pitch)), 0.01)
    assert not contact.area.any()
    assert not coverage.any()


@pytest.mark.parametrize("scale", [0.02, 1.0, 30.0])
def test_what_counts_as_touching_grows_with_the_sole(scale):
    sole = box_sole(LENGTH, WIDTH)
    small = box_sole(LENGTH * scale, WIDTH * scale, spacing=0.005 * scale)
    reference = lay(sole, flat(sole, pitch=0.3), 0.005)[2]
    coverage = lay(small, flat(small, pitch=0.3), 0.005 * scale)[2]
    assert coverage == pytest.approx(reference, abs=1e-5)


@pytest.mark.parametrize("rise", [0.15, 1.0])
@pytest.mark.parametrize("clipped", [0.01, 0.03])
def test_a_sole_that_is_stuck_into_a_curb_or_wall_stands_beside_it(rise, clipped):
    """Animated feet graze risers and walls: what is inside them bears nothing."""
    sole = box_sole(LENGTH, WIDTH)
    edge = LENGTH / 2 - clipped
    step = Ground(lambda x, y: np.where(x > edge, rise, 0.0))
    _, contact, coverage, window = lay(sole, flat(sole), 0.01, terrain=step)
    x, _ = window.centres(0.01)
    assert contact.lowest == pytest.approx(0.0, abs=1e-6)
    assert coverage[0, :, x > edge].max() == 0.0
    assert coverage.sum() * 1e-4 == pytest.approx((LENGTH - clipped) * WIDTH, rel=0.12)  # the steep cells bear nothing


def test_toes_on_a_step_stand_on_the_step():
    sole = box_sole(LENGTH, WIDTH)
    step = Ground(lambda x, y: np.where(x > 0.05, 0.15, 0.0))
    _, contact, coverage, window = lay(sole, flat(sole, (0, 0, 0.15)), 0.01, terrain=step)
    x, _ = window.centres(0.01)
    assert contact.lowest == pytest.approx(0.0, abs=1e-6)
    assert coverage[0, :, x < 0.05].max() == 0.0
    assert coverage[0, :, x > 0.07].max() == 1.0
