"""A bake in Blender and the library without it give the same forces and prints for the same motion.

What a bake has read is kept, so that the library gets the very same input: then all numbers are equal to the last bit.
From a file itself they are equal but for the single precision in which Blender keeps a rig and its keys.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import bpy
import numpy as np
import pytest

from library import softground
from softground_addon.blender import compat, jobs, settings
from softground_addon.blender.baking import bake_job
from softground_addon.blender.reading import analysis
from softground_addon.blender.rigs.rig_mapping import rest_bones
from softground_addon.blender.sampling import body_sampling, rig_sampling
from softground_addon.core.loads.estimate import CharacterLoads
from softground_addon.core.record.footprints import Footprint
from softground_addon.core.settings import BakeSettings
from tests.blender import grounds, shots
from tests.blender.characters.test_bare_bodies import robot
from tests.blender.interface.test_selection import select
from tests.core.capture.c3d_files import c3d_file
from tests.core.capture.test_joint_centres import centres

SAME_DEPTH = 3e-6
"""Difference of depths from a file [m]: 2.4 µm in 31 steps of the zombie, .3 to 1.9 µm in the other five files."""
SAME_FORCE = 1e-4
"""Difference of forces from a file over the body's weight: 7e-5 in the zombie and the run, 1.5e-5 in the walk."""
RATE = 100.0
NOT_COMPARED = {"character", "sole", "pressed_by", "surface"}
"""Names, which the library has of the file; what pressed a print follows from the poses that are compared."""


@dataclass
class Baked:
    """A bake, and what it has read."""

    wanted: BakeSettings
    loads: CharacterLoads
    prints: list[Footprint]
    read: list[Any]


@pytest.fixture
def baked(scene, monkeypatch):
    """Bakes what is selected, on a plane at height 0."""
    read: list[Any] = []

    record = rig_sampling.record

    def keeping(*arguments, **options):
        read.append((yield from record(*arguments, **options)))
        return read[-1]

    monkeypatch.setattr(rig_sampling, "record", keeping)

    def bake() -> Baked:
        bpy.ops.softground.add_character()
        ground = grounds.plane(scene, size=60.0, vertices=2)
        scene.softground.ground = ground
        bpy.ops.softground.load_preset(name="Snow")
        shots.coarse(scene)
        wanted, (loads,) = settings.snapshot(scene), analysis.read(scene).loads
        return Baked(wanted, loads, jobs.run(bake_job.bake(scene)).footprints, read)

    return bake


def from_frame_0(scene, *objects):
    """Shift keys to the frame at which the library begins: times as of other frames are rounded otherwise."""
    curves = [curve for obj in objects for curve in compat.action_curves(obj.animation_data.action)]
    for curve in curves:
        for key in curve.keyframe_points:
            key.co.x -= 1
    scene.frame_start, scene.frame_end = 0, round(max(curve.range()[1] for curve in curves))


@pytest.fixture
def baked_motion(scene, baked, request):
    """A motion file, its rig and its bake."""
    motion = shots.MOTION_FILES[request.param]
    shots.import_file(motion)
    rig = bpy.context.active_object
    from_frame_0(scene, rig)
    return motion, rig, baked()


every_file = pytest.mark.parametrize(
    "baked_motion",
    [name if name == "walk" else pytest.param(name, marks=pytest.mark.slow) for name in sorted(shots.MOTION_FILES)],
    indirect=True,
)


def of_library(body: softground.Body, wanted: BakeSettings) -> tuple[softground.Loads, softground.Prints]:
    """Loads and prints of a body on the ground of a bake."""
    loads = softground.estimate_loads(body)
    ground = softground.Ground(wanted.material, 0.0, wanted.pressure)
    return loads, softground.press(loads, ground, cell_size=wanted.cell_size_m)


def bits(value):
    """A value as it can be compared: the library's classes are others than the extension's, of the same files."""
    if is_dataclass(value):
        return [bits(getattr(value, field.name)) for field in fields(value)]
    return (value.dtype, value.shape, value.tobytes()) if isinstance(value, np.ndarray) else value


