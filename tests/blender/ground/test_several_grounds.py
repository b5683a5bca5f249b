"""Several soft grounds in one shot: a floor, a crate and stairs, each with prints of its own."""

import json
from functools import partial
from types import SimpleNamespace
from unittest.mock import MagicMock

import bpy
import numpy as np
import pytest

from sample_scenes import stage
from softground_addon.blender import further_grounds, ground_presets, jobs, preset_files, reuse, settings
from softground_addon.blender.baking import bake_job, bake_report, clean_feet, step_edits
from softground_addon.blender.baking.publish import READY
from softground_addon.blender.carried import marks_object
from softground_addon.blender.ground import baked_ground, ground_mesh
from softground_addon.blender.live import live, live_start
from softground_addon.blender.output import event_points, export_formats, sound_exports
from softground_addon.blender.panels import panels
from softground_addon.blender.playback import weather_modifier
from softground_addon.blender.reading import analysis
from softground_addon.blender.state import state
from softground_addon.blender.weather import ground_weather
from softground_addon.core.errors import InputError
from softground_addon.core.events import sound
from softground_addon.core.record.edits import StepEdit
from softground_addon.core.record.typical_depth import typical_of
from tests.blender import command_line, fingerprints, shots
from tests.blender.ground.test_ground_frames import WHERE, hung_up, moved
from tests.blender.ground.test_hard_ground import HIGH, LOW, below, box, bytes_of, curves_of, lift
from tests.blender.grounds import as_rendered, bake, plane, refusal, steps_on

CRATE, DECK = "Crate", 0.2
GRAZE = 4.0
"""Contacts that are shorter are of a foot that swings against the edge of the crate, in it or not [frames]."""


def over_a_crate(scene):
    """A walk that is keyed over a crate on a floor, which is the first ground."""
    rig = shots.walker(scene, frames=84)
    bpy.ops.softground.add_character()
    options = scene.softground
    options.ground, options.cell_size = plane(scene, size=9.0, vertices=200), 0.02
    options.debris = options.marks = False
    box(scene, CRATE, DECK)
    lift(rig, DECK)
    bpy.context.view_layer.update()


@pytest.fixture
def crate(opened_as):
    opened_as(over_a_crate)
    return bpy.data.objects[CRATE]


def also(*objects):
    return [further_grounds.add(bpy.context.scene.softground, obj) for obj in objects][-1]


def codes(result):
    return [row["code"] for row in result.report["self_check"]]


def record_of(ground):
    return baked_ground.record_of(ground)


def prints_on(ground):
    return record_of(ground).footprints


@pytest.mark.slow
def test_each_step_prints_on_the_ground_under_it(crate):
    scene = bpy.context.scene
    also(crate)
    result, floor = bake(scene), scene.softground.ground
    assert result.report["warnings"] == []
    on = {name: [row for row in result.report["steps"] if row["ground"] == name] for name in ("Field", CRATE)}
    assert len(on[CRATE]) >= 2
    assert len(on["Field"]) >= 4
    assert all(abs(row["position"][2] - DECK) < 1e-3 for row in on[CRATE])
    assert all(abs(row["position"][2]) < 1e-3 for row in on["Field"])
    assert [len(prints_on(ground)) for ground in (floor, crate)] == [len(on["Field"]), len(on[CRATE])]
    assert not below(prints_on(floor))
    scene.frame_set(84)
    x, y, z = as_rendered(baked_ground.display_mesh_of(crate)).T
    within = (np.abs(x) < 0.45) & (y > LOW + 0.05) & (y < HIGH - 0.05) & (z > DECK / 2)
    assert DECK - z[within].min() == pytest.approx(max(step.max_depth_m for step in prints_on(crate)), abs=0.005)


@pytest.mark.slow
def test_depth_on_each_ground_is_as_on_that_ground_alone(crate):
    scene = bpy.context.scene
    item, floor = also(crate), scene.softground.ground
    settings_of = ("Snow", "Mud")
    bpy.ops.softground.load_preset(name=settings_of[0])
    scene.softground.cell_size = 0.02
    further_grounds.own_material(scene.softground, item)
    for field, value in vars(preset_files.named("mud").material).items():
        setattr(item.material, field, value)
    item.material.surface = "mud"
    bake(scene)
    together = {ground: prints_on(ground) for ground in (floor, crate)}
    events = {ground: {row["surface"] for row in baked_ground.events_of(ground)} for ground in (floor, crate)}
    assert events == {floor: {"snow"}, crate: {"mud"}}
    scene.softground.grounds.clear()
    for ground, other, preset in ((floor, crate, "Snow"), (crate, floor, "Mud")):
        scene.softground.hard_grounds.clear()
        bpy.ops.softground.load_preset(name=preset)
        scene.softground.cell_size, scene.softground.debris = 0.02, False
        scene.softground.ground = ground
        scene.softground.hard_grounds.add().object = other
        bake(scene)
        alone = {(step.sole, round(step.start_frame, 6)): step for step in prints_on(ground)}
        assert len(together[ground]) == len(alone) >= 2
        for step in (step for step in together[ground] if step.end_frame - step.start_frame > GRAZE):
            same = alone[step.sole, round(step.start_frame, 6)]
            assert step.max_depth_m == pytest.approx(same.max_depth_m, rel=1e-6)
            assert step.compressed_m3 == pytest.approx(same.compressed_m3, rel=1e-6)
            assert step.rim_m3 == pytest.approx(same.rim_m3, rel=1e-6)


@pytest.mark.slow
def test_a_further_ground_that_nobody_walks_on_changes_nothing_bit_for_bit(walk):
    scene = bpy.context.scene
    scene.softground.ground, scene.softground.cell_size = plane(scene, size=9.0, vertices=200), 0.02
    scene.softground.detail = "NEVER"
    before = bytes_of(bake(scene).footprints)
    deck, aside = box(scene, "Deck", 2.2, y=(-9, 9), bottom=2.0), box(scene, "Aside", 0.3, x=(11.5, 12.0), y=(-9, 9))
    bpy.context.view_layer.update()
    also(deck, aside)
    result = bake(scene)
    assert bytes_of(result.footprints) == before
    assert result.report["warnings"] == []
    assert not baked_ground.is_baked(deck)
    assert not baked_ground.is_baked(aside)


