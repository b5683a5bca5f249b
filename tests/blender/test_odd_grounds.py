"""Grounds as artists have them: with physics, scatter, constraints and modifiers of all kinds."""

import bpy
import numpy as np
import pytest

from softground_addon.blender.baking import bake_report
from softground_addon.blender.ground import baked_ground, ground_mesh
from tests.blender import fingerprints, shots
from tests.blender.grounds import plane


@pytest.fixture
def walk(scene):
    """A short walk to be baked with coarse cells."""
    shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.02
    return scene


def field(scene, vertices=4, **values):
    """A ground of a user's, coarse by default, that is the scene's."""
    ground = scene.softground.ground = plane(scene, vertices=vertices, **values)
    bpy.context.view_layer.objects.active = ground
    bpy.context.view_layer.update()
    return ground


def refusal(operator):
    with pytest.raises(RuntimeError) as error:
        operator()
    assert "Traceback" not in str(error.value)
    return str(error.value)


def as_rendered(ground):
    """World positions of the ground's evaluated mesh, (V, 3), at the scene's frame."""
    shown = ground.evaluated_get(bpy.context.evaluated_depsgraph_get())
    points = np.empty(len(shown.data.vertices) * 3, dtype=np.float32)
    shown.data.vertices.foreach_get("co", points)
    matrix = np.array(shown.matrix_world)
    return points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def test_a_ground_that_rigid_bodies_fall_on_gets_detail_and_comes_back(walk):
    ground = field(walk)
    bpy.ops.rigidbody.object_add(type="PASSIVE")
    ground.rigid_body.friction = 0.75
    before = fingerprints.of_file()
    bodies = walk.rigidbody_world.collection
    assert bpy.ops.softground.bake() == {"FINISHED"}
    carrier = baked_ground.carrier_of(ground)
    assert carrier != ground
    assert ground_mesh.is_baked(carrier)
    assert carrier.name in walk.objects
    assert bpy.ops.softground.clear_bake() == {"FINISHED"}
    assert fingerprints.of_file() == before
    assert list(bodies.objects) == [ground]
    assert ground.rigid_body.friction == 0.75


def test_a_bake_of_a_rigid_ground_that_is_stopped_leaves_no_draft(walk):
    field(walk)
    bpy.ops.rigidbody.object_add(type="PASSIVE")
    before = fingerprints.of_file()
    from softground_addon.blender.baking import bake_job

    job = bake_job.bake(walk)
    for progress in job:
        if progress.stage == "write" and any("Trail" in thing.name for thing in bpy.data.objects):
            break
    else:
        pytest.fail("no draft was made")
    job.close()
    assert fingerprints.of_file() == before


def test_a_fine_copy_in_edit_mode_is_named_and_stays(walk):
    ground = field(walk)
    bpy.ops.softground.bake()
    carrier = baked_ground.carrier_of(ground)
    bpy.context.view_layer.objects.active = carrier
    bpy.ops.object.mode_set(mode="EDIT")
    assert f"'{carrier.name}' is in Edit Mode: leave it" in refusal(bpy.ops.softground.bake)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert bpy.ops.softground.bake() == {"FINISHED"}


def node_group():
    """An empty group of geometry nodes, with its input and output."""
    tree = bpy.data.node_groups.new("Theirs", "GeometryNodeTree")
    tree.is_modifier = True
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    return tree, tree.nodes.new("NodeGroupInput").outputs[0], tree.nodes.new("NodeGroupOutput").inputs[0]


