"""Debris in Blender: it flies by its node group alone, in any order of frames, and Clear takes all of it away."""

import re
import subprocess
import sys
from dataclasses import replace

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix, Vector
from scipy.spatial import KDTree

from sample_scenes.body import Body
from sample_scenes.character import create_character
from sample_scenes.keys import write_action
from sample_scenes.run import Run, run
from softground_addon.blender import compat, jobs, mesh_arrays, settings
from softground_addon.blender.baking import bake_job, bake_report, step_edits
from softground_addon.blender.debris import debris_object, debris_shapes
from softground_addon.blender.ground import baked_ground
from softground_addon.blender.nodes import node_modifiers
from softground_addon.blender.output import exports, image_exports
from softground_addon.blender.viewport.step_preview import StepPreview
from softground_addon.core.debris import flight
from softground_addon.core.ground.surfaces import SURFACES
from softground_addon.core.record import record
from softground_addon.core.record.edits import StepEdit, step_id
from tests.blender import fingerprints, shots
from tests.blender.images import read_image


def runner(scene):
    """A run on dry sand, with quick settings."""
    body = Body()
    armature = create_character("Runner", body, scene.collection, shots.COARSE)
    write_action(armature, run(body, Run(), 24, 24), "Run")
    scene.render.fps = 24
    bpy.context.view_layer.objects.active = armature
    bpy.ops.softground.add_character()
    shots.coarse(scene)
    options = scene.softground
    options.material.preset, options.material.surface = "Dry Sand", "sand"
    options.material.youngs_modulus, options.material.poisson_ratio = 9e5, 0.5
    options.cell_size = 0.03
    return armature


@pytest.fixture(scope="module")
def baked(addon, tmp_path_factory):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    runner(scene)
    jobs.run(bake_job.bake(scene))  # the others read the ground that this one makes
    without = jobs.run(bake_job.bake(scene, write=False)).report
    scene.softground.debris = True
    result = jobs.run(bake_job.bake(scene))
    path = tmp_path_factory.mktemp("debris") / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path, result.report, without["totals"]


@pytest.fixture
def scene(baked):
    bpy.ops.wm.open_mainfile(filepath=str(baked[0]))
    return bpy.context.scene


def set_input(modifier, name, value):
    compat.write_input(modifier, node_modifiers.inputs_of(modifier)[name], value)


def get_input(modifier, name):
    return compat.read_input(modifier, node_modifiers.inputs_of(modifier)[name])


def values(obj, name, field="value", size=1):
    out = np.empty(len(obj.data.vertices) * size, np.float32)
    obj.data.attributes[name].data.foreach_get(field, out)
    return out.reshape(-1, size) if size > 1 else out


def places_of(obj):
    """Where its points come to rest."""
    return mesh_arrays.positions(obj.data) + np.array(obj.location)


def pieces(obj):
    """Places of all shapes and of all round points that are seen."""
    graph = bpy.context.evaluated_depsgraph_get()
    shapes, points = [], []
    for instance in graph.object_instances:  # each lives for its turn only
        if instance.is_instance and instance.parent and instance.parent.original == obj:
            if instance.object.type == "POINTCLOUD":
                at = np.empty(3 * len(instance.object.data.points), np.float32)
                instance.object.data.attributes["position"].data.foreach_get("vector", at)
                points += [tuple(instance.matrix_world @ Vector(place)) for place in at.reshape(-1, 3)]
            else:
                shapes.append(tuple(instance.matrix_world.translation))
    return shapes, points


def points_of(obj):
    """Attributes of all round points that are seen, in world space, by name: (N, 1 or 3)."""
    columns = {name: [] for name in ("position", "velocity", "age", "radius", "kind", "step")}
    for instance in bpy.context.evaluated_depsgraph_get().object_instances:  # each lives for its turn only
        if (
            instance.is_instance
            and instance.parent
            and instance.parent.original == obj
            and instance.object.type == "POINTCLOUD"
        ):
            for name, parts in columns.items():
                size = 3 if name in ("position", "velocity") else 1
                part = np.empty(len(instance.object.data.points) * size, np.float32)
                instance.object.data.attributes[name].data.foreach_get("vector" if size == 3 else "value", part)
                parts.append(part.reshape(-1, size))
            matrix = np.array(instance.matrix_world)
            columns["position"][-1] = columns["position"][-1] @ matrix[:3, :3].T + matrix[:3, 3]
            columns["velocity"][-1] = columns["velocity"][-1] @ matrix[:3, :3].T
    return {name: np.concatenate(parts) for name, parts in columns.items()}


