"""The shot of the GUI tests: the project's own character, walking. Free of everything that Blender does not ship."""

from __future__ import annotations

from typing import Any

import bpy

from sample_scenes.body import Body
from sample_scenes.character import create_character
from sample_scenes.gait import Gait, walk
from sample_scenes.keys import write_action


def open_walk(frames: int = 72, rate: int = 24, **gait: float) -> Any:
    """Replace what the open file shows by a walker, framed in the viewport; returns its armature."""
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    scene = bpy.context.window_manager.windows[0].scene
    scene.render.fps, scene.render.fps_base = rate, 1.0
    scene.frame_start, scene.frame_end = 1, frames
    body = Body()
    armature = create_character("Walker", body, scene.collection)
    write_action(armature, walk(body, Gait(**gait), frames, rate), "Walk")
    layer = bpy.context.window_manager.windows[0].view_layer
    layer.update()
    layer.objects.active = armature
    armature.select_set(True)
    return armature
