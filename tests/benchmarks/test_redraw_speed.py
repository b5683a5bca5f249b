"""What the add-on's panels, buttons and handlers cost at a redraw in a large file."""

import bpy
import pytest

from tests.benchmarks.bars import below
from tests.blender import grounds, shots
from tests.blender.redraws import fill, least_seconds, redraw

pytestmark = pytest.mark.benchmark

OBJECTS = 10_000

A_REDRAW = 1e-3
"""Longest that all panels may take together [s]."""


def test_a_redraw_beside_ten_thousand_objects(scene):
    shots.walker(scene, frames=72)
    bpy.ops.softground.add_character()
    grounds.field(scene)
    bpy.ops.softground.bake()
    bpy.ops.softground.predict_depth()
    fill(scene, OBJECTS)
    redraw(bpy.context)
    seconds = least_seconds(redraw, bpy.context)
    below(f"a redraw beside {OBJECTS:,} objects", 1e3 * seconds, 1e3 * A_REDRAW, "ms")