def shown(obj):
    """Places of all pieces, by place."""
    shapes, points = pieces(obj)
    return np.array(sorted(shapes + points)).reshape(-1, 3)


def wanted(obj, frame, wind=(0.0, 0.0, 0.0)):
    """The same by the closed form of the core."""
    start = values(obj, "softground_start", "vector", 3) + np.array(obj.location)
    since = (frame - values(obj, "softground_birth")) / 24.0
    born = since >= 0
    drag, time = values(obj, "softground_drag")[born], np.minimum(since, values(obj, "softground_flight"))[born]
    launch = values(obj, "softground_launch", "vector", 3)[born]
    place = flight.position(start[born].astype(float), launch, drag, time, 9.81)
    place += np.outer(time + drag * np.expm1(-time / drag), wind)
    return np.array(sorted(map(tuple, place.tolist()))).reshape(-1, 3)


@pytest.mark.slow
def test_debris_flies_as_the_closed_form_says_in_any_order_of_frames(scene):
    (obj,) = [each for each in scene.objects if each.name.startswith("SoftGround Debris")]
    counts = []
    for frame in (24, 3, 12, 24, 9):
        scene.frame_set(frame)
        places = shown(obj)
        expected = wanted(obj, frame)
        counts.append(len(places))
        assert len(places) == len(expected)
        if len(places):
            assert np.abs(np.sort(places, axis=0) - np.sort(expected, axis=0)).max() < 1e-4
    assert counts[0] == counts[3] == len(obj.data.vertices) or counts[0] == counts[3] > counts[4]
    assert counts[1] < counts[0]


@pytest.mark.parametrize("frame", [9, 13, 24])
def test_points_know_their_age_velocity_radius_kind_and_step(scene, frame):
    obj = debris_object.of(scene.softground.ground)
    scene.frame_set(frame)
    seen = points_of(obj)
    since = (frame - values(obj, "softground_birth")).astype(float) / 24.0
    start = values(obj, "softground_start", "vector", 3) + np.array(obj.location)
    launch, drag = values(obj, "softground_launch", "vector", 3), values(obj, "softground_drag").astype(float)
    flies = since < values(obj, "softground_flight")
    time = np.clip(since, 0.0, values(obj, "softground_flight"))
    at = flight.position(start.astype(float), launch, drag, time, 9.81)
    fall = np.array([0.0, 0.0, -9.81]) * drag[:, None]
    speed = (fall + (launch - fall) * np.exp(-time / drag)[:, None]) * flies[:, None]
    expected = {"age": since, "velocity": speed}
    expected |= {name: values(obj, name) for name in ("radius", "kind", "step")}
    born = np.flatnonzero(since >= 0)
    apart, which = KDTree(at[born]).query(seen["position"])
    assert len(apart) > 100
    assert apart.max() < 1e-4
    for name, wanted_of in expected.items():
        wrong = np.abs(seen[name] - wanted_of[born][which].reshape(len(which), -1)).max(axis=1)
        assert (wrong > 1e-3).mean() < 0.02, name  # a few lie in one place


@pytest.mark.slow
def test_wind_and_amount_act_at_once(scene):
    obj = debris_object.of(scene.softground.ground)
    modifier = obj.modifiers[0]
    set_input(modifier, "Wind", (2.0, 0.0, 0.0))
    obj.update_tag()
    scene.frame_set(20)
    assert np.abs(np.sort(shown(obj), axis=0) - np.sort(wanted(obj, 20, (2, 0, 0)), axis=0)).max() < 1e-4
    set_input(modifier, "Amount", 0.25)
    obj.update_tag()
    bpy.context.view_layer.update()
    assert 0.15 < len(shown(obj)) / len(wanted(obj, 20)) < 0.35


