"""Where the user's NLA is switched off, a copy of the action takes the layer's place; the original stays as it is."""

import bpy
import numpy as np
import pytest

from softground_addon.blender.animation_layer import nla_layer
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.numerics.orientation import quaternion_power, quaternion_product, rotation_matrices
from tests.blender import fingerprints, responders, shots

BONES = ["hips", "thigh.L", "shin.L", "foot.L", "thigh.R", "hand.L"]
FRAMES = range(1, 73, 6)


@pytest.fixture
def walker(scene):
    armature = shots.walker(scene)
    bpy.ops.softground.add_character()
    armature.animation_data.use_nla = False
    return armature


@pytest.mark.slow
def test_the_copy_poses_the_rig_as_the_nla_layer_does(scene, walker):
    bpy.ops.softground.create_ground()
    responders.bake(scene)
    copied = responders.world_matrices(scene, walker, BONES, FRAMES)
    bpy.ops.softground.clear_bake()
    walker.animation_data.use_nla = True
    responders.bake(scene)
    assert copied == pytest.approx(
        responders.world_matrices(scene, walker, BONES, FRAMES), abs=1e-3
    )  # keys are good to 0.04°


@pytest.mark.slow
def test_standing_soles_lie_on_their_prints(scene, walker):
    result = responders.bake(scene)
    terrain = FlatTerrain(scene.softground.ground.matrix_world.translation.z)
    gaps = np.abs(responders.gaps_on_the_rig(scene, result, terrain)) * 1e3
    assert np.percentile(gaps, 95) < 2.0
    assert gaps.max() < 5.0


def test_the_original_is_the_same_bytes_during_and_after_and_all_is_given_back(scene, walker):
    scene.frame_set(20)
    before = fingerprints.of_file()
    original = walker.animation_data.action
    responders.bake(scene, output="RESPONSE")
    assert walker.animation_data.action != original
    assert nla_layer.own_action(walker)[0] == original
    assert fingerprints.of_action(original) == before["actions"][original.name]
    bpy.ops.softground.clear_bake()
    scene.frame_set(20)
    assert fingerprints.of_file() == before


def test_the_strength_scales_it_without_a_bake_and_none_is_the_source(scene, walker):
    character = scene.softground.characters[0]
    before = responders.world_matrices(scene, walker, BONES, FRAMES)
    responders.bake(scene)
    heights = {}
    for strength in (0.0, 0.5, 1.0, 2.0):
        character.response_strength = strength
        heights[strength] = responders.world_matrices(scene, walker, ["hips"], [40])[0, 0, 2, 3]
    for strength, height in heights.items():
        assert height - heights[0.0] == pytest.approx(strength * (heights[1.0] - heights[0.0]), rel=0.02, abs=1e-5)
    character.response_strength = 0.0
    assert responders.world_matrices(scene, walker, BONES, FRAMES) == pytest.approx(before, abs=1e-5)


@pytest.mark.slow
def test_baking_again_reads_the_original_and_replaces_only_the_copy(scene, walker):
    first = responders.bake(scene).report
    actions = sorted(action.name for action in bpy.data.actions)
    second = responders.bake(scene).report
    assert second["gaps_mm"]["before"] == first["gaps_mm"]["before"]
    assert sorted(action.name for action in bpy.data.actions) == actions


def test_it_survives_saving_and_loading(scene, walker, tmp_path):
    name = walker.animation_data.action.name
    responders.bake(scene)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    armature = bpy.data.objects["Walker"]
    assert nla_layer.strength_of(armature) == pytest.approx(1.0)
    bpy.ops.softground.clear_bake()
    assert armature.animation_data.action.name == name
    assert not nla_layer.has_layer(armature)


def test_outside_its_frames_the_animation_is_the_users(scene, walker):
    before = responders.world_matrices(scene, walker, ["hips", "foot.L"], [5, 65])
    responders.bake(scene, frame_start=10, frame_end=60)
    assert responders.world_matrices(scene, walker, ["hips", "foot.L"], [5, 65]) == pytest.approx(before, abs=1e-5)


def test_quaternions_multiply_and_scale_as_rotations_do():
    turns = np.random.default_rng(1).normal(size=(40, 4))
    one, other = turns[:20] / np.linalg.norm(turns[:20], axis=1, keepdims=True), turns[20:]
    other = other / np.linalg.norm(other, axis=1, keepdims=True)
    product = rotation_matrices(quaternion_product(one, other))
    assert product == pytest.approx(rotation_matrices(one) @ rotation_matrices(other), abs=1e-9)
    assert rotation_matrices(quaternion_power(one, 2.0)) == pytest.approx(
        rotation_matrices(one) @ rotation_matrices(one)
    )
    assert quaternion_power(one, 0.0) == pytest.approx(np.tile((1.0, 0.0, 0.0, 0.0), (20, 1)))
