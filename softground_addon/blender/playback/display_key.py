"""The shape keys of a baked ground: raw heights as the basis and the blurred ones above it, beside the user's own."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..rigs.object_data import mesh_of

Positions = NDArray[np.float32]
"""Of all vertices, (V, 3) in the object's own space and units."""

DISPLAY_KEY = "SoftGround Display"


MOST_VERTICES = 250_000
"""Vertices of a ground up to which shape keys cost nothing that shows; see docs/playback.md."""


def is_dense(ground: bpy.types.Object) -> bool:
    """True if shape keys would make a ground play slower."""
    return len(mesh_of(ground).vertices) > MOST_VERTICES


def put(ground: bpy.types.Object, raw: Positions, display: Positions) -> None:
    """Raw positions as the basis, and above it the key that shows the blurred ones, as it may be there already."""
    mesh = mesh_of(ground)
    if not mesh.shape_keys:
        ground.shape_key_add(name="Basis", from_mix=False)
    keys: Any = mesh.shape_keys
    if DISPLAY_KEY not in keys.key_blocks:
        ground.shape_key_add(name=DISPLAY_KEY, from_mix=False).value = 1.0
    _move_basis(mesh, raw)
    keys.key_blocks[DISPLAY_KEY].points.foreach_set("co", display.ravel())


def take_off(ground: bpy.types.Object, basis: Positions) -> None:
    """Leave no shape keys but those that the user has made since, on a basis of these positions."""
    mesh = mesh_of(ground)
    if not mesh.shape_keys:
        return
    if shown := mesh.shape_keys.key_blocks.get(DISPLAY_KEY):
        ground.shape_key_remove(shown)
    if mesh.shape_keys and len(mesh.shape_keys.key_blocks) > 1:
        _move_basis(mesh, basis)
    else:
        ground.shape_key_clear()


def positions(mesh: bpy.types.Mesh) -> Positions | None:
    """The blurred positions, where a mesh has the key that shows them."""
    key = mesh.shape_keys.key_blocks.get(DISPLAY_KEY) if mesh.shape_keys else None
    return None if key is None else _read(key)


def drop_all(mesh: bpy.types.Mesh) -> None:
    """Take the shape keys off a copy of a mesh: before 5.x their data stays, as a copy counts it twice."""
    if not mesh.shape_keys:
        return
    keys = mesh.shape_keys.session_uid
    holder = bpy.data.objects.new("SoftGround Evaluation", mesh)
    holder.shape_key_clear()
    bpy.data.objects.remove(holder)
    bpy.data.batch_remove([unused for unused in bpy.data.shape_keys if unused.session_uid == keys])


def _move_basis(mesh: bpy.types.Mesh, basis: Positions) -> None:
    """Give the first key other positions; the user's keys keep what they add to it."""
    keys: Any = mesh.shape_keys
    first = keys.reference_key
    change = basis - _read(first)
    first.points.foreach_set("co", basis.ravel())
    for key in keys.key_blocks:
        if key.name not in (first.name, DISPLAY_KEY):
            key.points.foreach_set("co", (_read(key) + change).ravel())


def _read(key: bpy.types.ShapeKey) -> Positions:
    values = np.empty(len(key.points) * 3, dtype=np.float32)
    key.points.foreach_get("co", values)
    return values.reshape(-1, 3)