@pytest.mark.slow
def test_walkers_below_a_bridge_are_not_on_it_whichever_ground_is_the_first(walk):
    scene = bpy.context.scene
    floor = scene.softground.ground = plane(scene, size=9.0, vertices=200)
    scene.softground.cell_size, scene.softground.detail = 0.02, "NEVER"
    item = also(box(scene, "Bridge", 2.2, y=(-9, 9), x=(-1, 1), bottom=2.0))
    bpy.context.view_layer.update()
    before = bytes_of(bake(scene).footprints)
    further_grounds.choose(scene.softground, item)
    assert scene.softground.ground.name == "Bridge"
    assert bytes_of(bake(scene).footprints) == before
    assert len(prints_on(floor)) >= 4


STAIRS = {"Field": 0.0, "Stair 1": 0.1, "Stair 2": 0.2}


def stairs(scene):
    """A floor and two broad stairs, each an object of its own, up which the walk is keyed."""
    rig = shots.walker(scene, frames=84)
    bpy.ops.softground.add_character()
    options = scene.softground
    options.ground, options.cell_size = plane(scene, size=9.0, vertices=200), 0.02
    options.debris = options.marks = False
    for number, (low, high) in enumerate(((-2.2, -1.0), (-4.0, -2.2)), 1):
        box(scene, f"Stair {number}", 0.1 * number, y=(low, high))
        lift(rig, 0.1, low=-9.0, high=high)
    bpy.context.view_layer.update()


@pytest.mark.slow
def test_feet_stand_on_crates_within_a_millimetre_after_clean_feet_and_sink_feet(crate):
    scene = bpy.context.scene
    also(crate)
    cleaned = jobs.run(clean_feet.clean_feet(scene))
    assert cleaned.feet["after"]["Walker"]["penetration"]["max"] < 1.0
    assert cleaned.feet["after"]["Walker"]["float"]["max"] < 1.0
    scene.softground.sink_feet, scene.softground.carve = True, False
    report = bake(scene).report
    gaps = report["gaps_mm"]["after"]["Walker"]
    assert (gaps["penetration"]["max"], gaps["float"]["max"]) < (1.0, 1.0)
    assert {row["ground"] for row in report["steps"]} == {"Field", CRATE}


@pytest.mark.slow
def test_each_step_up_the_stairs_is_on_the_stair_under_it(opened_as):
    scene = opened_as(stairs)
    also(*(bpy.data.objects[name] for name in STAIRS if name != "Field"))
    result = bake(scene)
    assert {row["ground"] for row in result.report["steps"]} == set(STAIRS)
    assert all(abs(row["position"][2] - STAIRS[row["ground"]]) < 1e-3 for row in result.report["steps"])


@pytest.mark.slow
def test_clear_gives_all_grounds_back_by_bytes_or_the_one_that_is_shown(crate):
    scene = bpy.context.scene
    before = fingerprints.of_file()
    also(crate)
    bake(scene)
    assert baked_ground.is_baked(crate)
    assert bpy.ops.softground.clear_bake(only_shown=True) == {"FINISHED"}
    assert [baked_ground.is_baked(ground) for ground in settings.grounds_of(scene.softground)] == [False, True]
    bake(scene)
    bpy.ops.softground.clear_bake()
    assert fingerprints.of_file() == before


def test_clear_of_the_ground_shown_says_so_where_that_has_no_prints(crate):
    scene = bpy.context.scene
    also(crate)
    bake(scene)
    bpy.ops.softground.clear_bake(only_shown=True)
    assert "There is no bake on ground 'Field'" in refusal(lambda: bpy.ops.softground.clear_bake(only_shown=True))
    assert baked_ground.is_baked(crate)


@pytest.mark.slow
def test_the_depth_is_predicted_on_all_of_them(crate):
    scene = bpy.context.scene
    also(crate)
    analysis.read(scene)
    predicted = analysis.expected_depth(scene)
    assert predicted == pytest.approx(bake(scene).report["totals"]["typical_depth_m"], rel=0.05)


@pytest.mark.slow
def test_the_depth_is_predicted_on_the_ground_that_is_shown_in_what_that_is_made_of(crate):
    scene, options = bpy.context.scene, bpy.context.scene.softground
    item, slab = also(crate), box(scene, "Slab", 0.1, y=(3.0, 4.0))
    ground_presets.make_of(options, further_grounds.own_material(options, item), preset_files.named("soft_mud"))
    bpy.context.view_layer.update()
    bake(scene)
    typical = {ground: typical_of(prints_on(ground)) for ground in settings.grounds_of(options)}
    for _ in typical:
        analysis.read(scene)
        predicted = analysis.expected_depth(scene)
        assert predicted == pytest.approx(typical[options.ground], rel=0.05)
        further_grounds.choose(options, item)
    assert max(typical.values()) > 1.5 * min(typical.values())
    further_grounds.choose(options, also(slab))
    analysis.read(scene)
    assert analysis.expected_depth(scene) > 0, "where nobody walks on it, all contacts tell"


def test_undo_gives_all_grounds_back_by_bytes(crate):
    also(crate)
    bpy.ops.ed.undo_push(message="Opened")
    before = fingerprints.of_file()
    bpy.ops.softground.bake()
    bpy.ops.ed.undo_push(message="Bake")
    assert baked_ground.is_baked(bpy.data.objects[CRATE])
    bpy.ops.ed.undo()
    assert fingerprints.of_file() == before


def test_each_ground_goes_with_its_prints_into_another_file(crate, tmp_path):
    scene, path = bpy.context.scene, str(tmp_path / "shot.blend")
    also(crate)
    bake(scene)
    prints = bytes_of(prints_on(crate))
    name = baked_ground.display_mesh_of(crate).name
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(path) as (_, here):
        here.objects = [CRATE, name]
    for each in (CRATE, name):
        bpy.context.scene.collection.objects.link(bpy.data.objects[each])
    assert bytes_of(prints_on(bpy.data.objects[CRATE])) == prints


@pytest.mark.slow
def test_an_edit_is_of_the_ground_that_is_shown_and_stays_through_the_next_bake(crate):
    scene = bpy.context.scene
    item = also(crate)
    bake(scene)
    floor = scene.softground.ground
    on_floor = bytes_of(record_of(floor).edited)
    further_grounds.choose(scene.softground, item)
    editable = jobs.run(step_edits.reading(scene))
    step = editable.record.steps[0]
    jobs.run(step_edits.editing(editable, {step.name: StepEdit(strength=0.5)}))
    shallow = record_of(crate).edited[0].max_depth_m
    assert shallow < step.baked.max_depth_m
    assert bytes_of(record_of(floor).edited) == on_floor
    assert bake_report.stale_reasons(scene) == ()
    bake(scene)
    assert record_of(crate).edited[0].max_depth_m == shallow
    assert not record_of(floor).edits


