"""Characters of files in other units, and the button that puts them right."""

import bpy
import numpy as np
import pytest

from sample_scenes.body import Body
from sample_scenes.gait import Gait, walk
from softground_addon.blender.characters.contact_editing import add_bone_contacts
from softground_addon.blender.characters.import_fixes import extent_of, is_captured, sizes_of
from softground_addon.blender.compat import HAS_SLOTS, action_curves, channels_of, slot_of
from softground_addon.blender.reading import analysis
from softground_addon.core.motion.units import scale_to_metres
from tests.blender import shots
from tests.blender.baking.test_self_check import codes
from tests.blender.grounds import bake
from tests.blender.response.test_root_motion import FRAMES, on_the_spot, speed_of
from tests.tiers import slow_but_one


def keys_of(armature):
    return [tuple(key.co) for curve in action_curves(armature.animation_data.action) for key in curve.keyframe_points]


def imported(scene, factor, *, loose=False):
    """A walker as a file in other units has it: bones, mesh and keys of the root, without a scale of its own."""
    armature = shots.walker(scene, frames=40)
    figure = armature.children[0]
    if loose:
        figure.parent = None
    armature.data.transform(np.diag([factor, factor, factor, 1.0]).tolist())
    figure.data.transform(np.diag([factor, factor, factor, 1.0]).tolist())
    for curve in action_curves(armature.animation_data.action):
        if curve.data_path.endswith("location"):
            for key in curve.keyframe_points:
                key.co.y *= factor
            curve.update()
    bpy.context.view_layer.update()
    return armature


@pytest.fixture
def metres(scene):
    armature = shots.walker(scene, frames=40)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.02
    steps = bake(scene).report["steps"]
    bpy.ops.softground.clear_bake()
    mass = scene.softground.characters[0].mass
    scene.softground.characters.clear()
    bpy.data.objects.remove(armature.children[0])
    bpy.data.objects.remove(armature)
    return steps, mass


@pytest.mark.slow
@pytest.mark.parametrize("loose", slow_but_one([False, True]))
@pytest.mark.parametrize("factor", slow_but_one([100.0, 0.01]))
def test_one_button_makes_the_same_prints_of_a_file_in_other_units(scene, metres, factor, loose):
    steps, mass = metres
    armature = imported(scene, factor, loose=loose)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.softground.add_character()
    character = scene.softground.characters[0]
    assert scale_to_metres(character.size) == pytest.approx(1 / factor)
    keys = keys_of(armature)
    bpy.ops.softground.fix_scale()
    bpy.context.view_layer.update()
    assert armature.parent.name == "Walker Scale"
    assert tuple(armature.parent.scale) == pytest.approx([1 / factor] * 3)
    assert keys == keys_of(armature)
    assert extent_of(scene.unit_settings.scale_length, armature) == pytest.approx(character.size, rel=1e-4)
    assert 1.0 < character.size < 2.0
    assert character.mass == pytest.approx(mass, rel=0.05)
    scene.softground.cell_size = 0.02
    report = bake(scene).report
    assert not codes(report) & {"unit_scale", "mass_of_size"}
    assert len(report["steps"]) == len(steps)
    for step, other in zip(report["steps"], steps, strict=True):
        assert step["position"] == pytest.approx(other["position"], abs=0.02)
        assert step["max_depth_m"] == pytest.approx(other["max_depth_m"], rel=0.1)
    with pytest.raises(RuntimeError, match="its scale needs no fix"):
        bpy.ops.softground.fix_scale()
    bpy.data.objects.remove(armature.parent)


def test_the_scale_of_a_character_is_on_one_empty_however_often_it_is_put_right(scene):
    armature = shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    for factor in (100.0, 0.01):
        armature.scale = armature.scale * factor
        bpy.context.view_layer.update()
        bpy.ops.softground.fix_scale()
        bpy.context.view_layer.update()
        assert sizes_of(1.0, scene.softground.characters[0])[0] == pytest.approx(1.7, abs=0.3)
        assert (armature.parent.name, armature.parent.parent) == ("Walker Scale", None)


