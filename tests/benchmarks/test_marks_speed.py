"""What the marks of 300 steps on hard floors take in a file, and cost in a frame of a shot with its character."""

import bpy
import numpy as np
import pytest

from softground_addon.blender.carried import marks_object
from softground_addon.blender.carried.marks_nodes import STEP
from tests.benchmarks.bars import below
from tests.benchmarks.test_playback_speed import heavy_walker, in_turns, times
from tests.blender.carried.test_mass_of_clips import strips
from tests.blender.ground.test_hard_ground import listed

pytestmark = pytest.mark.benchmark

STEPS = 300
FRAMES = 5200
MUD, FLOOR = 3.0, 15.0
"""Lengths of the strips that follow each other [m]."""


def saved(path):
    """Size of the open file [MB]."""
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, compress=False)
    return path.stat().st_size / 1e6


def test_marks_of_300_steps_are_small_and_play_near_the_shot_without_them(scene, tmp_path):
    heavy_walker(scene, FRAMES)
    bpy.ops.softground.add_character()
    starts = 2.0 - np.arange(0.0, 300.0, MUD + FLOOR)  # it walks along -y
    mud = strips(scene, "Mud", [(start - MUD, start) for start in starts], 1, (-3.0, 3.0), 0.0)
    floor = strips(scene, "Floor", [(start - MUD - FLOOR, start - MUD) for start in starts], 1, (-3.0, 3.0), 0.0)
    options = scene.softground
    options.ground, options.material.surface, options.cell_size = mud, "mud", 0.02
    options.frame_start, options.frame_end = 1, FRAMES
    listed(floor)
    bpy.ops.softground.bake()
    marks = marks_object.of(mud)
    steps = len(np.unique(marks_object.values(marks.data, STEP)))
    assert steps >= STEPS

    def play(hidden):
        marks.hide_viewport = hidden
        bpy.context.view_layer.update()
        return times(scene, None, np.random.default_rng(0).permutation(np.arange(FRAMES - 300, FRAMES))[:60])

    rows = in_turns({"without": lambda: play(True), "with": lambda: play(False)})
    whole = saved(tmp_path / "with.blend")
    marks_object.remove(mud)
    bpy.ops.outliner.orphans_purge(do_recursive=True)
    size = (whole - saved(tmp_path / "without.blend")) * STEPS / steps
    below("marks of 300 steps in a file", size, 3.0, "MB")
    below("a frame with the marks of 300 steps over one without", rows["with"].frame / rows["without"].frame, 1.05)
