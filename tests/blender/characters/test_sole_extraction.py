"""Soles come from the character's own feet."""

from dataclasses import replace
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from softground_addon.blender.jobs import run
from softground_addon.blender.rigs.rig_mapping import map_rig
from softground_addon.blender.sampling.rig_sampling import sample_character
from softground_addon.blender.sampling.take import Take
from softground_addon.core.rig.mapping import SoleSource
from softground_addon.core.rig.motion_assembly import _pointing
from tests.blender import rigs

BLENDER = rigs.FAMILIES["blender"]
BALL_Y = -0.13


def standing(**options):
    """The standing figure, keyed so that it stays where it is."""
    armature = rigs.human(BLENDER, **options)
    rigs.key(armature, "location", {1: (0, 0, 0), 10: (0, 0, 0)}, bone="hips")
    return armature


def sample(armature):
    take = Take.about(armature, bpy.context.scene, range(1, 11))
    return run(sample_character(take, armature, map_rig(armature), mass=70.0))


def box(x, y, bottom=0.0, top=0.06):
    """Corners and faces of a box over ranges of x and y."""
    corners = [(i, j, k) for k in (bottom, top) for i, j in ((x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1]))]
    faces = [(3, 2, 1, 0), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    return corners, faces


def shoe(*boxes):
    corners, faces = [], []
    for points, sides in boxes:
        faces += [tuple(i + len(corners) for i in side) for side in sides]
        corners += points
    return corners, faces


LEFT_BOOT = shoe(box((0.055, 0.145), (-0.13, 0.06)), box((0.055, 0.145), (-0.22, -0.13)))
LEFT_HEEL = shoe(
    box((0.06, 0.14), (-0.22, -0.13)), box((0.06, 0.14), (-0.13, -0.09)), box((0.085, 0.115), (0.03, 0.06), 0.0, 0.1)
)


def dress(armature, shape, name="Shoes", *, both=True):
    """A mesh weighted to feet and toes: left as given, right mirrored; with legs that must not print."""
    corners, faces = shape
    points, sides = list(corners), list(faces)
    if both:
        sides += [tuple(i + len(points) for i in reversed(side)) for side in faces]
        points += [rigs.mirrored(point) for point in corners]
    leg, around = box((-0.3, 0.3), (-0.3, 0.3), 0.2, 0.9)
    sides += [tuple(i + len(points) for i in side) for side in around]
    legs = range(len(points), len(points) + len(leg))
    points += leg
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], sides)
    thing = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(thing)
    thing.parent = armature
    thing.modifiers.new("Armature", "ARMATURE").object = armature
    for side, sign in (("L", 1), ("R", -1)):
        foot, toe = (thing.vertex_groups.new(name=f"{part}.{side}") for part in ("foot", "toe"))
        for index, point in enumerate(points):
            if index not in legs and sign * point[0] > 0:
                (toe if point[1] < BALL_Y - 0.02 else foot).add([index], 1.0, "REPLACE")
    thing.vertex_groups.new(name="shin.L").add(list(legs), 1.0, "REPLACE")
    return thing


def test_a_boot_prints_its_own_sole_where_the_boot_stands(scene):
    armature = standing()
    dress(armature, LEFT_BOOT)
    motion = sample(armature)
    for sole, x in zip(motion.soles, (0.1, -0.1), strict=True):
        assert sole.sole.area == pytest.approx(0.28 * 0.09, rel=0.02)
        outline = np.column_stack(
            [sole.sole.outline, np.zeros(len(sole.sole.outline)), np.ones(len(sole.sole.outline))]
        )
        world = outline @ sole.transforms[0, 0].T
        np.testing.assert_allclose(world[:, 2], 0.0, atol=1e-5)
        np.testing.assert_allclose([world[:, 1].min(), world[:, 1].max()], [-0.22, 0.06], atol=0.004)
        np.testing.assert_allclose([world[:, 0].min(), world[:, 0].max()], [x - 0.045, x + 0.045], atol=0.004)
        np.testing.assert_allclose(sole.landmark_positions()[..., 2], 0.0, atol=1e-5)