@pytest.mark.slow
@pytest.mark.parametrize("turned", [0.0, 2.0])
def test_walk_ahead_a_second_time_acts_on_the_empty_of_the_first(scene, turned):
    armature = on_the_spot(scene, walk(Body(), Gait(), FRAMES, 24), Gait().speed, 24, hips_held=False)
    bpy.ops.softground.walk_ahead()
    empty = armature.parent
    with pytest.raises(RuntimeError, match="'Walker' does not walk on the spot"):
        bpy.ops.softground.walk_ahead()
    for curve in action_curves(empty.animation_data.action):
        for key in curve.keyframe_points:
            key.co.y *= 0.0
        curve.update()
        curve.id_data.update_tag()
    if turned:
        deck = empty.parent = bpy.data.objects.new("Deck", None)
        scene.collection.objects.link(deck)
        deck.rotation_euler.z, deck.scale = turned, (0.5,) * 3
        armature.rotation_euler.z, armature.scale = -turned, (2.0,) * 3
    bpy.context.view_layer.update()
    bpy.ops.softground.walk_ahead()
    assert armature.parent == empty
    assert empty.parent == (bpy.data.objects["Deck"] if turned else None)
    bpy.context.view_layer.update()
    assert "Walker" not in analysis.read(scene).belts
    assert speed_of(scene, armature) == pytest.approx(Gait().speed, rel=0.03)


def push_down(animation):
    action, slot = animation.action, slot_of(animation)
    strip = animation.nla_tracks.new().strips.new("Travel", 1, action)
    if HAS_SLOTS:
        strip.action_slot = slot
    animation.action = None


def leave_one_key(animation):
    for curve in channels_of(animation.action, slot_of(animation)):
        curve.keyframe_points.remove(curve.keyframe_points[1])


def delete_ways(animation):
    curves = channels_of(animation.action, slot_of(animation))
    for curve in [curve for curve in curves if curve.array_index < 2]:
        curves.remove(curve)


def mute(animation):
    for curve in action_curves(animation.action):
        curve.mute = True


def share(animation):
    """Let another object be animated by the same action, by its own slot if there are any."""
    other = bpy.data.objects.new("Other", None).animation_data_create()
    other.action = animation.action
    if HAS_SLOTS:
        other.action_slot = other.action.slots.new(id_type="OBJECT", name="Other")
        other.id_data.keyframe_insert("location", frame=1)
        animation.action_slot = None


@pytest.mark.slow
@pytest.mark.parametrize("spoil", [push_down, leave_one_key, delete_ways, mute, share])
def test_walk_ahead_takes_a_new_empty_where_the_curves_of_the_first_do_not_move_it_or_move_others(scene, spoil):
    armature = on_the_spot(scene, walk(Body(), Gait(), FRAMES, 24), Gait().speed, 24, hips_held=False)
    bpy.ops.softground.walk_ahead()
    first = armature.parent
    action = first.animation_data.action
    for curve in action_curves(action):
        for key in curve.keyframe_points:
            key.co.y *= 0.0
        curve.update()
        curve.id_data.update_tag()
    spoil(first.animation_data)
    keys = [tuple(key.co) for curve in action_curves(action) for key in curve.keyframe_points]
    bpy.context.view_layer.update()
    bpy.ops.softground.walk_ahead()
    assert first.parent.name == "Walker Travel.001"
    assert keys == [tuple(key.co) for curve in action_curves(action) for key in curve.keyframe_points]
    bpy.context.view_layer.update()
    assert speed_of(scene, armature) == pytest.approx(Gait().speed, rel=0.03)
    with pytest.raises(RuntimeError, match="'Walker' does not walk on the spot"):
        bpy.ops.softground.walk_ahead()


@pytest.mark.slow
def test_a_walk_on_the_spot_travels_ahead_by_one_button(scene):
    armature = shots.walker(scene, frames=72)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.02
    steps = bake(scene).report["steps"]
    bpy.ops.softground.clear_bake()
    with pytest.raises(RuntimeError, match="'Walker' does not walk on the spot"):
        bpy.ops.softground.walk_ahead()
    belt = bpy.data.objects.new("Belt", None)
    scene.collection.objects.link(belt)
    same_side = [step for step in steps if step["contact"] == steps[1]["contact"]]
    first, last = same_side[0], same_side[-1]
    frames = last["frame_start"] - first["frame_start"]
    speed = np.subtract(last["position"], first["position"]) / frames  # of the whole walk, per frame
    for frame in (1, 72):
        belt.location = -speed * (frame - 1)
        belt.keyframe_insert("location", frame=frame)
    for curve in action_curves(belt.animation_data.action):
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    armature.parent = belt
    bpy.context.view_layer.update()
    assert "walks_in_place" in codes(bake(scene).report)
    bpy.ops.softground.clear_bake()
    bpy.ops.softground.walk_ahead()
    report = bake(scene).report
    assert "walks_in_place" not in codes(report)
    assert len(report["steps"]) == len(steps)
    for ours, other in zip(report["steps"], steps, strict=True):
        assert ours["position"][:2] == pytest.approx(other["position"][:2], abs=0.12)
    assert belt.parent.name == "Walker Travel"
    places = []
    for frame in (62, 72, 82):  # the walk may be repeated later
        scene.frame_set(frame)
        places.append(belt.parent.matrix_world.translation[:2])
    assert np.diff(places, axis=0)[1] == pytest.approx(np.diff(places, axis=0)[0], rel=1e-4)