@pytest.mark.slow
def test_what_a_muted_step_threw_is_not_there_until_it_is_back(scene):
    ground = scene.softground.ground
    before = fingerprints.of_mesh(debris_object.of(ground).data)
    bake = jobs.run(step_edits.reading(scene))
    number = int(values(debris_object.of(ground), "step")[0])
    jobs.run(step_edits.editing(bake, {step_id(bake.record.footprints[number]): StepEdit(mute=True)}))
    assert set(values(debris_object.of(ground), "step")) == set(bake.record.thrown) - {number}
    jobs.run(step_edits.editing(bake, {}))
    assert fingerprints.of_mesh(debris_object.of(ground).data) == before


@pytest.mark.slow
def test_edited_steps_throw_what_a_bake_with_the_same_edits_throws(scene):
    """Moved, deepened, scaled and shifted in time, muted, and a copy on an earlier print."""
    ground = scene.softground.ground
    bake = jobs.run(step_edits.reading(scene))
    names = [step_id(footprint) for footprint in bake.record.footprints]
    edits = {
        names[0]: StepEdit(move_m=(0.3, 0.2), turn_deg=40.0),
        names[1]: StepEdit(strength=2.0),
        names[2]: StepEdit(mute=True),
        names[3]: StepEdit(scale=1.2, shift_frames=2),
        f"{names[1]}+1": StepEdit(move_m=(0.05, 0.0), shift_frames=4),
    }
    before = values(debris_object.of(ground), "step")
    jobs.run(step_edits.editing(bake, edits))
    loaded = record.load(bytes(baked_ground.stored_record(ground)))
    edited, content = fingerprints.of_mesh(debris_object.of(ground).data), record.dump(replace(loaded, about={}))
    report = jobs.run(bake_job.bake(scene)).report
    loaded = record.load(bytes(baked_ground.stored_record(ground)))
    assert record.dump(replace(loaded, about={})) == content
    assert fingerprints.of_mesh(debris_object.of(ground).data) == edited
    steps = values(debris_object.of(ground), "step")
    assert 2 in before
    assert set(steps) == set(loaded.thrown) >= {0, 1, 3, 1 + len(names)}
    assert 2 not in steps
    displaced = 2 * scene.softground.material.poisson_ratio
    for step in loaded.steps:
        if step.footprint:
            thrown = sum(step.thrown.values())
            assert step.footprint.rim_m3 + thrown == pytest.approx(displaced * step.footprint.compressed_m3, rel=1e-6)
    totals = report["totals"]
    assert totals["rim_m3"] + totals["thrown_m3"] == pytest.approx(
        displaced * sum(step.footprint.compressed_m3 for step in loaded.steps if step.footprint), rel=1e-6
    )
    thrown = sum(row["thrown_kg"] for row in baked_ground.events_of(ground))
    assert thrown == pytest.approx(totals["thrown_m3"] * SURFACES["sand"].density, rel=1e-3)


def test_no_piece_stays_where_a_print_is_dragged_away_from_under_it(scene):
    obj = debris_object.of(scene.softground.ground)
    bake = jobs.run(step_edits.reading(scene))
    step = bake.record.steps[1]
    before = fingerprints.of_mesh(obj.data)
    place, radius = places_of(obj)[:, :2], values(obj, "radius")
    in_print = np.abs(place - step.footprint.position[:2]).max(axis=1) < 0.1
    thrown = values(obj, "step") == step.index
    assert in_print.sum() > 100
    assert (thrown & ~in_print).sum() > 100
    preview = StepPreview(scene.softground.ground, bake)
    preview.show({step.name: StepEdit(move_m=(0.0, 0.5))})
    assert not values(obj, "radius")[in_print | thrown].any()
    far = np.abs(place - step.footprint.position[:2]).max(axis=1) > 1.5
    assert np.array_equal(values(obj, "radius")[far & ~thrown], radius[far & ~thrown])
    preview.end()
    assert fingerprints.of_mesh(obj.data) == before


