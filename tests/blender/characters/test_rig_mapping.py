"""Which bone is what, under the names of every family and under no names at all."""

import itertools

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from softground_addon.blender.rigs.rig_mapping import map_rig
from softground_addon.core.errors import InputError
from softground_addon.core.motion.motion import JOINTS
from tests.blender import rigs, shots

SEGMENT_OF_JOINT = {
    "shoulder": "upper_arm",
    "elbow": "forearm",
    "wrist": "hand",
    "hip": "thigh",
    "knee": "shin",
    "ankle": "foot",
    "ball": "toe",
}


@pytest.mark.parametrize("family", rigs.FAMILIES)
def test_every_joint_of_a_family_is_found(scene, family):
    names = rigs.FAMILIES[family]
    mapping = map_rig(rigs.human(names))
    expected = {part: (names.name(part), "head") for part in ("hips", "spine", "neck", "head")}
    for side, letter in enumerate("lr"):
        for joint, segment in SEGMENT_OF_JOINT.items():
            expected[f"{joint}_{letter}"] = (names.name(segment, side), "head")
        expected[f"toe_{letter}"] = (names.name("toe", side), "tail")
    assert {joint: mapping.joints.get(joint) for joint in expected} == expected
    assert set(mapping.joints) <= set(JOINTS)


@pytest.mark.parametrize("family", rigs.FAMILIES)
def test_both_feet_of_a_family_are_found_with_their_toes(scene, family):
    names = rigs.FAMILIES[family]
    mapping = map_rig(rigs.human(names))
    assert mapping.method == "names"
    assert [(s.name, s.side, s.bone, s.toe_bone) for s in mapping.soles] == [
        ("foot.L", "L", names.name("foot", 0), names.name("toe", 0)),
        ("foot.R", "R", names.name("foot", 1), names.name("toe", 1)),
    ]


@pytest.mark.parametrize("family", [name for name in rigs.FAMILIES if name != "smpl"])
def test_a_foot_without_toes_has_a_sole_of_one_piece(scene, family):
    names = rigs.FAMILIES[family]
    mapping = map_rig(rigs.human(names, without=("toe",)))
    assert [(s.bone, s.toe_bone) for s in mapping.soles] == [(names.name("foot", side), "") for side in (0, 1)]
    assert mapping.joints["toe_l"] == (names.name("foot", 0), "tail")
    assert "ball_l" not in mapping.joints


def nameless(turn=0.0, *, swap=False):
    """The standing figure with bones that are only numbered; returns the armature and the name of each part."""
    parts = [*rigs.TRUNK, *(f"{part}{side}" for part in rigs.LIMBS for side in (1, 0))]
    numbers = {part: f"Bone.{place:03d}" for place, part in enumerate(parts if not swap else parts[::-1])}
    family = rigs.Family(
        [numbers[part] for part in rigs.TRUNK],
        {part: "{s}" + part for part in rigs.LIMBS},
        sides=("0", "1"),
    )
    armature = rigs.human(family, turn=turn)
    for part, side in itertools.product(rigs.LIMBS, (0, 1)):
        armature.data.bones[family.name(part, side)].name = numbers[f"{part}{side}"]
    return armature, numbers


@pytest.mark.parametrize("turn", [0.0, np.pi / 2, np.pi, -0.7])
@pytest.mark.parametrize("swap", [False, True])
def test_a_rig_without_names_is_read_from_its_rest_pose(scene, turn, swap):
    armature, numbers = nameless(turn, swap=swap)
    mapping = map_rig(armature)
    assert mapping.method == "rest pose"
    assert [(s.name, s.side, s.bone, s.toe_bone) for s in mapping.soles] == [
        ("foot.L", "L", numbers["foot0"], numbers["toe0"]),
        ("foot.R", "R", numbers["foot1"], numbers["toe1"]),
    ]
    for joint, part in (("hips", "hips"), ("hip_l", "thigh0"), ("knee_r", "shin1"), ("ankle_l", "foot0")):
        assert mapping.joints[joint] == (numbers[part], "head")


@pytest.mark.parametrize("turn", [0.0, np.pi / 2, -0.7])
def test_without_names_the_upper_body_is_read_from_the_rest_pose_too(scene, turn):
    armature, numbers = nameless(turn)
    mapping = map_rig(armature)
    expected = {part: numbers[part] for part in ("spine", "neck", "head")}
    for side, letter in enumerate("lr"):
        expected |= {f"{joint}_{letter}": numbers[f"{segment}{side}"] for joint, segment in SEGMENT_OF_JOINT.items()}
    assert {joint: mapping.joints[joint][0] for joint in expected} == expected