@pytest.mark.slow
def test_steps_are_edited_as_well_once_another_ground_was_listed(crate):
    scene = bpy.context.scene
    bake(scene)
    also(crate)
    step = steps_on(scene.softground.ground)[0].name
    jobs.run(step_edits.editing(jobs.run(step_edits.reading(scene)), {step: StepEdit(strength=0.5)}))
    assert record_of(scene.softground.ground).edits == {step: StepEdit(strength=0.5)}
    assert not baked_ground.is_baked(crate)


@pytest.mark.slow
def test_what_makes_one_ground_outdated_is_said_of_each(crate):
    scene = bpy.context.scene
    item = also(crate)
    bake(scene)
    assert bake_report.stale_reasons(scene) == ()
    further_grounds.choose(scene.softground, item)
    assert bake_report.stale_reasons(scene) == (), "which is shown is no input"
    scene.softground.material.youngs_modulus *= 2
    assert bake_report.stale_reasons(scene) == ("The settings have changed",)
    further_grounds.choose(scene.softground, item)
    assert bake_report.stale_reasons(scene) == ("The settings have changed",)
    bake(scene)
    crate.location.z += 0.01
    bpy.context.view_layer.update()
    assert bake_report.stale_reasons(scene) == ("Another ground than 'Field' has changed",)
    further_grounds.choose(scene.softground, item)
    assert bake_report.stale_reasons(scene) == ("The mesh or the position of 'Crate' has changed",)


def test_a_ground_that_is_shown_brings_what_is_set_for_it_and_takes_it_back(crate):
    options = bpy.context.scene.softground
    item = also(crate)
    before = settings.snapshot(bpy.context.scene)
    further_grounds.choose(options, item)
    bpy.ops.softground.load_preset(name="Mud")
    options.under, options.painted.rim = "NEVER", "Mine"
    further_grounds.choose(options, item)
    now = settings.snapshot(bpy.context.scene)
    assert (now.ground, now.material, now.preset, now.painted) == (
        before.ground,
        before.material,
        before.preset,
        before.painted,
    )
    (other,) = now.grounds
    assert (other.preset, other.surface, other.under, other.painted[2]) == ("Mud", "mud", "NEVER", "Mine")


@pytest.mark.slow
def test_cover_adds_a_ground_and_the_first_stays(crate):
    scene = bpy.context.scene
    options, floor = scene.softground, scene.softground.ground
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    bpy.context.view_layer.objects.active = crate
    crate.select_set(True)
    assert bpy.ops.softground.cover(thickness_cm=4.0) == {"FINISHED"}
    (item,) = options.grounds
    assert (options.ground, item.object.name) == (floor, "Crate Cover")
    assert item.material.layer_depth == pytest.approx(0.04)
    assert (options.under, item.under) == ("AUTO", "NEVER")
    item.object.location.z -= 0.04  # the walk was made for the crate
    crate.location.z -= 0.04
    bpy.context.view_layer.update()
    result = bake(scene)
    assert {row["ground"] for row in result.report["steps"]} == {"Field", "Crate Cover"}
    assert all(row["max_depth_m"] <= 0.04 + 1e-6 for row in result.report["steps"] if row["ground"] != "Field")


def test_the_list_is_shown_where_there_are_several_and_its_buttons_act(crate):
    options = bpy.context.scene.softground
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    assert "Select meshes to walk on" in refusal(bpy.ops.softground.add_ground)
    crate.select_set(True)
    assert bpy.ops.softground.add_ground() == {"FINISHED"}
    assert settings.grounds_of(options) == [options.ground, crate]
    assert bpy.ops.softground.choose_ground(object=CRATE) == {"FINISHED"}
    assert options.ground == crate
    assert "no such" not in refusal(lambda: bpy.ops.softground.choose_ground(object="Nobody"))
    bpy.ops.softground.remove_ground()
    assert settings.grounds_of(options) == [crate]


def shown_on(*grounds):
    """Heights of what shows the prints of some grounds."""
    return [as_rendered(baked_ground.display_mesh_of(ground))[:, 2] for ground in grounds]


@pytest.mark.slow
def test_live_mode_presses_all_grounds_as_a_bake_does_and_takes_back_what_it_pressed(crate):
    scene = bpy.context.scene
    item, floor = also(crate), scene.softground.ground
    ground_presets.make_of(scene.softground, further_grounds.own_material(scene.softground, item), FIRM)
    before = fingerprints.of_file()
    scene.frame_set(1)
    assert bpy.ops.softground.live() == {"FINISHED"}
    undisturbed = shown_on(floor, crate)
    seen = {}
    for frame in (84, 40, 1, 84):
        scene.frame_set(frame)
        heights = shown_on(floor, crate)
        assert all(map(np.array_equal, heights, seen.setdefault(frame, heights)))
    assert all(map(np.array_equal, seen[1], undisturbed))
    assert [np.ptp(now - then) > 0.005 for now, then in zip(seen[84], undisturbed, strict=True)] == [True, True]
    assert len(live.in_contact(scene.session_uid)[0]) > 0
    scene.frame_set(1)
    bpy.ops.softground.live()
    assert fingerprints.of_file() == before
    bake(scene)
    scene.frame_set(84)
    baked = {ground: (len(record_of(ground).footprints), low) for ground, low in lowest_steps(floor, crate)}
    bpy.ops.softground.clear_bake()
    scene.frame_set(1)
    bpy.ops.softground.live()
    scene.frame_set(84)
    bpy.ops.softground.live(keep=True)
    for ground, deepest in lowest_steps(floor, crate):
        assert (len(record_of(ground).footprints), pytest.approx(deepest, rel=1e-6)) == baked[ground]
        assert [each["ground"] for each in record_of(ground).about["inputs"]["grounds"]]
    assert bake_report.baked_grounds(scene.softground) == [floor, crate]
    assert [item.object for item in scene.softground.printed] == [floor, crate]
    bpy.ops.softground.clear_bake()
    scene.frame_set(1)
    assert fingerprints.of_file() == before


FIRM = preset_files.named("mud")


def lowest_steps(*grounds):
    return [(ground, max(step.max_depth_m for step in prints_on(ground))) for ground in grounds]


