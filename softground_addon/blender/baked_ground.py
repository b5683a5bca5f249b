"""A bake on a ground, wherever it lies: on the user's own mesh, or on the detail that stands in for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core import record
from ..core.errors import InputError
from ..core.footprints import Footprint
from ..core.heightfield import Terrain
from ..core.histories import Histories
from ..core.pressed_ground import GroundSample, PressedGround
from ..core.timelines import timelines
from . import created_ground, ground_mesh, playback, trail_detail
from .created_ground import Layout
from .jobs import Job, Progress

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Place:
    """Where a bake is to be written. Nothing that the user sees is changed before `publish`.

    Attributes
    ----------
    index : (K,) int array
        Vertices of the carrier's mesh that the bake moves.
    position : (K, 3) float array
        Their undisturbed world positions [m].
    publish : callable
        Takes away what stands there now, and returns the carrier: the object that takes the prints.
    draft : bpy.types.Object, optional
        The carrier where it is a new object, in no scene yet.
    """

    index: Indices
    position: Array
    publish: Callable[[], bpy.types.Object]
    draft: bpy.types.Object | None = None


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


def on_created(scene: bpy.types.Scene, draft: bpy.types.Object, layout: Layout, pressed: PressedGround) -> Place:
    """A ground that is not in the scene yet."""

    def publish() -> bpy.types.Object:
        created_ground.publish(scene, draft)
        return draft

    index = np.flatnonzero(pressed.covers(*layout.vertices[:, :2].T))
    return Place(index, layout.vertices[index], publish, draft)


def on_detail(
    ground: bpy.types.Object, draft: bpy.types.Object, vertices: Array, pressed: PressedGround, terrain: Terrain
) -> Place:
    """The ground refined along the trail; a bake that lies on the ground itself is taken off.

    Parameters
    ----------
    ground : bpy.types.Object
    draft : bpy.types.Object
        A draft of the refined ground.
    vertices : (V, 3) float array
        World positions of its vertices [m].
    pressed : PressedGround
    terrain : Terrain
    """

    def publish() -> bpy.types.Object:
        ground_mesh.restore(ground)
        return trail_detail.publish(ground, draft)

    index = ground_mesh.pressed_vertices(vertices, pressed, terrain)
    is_first = trail_detail.detail_of(ground) is None
    return Place(index, vertices[index], publish, draft if is_first else None)


def on_itself(ground: bpy.types.Object, index: Indices, vertices: Array) -> Place:
    """The ground itself; a detail that stood in for it is taken away."""

    def publish() -> bpy.types.Object:
        trail_detail.remove(ground)
        return ground

    return Place(index, vertices[index], publish)


def write(
    place: Place,
    sample: GroundSample,
    over_time: Histories,
    stored: bytes,
    *,
    frame_rate: float,
    unit_scale: float,
    shape_keys: bool = True,
) -> Job[bpy.types.Object]:
    """Put a bake on its place: the finished ground, the record, and the playback. Returns what carries it.

    What is there already is written in the last step, a new object in steps before it gets into the scene.

    Parameters
    ----------
    place : Place
    sample : GroundSample
        The finished ground at the place's positions.
    over_time : Histories
        Of the place's positions.
    stored : bytes
        The footprints, from `core.record`.
    frame_rate : float
        Scene frames per second [Hz].
    unit_scale : float
        Metres per Blender unit.
    shape_keys : bool
        See `ground_mesh.write`.

    Raises
    ------
    InputError
        If there is more than can be played; nothing is written then.
    """
    table = timelines(over_time)
    carrier = place.draft or place.publish()
    ground_mesh.write(carrier, place.index, sample, stored, unit_scale, shape_keys=shape_keys)
    up = ground_mesh.up_of(carrier, unit_scale)
    if place.draft:
        yield Progress("write", 0.9)
    playback.install(carrier, place.index, table, up=up, frame_rate=frame_rate)
    if place.draft:
        yield Progress("write", 0.9)
        place.publish()
    return carrier


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
