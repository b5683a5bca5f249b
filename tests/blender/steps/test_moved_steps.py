"""The walk follows: moved and turned steps take the feet of FK, IK and Rigify rigs there."""

import bpy
import numpy as np
import pytest

from softground_addon.blender import jobs
from softground_addon.blender.baking import bake_job
from softground_addon.core.record.edits import StepEdit
from tests.blender import responders, shots
from tests.blender.animation_layer.test_character_keys import MAKE, rigify, set_up
from tests.tiers import slow_but_one

MOVE, TURN = (0.06, 0.08), 12.0


@pytest.fixture(params=slow_but_one(["ik", "walker", "rigify"]))
def rig(scene, request):
    if request.param == "rigify":
        return rigify(request.getfixturevalue("rigify_file"))
    return MAKE[request.param](scene)


def bake(scene, edits=None):
    scene.softground.grounding.use = True
    return jobs.run(bake_job.bake(scene, edits=edits))


def contact_bones(scene, armature, steps):
    """World matrices of the bones of some steps' soles, in the middle of the contact."""
    mapping = responders.mapping_of(scene.softground.characters[0])
    bones = {source.name: source.bone for source in mapping.soles}
    gaps = []
    for step in steps:
        frame = round((step["frame_start"] + step["frame_end"]) / 2)
        gaps.append(responders.world_matrices(scene, armature, [bones[step["contact"]]], [frame])[0, 0])
    return np.array(gaps)


@pytest.mark.slow
def test_the_rig_stands_in_its_moved_print_and_in_all_others_as_before(rig):
    scene = bpy.context.scene
    set_up(rig)
    steps = bake(scene).report["steps"]
    pivots = np.array([[*step["position"], 1.0] for step in steps])
    before = contact_bones(scene, rig, steps)
    moved = len(steps) // 2
    report = bake(scene, {steps[moved]["id"]: StepEdit(move_m=MOVE, turn_deg=TURN)}).report
    assert not [finding for finding in report["self_check"] if finding["code"] == "step_out_of_reach"]
    carry = contact_bones(scene, rig, steps) @ np.linalg.inv(before)
    went = np.einsum("sij,sj->si", carry, pivots)[:, :2] - pivots[:, :2]
    np.testing.assert_allclose(went[moved], MOVE, atol=2e-3)
    yaw = np.degrees(np.arctan2(carry[:, 1, 0], carry[:, 0, 0]))
    np.testing.assert_allclose(yaw, np.where(np.arange(len(steps)) == moved, TURN, 0.0), atol=1.0)
    assert np.abs(np.delete(went, moved, axis=0)).max() < 5e-3, "heels may rise"
    gaps = report["gaps_mm"]["after"][rig.name]
    assert gaps["float"]["p95"] < 2.0
    assert gaps["penetration"]["p95"] < 2.0


@pytest.mark.slow
def test_edits_that_are_reset_give_the_walk_back(scene):
    armature = shots.walker(scene)
    set_up(armature)
    steps = bake(scene).report["steps"]
    bake(scene)  # on the ground that the first one has made
    before = contact_bones(scene, armature, steps)
    bake(scene, {steps[2]["id"]: StepEdit(move_m=MOVE)})
    assert np.abs(contact_bones(scene, armature, steps) - before).max() > 0.05
    bake(scene, {})
    np.testing.assert_array_equal(contact_bones(scene, armature, steps), before)


@pytest.mark.slow
def test_a_step_beyond_the_leg_is_said(scene):
    armature = shots.walker(scene)
    set_up(armature)
    name = bake(scene).report["steps"][2]["id"]
    report = bake(scene, {name: StepEdit(move_m=(0.0, 2.0))}).report
    (said,) = [finding for finding in report["self_check"] if finding["code"] == "step_out_of_reach"]
    assert name in said["message"]
    assert "% of the way" in said["message"]
