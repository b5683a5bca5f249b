"""The response on every reference motion and on the project's own walker: flat snow, a hill, rough soil.

Everything is read from the rig as the user's scene shows it.
"""

import bpy
import numpy as np
import pytest

from softground_addon.blender.ground.ground_surface import terrain_of, undisturbed_surface
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.loads.contacts import detect_contacts
from tests.blender import responders, shots

KNEE_PER_FRAME = 15.0
"""A knee that turns by less than this from frame to frame at 30 fps does not flip [degrees]."""
FAST_SOURCE = 1.05
"""Knees that turn faster than that in the source itself, a runner's or a jumper's, turn faster by no more than 5 %."""
COMFORTABLE = 0.985
"""A leg may stretch so far over its length, or as far as in the source where that is more."""

BENT = np.radians(25.0)
"""A knee that is bent by more than this has a side."""

SNOW = GroundMaterial(youngs_modulus=375e3, poisson_ratio=0.05, characteristic_time=0.2)
SOIL = GroundMaterial(youngs_modulus=1.25e6, poisson_ratio=0.35, characteristic_time=0.05)


def hill(along, across):
    """A ridge across the way, 0.4 m high and as steep as 16°."""
    return 0.4 * np.exp(-((along / 1.2) ** 2)) + 0.0 * across


def bumps(along, across):
    """5 cm up and down, some decimetres wide."""
    return 0.025 * np.sin(5 * along) * np.sin(4 * across + 1) + 0.025 * np.sin(3 * along + 2 * across)


GROUNDS = {"flat snow": (None, SNOW), "hill": (hill, SNOW), "rough soil": (bumps, SOIL)}


def level_under(motion):
    """Height of the level that the motion was made for [m]: where its soles stand."""
    low = float(np.percentile([sole.landmark_positions()[..., 2].min(axis=1) for sole in motion.soles], 10.0))
    return low + float(np.median(detect_contacts(motion, FlatTerrain(low)).offset))


def put_ground(scene, motion, shape):
    """A mesh of a shape under a motion: its middle half way along the path, beside a motion on the spot."""
    paths = np.concatenate([sole.landmark_positions().reshape(-1, 3) for sole in motion.soles])[:, :2]
    hips = motion.joints["hips"][:, :2]
    way = hips[np.linalg.norm(hips - hips[0], axis=1).argmax()] - hips[0]
    length = np.linalg.norm(way)
    along = way / length if length > 0.5 else np.array((1.0, 0.0))
    middle = hips[0] + along * max(length / 2, 0.6)
    low, high = paths.min(axis=0) - 0.6, paths.max(axis=0) + 0.6
    x, y = (np.arange(a, b, 0.04) for a, b in zip(low, high, strict=True))
    points = np.stack(np.meshgrid(x, y), axis=-1)
    off = points - middle
    height = level_under(motion) + shape(off @ along, off @ (-along[1], along[0]))
    corner = (np.arange(len(y) - 1)[:, None] * len(x) + np.arange(len(x) - 1)).ravel()
    mesh = bpy.data.meshes.new("Field")
    mesh.from_pydata(
        np.concatenate([points, height[..., None]], axis=-1).reshape(-1, 3).tolist(),
        [],
        (corner[:, None] + [0, 1, len(x) + 1, len(x)]).tolist(),
    )
    ground = bpy.data.objects.new("Field", mesh)
    scene.collection.objects.link(ground)
    scene.softground.ground = ground
    scene.view_layers[0].update()


LONG = {"zombie", "jumping", "dance"}
"""Motions whose bakes take long: on the flat in the slow tests, on the other grounds in the marathon."""


def tier(name, kind):
    return pytest.mark.marathon if name in LONG and kind != "flat snow" else pytest.mark.slow


@pytest.mark.parametrize(
    ("name", "kind"),
    [pytest.param(name, kind, marks=tier(name, kind)) for name in [*shots.MOTION_FILES, "walker"] for kind in GROUNDS],
)
def test_standing_soles_lie_on_the_ground_legs_reach_and_knees_do_not_flip(scene, name, kind):
    shape, material = GROUNDS[kind]
    armature = shots.walker(scene, frames=120) if name == "walker" else shots.import_motion(name)
    bpy.ops.softground.add_character()
    for field in ("youngs_modulus", "poisson_ratio", "characteristic_time"):
        setattr(scene.softground.material, field, getattr(material, field))
    if shape:
        put_ground(scene, responders.source_motion(scene), shape)
    before = responders.legs(scene)
    result = responders.bake(scene, output="BOTH" if shape is None else "RESPONSE")
    ground = scene.softground.ground
    terrain = terrain_of(undisturbed_surface(ground, 1.0)) if shape else FlatTerrain(ground.matrix_world.translation.z)
    gaps = np.abs(responders.gaps_on_the_rig(scene, result, terrain)) * 1e3
    after = responders.legs(scene)
    rate = scene.render.fps / scene.render.fps_base
    turn, source_turn = (responders.knee_turn(legs, rate) for legs in (after, before))
    source = result.report["gaps_mm"]["before"][armature.name]
    print(
        f"\n{name}, {kind}: before p95 {max(source[way]['p95'] for way in source):.0f} mm; after p95 "
        f"{np.percentile(gaps, 95):.2f}, max {gaps.max():.2f} mm; knee per 1/30 s {source_turn:.1f} -> {turn:.1f} "
        f"degrees; stretch {np.max([leg.extension.max() for leg in after]):.3f}; {result.report['timings']}"
    )
    assert np.percentile(gaps, 95) < 2.0
    assert gaps.max() < 5.0
    assert turn < max(KNEE_PER_FRAME, FAST_SOURCE * source_turn)
    for leg, made in zip(after, before, strict=True):
        assert (leg.extension <= np.maximum(made.extension, COMFORTABLE) + 2e-3).all()
        # A knee that is bent in the source stays on its side; one that was straight bends toward the toes.
        forward = np.where((made.flexion > BENT)[:, None], responders.knee_direction(made), made.toward_toes)
        side = np.sum(responders.knee_direction(leg) * forward, axis=1)
        assert (side[leg.flexion > BENT] > 0).all(), "knees bend forward"
