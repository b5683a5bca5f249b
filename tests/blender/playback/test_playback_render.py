"""A baked file renders the same pixels where the add-on is missing, frames in any order, with motion blur."""

import subprocess
import sys

import bpy
import numpy as np
import pytest

from softground_addon.blender import jobs
from softground_addon.blender.baking import bake_job
from tests.blender import shots
from tests.blender.grounds import plane

RENDER = """
import sys
import bpy, numpy as np
blend, out, with_addon, *frames = sys.argv[1:]
if with_addon == "1":
    import softground_addon
    softground_addon.register()
bpy.ops.wm.open_mainfile(filepath=blend, use_scripts=with_addon == "1")
assert hasattr(bpy.types.Scene, "softground") == (with_addon == "1")
scene, shown = bpy.context.scene, {}
for frame in frames:
    scene.frame_set(int(frame))
    scene.render.filepath = f"{out}_{frame}.exr"
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.empty(image.size[0] * image.size[1] * image.channels, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    shown[frame] = pixels
np.savez(out, **shown)
if with_addon == "1":
    bpy.ops.wm.read_factory_settings(use_empty=True)
    softground_addon.unregister()
"""


def set_up_render(scene):
    """A small picture of the trail with a low sun, by Cycles on the CPU."""
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (1.0, -1.2, 1.5), (0.7, 0.0, 0.0)
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.rotation_euler, sun.data.energy = (1.2, 0.3, 0.4), 3.0
    for thing in (camera, sun):
        scene.collection.objects.link(thing)
    scene.camera = camera
    render = scene.render
    render.engine, scene.cycles.device = "CYCLES", "CPU"
    scene.cycles.samples, scene.cycles.seed, scene.cycles.use_denoising = 4, 1, False
    render.resolution_x, render.resolution_y, render.resolution_percentage = 64, 48, 100
    render.use_motion_blur = True
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"


@pytest.mark.slow
def test_pixels_are_the_same_without_the_add_on_and_in_any_order(scene, tmp_path):
    shots.walker(scene, frames=48)
    bpy.ops.softground.add_character()
    scene.softground.ground, scene.softground.frame_end = plane(scene, vertices=2), 48
    bpy.context.view_layer.update()
    jobs.run(bake_job.bake(scene))
    set_up_render(scene)
    blend = tmp_path / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    pictures = []
    for with_addon, frames in (("1", ["8", "22", "36"]), ("0", ["36", "8", "22"])):
        out = tmp_path / f"with_{with_addon}.npz"
        command = [sys.executable, "-c", RENDER, str(blend), str(out), with_addon, *frames]
        subprocess.run(command, check=True, capture_output=True)
        pictures.append(np.load(out))
    for frame in ("8", "22", "36"):
        np.testing.assert_array_equal(pictures[0][frame], pictures[1][frame])
    assert np.abs(pictures[0]["8"] - pictures[0]["36"]).max() > 0.05, "nothing happens in the picture"