def test_boot_heel_and_bare_bones_print_differently(scene):
    armature = standing()
    bones = sample(armature).soles[0].sole.area
    thing = dress(armature, LEFT_BOOT)
    boot = sample(armature).soles[0].sole.area
    bpy.data.objects.remove(thing)
    dress(armature, LEFT_HEEL)
    heel = sample(armature).soles[0].sole.area
    assert boot == pytest.approx(0.28 * 0.09, rel=0.02)
    assert heel == pytest.approx(0.08 * 0.13 + 0.03 * 0.03, rel=0.04)
    assert 0.015 < bones < 0.023


def test_shoes_parented_to_the_bones_print_too(scene):
    armature = standing()
    for side, sign in (("L", 1), ("R", -1)):
        corners, faces = LEFT_BOOT
        mesh = bpy.data.meshes.new(f"Shoe.{side}")
        mesh.from_pydata([(sign * x, y, z) for x, y, z in corners], [], faces)
        thing = bpy.data.objects.new(mesh.name, mesh)
        bpy.context.scene.collection.objects.link(thing)
        thing.parent, thing.parent_type, thing.parent_bone = armature, "BONE", f"foot.{side}"
        bpy.context.view_layer.update()
        thing.matrix_world = armature.matrix_world
        bpy.context.view_layer.update()
    for sole in sample(armature).soles:
        assert sole.sole.area == pytest.approx(0.28 * 0.09, rel=0.02)
        np.testing.assert_allclose(sole.landmark_positions()[..., 2], 0.0, atol=1e-4)


def test_the_rest_pose_counts_and_not_the_pose_of_the_moment(scene):
    armature = standing()
    dress(armature, LEFT_BOOT)
    rigs.key(armature, "rotation_euler", {8: (0, 0, 0), 10: (0.8, 0.2, 0.1)}, bone="foot.L")
    scene.frame_set(1)
    before = sample(armature)
    scene.frame_set(10)
    after = sample(armature)
    np.testing.assert_array_equal(before.soles[0].sole.outline, after.soles[0].sole.outline)
    np.testing.assert_array_equal(before.soles[0].transforms, after.soles[0].transforms)
    assert np.ptp(before.soles[0].transforms[:, 0, 2, 2]) > 0.2


def test_a_scaled_and_moved_character_has_soles_of_its_size(scene):
    armature = standing()
    dress(armature, LEFT_BOOT)
    armature.scale = (2.0,) * 3
    armature.location = (3, 4, 1)
    armature.rotation_euler = (0, 0, 0.8)
    bpy.context.view_layer.update()
    for sole in sample(armature).soles:
        assert sole.sole.area == pytest.approx(4 * 0.28 * 0.09, rel=0.02)
        np.testing.assert_allclose(sole.landmark_positions()[..., 2], 1.0, atol=1e-5)


def under_an_empty(armature, turns):
    """Parent a rig to an empty that is turned so at these frames [rad]."""
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.scene.collection.objects.link(parent)
    armature.parent = parent
    rigs.key(parent, "rotation_euler", turns)


TILTS = {
    "forward": {1: (0.35, 0, 0)},
    "back and aside": {1: (-0.25, 0.3, 2.0)},
    "steeply": {1: (1.2, 0, 0)},
    "more and more": {1: (0, 0, 0), 10: (0.35, 0.2, 0)},
    "less and less": {1: (0.9, 0, 0.4), 10: (0, 0, 0)},
}


