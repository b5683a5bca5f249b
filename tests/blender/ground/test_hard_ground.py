"""Crates, stairs and floors beside the one soft ground: feet stand on them, and leave no print below."""

from types import SimpleNamespace
from unittest.mock import MagicMock

import bpy
import mathutils
import numpy as np
import pytest

from softground_addon.blender import jobs, settings
from softground_addon.blender.baking import bake_job, bake_report, clean_feet
from softground_addon.blender.operators import bake_result
from softground_addon.blender.reading.shots import read_shot, settings_of
from softground_addon.core.composers.responses import standing_on
from softground_addon.core.composers.shot_loads import loads_of_shot
from softground_addon.core.loads.raised_rests import stands_on_hard
from softground_addon.core.record import record
from tests.blender import shots
from tests.blender.grounds import bake, plane, refusal

LOW, HIGH = -2.2, -1.0
"""The crate along the walk [m]."""


def box(scene, name, height, y=(LOW, HIGH), x=(-0.5, 0.5), bottom=0.0):
    corners = [(a, b, c) for c in (bottom, height) for a, b in ((x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1]))]
    faces = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    obj = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(obj)
    return obj


def curves_of(rig):
    action = rig.animation_data.action
    if hasattr(action, "fcurves"):
        return list(action.fcurves)
    return [
        curve for layer in action.layers for strip in layer.strips for bag in strip.channelbags for curve in bag.fcurves
    ]


def lift(rig, height, low=LOW, high=HIGH, ramp=0.3):
    """Raise the hips over a part of the way, smoothly [m]."""
    bone = rig.data.bones["hips"]
    to_bone = bone.matrix_local.to_3x3().inverted()
    location = {
        curve.array_index: curve for curve in curves_of(rig) if curve.data_path == 'pose.bones["hips"].location'
    }
    up = to_bone @ mathutils.Vector((0, 0, height))
    back = bone.matrix_local.to_3x3()
    for number in range(len(location[0].keyframe_points)):
        keys = [location[axis].keyframe_points[number] for axis in range(3)]
        y = (back @ mathutils.Vector([key.co.y for key in keys])).y + bone.head_local.y
        t = np.clip((high + ramp - y) / ramp, 0, 1) * np.clip((y - low + ramp) / ramp, 0, 1)
        for axis, key in enumerate(keys):
            key.co.y += up[axis] * t * t * (3 - 2 * t)
    for curve in location.values():
        curve.update()


def over_a_crate(scene, height):
    """A walk that is keyed over a crate on a floor, which is the ground."""
    rig = shots.walker(scene, frames=84)
    bpy.ops.softground.add_character()
    options = scene.softground
    options.ground, options.cell_size, options.detail = plane(scene, size=9.0, vertices=200), 0.02, "NEVER"
    box(scene, "Crate", height)
    lift(rig, height)
    bpy.context.view_layer.update()


@pytest.fixture
def crate(opened_as):
    opened_as(over_a_crate, 0.2)
    return bpy.data.objects["Crate"]


def listed(*objects):
    for obj in objects:
        bpy.context.scene.softground.hard_grounds.add().object = obj


def below(footprints):
    return [step for step in footprints if LOW < step.position[1] < HIGH]


def bytes_of(footprints):
    return record.dump(record.BakeRecord(list(footprints), {}))


SLOW = pytest.mark.slow


@pytest.mark.slow
@pytest.mark.parametrize("height", [pytest.param(0.1, marks=SLOW), 0.2, pytest.param(0.5, marks=SLOW)])
def test_a_crate_that_is_not_listed_is_named_and_nothing_prints_below_it(opened_as, height):
    scene = opened_as(over_a_crate, height)
    result = bake(scene)
    assert result.footprints
    assert not below(result.footprints)
    (warning,) = [text for text in result.report["warnings"] if "Crate" in text]
    assert "Press Add 'Crate'" in warning
    assert len(result.report["warnings"]) == 1
    listed(bpy.data.objects["Crate"])
    again = bake(scene)
    assert again.report["warnings"] == []
    assert bytes_of(again.footprints) == bytes_of(result.footprints)


@pytest.mark.slow
def test_the_warning_has_a_button_that_adds_the_crate_and_the_bake_notices_when_it_moves(crate):
    scene = bpy.context.scene
    warnings, drawn = bake(scene).report["warnings"], []
    layout = MagicMock()
    layout.operator.side_effect = lambda name, **how: drawn.append((name, button := SimpleNamespace(**how))) or button
    bake_result.draw_remedies(layout, scene.softground, warnings)
    (name, button), (other_name, other) = drawn
    assert (name, button.text, button.object) == ("softground.add_hard_ground", "Add 'Crate'", "Crate")
    assert (other_name, other.text, other.object) == ("softground.add_ground", "Add 'Crate' as Ground", "Crate")
    bpy.ops.softground.add_hard_ground(object=button.object)
    assert settings.hard_grounds_of(scene.softground) == [crate]
    drawn.clear()
    bake_result.draw_remedies(layout, scene.softground, warnings)
    assert not drawn
    assert bake_report.stale_reasons(scene) == ("The settings have changed",)
    bake(scene)
    crate.name = "Box"
    assert bake_report.stale_reasons(scene) == ()
    crate.location.z += 0.05
    bpy.context.view_layer.update()
    assert bake_report.stale_reasons(scene) == ("The mesh or the position of 'Box', which is hard ground, has changed",)


