"""Rigs made up at random that walk with a known gait: their contacts are that gait's, whatever they are built like."""

from dataclasses import dataclass

import bpy
import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from softground_addon.blender import jobs
from softground_addon.blender.characters.character_setup import add_character
from softground_addon.blender.reading.shots import estimate_shot, read_shot, settings_of
from tests.blender import rigs

FRAMES, RATE, PERIOD = 50, 24, 24
LIFT = 0.12
NAMES = st.text(st.characters(exclude_categories=("Cs", "Cc"), exclude_characters=".\x00"), min_size=1, max_size=12)


@dataclass(frozen=True)
class Animal:
    """An animal 1 m tall before it is scaled.

    It travels, or takes its steps `on_the_spot`. `turn` is of the rest pose in the armature, which is turned back, and
    about the vertical by `heading` [rad]. `axes` and `leaves` are those of the feet's bones and the lengths of theirs;
    `on_trunk` says which feet hang on the trunk and not on the root.
    """

    legs: int
    duty: float
    stride: float
    on_the_spot: bool
    names: tuple[str, ...]
    turn: np.ndarray
    axes: np.ndarray
    leaves: tuple[float, ...]
    on_trunk: tuple[bool, ...]
    scale: float
    heading: float


@st.composite
def animals(draw):
    legs = draw(st.integers(2, 8))
    chance = np.random.default_rng(draw(st.integers(0, 10**6)))
    turn = np.eye(3)[chance.permutation(3)] * chance.choice([-1, 1], 3)  # to the axes of some other program
    return Animal(
        legs,
        draw(st.floats(0.55, 0.72)),
        draw(st.floats(0.3, 0.7)),
        draw(st.booleans()),
        tuple(draw(st.lists(NAMES, min_size=2 * legs + 2, max_size=2 * legs + 2, unique_by=lambda name: name.lower()))),
        turn * np.sign(np.linalg.det(turn)),
        chance.normal(size=(legs, 3)),
        tuple(10.0 ** chance.uniform(-3, 1, legs)),
        tuple(chance.random(legs) < 0.5),
        10.0 ** draw(st.floats(-3, 3)),
        float(chance.uniform(0, 2 * np.pi)),
    )


def gait(animal):
    """How far each foot is ahead and lifted (F, legs), and when it stands (F, legs)."""
    offset = np.arange(animal.legs) * (0.5 if animal.legs == 2 else 0.618) + 0.1
    time = np.arange(FRAMES)[:, None] / PERIOD + offset
    phase = time % 1.0
    swing = np.clip((phase - animal.duty) / (1 - animal.duty), 0, 1)
    ahead = np.floor(time) + swing - np.sin(2 * np.pi * swing) / (2 * np.pi) - offset
    return animal.stride * ahead, LIFT * np.sin(np.pi * swing), phase < animal.duty


def cuboid(size, place):
    """Corners and faces of a block."""
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * np.array(size) / 2 + place
    return corners, np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])