def laid_along_one_axis(armature):
    """Lay all bones along x at rest, as some motion files do, and pose them as they lay before."""
    bpy.context.view_layer.objects.active = armature
    stood = {bone.name: bone.matrix_local.copy() for bone in armature.data.bones}
    bpy.ops.object.mode_set(mode="EDIT")
    for bone in armature.data.edit_bones:
        bone.use_connect = False
    before = {bone.name: (bone.head.copy(), bone.length) for bone in armature.data.edit_bones}
    for bone in armature.data.edit_bones:  # parents first
        head, length = before[bone.name]
        apart = (head - before[bone.parent.name][0]).length if bone.parent else 0.0
        bone.head = (bone.parent.head.x + apart, 0.0, 0.0) if bone.parent else (0.0, 0.0, 0.0)
        bone.tail = (bone.head.x + length, 0.0, 0.0)
    bpy.ops.object.mode_set(mode="OBJECT")
    for name, matrix in stood.items():
        armature.pose.bones[name].matrix = matrix
        bpy.context.view_layer.update()


@pytest.mark.parametrize("turn", [0.0, np.pi / 2, -0.7])
@pytest.mark.parametrize("stride", [0.0, 0.45])
def test_a_rig_whose_rest_pose_says_nothing_either_is_read_from_its_pose(scene, turn, stride):
    armature, numbers = nameless(turn)
    expected = map_rig(armature)
    laid_along_one_axis(armature)
    for side, way in ((0, 1), (1, -1)):
        thigh = armature.pose.bones[numbers[f"thigh{side}"]]
        across = Matrix.Rotation(turn, 3, "Z").col[0]
        hip = Matrix.Translation(thigh.head)
        thigh.matrix = hip @ Matrix.Rotation(way * stride, 4, across) @ hip.inverted() @ thigh.matrix
        bpy.context.view_layer.update()
    mapping = map_rig(armature, posed=True)
    assert mapping.soles == expected.soles
    assert mapping.joints == expected.joints
    with pytest.raises(InputError, match="No feet found"):
        map_rig(armature)
    bpy.ops.softground.add_character()
    (character,) = scene.softground.characters
    assert {sole.bone for sole in character.soles} == {sole.bone for sole in expected.soles}


@pytest.mark.parametrize(
    ("thigh", "shin", "foot", "toe", "arm", "forearm", "hand"),
    [
        ("leg1_{s}", "leg2_{s}", "foot_{s}", "toe_{s}", "arm1_{s}", "arm2_{s}", "hand_{s}"),
        ("leg_{s}0_0", "leg_{s}0_1", "leg_{s}0_2", "foot_{s}0_0", "arm_{s}0_0", "arm_{s}0_1", "arm_{s}0_2"),
        ("Bein1.{s}", "Bein2.{s}", "foot.{s}", "toe.{s}", "Oberarm.{s}", "Unterarm.{s}", "hand.{s}"),
    ],
)
def test_limbs_that_are_named_in_part_are_completed_from_the_rest_pose(
    scene, thigh, shin, foot, toe, arm, forearm, hand
):
    limbs = dict(zip(rigs.LIMBS, ("collar_{s}", arm, forearm, hand, thigh, shin, foot, toe), strict=True))
    family = rigs.Family(("root", "body1", "body2", "neck", "head"), limbs, sides=("L", "R"))
    mapping = map_rig(rigs.human(family))
    for side, letter in enumerate("lr"):
        for joint, segment in SEGMENT_OF_JOINT.items():
            assert mapping.joints[f"{joint}_{letter}"] == (family.name(segment, side), "head")
    assert [(s.bone, s.toe_bone) for s in mapping.soles] == [
        (family.name("foot", side), family.name("toe", side)) for side in (0, 1)
    ]


def test_an_insect_without_names_has_six_soles_of_different_names(scene):
    bones = {"b0": ((0, 0.6, 0.7), (0, 0, 0.75)), "b1": ((0, 0, 0.75), (0, -0.6, 0.7))}
    parents = {"b1": "b0"}
    for y, parent in ((0.6, "b0"), (0.0, "b1"), (-0.5, "b1")):
        for x in (0.15, -0.15):
            previous = parent
            for high, low in itertools.pairwise((0.65, 0.35, 0.08, 0.0)):
                name = f"b{len(bones)}"
                bones[name] = ((x, y, high), (x, y - (0.05 if low == 0 else 0), low))
                parents[name] = previous
                previous = name
    mapping = map_rig(rigs.build("Ant", bones, parents))
    assert len({sole.name for sole in mapping.soles}) == len({sole.bone for sole in mapping.soles}) == 6