def scatter_by_nodes(ground):
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=1, radius=0.05, location=(50.0, 0.0, 0.0))
    tree, given, result = node_group()
    stone = tree.nodes.new("GeometryNodeObjectInfo")
    stone.inputs["Object"].default_value = bpy.context.object
    points = tree.nodes.new("GeometryNodeDistributePointsOnFaces")
    points.inputs["Density"].default_value = 1.0
    stones = tree.nodes.new("GeometryNodeInstanceOnPoints")
    both = tree.nodes.new("GeometryNodeJoinGeometry")
    for one, other in (
        (given, points.inputs["Mesh"]),
        (points.outputs["Points"], stones.inputs["Points"]),
        (stone.outputs["Geometry"], stones.inputs["Instance"]),
        (given, both.inputs[0]),
        (stones.outputs["Instances"], both.inputs[0]),
        (both.outputs[0], result),
    ):
        tree.links.new(one, other)
    ground.modifiers.new("Scatter", "NODES").node_group = tree


def scatter_by_particles(ground):
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=1, radius=0.05, location=(50.0, 0.0, 0.0))
    grains = ground.modifiers.new("Scatter", "PARTICLE_SYSTEM").particle_system.settings
    grains.type, grains.count = "HAIR", 40
    grains.render_type, grains.instance_object = "OBJECT", bpy.context.object


def shown(thing):
    """Whether an object's own mesh is in the viewport, and how many instances are on it."""
    mesh, instances = False, 0
    for one in bpy.context.evaluated_depsgraph_get().object_instances:
        if one.is_instance:
            instances += one.parent.original == thing
        elif one.object.original == thing:
            mesh = one.show_self
    return mesh, instances


@pytest.mark.parametrize("scatter", [scatter_by_nodes, scatter_by_particles])
def test_what_is_scattered_on_a_ground_stays_while_a_copy_of_it_takes_the_prints(walk, scatter):
    ground = field(walk)
    scatter(ground)
    bpy.context.view_layer.update()
    mesh_is_shown, stones = shown(ground)
    assert mesh_is_shown
    assert stones > 20
    assert bpy.ops.softground.bake() == {"FINISHED"}
    carrier = baked_ground.carrier_of(ground)
    assert shown(ground) == (False, stones)
    assert shown(carrier) == (True, 0)
    assert (ground.hide_render, ground.show_instancer_for_render) == (False, False)
    assert bpy.ops.softground.bake() == {"FINISHED"}
    assert shown(ground) == (False, stones)
    assert bpy.ops.softground.clear_bake() == {"FINISHED"}
    bpy.context.view_layer.update()
    assert shown(ground) == (True, stones)
    assert ground.show_instancer_for_render


def test_a_scatter_that_renders_only_is_in_the_way_in_no_viewport(walk):
    ground = field(walk)
    scatter_by_nodes(ground)
    ground.modifiers["Scatter"].show_viewport = False
    bpy.context.view_layer.update()
    bpy.ops.softground.bake()
    assert (ground.hide_viewport, ground.hide_render) == (True, False)
    assert (ground.show_instancer_for_viewport, ground.show_instancer_for_render) == (True, False)


def test_what_collides_with_a_ground_collides_with_its_fine_copy(walk):
    ground = field(walk)
    ground.modifiers.new("Collision", "COLLISION")
    ground.collision.damping_factor = 0.25
    bpy.ops.softground.bake()
    carrier = baked_ground.carrier_of(ground)
    assert [modifier.type for modifier in carrier.modifiers] == ["NODES", "COLLISION"]
    assert carrier.collision.damping_factor == 0.25
    bpy.ops.softground.clear_bake()
    assert ground.collision.damping_factor == 0.25


def mover(scene, name="Lift"):
    """An empty that goes up."""
    empty = bpy.data.objects.new(name, None)
    scene.collection.objects.link(empty)
    for frame, height in ((1, 0.0), (30, 1.0)):
        empty.location.z = height
        empty.keyframe_insert("location", frame=frame)
    scene.frame_set(1)
    return empty


def constrain(ground, scene):
    ground.constraints.new("COPY_LOCATION").target = mover(scene)


def constrain_parent(ground, scene):
    ground.parent = bpy.data.objects.new("Platform", None)
    scene.collection.objects.link(ground.parent)
    ground.parent.constraints.new("CHILD_OF").target = mover(scene)


