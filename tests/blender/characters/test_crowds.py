"""Crowds: figures that do the same elsewhere are recognised as each of them alone would be, and only once."""

from dataclasses import replace

import bpy
import numpy as np
import pytest

from softground_addon.blender import jobs, reuse, settings
from softground_addon.blender.characters import recognition
from softground_addon.blender.characters.selection import chosen, walkers_of
from softground_addon.blender.compat import action_curves
from softground_addon.blender.placement import beside
from softground_addon.blender.reading import staleness
from softground_addon.blender.sampling.skin_sampling import read_skin
from softground_addon.core.files.report import hash_inputs
from tests.blender import shots
from tests.blender.characters.test_recognition import FRAMES, stool

PLACES = [(0.0, 0.0, 0.0, 0.0), (3.1, -2.7, 0.0, 0.4), (-41.3, 17.9, 1.3, -2.9)]
"""Position [m] and heading [rad]."""


def select(scene, rigs):
    bpy.context.view_layer.update()
    for thing in scene.objects:
        thing.select_set(thing in rigs)
    bpy.context.view_layer.objects.active = rigs[0]


def set_up_of(character):
    soles = [(sole.name, sole.bone, sole.kind, *(part.name for part in sole.parts)) for sole in character.soles]
    joints = [(joint.name, joint.bone, joint.end) for joint in character.joints]
    return soles, joints, character.skin_mass, character.mass, pytest.approx(character.sole_length, rel=1e-6)


def added(scene, rigs):
    """What Add Character sets up for rigs."""
    scene.softground.characters.clear()
    select(scene, rigs)
    bpy.ops.softground.add_character()
    return [set_up_of(character) for character in scene.softground.characters]


@pytest.fixture
def looked_at(monkeypatch):
    """The skins that were looked at."""
    reuse.forget()
    skins, shown = [], recognition._shown

    def noted(bones, skin, *rest):
        def work():
            skins.append(skin)
            return (yield from shown(bones, skin, *rest))

        return work()

    monkeypatch.setattr(recognition, "_shown", noted)
    return skins


def crowd():
    return shots.copies(stool(), PLACES)


def under_empties(rigs):
    """The same, each below an object that says where it is."""
    for rig in rigs:
        empty = bpy.data.objects.new("Place", None)
        bpy.context.scene.collection.objects.link(empty)
        empty.matrix_basis, rig.matrix_basis = rig.matrix_basis.copy(), empty.matrix_basis.copy()
        rig.parent = empty


@pytest.mark.parametrize("parented", [False, True])
def test_figures_that_do_the_same_elsewhere_are_looked_at_once(scene, looked_at, parented):
    rigs = crowd()
    if parented:
        under_empties(rigs)
    together = added(scene, rigs)
    assert len(looked_at) == 1
    alone = []
    for rig in rigs:
        reuse.forget()
        alone += added(scene, [rig])
    assert len(looked_at) == 1 + len(rigs)
    assert together == alone


def its_mesh(rig):
    part = rig.children[0]
    part.data = part.data.copy()
    part.data.vertices[0].co.z += 0.01


def its_action(rig):
    rig.animation_data.action = rig.animation_data.action.copy()
    curve = next(
        each for each in action_curves(rig.animation_data.action) if np.ptp([k.co[1] for k in each.keyframe_points])
    )
    curve.keyframe_points[3].co.y += 0.01


def its_scale(rig):
    rig.scale = 1.1, 1.1, 1.1


def its_rest_pose(rig):
    parts = rig.children
    rig.data = rig.data.copy()
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    rig.data.edit_bones["Pm"].tail.z += 0.1
    bpy.ops.object.mode_set(mode="OBJECT")
    assert rig.children == parts


def its_weights(rig):
    part = rig.children[0]
    part.data = part.data.copy()
    part.vertex_groups.new(name="Root").add([0], 0.5, "REPLACE")


def its_path(rig):
    rig.keyframe_insert("location", frame=1)
    rig.location.x += 2.0
    rig.keyframe_insert("location", frame=FRAMES)


@pytest.mark.parametrize("change", [its_mesh, its_action, its_scale, its_rest_pose, its_weights, its_path])
def test_a_figure_that_differs_is_looked_at_by_itself(scene, looked_at, change):
    rigs = crowd()
    for rig in rigs:
        rig.animation_data.action = rigs[0].animation_data.action.copy()  # so that a path is one's own
    change(rigs[1])
    added(scene, rigs)
    assert len(looked_at) == 2


def test_the_parts_of_a_figure_lie_in_it_as_they_do_wherever_it_is(scene):
    rigs = crowd()
    bpy.context.view_layer.update()
    first, *others = [[beside(part, rig) for part in rig.children] for rig in rigs]
    assert all(np.array_equal(first, other) for other in others)
    part = rigs[0].children[0]
    exact = np.linalg.inv(rigs[0].matrix_world) @ np.array(part.matrix_world)
    np.testing.assert_allclose(beside(part, rigs[0]), exact, atol=1e-6)


def test_all_of_a_crowd_are_chosen(scene):
    rigs = crowd()
    select(scene, rigs)
    assert chosen(scene, rigs[0], rigs)[0] == walkers_of(scene.objects) == rigs


def test_a_recording_says_where_a_figure_goes_from_its_own_start(scene):
    rigs = crowd()
    bpy.context.view_layer.update()
    recordings = [jobs.run(recognition.recognise(scene, rig, (1, FRAMES))).recording for rig in rigs]
    for recording in recordings:
        assert recording.frames[0] == 0.0
        np.testing.assert_array_equal(recording.world, recordings[0].world)


def test_skins_with_the_weights_of_a_mesh_that_was_read_before_are_those_read_by_themselves(scene):
    rigs = crowd()
    part = rigs[2].children[0]
    part.data = part.data.copy()
    part.vertex_groups[0].add([0, 3], 0.25, "REPLACE")
    bpy.context.view_layer.update()
    weights = {}
    for rig in rigs:
        skin, alone = read_skin(scene.objects, rig, weights), read_skin(scene.objects, rig)
        assert hash_inputs(skin) == hash_inputs(alone)
    assert part.data.name_full not in weights
    assert len(weights) == len(rigs[0].children)


def test_the_inputs_of_a_crowd_are_hashed_as_those_of_each_figure_alone(scene):
    rigs = crowd()
    for part in rigs[1].children:
        part.data = part.data.copy()
        part.vertex_groups[0].add([0, 3], 0.25, "REPLACE")
    its_action(rigs[2])
    added(scene, rigs)
    wanted = settings.snapshot(scene)
    together, alone = staleness.of_movers(scene.objects, wanted), {}
    for character in wanted.characters:
        alone |= staleness.of_movers(scene.objects, replace(wanted, characters=(character,)))
    assert together == alone
    keys, bodies = ([together[f"{kind}:{rig.name}"] for rig in rigs] for kind in (staleness.ANIMATION, staleness.BODY))
    assert keys[0] == keys[1] != keys[2]
    assert bodies[0] == bodies[2] != bodies[1]
