"""A bake that no longer fits what it was made from says so."""

import json

import bpy
import pytest

from softground_addon.blender.baking import bake_report
from softground_addon.blender.characters.contact_editing import add_object_contacts
from softground_addon.blender.compat import action_curves
from softground_addon.blender.ground import baked_ground
from softground_addon.blender.reading import analysis, staleness
from softground_addon.blender.settings import snapshot
from tests.blender import rigs, shots
from tests.blender.grounds import plane
from tests.tiers import slow_but_one


@pytest.fixture(scope="module", params=["NEVER", "ALWAYS"])
def baked_file(addon, tmp_path_factory, request):
    """A bake on the ground itself, and one on detail along the trail."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    shots.walker(scene, frames=40)
    bpy.ops.softground.add_character()
    scene.softground.ground = plane(scene)
    scene.softground.detail, scene.softground.frame_end = request.param, 40
    bpy.context.view_layer.update()
    bpy.ops.softground.bake()
    assert bake_report.stale_reasons(scene) == ()
    path = tmp_path_factory.mktemp("baked") / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@pytest.fixture
def baked(baked_file):
    bpy.ops.wm.open_mainfile(filepath=str(baked_file))
    return bpy.context.scene


def test_a_fresh_bake_is_up_to_date_at_every_frame_also_after_a_reload(baked):
    assert bake_report.stale_reasons(baked) == ()
    baked.frame_set(17)
    assert bake_report.stale_reasons(baked) == ()


def test_asking_whether_a_bake_is_outdated_touches_nothing(baked):
    """What does would have Blender call the handlers, which ask again, for ever."""
    updates = []
    bpy.context.view_layer.update()
    bpy.app.handlers.depsgraph_update_post.append(lambda *_: updates.append(1))
    try:
        assert bake_report.stale_reasons(baked) == ()
        bpy.context.view_layer.update()
    finally:
        bpy.app.handlers.depsgraph_update_post.pop()
    assert updates == []


def change_setting(scene):
    scene.softground.material.youngs_modulus *= 1.01


def change_mass(scene):
    scene.softground.characters[0].mass += 1


def move_ground(scene):
    scene.softground.ground.location.z += 0.01


def delete_vertex(scene):
    import bmesh  # only there once bpy is

    for thing in {scene.softground.ground, baked_ground.display_mesh_of(scene.softground.ground)}:
        edited = bmesh.new()
        edited.from_mesh(thing.data)
        edited.verts.ensure_lookup_table()
        edited.verts.remove(edited.verts[0])
        edited.to_mesh(thing.data)
        edited.free()


def curves_of(thing):
    return action_curves(thing.animation_data.action)


def move_key(scene):
    curves_of(scene.softground.characters[0].armature)[0].keyframe_points[3].co.y += 0.001


def remap_time(scene):
    scene.render.frame_map_new = 120


def halve_gravity(scene):
    scene.gravity.z /= 2


def change_unit(scene):
    scene.unit_settings.scale_length = 0.5


def move_character(scene):
    scene.softground.characters[0].armature.location.x += 0.1


def move_parent(scene):
    parent = bpy.data.objects.new("Parent", None)
    scene.collection.objects.link(parent)
    scene.softground.characters[0].armature.parent = parent
    parent.location.x = 0.1


def add_strip(scene):
    armature = scene.softground.characters[0].armature
    track = armature.animation_data.nla_tracks.new()
    track.strips.new("again", 60, armature.animation_data.action)


ANY_SETTING = (change_setting, change_mass, remap_time, halve_gravity, change_unit)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "message"),
    [
        *slow_but_one((change, "settings") for change in ANY_SETTING),
        (move_ground, "'Field' has changed"),
        (delete_vertex, "'Field"),
        (move_character, "'Walker' or a parent of it was moved"),
        (move_parent, "'Walker' or a parent of it was moved"),
        (move_key, "animation of 'Walker'"),
        (add_strip, "animation of 'Walker'"),
    ],
)
def test_every_change_of_the_inputs_makes_it_stale_until_the_next_bake(baked, change, message):
    change(baked)
    bpy.context.view_layer.update()
    reasons = bake_report.stale_reasons(baked)
    assert any(message in reason for reason in reasons)
    if change is not delete_vertex or baked.softground.detail == "ALWAYS":
        bpy.ops.softground.bake()
        assert bake_report.stale_reasons(baked) == ()


@pytest.mark.slow
@pytest.mark.parametrize("change", [remap_time, halve_gravity, change_unit])
def test_what_was_read_at_another_time_scale_gravity_or_unit_is_not_known(scene, change):
    shots.walker(scene, frames=40)
    bpy.ops.softground.add_character()
    analysis.read(scene)
    assert analysis.known(snapshot(scene)) is not None
    change(scene)
    assert analysis.known(snapshot(scene)) is None


@pytest.mark.slow
def test_a_keyed_place_is_no_move(scene):
    armature = shots.walker(scene, frames=40)
    for frame, x in ((1, 0.0), (40, 0.3)):
        armature.location.x = x
        armature.keyframe_insert("location", index=0, frame=frame)
    bpy.ops.softground.add_character()
    bpy.ops.softground.bake()
    for frame in (1, 40):
        scene.frame_set(frame)
        assert bake_report.stale_reasons(scene) == ()
    armature.location.y = 0.1
    assert bake_report.stale_reasons(scene) == ("'Walker' or a parent of it was moved",)


def stand_on_parent(field, support):
    field.parent = support


def stand_on_hidden_parent(field, support):
    field.parent = support
    support.hide_viewport = True


def follow_by_constraint(field, support):
    constraint = field.constraints.new("COPY_LOCATION")
    constraint.target, constraint.use_offset = support, True


@pytest.mark.slow
@pytest.mark.parametrize("detail", ["NEVER", "ALWAYS"])
@pytest.mark.parametrize("stand", slow_but_one([stand_on_hidden_parent, stand_on_parent, follow_by_constraint]))
def test_a_ground_is_known_to_have_been_moved_by_what_it_stands_on_however_it_is_hidden(scene, tmp_path, detail, stand):
    shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    support = bpy.data.objects.new("Support", None)
    scene.collection.objects.link(support)
    support.rotation_euler.z, support.location = 0.3, (0.1, 0.2, 0.0)
    field = scene.softground.ground = plane(scene)
    scene.softground.detail = detail
    stand(field, support)
    bpy.context.view_layer.update()
    bpy.ops.softground.bake()
    assert bake_report.stale_reasons(scene) == ()
    field.hide_viewport = True
    path = str(tmp_path / "shot.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    scene = bpy.context.scene
    assert bake_report.stale_reasons(scene) == ()
    bpy.data.objects["Support"].location.x += 0.05
    bpy.context.view_layer.update()
    assert bake_report.stale_reasons(scene) == ("The mesh or the position of 'Field' has changed",)


def test_a_cleared_ground_is_not_stale(baked):
    bpy.ops.softground.clear_bake()
    change_setting(baked)
    assert bake_report.stale_reasons(baked) == ()


@pytest.fixture(scope="module")
def rigged_file(addon, tmp_path_factory):
    """A bake of a rig with a moving parent, constraints, strips and drivers, on a ground with a modifier and paint."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    armature = shots.walker(scene, frames=40)
    for name in ("Parent", "Target"):
        scene.collection.objects.link(bpy.data.objects.new(name, None))
    armature.parent = bpy.data.objects["Parent"]
    key(armature.parent, "location", (0.0, 0.1))
    follows = armature.pose.bones["head"].constraints.new("COPY_ROTATION")
    follows.target = bpy.data.objects["Target"]
    key(follows, "influence", (0.1, 0.2))
    driver = follows.target.driver_add("location", 0).driver
    driver.expression = "lean"
    driver.variables.new().name = "lean"
    driver.variables[0].targets[0].id, driver.variables[0].targets[0].data_path = armature, '["lean"]'
    armature["lean"] = 0.1
    animation = armature.animation_data
    strip = animation.nla_tracks.new().strips.new("walk", 1, animation.action)
    animation.action = None
    strip.use_animated_influence = True
    key(strip, "influence", (0.9, 1.0))

    ground = scene.softground.ground = plane(scene)
    ground.modifiers.new("Bumps", "DISPLACE").texture = bpy.data.textures.new("Bumps", "CLOUDS")
    ground.modifiers["Bumps"].strength = 0.01
    ground.vertex_groups.new(name="softground_stiffness").add(range(len(ground.data.vertices)), 0.9, "REPLACE")
    bpy.context.view_layer.objects.active = armature
    bpy.ops.softground.add_character()
    scene.softground.frame_end, scene.softground.cell_size = 40, 0.02
    bpy.ops.softground.bake()
    path = tmp_path_factory.mktemp("rigged") / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def key(owner, path, values):
    for frame, value in zip((1, 40), values, strict=True):
        setattr(owner, path, (value,) * 3 if path == "location" else value)
        owner.keyframe_insert(path, frame=frame)