def turn_by_driver(ground, _scene):
    ground.driver_add("rotation_euler", 2).driver.expression = "frame * 0.01"


@pytest.mark.parametrize(
    ("let_move", "name"), [(constrain, "Lift"), (constrain_parent, "Lift"), (turn_by_driver, "Field")]
)
def test_a_ground_that_something_moves_is_named_with_what_moves_it(walk, let_move, name):
    ground = field(walk)
    let_move(ground, walk)
    bpy.context.view_layer.update()
    assert f"Ground 'Field' moves: '{name}' is animated" in refusal(bpy.ops.softground.bake)
    for constraint in (*ground.constraints, *(ground.parent.constraints if ground.parent else ())):
        constraint.mute = True
        assert bpy.ops.softground.bake() == {"FINISHED"}


def test_keys_that_move_nothing_are_no_movement(walk):
    ground = field(walk, vertices=120)
    ground["mood"] = 1.0
    ground.keyframe_insert('["mood"]', frame=1)
    ground.keyframe_insert("hide_render", frame=1)
    assert bpy.ops.softground.bake() == {"FINISHED"}
    assert not ground_mesh.warnings_of(ground)


def test_a_coarse_ground_that_keys_show_and_hide_is_named_with_the_remedy(walk):
    ground = field(walk)
    ground.keyframe_insert("hide_render", frame=1)
    before = fingerprints.of_file()
    assert "Ground 'Field' is hidden and shown by keys" in refusal(bpy.ops.softground.bake)
    assert fingerprints.of_file() == before


def lift_by_scene_time(ground, _scene):
    tree, given, result = node_group()
    inner, inner_given, inner_result = node_group()
    place, time, up = (
        inner.nodes.new(kind)
        for kind in ("GeometryNodeSetPosition", "GeometryNodeInputSceneTime", "ShaderNodeCombineXYZ")
    )
    for one, other in (
        (inner_given, place.inputs["Geometry"]),
        (time.outputs["Seconds"], up.inputs["Z"]),
        (up.outputs[0], place.inputs["Offset"]),
        (place.outputs[0], inner_result),
    ):
        inner.links.new(one, other)
    nested = tree.nodes.new("GeometryNodeGroup")
    nested.node_tree = inner
    tree.links.new(given, nested.inputs[0])
    tree.links.new(nested.outputs[0], result)
    ground.modifiers.new("Theirs", "NODES").node_group = tree


def hook(ground, scene):
    modifier = ground.modifiers.new("Theirs", "HOOK")
    modifier.object = mover(scene)
    modifier.vertex_indices_set([0, 1])


def grow_by_keys(ground, scene):
    modifier = ground.modifiers.new("Theirs", "DISPLACE")
    modifier.mid_level = 0.0
    for frame, strength in ((1, 0.0), (30, 0.2)):
        modifier.strength = strength
        modifier.keyframe_insert("strength", frame=frame)
    scene.frame_set(1)


@pytest.mark.parametrize("change", [lift_by_scene_time, hook, grow_by_keys])
def test_a_ground_that_anything_shapes_over_time_is_told_of_and_up_to_date_at_every_frame(walk, change):
    ground = field(walk, vertices=120)
    change(ground, walk)
    bpy.context.view_layer.update()
    assert bpy.ops.softground.bake() == {"FINISHED"}
    (warning,) = ground_mesh.warnings_of(baked_ground.carrier_of(ground))
    assert "'Field' changes its shape over time by its modifier 'Theirs'" in warning
    for frame in (1, 20):
        walk.frame_set(frame)
        assert bake_report.stale_reasons(walk) == ()


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
def test_a_ground_above_the_feet_is_named_with_the_remedy(walk, build, depth):
    ground = build(walk)
    bpy.context.view_layer.update()
    said = refusal(bpy.ops.softground.bake)
    assert f"The feet of 'Walker' are {depth} m below '{ground.name}': move the ground down" in said
    assert "Recalculate Inside" in said


