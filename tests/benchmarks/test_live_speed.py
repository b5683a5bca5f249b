"""What live mode costs per frame, against Dynamic Paint on the same ground under the same character."""

import time
from statistics import median

import bpy
import numpy as np
import pytest

import softground_addon
from softground_addon.blender import created_ground, live
from softground_addon.core.ground_plan import GroundPlan
from softground_addon.core.heightfield import FlatTerrain
from tests.blender.shots import walker

pytestmark = pytest.mark.benchmark

SIDE = 512
EXTENT = 10.0
"""Length of the ground's sides [m]."""
FRAMES = 96
LARGEST_RATIO = 1.5


@pytest.fixture
def scene():
    softground_addon.register()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    yield bpy.context.scene
    bpy.ops.wm.read_factory_settings(use_empty=True)
    softground_addon.unregister()


def ground_of(scene):
    scene.softground.cell_size = EXTENT / SIDE
    half = np.array([EXTENT / 2 - 0.02, EXTENT / 2 - 0.02])
    layout = created_ground.lay_out(GroundPlan(-half, half, FlatTerrain()), EXTENT / SIDE, 1.0)
    with created_ground.draft(layout) as ground:
        scene.collection.objects.link(ground)
    scene.softground.ground = ground
    bpy.context.view_layer.update()
    return ground


def seconds_per_frame(scene, ground):
    """Median time of a frame of first playback, with the normals that a viewport would ask for."""
    scene.frame_set(1)
    times = []
    for frame in range(2, FRAMES + 1):
        begin = time.perf_counter()
        scene.frame_set(frame)
        mesh = ground.evaluated_get(bpy.context.view_layer.depsgraph).data
        len(mesh.vertex_normals)
        times.append(time.perf_counter() - begin)
    return median(times)


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
    return seconds_per_frame(scene, ground)


def feet_of(scene, armature):
    """A box on each foot: the lightest brush that leaves prints."""
    feet = []
    for sole in scene.softground.characters[0].soles:
        mesh = bpy.data.meshes.new(sole.name)
        corners = [(x, y, z) for x in (-0.05, 0.05) for y in (-0.05, 0.2) for z in (-0.08, 0.02)]
        faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        mesh.from_pydata(corners, [], faces)
        box = bpy.data.objects.new(sole.name, mesh)
        box.parent, box.parent_type, box.parent_bone = armature, "BONE", sole.bone
        scene.collection.objects.link(box)
        feet.append(box)
    return feet


def test_live_mode_costs_no_more_than_dynamic_paint(scene):
    armature = walker(scene, frames=FRAMES)
    bpy.ops.softground.add_character()
    ground = ground_of(scene)
    bare = seconds_per_frame(scene, ground)
    scene.frame_set(1)
    bpy.ops.softground.live()
    ours = seconds_per_frame(scene, ground) - bare
    live.discard()
    theirs = with_dynamic_paint(scene, ground, feet_of(scene, armature)) - bare
    print(
        f"\nper frame at {SIDE}² over bare playback ({bare * 1e3:.2f} ms): live mode {ours * 1e3:.2f} ms, "
        f"Dynamic Paint with boxes for feet {theirs * 1e3:.2f} ms, ratio {ours / theirs:.2f}"
    )
    assert ours <= LARGEST_RATIO * theirs
