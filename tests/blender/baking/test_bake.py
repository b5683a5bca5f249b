"""The main job, end to end: from a rig to footprints on a ground, and back."""

import gc
from collections import Counter
from dataclasses import replace
from itertools import pairwise

import bpy
import numpy as np
import pytest

from softground_addon.blender import mesh_arrays, reuse
from softground_addon.blender.baking import bake_job
from softground_addon.blender.characters.selection import set_up_automatically
from softground_addon.blender.compat import action_curves
from softground_addon.blender.ground import baked_ground, ground_mesh
from softground_addon.blender.playback.display_key import DISPLAY_KEY
from softground_addon.core.errors import InputError
from softground_addon.core.ground.presets import FOLDER
from softground_addon.core.ground.surfaces import SURFACES
from softground_addon.core.loads.estimate import CharacterLoads
from softground_addon.core.record import edits, record
from tests.blender import fingerprints, shots
from tests.blender.grounds import bake, heights, plane, refusal, rest
from tests.tiers import slow_but_one

PRESETS = sorted(path.stem for path in FOLDER.glob("*.json"))


def test_two_clicks_lead_from_an_animated_rig_to_prints(scene):
    shots.walker(scene)
    assert bpy.ops.softground.add_character() == {"FINISHED"}
    assert bpy.ops.softground.bake() == {"FINISHED"}
    ground = scene.softground.ground
    depth = rest(ground)[:, 2] - heights(ground)[:, 2]
    assert 0.01 < depth.max() < 0.10


def test_steps_alternate_and_lie_under_the_feet(walk):
    report = bake(walk).report
    contacts = [step["contact"] for step in report["steps"]]
    assert len(contacts) >= 5
    assert all(a != b for a, b in pairwise(contacts))
    armature = walk.softground.characters[0].armature
    for step in report["steps"][1:-1]:
        walk.frame_set(round((step["frame_start"] + step["frame_end"]) / 2))
        sole = walk.softground.characters[0].soles[step["contact"]]
        bone = armature.pose.bones[sole.bone]
        heel, ball = (np.array(armature.matrix_world @ point)[:2] for point in (bone.head, bone.tail))
        along = (np.array(step["position"][:2]) - heel) @ (ball - heel) / ((ball - heel) @ (ball - heel))
        aside = np.linalg.norm(np.array(step["position"][:2]) - heel - along * (ball - heel))
        assert -0.5 < along < 1.5
        assert aside < 0.02


def test_no_print_where_no_foot_was(walk):
    bake(walk)
    ground = walk.softground.ground
    moved = np.abs(rest(ground)[:, 2] - heights(ground, DISPLAY_KEY)[:, 2]) > 1e-4
    steps = record.load(ground.data[ground_mesh.RECORD]).footprints
    place = rest(ground)[moved, :2]
    nearest = np.min([np.linalg.norm(place - step.position[:2], axis=1) for step in steps], axis=0)
    assert nearest.max() < 0.16 + 0.04 + 0.04  # half a shoe, the rim's reach, the blur


def test_a_muted_step_stays_out_of_the_ground_when_it_is_baked_again(walk):
    steps = bake(walk).report["steps"]
    ground = walk.softground.ground
    plain = heights(ground, DISPLAY_KEY)
    stored = record.load(bytes(ground.data[ground_mesh.RECORD]))
    assert [edits.step_id(step) for step in stored.footprints] == [step["id"] for step in steps]
    muted = stored.footprints[3]
    content = record.dump(replace(stored, edits={edits.step_id(muted): edits.StepEdit(mute=True)}))
    del ground.data[ground_mesh.RECORD]  # an array that is there would keep its length
    ground.data[ground_mesh.RECORD] = np.frombuffer(content + bytes(-len(content) % 4), np.int32)
    again = bake(walk)
    assert record.load(bytes(ground.data[ground_mesh.RECORD])).edits[steps[3]["id"]].mute
    assert len(again.report["steps"]) == len(baked_ground.load(ground)[0]) + 1 == len(steps)
    moved = heights(ground, DISPLAY_KEY)[:, 2] - rest(ground)[:, 2]
    under = np.linalg.norm(rest(ground)[:, :2] - muted.position[:2], axis=1) < 0.08
    beside = np.linalg.norm(rest(ground)[:, :2] - stored.footprints[2].position[:2], axis=1) < 0.08
    assert np.abs(plain[under, 2] - rest(ground)[under, 2]).max() > 0.01
    assert np.abs(moved[under]).max() < 1e-3
    np.testing.assert_array_equal(heights(ground, DISPLAY_KEY)[beside], plain[beside])
    walk.frame_set(walk.frame_end)
    shown = ground.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    played = mesh_arrays.positions(shown)[:, 2] + ground.location.z
    np.testing.assert_allclose(played[under], heights(ground, DISPLAY_KEY)[under, 2], atol=3e-4)


