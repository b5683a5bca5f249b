"""Contacts that the skin of a rig shows, whatever its bones are called and however they hang together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import bpy
import numpy as np
import pytest

from softground_addon.blender import jobs
from softground_addon.blender.characters import character_setup
from softground_addon.blender.characters.character_setup import add_character
from softground_addon.blender.characters.recognition import recognise
from softground_addon.blender.rigs.rig_mapping import map_rig
from softground_addon.blender.sampling.rig_sampling import sample_character
from softground_addon.blender.sampling.take import Take
from tests.blender import grounds, rigs
from tests.blender.responders import mapping_of

FRAMES = 60
LEGS = {"Qx": (0.0, 0.4), "Zk": (-0.35, -0.2), "Vn": (0.35, -0.2)}
"""Three feet that are children of the root: names and rest pose say nothing of feet, and no two are mirror images."""


def box(name: str, size: float, place: tuple[float, float, float], armature: bpy.types.Object, bone: str) -> None:
    """A cube that hangs on a bone."""
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * size / 2 + place
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners.tolist(), [], faces)
    thing = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(thing)
    thing.modifiers.new("Armature", "ARMATURE").object = armature
    thing.parent = armature
    thing.vertex_groups.new(name=bone).add(range(8), 1.0, "REPLACE")


def stool(hands: Mapping[str, bool] = MappingProxyType({})) -> bpy.types.Object:
    """A stool of 1 m that walks on its three legs, its feet 10 cm wide and 6 cm above their bones' origin.

    Its hands, right and left, touch the ground for five frames where they are said to.
    """
    bones = {"Root": ((0, 0, 0), (0, 0, 0.1)), "Pm": ((0, 0, 0.9), (0, 0, 1.0))}
    bones |= {name: ((x, y, 0.05), (x, y, 0.051)) for name, (x, y) in LEGS.items()}
    bones |= {name: ((x, 0.3, 0.5), (x, 0.3, 0.501)) for name, x in zip(hands, (-0.5, 0.5), strict=False)}
    armature = rigs.build("Stool", bones, dict.fromkeys(("Pm", *LEGS, *hands), "Root"))
    for (name, dips), x in zip(hands.items(), (-0.5, 0.5), strict=False):
        box(f"{name} hand", 0.1, (x, 0.3, 0.5), armature, name)
        heights = {frame: -0.39 * (dips and 3 <= frame <= 7) for frame in range(1, FRAMES + 1)}
        rigs.key(armature, "location", {frame: (0, height, 0) for frame, height in heights.items()}, bone=name)
    for name, (x, y) in LEGS.items():
        box(f"{name} foot", 0.1, (x, y, 0.11), armature, name)
    box("seat", 0.3, (0, 0, 0.95), armature, "Pm")
    for number, name in enumerate(LEGS):
        values = {}
        for frame in range(1, FRAMES + 1):
            cycles, phase = divmod((frame - 1) / 30 + number / 3 + 0.5, 1.0)
            swing = max(0.0, phase - 0.6) / 0.4
            ahead = 0.5 * (cycles + swing - np.sin(2 * np.pi * swing) / (2 * np.pi))
            # The bones point up: their y is the world's z, their z the world's -y.
            values[frame] = (0.0, 0.15 * np.sin(np.pi * swing), ahead)
        rigs.key(armature, "location", values, bone=name)
    seat = {frame: (0.0, 0.0, 0.5 * (frame - 1) / 30) for frame in range(1, FRAMES + 1)}
    rigs.key(armature, "location", seat, bone="Pm")
    return armature


def test_feet_that_nothing_names_are_found_by_their_skin(scene):
    character = add_character(scene, stool())
    assert {sole.bone for sole in character.soles} == set(LEGS)
    assert all(sole.kind == "FOOT" and sole.parts.keys() == [sole.bone] for sole in character.soles)


def test_the_ground_is_where_the_skin_rests_and_each_foot_bears_as_it_stands(scene):
    armature = stool()
    character = add_character(scene, armature)
    take = Take.about(armature, scene, range(1, FRAMES + 1))
    reading = sample_character(take, armature, mapping_of(character), mass=10.0)
    motion = jobs.run(jobs.counted(reading, "sample", FRAMES))
    assert motion.ground_level == pytest.approx(0.06, abs=1e-3)
    for sole in motion.soles:
        number = list(LEGS).index(sole.sole.name)
        stands = ((np.arange(FRAMES) / 30 + number / 3 + 0.5) % 1.0) < 0.6
        assert (sole.bears == stands).mean() > 0.9
        low = sole.landmark_positions()[sole.bears][..., 2].min(axis=1)
        assert low == pytest.approx(0.06, abs=0.02)


def test_what_a_hand_carries_is_no_part_of_the_body(scene):
    armature = stool()
    corners = [(0, 0, -1.2), (0.1, 0, -1.2), (0, 0.1, -1.2), (0, 0, -0.1)]
    mesh = bpy.data.meshes.new("Sword")
    mesh.from_pydata(corners, [], [(0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3)])
    sword = bpy.data.objects.new("Sword", mesh)
    scene.collection.objects.link(sword)
    with bpy.context.temp_override(active_object=armature, object=armature):
        bpy.context.view_layer.objects.active = armature
        bpy.ops.object.mode_set(mode="EDIT")
        slot = armature.data.edit_bones.new("Slot")
        slot.head, slot.tail, slot.parent = (0, 0, 1.0), (0, 0, 1.1), armature.data.edit_bones["Pm"]
        bpy.ops.object.mode_set(mode="OBJECT")
    sword.parent, sword.parent_type, sword.parent_bone = armature, "BONE", "Slot"
    character = add_character(scene, armature)
    assert {sole.bone for sole in character.soles} == set(LEGS)


@pytest.mark.parametrize("together", [False, True])
def test_a_hand_that_touches_for_a_moment_is_a_contact_where_the_other_one_touches_too(scene, together):
    armature = stool({"Hr": True, "Hl": together})
    mapping = jobs.run(recognise(scene, armature, (1, 10))).mapping
    assert {sole.bone for sole in mapping.soles} - set(LEGS) == ({"Hr", "Hl"} if together else set())


@pytest.mark.parametrize("walks_on_feet", [True, False])
def test_legs_that_the_rest_pose_tells_are_none_where_the_character_bears_on_other_parts(scene, walks_on_feet):
    """Feet that hang on the root, as those of baked IK do, are not those at the ends of the rest pose's legs."""
    bones, parents = dict(rigs.TRUNK), {part: above for part, above in rigs.PARENTS.items() if part in rigs.TRUNK}
    for side, place in (("x", 1), ("y", -1)):
        limbs = {part: np.multiply(ends, (place, 1, 1)) for part, ends in rigs.LIMBS.items()}
        bones |= {f"{part}{side}": ends for part, ends in limbs.items()}
        parents |= {
            f"{part}{side}": rigs.PARENTS[part] + (side if rigs.PARENTS[part] in rigs.LIMBS else "") for part in limbs
        }
        bones[f"paw{side}"] = ((0.1 * place, 0.3, 0.02), (0.1 * place, 0.3, 0.03))
    numbers = {part: f"Bone.{number:03d}" for number, part in enumerate(bones)}
    armature = rigs.build(
        "Beast",
        {numbers[part]: ends for part, ends in bones.items()},
        {numbers[part]: numbers[above] for part, above in parents.items()},
    )
    assert map_rig(armature).method == "rest pose"
    feet = {numbers[f"{'foot' if walks_on_feet else 'paw'}{side}"] for side in "xy"}
    box("trunk", 0.3, (0, 0, 1.2), armature, numbers["chest"])
    for number, bone in enumerate(sorted(feet)):
        x, y, _ = armature.data.bones[bone].head_local
        box(f"sole {number}", 0.1, (x, y, 0.05), armature, bone)
        rigs.key(armature, "location", {1: (0, 0, 0), 20: (0, 0, 0), 30: (0, 0.0, 0.1)}, bone=bone)
    mapping = jobs.run(recognise(scene, armature, (1, 40))).mapping
    assert {(sole.bone, sole.limb) for sole in mapping.soles} == {(bone, False) for bone in feet}
    assert ("ankle_l" in mapping.joints) == walks_on_feet


