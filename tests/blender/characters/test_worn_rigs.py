"""Shoes, hair and skirts on armatures of their own: one character with the body, whose feet print once."""

import bmesh
import bpy
import pytest
from mathutils import Matrix

from softground_addon.blender.characters.selection import chosen, set_up_automatically
from softground_addon.blender.reading.staleness import bodies_of
from softground_addon.blender.rigs.worn_rigs import hung_on, worn_rigs
from softground_addon.blender.settings import snapshot
from tests.blender import shots
from tests.blender.grounds import bake
from tests.blender.interface.test_selection import added, controlled, select

FEET = ("foot", "toe")


def cut(obj, groups, *, keep):
    """Keep the skin on some vertex groups of a mesh object, or all but that."""
    numbers = {group.index for group in obj.vertex_groups if group.name in groups}
    mesh = bmesh.new()
    mesh.from_mesh(obj.data)
    weights = mesh.verts.layers.deform.verify()
    gone = [vertex for vertex in mesh.verts if bool({*vertex[weights].keys()} & numbers) != keep]
    bmesh.ops.delete(mesh, geom=gone, context="VERTS")
    mesh.to_mesh(obj.data)


def copy_of(obj, name):
    """A copy of an object with data of its own, and nothing that animates it."""
    copy = obj.copy()
    copy.data, copy.name = obj.data.copy(), name
    copy.animation_data_clear()
    bpy.context.scene.collection.objects.link(copy)
    return copy


def copy_of_place(obj):
    """An empty that hangs where an object does."""
    empty = bpy.data.objects.new("Node", None)
    bpy.context.scene.collection.objects.link(empty)
    empty.parent, empty.parent_type, empty.parent_bone = obj.parent, obj.parent_type, obj.parent_bone
    return empty


def following(leader, name, kind="COPY_TRANSFORMS", **values):
    """A copy of a rig each bone of which follows that of the leader."""
    rig = copy_of(leader, name)
    for bone in rig.pose.bones:
        follows = bone.constraints.new(kind)
        follows.target, follows.subtarget = leader, bone.name
        for key, value in values.items():
            setattr(follows, key, value)
    return rig


def dressed(walker, rig):
    """Part of the walker's skin goes on another rig: that of its feet, under names of that rig's."""
    body = walker.children[0]
    feet = {group.name for group in body.vertex_groups if group.name.startswith(FEET)}
    shoes = copy_of(body, "Shoes")
    shoes.parent = shoes.modifiers[0].object = rig
    cut(body, feet, keep=False)
    cut(shoes, feet, keep=True)
    for name in feet:
        rig.data.bones[name].name = f"shoe {name}"
    bpy.context.view_layer.update()
    assert all(group.name.startswith("shoe ") for group in shoes.vertex_groups if group.name.endswith(tuple(feet)))
    return shoes


def prints(scene):
    scene.softground.cell_size = 0.02
    steps = bake(scene).report["steps"]
    moments = [(step["contact"], step["frame_start"], step["frame_end"]) for step in steps]
    return moments, [step["max_depth_m"] for step in steps]


@pytest.mark.slow
@pytest.mark.parametrize("way", ["worn", "worn from afar", "both controlled"])
def test_shoes_on_a_rig_of_their_own_print_as_the_feet_of_the_body_do(scene, way):
    control, walker = controlled(scene) if way == "both controlled" else (None, shots.walker(scene, frames=30))
    select(walker)
    bpy.ops.softground.add_character()
    whole, depths = prints(scene)
    scene.softground.characters.clear()
    rig = following(control or walker, "Shoes Rig")
    if way == "worn from afar":
        rig.location.x += 3.0
    shoes = dressed(walker, rig)
    for picked in ([rig], [shoes], [rig, walker], [walker.children[0], shoes], [walker]):
        assert len(chosen(scene, picked[0], picked)[0]) == 1
    set_up_automatically(scene)
    assert len(added(scene)) == 1
    parted, parted_depths = prints(scene)
    assert parted == whole
    assert parted_depths == pytest.approx(depths, rel=0.02)
    assert shoes in bodies_of(scene.objects, snapshot(scene))