@pytest.mark.parametrize(
    "scale",
    [*slow_but_one([12.5, 39.4, 100.0, 0.0254]), pytest.param(0.01, marks=pytest.mark.marathon)],  # takes minutes
)
def test_the_button_works_that_a_warning_names_of_a_rig_that_was_scaled_after_it_was_added(scene, scale):
    armature = shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    armature.scale = (scale,) * 3
    bpy.context.view_layer.update()
    scene.softground.cell_size = 0.02 * scale
    (finding,) = (each for each in bake(scene).report["self_check"] if each["code"] == "unit_scale")
    bpy.ops.softground.fix_scale()
    factor = armature.parent.scale.x
    assert finding["remedy"].startswith(f"Press Scale by {factor:g}, or leave it")
    assert factor * scale == pytest.approx(1.0, rel=0.02)


def test_captured_motion_of_42_cm_is_scaled_by_the_button_that_its_warning_names(scene):
    armature = shots.walker(scene, frames=30)
    bpy.data.objects.remove(armature.children[0])
    bpy.ops.softground.add_character()
    character = scene.softground.characters[0]
    assert scale_to_metres(sizes_of(scene.unit_settings.scale_length, character)[0], captured=True) == 1.0
    armature.scale = (0.42 / sizes_of(scene.unit_settings.scale_length, character)[0],) * 3
    bpy.context.view_layer.update()
    scene.softground.cell_size = 0.01
    (finding,) = (each for each in bake(scene).report["self_check"] if each["code"] == "unit_scale")
    assert "is 42 cm tall: its file is in another unit." in finding["message"]
    assert finding["remedy"].startswith("Press Scale by 4,")
    bpy.ops.softground.clear_bake()
    bpy.ops.softground.fix_scale()
    bpy.context.view_layer.update()
    assert sizes_of(scene.unit_settings.scale_length, character)[0] == pytest.approx(1.68, rel=0.01)
    scene.softground.cell_size = 0.02
    assert "unit_scale" not in codes(bake(scene).report)


def laid_in_a_split(armature):
    """Give a rig a rest pose in which legs lie to both sides and the trunk ahead, as some motion files have."""
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    bones = armature.data.edit_bones
    origin = bones["thigh.L"].head.z
    for bone in bones:
        bone.use_connect = False
        sided = next((b for b in (bone, *bone.parent_recursive) if b.name.startswith("thigh")), None)
        for end in ("head", "tail"):
            x, y, z = getattr(bone, end)
            side = 1 if x > 0 else -1
            setattr(bone, end, (x + side * (origin - z), y, origin) if sided else (x, y - (z - origin), origin))
    bpy.ops.object.mode_set(mode="OBJECT")


@pytest.mark.parametrize("scale", [1.0, 0.25])
def test_captured_motion_is_as_tall_as_its_legs_are_long_whatever_its_rest_pose(scene, scale):
    armature = shots.walker(scene, frames=30)
    bpy.data.objects.remove(armature.children[0])
    bpy.ops.softground.add_character()
    character = scene.softground.characters[0]
    stood, _ = sizes_of(1.0, character)
    assert stood == pytest.approx(1.75, rel=0.05)
    laid_in_a_split(armature)
    armature.scale = (scale,) * 3
    bpy.context.view_layer.update()
    stature, _ = sizes_of(1.0, character)
    assert stature == pytest.approx(scale * stood, rel=0.01)
    assert scale_to_metres(stature, captured=True) == pytest.approx(1 / scale, rel=0.06)


def test_a_skeleton_of_a_person_stays_one_whatever_else_of_it_prints(scene):
    armature = shots.walker(scene, frames=30)
    bpy.data.objects.remove(armature.children[0])
    bpy.context.view_layer.objects.active = armature
    bpy.ops.softground.add_character()
    character = scene.softground.characters[0]
    sizes = sizes_of(1.0, character)
    add_bone_contacts(character, ["hand.L"])
    assert is_captured(character)
    assert sizes_of(1.0, character) == sizes
    (motion,) = analysis.read(scene).shot.motions
    assert motion.two_legs
    assert (motion.stature, motion.size) == pytest.approx(sizes)