@pytest.mark.slow
def test_live_mode_presses_a_ground_again_when_its_material_changes_and_leaves_the_others(crate):
    scene = bpy.context.scene
    item, floor = also(crate), scene.softground.ground
    material = further_grounds.own_material(scene.softground, item)
    scene.frame_set(84)
    bpy.ops.softground.live()
    on_floor, on_crate = shown_on(floor, crate)
    material.youngs_modulus /= 2
    while live.is_answering():
        live.answer(0.0)
    now_on_floor, now_on_crate = shown_on(floor, crate)
    assert np.array_equal(now_on_floor, on_floor)
    assert (on_crate - now_on_crate).max() > 0.005
    assert live.is_on()
    live.discard()
    assert not baked_ground.has_remains(crate)


@pytest.mark.slow
def test_live_mode_says_why_it_does_not_follow_where_steps_come_onto_another_ground(crate):
    scene = bpy.context.scene
    slab = box(scene, "Slab", 0.05, y=(3.0, 4.0))
    bpy.context.view_layer.update()
    also(crate, slab)
    scene.frame_set(60)
    bpy.ops.softground.live()
    before = shown_on(scene.softground.ground, crate)
    slab.location.y = scene.softground.ground.location.y - 6.0
    slab.location.z = 0.01 - 0.05
    bpy.context.view_layer.update()
    while live.is_answering():
        live.answer(0.0)
    assert "Steps are on other grounds by now" in live.refusal()
    assert all(map(np.array_equal, shown_on(scene.softground.ground, crate), before))
    slab.location = (0.0, 0.0, 0.0)
    bpy.context.view_layer.update()
    while live.is_answering():
        live.answer(0.0)
    assert live.refusal() == ""
    live.discard()


def in_live_mode_over_a_slab(crate):
    """A slab at the floor's start, which is stepped on too; with the floor and a crate in live mode."""
    scene = bpy.context.scene
    slab = box(scene, "Slab", 0.004, y=(LOW - 1.2, LOW - 0.2))
    bpy.context.view_layer.update()
    also(crate, slab)
    scene.frame_set(84)
    bpy.ops.softground.live()
    return slab


def all_answered():
    while live.is_answering():
        live.answer(0.0)


@pytest.mark.slow
def test_live_mode_knows_its_grounds_when_one_is_taken_off_the_list_and_listed_again(crate):
    scene = bpy.context.scene
    floor, slab = scene.softground.ground, in_live_mode_over_a_slab(crate)
    before = shown_on(floor, crate, slab)
    scene.softground.active_ground = 0
    bpy.ops.softground.remove_ground()
    all_answered()
    assert "'Crate' is not among the grounds any more" in live.refusal()
    scene.frame_set(83)
    assert live.is_on()
    also(crate)
    scene.frame_set(84)
    bpy.context.view_layer.update()
    all_answered()
    assert live.refusal() == ""
    for now, then in zip(shown_on(floor, crate, slab), before, strict=True):
        assert now == pytest.approx(then, abs=1e-6)
    bpy.ops.softground.live(keep=True)
    assert [record_of(each).about["inputs"]["ground"] for each in (floor, crate, slab)] == ["Field", CRATE, "Slab"]
    assert len(below(prints_on(crate))) == len(prints_on(crate)) >= 2


@pytest.mark.slow
def test_live_mode_goes_on_when_another_of_its_grounds_is_shown_and_says_why_not_where_one_is_replaced(crate):
    options = bpy.context.scene.softground
    floor, slab = options.ground, in_live_mode_over_a_slab(crate)
    before = shown_on(floor, crate, slab)
    bpy.ops.softground.choose_ground(object=CRATE)
    all_answered()
    for now, then in zip(shown_on(floor, crate, slab), before, strict=True):
        assert now == pytest.approx(then, abs=1e-6)
    options.material.youngs_modulus /= 2
    assert live.is_answering()
    all_answered()
    assert live.refusal() == ""
    assert (before[1] - shown_on(crate)[0]).max() > 0.005
    options.ground = slab
    all_answered()
    assert "'Crate' is not among the grounds any more" in live.refusal()
    live.discard()
    assert not any(map(baked_ground.has_remains, (floor, crate, slab)))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Field", CRATE])
def test_live_mode_changes_none_of_its_grounds_while_one_is_in_edit_mode(crate, name):
    floor = bpy.context.scene.softground.ground
    also(crate)
    bpy.context.scene.frame_set(60)
    bpy.ops.softground.live()
    bpy.context.view_layer.objects.active = baked_ground.display_mesh_of(bpy.data.objects[name])
    bpy.ops.object.mode_set(mode="EDIT")  # which by itself changes a little in Blender 5.2
    bpy.ops.object.mode_set(mode="OBJECT")
    before = fingerprints.of_file()
    for keep in (True, False):
        bpy.ops.object.mode_set(mode="EDIT")
        assert "is in Edit Mode: leave it with Tab first" in refusal(partial(bpy.ops.softground.live, keep=keep))
        bpy.ops.object.mode_set(mode="OBJECT")
        assert fingerprints.differences(before, fingerprints.of_file()) == []
    assert live.is_on()
    bpy.ops.softground.live()
    assert not any(map(baked_ground.has_remains, (floor, crate)))
    assert len(bpy.context.scene.softground.printed) == 0


@pytest.mark.slow
def test_live_mode_notes_its_grounds_so_that_none_keeps_prints_that_nothing_clears(crate, tmp_path):
    options = bpy.context.scene.softground
    also(crate)
    bpy.context.scene.frame_set(60)
    bpy.ops.softground.live()
    assert [item.object for item in options.printed] == [options.ground, crate]
    options.printed.clear()
    bpy.ops.softground.remove_ground()
    assert bake_report.unlisted(options) == [crate]
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "live.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "live.blend"))
    bpy.ops.softground.clear_bake()
    assert bpy.ops.softground.clear_unlisted() == {"FINISHED"}
    assert not any(map(baked_ground.has_remains, bpy.data.objects))


@pytest.mark.slow
@pytest.mark.parametrize("by", ["script", "key"])
def test_live_mode_leaves_grounds_alone_that_no_step_is_on_and_ends_with_one_that_is_deleted(crate, by):
    scene = bpy.context.scene
    slab = box(scene, "Slab", 0.1, y=(3.0, 4.0))
    bpy.context.view_layer.update()
    also(crate, slab)
    scene.frame_set(60)
    bpy.ops.softground.live()
    assert [ground_mesh.is_baked(baked_ground.display_mesh_of(each)) for each in (crate, slab)] == [True, False]
    shown = baked_ground.display_mesh_of(crate)
    if by == "key":
        with bpy.context.temp_override(selected_objects=[shown]):
            bpy.ops.object.delete()
    else:
        bpy.data.objects.remove(shown)
    scene.frame_set(61)
    assert not live.is_on()
    assert live.refusal().startswith("Live mode has ended: a ground or its prints are gone")
    bpy.ops.softground.clear_bake()
    assert not baked_ground.has_remains(scene.softground.ground)