@pytest.mark.slow
def test_what_is_out_of_reach_changes_nothing_bit_for_bit(walk):
    scene = bpy.context.scene
    scene.softground.ground, scene.softground.cell_size = plane(scene, size=9.0, vertices=200), 0.02
    scene.softground.detail = "NEVER"
    before = bytes_of(bake(scene).footprints)
    deck, aside = box(scene, "Deck", 2.2, y=(-9, 9), bottom=2.0), box(scene, "Aside", 0.3, x=(1.5, 2.0), y=(-9, 9))
    bpy.context.view_layer.update()
    assert bytes_of(bake(scene).footprints) == before
    listed(deck, aside)
    result = bake(scene)
    assert bytes_of(result.footprints) == before
    assert result.report["warnings"] == []


@pytest.mark.slow
def test_feet_on_a_crate_are_within_a_millimetre_of_it_after_clean_feet_and_sink_feet(crate):
    scene = bpy.context.scene
    listed(crate)
    for obj in [*scene.objects]:
        obj.select_set(False)
    cleaned = jobs.run(clean_feet.clean_feet(scene))
    assert all(
        kind["max"] < 1.0 for name in ("float", "penetration") for kind in [cleaned.feet["after"]["Walker"][name]]
    )
    scene.softground.sink_feet = True
    wanted = settings_of(scene, grounded=True)
    shot = jobs.run(read_shot(wanted))
    (motion,) = standing_on(shot.motions, shot.terrain, wanted.response)
    assert stands_on_hard(shot.motions[0], shot.terrain)
    assert motion is shot.motions[0]
    contacts = loads_of_shot(wanted, [motion], shot.terrain)[0].contacts
    assert contacts.hard.any()
    result = bake(scene)
    assert result.report["gaps_mm"]["after"]["Walker"]["float"]["max"] < 1.0
    assert result.report["gaps_mm"]["after"]["Walker"]["penetration"]["max"] < 1.0
    assert not below(result.footprints)


@pytest.mark.slow
def test_a_walk_made_for_the_level_is_lifted_onto_a_listed_crate(walk):
    scene = bpy.context.scene
    scene.softground.ground, scene.softground.cell_size = plane(scene, size=9.0, vertices=200), 0.02
    scene.softground.detail, scene.softground.sink_feet = "NEVER", True
    listed(box(scene, "Crate", 0.15))
    bpy.context.view_layer.update()
    result = bake(scene)
    assert not below(result.footprints)
    assert result.report["warnings"] == []
    assert result.report["gaps_mm"]["after"]["Walker"]["penetration"]["max"] < 1.0


@pytest.mark.slow
def test_what_is_hidden_or_moves_is_not_found_and_a_listed_mover_is_refused_by_name(crate):
    scene = bpy.context.scene
    crate.hide_render = True
    assert not any("Crate" in text for text in bake(scene).report["warnings"])
    crate.hide_render = False
    for frame, x in ((1, 0.0), (80, 0.01)):
        crate.location.x = x
        crate.keyframe_insert("location", frame=frame)
    assert not any("Crate" in text for text in bake(scene).report["warnings"])
    said = refusal(lambda: bpy.ops.softground.add_hard_ground(object="Crate"))
    assert "'Crate'" in said
    assert "moves" in said
    listed(crate)
    assert "'Crate'" in refusal(bpy.ops.softground.bake)


def test_a_listed_object_is_as_it_was_after_bake_and_clear(crate):
    scene = bpy.context.scene
    listed(crate)

    def state():
        points = np.empty(len(crate.data.vertices) * 3, dtype=np.float32)
        crate.data.vertices.foreach_get("co", points)
        return (
            points.tobytes(),
            [a.name for a in crate.data.attributes],
            [m.name for m in crate.modifiers],
            list(crate.keys()),
        )

    before = state()
    bake(scene)
    bpy.ops.softground.clear_bake()
    assert state() == before


def test_a_ground_that_is_made_for_the_walk_has_hard_objects_on_it_too(crate):
    scene = bpy.context.scene
    scene.softground.ground = None
    listed(crate)
    counts = [len(jobs.run(bake_job.bake(scene, write=False)).footprints) for _ in range(2)]
    assert counts[0] == counts[1] > 0


def test_a_deleted_object_is_forgotten_and_removed_from_the_list(crate):
    scene = bpy.context.scene
    listed(crate)
    bpy.data.objects.remove(crate)
    assert settings.hard_grounds_of(scene.softground) == []
    bake(scene)
    assert bpy.ops.softground.remove_hard_ground() == {"FINISHED"}
    assert not scene.softground.hard_grounds
    assert "Select meshes" in refusal(bpy.ops.softground.add_hard_ground)


@pytest.mark.slow
def test_a_listed_floor_bears_beyond_the_edge_of_the_soft_ground(crate):
    scene = bpy.context.scene
    bpy.data.objects.remove(crate)
    over = box(scene, "Road", 0.0, y=(-9, HIGH), bottom=-0.1)
    floor = scene.softground.ground
    floor.location.y = 4.5 + HIGH
    rig = scene.softground.characters[0].armature
    lift(rig, -0.2)
    bpy.context.view_layer.update()
    assert any("meet no ground" in text for text in bake(scene).report["warnings"])
    listed(over)
    result = bake(scene)
    assert not any("meet" in text for text in result.report["warnings"])
    assert result.footprints
    assert not below(result.footprints)
