"""Grounds as artists have them: with physics, scatter and constraints, overhead, and under edit."""

import bpy
import pytest

from softground_addon.blender.baking import bake_job
from softground_addon.blender.ground import baked_ground, ground_mesh
from softground_addon.blender.panels import ground_options_panel
from tests.blender import fingerprints
from tests.blender.grounds import as_rendered, bake, field, mover, node_group, refusal


def test_a_ground_that_rigid_bodies_fall_on_gets_detail_and_comes_back(short_walk):
    ground = field(short_walk)
    bpy.ops.rigidbody.object_add(type="PASSIVE")
    ground.rigid_body.friction = 0.75
    before = fingerprints.of_file()
    bodies = short_walk.rigidbody_world.collection
    assert bpy.ops.softground.bake() == {"FINISHED"}
    display_mesh = baked_ground.display_mesh_of(ground)
    assert display_mesh != ground
    assert ground_mesh.is_baked(display_mesh)
    assert display_mesh.name in short_walk.objects
    assert bpy.ops.softground.clear_bake() == {"FINISHED"}
    assert fingerprints.of_file() == before
    assert list(bodies.objects) == [ground]
    assert ground.rigid_body.friction == 0.75


def test_a_bake_of_a_rigid_ground_that_is_stopped_leaves_no_draft(short_walk):
    field(short_walk)
    bpy.ops.rigidbody.object_add(type="PASSIVE")
    before = fingerprints.of_file()
    job = bake_job.bake(short_walk)
    for progress in job:
        if progress.stage == "write" and any("Trail" in thing.name for thing in bpy.data.objects):
            break
    else:
        pytest.fail("no draft was made")
    job.close()
    assert fingerprints.of_file() == before


def test_a_fine_copy_in_edit_mode_is_named_and_stays(short_walk):
    ground = field(short_walk)
    bpy.ops.softground.bake()
    display_mesh = baked_ground.display_mesh_of(ground)
    bpy.context.view_layer.objects.active = display_mesh
    bpy.ops.object.mode_set(mode="EDIT")
    assert f"'{display_mesh.name}' beside ground 'Field' is in Edit Mode: leave it" in refusal(bpy.ops.softground.bake)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert bpy.ops.softground.bake() == {"FINISHED"}


def scatter_by_nodes(ground):
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=1, radius=0.05, location=(50.0, 0.0, 0.0))
    tree, given, result = node_group()
    stone = tree.nodes.new("GeometryNodeObjectInfo")
    stone.inputs["Object"].default_value = bpy.context.object
    points = tree.nodes.new("GeometryNodeDistributePointsOnFaces")
    points.inputs["Density"].default_value = 1.0
    stones = tree.nodes.new("GeometryNodeInstanceOnPoints")
    both = tree.nodes.new("GeometryNodeJoinGeometry")
    for source, target in (
        (given, points.inputs["Mesh"]),
        (points.outputs["Points"], stones.inputs["Points"]),
        (stone.outputs["Geometry"], stones.inputs["Instance"]),
        (given, both.inputs[0]),
        (stones.outputs["Instances"], both.inputs[0]),
        (both.outputs[0], result),
    ):
        tree.links.new(source, target)
    ground.modifiers.new("Scatter", "NODES").node_group = tree


def scatter_by_particles(ground):
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=1, radius=0.05, location=(50.0, 0.0, 0.0))
    grains = ground.modifiers.new("Scatter", "PARTICLE_SYSTEM").particle_system.settings
    grains.type, grains.count = "HAIR", 40
    grains.render_type, grains.instance_object = "OBJECT", bpy.context.object


def shown(thing):
    """True if an object's own mesh is in the viewport, and how many instances are on it."""
    mesh, instances = False, 0
    for instance in bpy.context.evaluated_depsgraph_get().object_instances:
        if instance.is_instance:
            instances += instance.parent.original == thing
        elif instance.object.original == thing:
            mesh = instance.show_self
    return mesh, instances