def test_live_mode_waits_until_no_ground_has_a_bake(crate):
    scene = bpy.context.scene
    also(crate)
    bake(scene)
    bpy.ops.softground.clear_bake(only_shown=True)
    assert not bpy.ops.softground.live.poll()
    with pytest.raises(InputError, match="There is a bake on 'Crate'"):
        jobs.run(live_start.starting(scene))
    assert prints_on(crate)
    bpy.ops.softground.clear_bake()
    assert bpy.ops.softground.live.poll()


def test_what_moves_or_is_no_ground_is_refused(crate):
    also(crate)
    crate.keyframe_insert("location", frame=1)
    crate.location.x = 1.0
    crate.keyframe_insert("location", frame=40)
    assert "'Crate' beside the ground moves" in refusal(bpy.ops.softground.bake)


@pytest.mark.slow
def test_the_command_line_names_several_grounds_each_with_its_preset(crate, tmp_path):
    path, report, receipt = tmp_path / "shot.blend", tmp_path / "report.json", tmp_path / "receipt.json"
    bpy.context.scene.softground.ground = None
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    chosen = ("--ground=Field=Snow", "--ground=Crate=Mud", "--response=layer")
    command_line.run("bake", path, *chosen, "--report", report, "--receipt", receipt)
    assert json.loads(receipt.read_text())["options"][:3] == list(chosen)
    result = json.loads(report.read_text())
    assert {row["ground"] for row in result["steps"]} == {"Field", CRATE}
    assert result["inputs"]["preset"] == "Snow"
    assert [ground["preset"] for ground in result["inputs"]["grounds"]] == ["Mud"]


@pytest.mark.slow
@pytest.mark.parametrize("how", ["sails", "on_a_map"])
def test_grounds_that_move_together_or_are_far_away_are_pressed_as_at_rest(crate, how):
    scene = bpy.context.scene
    also(crate)
    before = bake(scene).report["steps"]
    bpy.ops.softground.clear_bake()
    hung_up(scene)
    place = bpy.data.objects["Place"]
    if how == "sails":
        for frame, x in ((1, 0.0), (84, 8.3)):
            place.location.x = x
            place.keyframe_insert("location", index=0, frame=frame)
        for curve in curves_of(place):
            for key in curve.keyframe_points:
                key.interpolation = "LINEAR"
    else:
        moved(scene, WHERE["on_a_map"])
    scene.frame_set(1)
    now = bake(scene).report["steps"]
    assert [row["ground"] for row in now] == [row["ground"] for row in before]
    for here, there in zip(now, before, strict=True):
        assert here["max_depth_m"] == pytest.approx(there["max_depth_m"], abs=1e-5)
        assert here["compressed_m3"] == pytest.approx(there["compressed_m3"], rel=1e-3)
    assert bake_report.stale_reasons(scene) == ()
    crate.parent = None
    if how == "sails":
        assert "'Crate' beside the ground stands still while 'Place' moves" in refusal(bpy.ops.softground.bake)


def test_a_bake_that_is_closed_while_it_writes_leaves_all_grounds_as_they_were(crate):
    scene = bpy.context.scene
    also(crate)
    before = fingerprints.of_file()
    job = bake_job.bake(scene)
    for progress in job:
        if progress is READY:
            break
    next(job)
    job.close()
    assert fingerprints.of_file() == before


@pytest.mark.slow
def test_a_ground_that_no_step_is_on_any_more_is_cleared(crate):
    scene = bpy.context.scene
    also(crate)
    bake(scene)
    assert baked_ground.is_baked(crate)
    crate.location.x = 3.0
    bpy.context.view_layer.update()
    result = bake(scene)
    assert {row["ground"] for row in result.report["steps"]} == {"Field"}
    assert not baked_ground.has_remains(crate)


@pytest.mark.slow
def test_weather_is_of_each_ground(crate):
    scene = bpy.context.scene
    item = also(crate)
    bake(scene)
    floor = scene.softground.ground
    further_grounds.choose(scene.softground, item)
    bpy.ops.softground.add_weather()
    modifiers = [weather_modifier.modifier_of(baked_ground.display_mesh_of(ground)) for ground in (floor, crate)]
    assert [modifier is None for modifier in modifiers] == [True, False]
    scene.softground.steps_feel_weather = True
    now = settings.snapshot(scene)
    assert (now.weather.surface, now.grounds[0].weather.surface) == ("snow", "snow")
    assert bake(scene).report["warnings"] == []
    assert weather_modifier.modifier_of(baked_ground.display_mesh_of(crate)) is not None


@pytest.mark.slow
def test_marks_and_hard_steps_beside_several_grounds_are_there_once(crate):
    scene = bpy.context.scene
    item, floor = also(crate), scene.softground.ground
    bpy.ops.softground.load_preset(name="Mud")
    scene.softground.cell_size, scene.softground.debris, scene.softground.marks = 0.02, False, True
    scene.softground.hard_grounds.add().object = box(scene, "Slab", 0.004, y=(-4.6, -2.6), x=(-1.0, 1.0), bottom=-0.1)
    bpy.context.view_layer.update()
    report = bake(scene).report
    assert {row["ground"] for row in report["steps"]} == {"Field", CRATE}
    assert all(row["position"][1] > -2.75 for row in report["steps"])
    hard = [row for row in report["events"] if row["surface"] == "hard"]
    assert hard
    assert len({(row["frame"], row["contact"], row["phase"]) for row in hard}) == len(hard)
    assert all(row["surface"] != "hard" for row in baked_ground.events_of(item.object))
    assert len(marks_object.of(floor).data.polygons) + len(marks_object.of(crate).data.polygons) > 0
    assert report["totals"]["carried_kg"]["picked_up"] > 0


def until_written(scene):
    """A bake of two grounds that has worked all out, and has written nothing."""
    job = bake_job.bake(scene)
    ready = (progress for progress in job if progress is READY)
    assert [next(ready), next(ready)] == [READY, READY]
    return job


def edit(obj):
    for other in bpy.context.selected_objects:
        other.select_set(False)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode="EDIT")


