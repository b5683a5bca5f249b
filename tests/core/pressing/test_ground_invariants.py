"""What holds for every motion, material and ground: volumes, monotony, limits."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import softground_addon.core.pressing.deformation as deformation_module
from softground_addon.core.composers.simulation import simulate
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.record.footprints import QUANTUM, recompose
from tests.core.walkers import box_sole, foot_sole, loads_of, pose, walk

PAPER = {
    "snow": GroundMaterial(0.375e6, 0.05, 0.2, blur_sigma=0.005),
    "dry sand": GroundMaterial(2.25e6, 0.5, 0.05, blur_sigma=0.01),
    "mud": GroundMaterial(0.625e6, 0.35, 0.15, blur_sigma=0.01),
    "soil": GroundMaterial(1.25e6, 0.35, 0.05, blur_sigma=0.005),
}
PRESETS = Path(deformation_module.__file__).parents[2] / "presets"


class Hills:
    """Smooth hills with a hole."""

    def __init__(self, height, hole):
        self.height, self.hole = height, hole

    def heights(self, x, y):
        z = self.height * np.sin(3 * x) * np.cos(2 * y + 0.3)
        return np.where((x - 0.6) ** 2 + (y + 0.05) ** 2 < self.hole**2, np.nan, z)


def check_every_frame(loads, terrain, material, cell_size):
    """Follow a simulation and assert what must hold at each frame; the record at its end."""
    footprints, volumes, previous = [], (0.0, 0.0), {}
    unplaced = 0.0
    for result in simulate(loads, SoftGround(terrain, material), cell_size):
        footprints += result.footprints
        for window in result.ground.tile_windows():
            state = result.ground.read(window)
            before = previous.get(window, np.zeros_like(state))
            assert (state[0] >= before[0]).all(), "compression only grows"
            assert material.repose_angle or (state[1] >= before[1]).all(), "a rim that does not slide only grows"
            assert (state[0] <= material.deepest * (1 + 1e-12)).all()
            previous[window] = state
        compressed, rim = result.ground.volumes()
        unplaced = sum(footprint.unplaced_rim_m3 for footprint in footprints)
        if not unplaced:
            newly = 2 * material.poisson_ratio * (compressed - volumes[0])
            assert rim - volumes[1] == pytest.approx(newly, rel=1e-6, abs=1e-12 * max(compressed, 1e-9))
        volumes = compressed, rim
    assert rim + unplaced == pytest.approx(2 * material.poisson_ratio * compressed, rel=1e-6, abs=1e-18)
    return result.ground, footprints


@pytest.mark.parametrize("name", PAPER)
@pytest.mark.parametrize("cell", [0.005, 0.02])
def test_the_rim_holds_the_displaced_volume_on_every_ground_of_the_paper_at_every_frame(name, cell):
    ground, footprints = check_every_frame([walk(steps=3, heading=0.2)], FlatTerrain(), PAPER[name], cell)
    compressed, rim = ground.volumes()
    assert compressed > 1e-5
    assert sum(footprint.compressed_m3 for footprint in footprints) == pytest.approx(compressed, rel=1e-9)
    assert sum(footprint.rim_m3 for footprint in footprints) == pytest.approx(rim, rel=1e-9)


def test_the_rim_holds_the_displaced_volume_on_every_preset_that_is_shipped():
    for path in PRESETS.glob("*.json"):
        material = GroundMaterial(**json.loads(path.read_text(encoding="utf-8"))["material"])
        check_every_frame([walk(steps=2)], FlatTerrain(), material, 0.01)


materials = st.builds(
    GroundMaterial,
    youngs_modulus=st.floats(2e4, 1e7),
    poisson_ratio=st.floats(0, 0.5),
    characteristic_time=st.floats(0.002, 1.0),
    layer_depth=st.floats(0.01, 1.0),
    rim_reach=st.floats(0.0, 0.1),
    exponent=st.sampled_from([1.0]) | st.floats(0.2, 3.0),
    densest=st.sampled_from([0.0]) | st.floats(0.01, 1.0),
    edge_width=st.floats(0.0, 1.0),
    spread=st.floats(0.0, 3.0),
)


def random_loads(seed):
    """Soles that wander, turn, tip and press at random, touching now and then."""
    rng = np.random.default_rng(seed)
    frame_rate = rng.choice([24.0, 30.0, 60.0])
    soles = [(box_sole(0.2, 0.1), foot_sole("foot", "R"))[kind] for kind in rng.integers(0, 2, rng.integers(1, 4))]
    count = round(frame_rate * 0.6) * round(120 / frame_rate) + 1

    def path(size, width):
        knots = rng.normal(scale=size, size=(6, width))
        time = np.linspace(0, 5, count)
        return np.stack([np.interp(time, np.arange(6), knot) for knot in knots.T], -1)

    transforms, forces = [], []
    for sole in soles:
        place = path(0.3, 3)
        poses = pose(place, path(1.0, 1)[:, 0], path(0.4, 1)[:, 0])
        transforms.append(np.stack([poses] * len(sole.patches), 1))
        forces.append(np.maximum(path(1500.0, 1)[:, 0], 0.0))
    touching = np.stack([path(1.0, 1)[:, 0] > -0.5 for _ in soles], 1)
    return loads_of(soles, transforms, np.stack(forces, 1), touching, frame_rate)


@settings(max_examples=25)
@given(
    st.integers(0, 2**32 - 1),
    materials,
    st.sampled_from([0.013, 0.03, 0.07]),
    st.floats(0, 0.3),
    st.floats(0, 0.3),
)
def test_volumes_limits_and_the_record_hold_for_anything_that_presses(seed, material, cell, height, hole):
    ground, footprints = check_every_frame([random_loads(seed)], Hills(height, hole), material, cell)
    recomposed = recompose(footprints, cell_size=cell)
    assert set(recomposed.tiles) <= set(ground.tiles)
    for window in ground.tile_windows():
        assert recomposed.read(window) == pytest.approx(ground.read(window), abs=QUANTUM)
