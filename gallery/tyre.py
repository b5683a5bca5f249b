"""A tyre for soft ground: a broad tread of slanted lugs to either side of the middle."""

from __future__ import annotations

from math import pi

import bpy
import numpy as np

from sample_scenes.plain_objects import add_object
from sample_scenes.stage import Array

RADIUS, WIDTH = 0.36, 0.21
"""To the top of the lugs, and of the tread [m]."""
_LUGS, _LUG_HEIGHT, _SLANT = 38, 0.013, 0.75  # around; m; pitches from the middle to the shoulder
_AROUND, _ACROSS = 12 * _LUGS, 41
_SHOULDER = 0.035  # m by which the tread falls away at its edge


def create_tyre(name: str, collection: bpy.types.Collection) -> bpy.types.Object:
    """A tyre about the origin, its axle along x."""
    vertices, faces = tyre_mesh()
    look = ("SoftGround Sample tyre", (0.015, 0.015, 0.016), 0.7)
    return add_object(name, vertices, faces, look, collection, smooth=False)


def tyre_mesh() -> tuple[Array, list[list[int]]]:
    """Vertices and faces of the tread and its sides, down to the rim."""
    across = np.linspace(-1.0, 1.0, _ACROSS)
    turn = 2 * pi * np.arange(_AROUND) / _AROUND
    side = np.abs(across)
    phase = turn[:, None] * _LUGS / (2 * pi) + _SLANT * side + 0.5 * (across > 0)
    lug = (np.mod(phase, 1.0) < 0.5) & (side > 0.08) & (side < 0.97)
    away = RADIUS - _LUG_HEIGHT * ~lug - _SHOULDER * side**6
    rows = [np.full((_AROUND, 1), 0.6 * RADIUS), away, np.full((_AROUND, 1), 0.6 * RADIUS)]
    place = np.concatenate([[-0.8], across, [0.8]]) * WIDTH / 2
    radius = np.concatenate(rows, axis=1)
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=-1)[:, None] * radius[..., None]
    vertices = np.concatenate([np.broadcast_to(place[None, :, None], (*radius.shape, 1)), ring], axis=-1)
    count = len(place)
    row, column = np.meshgrid(np.arange(_AROUND), np.arange(count - 1), indexing="ij")
    ahead = (row + 1) % _AROUND
    quads = [row * count + column, row * count + column + 1, ahead * count + column + 1, ahead * count + column]
    return vertices.reshape(-1, 3), np.stack(quads, axis=-1).reshape(-1, 4)[:, ::-1].tolist()
