"""After a bake of prints alone the panel says how far feet float, and one button lets them down."""

import bpy
import numpy as np
import pytest

from softground_addon.blender import compat, jobs
from softground_addon.blender.animation_layer.constraint_layer import LayerKind, has_layer
from softground_addon.blender.baking import bake_job, bake_report, sink_feet
from softground_addon.blender.characters.selection import set_up_automatically
from softground_addon.blender.ground import baked_ground, ground_mesh
from softground_addon.blender.reading import analysis
from softground_addon.blender.response.character_keys import controls_of
from softground_addon.blender.settings import snapshot
from softground_addon.core.errors import InputError
from softground_addon.core.rig.mapping import RigMapping, SoleSource
from tests.blender import fingerprints, responders, shots
from tests.blender.grounds import plane


def bake_on_a_plane(scene):
    shots.walker(scene, frames=48)
    bpy.ops.softground.add_character()
    scene.softground.frame_end = 48
    scene.softground.ground = plane(scene)
    bpy.context.view_layer.update()
    bpy.ops.softground.bake()


@pytest.fixture
def baked(opened_as):
    return opened_as(bake_on_a_plane)


def floating_mm(scene):
    """How far the feet float above the prints of the scene's last bake, as its summary says."""
    return ground_mesh.summary_of(baked_ground.display_mesh_of(scene.softground.ground))[bake_report.FLOATING]


def test_a_bake_of_prints_says_how_far_the_feet_float(baked):
    floating = floating_mm(baked)
    assert 10.0 < floating < 100.0
    assert not has_layer(baked.softground.characters[0].armature)


def test_one_button_lets_the_feet_down_and_leaves_the_prints(baked):
    ground = baked.softground.ground
    before = fingerprints.of_mesh(ground.data)
    assert bpy.ops.softground.sink_feet() == {"FINISHED"}
    after = fingerprints.of_mesh(ground.data)
    for part in ("attributes", "shape_keys", "materials"):
        assert after[part] == before[part]
    armature = baked.softground.characters[0].armature
    assert has_layer(armature)
    assert baked.softground.grounding.use
    assert baked.softground.output == "BOTH"
    assert floating_mm(baked) < 2.0
    assert bake_report.stale_reasons(baked) == (), "on level ground the prints are those of the grounded walk"


def test_a_second_press_replaces_the_layer_of_the_first(baked):
    armature = baked.softground.characters[0].armature
    before = fingerprints.of_object(armature)

    def keys():
        return {
            (curve.data_path, curve.array_index): [tuple(key.co) for key in curve.keyframe_points]
            for curve in compat.action_curves(bpy.data.objects[LayerKind.RESPONSE.value].animation_data.action)
        }

    bpy.ops.softground.sink_feet()
    once, actions = keys(), len(bpy.data.actions)
    bpy.ops.softground.sink_feet()
    twice = keys()
    assert list(twice) == list(once)
    assert len(bpy.data.actions) == actions
    for curve, expected in once.items():
        np.testing.assert_allclose(twice[curve], expected, atol=1e-5, err_msg=str(curve))
    assert floating_mm(baked) < 2.0
    assert bake_report.stale_reasons(baked) == ()
    bpy.ops.softground.clear_bake()
    assert not baked.softground.grounding.use
    assert fingerprints.of_object(armature) == before


def test_feet_that_cannot_be_lowered_leave_the_settings_as_they_were(scene, tmp_path):
    responders.linked_walker(tmp_path)
    scene = bpy.context.scene
    bpy.ops.softground.add_character()
    scene.softground.output = "PRINTS"
    with pytest.raises(RuntimeError, match="'Walker' is linked"):
        bpy.ops.softground.sink_feet()
    assert not scene.softground.grounding.use
    assert scene.softground.output == "PRINTS"


def test_things_without_feet_are_refused_and_the_settings_stay(scene):
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.25, location=(0, 0, 0.25))
    bpy.ops.softground.add_character()
    with pytest.raises(RuntimeError, match="feet to lower"):
        bpy.ops.softground.sink_feet()
    assert not scene.softground.grounding.use


def test_a_sinking_that_is_cancelled_leaves_everything_as_it_was(baked):
    before = fingerprints.of_file()
    job = sink_feet.sink_feet(baked)
    for _ in range(3):
        next(job)
    job.close()
    assert not baked.softground.grounding.use
    assert fingerprints.of_file() == before


def test_sinking_needs_no_ground_that_is_baked(scene):
    """With no ground chosen the plane under the walk is the ground."""
    shots.walker(scene, frames=40)
    bpy.ops.softground.add_character()
    scene.softground.frame_end = 40
    jobs.run(sink_feet.sink_feet(scene))
    assert has_layer(scene.softground.characters[0].armature)
    assert scene.softground.ground is None


