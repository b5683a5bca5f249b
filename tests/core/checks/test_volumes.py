"""Invariants that each print is held to before anything is written."""

import pytest

from softground_addon.core.checks.volumes import check_volumes
from softground_addon.core.composers.simulation import simulate
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from tests.core.walkers import box_sole, standing


@pytest.mark.parametrize("layer", [0.035, 0.05, 0.3])
def test_a_print_at_the_very_bottom_of_a_layer_is_no_deeper_than_that(layer):
    """Also where the depth, in 32-bit floats, is rounded up."""
    soft = GroundMaterial(youngs_modulus=3e3, poisson_ratio=0.05, characteristic_time=0.02, layer_depth=layer)
    ground = SoftGround(FlatTerrain(), soft)
    *_, last = simulate([standing(box_sole(0.3, 0.1), [0, 0, 0], 700.0)], ground, 0.02)
    (step,) = last.footprints
    assert step.max_depth_m == pytest.approx(layer, rel=1e-6)
    check_volumes([step], ground)
