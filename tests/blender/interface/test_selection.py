"""Add Character and Create Ground on whatever is selected: they do what is meant, or say in a sentence what to do."""

import bmesh
import bpy
import pytest

from softground_addon.blender import settings
from softground_addon.blender.characters.selection import set_up_automatically, walkers_of
from softground_addon.core.errors import InputError
from tests.blender import rigs, shots
from tests.blender.characters.test_recognition import box, stool
from tests.blender.grounds import bake


def select(*things):
    """Select some objects, the first of them active."""
    bpy.context.view_layer.update()
    for thing in bpy.context.view_layer.objects:
        thing.select_set(thing in things)
    bpy.context.view_layer.objects.active = things[0] if things else None


def added(scene):
    return [character.armature or character.soles[0].object for character in scene.softground.characters]


def new_object(name, data=None):
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    return thing


@pytest.fixture
def cube(scene):
    bpy.ops.mesh.primitive_cube_add(location=(5, 5, 1))
    return bpy.context.active_object


@pytest.mark.slow
@pytest.mark.parametrize("what", ["cube", "camera", "empty", "nothing"])
def test_what_is_no_rig_and_does_not_move_stands_for_the_only_rig_that_does(scene, cube, what):
    walker = shots.walker(scene)
    camera = new_object("Camera", bpy.data.cameras.new("Camera"))
    select(*{"cube": [cube], "camera": [camera], "empty": [new_object("Empty")], "nothing": []}[what])
    bpy.ops.softground.add_character()
    assert added(scene) == [walker]


def test_the_first_cube_of_an_empty_scene_is_added_with_what_it_lacks(scene, cube, capfd):
    select(cube)
    bpy.ops.softground.add_character()
    assert added(scene) == [cube]
    assert "'Cube' does not move: give it keys or a rigid body before you bake" in capfd.readouterr().out


def test_a_camera_without_any_rig_and_several_rigs_unselected_are_told_what_to_do(scene):
    camera = new_object("Camera", bpy.data.cameras.new("Camera"))
    select(camera)
    with pytest.raises(RuntimeError, match="'Camera' is not an armature but of type Camera: select the character"):
        bpy.ops.softground.add_character()
    shots.walker(scene)
    shots.walker(scene)
    select(camera)
    with pytest.raises(RuntimeError, match=r"Several rigs move .*'Walker', 'Walker.001'.*select those"):
        bpy.ops.softground.add_character()
    assert not scene.softground.characters


def test_all_selected_rigs_are_added_by_themselves_or_by_their_meshes(scene):
    first, second, third = (shots.walker(scene, frames=30) for _ in range(3))
    select(first, second)
    bpy.ops.softground.add_character()
    assert added(scene) == [first, second]
    select(third.children[0], first)
    bpy.ops.softground.add_character()
    assert added(scene) == [first, second, third]
    with pytest.raises(RuntimeError, match="is already a character"):
        bpy.ops.softground.add_character()


def test_an_empty_above_a_rig_and_what_it_carries_stand_for_it(scene, cube):
    walker = shots.walker(scene, frames=30)
    root = new_object("Root")
    walker.parent = root
    select(root)
    bpy.ops.softground.add_character()
    assert added(scene) == [walker]
    scene.softground.characters.clear()
    cube.parent, cube.parent_type, cube.parent_bone = walker, "BONE", walker.data.bones[-1].name
    select(cube)
    bpy.ops.softground.add_character()
    assert added(scene) == [walker]


def controlled(scene):
    """A rig with keys and no mesh, and one that follows it bone by bone and moves the mesh."""
    deform = shots.walker(scene, frames=40)
    control = deform.copy()
    control.data = deform.data.copy()
    control.name = "Controls"
    scene.collection.objects.link(control)
    deform.animation_data_clear()
    for bone in deform.pose.bones:
        follows = bone.constraints.new("COPY_TRANSFORMS")
        follows.target, follows.subtarget = control, bone.name
    bpy.context.view_layer.update()
    return control, deform


@pytest.mark.slow
def test_of_a_control_rig_and_a_deform_rig_the_one_that_moves_the_skin_is_added(scene):
    control, deform = controlled(scene)
    assert walkers_of(scene.objects) == [deform]
    for chosen in ([control], [deform.children[0]], [control, deform], []):
        scene.softground.characters.clear()
        select(*chosen)
        bpy.ops.softground.add_character()
        assert added(scene) == [deform]
    scene.softground.characters.clear()
    set_up_automatically(scene)
    assert added(scene) == [deform]
    assert (scene.softground.frame_start, scene.softground.frame_end) == (1, 40)
    scene.softground.cell_size = 0.02
    assert len(bake(scene).report["steps"]) >= 2