@pytest.mark.parametrize("preset", slow_but_one(PRESETS))
def test_the_rim_holds_the_displaced_volume_on_every_preset(walk, preset):
    bpy.ops.softground.load_preset(name=preset)
    result = bake(walk)
    nu = walk.softground.material.poisson_ratio
    totals = result.report["totals"]
    assert totals["compressed_m3"] > 0
    assert totals["rim_m3"] + totals["thrown_m3"] == pytest.approx(2 * nu * totals["compressed_m3"], rel=1e-6)
    assert (totals["thrown_m3"] > 0) == (not preset.startswith("paper"))
    thrown, density = Counter(), SURFACES[walk.softground.material.surface].density
    for row in result.report["events"]:
        thrown[row["step"]] += row["thrown_kg"] / density
    for step in result.report["steps"]:
        displaced = step["rim_m3"] + thrown[step["id"]]
        assert displaced == pytest.approx(2 * nu * step["compressed_m3"], rel=1e-6, abs=1e-8)
        assert step["max_depth_m"] <= walk.softground.material.layer_depth
    ground = walk.softground.ground
    assert np.isfinite(heights(ground)).all()


def test_a_bake_on_the_users_mesh_moves_nothing_else_and_clears_to_the_same_bytes(walk):
    ground = plane(walk, height=lambda x, y: 0.03 * np.sin(2 * x))
    walk.softground.ground = ground
    bpy.context.view_layer.update()
    before = fingerprints.of_file()
    bpy.ops.softground.bake()
    baked = fingerprints.of_file()
    assert baked["objects"]["Walker"] == before["objects"]["Walker"]
    assert baked["actions"] == before["actions"]
    assert baked["names"] == {**before["names"], "node_groups": ["SoftGround Playback"]}
    assert baked["meshes"]["Field"] != before["meshes"]["Field"]
    assert np.array_equal(heights(ground)[:, :2], rest(ground)[:, :2])
    bpy.ops.softground.clear_bake()
    assert fingerprints.of_file() == before


def test_a_mass_or_cells_that_do_not_suit_the_size_of_the_body_are_pointed_out(walk):
    assert bake(walk).report["warnings"] == []
    walk.softground.characters[0].mass = 3.0
    walk.softground.cell_size = 0.05
    mass, cells = sorted(bake(walk).report["warnings"])
    assert "weighs 3 kg" in mass
    assert "cells long: set the cell size to 1" in cells


def test_a_character_that_leaves_no_print_is_pointed_out(walk):
    walk.softground.characters[0].armature.rotation_euler.x = np.pi
    walk.softground.ground = None
    bpy.context.view_layer.update()
    with pytest.raises(InputError, match="'Walker' hovers, and leaves no print"):
        bake(walk)


@pytest.mark.slow
def test_nothing_is_baked_where_nobody_moves_and_a_statue_among_others_is_pointed_out(walk):
    walker = walk.softground.characters[0].armature
    statue = bpy.data.objects.new("Statue", walker.data)
    walk.collection.objects.link(statue)
    walk.collection.objects.link(skin := next(obj for obj in walker.children if obj.type == "MESH").copy())
    skin.parent = statue
    for modifier in skin.modifiers:
        modifier.object = statue
    statue.location.y = 0.5
    statue.keyframe_insert("location", frame=1)
    bpy.context.view_layer.objects.active = statue
    bpy.ops.softground.add_character()
    (warning,) = [warning for warning in bake(walk).report["warnings"] if "does not move" in warning]
    assert "'Statue'" in warning
    bpy.ops.softground.clear_bake()
    walk.softground.characters.remove(1)
    for curve in action_curves(walker.animation_data.action):
        curve.mute = True
    before = fingerprints.of_file()
    said = refusal(bpy.ops.softground.bake)
    assert "'Walker' does not move in these frames: check that its action has keys" in said
    assert fingerprints.of_file() == before


