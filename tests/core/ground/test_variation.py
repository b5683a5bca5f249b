"""Grounds that vary from place to place: depth, volume and limits on both sides of a border."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softground_addon.core.composers.simulation import simulate
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.ground.sparse_grid import Window
from softground_addon.core.ground.terrain import MeshTerrain
from softground_addon.core.ground.variation import SOFTEST, PaintedSurface, VariationTiles
from softground_addon.core.record.footprints import QUANTUM, recompose
from tests.core.pressing.test_ground_invariants import random_loads
from tests.core.walkers import box_sole, equilibrium_depth, standing, walk

MUD = GroundMaterial(0.625e6, 0.35, 0.15)


class Bands:
    """Factors of their own on each side of x = 0."""

    def __init__(self, left=(1.0, 1.0, 1.0), right=(1.0, 1.0, 1.0)):
        self.left, self.right = left, right

    def factors(self, x, y):
        return np.stack(
            [np.where(x < 0, each, other) + 0 * y for each, other in zip(self.left, self.right, strict=True)]
        )


def pressed(loads, variation, material=MUD, cell=0.01, **options):
    footprints = []
    for result in simulate([loads], SoftGround(FlatTerrain(), material, variation=variation, **options), cell):
        footprints += result.footprints
    return result.ground, footprints


def test_ground_that_varies_by_nothing_is_as_if_it_did_not_vary():
    plain, (first, *_) = pressed(walk(steps=2), None)
    varied, (other, *_) = pressed(walk(steps=2), Bands())
    for window in plain.tile_windows():
        assert varied.read(window) == pytest.approx(plain.read(window), abs=1e-9)
    assert other.rim_m3 == pytest.approx(first.rim_m3, rel=1e-9)


@pytest.mark.parametrize(
    ("factors", "depth"), [((0.25, 1, 1), 4.0), ((2, 1, 1), 0.5), ((1, 0.5, 1), 0.5), ((0.5, 0.1, 1), 0.2)]
)
def test_a_print_is_deeper_the_softer_its_place_and_shallower_the_thinner_its_layer(factors, depth):
    sole = box_sole(0.25, 0.09)
    loads = standing(sole, [[1.0, 0, 0]], 400.0)
    _, (footprint,) = pressed(loads, Bands(right=factors))
    expected = depth * equilibrium_depth(400.0, sole.patches[0].area, MUD)
    assert footprint.max_depth_m == pytest.approx(expected, rel=0.01)


def test_a_foot_on_a_border_prints_each_side_by_its_own():
    sole = box_sole(0.24, 0.08)
    ground, (footprint,) = pressed(standing(sole, [[0, 0, 0]], 400.0), Bands(right=(0.5, 1.0, 1.0)))
    left, right = ground.sample(np.array([-0.06, 0.06]), np.zeros(2))[0]
    assert right == pytest.approx(2 * left, rel=1e-6)
    assert left == pytest.approx(equilibrium_depth(400.0, sole.patches[0].area, MUD), rel=0.01)
    assert footprint.rim_m3 == pytest.approx(2 * 0.35 * footprint.compressed_m3, rel=1e-9)


@pytest.mark.parametrize(("factor", "share"), [(0.0, 0.0), (0.5, 0.35), (1.0, 0.7), (5.0, 1.0)])
def test_the_rim_is_scaled_and_never_holds_more_than_was_compressed(factor, share):
    loads = standing(box_sole(0.25, 0.09), [[1.0, 0, 0]], 400.0)
    ground, (footprint,) = pressed(loads, Bands(right=(1.0, 1.0, factor)))
    assert footprint.rim_m3 == pytest.approx(share * footprint.compressed_m3, rel=1e-9, abs=1e-15)
    compressed, rim = ground.volumes()
    assert rim == pytest.approx(share * compressed, rel=1e-9, abs=1e-15)


def test_no_layer_takes_no_print():
    ground, _ = pressed(standing(box_sole(0.25, 0.09), [[1.0, 0, 0]], 400.0), Bands(right=(1.0, 0.0, 1.0)))
    assert ground.volumes() == (0.0, 0.0)


def test_the_depth_on_a_varied_ground_does_not_depend_on_cell_size_or_frame_rate():
    bands = Bands((2.0, 1.0, 1.0), (0.5, 0.5, 0.5))
    reference = pressed(walk(steps=3), bands)[0].volumes()
    for cell in (0.005, 0.02):
        assert pressed(walk(steps=3), bands, cell=cell)[0].volumes() == pytest.approx(reference, rel=0.02)
    for rate in (24.0, 120.0):
        assert pressed(walk(steps=3, frame_rate=rate), bands)[0].volumes() == pytest.approx(reference, rel=0.01)


@settings(max_examples=10)
@given(
    st.integers(0, 2**32 - 1),
    st.tuples(*[st.floats(0, 3)] * 3),
    st.tuples(*[st.floats(0, 3)] * 3),
    st.sampled_from(["UNIFORM", "CENTRE_OF_PRESSURE"]),
)
def test_volumes_limits_and_the_record_hold_however_the_ground_varies(seed, left, right, pressure):
    ground, footprints = pressed(random_loads(seed), Bands(left, right), cell=0.03, pressure=pressure)
    recomposed = recompose(footprints, cell_size=0.03)
    for window in ground.tile_windows():
        state = ground.read(window)
        x, _ = window.centres(0.03)
        deepest = MUD.layer_depth * np.where(x < 0, left[1], right[1])
        assert (state >= 0).all()
        assert (state[0] <= deepest * (1 + 1e-9)).all()
        assert recomposed.read(window) == pytest.approx(state, abs=QUANTUM)
    compressed, rim = ground.volumes()
    assert rim == pytest.approx(sum(footprint.rim_m3 for footprint in footprints), rel=1e-6, abs=1e-15)
    assert rim <= compressed * (1 + 1e-6)


def test_painted_vertices_are_factors_between_them_and_one_beside_the_mesh():
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    values = np.array([[0.0, 1, 1], [2, 1, 1], [2, 0.5, 1], [0, 0.5, 1]])
    surface = MeshTerrain.from_mesh(vertices, np.array([[0, 1, 2], [0, 2, 3]]), values=values)
    factors = VariationTiles(PaintedSurface(surface), 0.1).factors(Window(-1, 2, 12, 3))
    x, y = Window(-1, 2, 12, 3).centres(0.1)
    inside = slice(1, 11)
    assert factors.stiffness[:, inside] == pytest.approx(np.tile(np.maximum(2 * x[inside], SOFTEST), (3, 1)))
    assert factors.depth[:, inside] == pytest.approx(np.tile(1 - 0.5 * y[:, None], (1, 10)))
    assert (factors.stiffness[:, [0, 11]] == 1).all()