def test_debris_that_was_deleted_stays_away_from_edited_steps(scene):
    ground = scene.softground.ground
    bpy.data.objects.remove(debris_object.of(ground))
    bake = jobs.run(step_edits.reading(scene))
    jobs.run(step_edits.editing(bake, {step_id(bake.record.footprints[0]): StepEdit(strength=0.5)}))
    assert debris_object.of(ground) is None


def test_the_report_says_how_much_was_thrown_and_the_rims_lack_it(baked, scene):
    totals = baked[1]["totals"]
    thrown = totals["thrown_m3"]
    assert thrown > 1e-5
    radius = values(debris_object.of(scene.softground.ground), "radius").astype(float)
    assert (4 / 3 * np.pi * radius**3).sum() == pytest.approx(thrown, rel=1e-4)
    without = baked[2]
    assert without["thrown_m3"] == 0
    assert without["rim_m3"] == pytest.approx(totals["rim_m3"] + thrown, rel=1e-6)
    assert sum(row["thrown_kg"] for row in baked[1]["events"]) == pytest.approx(
        thrown * SURFACES["sand"].density, rel=1e-3
    )


def test_a_run_in_dry_sand_throws_a_plume_at_each_landing(baked, scene):
    """Some tens of grams, a tenth of which rises by more than 3 cm, some by 8; what soles shed is far less."""
    kilograms = {}
    for row in baked[1]["events"]:
        kilograms.setdefault(row["phase"], []).append(row["thrown_kg"])
    strikes = np.array(kilograms["heel_strike"])
    assert 0.02 < np.median(strikes) < 0.1
    assert sum(kilograms["toe_off"]) < 0.1 * strikes.sum()
    obj = debris_object.of(scene.softground.ground)
    thrown = values(obj, "kind") == 0
    start, launch = (values(obj, f"softground_{name}", "vector", 3)[thrown] for name in ("start", "launch"))
    drag = values(obj, "softground_drag")[thrown]
    apex = drag * np.log1p(launch[:, 2] / (9.81 * drag))
    rise = (flight.position(start.astype(float), launch, drag, apex, 9.81) - start)[:, 2]
    assert np.percentile(rise, 90) > 0.03
    assert 0.08 < rise.max() < 0.4


@pytest.mark.slow
def test_debris_goes_with_the_ground_and_has_its_origin_so_that_no_line_runs_between_them(addon):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    runner(scene)
    scene.softground.debris = True
    bpy.ops.softground.create_ground()
    ground = scene.softground.ground
    assert bpy.ops.softground.bake() == {"FINISHED"}
    scene.frame_set(20)
    before, obj = shown(debris_object.of(ground)), debris_object.of(ground)
    assert ground.location.length > 0.1
    assert np.abs(np.sort(before, axis=0) - np.sort(wanted(obj, 20), axis=0)).max() < 1e-4
    turned = Matrix.LocRotScale((1.0, 2.0, 3.0), Euler((0.1, 0.2, 0.3)), (2.0, 2.0, 2.0))
    ground.matrix_world = turned @ ground.matrix_world
    bpy.context.view_layer.update()
    after = np.array([tuple(turned @ Vector(place)) for place in before])
    assert KDTree(shown(obj)).query(after)[0].max() < 1e-4
    assert (obj.matrix_world.translation - ground.matrix_world.translation).length < 1e-5


@pytest.mark.slow
def test_clear_takes_all_of_it_away_and_gives_the_bytes_back(addon):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    scene.softground.material.surface, scene.softground.cell_size = "wet_sand", 0.03
    bpy.ops.softground.create_ground()
    before = {
        name: len(getattr(bpy.data, name)) for name in ("objects", "meshes", "node_groups", "collections", "materials")
    }
    ground = fingerprints.of_mesh(scene.softground.ground.data)
    scene.softground.debris = True
    for _ in range(2):  # the second takes the place of the first
        assert bpy.ops.softground.bake() == {"FINISHED"}
        assert sum(obj.name.startswith("SoftGround Debris") for obj in scene.objects) == 1
    bpy.ops.softground.clear_bake()
    assert {name: len(getattr(bpy.data, name)) for name in before} == before
    assert fingerprints.of_mesh(scene.softground.ground.data) == ground


