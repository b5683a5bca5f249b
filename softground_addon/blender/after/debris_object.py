"""The object `SoftGround Debris`: what the steps of a ground's bake throw, put there and taken away."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.after import flight
from ...core.after.debris import Debris
from ...core.settings import SceneUnits
from .. import compat
from ..node_graph import inputs_of, modifier_with
from ..settings import exists
from . import debris_nodes as nodes
from . import debris_shapes

NAME = "SoftGround Debris"
MODIFIER = "SoftGround Debris"
THROWN = "softground_thrown"
"""Property of the ground: its debris."""


@dataclass(frozen=True)
class AtRest:
    """Pieces that lie on the ground.

    Attributes
    ----------
    place : (N, 2) float array
        [m]
    radius : (N,) float array
        [m]
    landed : (N,) float array
        Scene frame at which each came down.
    """

    place: NDArray[np.float64]
    radius: NDArray[np.float64]
    landed: NDArray[np.float64]


_AT_FIRST: dict[str, Any] = {"Wind": (0.0, 0.0, 0.0), "Amount": 1.0, "Shaped": nodes.SHAPED}


def put(
    ground: bpy.types.Object,
    debris: Debris | None,
    *,
    surface: str,
    units: SceneUnits,
) -> bpy.types.Object | None:
    """Let a ground have debris in place of what it may have; None takes that away.

    Parameters
    ----------
    ground : bpy.types.Object
    debris : Debris or None
    surface : str
        See `core.ground.presets.SURFACES`.
    units : SceneUnits
    """
    unit_scale, gravity, time_stretch = units.unit_scale_m, units.gravity_m_s2, units.time_stretch
    older = of(ground)
    kept = _settings_of(older) if older else {}
    remove(ground)
    if debris is None or not len(debris.birth):
        return None
    origin = ground.matrix_world.translation  # of both, or a line would be drawn from one to the other
    points = _points(debris, np.array(origin) * unit_scale, time_stretch, gravity, unit_scale)
    obj = bpy.data.objects.new(NAME, points)
    obj[nodes.MARK] = True
    for collection in ground.users_collection:
        collection.objects.link(obj)
    obj.parent = ground
    obj.matrix_parent_inverse = ground.matrix_world.inverted()
    obj.location = origin
    ground[THROWN] = obj
    shapes = debris_shapes.collection_of(surface)
    group = nodes.build(
        frame_rate=units.frame_rate * time_stretch,
        gravity=gravity,
        unit_scale=unit_scale,
        shapes=shapes,
        material=debris_shapes.material_of(shapes),
    )
    modifier: Any = obj.modifiers.new(MODIFIER, "NODES")
    modifier.node_group = group
    sockets = inputs_of(modifier)
    for name, value in (_AT_FIRST | kept).items():
        compat.write_input(modifier, sockets[name], value)
    return obj


def of(ground: bpy.types.Object) -> bpy.types.Object | None:
    """The debris of a ground's bake; none of a ground that is a duplicate."""
    debris = ground.get(THROWN)
    belongs = exists(debris) and debris.get(nodes.MARK) and debris.parent == ground
    return debris if belongs else None


def field_of(obj: bpy.types.Object, name: str) -> tuple[Any, str] | None:
    """An input of the debris as `layout.prop` takes it: its modifier and the path of the property."""
    modifier = _modifier_of(obj)
    return compat.input_field(modifier, inputs_of(modifier)[name]) if modifier else None


def at_rest(obj: bpy.types.Object, *, frame_rate: float, time_stretch: float, unit_scale: float) -> AtRest:
    """Where the pieces of debris come to rest in the wind of the moment; those that never do are left out.

    Parameters
    ----------
    obj : bpy.types.Object
        From `of`.
    frame_rate, time_stretch, unit_scale
        As of `put`.
    """
    points: Any = obj.data
    count, modifier = len(points.vertices), _modifier_of(obj)

    def values(name: str) -> NDArray[np.float64]:
        found = np.empty(count, np.float32)
        points.attributes[name].data.foreach_get("value", found)
        return found.astype(np.float64)

    place = np.empty(count * 3, np.float32)
    points.vertices.foreach_get("co", place)
    time, drag = values(nodes.FLIGHT), values(nodes.DRAG)
    wind = compat.read_input(modifier, inputs_of(modifier)["Wind"]) if modifier else None
    drift = np.outer(time - flight.coasting(drag, time), tuple(wind or (0.0, 0.0, 0.0))[:2])
    landed = values(nodes.BIRTH) / time_stretch + time * frame_rate
    down = time < flight.LONGEST_FLIGHT - 1e-3
    at = (place.reshape(-1, 3) + np.array(obj.location))[:, :2] * unit_scale + drift
    return AtRest(at[down], values(nodes.RADIUS)[down] * unit_scale, landed[down])