def test_baking_again_gives_the_same_ground_and_not_twice_the_depth(walk):
    bpy.ops.softground.bake()
    first = heights(walk.softground.ground)
    bpy.ops.softground.bake()
    assert np.array_equal(heights(walk.softground.ground), first)


def test_a_bake_survives_save_reload_and_append(walk, tmp_path):
    bpy.ops.softground.bake()
    ground = walk.softground.ground
    name, baked = ground.name, heights(ground, DISPLAY_KEY)
    stored = bytes(ground.data[ground_mesh.RECORD])
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    ground = bpy.context.scene.softground.ground
    assert np.array_equal(heights(ground, DISPLAY_KEY), baked)
    assert bytes(ground.data[ground_mesh.RECORD]) == stored
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "shot.blend")) as (_, wanted):
        wanted.objects = [name]
    bpy.context.scene.collection.objects.link(wanted.objects[0])
    bpy.context.view_layer.update()
    assert np.array_equal(heights(wanted.objects[0], DISPLAY_KEY), baked)
    assert bytes(wanted.objects[0].data[ground_mesh.RECORD]) == stored


@pytest.mark.parametrize("stage", ["sample", "simulate", "write"])
def test_a_bake_that_is_stopped_half_way_changes_nothing(walk, stage):
    walk.softground.ground = plane(walk)
    bpy.context.view_layer.update()
    before = fingerprints.of_file()
    job = bake_job.bake(walk)
    while next(job).stage != stage:
        pass
    job.close()
    assert fingerprints.of_file() == before


@pytest.mark.slow
@pytest.mark.parametrize("transform", slow_but_one(["tilted", "scaled", "parented", "moved"]))
def test_grounds_with_a_transform_take_the_same_prints(walk, transform):
    """A level field looks the same however its object is turned and scaled, and so do the prints."""
    walk.softground.ground = plane(walk)
    plain = bake(walk)
    bpy.ops.softground.clear_bake()
    ground = walk.softground.ground
    matrix = ground.matrix_world.copy()
    if transform == "tilted":
        ground.rotation_euler = (0.3, -0.2, 0.7)
    elif transform == "scaled":
        ground.scale = (2.0, 0.5, 3.0)
    elif transform == "parented":
        ground.parent = bpy.data.objects.new("parent", None)
        ground.parent.rotation_euler = (0.2, 0.0, 1.0)
        walk.collection.objects.link(ground.parent)
    else:
        ground.location = (0.5, -0.2, 1.0)
    bpy.context.view_layer.update()
    ground.data.transform(ground.matrix_world.inverted() @ matrix)
    turned = bake(walk)
    for a, b in zip(plain.report["steps"], turned.report["steps"], strict=True):
        assert b["max_depth_m"] == pytest.approx(a["max_depth_m"], rel=1e-3)
        assert np.allclose(b["position"], a["position"], atol=1e-3)


@pytest.mark.slow
def test_prints_do_not_depend_on_the_scenes_units(walk):
    """The same walk in a scene of centimetres gives the same prints, in metres."""
    metres = bake(walk).report
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.unit_settings.scale_length = 0.01
    armature = shots.walker(scene)
    armature.scale = (100.0, 100.0, 100.0)
    bpy.context.view_layer.update()
    bpy.ops.softground.add_character()
    centimetres = bake(scene).report
    assert len(metres["steps"]) == len(centimetres["steps"])
    for a, b in zip(metres["steps"], centimetres["steps"], strict=True):
        assert b["max_depth_m"] == pytest.approx(a["max_depth_m"], rel=1e-3)
        assert np.allclose(b["position"], a["position"], atol=1e-3)


def test_an_armature_is_needed_to_add_a_character(scene):
    with pytest.raises(RuntimeError, match="armature"):
        bpy.ops.softground.add_character()


