"""The table that plants give way by: an object of vertices in no scene, which each bake of its ground writes anew."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ...core.plants.tramplings import Tramplings
from ...core.settings import SceneUnits
from .. import compat, mesh_arrays
from ..drafts import none_left_if_it_fails
from ..nodes.node_modifiers import inputs_of, modifier_with, set_inputs
from ..placement import hang_on
from ..rigs.object_data import mesh_of
from . import give_way_nodes as nodes
from . import trampling_layout as layout

NAME = "SoftGround Tramplings"
TRAMPLED, TRAMPLED_ON = "softground_trampled", "softground_trampled_on"
"""Properties of the ground, its table, and of the table, its ground."""
NEVER = 1e9
"""Frame of passes that never begin."""


def of(ground: bpy.types.Object) -> bpy.types.Object | None:
    """The table of a ground; none of a ground that is a duplicate."""
    table = ground.get(TRAMPLED)
    return table if table is not None and table.get(TRAMPLED_ON) == ground else None


def ensure(ground: bpy.types.Object) -> bpy.types.Object:
    """The table of a ground, empty on first use."""
    table = of(ground)
    if table is None:
        table = bpy.data.objects.new(NAME, bpy.data.meshes.new(NAME))
        table[TRAMPLED_ON], ground[TRAMPLED] = ground, table
        table.parent = ground
    return table


def is_current(ground: bpy.types.Object) -> bool:
    """True if a ground has a table, and what is in it is of this version."""
    table = of(ground)
    return table is not None and mesh_of(table).get(layout.MARK) == layout.VERSION


def is_idle(ground: bpy.types.Object) -> bool:
    """True if a ground has a table and no plants that give way by it any more, told without a walk over all objects.
    Blender 5.2 counts a removed modifier's table for good, but not its group."""
    table = of(ground)
    groups = filter(nodes.is_give_way, bpy.data.node_groups)
    return table is not None and (table.users <= 1 or all(tree.users <= tree.use_fake_user for tree in groups))


def write(table: bpy.types.Object, ground: bpy.types.Object, trampled: Tramplings | None, units: SceneUnits) -> None:
    """Write what soles trample to a ground's table, for plants that all play it by the group of this version."""
    with none_left_if_it_fails():
        vertices = bpy.data.meshes.new(NAME)
        if trampled is not None:
            _fill(vertices, trampled, units)
    _exchange(table, vertices)
    for obj in plants_of(table):
        _play_anew(modifier_of(obj))
    if trampled is not None:
        side = trampled.cell_size / units.unit_scale_m
        origin = trampled.origin / units.unit_scale_m
        hang_on(table, ground, units.frame)
        table.matrix_basis = Matrix.Translation((*origin, 0.0)) @ Matrix.Scale(side, 4)


def clear(ground: bpy.types.Object) -> None:
    """Empty a ground's table, so that plants stand; it goes where no plants are left that give way by it."""
    table = of(ground)
    if table is None:
        return
    if plants_of(table):
        table.modifiers.clear()
        table.animation_data_clear()
        _exchange(table, bpy.data.meshes.new(NAME))
        return
    ground.pop(TRAMPLED, None)
    vertices = mesh_of(table)
    bpy.data.objects.remove(table)
    bpy.data.meshes.remove(vertices)


def modifier_of(obj: bpy.types.Object) -> Any:
    """The modifier by which an object gives way, whatever its name has become; None without one."""
    return modifier_with(obj, nodes.is_give_way)


def plants_of(table: bpy.types.Object) -> list[bpy.types.Object]:
    """Objects of this file that give way by a table."""
    of_file = ((obj, modifier_of(obj)) for obj in bpy.data.objects if obj.library is None)
    return [obj for obj, modifier in of_file if modifier and table in dict(compat.node_inputs(modifier)).values()]


def _play_anew(modifier: Any) -> None:
    """Have a modifier play the group of this version, with what the artist has set, but for one that they edited."""
    if modifier.node_group.get(layout.MARK) != layout.VERSION and not nodes.is_edited(modifier.node_group):
        known = inputs_of(modifier)
        chosen = {name: compat.read_input(modifier, known[name]) for name, *_ in nodes.INPUTS if name in known}
        modifier.node_group = nodes.ensure_group()
        set_inputs(modifier, {name: value for name, value in chosen.items() if value is not None})


def _fill(vertices: bpy.types.Mesh, trampled: Tramplings, units: SceneUnits) -> None:
    """Store the table in the attributes of vertices, lengths in cells: each from the first on, passes from the second,
    as the number of none is 0."""
    stretch, scale, by = units.time_stretch, units.unit_scale_m, trampled.by
    rows, columns = trampled.tiles.shape
    size, side = trampled.cell_size, trampled.tile
    corner_row, corner_column = np.indices((rows, columns))
    pace = 1.0 / (scale * stretch)
    active = trampled.active * stretch
    meta = (
        (columns, side, units.frame_rate * stretch),
        (columns * side - 1, rows * side - 1, active.min()),
        (size / scale, units.gravity_m_s2 / scale, layout.THROWN_FROM / scale),
    )
    is_second = np.ones(len(active) + 1, bool)
    is_second[trampled.first] = False
    arrays: tuple[tuple[str, str, NDArray[Any]], ...] = (
        (layout.META, "FLOAT_VECTOR", np.array(meta)),
        (layout.TILES, "FLOAT", (trampled.tiles - corner_column * side - corner_row * side**2).ravel()),
        (layout.FIRST, "INT", trampled.first + 1),
        (layout.SENT_BY, "INT", _first_to_tread(trampled) + 1),
        (layout.ACTIVE, "FLOAT2", np.column_stack([active, trampled.settled * stretch])),
        (layout.LEAN, "FLOAT2", trampled.direction),
        *(
            (name, "FLOAT_VECTOR", np.column_stack(parts))
            for name, parts in (
                (layout.TIMES, (by.start * stretch, by.end * stretch, by.passes)),
                (layout.PACE, (by.down * pace, by.up * pace, by.above / scale)),
                (layout.SHARES, (by.reach, by.lasting, is_second[:-1])),
                (layout.SINK, (trampled.slope, trampled.sink / size)),
            )
        ),
    )
    vertices[layout.MARK] = layout.VERSION
    count = max(len(values) for _, _, values in arrays) + 2
    vertices.vertices.add(count)
    for name, kind, values in arrays:
        whole = np.full((count, *values.shape[1:]), NEVER if name == layout.ACTIVE else 0, values.dtype)
        begin = int(name not in (layout.META, layout.TILES, layout.FIRST))
        whole[begin : begin + len(values)] = values
        mesh_arrays.add_attributes(vertices, [(name, kind, whole)])


def _first_to_tread(trampled: Tramplings) -> NDArray[np.int64]:
    """Of each pass, the number of the first over its cell that trod on it; without any, its own."""
    slot = np.repeat(np.arange(len(trampled.first) - 1), np.diff(trampled.first))
    number = np.arange(len(slot))
    earliest = np.full(len(trampled.first) - 1, len(slot))
    np.minimum.at(earliest, slot[trampled.by.passes > 0], number[trampled.by.passes > 0])
    return np.where(trampled.by.passes > 0, earliest[slot], number)


def _exchange(table: bpy.types.Object, vertices: bpy.types.Mesh) -> None:
    """Give a table other vertices."""
    old: Any = table.data
    table.data = vertices
    if not old.users:
        bpy.data.meshes.remove(old)
