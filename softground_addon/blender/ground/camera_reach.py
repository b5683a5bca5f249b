"""Which part of a trail the scene's camera comes close to, so that vertices go where pictures show them."""

from __future__ import annotations

from typing import Any, cast

import bpy
import numpy as np
from numpy.typing import NDArray

from ..compat import action_curves

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

PIXELS = 0.75
"""Width of a fine cell in the picture from which it is worth its vertices [pixels]."""

LOOKS = 33
"""Frames of a camera's path that are looked at."""


def near_camera(scene: bpy.types.Scene, places: Array, spacing: float) -> Mask:
    """Which places (N, 2) [m] the scene's camera sees from so near that cells of a size [m] show; all without one.

    A camera that is keyed by its location is looked for along its path; one that follows something, where it is.
    """
    camera = scene.camera
    if camera is None or not isinstance(camera.data, bpy.types.Camera) or camera.data.type == "ORTHO":
        return np.ones(len(places), dtype=bool)
    eyes = _path(scene, camera) * scene.unit_settings.scale_length
    reach = spacing * _pixels_per_radian(scene, camera.data) / PIXELS
    near = np.zeros(len(places), dtype=bool)
    for eye in np.unique(eyes, axis=0):
        near |= np.hypot(*(places - eye[:2]).T) < np.sqrt(max(reach**2 - eye[2] ** 2, 0.0))
    return near


def _pixels_per_radian(scene: bpy.types.Scene, camera: bpy.types.Camera) -> float:
    """Pixels of the rendered picture over the angle that they are seen under, in its middle."""
    render = scene.render
    width = max(render.resolution_x, render.resolution_y) * render.resolution_percentage / 100
    return float(width / (2.0 * np.tan(camera.angle / 2.0)))


def _path(scene: bpy.types.Scene, camera: bpy.types.Object) -> Array:
    """Where the camera is at some frames, (N, 3) in Blender units."""
    here = np.array(camera.matrix_world, dtype=np.float64)[:3, 3]
    keys = camera.animation_data
    if camera.parent is not None or keys is None or keys.action is None:
        return here[None]
    curves = action_curves(keys.action, getattr(keys, "action_slot", None))
    frames = np.linspace(scene.softground.frame_start, scene.softground.frame_end, LOOKS)
    path = np.tile(np.array(camera.location, dtype=np.float64), (LOOKS, 1))
    for curve in (cast("Any", one) for one in curves if one.data_path == "location"):
        path[:, curve.array_index] = [curve.evaluate(frame) for frame in frames]
    return np.concatenate([here[None], path])