def assert_same_to_the_last_bit(bake: Baked, loads: softground.Loads, prints: softground.Prints) -> None:
    shown = bake.loads.motion.on_frames
    for number, sole in enumerate(loads.soles):
        assert np.array_equal(sole.force, bake.loads.forces.forces[shown, number])
    assert np.array_equal(loads.steps.contacts.touching, bake.loads.contacts.touching)
    assert len(prints.record) == len(bake.prints) > 0
    for ours, theirs in zip(prints.record, bake.prints, strict=True):
        for field in fields(theirs):
            if field.name not in NOT_COMPARED:
                assert bits(getattr(ours, field.name)) == bits(getattr(theirs, field.name)), field.name


def assert_same_but_for_single_precision(bake: Baked, loads: softground.Loads, prints: softground.Prints) -> None:
    shown = bake.loads.motion.on_frames
    for number, sole in enumerate(loads.soles):
        gap = np.abs(sole.force - bake.loads.forces.forces[shown, number]).max()
        assert gap < SAME_FORCE * loads.body.mass * 9.81
    assert np.array_equal(loads.steps.contacts.touching, bake.loads.contacts.touching)
    assert len(prints.prints) == len(bake.prints) > 0
    for ours, theirs in zip(prints.prints, bake.prints, strict=True):
        rate = loads.body.rate  # in Blender of single precision
        assert (ours.sole, ours.start * rate) == (theirs.sole, pytest.approx(theirs.start_frame, abs=1e-9))
        assert ours.end * rate == pytest.approx(theirs.end_frame, abs=1e-9)
        assert ours.depth == pytest.approx(theirs.max_depth_m, abs=SAME_DEPTH)
        np.testing.assert_allclose(ours.position, theirs.position, atol=1e-4)


@every_file
def test_the_poses_that_a_bake_has_read_give_its_numbers_to_the_last_bit(baked_motion):
    _, rig, bake = baked_motion
    recording, bones = bake.read[-1], rest_bones(rig)
    still = {name: np.tile(bone.matrix, (len(recording.frames), 1, 1)) for name, bone in bones.items()}  # not read
    poses = [recording.bone(name) if name in recording.bones else still[name] for name in bones]
    skeleton = softground.Skeleton(
        tuple(
            softground.Bone(name, bone.parent, bone.head, bone.tail, bone.matrix[:3, 0]) for name, bone in bones.items()
        ),
        np.stack(poses, axis=1),
        recording.units.frame_rate,
        np.stack([bone.matrix for bone in bones.values()]),
    )
    (character,) = bake.wanted.characters
    body = softground.Body.from_skeleton(skeleton, joints=character.joints, mass=character.mass_kg)
    assert_same_to_the_last_bit(bake, *of_library(body, bake.wanted))


@every_file
def test_a_bvh_file_gives_the_numbers_of_its_bake_but_for_single_precision(baked_motion):
    motion, _, bake = baked_motion
    (character,) = bake.wanted.characters
    body = softground.read_bvh(shots.SHARED / motion.path, mass=character.mass_kg, scale=motion.scale)
    assert_same_but_for_single_precision(bake, *of_library(body, bake.wanted))


def test_vertices_that_a_bake_has_read_give_its_numbers_to_the_last_bit(scene, baked):
    """A robot of three meshes that no armature moves, which are one mesh to the library."""
    top = robot(scene)
    from_frame_0(scene, *top.children)
    select(top)
    bake = baked()
    frames = range(scene.frame_end + 1)
    parts = [part.name_full for part in body_sampling.meshes_of(top)]
    positions, _, triangles = jobs.run(body_sampling._positions(scene, parts, frames))
    (character,) = bake.wanted.characters
    body = softground.Body.from_mesh_sequence(positions, triangles, scene.render.fps, mass=character.mass_kg)
    assert_same_to_the_last_bit(bake, *of_library(body, bake.wanted))


def test_a_c3d_file_gives_the_numbers_of_its_bake_but_for_single_precision(scene, baked, tmp_path):
    """The rig that Blender imports is the library's `shape`; the library's own forces follow from the markers."""
    scene.frame_start, scene.render.fps = 0, int(RATE)
    markers = centres()
    points = np.stack(list(markers.values()), axis=1) * 1e3
    (tmp_path / "anna.c3d").write_bytes(c3d_file(points, RATE, labels=list(markers)))
    bpy.ops.softground.import_capture(filepath=str(tmp_path / "anna.c3d"))
    bake = baked()
    (character,) = bake.wanted.characters
    body = softground.read_c3d(tmp_path / "anna.c3d", mass=character.mass_kg)
    assert_same_but_for_single_precision(bake, *of_library(replace(body, motion=body.shape), bake.wanted))