@pytest.fixture
def rigged(rigged_file):
    bpy.ops.wm.open_mainfile(filepath=str(rigged_file))
    return bpy.context.scene


def armature_of(scene):
    return scene.softground.characters[0].armature


def strip_of(scene):
    return armature_of(scene).animation_data.nla_tracks[0].strips[0]


def step_between_keys(scene):
    for curve in action_curves(strip_of(scene).action):
        for point in curve.keyframe_points:
            point.interpolation = "CONSTANT"


def shake(scene):
    action_curves(strip_of(scene).action)[0].modifiers.new("NOISE")


def reverse_strip(scene):
    strip_of(scene).use_reverse = True


def let_parent_go_farther(_scene):
    for curve in curves_of(bpy.data.objects["Parent"]):
        curve.keyframe_points[1].co.y += 0.1


def turn_target(_scene):
    bpy.data.objects["Target"].rotation_euler.x = 0.1


def set_driven(scene):
    armature_of(scene)["lean"] = 0.2


def stretch_foot(scene):
    bpy.ops.object.mode_set(mode="EDIT")
    armature_of(scene).data.edit_bones["foot.L"].tail.z -= 0.01
    bpy.ops.object.mode_set(mode="OBJECT")


def shape_body(scene):
    body = next(thing for thing in armature_of(scene).children if thing.type == "MESH")
    body.data.vertices[0].co.z += 0.01
    body.data.update()