def test_an_armature_in_a_collection_instance_is_named_with_its_remedy(scene):
    armature = shots.walker(scene)
    collection = bpy.data.collections.new("Linked")
    for thing in (armature, *armature.children):
        scene.collection.objects.unlink(thing)
        collection.objects.link(thing)
    instance = bpy.data.objects.new("Instance", None)
    instance.instance_type, instance.instance_collection = "COLLECTION", collection
    scene.collection.objects.link(instance)
    with pytest.raises(InputError, match=r"'Instance'.*Library Override"):
        set_up_automatically(scene)
    bpy.context.view_layer.objects.active = instance
    with pytest.raises(RuntimeError, match=r"'Instance'.*Library Override"):
        bpy.ops.softground.add_character()


def test_clicking_the_characters_mesh_adds_its_armature(scene):
    armature = shots.walker(scene)
    bpy.context.view_layer.objects.active = next(child for child in armature.children if child.type == "MESH")
    bpy.ops.softground.add_character()
    assert scene.softground.characters[0].armature == armature


def test_a_character_cannot_be_added_twice(walk):
    with pytest.raises(RuntimeError, match="is already a character"):
        bpy.ops.softground.add_character()


def test_a_selected_mesh_becomes_the_ground_as_it_is(walk):
    ground = plane(walk)
    bpy.context.view_layer.objects.active = ground
    ground.select_set(True)
    before = fingerprints.of_file()
    bpy.ops.softground.create_ground()
    assert walk.softground.ground == ground
    assert fingerprints.of_file() == before


@pytest.mark.parametrize("kind", ["COPY_TRANSFORMS", "ARMATURE"])
def test_a_rig_that_copies_another_is_baked_over_the_frames_of_that_one(scene, kind):
    source = shots.walker(scene, frames=40)
    follower = shots.walker(scene, frames=20)
    follower.animation_data_clear()
    for bone in follower.pose.bones:
        constraint = bone.constraints.new(kind)
        leader = constraint.targets.new() if kind == "ARMATURE" else constraint
        leader.target, leader.subtarget = source, bone.name
    bpy.ops.softground.add_character()
    assert (scene.softground.frame_start, scene.softground.frame_end) == (1, 40)
    leader.target = follower
    source.animation_data_clear()
    source.constraints.new("COPY_LOCATION").target = follower  # round in a circle
    scene.frame_start, scene.frame_end = 5, 33
    scene.softground.characters.clear()
    bpy.ops.softground.add_character()
    assert (scene.softground.frame_start, scene.softground.frame_end) == (5, 33)


def test_a_created_ground_fits_the_walk_with_a_margin(walk):
    bpy.ops.softground.create_ground()
    ground = walk.softground.ground
    report = bake(walk).report
    place = np.array([step["position"][:2] for step in report["steps"]])
    corner = heights(ground)[:, :2]
    assert (corner.min(axis=0) < place.min(axis=0) - 0.3).all()
    assert (corner.max(axis=0) > place.max(axis=0) + 0.3).all()


def test_a_created_ground_is_fine_under_the_prints_only(walk):
    result = bake(walk)
    ground = walk.softground.ground
    assert baked_ground.display_mesh_of(ground) == ground
    spacing = walk.softground.cell_size
    area = np.ptp(rest(ground)[:, 0]) * np.ptp(rest(ground)[:, 1])
    assert len(ground.data.vertices) < 0.5 * area / spacing**2
    footprints, _ = baked_ground.load(ground)
    deepest = max(print_.max_depth_m for print_ in footprints)
    assert (rest(ground) - heights(ground))[:, 2].max() == pytest.approx(deepest, rel=5e-3)
    assert not result.report["warnings"]


def test_prints_beside_the_fine_part_of_a_created_ground_get_detail_and_a_word(walk):
    bpy.ops.softground.create_ground()
    ground = walk.softground.ground
    walk.softground.characters[0].armature.location.x += 0.35
    bpy.context.view_layer.update()
    result = bake(walk)
    display_mesh = baked_ground.display_mesh_of(ground)
    assert display_mesh != ground
    footprints, _ = baked_ground.load(ground)
    deepest = max(print_.max_depth_m for print_ in footprints)
    assert (rest(display_mesh) - heights(display_mesh))[:, 2].max() == pytest.approx(deepest, rel=0.02)
    assert any("'SoftGround Trail'" in warning for warning in result.report["warnings"])
    with pytest.raises(InputError, match="'SoftGround' is too coarse"):
        bake(walk, detail="NEVER")