def remove(ground: bpy.types.Object) -> None:
    """Take a ground's debris away; nothing happens where there is none."""
    obj = ground.pop(THROWN, None)
    if obj is not None and obj.get(nodes.MARK) and obj.parent == ground:
        groups = [modifier.node_group for modifier in obj.modifiers if modifier.type == "NODES" and modifier.node_group]
        mesh: Any = obj.data
        bpy.data.objects.remove(obj)
        if mesh is not None and not mesh.users:
            bpy.data.meshes.remove(mesh)
        for group in groups:
            if group.get(nodes.MARK) and not group.users:
                bpy.data.node_groups.remove(group)
        for shapes in [one for one in bpy.data.collections if one.get(nodes.MARK) and not one.users]:
            debris_shapes.remove(shapes)


def _settings_of(obj: bpy.types.Object) -> dict[str, Any]:
    """What the artist set of the older debris: wind, amount, how many are shaped, and shapes of their own."""
    modifier = _modifier_of(obj)
    if modifier is None:
        return {}
    sockets = inputs_of(modifier)
    values = {name: compat.read_input(modifier, sockets[name]) for name in (*_AT_FIRST, "Shapes")}
    if values["Shapes"] is not None and values["Shapes"].get(nodes.MARK):
        values["Shapes"] = None
    # Vectors belong to the modifier, and go with it.
    values["Wind"] = None if values["Wind"] is None else tuple(values["Wind"])
    return {name: value for name, value in values.items() if value is not None}


def _modifier_of(obj: bpy.types.Object) -> Any:
    return modifier_with(obj, lambda group: bool(group.get(nodes.MARK)))


def _points(
    debris: Debris, origin: NDArray[np.float64], time_stretch: float, gravity: float, unit_scale: float
) -> bpy.types.Mesh:
    """Points where the pieces come to rest as seen from an origin (3,) [m], with what lets them fly there."""
    start = debris.start - origin
    rest = flight.position(start, debris.velocity, debris.drag_time, debris.time, gravity)
    rank = np.empty(len(debris.radius))
    rank[np.argsort(-debris.radius, kind="stable")] = np.arange(len(rank))
    order = np.argsort(rank >= nodes.SHAPED, kind="stable")  # then what is seen is one run of points, copied as such
    points = bpy.data.meshes.new(NAME)
    points.vertices.add(len(debris.birth))
    points.vertices.foreach_set("co", (rest / unit_scale)[order].astype(np.float32).ravel())
    columns: tuple[tuple[str, Any, str, Any], ...] = (
        (nodes.BIRTH, "FLOAT", "value", debris.birth * time_stretch),
        (nodes.FLIGHT, "FLOAT", "value", debris.time),
        (nodes.DRAG, "FLOAT", "value", debris.drag_time),
        (nodes.RADIUS, "FLOAT", "value", debris.radius / unit_scale),
        (nodes.RANK, "FLOAT", "value", rank),
        (nodes.START, "FLOAT_VECTOR", "vector", start / unit_scale),
        (nodes.LAUNCH, "FLOAT_VECTOR", "vector", debris.velocity / unit_scale),
        (nodes.KIND, "INT", "value", debris.kind),
        (nodes.STEP, "INT", "value", debris.step),
    )
    for name, kind, field, values in columns:
        attribute: Any = points.attributes.new(name, kind, "POINT")
        attribute.data.foreach_set(field, values[order].astype(np.int32 if kind == "INT" else np.float32).ravel())
    return points
