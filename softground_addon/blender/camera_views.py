"""The scene's camera as the core's type."""

from __future__ import annotations

from typing import Any, cast

import bpy
import numpy as np

from ..core.ground.camera_view import CameraView
from .compat import action_curves, slot_of

LOOKS = 33
"""Frames of a camera's path that are looked at."""


def camera_view(scene: bpy.types.Scene, frames: tuple[int, int]) -> CameraView | None:
    """View of the scene's camera, now and on its path between two frames; None without one.

    A camera that is keyed by its location is looked for along its path; one that follows something, where it is.
    """
    camera = scene.camera
    if camera is None or not isinstance(camera.data, bpy.types.Camera):
        return None
    scale, matrix = scene.unit_settings.scale_length, np.array(camera.matrix_world)
    eyes = [matrix[:3, 3], *_path(camera, frames)]
    corners = np.array(camera.data.view_frame(scene=scene)) @ matrix[:3, :3].T + matrix[:3, 3]
    if camera.data.type == "ORTHO":
        origins, rays, pixels = corners * scale, np.broadcast_to(-matrix[:3, 2], (4, 3)), 0.0
    else:
        origins, rays = np.broadcast_to(matrix[:3, 3] * scale, (4, 3)), corners - matrix[:3, 3]
        render = scene.render
        width = max(render.resolution_x, render.resolution_y) * render.resolution_percentage / 100
        pixels = float(width / (2.0 * np.tan(camera.data.angle / 2.0)))
    return CameraView(
        tuple((tuple(origin), tuple(ray)) for origin, ray in zip(origins.tolist(), rays.tolist(), strict=True)),
        tuple(tuple((eye * scale).tolist()) for eye in eyes),
        pixels,
    )


def _path(camera: bpy.types.Object, frames: tuple[int, int]) -> Any:
    """Path of a camera over frames, (N, 3) in Blender units; nothing of one that has no path of its own."""
    keys = camera.animation_data
    if camera.parent is not None or keys is None or keys.action is None:
        return ()
    path = np.tile(np.array(camera.location, dtype=np.float64), (LOOKS, 1))
    for curve in (
        cast("Any", channel) for channel in action_curves(keys.action, slot_of(keys)) if channel.data_path == "location"
    ):
        path[:, curve.array_index] = [curve.evaluate(frame) for frame in np.linspace(*frames, LOOKS)]
    return path
