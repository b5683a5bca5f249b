"""What the add-on's panels, buttons and handlers cost at a redraw in a large file."""

import bpy
import pytest

from tests.blender import grounds, shots
from tests.blender.redraws import fill, least_seconds, redraw, walk_over_all_objects

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
    walk = least_seconds(walk_over_all_objects)
    print(f"\na redraw beside {OBJECTS} objects: {seconds * 1e3:.2f} ms; walking over them once: {walk * 1e3:.2f} ms")
    assert seconds < A_REDRAW
