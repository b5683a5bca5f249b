"""The object `SoftGround Debris`: what the steps of a ground's bake throw, put there and taken away."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, cast

import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

from ...core.debris import flight
from ...core.debris.debris import Debris
from ...core.ground import surfaces
from ...core.rig.recording import SceneUnits
from .. import compat, mesh_arrays
from ..belongings import Belonging, exchange
from ..drafts import none_left_if_it_fails
from ..nodes.node_modifiers import inputs_of, modifier_with, set_inputs
from ..placement import hang_on, matrix_in
from ..rigs.object_data import mesh_of
from ..settings import find, name_of
from . import debris_nodes as nodes
from . import debris_shapes

NAME = MODIFIER = nodes.GROUP
BELONGS = Belonging(nodes.MARK, "softground_thrown", "softground_thrown_by")
of = BELONGS.of
ORIGIN, MADE_FOR = "softground_origin", "softground_made_for"
"""Properties of its points, where their origin was [Blender units], and of its node group, for what it was made."""


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
    of_steps: Mapping[int, str] = MappingProxyType({}),
) -> bpy.types.Object | None:
    """Let a ground have debris in place of what it may have; None takes that away.

    Parameters
    ----------
    of_steps : mapping of int to str
        Surfaces of steps, by their numbers, on a ground with regions.
    """
    older = BELONGS.remaining(ground, wanted=debris is not None and bool(len(debris.birth)))
    _remove_unused()
    if debris is None or not len(debris.birth):
        return None
    before = _origin_of(older) if older else Vector()
    follows = older is None or older.parent == BELONGS.owner_of(older)  # or the user has given it another parent
    its_place = Matrix(matrix_in(units.frame, ground).tolist()) if units.frame else ground.matrix_world
    origin = its_place.translation if follows else before  # of both, or a line would be drawn between them
    modifier: Any = _modifier_of(older) if older else None
    looks = list(dict.fromkeys([surface, *(of_steps[number] for number in sorted(of_steps))]))
    with none_left_if_it_fails():
        points = _points(debris, origin, units, [looks.index(of_steps.get(n, surface)) for n in debris.step.tolist()])
        group = _group_for(modifier and modifier.node_group, looks, units)
    obj = older or bpy.data.objects.new(NAME, points)
    if older:
        exchange(older, points)
    BELONGS.give(ground, obj)
    if follows:
        hang_on(obj, ground, units.frame)
        obj.location += origin - before
    _play(modifier or obj.modifiers.new(MODIFIER, "NODES"), group)
    return obj


def _origin_of(debris: bpy.types.Object) -> Vector:
    """Origin of its points in the world, if the user has not moved it [Blender units]."""
    return Vector(mesh_of(debris).get(ORIGIN, debris.matrix_parent_inverse.inverted().translation))


def field_of(obj: bpy.types.Object, name: str) -> tuple[Any, str] | None:
    """An input of the debris as `layout.prop` takes it: its modifier and the path of the property."""
    modifier = _modifier_of(obj)
    return compat.input_field(modifier, inputs_of(modifier)[name]) if modifier else None


def at_rest(obj: bpy.types.Object, units: SceneUnits) -> AtRest:
    """Places where the pieces of debris (`of`) come to rest in the wind of the moment, without those that never do."""
    points: Any = obj.data
    count, modifier = len(points.vertices), _modifier_of(obj)

    def values(name: str) -> NDArray[np.float64]:
        numbers = np.empty(count, np.float32)
        points.attributes[name].data.foreach_get("value", numbers)
        return numbers.astype(np.float64)

    place = np.empty(count * 3, np.float32)
    points.vertices.foreach_get("co", place)
    time, drag = values(nodes.FLIGHT), values(nodes.DRAG)
    wind = compat.read_input(modifier, inputs_of(modifier)["Wind"]) if modifier else None
    drift = np.outer(time - flight.coasting(drag, time), tuple(wind or (0.0, 0.0, 0.0))[:2])
    landed = values(nodes.BIRTH) / units.time_stretch + time * units.frame_rate
    down = time < flight.LONGEST_FLIGHT - 1e-3
    at = (place.reshape(-1, 3) + np.array(_origin_of(obj)))[:, :2] * units.unit_scale_m + drift
    return AtRest(at[down], values(nodes.RADIUS)[down] * units.unit_scale_m, landed[down])


class Pieces:
    """The pieces of debris, of which some are not shown for a while.

    Attributes
    ----------
    place : (N, 2) float array
        Where they come to rest without wind [m].
    step : (N,) int array
        Number of the step that threw each.
    """

    def __init__(self, debris: bpy.types.Object, unit_scale: float) -> None:
        points = mesh_of(debris)
        at = mesh_arrays.positions(points).astype(np.float64) + np.array(_origin_of(debris))
        self._name, self.place = name_of(debris), at[:, :2] * unit_scale
        self._radius, self.step = np.empty(len(at), np.float32), np.empty(len(at), np.int32)
        for name, values in ((nodes.RADIUS, self._radius), (nodes.STEP, self.step)):
            cast("Any", points.attributes[name]).data.foreach_get("value", values)

    def hide(self, hidden: NDArray[np.bool_]) -> None:
        """Show all but some of them (N,)."""
        if (debris := find(self._name)) is not None:
            points = mesh_of(debris)
            radius: Any = points.attributes[nodes.RADIUS]
            radius.data.foreach_set("value", np.where(hidden, np.float32(0.0), self._radius))
            points.update()


def remove(ground: bpy.types.Object) -> None:
    """Take a ground's debris away; nothing happens where there is none."""
    BELONGS.remove(ground)
    _remove_unused()


