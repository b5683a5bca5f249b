"""Shots to bake and render on a farm of one machine, and a `blender` program made of the bpy module."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

MAKE_SHOT = """
import sys
import bpy
import softground_addon
from tests.blender import shots
bpy.ops.wm.read_factory_settings(use_empty=True)
softground_addon.register()
scene = bpy.context.scene
shots.walker(scene, frames=24)
scene.collection.objects.link(camera := bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera")))
scene.camera = camera
camera.location = (0.3, 0, 4)
scene.render.engine = "CYCLES"
scene.cycles.samples = 1
scene.render.resolution_x = scene.render.resolution_y = 16
scene.render.image_settings.file_format = "PNG"
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1])
softground_addon.unregister()
"""


@pytest.fixture
def shot(tmp_path):
    """A small shot that renders fast."""
    path = tmp_path / "shot.blend"
    subprocess.run([sys.executable, "-c", MAKE_SHOT, str(path)], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    return path


@pytest.fixture
def blender(tmp_path):
    """A program that takes Blender's command line."""
    program = tmp_path / "blender"
    script = ROOT / "tests/farm/blender_of_bpy.py"
    program.write_text(f'#!/bin/sh\nPYTHONPATH={ROOT} exec "{sys.executable}" "{script}" "$@"\n')
    os.chmod(program, 0o755)
    return program