def test_a_shot_with_sunk_feet_stays_known_once_it_was_read_also_in_a_file_that_was_opened(baked, tmp_path):
    """Reading switches the response layer off and on again: that is no edit."""
    bpy.ops.softground.sink_feet()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "sunk.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "sunk.blend"))
    scene = bpy.context.scene
    depth = analysis.read(scene) and analysis.expected_depth(scene)
    bpy.context.view_layer.update()
    assert analysis.known(snapshot(scene))
    assert analysis.expected_depth(scene) == depth


@pytest.fixture
def first_walk(scene):
    """A walker who was just added to a scene in which nothing was set, with coarse cells."""
    shots.walker(scene, frames=40)
    scene.softground.property_unset("sink_feet")
    bpy.ops.softground.add_character()
    return scene


def test_feet_sink_by_themselves(first_walk):
    options = first_walk.softground
    assert options.sink_feet
    result = jobs.run(bake_job.bake(first_walk))
    assert has_layer(options.characters[0].armature)
    assert floating_mm(first_walk) < 2.0
    assert not [finding for finding in result.report["self_check"] if finding["code"] == "feet_not_sunk"]
    assert bake_report.stale_reasons(first_walk) == ()
    options.sink_feet = False
    assert bake_report.stale_reasons(first_walk)


@pytest.mark.slow
def test_a_rig_that_takes_no_layer_is_named_in_a_line_and_prints_all_the_same(scene, tmp_path):
    armature = responders.linked_walker(tmp_path)
    scene = bpy.context.scene
    bpy.ops.softground.add_character()
    assert scene.softground.sink_feet
    result = jobs.run(bake_job.bake(scene))
    assert result.footprints
    (said,) = [finding for finding in result.report["self_check"] if finding["code"] == "feet_not_sunk"]
    assert "'Walker' is linked" in said["message"]
    assert not has_layer(armature)
    assert bake_report.stale_reasons(scene) == ()


def test_a_rig_whose_feet_hang_on_no_bone_of_the_body_is_asked_for_a_root_bone(scene):
    armature = bpy.data.objects.new("Fox", bpy.data.armatures.new("Fox"))
    scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for name in ("body", "paw.L", "paw.R"):
        armature.data.edit_bones.new(name).tail = (0.0, 0.2, 0.0)
    bpy.ops.object.mode_set(mode="OBJECT")
    paws = tuple(SoleSource(name, name[-1], name, "") for name in ("paw.L", "paw.R"))
    with pytest.raises(InputError, match="'Fox' carries its whole body: add a root bone in Edit Mode"):
        controls_of(bpy.context.view_layer, armature, RigMapping({}, paws, "settings"))


def test_a_scene_that_was_set_up_before_keeps_its_feet(baked):
    assert not baked.softground.sink_feet
    assert not has_layer(baked.softground.characters[0].armature)


def test_a_shot_that_sets_itself_up_keeps_its_animation(first_walk):
    options = first_walk.softground
    assert options.sink_feet
    options.characters.clear()
    options.property_unset("sink_feet")
    set_up_automatically(first_walk)
    assert not options.sink_feet
    bpy.ops.softground.bake()
    assert not has_layer(options.characters[0].armature)


def test_the_layer_is_no_animation_of_the_user_s(first_walk):
    options = first_walk.softground
    bpy.ops.softground.bake()
    frames = options.frame_start, options.frame_end
    options.characters.clear()
    bpy.context.view_layer.objects.active = bpy.data.objects["Walker"]
    bpy.ops.softground.add_character()
    assert (options.frame_start, options.frame_end) == frames


def test_clear_bake_switches_off_what_the_button_has_switched_on_and_nothing_else(baked):
    options = baked.softground
    bpy.ops.softground.sink_feet()
    assert options.grounding.use
    bpy.ops.softground.clear_bake()
    assert not options.grounding.use
    options.grounding.use = True
    bpy.ops.softground.bake()
    bpy.ops.softground.sink_feet()
    bpy.ops.softground.clear_bake()
    assert options.grounding.use


@pytest.mark.parametrize("take_off", ["untick", "clear", "remove"])
def test_the_action_stays_where_it_is_while_the_layer_is_there_and_after_it(first_walk, take_off):
    options = first_walk.softground
    armature = options.characters[0].armature
    action = armature.animation_data.action
    before = fingerprints.of_action(action), fingerprints.of_object(armature)
    bpy.ops.softground.bake()
    assert has_layer(armature)
    assert armature.animation_data.action == action
    assert fingerprints.of_action(action) == before[0]
    if take_off == "untick":
        options.sink_feet = False
        bpy.ops.softground.bake()
    elif take_off == "clear":
        bpy.ops.softground.clear_bake()
    else:
        bpy.ops.softground.remove_response()
        assert baked_ground.is_baked(options.ground), "the prints stay"
    assert (fingerprints.of_action(action), fingerprints.of_object(armature)) == before
