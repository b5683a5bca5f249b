"""A bake on a ground, wherever it lies: on the user's own mesh, or on the detail that stands in for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core import record
from ..core.errors import InputError
from ..core.footprints import Footprint
from ..core.histories import Histories
from ..core.pressed_ground import PressedGround
from . import ground_mesh, playback, trail_detail

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Place:
    """Where a bake is written.

    Attributes
    ----------
    carrier : bpy.types.Object
        The object that takes the prints.
    index : (K,) int array
        Vertices of its mesh that the bake moves.
    position : (K, 3) float array
        Their undisturbed world positions [m].
    """

    carrier: bpy.types.Object
    index: Indices
    position: Array


def carrier_of(ground: bpy.types.Object) -> bpy.types.Object:
    """The object that carries the ground's bake: the detail along the trail where there is one, else the ground."""
    return trail_detail.detail_of(ground) or ground


def is_baked(ground: bpy.types.Object) -> bool:
    """Whether a bake is on this ground."""
    return ground_mesh.is_baked(carrier_of(ground))


def clear(ground: bpy.types.Object) -> None:
    """Take the bake off the ground: it is what it was before, bit for bit. Without a bake nothing happens."""
    trail_detail.remove(ground)
    ground_mesh.restore(ground)


def on_detail(
    ground: bpy.types.Object, pressed: PressedGround, terrain: Any, spacing: float, unit_scale: float
) -> Place:
    """Refine the ground along the trail; a bake that lies on the ground itself is taken off."""
    ground_mesh.restore(ground)
    detail = trail_detail.refine_ground(ground, trail_detail.region_of(pressed), spacing, unit_scale)
    surface = ground_mesh.undisturbed_surface(detail, unit_scale)
    index = surface.pressed_vertices(pressed, terrain)
    return Place(detail, index, surface.vertices[index])


def on_itself(ground: bpy.types.Object, index: Indices, vertices: Array) -> Place:
    """The ground itself; a detail that stood in for it is taken away."""
    trail_detail.remove(ground)
    return Place(ground, index, vertices[index])


def write(
    place: Place,
    pressed: PressedGround,
    over_time: Histories,
    stored: bytes,
    *,
    unit_scale: float,
    shape_keys: bool = True,
) -> None:
    """Put a bake on its place: the finished ground, the record, and the playback.

    Parameters
    ----------
    place : Place
    pressed : PressedGround
        The finished ground.
    over_time : Histories
        Of the place's positions.
    stored : bytes
        The footprints, from `core.record`.
    unit_scale : float
        Metres per Blender unit.
    shape_keys : bool
        See `ground_mesh.write`.
    """
    sample = pressed.sample(*place.position[:, :2].T)
    ground_mesh.write(place.carrier, place.index, sample, stored, unit_scale, shape_keys=shape_keys)
    up = ground_mesh.up_of(place.carrier, unit_scale)
    playback.install(place.carrier, place.index, over_time, up=up, frame_rate=pressed.frame_rate)


def load(ground: bpy.types.Object) -> tuple[list[Footprint], dict[str, Any]]:
    """The record of a ground's bake: its footprints, and what is known about them.

    Raises
    ------
    InputError
        If there is no bake, or its record is damaged or no longer fits the mesh.
    """
    mesh = ground_mesh.mesh_of(carrier_of(ground))
    stored = mesh.get(ground_mesh.RECORD)
    if stored is None:
        raise InputError(f"There is no bake on ground '{ground.name}': press Bake Footprints first.")
    try:
        content = bytes(memoryview(stored))
    except TypeError:
        raise InputError(
            f"The stored record of the footprints on '{ground.name}' was replaced by something else: clear the bake "
            "and bake again."
        ) from None
    footprints, about = record.load(content)
    return footprints, dict(about)


def blur_sigma_of(about: dict[str, Any]) -> float:
    """Standard deviation of the display blur that a bake was made with [m].

    Raises
    ------
    InputError
        If the record does not say.
    """
    try:
        return float(about["inputs"]["material"]["blur_sigma"])
    except (KeyError, TypeError, ValueError):
        raise InputError(
            "The stored record of the footprints lacks its material: clear the bake and bake again."
        ) from None
