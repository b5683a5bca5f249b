"""Playing a bake on the ground: its record as splines over time, and the modifier that samples them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, cast

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.numerics.arrays import Array, Indices
from ...core.playback.keyframe_tables import NO_CONTACT
from ...core.playback.playback_curves import PlaybackCurves, Spans
from .. import mesh_arrays
from ..compat import straighten
from ..drafts import none_left_if_it_fails
from ..nodes.node_modifiers import modifier_with, put, showing
from ..rigs.object_data import mesh_of
from ..settings import find, name_of, resolve
from . import own_data
from . import playback_nodes as nodes

MODIFIER = nodes.GROUP

TABLE = "SoftGround KeyframeTables"

_TYPE = {"FLOAT": np.float32, "INT": np.int32, "BOOLEAN": np.bool_}

FEW = 1 / 64
"""Part of the vertices that is worth looking up whole: a look-up takes about as long as 60 comparisons."""


@contextmanager
def keyframe_tables(lines: PlaybackCurves, position: NDArray[np.float32]) -> Iterator[bpy.types.Object]:
    """An object that holds keyframe tables as splines in no scene; taken away if nothing comes to use it.

    The points' positions are unpacked already.
    """
    name = name_of(_table_object(lines, position))
    del lines, position  # they are large, and all is in the table
    try:
        yield resolve(name)
    finally:
        if (table := find(name)) is not None and not table.users:
            _remove_table(table)


def attach(
    ground: bpy.types.Object,
    vertices: Indices,
    spans: Spans,
    table: bpy.types.Object,
    *,
    up: Array,
) -> bpy.types.Modifier:
    """Let keyframe_tables play a ground, in place of those that may play it.

    The ground must carry its undisturbed positions and stand finished (`ground_mesh.write`). The modifier comes first,
    so that the user's own modifiers work on the ground as it is at the time.

    Parameters
    ----------
    vertices : (P,) int array
        Vertex of its mesh that each of the spans is of.
    table : bpy.types.Object
        The curves that these lie on, from `keyframe_tables`.
    up : (3,) float array
        World up in the ground's own space and units, of the length of one metre.
    """
    remove(ground)
    mesh = mesh_of(ground)
    _write_attributes(mesh, vertices, spans)
    group = nodes.build(
        table=table,
        up=up.tolist(),
        frame_rate=spans.frame_rate,
        few=len(vertices) < FEW * len(mesh.vertices),
        settled=mesh.shape_keys is None,
    )
    return play(ground, group)


def play(ground: bpy.types.Object, group: bpy.types.NodeTree) -> Any:
    """Have an object play a node group by a modifier of its own, the first."""
    modifier = put(ground, MODIFIER, group, 0)
    modifier.show_expanded = False
    return modifier


NEED_THE_MESH = ("MULTIRES", "SOFT_BODY")
"""Modifiers that take the mesh as it is, and let Blender put none that makes geometry before them."""


def barrier_on(ground: bpy.types.Object) -> bpy.types.Modifier | None:
    """A modifier that keeps the playback from coming first, as it must."""
    return next((modifier for modifier in ground.modifiers if modifier.type in NEED_THE_MESH), None)


def modifier_of(ground: bpy.types.Object) -> bpy.types.NodesModifier | None:
    """The ground's playback, whatever the names of the modifier and its node group have become."""
    return modifier_with(ground, nodes.is_playback)


def playing(ground: bpy.types.Object) -> list[tuple[bpy.types.Object, Any]]:
    """The objects that show a ground's mesh and play it, the ground or copies of it, each with its modifier."""
    return [(shown, modifier) for shown in showing(ground) if (modifier := modifier_of(shown))]


def remove(ground: bpy.types.Object) -> None:
    """Take the playback off a ground and copies of it with the same mesh; nothing happens where there is none."""
    for shown, _ in playing(ground):
        _stop(shown)
    remove_unused()
    own_data.remove(mesh_of(ground), own_data.OF_PLAYBACK)


def hand_over(source: bpy.types.Object, target: bpy.types.Object) -> None:
    """Have an object play what another one plays, under the name of what it played; its mesh is left alone."""
    new, old = cast("Any", (modifier_of(source), modifier_of(target)))
    name = old.node_group.name if old else ""
    _stop(target)
    remove_unused()
    if new is not None:
        play(target, new.node_group)
        new.node_group.name = name or new.node_group.name


def _stop(obj: bpy.types.Object) -> None:
    """Take the playback off one object."""
    while modifier := modifier_of(obj):
        obj.modifiers.remove(modifier)


def remove_unused() -> None:
    """Remove what nobody plays any more, also of a modifier that the user has deleted."""
    for group in [
        item for item in bpy.data.node_groups if nodes.is_playback(item) and not (item.users or item.library)
    ]:
        _remove_group(group)


def _remove_group(group: bpy.types.NodeTree) -> None:
    table = nodes.table_of(group)
    bpy.data.node_groups.remove(group)
    if table is not None and not table.users:
        _remove_table(table)


def _remove_table(table: bpy.types.Object) -> None:
    splines: Any = table.data
    bpy.data.objects.remove(table)
    bpy.data.hair_curves.remove(splines)


def moves(mesh: bpy.types.Mesh) -> NDArray[np.bool_] | None:
    """True if the playback moves each vertex, (V,); None where there is none."""
    attribute: Any = mesh.attributes.get(nodes.MOVED)
    if attribute is None or (attribute.domain, attribute.data_type) != ("POINT", "BOOLEAN"):
        return None
    moved = np.empty(len(attribute.data), dtype=bool)
    attribute.data.foreach_get("value", moved)
    return moved


def moved_vertices(mesh: bpy.types.Mesh) -> Indices:
    """Vertices that the playback moves, (K,)."""
    moved = moves(mesh)
    return np.zeros(0, dtype=np.intp) if moved is None else np.flatnonzero(moved)


def _write_attributes(mesh: bpy.types.Mesh, vertex: Indices, spans: Spans) -> None:
    """Store of which vertices (P,) the spans are."""
    for name, kind, values, elsewhere in (
        (nodes.MOVED, "BOOLEAN", True, False),
        (nodes.START, "FLOAT", spans.start, -NO_CONTACT),
        (nodes.END, "FLOAT", spans.end, -NO_CONTACT),
        (nodes.SPLINE, "INT", spans.curve, 0),
        (nodes.OFFSET, "FLOAT", spans.offset, 0.0),
        (nodes.LAST_CONTACT, "FLOAT", spans.last_contact, NO_CONTACT),
        # What is there is overwritten faster than made.
        (nodes.PRESSURE, "FLOAT", 0.0, 0.0),
        *([(nodes.LAST_HEIGHT, "FLOAT", spans.last_height, 0.0)] if mesh.shape_keys else []),
    ):
        whole = np.full(len(mesh.vertices), elsewhere, dtype=_TYPE[kind])
        whole[vertex] = values
        own_data.attribute(mesh, name, kind).data.foreach_set("value", whole)


@none_left_if_it_fails()
def _table_object(lines: PlaybackCurves, position: NDArray[np.float32]) -> bpy.types.Object:
    """The curves as splines."""
    splines = bpy.data.hair_curves.new(TABLE)
    if len(lines.size):
        splines.add_curves(lines.size.tolist())
        attribute: Any = splines.attributes["position"]
        attribute.data.foreach_set("vector", position.ravel())
    mesh_arrays.add_attributes(splines, [(nodes.CONTACT, "FLOAT", lines.contact.unpacked())])
    if len(lines.size):
        straighten(splines)
    return bpy.data.objects.new(TABLE, splines)