def test_skin_that_no_bone_moves_is_no_contact(scene):
    armature = stool()
    box("runner", 0.1, (0, 0.2, 0.11), armature, "Pm")
    bpy.data.objects["runner"].vertex_groups.clear()
    character = add_character(scene, armature)
    assert {sole.bone for sole in character.soles} == set(LEGS)


@pytest.mark.parametrize(("last", "prints"), [(96, {"foot.L", "foot.R"}), (12, {"foot.L", "foot.R", "Root"})])
def test_a_floor_that_the_body_leaves_behind_is_none_of_it(addon, scene, last, prints):
    bpy.ops.softground.add_sample_scene()
    armature = bpy.context.view_layer.objects.active
    bpy.ops.object.mode_set(mode="EDIT")
    armature.data.edit_bones.new("Root").tail = (0, 0.2, 0)
    bpy.ops.object.mode_set(mode="OBJECT")
    box("floor", 1.0, (0, 0, -0.5), armature, "Root")
    mapping = jobs.run(recognise(scene, armature, (1, last))).mapping
    assert {sole.bone for sole in mapping.soles} == prints
    assert mapping.mass == pytest.approx(78.0 if last == 96 else 1078.0, rel=0.05)


def test_a_fingertip_on_the_ground_does_not_size_the_cells(scene):
    armature = stool()
    box("tip", 0.004, (0, 0.1, 0.062), armature, "Root")
    rigs.key(armature, "location", {1: (0, 0, 0), FRAMES: (0.002, 0, 0)}, bone="Root")
    character = add_character(scene, armature)
    assert "Root" in {sole.bone for sole in character.soles}
    assert 0.02 < character.sole_length < 0.05
    assert scene.softground.cell_size > 0.02 / scene.softground.cells_along_sole