def _remove_unused() -> None:
    """Remove the groups and shapes that no debris has any more."""
    for group in [block for block in bpy.data.node_groups if block.get(nodes.MARK) and not block.users]:
        bpy.data.node_groups.remove(group)
    for shapes in [block for block in bpy.data.collections if block.get(nodes.MARK) and not block.users]:
        debris_shapes.remove(shapes)


def _group_for(group: Any, looks: Sequence[str], units: SceneUnits) -> Any:
    """The node group that debris has, or a new one if it is for other surfaces or other units."""
    surface, *more = looks
    made_for = f"{' '.join(looks)} {units.frame_rate} {units.time_stretch} {units.gravity_m_s2} {units.unit_scale_m}"
    if group and group.get(MADE_FOR) == made_for:
        return group
    shapes = group and _shapes_of(group)
    if shapes is None or shapes.get(nodes.MARK) != surface:
        shapes = debris_shapes.collection_of(surfaces.find(surface))
    others = [debris_shapes.collection_of(surfaces.find(other)) for other in more]
    group = nodes.build(
        frame_rate=units.frame_rate * units.time_stretch,
        gravity=units.gravity_m_s2,
        unit_scale=units.unit_scale_m,
        shapes=shapes,
        material=debris_shapes.material_of(shapes),
        others=[(other, debris_shapes.material_of(other)) for other in others],
    )
    group[MADE_FOR] = made_for
    return group


def _shapes_of(group: Any) -> Any:
    """The shapes that a group has unless others are chosen."""
    return next(item for item in group.interface.items_tree if item.name == "Shapes").default_value


def _play(modifier: Any, group: Any) -> None:
    """Have debris play a group, with what the artist has set."""
    if modifier.node_group == group:
        return
    values = _AT_FIRST | {"Shapes": _shapes_of(group)} | (_settings_of(modifier) if modifier.node_group else {})
    modifier.node_group = group
    set_inputs(modifier, values)
    _remove_unused()


def _settings_of(modifier: Any) -> dict[str, Any]:
    """Settings of the artist on the older debris: wind, amount, share that is shaped, and shapes of their own."""
    sockets = inputs_of(modifier)
    values = {name: compat.read_input(modifier, sockets[name]) for name in (*_AT_FIRST, "Shapes")}
    if values["Shapes"] is not None and values["Shapes"].get(nodes.MARK):
        values["Shapes"] = None
    # Vectors belong to the modifier, and go with it.
    values["Wind"] = None if values["Wind"] is None else tuple(values["Wind"])
    return {name: value for name, value in values.items() if value is not None}


def _modifier_of(obj: bpy.types.Object) -> Any:
    return modifier_with(obj, lambda group: bool(group.get(nodes.MARK)))


def _points(debris: Debris, origin: Vector, units: SceneUnits, looks: Sequence[int]) -> bpy.types.Mesh:
    """Points where the pieces come to rest as seen from an origin [Blender units], with what lets them fly there, and
    with their looks where there are several.
    """
    unit_scale, time_stretch = units.unit_scale_m, units.time_stretch
    start = debris.start - np.array(origin) * unit_scale
    rest = flight.position(start, debris.velocity, debris.drag_time, debris.time, units.gravity_m_s2)
    rank = np.empty(len(debris.radius))
    rank[np.argsort(-debris.radius, kind="stable")] = np.arange(len(rank))
    order = np.argsort(rank >= nodes.SHAPED, kind="stable")  # then what is seen is one run of points, copied as such
    columns = (
        (nodes.BIRTH, "FLOAT", debris.birth * time_stretch),
        (nodes.FLIGHT, "FLOAT", debris.time),
        (nodes.DRAG, "FLOAT", debris.drag_time),
        (nodes.RADIUS, "FLOAT", debris.radius / unit_scale),
        (nodes.RANK, "FLOAT", rank),
        (nodes.START, "FLOAT_VECTOR", start / unit_scale),
        (nodes.LAUNCH, "FLOAT_VECTOR", debris.velocity / unit_scale),
        (nodes.KIND, "INT", debris.kind),
        (nodes.STEP, "INT", debris.step),
        *([(nodes.LOOK, "INT", np.array(looks))] if any(looks) else []),
    )
    in_order = ((name, kind, values[order]) for name, kind, values in columns)
    points = mesh_arrays.points(NAME, (rest / unit_scale)[order], in_order)
    points[ORIGIN] = origin[:]
    return points
