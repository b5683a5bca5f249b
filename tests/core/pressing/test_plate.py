"""Soles in deep ground: early and as one plate; above the ankle, bit for bit as without that law."""

from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.composers.simulation import simulate
from softground_addon.core.ground import presets
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.ground.sparse_grid import Window
from softground_addon.core.pressing import contact_layout
from softground_addon.core.pressing.deformation import compression_rate
from softground_addon.core.pressing.plate import FALL_TIME, STIFF, Plate
from softground_addon.core.soles import deep_ground
from softground_addon.core.soles.deep_ground import wading
from tests.core.ground.test_variation import Bands
from tests.core.walkers import FOOT_LENGTH, box_sole, equilibrium_depth, loads_of, pose, pressed, standing, walk

DEEP = GroundMaterial(110e3, 0.05, 0.2, layer_depth=0.60)


def prints_on(material, loads=None, pressure="CENTRE_OF_PRESSURE"):
    ground = SoftGround(FlatTerrain(), material, pressure=pressure)
    return [mark for result in simulate([loads or walk()], ground, 0.02) for mark in result.footprints]


def switch_off(monkeypatch):
    monkeypatch.setattr(deep_ground, "ANKLE", 1e9)
    monkeypatch.setattr(deep_ground, "WADES", 2e9)


def as_bytes(prints):
    prints = list(prints)
    arrays = [(mark.compression.frames, mark.compression.cells, mark.compression.amounts) for mark in prints]
    arrays += [(mark.rim.amounts, mark.contact_start, mark.contact_end) for mark in prints]
    return [array.tobytes() for group in arrays for array in group]


def half_time(mark):
    """Frame at which the print's volume is half of what it becomes, over its contact, 0 to 1."""
    changes = mark.compression
    volume = np.cumsum(np.add.reduceat(changes.amounts.astype(float), changes.first[:-1]))
    frame = changes.frames[np.searchsorted(volume, volume[-1] / 2)]
    return (frame - mark.start_frame) / (mark.end_frame - mark.start_frame)


@pytest.mark.parametrize("pressure", ["UNIFORM", "CENTRE_OF_PRESSURE"])
@pytest.mark.parametrize(
    "material",
    [
        GroundMaterial(375e3, 0.05, 0.2),  # snow
        GroundMaterial(900e3, 0.2, 0.1, repose_angle=0.55, shortest_time=0.02),  # sand
        GroundMaterial(900e3, 0.45, 0.2, exponent=0.8, edge_width=0.01, spread=0.5, crust_stress=5e3),  # mud
    ],
)
def test_above_the_ankle_prints_are_bit_for_bit_those_without_the_law(material, pressure, monkeypatch):
    prints = prints_on(material, pressure=pressure)
    assert 0.01 < max(mark.max_depth_m for mark in prints) < deep_ground.ANKLE * FOOT_LENGTH
    switch_off(monkeypatch)
    assert as_bytes(prints) == as_bytes(prints_on(material, pressure=pressure))


@pytest.mark.parametrize("material", [DEEP, presets.find("settled_snow").material, presets.find("powder").material])
def test_in_deep_ground_a_step_is_pressed_earlier_than_without_the_law_and_ends_as_deep(material, monkeypatch):
    with_law = prints_on(material)
    switch_off(monkeypatch)
    without = prints_on(material)
    for deep, other in zip(with_law, without, strict=True):
        assert half_time(deep) < 0.75 * half_time(other)
        assert deep.max_depth_m == pytest.approx(other.max_depth_m, rel=0.03)


@pytest.mark.parametrize("seconds", [0.15, 0.3, 0.6])
def test_a_load_too_short_for_the_ground_presses_no_deeper_than_without_the_law(seconds, monkeypatch):
    time = np.arange(121) / 120.0
    force = np.where(time < seconds, 1800.0 * np.sin(np.pi * time / seconds), 0.0)[:, None]
    poses = np.tile(pose(np.zeros(3)), (len(time), 1, 1, 1))
    step = loads_of([box_sole(0.27, 0.1)], [poses], force, force > 0, 120.0)
    (with_law,) = prints_on(DEEP, step)
    assert with_law.max_depth_m > deep_ground.WADES * FOOT_LENGTH
    switch_off(monkeypatch)
    (without,) = prints_on(DEEP, step)
    assert with_law.max_depth_m == pytest.approx(without.max_depth_m, rel=0.02)
    assert half_time(with_law) <= half_time(without)