def test_the_tail_of_a_giant_asks_for_no_finer_cells_than_its_feet(scene, monkeypatch):
    """A tail prints with a part of itself, whose length nothing tells; feet of metres tell what shows the giant."""
    armature = stool()
    box("tail", 0.03, (0, 0.1, 0.075), armature, "Root")
    rigs.key(armature, "location", {1: (0, 0, 0), FRAMES: (0.002, 0, 0)}, bone="Root")

    def with_a_limb(*shot):
        recognised = yield from recognise(*shot)
        soles = tuple(replace(sole, limb=sole.bone == "Root") for sole in recognised.mapping.soles)
        return replace(recognised, mapping=replace(recognised.mapping, soles=soles))

    monkeypatch.setattr(character_setup, "recognise", with_a_limb)
    small = add_character(scene, armature).sole_length
    scene.softground.characters.clear()
    armature.scale = (50.0,) * 3
    assert add_character(scene, armature).sole_length == pytest.approx(50 * small, rel=0.02)


def test_a_limb_lies_where_its_skin_does_though_other_bones_bend_it(scene):
    ends = {"Root": ((0, 0, 0), (0, 0, 0.1)), "Hip": ((0, 0, 1), (0, 0, 1.1)), "Back": ((0, 0, 1), (0, 0, 1.1))}
    armature = rigs.build("Sleeper", ends, {"Hip": "Root", "Back": "Root"})
    box("body", 0.5, (0, 0, 1), armature, "Hip")
    body = bpy.data.objects["body"]
    body.vertex_groups["Hip"].add(range(8), 0.6, "REPLACE")
    body.vertex_groups.new(name="Back").add(range(8), 0.4, "REPLACE")
    down = {frame: min(frame / 15, 1.0) for frame in range(1, FRAMES + 1)}
    rigs.key(armature, "location", {frame: (0, -0.4 * part, 0) for frame, part in down.items()}, bone="Hip")
    rigs.key(armature, "location", {frame: (0, -0.9 * part, 0) for frame, part in down.items()}, bone="Back")
    character = add_character(scene, armature)
    (sole,) = character.soles
    sole.kind = "LIMB"
    take = Take.about(armature, scene, range(1, FRAMES + 1))
    reading = sample_character(take, armature, mapping_of(character), mass=10.0)
    motion = jobs.run(jobs.counted(reading, "sample", FRAMES))
    (limb,) = motion.soles
    assert motion.ground_level == pytest.approx(0.75 - 0.6 * 0.4 - 0.4 * 0.9, abs=2e-3)
    assert limb.bears[20:].all()
    assert limb.lowest()[20:] == pytest.approx(motion.ground_level, abs=2e-3)


