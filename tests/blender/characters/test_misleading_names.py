"""Names that lie: how bones hang together and where the skin rests tell more than what they are called."""

import random

import bpy
import pytest

from softground_addon.blender import jobs
from softground_addon.blender.characters.recognition import recognise

SIDES = "LR"


def walking_figure():
    bpy.ops.softground.add_sample_scene()
    return bpy.data.objects["Walking Figure"]


def swapped(*pairs):
    return {name: other for pair in pairs for name, other in (pair, pair[::-1])}


def shuffled(seed):
    names = [bone.name for bone in walking_figure().data.bones]
    others = names[:]
    random.Random(seed).shuffle(others)
    return dict(zip(names, others, strict=True))


def recognised(scene, names, *, has_skin=True):
    """Soles and joints of the walking figure with bones called otherwise, in the names that they had."""
    armature = walking_figure()
    if not has_skin:
        bpy.data.objects.remove(bpy.data.objects["Walking Figure Body"])
    original = [bone.name for bone in armature.data.bones]
    for prefix in ("other ", ""):
        for number, name in enumerate(original):
            armature.data.bones[number].name = prefix + names.get(name, name)
    true = {bone.name: name for bone, name in zip(armature.data.bones, original, strict=True)} | {"": ""}
    mapping = jobs.run(recognise(scene, armature, (1, 96))).mapping
    soles = {(true[sole.bone], true[sole.toe_bone], sole.limb) for sole in mapping.soles}
    return soles, {joint: true[bone] for joint, (bone, _) in mapping.joints.items()}


@pytest.mark.parametrize("has_skin", [True, False])
@pytest.mark.parametrize(
    "names",
    [
        pytest.param({"hips": "foot.L", "foot.L": "Bone", "foot.R": "Bone.001"}, id="hips are a foot"),
        pytest.param(swapped(("hips", "foot.L")), id="hips and a foot"),
        pytest.param(swapped(*((f"hand.{side}", f"foot.{side}") for side in SIDES)), id="hands and feet"),
        pytest.param(swapped(("foot.L", "foot.R")), id="left and right feet"),
        pytest.param(swapped(*((f"thigh.{side}", f"foot.{side}") for side in SIDES)), id="thighs and feet"),
        pytest.param(swapped(*((f"shin.{side}", f"toe.{side}") for side in SIDES)), id="shins and toes"),
        pytest.param(
            {
                f"{bone}.{side}": f"{name}.{side}"
                for side in SIDES
                for bone, name in (
                    *(("upper_arm", "thigh"), ("forearm", "shin")),
                    *((bone, f"Bone {bone[:2]}") for bone in ("thigh", "shin", "foot", "toe", "hand")),
                )
            },
            id="arms are legs without feet",
        ),
        *(pytest.param(seed, id=f"shuffled {seed}") for seed in range(6)),
    ],
)
def test_limbs_that_hang_together_as_none_do_are_not_what_they_are_called(addon, scene, names, has_skin):
    names = shuffled(names) if isinstance(names, int) else names
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    soles, joints = recognised(bpy.context.scene, names, has_skin=has_skin)
    assert soles == {(f"foot.{side}", f"toe.{side}", False) for side in SIDES}
    legs = {"hip": "thigh", "knee": "shin", "ankle": "foot"}
    assert {joint[:-2]: bone[:-2] for joint, bone in joints.items() if joint[:-2] in legs} == legs


@pytest.mark.parametrize("bone", ["hips", "chest", "thigh.L", "hand.L"])
def test_a_bone_called_a_foot_is_none_where_the_skin_rests_elsewhere(addon, scene, bone):
    names = {other.name: f"Bone.{number}" for number, other in enumerate(walking_figure().data.bones)}
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    soles, _ = recognised(bpy.context.scene, names | {bone: "foot.L"})
    assert soles == {(f"foot.{side}", f"toe.{side}", False) for side in SIDES}


def test_toes_are_none_that_are_far_from_their_foot(addon, scene):
    soles, _ = recognised(scene, {"toe.L": "Bone", "head": "toe.L"})
    assert soles == {("foot.L", "", False), ("foot.R", "toe.R", False)}


def test_a_misread_arm_costs_no_feet_of_a_rig_whose_rest_pose_says_nothing(addon, scene):
    armature = walking_figure()
    bpy.context.view_layer.objects.active = armature
    for obj in [obj for obj in scene.objects if obj.type == "MESH"]:
        bpy.data.objects.remove(obj)
    names = swapped(("hand.L", "upper_arm.L"))
    for prefix in ("other ", ""):
        for bone, name in zip(armature.data.bones, [bone.name for bone in armature.data.bones], strict=True):
            bone.name = prefix + names.get(name.removeprefix("other "), name) if prefix else name.removeprefix("other ")
    bpy.ops.object.mode_set(mode="EDIT")
    for bone in armature.data.edit_bones:  # along one line, as motion files may lay them
        bone.use_connect = False
        bone.head, bone.tail = (0, 0, 0.1 * len(bone.parent_recursive)), (0, 0, 0.1 * len(bone.parent_recursive) + 0.1)
    bpy.ops.object.mode_set(mode="OBJECT")
    mapping = jobs.run(recognise(scene, armature, (1, 96))).mapping
    assert [(sole.bone, sole.toe_bone) for sole in mapping.soles] == [(f"foot.{side}", f"toe.{side}") for side in SIDES]
    assert "wrist_r" in mapping.joints