def test_a_room_with_its_faces_inward_takes_prints_on_its_floor(walk):
    ground = room(walk)
    ground.data.flip_normals()
    bpy.context.view_layer.update()
    assert bpy.ops.softground.bake() == {"FINISHED"}
    walk.frame_set(30)
    height = as_rendered(baked_ground.carrier_of(ground))[:, 2]
    assert -0.1 < height.min() < -0.02


def test_a_file_path_is_the_same_wherever_the_blend_is_saved(walk, tmp_path):
    ground = field(walk)
    ocean = ground.modifiers.new("Swell", "OCEAN")
    ocean.geometry_mode, ocean.wave_scale = "GENERATE", 0.1
    assert bpy.ops.softground.bake() == {"FINISHED"}
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        path = tmp_path / folder / "shot.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        bpy.ops.wm.open_mainfile(filepath=str(path))
        assert bake_report.stale_reasons(bpy.context.scene) == ()


def test_a_carrier_whose_playback_was_applied_is_no_longer_up_to_date(walk):
    walk.softground.shape_keys = False
    ground = field(walk)
    bpy.ops.softground.bake()
    assert bake_report.stale_reasons(walk) == ()
    carrier = baked_ground.carrier_of(ground)
    walk.frame_set(12)
    with bpy.context.temp_override(object=carrier, active_object=carrier):
        bpy.ops.object.modifier_apply(modifier="SoftGround Playback")
    assert bake_report.stale_reasons(walk) == ("'Field Trail' has lost its playback, and shows one moment only",)
    assert bpy.ops.softground.bake() == {"FINISHED"}
    assert bake_report.stale_reasons(walk) == ()


@pytest.fixture
def shrinkwrapped(walk):
    """A fine grid that a Shrinkwrap lays onto a coarse hill, wherever its vertices are."""
    hill = plane(walk, vertices=40, height=lambda x, y: 0.05 * np.sin(2 * x))
    hill.name, hill.hide_render = "Hill", True
    ground = field(walk, vertices=200, size=6.0)
    wrap = ground.modifiers.new("Wrap", "SHRINKWRAP")
    wrap.target, wrap.wrap_method, wrap.use_project_z, wrap.use_negative_direction = hill, "PROJECT", True, True
    ground.location.z = 0.5
    bpy.context.view_layer.update()
    return ground


def test_prints_that_modifiers_would_undo_are_taken_by_a_copy_without_them(walk, shrinkwrapped):
    assert bpy.ops.softground.bake() == {"FINISHED"}
    carrier = baked_ground.carrier_of(shrinkwrapped)
    assert carrier != shrinkwrapped
    walk.frame_set(1)
    before = as_rendered(carrier)[:, 2]
    walk.frame_set(30)
    assert -0.1 < (as_rendered(carrier)[:, 2] - before).min() < -0.02
    (warning,) = ground_mesh.warnings_of(carrier)
    assert "The modifiers of ground 'Field' undo prints on it" in warning


def test_prints_that_modifiers_would_undo_are_refused_where_there_may_be_no_copy(walk, shrinkwrapped):
    walk.softground.detail = "NEVER"
    assert "ground 'Field' would not show, as its modifiers undo them" in refusal(bpy.ops.softground.bake)


def test_live_prints_show_where_modifiers_would_undo_them(walk, shrinkwrapped):
    bpy.ops.softground.live()
    try:
        carrier = baked_ground.carrier_of(shrinkwrapped)
        before = as_rendered(carrier)[:, 2]
        walk.frame_set(15)
        assert -0.1 < (as_rendered(carrier)[:, 2] - before).min() < -0.02
    finally:
        bpy.ops.softground.live()