@pytest.mark.slow
def test_no_ground_is_written_where_another_one_cannot_be(crate):
    scene = bpy.context.scene
    also(crate)
    job = until_written(scene)
    edit(crate)
    with pytest.raises(InputError, match="'Crate' is in Edit Mode"):
        jobs.run(job)
    bpy.ops.object.mode_set(mode="OBJECT")
    job = until_written(scene)
    bpy.data.objects.remove(crate)
    with pytest.raises(InputError, match="'Crate' was deleted"):
        jobs.run(job)
    assert not baked_ground.has_remains(scene.softground.ground)


def test_a_ground_that_goes_into_edit_mode_during_its_bake_is_refused_by_name(crate):
    scene = bpy.context.scene
    scene.softground.ground = plane(scene, size=9.0, vertices=4)
    bpy.context.view_layer.update()
    job = bake_job.bake(scene)
    next(progress for progress in job if progress is READY)
    edit(scene.softground.ground)
    with pytest.raises(InputError, match="is in Edit Mode"):
        jobs.run(job)


def test_clear_that_is_refused_of_one_ground_clears_none(crate):
    scene = bpy.context.scene
    also(crate)
    bake(scene)
    edit(baked_ground.display_mesh_of(crate))
    assert "Edit Mode" in refusal(bpy.ops.softground.clear_bake)
    assert all(map(baked_ground.is_baked, settings.grounds_of(scene.softground)))


def beside_a_far_field(crate):
    """A first ground that nobody walks on; the floor under the walk is hard. The crate is the other ground."""
    scene = bpy.context.scene
    options, floor = scene.softground, scene.softground.ground
    far = options.ground = plane(scene, size=9.0, vertices=4)
    far.name, far.location.y = "Far", 30.0
    also(crate)
    options.hard_grounds.add().object = floor
    options.marks = True
    bpy.context.view_layer.update()
    return scene


@pytest.mark.slow
def test_what_happens_on_hard_ground_is_with_the_first_ground_that_has_steps(crate):
    scene = beside_a_far_field(crate)
    options = scene.softground
    options.characters[0].dirty_soles = 1.0
    report = bake(scene).report
    assert {row["ground"] for row in report["steps"]} == {CRATE}
    assert "hard" in {row["surface"] for row in baked_ground.events_of(crate)}
    assert report["totals"]["carried_kg"]["brought"] > 0
    as_second = baked_ground.events_of(crate)
    further_grounds.choose(options, options.grounds[0])
    bake(scene)
    assert baked_ground.events_of(crate) == as_second


@pytest.mark.slow
def test_edits_that_have_lost_their_step_stay_beside_a_ground_without_steps(crate):
    scene = beside_a_far_field(crate)
    lost = {"Walker/foot.L@900.0": StepEdit(mute=True)}
    jobs.run(bake_job.bake(scene, edits=lost))
    assert record_of(crate).edits == lost
    bake(scene)
    assert record_of(crate).edits == lost


@pytest.mark.slow
def test_weather_stays_on_a_ground_that_no_step_is_on_for_a_while(crate):
    scene = bpy.context.scene
    item = also(crate)
    bake(scene)
    further_grounds.choose(scene.softground, item)
    bpy.ops.softground.add_weather(preset=next(reversed(ground_weather.PRESETS)))
    values = ground_weather.values_of(crate)
    end = scene.softground.frame_end
    scene.softground.frame_end = 14
    assert {row["ground"] for row in bake(scene).report["steps"]} == {"Field"}
    assert bake_report.stale_reasons(scene) == ()
    scene.softground.frame_end = end
    bake(scene)
    assert len(prints_on(crate)) >= 2
    assert ground_weather.values_of(crate) == values


def test_use_selected_of_a_further_ground_brings_what_is_set_for_it(crate):
    options, floor = bpy.context.scene.softground, bpy.context.scene.softground.ground
    item = also(crate)
    ground_presets.make_of(options, further_grounds.own_material(options, item), preset_files.named("mud"))
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    bpy.context.view_layer.objects.active = crate
    crate.select_set(True)
    assert bpy.ops.softground.use_as_ground() == {"FINISHED"}
    assert settings.listed_grounds(options) == [crate, floor]
    assert (options.material.surface, item.material.surface) == ("mud", "snow")


def test_a_ground_that_is_moved_makes_the_prediction_outdated(crate):
    scene = bpy.context.scene
    also(crate)
    slab = scene.softground.hard_grounds.add().object = box(scene, "Slab", 0.1, y=(3.0, 4.0))
    bpy.context.view_layer.update()
    for obj in (crate, slab):
        analysis.read(scene)
        assert analysis.known(settings.snapshot(scene))
        obj.location.z += 0.01
        bpy.context.view_layer.update()
        assert not analysis.known(settings.snapshot(scene))


@pytest.mark.slow
def test_a_ground_taken_out_of_the_list_is_named_where_feet_still_stand_on_it(crate):
    scene = bpy.context.scene
    also(crate)
    bake(scene)
    assert baked_ground.display_mesh_of(crate) != crate
    bpy.ops.softground.remove_ground()
    warning, note = bake(scene).report["warnings"]
    assert "Press Add 'Crate'" in warning
    assert "Add 'Crate' as Ground" in warning
    assert "'Crate' keeps the prints of an earlier bake" in note
    assert bpy.ops.softground.add_ground(object=CRATE) == {"FINISHED"}
    assert settings.grounds_of(scene.softground)[1:] == [crate]
    assert bake(scene).report["warnings"] == []


@pytest.mark.slow
def test_a_ground_that_leaves_the_list_with_its_prints_is_named_until_they_are_cleared_or_it_is_listed(crate):
    scene = bpy.context.scene
    before, options = fingerprints.of_file(), scene.softground
    also(crate)
    bake(scene)
    prints = bytes_of(prints_on(crate))
    for take_out in (bpy.ops.softground.remove_ground, options.grounds.clear):
        assert rows_about(CRATE) == []
        take_out()
        assert rows_about(CRATE) == ["softground.add_ground", "softground.clear_unlisted"]
        assert bpy.ops.softground.add_ground(object=CRATE) == {"FINISHED"}
    options.grounds.clear()
    (note,) = [row for row in bake(scene).report["self_check"] if row["code"] == "unlisted_prints"]
    assert "'Crate' keeps the prints of an earlier bake" in note["message"]
    assert bytes_of(prints_on(crate)) == prints
    assert bpy.ops.softground.clear_unlisted(object=CRATE) == {"FINISHED"}
    assert not baked_ground.has_remains(crate)
    assert baked_ground.is_baked(options.ground)
    assert rows_about(CRATE) == []
    bpy.ops.softground.clear_bake()
    assert fingerprints.of_file() == before


