"""*Give Way* on a scatter of the user's: one modifier behind theirs, set to what the scatter is."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any, cast

import bpy
import numpy as np

from ...core.plants.bending import PLANTS
from .. import compat, mesh_arrays
from ..nodes.node_modifiers import named_by_nodes, nodes_of, set_inputs
from ..rigs.object_data import mesh_of
from . import give_way_nodes as nodes
from .trampling_table import TRAMPLED_ON, modifier_of, plants_of

MODIFIER = nodes.GROUP
LITTER = {"LITTER": 0.0, "PEBBLES": 0.12}
"""Kinds of what lies on the ground, and how far they roll where it is hard [m]."""
SCATTERS = ("MESH", "CURVES")
"""Types of objects that give way."""
_BY_COPY = "softground_by_copy"
"""Property of a table: True while a copy of its ground shows the prints."""
_SHAPES = ("MESH", "CURVE", "CURVES", "SURFACE")
_TALL = 95
"""Percentile of heights that is taken for that of the scatter: a few that are taller pass for grass that is moved."""


def put(
    objects: Sequence[bpy.types.Object], kind: str, table: bpy.types.Object, grounds: Collection[bpy.types.Object]
) -> None:
    """Have objects give way, behind their own modifiers; those that do get the values of a preset.

    All are measured first: after each change Blender evaluates them all anew.

    Parameters
    ----------
    kind : str
        Key of `PLANTS` or `LITTER`.
    table : bpy.types.Object
        From `trampling_table`.
    grounds : collection of bpy.types.Object
        The objects that show the prints.
    """
    follow(table, grounds)
    instances = _instances_of(objects)
    heights = [_height_of(obj, instances[obj]) for obj in objects]
    for obj, height in zip(objects, heights, strict=True):
        is_loose = obj.type == "MESH" and obj not in grounds and not instances[obj]
        _put(obj, kind, table, height, {"Loose Parts": is_loose, **_following(obj, grounds)})


def follow(table: bpy.types.Object, grounds: Collection[bpy.types.Object]) -> None:
    """Have plants sink or not, as they follow `grounds`, where a copy of the ground now shows the prints or no more."""
    by_copy = table[TRAMPLED_ON] not in grounds
    if table.get(_BY_COPY, False) == by_copy:
        return
    table[_BY_COPY] = by_copy
    for obj in plants_of(table):
        set_inputs(modifier_of(obj), _following(obj, grounds))
        obj.update_tag()


def _following(obj: bpy.types.Object, grounds: Collection[bpy.types.Object]) -> Mapping[str, Any]:
    """Inputs that go by whether a scatter goes with the prints by itself."""
    follows = _follows(obj, grounds)
    return {"Sinks": not follows, "Surface": getattr(obj.data, "surface", None) if follows else None}


def _put(obj: bpy.types.Object, kind: str, table: bpy.types.Object, height: float, others: Mapping[str, Any]) -> None:
    unit_scale = bpy.context.scene.unit_settings.scale_length
    modifier = modifier_of(obj)
    if modifier is None:
        modifier = cast("Any", obj.modifiers.new(MODIFIER, "NODES"))
        modifier.node_group = nodes.ensure_group()
        modifier.show_in_editmode = False
    plant = PLANTS.get(kind, PLANTS["MEADOW"])[1]
    values = {
        "Table": table,
        "Height": height or plant.height / unit_scale,
        "Stiffness": plant.stiffness,
        "Recovery": plant.recovery,
        "Breaks": plant.breaks,
        "Half After": plant.half_after,
        "Stands": kind not in LITTER,
        "Rolls": LITTER.get(kind, 0.0) / unit_scale,
        **others,
    }
    set_inputs(modifier, values)
    obj.update_tag()


def _follows(obj: bpy.types.Object, grounds: Collection[bpy.types.Object]) -> bool:
    """True if a scatter goes with the prints by itself, as it is made on what shows them."""
    if obj in grounds:
        return True
    on_surface = getattr(obj.data, "surface", None) in grounds
    for modifier in obj.modifiers:
        if not isinstance(modifier, bpy.types.NodesModifier) or modifier.node_group is None:
            continue
        named = [*named_by_nodes(modifier), *(value for _, value in compat.node_inputs(modifier))]
        deforms = any(node.bl_idname == "GeometryNodeDeformCurvesOnSurface" for node in nodes_of(modifier))
        if any(isinstance(block, bpy.types.Object) and block in grounds for block in named) or (on_surface and deforms):
            return True
    return False


def _instances_of(objects: Sequence[bpy.types.Object]) -> dict[bpy.types.Object, list[float]]:
    """Heights of the instances that each object makes [Blender units]."""
    graph = bpy.context.evaluated_depsgraph_get()
    heights: dict[bpy.types.Object, list[float]] = {obj: [] for obj in objects}
    for instance in graph.object_instances:
        if instance.is_instance and instance.parent and instance.parent.original in heights:
            shape = instance.instance_object
            corners = shape.bound_box if shape and shape.type in _SHAPES else ()
            top = max((corner[2] for corner in corners), default=0.0)
            heights[instance.parent.original].append(top * instance.matrix_world.to_scale().z)
    return heights


def _height_of(obj: bpy.types.Object, instances: Sequence[float]) -> float:
    """Height of what an object scatters [Blender units]; 0 where that cannot be told."""
    if instances:
        return float(np.percentile(instances, _TALL))
    scale = obj.matrix_world.to_scale().z
    if obj.type == "MESH":
        up = mesh_arrays.positions(mesh_of(obj))[:, 2]
        return scale * float(np.ptp(up)) if len(up) else 0.0
    curves: Any = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    if not len(curves.curves):
        return 0.0
    height = np.empty(len(curves.points) * 3, np.float32)
    curves.attributes["position"].data.foreach_get("vector", height)
    height = height[2::3]
    first = np.empty(len(curves.curves), np.int32)
    curves.curves.foreach_get("first_point_index", first)
    return scale * float(np.percentile(np.maximum.reduceat(height, first) - height[first], _TALL))
