"""Random walks over random terrains: what was simulated, what is recorded and what is played are the same ground."""

import bpy
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from softground_addon.core.composers.simulation import simulate
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.playback.ramps import TOLERANCE
from softground_addon.core.record.footprints import recompose
from tests.blender.playback.test_playback import bake_onto, evaluated, recorded, world_positions
from tests.core.walkers import walk

SIDE = 1.6
"""Length of the ground's sides [m]."""


class Bumps:
    """Smooth ground, some centimetres up and down."""

    def __init__(self, rng):
        self.waves = rng.uniform(-6, 6, (4, 2))
        self.phase, self.height = rng.uniform(0, 2 * np.pi, 4), rng.uniform(0, 0.01, 4)

    def heights(self, x, y):
        angle = np.multiply.outer(x, self.waves[:, 0]) + np.multiply.outer(y, self.waves[:, 1]) + self.phase
        return np.sin(angle) @ self.height


def ground_on(terrain, rng):
    """A mesh on the terrain, about as dense as the cells but not in line with them."""
    scene = bpy.context.scene
    axis = np.arange(-SIDE / 2, SIDE / 2, rng.uniform(0.015, 0.03))
    x, y = (values.ravel() for values in np.meshgrid(axis + rng.uniform(0, 0.01), axis))
    count = len(axis)
    corner = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
    mesh = bpy.data.meshes.new("Ground")
    points = np.stack([x, y, terrain.heights(x, y)], axis=-1)
    mesh.from_pydata(points.tolist(), [], (corner[:, None] + [0, 1, count + 1, count]).tolist())
    ground = bpy.data.objects.new("Ground", mesh)
    scene.collection.objects.link(ground)
    scene.view_layers[0].update()
    return ground


def state(ground):
    return {place: tile.copy() for place, tile in ground.tiles.items()}


@settings(max_examples=5)
@given(st.integers(0, 2**32 - 1), st.integers(1, 3), st.sampled_from([24.0, 30.0, 60.0]))
def test_simulation_record_and_playback_are_one(seed, walkers, rate):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    rng = np.random.default_rng(seed)
    terrain = Bumps(rng)
    material = GroundMaterial(
        10 ** rng.uniform(5.2, 6.3), rng.uniform(0, 0.5), rng.uniform(0.03, 0.3), blur_sigma=rng.uniform(0.004, 0.012)
    )
    loads = [
        walk(
            steps=2,
            frame_rate=rate,
            heading=rng.uniform(-np.pi, np.pi),
            origin=(*rng.uniform(-0.3, 0.3, 2), 0.0),
            speed=rng.uniform(0.6, 1.4),
            name=f"walker {number}",
        )
        for number in range(walkers)
    ]
    frames = rng.choice(np.arange(2, int(loads[0].motion.frames[-1])), 6, replace=False)
    simulated, footprints = {}, []
    for result in simulate(loads, SoftGround(terrain, material), 0.01):
        footprints += result.footprints
        if result.frame in frames:
            simulated[int(result.frame)] = state(result.ground)

    ground = ground_on(terrain, rng)
    surface = bake_onto(ground, footprints, material)
    assert recorded(footprints, 1e9, surface, material).display.min() < -1e-3
    for frame in frames:
        whole = recompose(footprints, float(frame), cell_size=0.01)
        for place, tile in simulated[int(frame)].items():
            np.testing.assert_allclose(whole.tiles.get(place, np.zeros_like(tile)), tile, atol=2e-9)
    for frame in [*frames, *(frames + rng.uniform(0, 1, len(frames)))]:
        moved = world_positions(evaluated(ground, bpy.context.scene, float(frame)))[:, 2] - surface.vertices[:, 2]
        assert np.abs(moved - recorded(footprints, float(frame), surface, material).display).max() <= TOLERANCE + 2e-6
