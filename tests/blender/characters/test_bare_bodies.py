"""Bodies that no armature moves: rigid parts under an empty, shape keys and caches walk like their rigged twins."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from softground_addon.blender import settings
from softground_addon.blender.baking import bake_job, clean_feet
from softground_addon.blender.characters.character_setup import add_character
from softground_addon.blender.characters.selection import set_up_automatically
from softground_addon.blender.jobs import run
from softground_addon.blender.reading import analysis, staleness
from softground_addon.blender.sampling.body_sampling import deforms, meshes_of
from softground_addon.core.errors import InputError
from tests.blender import shots
from tests.blender.interface.test_selection import new_object, select


def robot(scene, frames=48, rest=0.0):
    """A trunk and two legs under an empty, each keyed by itself: while one leg stands, the other one swings."""
    top = new_object("Robot")
    for name, size, place in (
        ("trunk", (0.4, 0.25, 0.8), (0, 0, 1.4)),
        ("leg.L", (0.12, 0.25, 0.95), (0.12, 0, 0.475)),
        ("leg.R", (0.12, 0.25, 0.95), (-0.12, 0, 0.475)),
    ):
        bpy.ops.mesh.primitive_cube_add(size=1)
        part = bpy.context.active_object
        part.name, part.scale, part.parent = name, size, top
        for frame in range(1, frames + 1):
            turn, within = divmod(frame + (12 if name == "leg.R" else 0), 24)
            swing = max(within - 12, 0) / 12 if name != "trunk" else 0
            way = frame / 48 if name == "trunk" else (turn + swing - (0.5 if name == "leg.R" else 0)) / 2
            up = rest + 0.15 * np.sin(np.pi * swing) ** 2
            part.location = (place[0], -way, place[2] + up)
            part.keyframe_insert("location", frame=frame)
    scene.frame_end = frames
    shots.coarse(scene)
    return top


def as_shape_keys(scene, rig, frames):
    """The mesh that a rig moves, with a shape key for each frame in place of it."""
    body = next(obj for obj in scene.objects if obj.find_armature() == rig)
    poses = []
    for frame in frames:
        scene.frame_set(frame)
        evaluated = body.evaluated_get(bpy.context.evaluated_depsgraph_get())
        places = np.array([vertex.co for vertex in evaluated.data.vertices])
        matrix = np.array(evaluated.matrix_world)
        poses.append(places @ matrix[:3, :3].T + matrix[:3, 3])
    body.modifiers.clear()
    body.parent = None
    body.matrix_world.identity()
    bpy.data.objects.remove(rig)
    body.shape_key_add(name="Basis").data.foreach_set("co", poses[0].astype(np.float32).ravel())
    for frame, pose in zip(frames, poses, strict=True):
        key = body.shape_key_add(name=f"{frame}")
        key.data.foreach_set("co", pose.astype(np.float32).ravel())
        for at, value in ((frame - 1, 0), (frame, 1), (frame + 1, 0)):
            if at in frames:
                key.value = value
                key.keyframe_insert("value", frame=at)
    scene.frame_set(frames[0])
    return body


def test_rigid_parts_under_an_empty_are_one_character_with_two_feet(scene):
    top = robot(scene)
    select(top)
    bpy.ops.softground.add_character()
    (character,) = scene.softground.characters
    assert (character.name, character.armature, character.body) == ("Robot", None, top)
    assert [(sole.name, sole.kind) for sole in character.soles] == [("leg.L", "FOOT"), ("leg.R", "FOOT")]
    volume = 0.4 * 0.25 * 0.8 + 2 * 0.12 * 0.25 * 0.95
    assert character.mass == pytest.approx(1000 * volume, rel=0.05)
    (loads,) = analysis.read(scene).loads
    assert loads.contacts.touching.any(axis=0).all()
    assert loads.motion.joints  # the whole-body model takes them


def test_reading_a_body_writes_nothing_of_the_users(scene):
    top = robot(scene, frames=30)
    add_character(scene, top)
    scene.frame_set(7)

    def everything():
        objects = [
            (obj.name, tuple(map(tuple, obj.matrix_world)), obj.parent, len(obj.modifiers)) for obj in scene.objects
        ]
        counts = [len(getattr(bpy.data, kind)) for kind in ("objects", "meshes", "scenes", "actions", "collections")]
        return objects, counts, scene.frame_current

    before = everything()
    analysis.read(scene)
    assert everything() == before


def test_a_bake_is_outdated_where_a_part_moves_otherwise_or_has_another_shape(scene):
    top = robot(scene, frames=30)
    add_character(scene, top)
    before = staleness.of_movers(scene.objects, settings.snapshot(scene))
    leg = bpy.data.objects["leg.L"]
    leg.keyframe_insert("scale", frame=1)
    moved = staleness.of_movers(scene.objects, settings.snapshot(scene))
    leg.data.vertices[0].co.x += 0.01
    shaped = staleness.of_movers(scene.objects, settings.snapshot(scene))
    assert {key.split(":")[0] for key in before if before[key] != moved[key]} >= {"animation"}
    assert {key.split(":")[0] for key in moved if moved[key] != shaped[key]} == {"body"}


@pytest.mark.parametrize(
    ("change", "reason"),
    [("still", "they keep one pose"), ("floats", "none of them rests on the ground in frames 1-30")],
)
def test_parts_that_are_no_figure_are_refused_with_the_reason(scene, change, reason):
    top = robot(scene, frames=30)
    for part in top.children:
        if change == "still":
            part.animation_data_clear()
            continue
        for frame in range(1, 31):
            part.location = (part.location.x, part.location.y, 1 + frame * (0.05 if part.name == "trunk" else 0.1))
            part.keyframe_insert("location", frame=frame)
    if change == "still":
        top.location.x = 1
        top.keyframe_insert("location", frame=1)
    select(top)
    with pytest.raises(RuntimeError, match=f"'Robot' has no armature, only mesh objects.*{reason}"):
        bpy.ops.softground.add_character()
    assert not scene.softground.characters


def test_the_command_line_sets_up_the_only_body_of_a_scene_without_a_rig(scene):
    robot(scene, frames=30)
    set_up_automatically(scene)
    assert [character.name for character in scene.softground.characters] == ["Robot"]


def test_a_body_that_lost_a_part_says_what_to_do(scene):
    top = robot(scene, frames=30)
    add_character(scene, top)
    bpy.data.objects.remove(bpy.data.objects["leg.L"])
    with pytest.raises(InputError, match=r"'leg.L' of 'Robot' has no part 'leg.L'.*Add Character again"):
        analysis.read(scene)


def test_vertices_that_come_and_go_are_refused_with_the_frame(scene):
    top = robot(scene, frames=30)
    build = bpy.data.objects["trunk"].modifiers.new("Build", "BUILD")
    build.frame_start, build.frame_duration = 5, 10
    with pytest.raises(InputError, match=r"'trunk' has .* vertices at frame .*Cache it again"):
        add_character(scene, top)


@pytest.mark.slow
def test_a_body_of_shape_keys_walks_as_the_rig_that_it_came_from(scene):
    rig = shots.walker(scene, frames=60)
    add_character(scene, rig)
    scene.softground.frame_start, scene.softground.frame_end = 1, 60
    twin, mass = analysis.read(scene), scene.softground.characters[0].mass
    scene.softground.characters.clear()
    body = as_shape_keys(scene, rig, range(1, 61))
    assert deforms(body)
    assert meshes_of(body) == [body]
    select(body)
    bpy.ops.softground.add_character()
    scene.softground.frame_start, scene.softground.frame_end = 1, 60
    (character,) = scene.softground.characters
    assert character.body == body
    assert character.skin_mass == pytest.approx(mass, rel=0.05)
    character.mass = mass
    of_parts = analysis.read(scene)
    (theirs,), (ours,) = twin.loads, of_parts.loads
    assert len(ours.motion.soles) == len(theirs.motion.soles) == 2
    weight = mass * 9.81
    total = ours.forces.forces[..., 2].sum(axis=1), theirs.forces.forces[..., 2].sum(axis=1)
    assert np.abs(total[0] - total[1]).mean() < 0.02 * weight
    assert of_parts.contacts.typical == pytest.approx(twin.contacts.typical, rel=0.05)


def test_beside_a_body_without_a_rig_a_rig_responds_by_its_own_steps(scene):
    """Responses are told apart by name: the first of them is of the robot, which has no bones to key."""
    top = robot(scene)
    top.location.x = 3.0
    select(top)
    bpy.ops.softground.add_character()
    armature = shots.walker(scene, frames=48)
    select(armature)
    bpy.ops.softground.add_character()
    assert [character.armature for character in scene.softground.characters] == [None, armature]
    scene.frame_end = scene.softground.frame_end = 48
    shots.coarse(scene)
    scene.softground.sink_feet = True
    report = run(bake_job.bake(scene)).report
    gaps = report["gaps_mm"]["after"][armature.name]
    assert gaps["float"]["p95"] < 2.0 < report["gaps_mm"]["before"][armature.name]["float"]["p95"]
    assert {"foot.L", "foot.R"} <= {bone.name for bone in armature.pose.bones if len(bone.constraints)}
    scene.frame_set(24)
    lowest = min((armature.matrix_world @ armature.pose.bones[f"foot.{side}"].tail).z for side in "LR")
    for constraint in (bone.constraints[0] for bone in armature.pose.bones if len(bone.constraints)):
        constraint.mute = True
    bpy.context.view_layer.update()
    source = min((armature.matrix_world @ armature.pose.bones[f"foot.{side}"].tail).z for side in "LR")
    assert lowest < source - 0.01, "it is let down into its own prints"
    assert run(clean_feet.clean_feet(scene)).feet["after"].keys() == {armature.name}