@pytest.mark.slow
def test_a_ground_that_others_alone_have_walked_on_is_no_finding_of_the_next_bake(crate):
    scene, options = bpy.context.scene, bpy.context.scene.softground
    bake(scene)
    first, armature = options.ground, options.characters[0].armature
    options.ground = plane(scene, size=9.0, vertices=200)
    assert codes(bake(scene)).count("unlisted_prints") == 1
    armature.name = options.characters[0].name = "Twin"  # as another of the same kind, who was not there
    assert "unlisted_prints" not in codes(bake(scene))
    assert bake_report.unlisted(options) == [first]


def test_clear_bake_is_off_where_only_grounds_that_left_the_list_have_prints(crate):
    scene = bpy.context.scene
    also(crate)
    bake(scene)
    bpy.ops.softground.remove_ground()
    assert not bpy.ops.softground.clear_unlisted.poll() or bake_report.unlisted(scene.softground) == [crate]
    assert bpy.ops.softground.clear_bake.poll()
    bpy.ops.softground.clear_bake()
    assert baked_ground.is_baked(crate)
    assert not bpy.ops.softground.clear_bake.poll()
    assert "no ground 'Nobody'" in refusal(lambda: bpy.ops.softground.clear_unlisted(object="Nobody"))
    assert bpy.ops.softground.clear_unlisted(object=CRATE) == {"FINISHED"}
    assert not baked_ground.has_remains(crate)
    assert not bpy.ops.softground.clear_unlisted.poll()


@pytest.mark.slow
@pytest.mark.parametrize("is_listed", [True, False])
def test_a_printed_ground_that_is_deleted_is_forgotten_at_once_and_undo_brings_both_back(crate, is_listed):
    scene, inner = bpy.context.scene, bpy.data.collections.new("Inner")
    scene.collection.children.link(inner)  # which is what a deletion changes, and not the scene
    inner.objects.link(crate)
    scene.collection.objects.unlink(crate)
    also(crate)
    bake(scene)
    if not is_listed:
        bpy.ops.softground.remove_ground()
    bpy.ops.ed.undo_push(message="Before")
    inner.objects.unlink(bpy.data.objects[CRATE])  # it is hidden, as its copy shows the prints
    bpy.ops.ed.undo_push(message="Delete")
    bpy.context.view_layer.update()  # after which a window calls the handlers
    assert [item.object.name for item in bpy.context.scene.softground.printed] == ["Field"]
    bpy.ops.ed.undo()
    assert [item.object.name for item in bpy.context.scene.softground.printed] == ["Field", CRATE]
    bpy.ops.ed.redo()
    assert [item.object.name for item in bpy.context.scene.softground.printed] == ["Field"]


@pytest.mark.slow
def test_a_ground_that_is_listed_again_with_an_older_bake_doubles_no_event_and_no_sound(
    crate, tmp_path, monkeypatch, capfd
):
    scene, heard = bpy.context.scene, []
    options, floor = scene.softground, scene.softground.ground
    also(crate)
    bake(scene)
    bpy.ops.softground.remove_ground()
    options.hard_grounds.add().object = crate
    report = bake(scene).report
    bpy.ops.softground.add_ground(object=CRATE)
    assert "The bake on 'Crate' is older, and left out of sound and events: bake again" in capfd.readouterr().out
    assert baked_ground.is_baked(crate)
    assert bake_report.baked_grounds(options) == [floor]
    rows = event_points.events_of(bake_report.heard_bakes(options))
    assert [(row["frame"], row["contact"], row["phase"]) for row in rows] == [
        (row["frame"], row["contact"], row["phase"]) for row in report["events"]
    ]
    further_grounds.choose(options, options.grounds[0])
    assert bake_report.baked_grounds(options) == [floor], "whichever is shown"
    monkeypatch.setattr(sound, "footsteps", lambda steps, *_: heard.extend(steps) or np.zeros((9, 1)))
    sound_exports.write(scene, tmp_path / "steps.wav", 1, 84)
    assert len({step.name for step in heard}) == len(heard)
    bake(scene)
    assert bake_report.baked_grounds(options) == [crate, floor]


@pytest.mark.slow
@pytest.mark.parametrize("again", ["bake", "live"])
def test_the_later_bake_is_heard_whatever_grounds_are_called_by_then_and_whichever_is_listed_first(crate, again):
    scene = bpy.context.scene
    options, floor = scene.softground, scene.softground.ground
    also(crate)
    bake(scene)
    further_grounds.choose(options, options.grounds[0])
    options.grounds.clear()
    floor.name, crate.name, options.cell_size = "Floor", "Box", 0.021
    if again == "live":
        bpy.ops.softground.clear_bake()
        scene.frame_set(1)
        bpy.ops.softground.live()
        scene.frame_set(84)
        bpy.ops.softground.live(keep=True)
    else:
        bake(scene)
    step = steps_on(crate)[0]
    jobs.run(step_edits.editing(jobs.run(step_edits.reading(scene)), {step.name: StepEdit(strength=0.5)}))
    also(floor)
    assert bake_report.baked_grounds(options) == [crate]
    further_grounds.choose(options, options.grounds[0])
    assert bake_report.baked_grounds(options) == [crate]


@pytest.mark.slow
def test_bakes_of_other_times_of_the_shot_are_all_heard(crate):
    scene = bpy.context.scene
    options, floor = scene.softground, scene.softground.ground
    end, options.frame_end = options.frame_end, 30
    bake(scene)
    options.ground, options.frame_start, options.frame_end = crate, 31, end
    options.hard_grounds.add().object = floor
    bake(scene)
    also(floor)
    assert set(bake_report.baked_grounds(options)) == {crate, floor}


def heard_steps(scene, folder, monkeypatch):
    """Frames at which the steps begin that are heard."""
    steps = []
    monkeypatch.setattr(sound, "footsteps", lambda heard, *_: steps.extend(heard) or np.zeros((9, 1)))
    sound_exports.write(scene, folder / "steps.wav", 1, 84)
    return sorted(step.frame for step in steps)


