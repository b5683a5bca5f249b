"""Playing a bake on the ground: its record as splines over time, and the modifier that samples them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, cast

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.polylines import Polylines
from . import playback_nodes as nodes
from .compat import straighten

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

MODIFIER = "SoftGround Playback"

TABLE = "SoftGround Timelines"

_ATTRIBUTES = (nodes.MOVED, nodes.SPLINE, nodes.PRESSURE)
_VALUE = {"FLOAT": "value", "INT": "value", "BOOLEAN": "value", "FLOAT_COLOR": "color"}


@contextmanager
def player(lines: Polylines, *, up: Array, frame_rate: float) -> Iterator[bpy.types.NodeTree]:
    """The node group that plays timelines; it is taken away at the end if nothing has come to use it.

    Parameters
    ----------
    lines : Polylines
    up : (3,) float array
        World up in the ground's own space and units, of the length of one metre.
    frame_rate : float
        Frames of the table per second [Hz].
    """
    group = nodes.build(table=_table_object(lines), up=up.tolist(), frame_rate=frame_rate)
    try:
        yield group
    finally:
        if not group.users:
            _remove_group(group)


def attach(ground: bpy.types.Object, vertices: Indices, group: bpy.types.NodeTree) -> bpy.types.Modifier:
    """Let a group from `player` play a ground, in place of the one that may play it.

    The ground must carry its undisturbed positions (`ground_mesh.write`). The modifier comes first, so that the
    user's own modifiers work on the ground as it is at the time.

    Parameters
    ----------
    ground : bpy.types.Object
    vertices : (P,) int array
        Vertex of its mesh that each of the group's splines plays.
    group : bpy.types.NodeTree
    """
    remove(ground)
    _write_splines(cast("bpy.types.Mesh", ground.data), vertices)
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
            _remove_group(group)
    mesh = cast("bpy.types.Mesh", ground.data)
    for name in [attribute.name for attribute in mesh.attributes]:
        if is_playback_attribute(name):
            mesh.attributes.remove(mesh.attributes[name])


def _remove_group(group: bpy.types.NodeTree) -> None:
    table = nodes.table_of(group)
    bpy.data.node_groups.remove(group)
    if table is not None and not table.users:
        splines: Any = table.data
        bpy.data.objects.remove(table)
        bpy.data.hair_curves.remove(splines)


def is_playback_attribute(name: str) -> bool:
    """Whether an attribute of this name belongs to the playback."""
    return name in _ATTRIBUTES


def moved_vertices(mesh: bpy.types.Mesh) -> Indices:
    """Vertices that the playback moves, (K,)."""
    attribute: Any = mesh.attributes.get(nodes.MOVED)
    if attribute is None:
        return np.zeros(0, dtype=np.intp)
    moves = np.empty(len(attribute.data), dtype=bool)
    attribute.data.foreach_get("value", moves)
    return np.flatnonzero(moves)


def _write_splines(mesh: bpy.types.Mesh, vertex: Indices) -> None:
    """Store which vertices the bake moves, one per spline (P,)."""
    moved = np.zeros(len(mesh.vertices), dtype=bool)
    moved[vertex] = True
    number = np.zeros(len(moved), dtype=np.int32)
    number[vertex] = np.arange(len(vertex))
    active = mesh.attributes.active_index
    _store(mesh, nodes.MOVED, "BOOLEAN", moved)
    _store(mesh, nodes.SPLINE, "INT", number)
    # What is there is overwritten faster than made.
    _store(mesh, nodes.PRESSURE, "FLOAT", np.zeros(len(moved), dtype=np.float32))
    mesh.attributes.active_index = active  # the one that the user has active stays so


def _table_object(lines: Polylines) -> bpy.types.Object:
    """The timelines as the splines of an object that is in no scene."""
    splines = bpy.data.hair_curves.new(TABLE)
    size = np.diff(lines.first)
    if len(size):
        splines.add_curves(size.tolist())
        position = np.zeros((len(lines.frame), 3), dtype=np.float32)
        position[:, 0] = lines.frame
        along: Any = splines.attributes["position"]
        along.data.foreach_set("vector", position.ravel())
    _store(splines, nodes.STATE, "FLOAT_COLOR", lines.state)
    last = lines.state[lines.first[1:] - 1]
    for name, kind, values in (
        (nodes.STATE_NOW, "FLOAT_COLOR", last),
        (nodes.START, "FLOAT", lines.start),
        (nodes.END, "FLOAT", lines.end),
    ):
        _store(splines, name, kind, values, domain="CURVE")
    if len(size):
        straighten(splines)
    return bpy.data.objects.new(TABLE, splines)


def _store(geometry: Any, name: str, kind: str, values: NDArray[Any], *, domain: str = "POINT") -> None:
    attribute: Any = geometry.attributes.new(name, kind, domain)
    attribute.data.foreach_set(_VALUE[kind], values.ravel())