def block(scene):
    """A rig of one bone that stands in a box: no names, no legs, nothing that moves."""
    armature = rigs.build("Block", {"Thing": ((0, 0, 0), (0, 0, 1))}, {})
    box("body", 0.4, (0, 0, 0.2), armature, "Thing")
    bpy.context.view_layer.update()
    return armature


def test_a_rig_without_feet_is_added_with_an_empty_list_that_bones_fill(scene, capfd):
    armature = block(scene)
    select(armature)
    bpy.ops.softground.add_character()
    (character,) = scene.softground.characters
    assert not character.soles
    assert "Added 'Block', but found no feet: select the bones that touch the ground" in capfd.readouterr().out
    with pytest.raises(RuntimeError, match="No feet found in 'Block': select the bones"):
        bpy.ops.softground.detect_bones()
    rigs.key(armature, "location", {1: (0, 0, 0), 20: (0, 0.2, 0)}, bone="Thing")
    with pytest.raises(InputError, match=r"'Block' has no feet, and nothing else to print with: .* press Add Contact"):
        bake(scene)
    bpy.ops.object.mode_set(mode="POSE")
    bpy.ops.pose.select_all(action="SELECT")
    bpy.ops.softground.add_contact()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert [sole.bone for sole in character.soles] == ["Thing"]
    scene.softground.frame_start, scene.softground.frame_end = 1, 20
    assert bake(scene).report["steps"]


def test_a_fish_that_touches_nothing_is_said_to_leave_no_print(scene, capfd):
    armature = block(scene)
    swims = {frame: (0, 0.3 + 0.05 * frame, 0.1 * frame) for frame in range(1, 31)}
    rigs.key(armature, "location", swims, bone="Thing")
    select(armature)
    bpy.ops.softground.add_character()
    said = capfd.readouterr().out
    assert "Added 'Block', but nothing of its skin rests on the ground, as of what swims or flies: it leaves no" in said
    with pytest.raises(InputError, match=r"Remove it from the characters if nothing of it touches the ground"):
        bake(scene)


def test_the_selected_vertices_of_a_skin_choose_the_bones_that_carry_them(scene):
    armature = stool()
    feet = [thing for thing in scene.objects if thing.name.endswith("foot")]
    select(feet[0], *feet[1:], bpy.data.objects["seat"])
    bpy.ops.object.join()
    skin = bpy.context.active_object
    select(armature)
    bpy.ops.softground.add_character()
    (character,) = scene.softground.characters
    character.soles.clear()
    select(skin)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    with pytest.raises(RuntimeError, match=r"No vertex of '.* foot' is selected that a bone of 'Stool' carries"):
        bpy.ops.softground.add_contact()
    shape = bmesh.from_edit_mesh(skin.data)
    for vertex in shape.verts:
        vertex.select_set(vertex.co.z < 0.12)
    shape.select_flush_mode()
    bmesh.update_edit_mesh(skin.data)
    bpy.ops.softground.add_contact()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert {sole.bone for sole in character.soles} == {"Qx", "Zk", "Vn"}
    assert all(sole.parts.keys() == [sole.bone] for sole in character.soles)


def test_a_deleted_character_neither_bakes_nor_sets_the_frames_of_the_next(scene):
    first = shots.walker(scene, frames=90)
    bpy.ops.softground.add_character()
    bpy.data.objects.remove(first.children[0])
    select(first)
    bpy.ops.object.delete()
    second = shots.walker(scene, frames=30)
    select(second)
    bpy.ops.softground.add_character()
    assert [settings.is_set_up(character) for character in scene.softground.characters] == [False, True]
    assert (scene.softground.frame_start, scene.softground.frame_end) == (1, 30)


def test_an_instance_of_a_collection_is_no_ground_and_says_what_makes_it_one(scene, cube):
    shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    shared = bpy.data.collections.new("Set")
    shared.objects.link(cube)
    instance = new_object("Set")
    instance.instance_type, instance.instance_collection = "COLLECTION", shared
    select(instance)
    with pytest.raises(RuntimeError, match=r"'Set' is a collection instance.* Make Instances Real"):
        bpy.ops.softground.create_ground()
    assert scene.softground.ground is None