def test_a_duplicate_of_the_ground_has_no_debris_and_cannot_take_the_first_ones_away(scene):
    ground = scene.softground.ground
    duplicate = ground.copy()
    scene.collection.objects.link(duplicate)
    assert debris_object.of(duplicate) is None
    debris_object.remove(duplicate)
    assert debris_object.of(ground) is not None


def test_debris_that_was_deleted_in_the_viewport_goes_with_the_next_bake(scene):
    ground = scene.softground.ground
    deleted = debris_object.of(ground)
    for collection in deleted.users_collection:
        collection.objects.unlink(deleted)
    assert debris_object.of(ground) is None
    debris_object.remove(ground)
    assert not any(obj.name.startswith("SoftGround Debris") for obj in bpy.data.objects)


def test_off_costs_nothing_and_takes_the_older_away(scene):
    scene.softground.debris = False
    assert bpy.ops.softground.bake() == {"FINISHED"}
    assert debris_object.of(scene.softground.ground) is None
    assert not [group for group in bpy.data.node_groups if group.name.startswith("SoftGround Debris")]
    assert not [collection for collection in bpy.data.collections if collection.name.startswith("SoftGround")]


@pytest.mark.slow
def test_an_artists_own_shapes_and_wind_stay_with_the_next_bake(scene):
    leaves = bpy.data.collections.new("Leaves")
    leaves.objects.link(bpy.data.objects.new("Leaf", bpy.data.meshes.new("Leaf")))
    obj = debris_object.of(scene.softground.ground)
    modifier = obj.modifiers[0]
    set_input(modifier, "Shapes", leaves)
    set_input(modifier, "Wind", (1.0, 2.0, 0.0))
    assert bpy.ops.softground.bake() == {"FINISHED"}
    modifier = debris_object.of(scene.softground.ground).modifiers[0]
    assert get_input(modifier, "Shapes") == leaves
    assert list(get_input(modifier, "Wind")) == [1.0, 2.0, 0.0]
    bpy.ops.softground.clear_bake()
    assert leaves.name in bpy.data.collections


def delete(obj):
    bpy.ops.object.select_all(action="DESELECT")
    obj.select_set(True)
    bpy.ops.object.delete()


@pytest.mark.slow
@pytest.mark.parametrize("has_own_parent", [False, True])
def test_another_bake_gives_debris_new_points_and_leaves_all_that_the_user_did_to_it(scene, has_own_parent):
    obj = debris_object.of(scene.softground.ground)
    obj.name, obj.hide_render, obj.display_type, obj["mine"] = "Spray", True, "BOUNDS", 7
    (modifier,) = obj.modifiers
    obj.modifiers.new("Mine", "DISPLACE")
    field, path = compat.input_field(modifier, node_modifiers.inputs_of(modifier)["Amount"])
    field.keyframe_insert(path, frame=1)
    obj.data.materials.append(bpy.data.materials.new("Glitter"))
    piece = get_input(modifier, "Shapes").objects[0]
    piece.active_material.diffuse_color = (1.0, 0.0, 0.0, 1.0)
    piece.active_material = bpy.data.materials.new("Gold")
    mine = bpy.data.collections.new("Mine")
    scene.collection.children.link(mine)
    mine.objects.link(obj)
    scene.collection.objects.unlink(obj)
    if has_own_parent:
        obj.parent = bpy.data.objects.new("Cart", None)
        scene.collection.objects.link(obj.parent)
    bpy.context.view_layer.update()
    before, first, group = fingerprints.of_object(obj), len(obj.data.vertices), modifier.node_group

    scene.softground.characters[0].mass *= 1.5
    assert bpy.ops.softground.bake() == {"FINISHED"}
    assert debris_object.of(scene.softground.ground) == obj
    assert len(obj.data.vertices) != first
    assert fingerprints.of_object(obj) == before
    assert (list(obj.users_collection), modifier.node_group) == ([mine], group)
    assert [material.name for material in obj.data.materials] == ["Glitter"]
    assert piece.active_material.name == "Gold"
    set_input(modifier, "Amount", 1.0)
    obj.animation_data_clear()
    obj.modifiers.remove(obj.modifiers["Mine"])
    bpy.context.view_layer.update()
    scene.frame_set(24)
    updated = shown(obj)
    bpy.ops.softground.clear_bake()
    assert bpy.ops.softground.bake() == {"FINISHED"}
    scene.frame_set(24)
    assert np.abs(updated - shown(debris_object.of(scene.softground.ground))).max() < 1e-5