def weigh_foot(scene):
    body = next(thing for thing in armature_of(scene).children if thing.type == "MESH")
    body.vertex_groups["foot.L"].add(range(len(body.data.vertices)), 0.5, "REPLACE")


def heighten_bumps(scene):
    scene.softground.ground.modifiers["Bumps"].strength = 0.02


def coarsen_bumps(_scene):
    bpy.data.textures["Bumps"].noise_scale = 1.0


def paint_ground(scene):
    ground = scene.softground.ground
    ground.vertex_groups["softground_stiffness"].add(range(len(ground.data.vertices)), 0.5, "REPLACE")


def ask_for_detail(scene):
    scene.softground.detail = "ALWAYS"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (step_between_keys, "The rig of 'Walker', or what it follows, has changed"),
        (shake, "The rig of 'Walker', or what it follows, has changed"),
        (reverse_strip, "The rig of 'Walker', or what it follows, has changed"),
        (let_parent_go_farther, "The rig of 'Walker', or what it follows, has changed"),
        (turn_target, "The rig of 'Walker', or what it follows, has changed"),
        (set_driven, "The rig of 'Walker', or what it follows, has changed"),
        (stretch_foot, "The rig of 'Walker', or what it follows, has changed"),
        (shape_body, "The mesh of 'Walker' that prints has changed"),
        (weigh_foot, "The mesh of 'Walker' that prints has changed"),
        (heighten_bumps, "The modifiers of 'Field', or what is painted on it, have changed"),
        (coarsen_bumps, "The modifiers of 'Field', or what is painted on it, have changed"),
        (paint_ground, "The modifiers of 'Field', or what is painted on it, have changed"),
        (ask_for_detail, "The settings have changed"),
    ],
)
def test_every_change_of_the_rig_or_of_the_ground_is_told_and_nothing_else(rigged, change, message):
    change(rigged)
    bpy.context.view_layer.update()
    assert bake_report.stale_reasons(rigged) == (message,)


def rename(scene):
    armature = armature_of(scene)
    things = [armature, *armature.children, armature.parent, scene.softground.ground, bpy.data.objects["Target"]]
    for number, thing in enumerate(things):
        thing.name = f"Renamed {number}"
        if thing.data:
            thing.data.name = f"Data {number}"
    for number, action in enumerate(bpy.data.actions):
        action.name = f"Action {number}"
    bpy.data.textures["Bumps"].name = "Lumps"
    scene.name = "Shot 2"


def test_what_has_only_been_renamed_is_the_same(rigged):
    rename(rigged)
    bpy.context.view_layer.update()
    assert bake_report.stale_reasons(rigged) == ()
    armature_of(rigged).location.x += 0.1
    bpy.context.view_layer.update()
    assert bake_report.stale_reasons(rigged) == ("'Renamed 0' or a parent of it was moved",)


def test_a_full_copy_of_the_scene_has_its_bake_and_what_is_changed_there_counts_there(rigged):
    bpy.ops.scene.new(type="FULL_COPY")
    copy = bpy.context.scene
    assert copy != rigged
    assert copy.softground.ground != rigged.softground.ground
    bpy.context.view_layer.update()
    assert bake_report.stale_reasons(copy) == ()
    move_ground(copy)
    bpy.context.view_layer.update()
    assert len(bake_report.stale_reasons(copy)) == 1
    assert bake_report.stale_reasons(rigged) == ()