@pytest.mark.parametrize("pressure", ["UNIFORM", "CENTRE_OF_PRESSURE"])
def test_a_deep_print_on_painted_ground_does_not_depend_on_how_many_steps_are_laid_out_at_once(pressure, monkeypatch):
    bands = Bands(right=(1.3, 0.9, 1.0))

    def painted():
        ground = SoftGround(FlatTerrain(), DEEP, pressure=pressure, variation=bands)
        return [mark for result in simulate([walk(steps=2)], ground, 0.02) for mark in result.footprints]

    at_once = painted()
    assert max(mark.max_depth_m for mark in at_once) > deep_ground.WADES * FOOT_LENGTH
    monkeypatch.setattr(contact_layout, "STEPS_AT_ONCE", 1)
    for mark, other in zip(painted(), at_once, strict=True):
        np.testing.assert_allclose(mark.tile(mark.compression), other.tile(other.compression), atol=1e-6)


def test_a_thin_layer_painted_on_deep_ground_is_shallow_ground(monkeypatch):
    ground = SoftGround(FlatTerrain(), DEEP, pressure="CENTRE_OF_PRESSURE", variation=Bands((1, 0.2, 1), (1, 0.2, 1)))

    def thin():
        return as_bytes(mark for result in simulate([walk(steps=2)], ground, 0.02) for mark in result.footprints)

    with_law = thin()
    switch_off(monkeypatch)
    assert thin() == with_law


def test_a_lasting_load_brings_a_sole_down_evenly_in_the_fall_time():
    sole, force = box_sole(0.27, 0.1), 700.0
    depth = equilibrium_depth(force, 0.27 * 0.1, replace(DEEP, youngs_modulus=60e3))
    assert wading(depth, 0.27) == 1.0
    loads = standing(sole, [0.0, 0.0, 0.0], force, seconds=0.5, frame_rate=120.0)
    ground = SoftGround(FlatTerrain(), replace(DEEP, youngs_modulus=60e3), pressure="UNIFORM")
    for count, result in enumerate(simulate([loads], ground, 0.01)):
        expected = depth * min(1.0, count / 120.0 / FALL_TIME)
        compression, _ = result.ground.read(Window(-2, -2, 4, 4))
        np.testing.assert_allclose(compression, expected, rtol=2e-3)


@pytest.mark.parametrize(("share", "bearing", "time"), [(0.0, 0.004, 0.2), (1.0, 0.02, FALL_TIME)])
def test_a_plate_bears_with_what_touches_or_with_all_of_the_sole(share, bearing, time):
    plate = Plate(share, 0.02)
    assert plate.bearing(0.004) == pytest.approx(bearing)
    assert plate.fall_time(0.2) == pytest.approx(time)
    assert plate.fall_time(0.02) == pytest.approx(0.02), "never slower than the ground"
    material = replace(DEEP, characteristic_time=0.2, shortest_time=0.0)
    assert compression_rate(0.01, material, plate=plate) == pytest.approx(0.01 / time)


def test_a_plate_takes_no_pressure_away_and_leaves_none_far_below_the_highest():
    even, tilted = [0.9, 1.0, 1.0, 1.1], [0.0, 0.9, 1.5, 1.6]
    for share, expected in (
        (1.0, [[1.0, 1.0, 1.0, 1.1], [1.6 * STIFF, 1.6 * STIFF, 1.5, 1.6]]),
        (0.5, [[0.95, 1.0, 1.0, 1.1], [0.8 * STIFF, 0.45 + 0.8 * STIFF, 1.5, 1.6]]),
    ):
        pressure = np.array([even, tilted])[:, None]
        Plate(share, 0.02).level(pressure)
        np.testing.assert_allclose(pressure[:, 0], expected)


def test_wading_goes_by_the_length_of_the_sole_and_grows_smoothly():
    depths = np.linspace(0.0, 0.4, 400)
    share = wading(depths, 0.28)
    assert np.all(np.diff(share) >= 0)
    assert np.all(share[depths <= deep_ground.ANKLE * 0.28] == 0.0)
    assert np.abs(np.diff(share, 2)).max() < 5e-3, "no kink"
    np.testing.assert_allclose(wading(depths * 20, 0.28 * 20), share, atol=1e-12)


def test_deep_prints_depend_little_on_frame_rate_and_cells():
    depths = []
    for rate, cell_size in ((24.0, 0.02), (120.0, 0.02), (24.0, 0.01)):
        _, prints = pressed(walk(steps=3, frame_rate=rate), DEEP, cell_size)
        depths.append([mark.max_depth_m for mark in prints])
    np.testing.assert_allclose(depths[1], depths[0], rtol=0.01)
    np.testing.assert_allclose(depths[2], depths[0], rtol=0.02)