@pytest.mark.parametrize("dressed", [True, False])
@pytest.mark.parametrize("tilt", TILTS)
def test_a_tilted_rig_has_the_soles_that_it_has_upright(scene, tilt, dressed):
    """However its parents lie and move, the soles are those of the rig, under its own feet."""
    armature = standing()
    if dressed:
        dress(armature, LEFT_BOOT)
    upright = sample(armature)
    under_an_empty(armature, TILTS[tilt])
    tilted = sample(armature)
    scene.frame_set(10)
    at_last = np.array(armature.matrix_world)
    for a, b in zip(upright.soles, tilted.soles, strict=True):
        assert b.sole.area == pytest.approx(a.sole.area, rel=1e-4)
        np.testing.assert_allclose(b.transforms[-1], at_last @ a.transforms[-1], atol=1e-5)


@pytest.mark.parametrize("dressed", [True, False])
def test_who_stands_upright_in_a_tilted_rig_has_level_soles(scene, dressed):
    """The bones make up for what the parent tilts."""
    armature = standing()
    if dressed:
        dress(armature, LEFT_BOOT)
    upright = sample(armature)
    hips = armature.pose.bones["hips"]
    pose = hips.matrix.copy()
    under_an_empty(armature, TILTS["back and aside"])
    scene.frame_set(1)
    hips.rotation_mode = "QUATERNION"
    hips.matrix = armature.matrix_world.inverted() @ pose
    for channel in ("location", "rotation_quaternion"):
        hips.keyframe_insert(channel, frame=1)
        hips.keyframe_insert(channel, frame=10)
    for a, b in zip(upright.soles, sample(armature).soles, strict=True):
        assert b.sole.area == pytest.approx(a.sole.area, rel=1e-4)
        np.testing.assert_allclose(b.transforms, a.transforms, atol=1e-5)


def test_bent_toes_leave_the_toe_patch_on_the_ground(scene):
    armature = standing()
    dress(armature, LEFT_BOOT)
    rigs.key(armature, "rotation_euler", {1: (0, 0, 0), 10: (0.5, 0, 0)}, bone="foot.L")
    rigs.key(armature, "rotation_euler", {1: (0, 0, 0), 10: (-0.5, 0, 0)}, bone="toe.L")
    sole = sample(armature).soles[0]
    assert len(sole.sole.patches) == 2
    foot_up, toe_up = sole.transforms[-1, :, 2, 2]
    assert foot_up < 0.9
    assert toe_up == pytest.approx(1.0, abs=0.02)


def test_feet_that_rest_on_tiptoe_are_laid_flat_as_they_stand(scene):
    """The rest pose points down 40 degrees; the animation stands on flat feet."""
    angle = np.radians(40)
    armature = rigs.human(BLENDER)
    bpy.ops.object.mode_set(mode="EDIT")
    for side in "LR":
        foot, toe = (armature.data.edit_bones[f"{part}.{side}"] for part in ("foot", "toe"))
        pivot = foot.head.copy()
        for bone, ends in ((foot, ("tail",)), (toe, ("tail",))):
            for end in ends:
                x, y, z = getattr(bone, end) - pivot
                turned = (x, y * np.cos(angle) - z * np.sin(angle), y * np.sin(angle) + z * np.cos(angle))
                setattr(bone, end, pivot + type(pivot)(turned))
        toe.head = foot.tail
    bpy.ops.object.mode_set(mode="OBJECT")
    for side in "LR":
        pose = armature.pose.bones[f"foot.{side}"]
        pose.rotation_mode = "XYZ"
        rest = np.array(pose.bone.matrix_local.to_3x3())
        back = np.array([[1, 0, 0], [0, np.cos(angle), np.sin(angle)], [0, -np.sin(angle), np.cos(angle)]])
        local = rest.T @ back @ rest
        pose.rotation_mode = "QUATERNION"
        pose.rotation_quaternion = type(pose.matrix)(np.pad(local, (0, 1)).tolist()).to_quaternion()
        pose.keyframe_insert("rotation_quaternion", frame=1)
    motion = sample(armature)
    for sole in motion.soles:
        np.testing.assert_allclose(sole.transforms[:, :, 2, 2], 1.0, atol=1e-4)
        # heel behind the ankle, toes ahead of it, all at one height
        marks = sole.landmark_positions()[0]
        assert marks[0, 1] > 0.03 > -0.1 > marks[2, 1]
        assert np.ptp(marks[:, 2]) < 0.005