def test_steps_off_the_ground_are_told_of_with_the_remedy(walk):
    field = plane(walk, size=2.0)
    bpy.context.view_layer.update()
    warnings = bake(walk, ground=field).report["warnings"]
    assert any("steps of 'Walker' meet no ground on 'Field'" in warning for warning in warnings)


def test_a_climb_gets_a_created_ground_that_climbs(walk):
    flat = bake(walk, ground=None).report["totals"]["steps"]
    bpy.ops.softground.clear_bake()
    walk.softground.characters[0].armature.rotation_euler.x = np.radians(8.0)
    bpy.context.view_layer.update()
    result = bake(walk, ground=None)
    assert result.report["totals"]["steps"] == flat
    place = rest(walk.softground.ground)
    assert np.ptp(place[:, 2]) == pytest.approx(np.tan(np.radians(8.0)) * np.ptp(place[:, 1]), rel=0.05)
    assert not result.report["warnings"]


def test_a_plane_of_four_vertices_gets_detail_along_the_trail_and_comes_back(walk):
    ground = walk.softground.ground = plane(walk, vertices=2)
    bpy.context.view_layer.update()
    before = fingerprints.of_file()
    bpy.ops.softground.bake()
    fine = baked_ground.display_mesh_of(ground)
    assert walk.softground.ground == ground
    assert (ground.hide_viewport, ground.hide_render, len(ground.data.vertices)) == (True, True, 4)
    depth = (rest(fine) - heights(fine, DISPLAY_KEY))[:, 2].max()
    footprints, _ = baked_ground.load(ground)
    assert depth == pytest.approx(max(print_.max_depth_m for print_ in footprints), rel=0.15)
    first = heights(fine, DISPLAY_KEY)
    bpy.ops.softground.bake()
    assert np.array_equal(heights(baked_ground.display_mesh_of(ground), DISPLAY_KEY), first)
    bpy.ops.softground.clear_bake()
    after = fingerprints.of_file()
    after["names"], before["names"] = ({**names, "materials": None} for names in (after["names"], before["names"]))
    assert after == before


def test_detail_survives_a_reload_and_a_bake_after_it(walk, tmp_path):
    ground = walk.softground.ground = plane(walk, vertices=2)
    ground.location = (0.3, -0.2, 0.0)
    bpy.context.view_layer.update()
    bpy.ops.softground.bake()
    first = heights(baked_ground.display_mesh_of(ground), DISPLAY_KEY)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    ground = bpy.context.scene.softground.ground
    bpy.ops.softground.bake()
    assert np.array_equal(heights(baked_ground.display_mesh_of(ground), DISPLAY_KEY), first)


def test_changing_the_choice_of_detail_moves_the_bake(walk):
    ground = walk.softground.ground = plane(walk)
    bpy.context.view_layer.update()
    original = fingerprints.of_file()["meshes"]["Field"]
    walk.softground.detail = "ALWAYS"
    bpy.ops.softground.bake()
    assert fingerprints.of_file()["meshes"]["Field"] == original
    assert not ground_mesh.is_baked(ground)
    walk.softground.detail = "NEVER"
    bpy.ops.softground.bake()
    assert ground_mesh.is_baked(ground)
    assert not ground.hide_viewport
    assert "Field Trail" not in bpy.data.objects


@pytest.mark.slow
def test_what_is_known_of_every_step_is_let_go_before_the_ground_is_written(walk, monkeypatch):
    def alive():
        return [thing for thing in gc.get_objects() if isinstance(thing, CharacterLoads)]

    others, alive_after = alive(), []  # of other tests
    write = baked_ground.write

    def watched(*given, **options):
        alive_after.extend(loads for loads in alive() if not any(loads is other for other in others))
        return write(*given, **options)

    monkeypatch.setattr(baked_ground, "write", watched)
    monkeypatch.setattr(reuse, "LARGEST", 0)  # of a long walk, the next bake takes nothing over either
    bake(walk)
    assert len(alive_after) == 0