@pytest.mark.parametrize("scatter", [scatter_by_nodes, scatter_by_particles])
def test_what_is_scattered_on_a_ground_stays_while_a_copy_of_it_takes_the_prints(short_walk, scatter):
    ground = field(short_walk)
    scatter(ground)
    bpy.context.view_layer.update()
    mesh_is_shown, stones = shown(ground)
    assert mesh_is_shown
    assert stones > 20
    assert bpy.ops.softground.bake() == {"FINISHED"}
    display_mesh = baked_ground.display_mesh_of(ground)
    assert shown(ground) == (False, stones)
    assert shown(display_mesh) == (True, 0)
    assert (ground.hide_render, ground.show_instancer_for_render) == (False, False)
    assert bpy.ops.softground.bake() == {"FINISHED"}
    assert shown(ground) == (False, stones)
    assert bpy.ops.softground.clear_bake() == {"FINISHED"}
    bpy.context.view_layer.update()
    assert shown(ground) == (True, stones)
    assert ground.show_instancer_for_render


@pytest.mark.parametrize("scatter", [scatter_by_nodes, scatter_by_particles])
def test_what_is_scattered_on_a_ground_after_a_bake_is_seen_from_the_next_on(short_walk, scatter):
    ground = field(short_walk)
    assert bpy.ops.softground.bake() == {"FINISHED"}
    scatter(ground)
    assert bpy.ops.softground.bake() == {"FINISHED"}
    mesh_is_shown, stones = shown(ground)
    assert (mesh_is_shown, ground.hide_render, ground.show_instancer_for_render) == (False, False, False)
    assert stones > 20
    ground.hide_viewport = True  # by the user
    ground.modifiers.clear()
    assert bpy.ops.softground.clear_bake() == {"FINISHED"}
    assert not ground.hide_viewport
    assert not ground.hide_render
    assert ground.show_instancer_for_viewport
    assert ground.show_instancer_for_render


def test_a_ground_that_the_user_shows_again_stays_shown(short_walk):
    ground = field(short_walk)
    bpy.ops.softground.bake()
    ground.hide_viewport = False
    bpy.ops.softground.bake()
    assert (ground.hide_viewport, ground.hide_render) == (False, True)


def test_the_copy_that_shows_the_prints_is_selected_by_a_button_and_is_no_ground_of_its_own(short_walk):
    ground = field(short_walk)
    ground.select_set(True)
    bpy.ops.softground.bake()
    copy = baked_ground.display_mesh_of(ground)
    bpy.context.view_layer.objects.active = next(obj for obj in short_walk.objects if obj.type == "ARMATURE")
    copy.select_set(False)
    assert bpy.ops.softground.open_settings(of="GROUND") == {"FINISHED"}
    assert bpy.context.selected_objects == [copy]
    assert bpy.context.active_object == copy
    assert ground_options_panel.SOFTGROUND_PT_of_ground.poll(bpy.context)
    assert bpy.ops.softground.use_as_ground() == {"FINISHED"}
    assert short_walk.softground.ground == ground
    with pytest.raises(RuntimeError, match="Select meshes to stand on, other than the ground"):
        bpy.ops.softground.add_hard_ground()
    short_walk.softground.ground = copy
    with pytest.raises(RuntimeError, match="'Field Trail' shows the prints of ground 'Field': choose 'Field'"):
        bpy.ops.softground.bake()
    short_walk.softground.ground = ground
    copy.hide_set(True)
    with pytest.raises(RuntimeError, match="'Field Trail' is hidden"):
        bpy.ops.softground.open_settings(of="GROUND")


def test_a_scatter_that_renders_only_is_in_the_way_in_no_viewport(short_walk):
    ground = field(short_walk)
    scatter_by_nodes(ground)
    ground.modifiers["Scatter"].show_viewport = False
    bpy.context.view_layer.update()
    bpy.ops.softground.bake()
    assert (ground.hide_viewport, ground.hide_render) == (True, False)
    assert (ground.show_instancer_for_viewport, ground.show_instancer_for_render) == (True, False)


@pytest.mark.slow
def test_what_collides_with_a_ground_collides_with_its_fine_copy(short_walk):
    ground = field(short_walk)
    ground.modifiers.new("Collision", "COLLISION")
    ground.collision.damping_factor = 0.25
    bpy.ops.softground.bake()
    display_mesh = baked_ground.display_mesh_of(ground)
    assert [modifier.type for modifier in display_mesh.modifiers] == ["NODES", "COLLISION"]
    assert display_mesh.collision.damping_factor == 0.25
    bpy.ops.softground.clear_bake()
    assert ground.collision.damping_factor == 0.25