@pytest.mark.parametrize("node", [False, True])
def test_hair_on_a_bone_and_a_skirt_that_goes_along_are_worn_whatever_keys_move_the_hair(scene, node):
    walker = shots.walker(scene, frames=30)
    body = walker.children[0]
    hair, skirt = copy_of(walker, "Hair"), copy_of(walker, "Skirt")
    hair.parent, hair.parent_type, hair.parent_bone = walker, "BONE", walker.data.bones[-1].name
    if node:  # an empty between the bone and the rig
        between = hair.parent = copy_of_place(hair)
        hair.parent_type = "OBJECT"
        hair.pose.bones[0].keyframe_insert("rotation_quaternion", frame=1)
        assert hung_on(hair, walker)[0] == between.parent_bone
    else:
        hair.keyframe_insert("rotation_euler", frame=1)
    follows = skirt.pose.bones[0].constraints.new("CHILD_OF")
    follows.target, follows.subtarget = walker, walker.data.bones[0].name
    for rig in (hair, skirt):
        mesh = copy_of(body, f"{rig.name} Mesh")
        mesh.parent = mesh.modifiers[0].object = rig
    bpy.context.view_layer.update()
    assert worn_rigs(scene.objects, walker) == [hair, skirt]
    assert not worn_rigs(scene.objects, hair) + worn_rigs(scene.objects, skirt)
    set_up_automatically(scene)
    assert added(scene) == [walker]


@pytest.mark.parametrize("who", ["drilled", "retargeted", "reaching"])
def test_a_body_that_moves_as_another_does_is_a_character_of_its_own(scene, who):
    walker = shots.walker(scene, frames=30)
    if who == "drilled":
        other = following(walker, "Other", target_space="LOCAL", owner_space="LOCAL")
    elif who == "retargeted":
        other = following(walker, "Other", "COPY_ROTATION")
        follows = other.pose.bones[0].constraints.new("COPY_LOCATION")
        follows.target, follows.subtarget = walker, walker.data.bones[0].name
    else:
        other = following(walker, "Other")
        for bone in list(other.pose.bones)[1:]:
            bone.constraints.remove(bone.constraints[0])
        other.pose.bones[0].keyframe_insert("location", frame=1)
    other.location.x += 2.0
    body = copy_of(walker.children[0], "Other Body")
    body.parent = body.modifiers[0].object = other
    bpy.context.view_layer.update()
    assert worn_rigs(scene.objects, walker) == worn_rigs(scene.objects, other) == []
    select(walker, other)
    bpy.ops.softground.add_character()
    assert added(scene) == [walker, other]


def hung(obj, rig, bone):
    """Hang an object on a bone, where it is at rest."""
    rest = rig.data.bones[bone]
    obj.modifiers.clear()
    obj.parent, obj.parent_type, obj.parent_bone = rig, "BONE", bone
    obj.matrix_parent_inverse = (rest.matrix_local @ Matrix.Translation((0, rest.length, 0))).inverted()
    obj.matrix_basis = Matrix.Identity(4)


@pytest.mark.slow
def test_shoes_that_hang_on_the_bones_of_feet_are_the_body_that_stands_on_them_and_a_staff_is_a_prop(scene):
    walker = shots.walker(scene, frames=30)
    body = walker.children[0]
    bpy.ops.mesh.primitive_cube_add(size=1, location=(0.9, 0, 0.3))
    staff = bpy.context.object
    staff.scale = (0.03, 0.03, 1.2)
    bpy.ops.object.transform_apply(location=True, scale=True)
    hung(staff, walker, next(bone.name for bone in walker.data.bones if bone.name.startswith("hand")))
    set_up_automatically(scene)
    whole, depths = prints(scene)
    assert {contact[:4] for contact, *_ in whole} == {"foot"}
    scene.softground.characters.clear()
    feet = [group.name for group in body.vertex_groups if group.name.startswith(FEET)]
    for bone in feet:
        shoe = copy_of(body, f"Shoe {bone}")
        cut(shoe, {bone}, keep=True)
        hung(shoe, walker, bone)
    cut(body, set(feet), keep=False)
    set_up_automatically(scene)
    parted, parted_depths = prints(scene)
    assert parted == whole
    assert parted_depths == pytest.approx(depths, rel=0.05)
