"""What is not at work in a scene is said by name and with a remedy; scenes that are in order are silent."""

import bpy
import pytest

from softground_addon.blender.characters import character_setup
from softground_addon.blender.compat import HAS_SLOTS, set_slot, slot_of
from softground_addon.blender.ground import baked_ground, ground_mesh
from softground_addon.blender.rigs.worn_rigs import rigs_below
from tests.blender.grounds import bake, plane


def finding(scene, code):
    """The one finding of a bake; it is also in the report's and the panel's warnings."""
    report = bake(scene).report
    (finding,) = report["self_check"]
    assert finding["code"] == code
    shown = ground_mesh.warnings_of(baked_ground.display_mesh_of(scene.softground.ground))
    assert list(shown) == report["warnings"]
    return finding


def rig_of(scene):
    return scene.softground.characters[0].armature


@pytest.mark.parametrize("direction", [(0, -9.81, 0), (0, 0, 9.81)])
def test_gravity_in_which_nobody_stands_is_said(short_walk, direction):
    short_walk.gravity = direction
    assert "Gravity of scene 'Scene' points along" in finding(short_walk, "gravity_direction")["message"]


def test_gravity_that_points_into_a_slope_says_nothing(short_walk):
    short_walk.gravity = (1.0, 0, -9.7)
    assert "gravity_direction" not in {finding["code"] for finding in bake(short_walk).report["self_check"]}


def test_gravity_that_is_switched_off_or_weak_points_nowhere_else(short_walk):
    short_walk.gravity = (0, 0, -1.6)
    assert not bake(short_walk).report["self_check"]
    short_walk.gravity, short_walk.use_gravity = (3, 0, 0), False
    assert not bake(short_walk).report["self_check"]


@pytest.mark.slow
@pytest.mark.parametrize(("away", "said"), [(4e3, False), (548e3, True)])
def test_a_walk_so_far_from_the_origin_that_cells_are_rounded_away_is_said(short_walk, away, said):
    short_walk.softground.cell_size = 0.02
    rig_of(short_walk).location.x = away
    ground = plane(short_walk)
    ground.location.x = away
    bpy.context.view_layer.update()
    codes = {finding["code"]: finding["message"] for finding in bake(short_walk, ground=ground).report["self_check"]}
    assert ("far_from_origin" in codes) == said
    if said:
        shown = "548 km from the world's origin, where Blender shows positions rounded to 6.2 cm"
        assert shown in codes["far_from_origin"]


def test_a_walk_keyed_in_coordinates_of_a_map_is_rounded_with_a_remedy(short_walk):
    rig = rig_of(short_walk)
    for frame, north in ((1, 5_932_000), (30, 5_932_002)):
        rig.location = (548_000, north, 0)
        rig.keyframe_insert("location", frame=frame)
    said = finding(short_walk, "far_from_origin")
    assert "rounds positions to 50 cm, and keys or constraints move 'Walker' there" in said["message"]
    assert "Parent it to an empty" in said["remedy"]


def strips(rig, *, at):
    """The rig's action as strips of 30 frames, and nothing else."""
    animation, action, slot = rig.animation_data, rig.animation_data.action, slot_of(rig.animation_data)
    animation.action = None
    track = animation.nla_tracks.new()
    made = [track.strips.new(f"part {number}", start, action) for number, start in enumerate(at)]
    for strip in made:
        set_slot(strip, slot)
    return made


@pytest.mark.skipif(not HAS_SLOTS, reason="actions have slots from 4.4 on")
@pytest.mark.parametrize("spoilt", ["slot", "muted", "elsewhere"])
def test_a_strip_without_a_slot_is_named_where_it_plays(short_walk, spoilt):
    _, second = strips(rig_of(short_walk), at=(1, 31))
    short_walk.softground.frame_end = 30 if spoilt == "elsewhere" else 60
    second.action_slot = None
    second.mute = spoilt == "muted"
    findings = bake(short_walk).report["self_check"]
    said = [finding["message"] for finding in findings if finding["code"] == "no_slot"]
    assert bool(said) == (spoilt == "slot")
    if said:
        assert said[0].startswith("NLA strip 'part 1' of 'Walker' has no slot: nothing moves by it in frames 31-60")


@pytest.mark.skipif(not HAS_SLOTS, reason="actions have slots from 4.4 on")
def test_an_action_of_a_parent_without_a_slot_is_named(short_walk):
    cart = bpy.data.objects.new("Cart", None)
    short_walk.collection.objects.link(cart)
    cart.keyframe_insert("location", frame=1)
    rig_of(short_walk).parent = cart
    assert not bake(short_walk).report["self_check"]
    cart.animation_data.action_slot = None
    assert "' of 'Cart' has no slot" in finding(short_walk, "no_slot")["message"]


