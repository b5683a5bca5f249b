"""A bake that no longer fits what it was made from says so."""

import bpy
import pytest

from softground_addon.blender import analysis, bake_report, baked_ground
from tests.blender import shots
from tests.blender.grounds import plane


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


def change_setting(scene):
    scene.softground.material.youngs_modulus *= 1.01


def change_mass(scene):
    scene.softground.characters[0].mass += 1


def move_ground(scene):
    scene.softground.ground.location.z += 0.01


def delete_vertex(scene):
    import bmesh  # only there once bpy is

    for thing in {scene.softground.ground, baked_ground.carrier_of(scene.softground.ground)}:
        edited = bmesh.new()
        edited.from_mesh(thing.data)
        edited.verts.ensure_lookup_table()
        edited.verts.remove(edited.verts[0])
        edited.to_mesh(thing.data)
        edited.free()


def move_key(scene):
    animation = scene.softground.characters[0].armature.animation_data
    bag = animation.action.fcurves if hasattr(animation.action, "fcurves") else None
    curve = bag[0] if bag else animation.action.layers[0].strips[0].channelbags[0].fcurves[0]
    curve.keyframe_points[3].co.y += 0.001


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


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (change_setting, "settings"),
        (change_mass, "settings"),
        (remap_time, "settings"),
        (halve_gravity, "settings"),
        (change_unit, "settings"),
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


@pytest.mark.parametrize("change", [remap_time, halve_gravity, change_unit])
def test_what_was_read_at_another_time_scale_gravity_or_unit_is_not_known(scene, change):
    shots.walker(scene, frames=40)
    bpy.ops.softground.add_character()
    analysis.read(scene)
    assert analysis.known(scene) is not None
    change(scene)
    assert analysis.known(scene) is None


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


def test_a_cleared_ground_is_not_stale(baked):
    bpy.ops.softground.clear_bake()
    change_setting(baked)
    assert bake_report.stale_reasons(baked) == ()