def test_debris_of_another_surface_looks_like_that(scene):
    obj = debris_object.of(scene.softground.ground)
    sand = get_input(obj.modifiers[0], "Shapes").name
    scene.softground.material.surface = "snow"
    assert bpy.ops.softground.bake() == {"FINISHED"}
    assert debris_object.of(scene.softground.ground) == obj
    assert get_input(obj.modifiers[0], "Shapes").name == "SoftGround Snow Pieces"
    assert sand not in bpy.data.collections
    assert sum(group.name.startswith("SoftGround Debris") for group in bpy.data.node_groups) == 1


def test_where_the_ground_was_deleted_no_debris_hangs_in_the_air_and_the_next_bake_takes_it_over(scene):
    ground = scene.softground.ground
    obj = debris_object.of(ground)
    obj.display_type = "BOUNDS"
    mine = obj.copy()
    scene.collection.objects.link(mine)
    delete(ground)
    bpy.context.view_layer.update()
    assert bake_report.stale_reasons(scene) == ("'SoftGround' was deleted",)
    assert obj.name not in scene.objects
    assert mine.name in scene.objects
    assert bpy.ops.softground.bake() == {"FINISHED"}
    assert scene.softground.ground != ground
    assert debris_object.of(scene.softground.ground) == obj
    assert obj.name in scene.objects
    assert obj.display_type == "BOUNDS"
    assert obj.parent == scene.softground.ground
    assert sum(bool(obj.get("softground_debris")) for obj in bpy.data.objects) == 2
    assert bake_report.stale_reasons(scene) == ()


@pytest.mark.slow
def test_where_the_copy_that_shows_the_prints_was_deleted_no_debris_hangs_in_the_air(scene):
    bpy.ops.softground.clear_bake()
    scene.softground.detail = "ALWAYS"
    assert bpy.ops.softground.bake() == {"FINISHED"}
    ground = scene.softground.ground
    obj = debris_object.of(ground)
    delete(baked_ground.display_mesh_of(ground))
    bpy.context.view_layer.update()
    assert bake_report.stale_reasons(scene) == ("The copy of 'SoftGround' that shows the prints was deleted",)
    assert obj.name not in scene.objects
    assert bpy.ops.softground.bake() == {"FINISHED"}
    assert debris_object.of(ground) == obj
    delete(ground)
    bpy.ops.softground.clear_bake()
    assert not any(obj.name.startswith("SoftGround Debris") for obj in bpy.data.objects)


def test_undo_brings_debris_back_with_its_ground(scene):
    mine = bpy.data.collections.new("Mine")
    scene.collection.children.link(mine)
    obj = debris_object.of(scene.softground.ground)
    mine.objects.link(obj)
    scene.collection.objects.unlink(obj)
    bpy.ops.ed.undo_push(message="Mine")
    delete(scene.softground.ground)
    bpy.ops.ed.undo_push(message="Delete")
    bpy.context.view_layer.update()
    assert not [obj for obj in bpy.context.scene.objects if obj.name.startswith("SoftGround Debris")]
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()
    scene = bpy.context.scene
    assert debris_object.of(scene.softground.ground).name in scene.objects