def drive(scene, expression):
    """A parent of the rig of which a driver sets the height."""
    cart = bpy.data.objects.new("Cart", None)
    scene.collection.objects.link(cart)
    rig_of(scene).parent = cart
    cart.driver_add("location", 2).driver.expression = expression


def test_a_driver_that_auto_run_holds_back_is_named_with_the_setting(short_walk):
    drive(short_walk, "0.0 * frame + len([])")
    assert not bake(short_walk).report["self_check"]
    bpy.data.objects["Cart"].animation_data.drivers[0].driver.expression = "0 * len(bpy.data.objects)"
    bpy.context.view_layer.update()
    message = finding(short_walk, "idle_drivers")["message"]
    assert message.startswith("1 driver of 'Cart' does not run (on 'location'), as Auto Run Python Scripts is off")


def test_a_driver_that_hides_something_moves_nothing(short_walk):
    drive(short_walk, "0.0 * frame")
    bpy.data.objects["Cart"].driver_add("hide_render").driver.expression = "bpy.data.filepath"
    bpy.context.view_layer.update()
    assert not bake(short_walk).report["self_check"]


def keyed_shape(obj):
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="Smile")
    for frame in (1, 20):
        key.value = frame / 20
        key.keyframe_insert("value", frame=frame)


def keyed_wave(obj):
    obj.modifiers.new("Ripple", "WAVE")


@pytest.mark.parametrize(("change", "by"), [(keyed_shape, "its shape keys"), (keyed_wave, "its modifier 'Ripple'")])
def test_a_prop_that_changes_its_shape_says_so_when_it_is_added_and_baked(scene, capfd, change, by):
    bpy.ops.mesh.primitive_cube_add(size=0.4, location=(0, 0, 0.2))
    change(bpy.context.active_object)
    bpy.ops.softground.add_character()
    said = capfd.readouterr().out
    assert f"'Cube' changes its shape by {by}, but prints as a rigid body" in said
    assert "does not move" not in said
    scene.softground.cell_size, scene.softground.frame_start, scene.softground.frame_end = 0.02, 1, 20
    messages = [
        finding["message"] for finding in bake(scene).report["self_check"] if finding["code"] == "changing_shape"
    ]
    assert len(messages) == 1
    assert by in messages[0]


def test_a_frame_handler_that_moves_the_rig_is_named_and_another_is_not(short_walk):
    rig = rig_of(short_walk)

    def counts(scene):
        rig.id_data["frame"] = scene.frame_current

    def lifts(scene):
        rig.location.x = 0.001 * scene.frame_current

    for handler, said in ((counts, []), (lifts, ["frame_handler"])):
        bpy.app.handlers.frame_change_post.append(handler)
        try:
            report = bake(short_walk).report
        finally:
            bpy.app.handlers.frame_change_post.remove(handler)
        assert [finding["code"] for finding in report["self_check"]] == said
        assert all(f"a frame handler of '{__name__}'" in finding["message"] for finding in report["self_check"])
        bpy.ops.softground.clear_bake()


@pytest.mark.parametrize("where", ["another scene", "an instance of its collection", "this scene"])
def test_a_ground_whose_prints_are_not_seen_in_the_scene_is_said(short_walk, where):
    ground = plane(short_walk)
    if where != "this scene":
        short_walk.collection.objects.unlink(ground)
        parts = bpy.data.collections.new("Set")
        parts.objects.link(ground)
        shown = bpy.data.objects.new("Set", None)
        shown.instance_type, shown.instance_collection = "COLLECTION", parts
        scene = short_walk if where == "an instance of its collection" else bpy.data.scenes.new("Other")
        scene.collection.objects.link(shown)
    codes = {one["code"] for one in bake(short_walk, ground=ground).report["self_check"]}
    assert ("unseen_ground" in codes) == (where == "another scene")


@pytest.mark.parametrize("added", [False, True])
def test_legs_with_a_rig_of_their_own_under_a_trunk_are_named(short_walk, added):
    """Select a trunk alone, and its arms would be taken for legs in silence."""
    trunk = rig_of(short_walk)
    legs, skin = trunk.copy(), bpy.data.objects.new("Skin", bpy.data.meshes.new("Skin"))
    legs.data, legs.location.z = trunk.data.copy(), trunk.location.z - 0.6
    for obj in (legs, skin):
        short_walk.collection.objects.link(obj)
    skin.modifiers.new("Armature", "ARMATURE").object = legs
    bpy.context.view_layer.update()
    assert rigs_below(short_walk.objects, trunk) == [legs]
    assert rigs_below(short_walk.objects, legs) == []
    if added:
        character_setup.add_character(short_walk, legs)
        short_walk.softground.characters[1].armature.location.z += 0.6
    findings = {one["code"]: one["message"] for one in bake(short_walk).report["self_check"]}
    assert ("rig_below" in findings) == (not added)
    assert added or f"'{legs.name}' stands under '{trunk.name}'" in findings["rig_below"]
