"""The sample walk in deep ground, as its rig shows it: the figure wades, it does not squat."""

import bpy
import numpy as np
import pytest

from tests.blender import responders, shots

FRAMES = 120
WALKS = slice(20, 100)
"""Frames that are far from the ends of the shot."""
JOINTS = ("hips", "head", "hand.L", "hand.R", "shin.L", "shin.R", "foot.L", "foot.R")
"""Bones whose heads are wrists, knees, ankles."""
SNOW = {"poisson_ratio": 0.05, "characteristic_time": 0.2, "layer_depth": 0.60}
FASTEST = 1.5
"""Most times the source's largest speed at which a joint may move."""


def joints(scene, armature):
    """Places of the joints, frame by frame, (F, J, 3) [m]."""
    return responders.world_matrices(scene, armature, JOINTS, range(1, FRAMES + 1))[..., :3, 3]


def straightest_knees(scene, steps):
    """Least flexion of the standing knee in the middle third of each contact far from the ends [degrees]."""
    flexion = dict(zip("LR", responders.knee_angles(scene).T, strict=True))
    heights = []
    for step in steps:
        start, end = step["frame_start"], step["frame_end"]
        if start >= WALKS.start and end <= WALKS.stop:
            middle = np.arange(np.ceil((2 * start + end) / 3), np.floor((start + 2 * end) / 3) + 1).astype(int)
            heights.append(flexion[step["contact"][-1]][middle - 1].min())
    return np.array(heights)


@pytest.mark.parametrize(
    ("depth", "youngs_modulus", "bounce", "flexion"),
    [
        (0.20, 215e3, 0.10, 25.0),
        pytest.param(0.35, 123e3, 0.15, 25.0, marks=pytest.mark.slow),
        pytest.param(0.50, 86e3, 0.20, 30.0, marks=pytest.mark.slow),
    ],
)
@pytest.mark.parametrize("preset", ["AS_ANIMATED", "WADING"])
def test_hips_hardly_bounce_knees_straighten_and_nothing_moves_too_fast(
    scene, depth, youngs_modulus, bounce, flexion, preset
):
    armature = shots.walker(scene, frames=FRAMES)
    bpy.ops.softground.add_character()
    scene.softground.frame_end = FRAMES
    for name, value in {**SNOW, "youngs_modulus": youngs_modulus}.items():
        setattr(scene.softground.material, name, value)
    source = joints(scene, armature)
    bpy.ops.softground.response_preset(preset=preset)
    tilt = scene.softground.tilt.use
    report = responders.bake(scene, tilt=tilt, output="RESPONSE", pressure="CENTRE_OF_PRESSURE").report
    wading = joints(scene, armature)
    knees = straightest_knees(scene, report["steps"])
    hips = wading[WALKS, 0, 2]
    fastest, in_source = (np.linalg.norm(np.diff(way, axis=0), axis=2)[WALKS].max(axis=0) for way in (wading, source))
    print(f"\n{np.ptp(hips):.3f} m, knees {knees.round(1)}, speeds {(fastest / in_source).round(2)}")
    of_depth = 0.03 if preset == "AS_ANIMATED" else 0.05  # a body that sways presses otherwise
    assert np.median([step["max_depth_m"] for step in report["steps"][1:-1]]) == pytest.approx(depth, rel=of_depth)
    assert np.ptp(hips) <= bounce
    assert len(knees) >= 4
    assert knees.max() < flexion
    assert (fastest <= FASTEST * in_source).all()
    assert -depth < (hips - source[WALKS, 0, 2]).mean() < -0.6 * depth, "it goes down with its feet"
    assert max(side["p95"] for side in report["gaps_mm"]["after"][armature.name].values()) < 2.0


def test_as_animated_gives_back_the_strength_of_tilt_from_before_wading(scene):
    options = scene.softground
    preset = bpy.ops.softground.response_preset
    options.tilt.strength = 0.8
    preset(preset="AS_ANIMATED")
    assert options.tilt.strength == pytest.approx(0.8), "it was not Wading that set it"
    for _ in range(2):
        preset(preset="WADING")
        assert options.tilt.strength == pytest.approx(0.1)
    preset(preset="AS_ANIMATED")
    assert options.tilt.strength == pytest.approx(0.8)
    preset(preset="WADING")
    options.tilt.strength = 0.3
    preset(preset="AS_ANIMATED")
    assert options.tilt.strength == pytest.approx(0.3), "which was set since"
    options.tilt.property_unset("strength")
    preset(preset="WADING")
    preset(preset="AS_ANIMATED")
    assert not options.tilt.is_property_set("strength")


@pytest.mark.slow
def test_the_preset_wading_acts_with_arms_trunk_and_speed_and_can_be_taken_back(scene):
    shots.walker(scene, frames=FRAMES)
    bpy.ops.softground.add_character()
    options, render = scene.softground, scene.render
    options.frame_end, options.grounding.crouch = FRAMES, 0.5
    scene.softground.material.layer_depth, scene.softground.material.youngs_modulus = 0.6, 215e3
    bpy.ops.softground.response_preset(preset="WADING")
    assert options.grounding.arms > 0
    assert options.grounding.crouch == 0
    assert options.tilt.use
    assert render.frame_map_new == render.frame_map_old, "no bake has told the speed"
    report = responders.bake(scene, output="RESPONSE").report
    bpy.ops.softground.response_preset(preset="WADING")
    (speed,) = report["suggested_speed"].values()
    assert render.frame_map_old / render.frame_map_new == pytest.approx(speed, abs=0.01)
    bpy.ops.softground.response_preset(preset="AS_ANIMATED")
    assert not options.grounding.arms
    assert not options.tilt.use
    assert render.frame_map_new == render.frame_map_old