@pytest.mark.slow
def test_a_rig_that_was_renamed_between_two_bakes_is_heard_once(crate, tmp_path, monkeypatch):
    scene = bpy.context.scene
    options, floor = scene.softground, scene.softground.ground
    also(crate)
    bake(scene)
    options.grounds.clear()
    bpy.data.objects["Walker"].name = "Ann"
    options.hard_grounds.add().object = crate
    report = bake(scene).report
    alone = heard_steps(scene, tmp_path, monkeypatch)
    also(crate)
    assert bake_report.baked_grounds(options) == [floor]
    rows = event_points.events_of(bake_report.heard_bakes(options))
    assert [(row["frame"], row["contact"]) for row in rows] == [
        (row["frame"], row["contact"]) for row in report["events"]
    ]
    assert heard_steps(scene, tmp_path, monkeypatch) == alone


@pytest.mark.slow
def test_of_an_older_bake_all_is_heard_that_the_later_one_does_not_have(crate, tmp_path, monkeypatch):
    scene = bpy.context.scene
    options, floor = scene.softground, scene.softground.ground
    end = options.frame_end
    older = bake(scene).report["events"]
    before = heard_steps(scene, tmp_path, monkeypatch)
    options.ground, options.frame_start = crate, 40
    options.hard_grounds.add().object = floor
    later = bake(scene).report["events"]
    also(floor)
    assert bake_report.baked_grounds(options) == [crate, floor]
    rows = event_points.events_of(bake_report.heard_bakes(options))
    wanted = [row for row in older if row["frame"] < 40] + later
    assert [row["frame"] for row in rows] == sorted(row["frame"] for row in wanted)
    assert len({(row["character"], row["contact"], row["phase"], row["frame"]) for row in rows}) == len(rows)
    heard = heard_steps(scene, tmp_path, monkeypatch)
    assert [frame for frame in heard if frame < 40] == [frame for frame in before if frame < 40]
    assert end > 40


def test_events_and_sound_are_of_the_steps_on_all_grounds_and_a_mesh_says_that_it_is_one(crate, tmp_path, monkeypatch):
    scene = bpy.context.scene
    also(crate)
    report = bake(scene).report
    events, heard, messages = tmp_path / "events.jsonl", [], []
    bpy.ops.softground.export(filepath=str(events), format="EVENTS_JSON")
    rows = [json.loads(line) for line in events.read_text().splitlines()]
    rows = [row for row in rows if "step" in row]
    assert [(row["step"], row["phase"]) for row in rows] == [(row["step"], row["phase"]) for row in report["events"]]
    bpy.ops.softground.event_markers()
    assert len(scene.timeline_markers) == sum(row["phase"] in event_points.MARKED for row in rows)
    monkeypatch.setattr(sound, "footsteps", lambda steps, *_: heard.extend(steps) or np.zeros((9, 1)))
    stage.add_camera(scene, "Ear", 50.0)
    scene.camera = bpy.data.objects["Ear"]
    for stereo in (False, True):
        heard.clear()
        sound_exports.write(scene, tmp_path / "steps.wav", 1, 84, stereo=stereo)
        assert sorted(step.name for step in heard) == sorted(row["id"] for row in report["steps"])
    monkeypatch.setattr(export_formats, "translated", lambda text, **_: messages.append(text) or text)
    bpy.ops.softground.export(filepath=str(tmp_path / "field.pc2"), format="PC2")
    assert messages == ["Wrote ground '{name}' alone: show another one in the Ground panel to write that too"]


@pytest.mark.slow
def test_a_bake_again_takes_the_prints_of_all_grounds_over_until_something_acts_on_them(crate):
    scene = bpy.context.scene
    item, options = also(crate), scene.softground
    options.hard_grounds.add().object = box(scene, "Slab", 0.1, y=(3.0, 4.0))
    bpy.context.view_layer.update()

    def presses(change):
        before = state.results["prints", ""][1]
        change()
        bake(scene)
        return state.results["prints", ""][1] is not before

    def soften():
        further_grounds.own_material(options, item).youngs_modulus *= 0.5

    def shift():
        crate.location.y += 0.02
        bpy.context.view_layer.update()

    bake(scene)
    prints = [bytes_of(prints_on(ground)) for ground in settings.grounds_of(options)]
    assert not presses(lambda: setattr(options, "relief_strength", 0.5))
    assert [bytes_of(prints_on(ground)) for ground in settings.grounds_of(options)] == prints
    for change in (soften, shift, lambda: further_grounds.choose(options, item)):
        assert presses(change)
        as_it_comes = [bytes_of(prints_on(ground)) for ground in settings.grounds_of(options)]
        reuse.forget()
        bake(scene)
        assert [bytes_of(prints_on(ground)) for ground in settings.grounds_of(options)] == as_it_comes


def rows_about(name):
    """Operators that the Ground panel offers on an object of a name."""
    layout, buttons = MagicMock(), []
    layout.row.return_value = layout
    layout.operator.side_effect = lambda name, **_: buttons.append((name, button := SimpleNamespace())) or button
    panels.SOFTGROUND_PT_ground.draw(SimpleNamespace(fields=lambda: layout), bpy.context)
    return [operator for operator, button in buttons if vars(button).get("object") == name]


@pytest.mark.parametrize("is_purged", [True, False])
def test_the_next_ground_becomes_the_first_where_that_was_deleted(crate, is_purged):
    scene, options = bpy.context.scene, bpy.context.scene.softground
    slab, floor = box(scene, "Slab", 0.1, y=(3.0, 4.0)), options.ground
    bpy.context.view_layer.update()
    item = also(crate)
    also(slab)
    ground_presets.make_of(options, further_grounds.own_material(options, item), preset_files.named("mud"))
    if is_purged:
        bpy.data.objects.remove(floor)
    else:
        delete(floor)
    result = bake(scene)
    assert settings.listed_grounds(options) == [crate, slab]
    assert options.material.surface == "mud"
    assert {row["ground"] for row in result.report["steps"]} == {CRATE}


def test_a_ground_that_is_created_in_the_place_of_one_that_was_deleted_leaves_the_others_in_the_list(crate):
    options = bpy.context.scene.softground
    item = also(crate)
    ground_presets.make_of(options, further_grounds.own_material(options, item), preset_files.named("mud"))
    item.painted.rim, item.under = "Edge", "NEVER"
    delete(options.ground)
    assert bpy.ops.softground.create_ground(use_selected=False) == {"FINISHED"}
    assert settings.grounds_of(options) == [options.ground, crate]
    (item,) = options.grounds
    assert (item.material.surface, item.painted.rim, item.under) == ("mud", "Edge", "NEVER")
    assert (options.painted.rim, options.under) == ("softground_rim_factor", "AUTO")


def delete(obj):
    """As in the viewport."""
    for other in bpy.context.selected_objects:
        other.select_set(False)
    obj.select_set(True)
    bpy.ops.object.delete()