@pytest.mark.parametrize("swapped", ["target", "driver"])
def test_another_object_that_is_followed_is_a_change(rigged, swapped):
    other = bpy.data.objects.new("Other", None)
    other.location.x, other["lean"] = 0.3, 0.1
    rigged.collection.objects.link(other)
    if swapped == "target":
        armature_of(rigged).pose.bones["head"].constraints[0].target = other
    else:
        bpy.data.objects["Target"].animation_data.drivers[0].driver.variables[0].targets[0].id = other
    bpy.context.view_layer.update()
    assert bake_report.stale_reasons(rigged) == ("The rig of 'Walker', or what it follows, has changed",)


def test_a_pose_without_keys_is_part_of_the_rig(rigged):
    track = armature_of(rigged).animation_data.nla_tracks[0]
    bone = armature_of(rigged).pose.bones.get("hand.L")
    animated = {curve.data_path for curve in action_curves(track.strips[0].action)}
    assert f"{bone.path_from_id()}.location" not in animated
    bone.location.x = 0.05
    assert bake_report.stale_reasons(rigged) == ("The rig of 'Walker', or what it follows, has changed",)


def test_what_is_animated_is_no_change_at_any_frame(rigged):
    for frame in (1, 17, 40):
        rigged.frame_set(frame)
        assert bake_report.stale_reasons(rigged) == ()


@pytest.mark.parametrize("uses_nla", [True, False])
def test_the_response_to_the_ground_is_no_change_at_any_frame(scene, uses_nla):
    armature = shots.walker(scene, frames=40)
    armature.animation_data.use_nla = uses_nla
    bpy.ops.softground.add_character()
    scene.softground.tilt.use = scene.softground.grounding.use = True
    scene.softground.output, scene.softground.cell_size = "BOTH", 0.02
    bpy.ops.softground.bake()
    for frame in (1, 17, 40):
        scene.frame_set(frame)
        assert bake_report.stale_reasons(scene) == ()


def move_cane(_scene):
    bpy.data.objects["Cane"].delta_location.z += 0.01


def rekey_cane(_scene):
    action_curves(bpy.data.objects["Cane"].animation_data.action)[0].keyframe_points[0].co.y += 0.1


def let_cane_follow(_scene):
    cane = bpy.data.objects["Cane"]
    cane.constraints.new("COPY_LOCATION").target = bpy.data.objects["Walker"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "messages"),
    [
        (move_cane, ("'Cane' or a parent of it was moved",)),
        (rekey_cane, ("The animation of 'Cane' has changed",)),
        (let_cane_follow, ("The rig of 'Cane', or what it follows, has changed",)),
    ],
)
def test_what_a_rigged_character_leans_on_is_compared_as_well(scene, change, messages):
    shots.walker(scene, frames=40)
    bpy.ops.softground.add_character()
    scene.softground.tilt.use = scene.softground.grounding.use = True
    scene.softground.output, scene.softground.cell_size = "BOTH", 0.02
    bpy.ops.mesh.primitive_cone_add(vertices=8, radius1=0.02, depth=0.9)
    cane = bpy.context.active_object
    cane.name = "Cane"
    rigs.key(cane, "location", {1: (0.3, 0, 0.45), 40: (0.3, 0, 0.45)})
    add_object_contacts(scene.softground, scene.softground.characters[0], [cane])
    bpy.ops.softground.bake()
    for frame in (1, 17, 40):
        scene.frame_set(frame)
        assert bake_report.stale_reasons(scene) == ()
    change(scene)
    bpy.context.view_layer.update()
    assert bake_report.stale_reasons(scene) == messages


def test_another_blender_compares_what_it_knows_as_the_one_that_baked(rigged):
    mesh = baked_ground.display_mesh_of(rigged.softground.ground).data
    noted = json.loads(mesh[staleness.BUILD_STAMP])
    mesh[staleness.BUILD_STAMP] = json.dumps(noted | {"version": "4.1", "surface": "0", "movement:Walker": "0"})
    assert bake_report.stale_reasons(rigged) == ()
    change_mass(rigged)
    assert bake_report.stale_reasons(rigged) == ("The settings have changed",)


def test_a_mesh_in_edit_mode_is_told_as_long_as_it_is(rigged):
    body = next(thing for thing in armature_of(rigged).children if thing.type == "MESH")
    for edited in (body, rigged.softground.ground):
        bpy.context.view_layer.objects.active = edited
        bpy.ops.object.mode_set(mode="EDIT")
        assert bake_report.stale_reasons(rigged) == (f"'{edited.name}' is in Edit Mode",)
        bpy.ops.object.mode_set(mode="OBJECT")
        assert bake_report.stale_reasons(rigged) == ()
