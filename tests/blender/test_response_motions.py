"""The response on every reference motion: read from the rig as the user's scene shows it."""

import bpy
import numpy as np
import pytest

from softground_addon.core.heightfield import FlatTerrain
from tests.blender import responders, shots

FAST_KNEE = 20.0
"""A knee that turns by less than this in 1/30 s does not flip, whatever the source does [degrees]."""
HOVERING = 150.0
"""A source whose feet stand this far above the ground is no stance to keep to the millimetre [mm]."""


@pytest.mark.slow
@pytest.mark.parametrize("name", shots.MOTION_FILES)
def test_standing_soles_of_reference_motions_lie_on_the_ground(scene, name):
    armature = shots.import_motion(name)
    bpy.ops.softground.add_character()
    before = responders.knee_angles(scene)
    result = responders.bake(scene)
    terrain = FlatTerrain(scene.softground.ground.matrix_world.translation.z)
    gaps = np.abs(responders.gaps_on_the_rig(scene, result, terrain)) * 1e3
    source = result.report["gaps_mm"]["before"][armature.name]
    window = max(1, round(scene.render.fps / scene.render.fps_base / 30))
    jump, source_jump = (
        np.abs(angles[window:] - angles[:-window]).max() for angles in (responders.knee_angles(scene), before)
    )
    print(
        f"\n{name}: before p95 {source['float']['p95']:.0f} mm; after p95 {np.percentile(gaps, 95):.2f}, max "
        f"{gaps.max():.2f} mm; knee per 1/30 s {source_jump:.0f} -> {jump:.0f} degrees; {result.report['timings']}"
    )
    assert np.percentile(gaps, 95) < 2.0
    hovers = source["float"]["max"] > HOVERING
    assert hovers or gaps.max() < 5.0
    assert hovers or jump < max(FAST_KNEE, 1.5 * source_jump)
