"""What live mode costs per frame, against Dynamic Paint on the same ground under the same character.

Both play the same frames in turns, several times over; of each frame the least time counts. It is the processor's time
of all threads, which other programs on the machine disturb less than the clock's.
"""

import time
from contextlib import ExitStack

import bpy
import numpy as np
import pytest

from softground_addon.blender.ground import created_ground
from softground_addon.blender.live import live
from softground_addon.blender.settings import resolve
from softground_addon.core.composers.ground_plan import GroundPlan
from softground_addon.core.ground.heightfield import FlatTerrain
from tests.benchmarks.bars import below
from tests.blender.shots import walker

pytestmark = pytest.mark.benchmark

SIDE = 512
EXTENT = 10.0
"""Length of the ground's sides [m]."""
FRAMES = 96
LARGEST_RATIO = 1.5
TURNS = 4


def ground_of(scene):
    scene.softground.cell_size = EXTENT / SIDE
    half = np.array([EXTENT / 2 - 0.02, EXTENT / 2 - 0.02])
    layout = created_ground.lay_out(GroundPlan(-half, half, FlatTerrain()), EXTENT / SIDE, 1.0)
    with ExitStack() as drafts:
        ground = resolve(created_ground.draft(drafts, layout))
        scene.collection.objects.link(ground)
    scene.softground.ground = ground
    bpy.context.view_layer.update()
    return ground


def seconds_of_frames(scene, ground):
    """Times of the frames of first playback, without and with the normals that a viewport would ask for, (F, 2)."""
    scene.frame_set(1)
    times = []
    for frame in range(2, FRAMES + 1):
        begin = time.process_time()
        scene.frame_set(frame)
        mesh = ground.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        evaluated = time.process_time()
        mesh.vertex_normals[0].vector  # noqa: B018  (computes them)
        times.append((evaluated - begin, time.process_time() - begin))
    return times


def with_dynamic_paint(scene, ground, brushes):
    canvas = ground.modifiers.new("Paint", "DYNAMIC_PAINT")
    canvas.ui_type = "CANVAS"
    bpy.context.view_layer.objects.active = ground
    with bpy.context.temp_override(object=ground, active_object=ground):
        bpy.ops.dpaint.type_toggle(type="CANVAS")
    surface = canvas.canvas_settings.canvas_surfaces[0]
    surface.surface_type = "DISPLACE"
    surface.frame_start, surface.frame_end = 1, FRAMES
    for brush in brushes:
        modifier = brush.modifiers.new("Brush", "DYNAMIC_PAINT")
        modifier.ui_type = "BRUSH"
        with bpy.context.temp_override(object=brush, active_object=brush):
            bpy.ops.dpaint.type_toggle(type="BRUSH")
    times = seconds_of_frames(scene, ground)
    assert lowest(ground) < -0.01
    ground.modifiers.remove(canvas)
    for brush in brushes:
        brush.modifiers.remove(brush.modifiers["Brush"])
    return times


def feet_of(scene, armature):
    """A box on each foot, no part of the character: the lightest brush that leaves prints."""
    feet = []
    for sole in scene.softground.characters[0].soles:
        mesh = bpy.data.meshes.new(sole.name)
        corners = [(x, y, z) for x in (-0.05, 0.05) for y in (-0.05, 0.2) for z in (-0.1, 0.1)]
        faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        mesh.from_pydata(corners, [], faces)
        box = bpy.data.objects.new(sole.name, mesh)
        follow = box.constraints.new("COPY_TRANSFORMS")
        follow.target, follow.subtarget = armature, sole.bone
        scene.collection.objects.link(box)
        feet.append(box)
    return feet


def in_live_mode(scene, ground):
    scene.frame_set(1)
    bpy.ops.softground.live()
    times = seconds_of_frames(scene, ground)
    assert lowest(ground) < -0.01
    live.discard()
    return times


def lowest(ground):
    """Height of the ground's deepest point."""
    mesh = ground.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    positions = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    mesh.attributes["position"].data.foreach_get("vector", positions)
    return positions[2::3].min()


def test_live_mode_costs_no_more_than_dynamic_paint(scene):
    armature = walker(scene, frames=FRAMES, coarseness=1.0)
    bpy.ops.softground.add_character()
    ground = ground_of(scene)
    feet = feet_of(scene, armature)
    turns = [
        (seconds_of_frames(scene, ground), in_live_mode(scene, ground), with_dynamic_paint(scene, ground, feet))
        for _ in range(TURNS)
    ]
    bare, ours, theirs = np.median(np.min(turns, axis=0), axis=1)
    ratio = (ours - bare) / (theirs - bare)
    below(f"live mode at {SIDE}² with normals over Dynamic Paint", ratio[1], LARGEST_RATIO)