@pytest.mark.slow
def test_only_the_largest_have_a_shape_and_the_rest_are_round(scene):
    obj = debris_object.of(scene.softground.ground)
    scene.frame_set(24)
    everything = shown(obj)
    for count in (0, 40, 10**6):
        set_input(obj.modifiers[0], "Shaped", count)
        obj.update_tag()
        bpy.context.view_layer.update()
        shapes, _ = pieces(obj)
        born = values(obj, "softground_birth") <= 24
        assert len(shapes) == (values(obj, "softground_rank")[born] < count).sum()
        assert np.abs(shown(obj) - everything).max() < 1e-6


@pytest.mark.parametrize("surface", SURFACES)
def test_light_goes_through_pieces_in_cycles_alone_as_eevee_draws_it_dark(scene, surface):
    tree = debris_shapes.material_of(debris_shapes.collection_of(SURFACES[surface])).node_tree
    shown = {
        engine: tree.get_output_node(engine).inputs["Surface"].links[0].from_node.type for engine in ("CYCLES", "EEVEE")
    }
    assert shown["EEVEE"] == "BSDF_PRINCIPLED"
    assert (shown["CYCLES"] == "MIX_SHADER") == (SURFACES[surface].fragments.translucency > 0)


def test_points_lie_where_they_come_to_rest(scene):
    obj = debris_object.of(scene.softground.ground)
    rest = places_of(obj)
    pieces = wanted(obj, 1e4)
    assert len(rest) == len(pieces)  # of two that lie side by side, either may be sorted first
    assert max(KDTree(rest).query(pieces)[0].max(), KDTree(pieces).query(rest)[0].max()) < 1e-4


COUNT = """
import bpy, sys
bpy.ops.wm.open_mainfile(filepath=sys.argv[-1], use_scripts=False)
bpy.context.scene.frame_set(20)
graph = bpy.context.evaluated_depsgraph_get()
ours = (one.object for one in graph.object_instances if one.is_instance)
print("shown", sum(len(obj.data.points) if obj.type == "POINTCLOUD" else 1 for obj in ours))
"""


@pytest.mark.slow
def test_it_plays_without_the_add_on_and_without_scripts(baked, scene):
    scene.frame_set(20)
    ran = subprocess.run([sys.executable, "-c", COUNT, str(baked[0])], capture_output=True, text=True, check=True)
    assert f"shown {len(shown(debris_object.of(scene.softground.ground)))}" in ran.stdout


def arrays_of_points(text, name):
    """Samples of an array in a USD file in text, by frame."""
    block = re.search(rf"\b{name}\.timeSamples = \{{(.*?)\n\s*\}}", text, re.DOTALL)[1]
    samples = re.findall(r"([-\d.]+): \[(.*?)\]", block, re.DOTALL)
    return {float(frame): np.array(re.findall(r"-?[\d.]+(?:e-?\d+)?", row), float) for frame, row in samples}


