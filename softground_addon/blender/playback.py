"""Playing a bake on the ground: its record as a table, and the modifier that looks it up over time."""

from __future__ import annotations

from typing import Any, Literal, cast

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.timelines import Timelines
from . import playback_nodes as nodes

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

MODIFIER = "SoftGround Playback"

TABLE = "SoftGround Timelines"

_ATTRIBUTES = (nodes.MOVED, nodes.ACTIVE, nodes.SPAN, nodes.FIRST_ROW, nodes.LAST_ROW, nodes.PRESSURE)
_VALUE = {"FLOAT": "value", "INT": "value", "BOOLEAN": "value", "FLOAT_VECTOR": "vector"}


def install(
    ground: bpy.types.Object, index: Indices, table: Timelines, *, up: Array, frame_rate: float
) -> bpy.types.Modifier:
    """Put the playback on a ground, in place of the one that may be there.

    The ground must carry its undisturbed positions (`ground_mesh.write`). The modifier comes first, so that the
    user's own modifiers work on the ground as it is at the time.

    Parameters
    ----------
    ground : bpy.types.Object
    index : (K,) int array
        Vertices that the places of the timelines stand for.
    table : Timelines
    up : (3,) float array
        World up in the ground's own space and units, of the length of one metre.
    frame_rate : float
        Scene frames per second [Hz].
    """
    remove(ground)
    _write_spans(cast("bpy.types.Mesh", ground.data), index, table)
    group = nodes.build(
        table=_table_object(table), bisections=max(table.longest.bit_length(), 1), up=up.tolist(), frame_rate=frame_rate
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
            _remove_group(group)
    mesh = cast("bpy.types.Mesh", ground.data)
    for name in [attribute.name for attribute in mesh.attributes]:
        if is_playback_attribute(name):
            mesh.attributes.remove(mesh.attributes[name])


def _remove_group(group: bpy.types.NodeTree) -> None:
    table = nodes.table_of(group)
    bpy.data.node_groups.remove(group)
    if table is not None and not table.users:
        mesh = cast("bpy.types.Mesh", table.data)
        bpy.data.objects.remove(table)
        bpy.data.meshes.remove(mesh)


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


def _write_spans(mesh: bpy.types.Mesh, index: Indices, table: Timelines) -> None:
    """Store which vertices the bake moves, from when to when, how far in all, and where their rows are."""
    vertex = index[table.point]
    last = table.first[1:] - 1
    moved = np.zeros(len(mesh.vertices), dtype=bool)
    moved[vertex] = True
    spans = np.zeros((len(moved), 3), dtype=np.float32)
    spans[vertex] = np.stack([table.frame[table.first[:-1]], table.frame[last], table.height[last]], axis=-1)
    _store(mesh, nodes.MOVED, "BOOLEAN", moved)
    _store(mesh, nodes.ACTIVE, "BOOLEAN", np.zeros_like(moved))  # what is there is overwritten faster than made
    _store(mesh, nodes.SPAN, "FLOAT_VECTOR", spans)
    _store(mesh, nodes.PRESSURE, "FLOAT", np.zeros(len(moved), dtype=np.float32))
    for name, rows in ((nodes.FIRST_ROW, table.first[:-1]), (nodes.LAST_ROW, last)):
        numbers = np.zeros(len(moved), dtype=np.int32)
        numbers[vertex] = rows
        _store(mesh, name, "INT", numbers)


def _table_object(table: Timelines) -> bpy.types.Object:
    """The table as the vertices of a mesh that is in no scene."""
    mesh = bpy.data.meshes.new(TABLE)
    mesh.vertices.add(len(table.frame))
    rows = np.stack([table.frame, table.height, table.compression], axis=-1).astype(np.float32)
    contacts = np.stack([table.visit_start, table.visit_end, table.pressure], axis=-1).astype(np.float32)
    if len(rows):  # a mesh without vertices has no positions either
        position: Any = mesh.attributes["position"]
        position.data.foreach_set("vector", rows.ravel())
    _store(mesh, nodes.CONTACT, "FLOAT_VECTOR", contacts)
    return bpy.data.objects.new(TABLE, mesh)


def _store(
    mesh: bpy.types.Mesh, name: str, kind: Literal["FLOAT", "INT", "BOOLEAN", "FLOAT_VECTOR"], values: NDArray[Any]
) -> None:
    """A new point attribute; the one that the user has active stays so."""
    active = mesh.attributes.active_index
    attribute: Any = mesh.attributes.new(name, kind, "POINT")
    attribute.data.foreach_set(_VALUE[kind], values.ravel())
    mesh.attributes.active_index = active