def build(animal):
    """The animal, keyed, and the name of each foot's bone."""
    root, trunk, *names = animal.names
    feet, leaves = names[: animal.legs], names[animal.legs :]
    number = np.arange(animal.legs)
    places = np.stack([np.where(number % 2, 0.2, -0.2), number // 2 * 0.45, np.full(animal.legs, 0.05)], axis=-1)
    middle = np.array([0.0, places[:, 1].mean(), 0.8])
    axes = 0.1 * animal.axes / np.linalg.norm(animal.axes, axis=1, keepdims=True)
    bones = {root: (np.zeros(3), (0, 0, 0.1)), trunk: (middle, np.add(middle, (0, 0.1, 0)))}
    bones |= {foot: (place, place + axis) for foot, place, axis in zip(feet, places, axes, strict=True)}
    ends = [place + axis for place, axis in zip(places, axes, strict=True)]
    bones |= {
        leaf: (end, end + 10 * length * axis)
        for leaf, end, axis, length in zip(leaves, ends, axes, animal.leaves, strict=True)
    }
    turned = {name: tuple(tuple(animal.turn @ np.asarray(end)) for end in ends) for name, ends in bones.items()}
    parents = {trunk: root, **dict(zip(leaves, feet, strict=True))}
    parents |= {foot: trunk if on else root for foot, on in zip(feet, animal.on_trunk, strict=True)}
    armature = rigs.build("Animal", turned, parents)
    pieces = [(trunk, *cuboid((0.3, 0.5, 0.4), middle))]
    pieces += [
        (foot, *cuboid((0.08, 0.14, 0.06), np.add(place, (0, 0, -0.02))))
        for foot, place in zip(feet, places, strict=True)
    ]
    mesh = bpy.data.meshes.new("Skin")
    faces = np.concatenate([8 * index + piece[2] for index, piece in enumerate(pieces)])
    mesh.from_pydata((np.concatenate([piece[1] for piece in pieces]) @ animal.turn.T).tolist(), [], faces.tolist())
    skin = bpy.data.objects.new("Skin", mesh)
    bpy.context.scene.collection.objects.link(skin)
    skin.parent = armature
    skin.modifiers.new("Armature", "ARMATURE").object = armature
    for index, (bone, *_) in enumerate(pieces):
        skin.vertex_groups.new(name=bone).add(range(8 * index, 8 * index + 8), 1.0, "REPLACE")
    ahead, lift, _ = gait(animal)
    travel, body = np.zeros((2, FRAMES, 3))
    travel[:, 1] = -animal.stride * np.arange(FRAMES) / PERIOD
    if not animal.on_the_spot:
        body = travel
    paths = {trunk: body}
    for index, foot in enumerate(feet):
        paths[foot] = np.stack([np.zeros(FRAMES), -ahead[:, index], lift[:, index]], axis=-1)
        paths[foot] -= travel - body + body * animal.on_trunk[index]
    for bone, path in paths.items():
        local = path @ animal.turn.T @ np.array(armature.data.bones[bone].matrix_local)[:3, :3]
        rigs.key(armature, "location", {frame + 1: value for frame, value in enumerate(local.tolist())}, bone=bone)
    to_world = np.eye(4)
    cos, sin = np.cos(animal.heading), np.sin(animal.heading)
    to_world[:3, :3] = animal.scale * np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]) @ animal.turn.T
    armature.matrix_world = to_world.T.tolist()
    return armature, feet


def assert_gait(animal):
    """Add the animal to an empty file, and compare its contacts with its gait within two frames at each end."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps, scene.frame_end = RATE, FRAMES
    armature, feet = build(animal)
    bpy.context.view_layer.update()
    character = add_character(scene, armature)
    assert sorted(sole.bone for sole in character.soles) == sorted(feet)
    wanted = settings_of(scene)
    (loads,) = jobs.run(estimate_shot(wanted, jobs.run(read_shot(wanted))))
    steps = (len(loads.contacts.touching) - 1) // (FRAMES - 1)
    touching = loads.contacts.touching[::steps]
    *_, stands = gait(animal)
    bone_of = {sole.name: sole.bone for sole in character.soles}
    for number, sole in enumerate(loads.motion.soles):
        foot = stands[:, feet.index(bone_of[sole.sole.name])]
        wide = np.convolve(foot, np.ones(5), "same") > 0
        narrow = np.convolve(~foot, np.ones(5), "same") == 0
        inside = slice(2, -2)
        assert (touching[:, number] <= wide)[inside].all(), (sole.sole.name, touching[:, number], foot)
        assert (touching[:, number] >= narrow)[inside].all(), (sole.sole.name, touching[:, number], foot)


@pytest.mark.parametrize("count", [8, pytest.param(80, marks=pytest.mark.slow)])
def test_whatever_walks_is_found_with_its_gait(addon, count):
    @settings(
        max_examples=count,
        phases=(Phase.generate,),  # to make a failing example smaller takes minutes
        deadline=None,
        database=None,
        derandomize=True,
        suppress_health_check=list(HealthCheck),
    )
    @given(animals())
    def all_of_them(animal):
        assert_gait(animal)

    all_of_them()