@pytest.mark.slow
def test_images_hold_what_came_down_where_and_when(scene, tmp_path):
    """All of the volume that has landed by a frame, around where it lies."""
    ground, side, resolution = scene.softground.ground, 8.0, 1024
    obj = debris_object.of(ground)
    place = places_of(obj)
    pixel = side / resolution
    middle = np.round(place[:, :2].mean(axis=0) / pixel) * pixel  # each square has a pixel in its middle
    corners = np.empty((len(ground.data.loops), 2), np.float32)
    vertex = np.empty(len(ground.data.loops), np.int32)
    ground.data.loops.foreach_get("vertex_index", vertex)
    world = mesh_arrays.positions(ground.data) + np.array(ground.location)
    corners[:] = (world[vertex, :2] - middle) / side + 0.5
    ground.data.uv_layers.new(name="Square").uv.foreach_set("vector", corners.ravel())
    scene.frame_set(5)
    paths = image_exports.export_images(
        ground, tmp_path, 20, 20, units=settings.units_of(scene), resolution=resolution, uv_map="Square"
    )
    for early in (1, 8):
        paths += image_exports.export_images(
            ground, tmp_path, early, early, units=settings.units_of(scene), resolution=resolution, uv_map="Square"
        )
    assert {path.stem.split("_")[-2] for path in paths} == {"displacement", "mask", "debris"}
    assert image_exports.kinds_of(ground) == ("displacement", "mask", "debris")
    assert scene.frame_current == 5
    volume = 4 / 3 * np.pi * values(obj, "radius").astype(float) ** 3
    landed = values(obj, "softground_birth") + 24 * values(obj, "softground_flight")
    centre = ((np.arange(resolution) + 0.5) / resolution - 0.5) * side
    for frame in (1, 8, 20):
        (path,) = [each for each in paths if each.name.endswith(f"debris_{frame:04d}.exr")]
        thickness, cover, since, _ = np.moveaxis(read_image(path), -1, 0)
        down = landed <= frame
        shown_volume = thickness.sum() * (side / resolution) ** 2
        assert shown_volume == pytest.approx(volume[down].sum(), rel=0.05, abs=1e-12)
        assert (cover.max() > 0.1) == (frame > 1)
        assert ((since >= 0) == (thickness > 0)).all()
        assert since.max() <= frame / 24
        if down.any():
            lies = np.average(place[down, :2] - middle, axis=0, weights=volume[down])
            shown = (thickness.sum(axis=0) @ centre, thickness.sum(axis=1) @ centre) / thickness.sum()
            assert shown == pytest.approx(lies, abs=0.02)
    set_input(obj.modifiers[0], "Wind", (3.0, 0.0, 0.0))
    blown = debris_object.at_rest(obj, settings.units_of(scene)).place
    shown_volume = wanted(obj, 1e4, (3, 0, 0))
    beside = (shown_volume[:, 2] < -5).sum()  # what fell beside the ground lies nowhere, and grains fall slowly
    assert len(shown_volume) - len(blown) == beside < 0.002 * len(shown_volume)
    assert KDTree(shown_volume[:, :2]).query(blown)[0].max() < 1e-4


@pytest.mark.slow
def test_usd_carries_debris_as_points_with_sizes_and_speeds(scene, tmp_path):
    ground = scene.softground.ground
    obj, before = debris_object.of(ground), fingerprints.of_file()
    exports.export_usd(ground, tmp_path / "shot.usda", 8, 20)
    assert fingerprints.of_file() == before
    text = (tmp_path / "shot.usda").read_text(encoding="utf-8")
    has_clouds = compat.WRITES_CLOUDS
    kind = "Points " if has_clouds else 'Mesh "[^"]*Debris'
    (points,) = (part for part in re.split(r"\bdef ", text) if re.match(kind, part))
    places = arrays_of_points(points, "points")
    assert len(places) > 5
    for frame, place in places.items():
        expected = wanted(obj, frame)
        assert np.abs(np.sort(place.reshape(-1, 3), axis=0) - np.sort(expected, axis=0)).max() < 1e-4
    if has_clouds:
        widths, speeds = (arrays_of_points(points, name) for name in ("widths", "velocities"))
        for frame, place in places.items():
            born = values(obj, "softground_birth") <= frame
            assert np.sort(widths[frame]) == pytest.approx(2 * np.sort(values(obj, "radius")[born]), rel=1e-5)
            assert speeds[frame].shape == place.shape


@pytest.mark.slow
def test_alembic_carries_debris_as_points_with_speeds(scene, tmp_path):
    ground = scene.softground.ground
    obj, before = debris_object.of(ground), fingerprints.of_file()
    exports.export_alembic(ground, tmp_path / "shot.abc", 8, 20)
    assert fingerprints.of_file() == before
    objects = set(bpy.data.objects)
    bpy.ops.wm.alembic_import(filepath=str(tmp_path / "shot.abc"), as_background_job=False)
    (copy,) = [each for each in set(bpy.data.objects) - objects if each.type == "MESH" and not len(each.data.polygons)]
    for frame in (10, 16, 20):
        scene.frame_set(frame)
        shown = copy.evaluated_get(bpy.context.evaluated_depsgraph_get())
        world = mesh_arrays.positions(shown.data) @ np.array(shown.matrix_world)[:3, :3].T
        assert np.abs(np.sort(world, axis=0) - np.sort(wanted(obj, frame), axis=0)).max() < 1e-4
        assert len(shown.data.attributes["velocity"].data) == len(world)
