"""Bakes that are wrong in one way each, and say so with the remedy; those that are right are silent."""

import bpy
import numpy as np
import pytest

from softground_addon.blender.ground import baked_ground, ground_mesh
from softground_addon.core.errors import InputError
from tests.blender import shots
from tests.blender.characters.test_recognition import LEGS, stool
from tests.blender.grounds import bake, plane


def codes(report):
    return {finding["code"] for finding in report["self_check"]}


def on_own_ground(scene, **values):
    ground = plane(scene, **values)
    bpy.context.view_layer.update()
    return ground


@pytest.mark.slow
def test_a_walk_with_a_skin_says_nothing_on_a_created_and_on_an_own_ground(short_walk):
    assert bake(short_walk).report["self_check"] == []
    bpy.ops.softground.clear_bake()
    assert bake(short_walk, ground=on_own_ground(short_walk)).report["self_check"] == []


def test_each_finding_is_in_the_report_once_worst_first_and_what_the_panel_shows(short_walk):
    short_walk.softground.characters[0].mass = 3.0
    ground = on_own_ground(short_walk)
    ground.location.z = -0.06
    bpy.context.view_layer.update()
    report = bake(short_walk, ground=ground).report
    assert [finding["code"] for finding in report["self_check"]] == ["ground_off_skin", "mass_of_size"]
    assert all(set(finding) == {"code", "severity", "message", "remedy", "facts"} for finding in report["self_check"])
    assert report["self_check"][1]["facts"]["mass"] == 3.0
    assert "6." in report["self_check"][0]["message"].split("rests ")[1][:2]
    assert report["warnings"] == ground_mesh.warnings_of(baked_ground.display_mesh_of(ground))
    for finding, warning in zip(report["self_check"], report["warnings"], strict=True):
        assert warning.startswith(finding["message"])
        assert warning.endswith(finding["remedy"])


def test_a_step_on_the_edge_of_the_ground_is_pointed_out(short_walk):
    steps = bake(short_walk).report["steps"]
    bpy.ops.softground.clear_bake()
    ground = on_own_ground(short_walk)
    along = int(np.argmax(np.abs(np.subtract(steps[-1]["position"], steps[0]["position"]))))
    ahead = np.sign(steps[-1]["position"][along] - steps[0]["position"][along])
    ground.location[along] = steps[1]["position"][along] - ahead * 3.5
    bpy.context.view_layer.update()
    report = bake(short_walk, ground=ground).report
    assert "edge_of_ground" in codes(report)


def test_a_walk_of_120_frames_a_second_in_a_scene_of_25_is_slow_motion(scene):
    shots.walker(scene, frames=240, rate=120)
    scene.render.fps = 25
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.02
    assert codes(bake(scene).report) == {"slow_motion"}


@pytest.mark.slow
def test_a_capture_of_120_frames_a_second_that_says_25_is_slow_motion(scene):
    path = shots.SHARED / "rigs" / "cmu_05_01.bvh"
    if not path.is_file():
        pytest.skip(f"the reference data is not here: {path}")
    bpy.ops.import_anim.bvh(filepath=str(path), global_scale=0.0564, update_scene_fps=True, update_scene_duration=True)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.04
    assert "slow_motion" in codes(bake(scene).report)


def test_a_character_in_centimetres_is_told_its_scale(short_walk):
    short_walk.softground.characters[0].armature.scale = (100.0, 100.0, 100.0)
    short_walk.softground.cell_size = 1.0
    bpy.context.view_layer.update()
    (unit,) = (finding for finding in bake(short_walk).report["self_check"] if finding["code"] == "unit_scale")
    assert "its file is in centimetres" in unit["message"]
    assert "0.01" in unit["remedy"]


@pytest.fixture
def walking_stool(scene):
    armature = stool()
    bpy.context.view_layer.objects.active = armature
    bpy.ops.softground.add_character()
    scene.frame_end = 60
    scene.softground.cell_size = 0.02
    scene.softground.characters[0].mass = 70.0
    return scene


@pytest.mark.slow
def test_skin_that_rests_where_nothing_prints_is_pointed_out(walking_stool):
    assert not codes(bake(walking_stool).report) & {
        "skin_without_step",
        "contact_without_step",
        "step_without_skin",
        "ground_off_skin",
    }
    bpy.ops.softground.clear_bake()
    soles = walking_stool.softground.characters[0].soles
    for name in list(LEGS)[1:]:
        soles.remove(soles.find(name))
    assert "skin_without_step" in codes(bake(walking_stool).report)


def bobbing(scene, height, path, *, skin=True):
    """A figure that moves as a whole along a path: its height over frames, while it travels."""
    armature = shots.walker(scene, frames=72)
    armature.animation_data_clear()
    if not skin:
        bpy.data.objects.remove(armature.children[0])
    for frame in range(1, 73):
        time = (frame - 1) / 24
        armature.location = (0.0, -0.6 * time, height + path(time))
        armature.keyframe_insert("location", frame=frame)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.softground.add_character()


@pytest.mark.slow
@pytest.mark.parametrize("skin", [True, False])
@pytest.mark.parametrize(("bob", "period"), [(0.1, 1.5), (0.04, 1.0)])
def test_a_body_that_hovers_is_said_to_and_leaves_no_print_where_it_dips(scene, bob, period, skin):
    bobbing(scene, bob, lambda time: bob * np.sin(2 * np.pi * time / period), skin=skin)
    with pytest.raises(InputError, match=r"'Walker' hovers, .* take it out of the characters"):
        bake(scene)
    scene.objects["Walker"].name = "Ghost"
    shots.walker(scene, frames=72)
    bpy.ops.softground.add_character()
    report = bake(scene).report
    assert {step["character"] for step in report["steps"]} == {"Walker"}
    assert "hovers" in codes(report)
    assert not codes(report) & {"no_print", "missed_steps", "skin_without_step", "contact_without_step"}


def test_hops_do_not_hover(scene):
    """Thrown up every second, they fall as bodies do."""

    def hop(time):
        aloft = np.clip(time % 1 - 0.5, 0.0, 0.5)
        return 9.81 / 2 * aloft * (0.5 - aloft)

    bobbing(scene, 0.0, hop)
    report = bake(scene).report
    assert report["steps"]
    assert "hovers" not in codes(report)
