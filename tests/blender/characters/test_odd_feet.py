"""One foot is one contact, however many bones carry it; and what rests prints, however little it bears."""

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix

from softground_addon.blender.characters.character_setup import add_character
from softground_addon.blender.jobs import run
from softground_addon.blender.reading import staleness
from softground_addon.blender.reading.shots import estimate_shot, read_shot, settings_of
from softground_addon.blender.rigs.carried import carrier_of
from softground_addon.blender.rigs.rig_mapping import rest_bones
from softground_addon.blender.sampling.rig_recording import record
from softground_addon.blender.sampling.skin_sampling import read_skin
from softground_addon.blender.sampling.take import Take
from softground_addon.blender.settings import character_of
from softground_addon.core.rig.rig_skin import of_body
from tests.blender import rigs

STRIDE, FRAMES = 0.8, 97
SIDES = {"L": (0.2, 0.0), "R": (-0.2, 1.0)}


def slab(name, low, high, armature, bone):
    """A box that a bone deforms."""
    corners = [(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    piece = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(piece)
    piece.parent = armature
    piece.modifiers.new("Armature", "ARMATURE").object = armature
    piece.vertex_groups.new(name=bone).add(range(8), 1.0, "REPLACE")


def place(armature, bone, path):
    """Keys that move a bone by vectors in the armature's space."""
    turn = np.array(armature.pose.bones[bone].bone.matrix_local.to_3x3().inverted())
    rigs.key(armature, "location", {frame: tuple(turn @ way) for frame, way in path.items()}, bone=bone)


def robot(foot):
    """A robot on two legs, one step a second; its feet are on one bone, split over two, or have bare bones beside."""
    bones = {"Root": ((0, 0, 0), (0, 0.2, 0)), "Body": ((0, 0, 1), (0, 0, 1.6))}
    for side, (x, _) in SIDES.items():
        bones[f"Leg3.{side}"] = ((x, 0, 0.3), (x, 0, 0.1))
        if foot != "one":
            bones[f"Foot.{side}"] = ((x, 0, 0.1), (x, -0.2, 0.1))
    armature = rigs.build("Robot", bones, dict.fromkeys(set(bones) - {"Root"}, "Root"))
    slab("body", (-0.3, -0.15, 0.8), (0.3, 0.15, 1.7), armature, "Body")
    for side, (x, _) in SIDES.items():
        if foot == "split":
            slab("sole", (x - 0.06, -0.22, 0), (x + 0.06, 0.02, 0.1), armature, f"Foot.{side}")
            slab("ankle", (x - 0.05, 0.03, 0.004), (x + 0.05, 0.15, 0.5), armature, f"Leg3.{side}")
        else:
            slab("leg", (x - 0.06, -0.2, 0), (x + 0.06, 0.1, 0.5), armature, f"Leg3.{side}")
    frames = range(1, FRAMES + 1)
    place(armature, "Body", {frame: (0, -STRIDE * (frame - 1) / 24, 0) for frame in frames})
    for side, (_, phase) in SIDES.items():
        path = {}
        for frame in frames:
            cycles, share = divmod(((frame - 1) / 24 + phase) / 2, 1.0)
            swing = max(0.0, (share - 0.55) / 0.45)
            along = -2 * STRIDE * (cycles + swing**2 * (3 - 2 * swing)) + phase * STRIDE
            path[frame] = (0, along, 0.6 * swing * (1 - swing))
        for bone in {f"Leg3.{side}", f"Foot.{side}"} & bones.keys():
            follows = bone.startswith("Leg3") or foot == "split"
            place(armature, bone, path if follows else {frame: (0, way[1], 0) for frame, way in path.items()})
    return armature


@pytest.mark.parametrize("foot", ["one", "split", "bare"])
def test_a_foot_on_several_bones_is_one_contact(scene, foot):
    armature = robot(foot)
    character = add_character(scene, armature)
    assert len(character.soles) == 2
    carriers = {f"{bone}.{side}" for bone in ("Leg3", "Foot") for side in "LR"}
    skinned = carriers if foot == "split" else {f"Leg3.{side}" for side in "LR"}
    assert {part for sole in character.soles for part, _ in sole.parts.items()} == skinned


@pytest.mark.parametrize("how", ["BONE", "on an empty", "CHILD_OF", "ARMATURE", "COPY_TRANSFORMS"])
def test_what_follows_a_bone_by_a_constraint_is_skin_as_what_hangs_on_it(scene, how):
    """As shoes, or the rigid parts of a robot."""
    armature = robot("one")
    deformed = read_skin(scene.objects, armature)
    for leg in [obj for obj in scene.objects if obj.name.startswith("leg")]:
        bone = armature.data.bones[leg.vertex_groups[0].name]
        leg.modifiers.clear()
        leg.vertex_groups.clear()
        leg.parent = None
        leg.animation_data_create()  # empty, as by a look at the drivers
        if how in ("BONE", "on an empty"):
            hung = leg if how == "BONE" else bpy.data.objects.new(f"{leg.name} node", None)
            hung.parent, hung.parent_type, hung.parent_bone = armature, "BONE", bone.name
            tail = bone.matrix_local @ Matrix.Translation((0, bone.length, 0))
            hung.matrix_parent_inverse = tail.inverted()
            if hung != leg:  # as of nodes between a bone and its mesh, with a place and a scale of their own
                hung.matrix_basis = Matrix.LocRotScale((0.3, 0.2, -0.1), Euler((0.4, 0.5, 0.6)), (0.5, 0.5, 0.5))
                leg.parent = hung
                leg.matrix_basis = hung.matrix_basis.inverted()
            continue
        constraint = leg.constraints.new(how)
        target = constraint.targets.new() if how == "ARMATURE" else constraint
        target.target, target.subtarget = armature, bone.name
        if how == "CHILD_OF":
            constraint.inverse_matrix = bone.matrix_local.inverted()
        elif how == "COPY_TRANSFORMS":
            leg.data.transform(bone.matrix_local.inverted())
    carried = read_skin(scene.objects, armature)
    assert carried.bones == deformed.bones
    assert carried.part.tolist() == deformed.part.tolist()
    assert carried.vertices == pytest.approx(deformed.vertices, abs=1e-6)
    character = add_character(scene, armature)
    assert {part for sole in character.soles for part, _ in sole.parts.items()} == {"Leg3.L", "Leg3.R"}
    wanted = character_of(character)
    before = staleness._of_body(scene.objects, wanted)
    leg = bpy.data.objects["leg"]
    if how == "CHILD_OF":
        leg.constraints[0].inverse_matrix.translation.x += 0.1
    elif how == "on an empty":
        leg.parent.location.x += 0.1
    else:
        leg.data.vertices[0].co.x += 0.1
    assert staleness._of_body(scene.objects, wanted) != before


def test_a_robot_of_rigid_parts_is_its_body_though_its_hands_are_deformed(scene):
    """A trunk that reaches lower than they do is no shoe, and a head above it no hat."""
    bones = {"Root": ((0, 0, 0), (0, 0.2, 0)), "Body": ((0, 0, 1), (0, 0, 1.6)), "Head": ((0, 0, 1.6), (0, 0, 2))}
    bones |= {"Hand": ((0.4, 0, 1.2), (0.4, 0, 0.9)), "Foot": ((0, 0, 0.1), (0, -0.1, 0.1))}
    armature = rigs.build("Robot", bones, {"Body": "Root", "Foot": "Root", "Head": "Body", "Hand": "Body"})
    slab("hand", (0.35, -0.05, 0.7), (0.45, 0.05, 2.5), armature, "Hand")
    slab("body", (-0.3, -0.15, 0.6), (0.3, 0.15, 1.1), armature, "Body")
    slab("head", (-0.3, -0.3, 1.1), (0.3, 0.3, 1.9), armature, "Head")
    slab("foot", (-0.3, -0.3, 0), (0.3, 0.3, 0.2), armature, "Foot")
    for part in ("body", "head", "foot"):
        obj = bpy.data.objects[part]
        bone = armature.data.bones[obj.vertex_groups[0].name]
        obj.modifiers.clear()
        obj.parent_type, obj.parent_bone = "BONE", bone.name
        obj.matrix_parent_inverse = (bone.matrix_local @ Matrix.Translation((0, bone.length, 0))).inverted()
    skin = read_skin(scene.objects, armature)
    recording = run_reading(record(Take.about(armature, scene, range(1, 3)), armature, skin.bones))
    assert of_body(skin, rest_bones(armature), recording).all()


def run_reading(reading):
    """What a generator returns."""
    try:
        while True:
            next(reading)
    except StopIteration as done:
        return done.value


def test_what_moves_by_itself_on_a_bone_or_is_deformed_by_another_rig_hangs_on_none(scene):
    armature = robot("one")
    leg = bpy.data.objects["leg"]
    node = bpy.data.objects.new("Node", None)
    node.parent, node.parent_type, node.parent_bone = armature, "BONE", leg.vertex_groups[0].name
    other = bpy.data.objects.new("Other", armature.data.copy())
    leg.modifiers.clear()
    leg.parent = node
    assert carrier_of(leg, armature)
    leg.modifiers.new("Armature", "ARMATURE").object = other
    assert not carrier_of(leg, armature)
    leg.modifiers.clear()
    node.animation_data_create()
    assert carrier_of(leg, armature)
    leg.keyframe_insert("location", frame=1)
    assert not carrier_of(leg, armature)


def test_a_mesh_that_hangs_on_another_bone_is_another_though_the_rig_stands_under_an_empty(scene):
    armature = robot("one")
    armature.parent = bpy.data.objects.new("Root", None)
    leg = next(obj for obj in scene.objects if obj.name.startswith("leg"))
    leg.parent_type, leg.parent_bone = "BONE", leg.vertex_groups[0].name
    wanted = character_of(add_character(scene, armature))
    before = staleness._of_body(scene.objects, wanted)
    armature.parent.location.x += 1.0  # which is compared by itself
    assert staleness._of_body(scene.objects, wanted) == before
    leg.parent_bone = "Body"
    assert staleness._of_body(scene.objects, wanted) != before


LEGS = {
    "named": {("BackUpLeg", "BackLowLeg", "BackFoot"): 0.5, ("FrontUpLeg", "FrontLowLeg", "FrontFoot"): -0.5},
    "unnamed": {("Thigh", "Calf", "Foot"): 0.5, ("b11", "b12", "b13"): -0.5},
}
"""Bones of the legs of an animal, and where they are along its body."""


def animal(front):
    """An animal that stands on four feet: it nods, or shifts its weight where nothing tells of its front legs.

    Those that are not named stand one before the other, so that the rest pose shows no pair.
    """
    bones = {"Pelvis": ((0, 0.5, 0.9), (0, 0.2, 0.9)), "Spine": ((0, 0.2, 0.9), (0, -0.5, 0.9))}
    bones["Head"] = ((0, -0.5, 0.9), (0, -1, 1.2))
    parents, boxes = {"Spine": "Pelvis", "Head": "Spine"}, []
    for side, x in (("L", 0.18), ("R", -0.18)):
        for leg, middle in LEGS[front].items():
            y = middle - 0.25 * (leg[0] == "b11" and side == "R")
            thigh, shin, foot = (f"{bone}.{side}" for bone in leg)
            bones |= {thigh: ((x, y, 0.8), (x, y, 0.45)), shin: ((x, y, 0.45), (x, y, 0.1))}
            bones[foot] = ((x, y, 0.1), (x, y - 0.12, 0.03))
            parents |= {thigh: "Pelvis", shin: thigh} | ({foot: shin} if front == "named" else {})
            boxes.append(((x - 0.06, y - 0.06, 0.08), (x + 0.06, y + 0.06, 0.8), shin))
            boxes.append(((x - 0.07, y - 0.14, 0), (x + 0.07, y + 0.08, 0.08), foot))
    armature = rigs.build("Animal", bones, parents)
    slab("trunk", (-0.25, -0.6, 0.7), (0.25, 0.6, 1.2), armature, "Spine")
    slab("head", (-0.15, -1.1, 1), (0.15, -0.6, 1.4), armature, "Head")
    for low, high, bone in boxes:
        slab(bone, low, high, armature, bone)
    turns = {frame: 2 * np.pi * (frame - 1) / 48 for frame in range(1, 50, 2)}
    if front == "named":
        nods = {frame: (0.1 * np.sin(turn), 0, 0) for frame, turn in turns.items()}
        rigs.key(armature, "rotation_euler", nods, bone="Head")
    else:
        sways = {frame: (0.01 * np.sin(turn), 0, 0.005 * np.sin(2 * turn)) for frame, turn in turns.items()}
        place(armature, "Pelvis", sways)
    return armature


@pytest.mark.parametrize("front", LEGS)
def test_every_foot_that_rests_bears_though_only_the_hind_legs_are_named(scene, front):
    """Its weight is where its volume is, between front and hind feet; and what nods is no statue."""
    armature = animal(front)
    scene.frame_start, scene.frame_end, scene.softground.sink_feet = 1, 49, False
    character = add_character(scene, armature)
    assert len(character.soles) == 4
    wanted = settings_of(scene)
    loads = run(estimate_shot(wanted, run(read_shot(wanted))))[0]
    assert not loads.motion.stands_still
    assert loads.contacts.touching.all()
    shares = loads.forces.forces[..., 2].mean(axis=0) / loads.forces.total[:, 2].mean()
    assert (shares > (0.15 if front == "unnamed" else 0.02)).all()
