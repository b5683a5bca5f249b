"""Playing a bake on the ground: its record as vertex attributes, and the modifier that adds them up over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, cast

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.histories import Histories, Visits
from ..core.ramps import Ramps
from . import playback_nodes as nodes
from .playback_nodes import numbered

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

MODIFIER = "SoftGround Playback"

PER_LAYER = 3
"""Ramps in one layer: a vector attribute holds one number of each."""

NO_VISIT = 1e9
"""Frame of visits that never come."""

_NAMES = (nodes.MOVED, nodes.SPAN, nodes.VISITED, nodes.PRESSURE)
_NUMBERED = (*nodes.HEIGHTS, *nodes.COMPRESSIONS, nodes.VISIT)
_VALUE = {"FLOAT": "value", "BOOLEAN": "value", "FLOAT_VECTOR": "vector"}


def install(
    ground: bpy.types.Object, index: Indices, histories: Histories, *, up: Array, frame_rate: float
) -> bpy.types.Modifier:
    """Put the playback on a ground, in place of the one that may be there.

    The ground must carry its undisturbed positions (`ground_mesh.write`). The modifier comes first, so that the
    user's own modifiers work on the ground as it is at the time.

    Parameters
    ----------
    ground : bpy.types.Object
    index : (K,) int array
        Vertices that the histories' places stand for.
    histories : Histories
    up : (3,) float array
        World up in the ground's own space and units, of the length of one metre.
    frame_rate : float
        Scene frames per second [Hz].
    """
    remove(ground)
    mesh = cast("bpy.types.Mesh", ground.data)
    _write_spans(mesh, index, histories)
    group = nodes.build(
        height_layers=_write_ramps(mesh, index, histories.heights, nodes.HEIGHTS),
        compression_layers=_write_ramps(mesh, index, histories.compression, nodes.COMPRESSIONS),
        visits=_write_visits(mesh, index, histories.visits),
        up=up.tolist(),
        frame_rate=frame_rate,
    )
    modifier: Any = ground.modifiers.new(MODIFIER, "NODES")
    modifier.node_group = group
    modifier.show_in_editmode = False
    modifier.show_expanded = False
    ground.modifiers.move(len(ground.modifiers) - 1, 0)
    return modifier


def modifier_of(ground: bpy.types.Object) -> bpy.types.Modifier | None:
    """The ground's playback, whatever its name has become."""
    for modifier in ground.modifiers:
        group = getattr(modifier, "node_group", None)
        if group is not None and group.name.split(".")[0] == nodes.GROUP:
            return modifier
    return None


def remove(ground: bpy.types.Object) -> None:
    """Take the playback off a ground; nothing happens where there is none."""
    while modifier := modifier_of(ground):
        group = cast("Any", modifier).node_group
        ground.modifiers.remove(modifier)
        if not group.users:
            bpy.data.node_groups.remove(group)
    mesh = cast("bpy.types.Mesh", ground.data)
    for name in [attribute.name for attribute in mesh.attributes]:
        if is_playback_attribute(name):
            mesh.attributes.remove(mesh.attributes[name])


def is_playback_attribute(name: str) -> bool:
    """Whether an attribute of this name belongs to the playback."""
    return name in _NAMES or name.rpartition("_")[0] in _NUMBERED


def moved_vertices(mesh: bpy.types.Mesh) -> Indices:
    """Vertices that the playback moves, (K,)."""
    attribute: Any = mesh.attributes.get(nodes.MOVED)
    if attribute is None:
        return np.zeros(0, dtype=np.intp)
    moves = np.empty(len(attribute.data), dtype=bool)
    attribute.data.foreach_get("value", moves)
    return np.flatnonzero(moves)


def _write_spans(mesh: bpy.types.Mesh, index: Indices, histories: Histories) -> None:
    """Store which vertices the bake moves, from when to when, and how far in all."""
    spans = np.zeros((len(mesh.vertices), 3))
    spans[:, 0], spans[:, 1] = np.inf, -np.inf
    for part in (histories.heights, histories.compression, histories.visits):
        np.minimum.at(spans[:, 0], index[part.point], part.start)
        np.maximum.at(spans[:, 1], index[part.point], part.end)
    moved = np.isfinite(spans[:, 0])
    spans[~moved] = 0.0
    np.add.at(spans[:, 2], index[histories.heights.point], histories.heights.change)
    _store(mesh, nodes.MOVED, "BOOLEAN", moved)
    _store(mesh, nodes.SPAN, "FLOAT_VECTOR", spans.astype(np.float32))


def _write_ramps(mesh: bpy.types.Mesh, index: Indices, ramps: Ramps, names: Sequence[str]) -> int:
    """Store ramps in layers; returns how many layers there are."""
    layer, place = np.divmod(ramps.rank(), PER_LAYER)
    count = int(layer.max(initial=-1)) + 1
    for number in range(count):
        chosen = layer == number
        vertex = index[ramps.point[chosen]]
        for name, values in zip(names, (ramps.start, ramps.end, ramps.change), strict=True):
            vectors = np.zeros((len(mesh.vertices), PER_LAYER), dtype=np.float32)
            vectors[vertex, place[chosen]] = values[chosen]
            _store(mesh, numbered(name, number), "FLOAT_VECTOR", vectors)
    return count


def _write_visits(mesh: bpy.types.Mesh, index: Indices, visits: Visits) -> int:
    """Store the contacts; returns the largest number of one vertex."""
    rank = visits.rank()
    count = int(rank.max(initial=-1)) + 1
    if count:
        visited = np.zeros(len(mesh.vertices), dtype=bool)
        visited[index[visits.point]] = True
        _store(mesh, nodes.VISITED, "BOOLEAN", visited)
        _store(mesh, nodes.PRESSURE, "FLOAT", np.zeros(len(mesh.vertices), dtype=np.float32))
    latest = np.full(len(mesh.vertices), -np.inf)
    for number in range(count):
        chosen = rank == number
        vertex = index[visits.point[chosen]]
        # Soles may leave in another order than they came.
        latest[vertex] = np.maximum(latest[vertex], visits.end[chosen])
        vectors = np.zeros((len(mesh.vertices), 3), dtype=np.float32)
        vectors[:, :2] = NO_VISIT
        vectors[vertex] = np.stack([visits.start[chosen], latest[vertex], visits.pressure[chosen]], axis=-1)
        _store(mesh, numbered(nodes.VISIT, number), "FLOAT_VECTOR", vectors)
    return count


def _store(
    mesh: bpy.types.Mesh, name: str, kind: Literal["FLOAT", "BOOLEAN", "FLOAT_VECTOR"], values: NDArray[Any]
) -> None:
    """A new point attribute; the one that the user has active stays so."""
    active = mesh.attributes.active_index
    attribute: Any = mesh.attributes.new(name, kind, "POINT")
    attribute.data.foreach_set(_VALUE[kind], values.ravel())
    mesh.attributes.active_index = active