def test_a_mirrored_armature_keeps_its_sides(scene):
    armature, numbers = nameless()
    armature.scale = (-1.0, 1.0, 1.0)
    scene.view_layers[0].update()
    assert [(s.side, s.bone) for s in map_rig(armature).soles] == [("L", numbers["foot0"]), ("R", numbers["foot1"])]


def test_steering_bones_do_not_fool_the_rest_pose(scene):
    armature, numbers = nameless()
    bpy.ops.object.mode_set(mode="EDIT")
    for place, x in enumerate((0.3, -0.3)):
        pole = armature.data.edit_bones.new(f"Thing.{place}")
        pole.head, pole.tail, pole.use_deform = (x, -0.5, 0.0), (x, -0.5, -0.1), False
        pole.parent = armature.data.edit_bones[numbers["hips"]]
    bpy.ops.object.mode_set(mode="OBJECT")
    assert [s.bone for s in map_rig(armature).soles] == [numbers["foot0"], numbers["foot1"]]


def test_a_quadruped_without_names_has_four_soles(scene):
    legs = {}
    parents = {"b1": "b0"}
    bones = {"b0": ((0, 0.6, 0.7), (0, 0, 0.75)), "b1": ((0, 0, 0.75), (0, -0.6, 0.7))}
    for y, parent in ((0.6, "b0"), (-0.5, "b1")):
        for x in (0.15, -0.15):
            previous = parent
            for high, low in itertools.pairwise((0.65, 0.35, 0.08, 0.0)):
                name = f"b{len(bones)}"
                bones[name] = ((x, y, high), (x, y - (0.05 if low == 0 else 0), low))
                parents[name] = previous
                previous = name
                legs.setdefault((x, y), []).append(name)
    mapping = map_rig(rigs.build("Dog", bones, parents))
    assert {(s.name, s.bone) for s in mapping.soles} == {
        ("foot.L", legs[0.15, 0.6][-1]),
        ("foot.R", legs[-0.15, 0.6][-1]),
        ("forefoot.L", legs[0.15, -0.5][-1]),
        ("forefoot.R", legs[-0.15, -0.5][-1]),
    }


def test_a_rig_without_legs_is_refused_with_its_name_and_a_remedy(scene):
    armature = rigs.build("Snake", {f"Bone.{i}": ((0, 0.1 * i, 0), (0, 0.1 * i + 0.1, 0)) for i in range(8)})
    with pytest.raises(InputError, match=r"Snake.*Add Contact"):
        map_rig(armature)


def test_an_object_that_is_no_armature_is_refused(scene):
    with pytest.raises(InputError, match=r"'Lamp'.*of type Light"):
        map_rig(bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT")))
    with pytest.raises(InputError, match="select the character's armature"):
        map_rig(None)


def test_an_armature_without_bones_is_refused(scene):
    with pytest.raises(InputError, match=r"'Empty' has no bones"):
        map_rig(bpy.data.objects.new("Empty", bpy.data.armatures.new("Empty")))


@pytest.mark.slow
@pytest.mark.slow
def test_a_rigify_human_maps_to_its_deform_bones(rigify_file):
    mapping = map_rig(rigs.open_rigify(rigify_file, "Generated"))
    assert [(s.bone, s.toe_bone) for s in mapping.soles] == [(f"DEF-foot.{s}", f"DEF-toe.{s}") for s in "LR"]
    assert mapping.joints["hips"] == ("DEF-spine", "head")
    assert mapping.joints["neck"] == ("DEF-spine.004", "head")
    assert mapping.joints["head"] == ("DEF-spine.006", "head")
    assert mapping.joints["hip_l"] == ("DEF-thigh.L", "head")
    assert mapping.joints["knee_r"] == ("DEF-shin.R", "head")
    assert mapping.joints["shoulder_r"] == ("DEF-upper_arm.R", "head")
    assert all(bone.startswith("DEF-") for bone, _ in mapping.joints.values())


@pytest.mark.slow
def test_a_rigify_metarig_maps_to_its_own_bones(rigify_file):
    mapping = map_rig(rigs.open_rigify(rigify_file, "Metarig"))
    assert [(s.bone, s.toe_bone) for s in mapping.soles] == [(f"foot.{s}", f"toe.{s}") for s in "LR"]
    assert mapping.joints["hips"] == ("spine", "head")
    assert mapping.joints["neck"] == ("spine.004", "head")


@pytest.mark.parametrize("name", shots.MOTION_FILES)
def test_motion_files_map_all_joints(scene, name):
    mapping = map_rig(shots.import_motion(name))
    assert set(mapping.joints) == set(JOINTS)
    assert [(s.side, bool(s.toe_bone)) for s in mapping.soles] == [("L", True), ("R", True)]