def constrain(ground, scene):
    ground.constraints.new("COPY_LOCATION").target = mover(scene)


def constrain_parent(ground, scene):
    ground.parent = bpy.data.objects.new("Platform", None)
    scene.collection.objects.link(ground.parent)
    ground.parent.constraints.new("CHILD_OF").target = mover(scene)


def turn_by_driver(ground, _scene):
    ground.driver_add("rotation_euler", 2).driver.expression = "frame * 0.01"


@pytest.mark.parametrize("let_move", [constrain, constrain_parent, turn_by_driver])
def test_a_ground_that_something_moves_takes_prints(short_walk, let_move):
    ground = field(short_walk)
    let_move(ground, short_walk)
    bpy.context.view_layer.update()
    assert bake(short_walk).report["steps"]
    for constraint in (*ground.constraints, *(ground.parent.constraints if ground.parent else ())):
        constraint.mute = True
        assert len(bake(short_walk).report["steps"]) == 3


def test_keys_that_move_nothing_are_no_movement(short_walk):
    ground = field(short_walk, vertices=120)
    ground["mood"] = 1.0
    ground.keyframe_insert('["mood"]', frame=1)
    ground.keyframe_insert("hide_render", frame=1)
    assert bpy.ops.softground.bake() == {"FINISHED"}
    assert not ground_mesh.warnings_of(ground)


def test_a_coarse_ground_that_keys_show_and_hide_is_named_with_the_remedy(short_walk):
    ground = field(short_walk)
    ground.keyframe_insert("hide_render", frame=1)
    before = fingerprints.of_file()
    assert "Ground 'Field' is hidden and shown by keys" in refusal(bpy.ops.softground.bake)
    assert fingerprints.of_file() == before


def overhead(scene):
    ground = field(scene)
    ground.location.z = 5.0
    return ground


def room(scene):
    """A box with its faces to the outside, as Blender adds it."""
    bpy.ops.mesh.primitive_cube_add(size=8.0, location=(0.0, 0.0, 4.0))
    scene.softground.ground = bpy.context.object
    return bpy.context.object


@pytest.mark.parametrize(("build", "depth"), [(overhead, "5"), (room, "8")])
def test_a_ground_above_the_feet_is_named_with_the_remedy(short_walk, build, depth):
    ground = build(short_walk)
    bpy.context.view_layer.update()
    said = refusal(bpy.ops.softground.bake)
    assert f"The feet of 'Walker' are {depth} m below '{ground.name}': move the ground down" in said
    assert "Recalculate Inside" in said


def test_an_upper_storey_is_named_as_one_of_several_layers(short_walk):
    ground = field(short_walk)
    upper = ground.modifiers.new("Upper", "ARRAY")
    upper.use_relative_offset, upper.use_constant_offset = False, True
    upper.constant_offset_displace = (0.0, 0.0, 3.0)
    bpy.context.view_layer.update()
    assert "Ground 'Field' has several layers" in refusal(bpy.ops.softground.bake)


def test_a_room_with_its_faces_inward_takes_prints_on_its_floor(short_walk):
    ground = room(short_walk)
    ground.data.flip_normals()
    bpy.context.view_layer.update()
    assert bpy.ops.softground.bake() == {"FINISHED"}
    short_walk.frame_set(30)
    height = as_rendered(baked_ground.display_mesh_of(ground))[:, 2]
    assert -0.1 < height.min() < -0.02


def test_a_ground_that_shows_nothing_but_instances_says_how_to_make_them_a_mesh(short_walk):
    ground = field(short_walk)
    tree, given, result = node_group()
    points = tree.nodes.new("GeometryNodeInstanceOnPoints")
    tree.links.new(given, points.inputs["Points"])
    tree.links.new(given, points.inputs["Instance"])
    tree.links.new(points.outputs[0], result)
    ground.modifiers.new("Tiles", "NODES").node_group = tree
    assert "let Realize Instances follow" in refusal(bpy.ops.softground.bake)