@pytest.mark.parametrize("kind", ["SUBSURF", "DISPLACE", "SOLIDIFY", "SMOOTH", "WAVE"])
def test_modifiers_that_let_prints_through_stay_on_the_ground(walk, kind):
    ground = field(walk, vertices=200, size=6.0)
    ground.scale = (1.0, -1.0, 1.0)
    modifier = ground.modifiers.new("Theirs", kind)
    if kind == "DISPLACE":
        modifier.strength, modifier.mid_level = 0.05, 0.0
    bpy.context.view_layer.update()
    assert bpy.ops.softground.bake() == {"FINISHED"}
    assert baked_ground.carrier_of(ground) == ground


@pytest.mark.parametrize(("kind", "shape_keys"), [("DISPLACE", True), ("DISPLACE", False), ("SOLIDIFY", True)])
def test_the_final_mesh_holds_what_modifiers_make_of_the_ground(walk, kind, shape_keys):
    walk.softground.shape_keys = shape_keys
    ground = field(walk, vertices=150, size=5.0)
    ground.data.materials.append(bpy.data.materials.new("Snow"))
    ground.data.uv_layers.new(name="Theirs")
    modifier = ground.modifiers.new("Theirs", kind)
    if kind == "DISPLACE":
        modifier.strength, modifier.mid_level, modifier.direction = 0.2, 0.0, "Z"
    bpy.context.view_layer.update()
    bpy.ops.softground.bake()
    walk.frame_set(100)
    seen = as_rendered(ground)
    meshes = len(bpy.data.meshes)
    bpy.ops.softground.final_mesh()
    still = next(thing for thing in walk.objects if thing.name.endswith("Final"))
    assert not still.modifiers
    assert still.data.shape_keys is None
    np.testing.assert_allclose(as_rendered(still), seen, atol=1e-6)
    assert [material.name for material in still.data.materials] == ["Snow"]
    assert still.data.materials[0] == bpy.data.materials["Snow"]
    assert [layer.name for layer in still.data.uv_layers] == ["Theirs"]
    assert not [key for key in still.data.keys() if key.startswith("softground")]  # noqa: SIM118  (an ID is no mapping)
    assert {name for name in still.data.attributes.keys() if name.startswith("softground")} == {  # noqa: SIM118
        "softground_compression",
        "softground_rim",
        "softground_age",
    }
    assert len(bpy.data.meshes) == meshes + 1


def test_a_ground_that_nodes_make_of_nothing_gets_a_copy_and_comes_back(walk):
    ground = bpy.data.objects.new("Made", bpy.data.meshes.new("Made"))
    walk.collection.objects.link(ground)
    tree, _, result = node_group()
    grid = tree.nodes.new("GeometryNodeMeshGrid")
    for name, value in (("Size X", 7.0), ("Size Y", 7.0), ("Vertices X", 30), ("Vertices Y", 30)):
        grid.inputs[name].default_value = value
    tree.links.new(grid.outputs["Mesh"], result)
    modifier = ground.modifiers.new("Theirs", "NODES")
    modifier.node_group = tree
    walk.softground.ground = ground
    bpy.context.view_layer.update()
    before = fingerprints.of_file()
    assert bpy.ops.softground.bake() == {"FINISHED"}
    walk.frame_set(30)
    assert -0.1 < as_rendered(baked_ground.carrier_of(ground))[:, 2].min() < -0.02
    assert bake_report.stale_reasons(walk) == ()
    walk.frame_set(1)
    assert bpy.ops.softground.clear_bake() == {"FINISHED"}
    assert fingerprints.of_file() == before
    modifier.show_viewport = False
    bpy.context.view_layer.update()
    assert "Ground 'Made' has no faces" in refusal(bpy.ops.softground.bake)
    modifier.show_viewport = True
    walk.softground.detail = "NEVER"
    assert "Ground 'Made' is too coarse" in refusal(bpy.ops.softground.bake)