def climber(riser: float) -> bpy.types.Object:
    """A body of 1 m on two feet that nothing names; each lands 0.3 m before the other one and a riser higher."""
    feet = {"Qx": -0.15, "Zk": 0.15}
    bones = {"Root": ((0, 0, 0), (0, 0, 0.1)), "Pm": ((0, 0, 0.9), (0, 0, 1.0))}
    bones |= {name: ((x, 0, 0.05), (x, 0, 0.051)) for name, x in feet.items()}
    armature = rigs.build("Climber", bones, dict.fromkeys(("Pm", *feet), "Root"))
    box("seat", 0.3, (0, 0, 0.95), armature, "Pm")
    time = np.arange(90) / 30
    for number, (name, x) in enumerate(feet.items()):
        box(f"{name} foot", 0.1, (x, 0, 0.11), armature, name)
        cycles, phase = np.divmod(time + number / 2, 1.0)
        swing = np.clip((phase - 0.6) / 0.4, 0, None)
        ahead = 0.6 * (cycles + swing - np.sin(2 * np.pi * swing) / (2 * np.pi)) - 0.3 * number
        up = cycles + np.clip(2 * swing - (riser < 0), 0, 1)
        height = 0.08 * np.sin(np.pi * swing) + riser * (2 * up - number)
        path = np.stack([0 * time, height, ahead], axis=-1)
        rigs.key(armature, "location", {frame + 1: value for frame, value in enumerate(path.tolist())}, bone=name)
    seat = np.stack([0 * time, 2 * riser * time, 0.6 * time], axis=-1)
    rigs.key(armature, "location", {frame + 1: value for frame, value in enumerate(seat.tolist())}, bone="Pm")
    return armature


@pytest.mark.slow
@pytest.mark.parametrize("riser", [0.17, -0.17])
def test_both_feet_print_on_stairs_though_they_never_stand_on_the_same_step(scene, riser):
    scene.render.fps = 30
    character = add_character(scene, climber(riser))
    assert {sole.bone for sole in character.soles} == {"Qx", "Zk"}
    stairs = grounds.plane(scene, height=lambda x, y: 0.06 + riser * np.round(-y / 0.3))
    scene.softground.ground = stairs
    bpy.context.view_layer.update()
    steps = grounds.bake(scene, cell_size=0.02).report["steps"]
    stood = {(step["contact"], round(-step["position"][1] / 0.3)) for step in steps}
    assert stood >= {("Qx", 0), ("Zk", 1), ("Qx", 2), ("Zk", 3), ("Qx", 4), ("Zk", 5)}
    for step in steps:
        assert step["position"][2] == pytest.approx(0.06 + riser * round(-step["position"][1] / 0.3), abs=0.03)


@pytest.mark.parametrize("riser", [0.17, -0.17])
def test_stairs_without_a_mesh_print_on_a_slope_and_only_a_mesh_of_them_is_the_remedy(scene, riser):
    scene.render.fps = 30
    add_character(scene, climber(riser))
    report = grounds.bake(scene, cell_size=0.02).report
    assert {step["contact"] for step in report["steps"]} == {"Qx", "Zk"}
    assert min(step["frame_end"] - step["frame_start"] for step in report["steps"][1:]) > 12
    assert [finding["code"] for finding in report["self_check"]] == ["level_on_slope", "few_cells", "no_legs"]
    assert "Use Selected" in report["self_check"][0]["remedy"]