@pytest.mark.parametrize("length", [1.0, 0.001])
def test_a_limb_prints_its_skin_however_short_an_importer_made_its_bone(scene, length):
    armature = standing()
    dress(armature, LEFT_BOOT)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for bone in armature.data.edit_bones:
        bone.use_connect = False
    for bone in armature.data.edit_bones:
        bone.tail = bone.head + (bone.tail - bone.head) * length
    bpy.ops.object.mode_set(mode="OBJECT")
    mapping = replace(map_rig(armature), soles=(SoleSource("shin", "L", "shin.L", limb=True),))
    motion = run(sample_character(Take.about(armature, scene, range(1, 11)), armature, mapping, mass=70.0))
    assert motion.soles[0].sole.prop.extent == pytest.approx((0.6, 0.6, 0.7), rel=0.05)


def test_a_mesh_hidden_from_the_render_prints_only_where_none_is_rendered(scene):
    armature = standing()
    boots = dress(armature, LEFT_BOOT)
    shown = sample(armature).soles[0].sole.area
    boots.hide_render = True
    assert sample(armature).soles[0].sole.area == shown
    dress(armature, LEFT_HEEL, "Heels")
    assert sample(armature).soles[0].sole.area < 0.9 * shown


def test_zero_length_and_missing_toe_bones_give_a_sensible_sole(scene):
    stub = {"foot.L": ((0.1, 0.0, 0.09), (0.1, 0.0, 0.0895)), "foot.R": ((-0.1, 0.0, 0.09), (-0.1, 0.0, 0.0895))}
    armature = rigs.human(BLENDER, without=("toe", "foot"))
    bpy.ops.object.mode_set(mode="EDIT")
    for name, (head, tail) in stub.items():
        bone = armature.data.edit_bones.new(name)
        bone.head, bone.tail = head, tail
        bone.parent = armature.data.edit_bones[name.replace("foot", "shin")]
    bpy.ops.object.mode_set(mode="OBJECT")
    rigs.key(armature, "location", {1: (0, 0, 0)}, bone="hips")
    for sole in sample(armature).soles:
        assert len(sole.sole.patches) == 1
        assert 0.22 < np.ptp(sole.sole.outline[:, 0]) < 0.32
        pose = sole.transforms[0, 0]
        np.testing.assert_allclose(pose[:3, 2], (0, 0, 1), atol=1e-4)
        np.testing.assert_allclose(pose[:3, 0], (0, -1, 0), atol=0.05)  # where the character faces


def test_a_shoe_whose_bone_is_gone_prints_no_more(scene):
    armature = standing()
    bare = [sole.sole.area for sole in sample(armature).soles]
    mesh = bpy.data.meshes.new("Shoe")
    mesh.from_pydata(LEFT_BOOT[0], [], LEFT_BOOT[1])
    shoe = bpy.data.objects.new("Shoe", mesh)
    scene.collection.objects.link(shoe)
    shoe.parent, shoe.parent_type, shoe.parent_bone = armature, "BONE", "gone"
    assert [sole.sole.area for sole in sample(armature).soles] == bare


@pytest.mark.parametrize(("seen", "across"), [(True, 0.04), (False, 0.02)])
def test_a_foot_without_a_mesh_points_between_the_ball_on_its_outer_side_and_its_great_toe(seen, across):
    foot = SimpleNamespace(ankle=np.zeros(3), hinge=np.array((0.11, 0.04, -0.07)), tip=np.array((0.15, 0.0, -0.03)))
    ahead = _pointing(foot, np.array((0.0, 0.0, 1.0)), np.array((0.0, 1.0, 0.0)), 0.9, seen=seen)
    assert ahead[1] == pytest.approx(across)
    assert ahead[0] > 0.1