def test_a_selected_mesh_that_cannot_be_the_ground_says_why_and_nothing_else(scene):
    shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    faceless = bpy.data.objects.new("Wire", bpy.data.meshes.new("Wire"))
    scene.collection.objects.link(faceless)
    select(faceless)
    with pytest.raises(RuntimeError, match=r"^Error: Ground 'Wire' has no faces: choose a surface"):
        bpy.ops.softground.create_ground()
    assert scene.softground.ground is None


def parts(scene):
    """A figure of rigid parts under an empty, two of which are keyed."""
    top = new_object("Robot")
    for name, x in (("left", 0.1), ("right", -0.1)):
        bpy.ops.mesh.primitive_cube_add(size=0.2, location=(x, 0, 0.1))
        part = bpy.context.active_object
        part.name, part.parent = name, top
        part.keyframe_insert("location", frame=1)
    return top


@pytest.mark.parametrize("beside", [False, True], ids=["alone", "beside a rig that walks"])
def test_an_empty_above_parts_without_an_armature_says_what_to_select(scene, beside):
    if beside:
        shots.walker(scene, frames=30)
    top = parts(scene)
    select(top)
    with pytest.raises(RuntimeError, match=r"'Robot' has no armature, only mesh objects below it: select those"):
        bpy.ops.softground.add_character()
    select(*top.children)
    bpy.ops.softground.add_character()
    assert [sole.name for sole in scene.softground.characters[0].soles] == ["left", "right"]


def crowd_by_nodes(shown, *, as_instance, only_near=False):
    """An object with points that show a mesh each, or a cube each that reads how near the mesh is."""
    points = bpy.data.meshes.new("Crowd")
    points.from_pydata([(1.5 * number, 5, 0) for number in range(20)], [], [])
    crowd = new_object("Crowd", points)
    tree = bpy.data.node_groups.new("Crowd", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    names = ("NodeGroupInput", "NodeGroupOutput", "GeometryNodeInstanceOnPoints", "GeometryNodeObjectInfo")
    first, last, on_points, info = map(tree.nodes.new, names)
    info.inputs["Object"].default_value, info.inputs["As Instance"].default_value = shown, as_instance
    source = info.outputs["Geometry"]
    if only_near:
        near, block = tree.nodes.new("GeometryNodeProximity"), tree.nodes.new("GeometryNodeMeshCube")
        tree.links.new(source, near.inputs[0])
        tree.links.new(near.outputs["Distance"], on_points.inputs["Scale"])
        source = block.outputs["Mesh"]
    tree.links.new(first.outputs[0], on_points.inputs["Points"])
    tree.links.new(source, on_points.inputs["Instance"])
    tree.links.new(on_points.outputs[0], last.inputs[0])
    crowd.modifiers.new("Crowd", "NODES").node_group = tree
    return crowd


def crowd_by_vertices(shown):
    crowd = crowd_by_nodes(shown, as_instance=True, only_near=True)
    crowd.modifiers.clear()
    shown.parent, crowd.instance_type = crowd, "VERTS"
    return crowd


CROWDS = {
    "objects": lambda body: crowd_by_nodes(body, as_instance=True),
    "meshes": lambda body: crowd_by_nodes(body, as_instance=False),
    "vertices": crowd_by_vertices,
}


@pytest.mark.parametrize("kind", CROWDS)
def test_a_crowd_of_instances_is_refused_and_beside_a_rig_that_bakes_it_is_named(scene, kind):
    walker = shots.walker(scene, frames=30)
    body = walker.children[0]
    select(CROWDS[kind](body))
    with pytest.raises(RuntimeError, match=f"'{body.name}' is also shown as instances by 'Crowd', which leave no"):
        bpy.ops.softground.add_character()
    select(walker)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.02
    assert [finding["code"] for finding in bake(scene).report["self_check"]] == ["instances"]


def test_instances_of_something_else_that_read_where_a_body_is_are_no_crowd(scene):
    walker = shots.walker(scene, frames=30)
    select(crowd_by_nodes(walker.children[0], as_instance=False, only_near=True))
    bpy.ops.softground.add_character()
    assert added(scene) == [walker]
    scene.softground.cell_size = 0.02
    assert bake(scene).report["self_check"] == []
