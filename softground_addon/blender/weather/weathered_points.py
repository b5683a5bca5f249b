"""A baked ground under its weather at any points: these as a mesh, under the ground's own modifier."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ...core.numerics.arrays import Array
from ...core.playback.keyframe_tables import keyframe_tables
from ...core.playback.vertex_histories import VertexHistories
from ...core.weather.weather_places import NOT_YET, SIGMAS, weather_places
from ..ground import baked_ground, ground_mesh, ground_surface
from ..mesh_arrays import positions
from ..playback import own_data, weather_modifier, weather_table
from ..playback import playback_nodes as played
from ..playback import weather_nodes as nodes
from . import ground_weather as weather
from . import weather_keys

BLUR = SIGMAS[-1]
"""Standard deviation over which a print acts on what weather makes of the ground around [m]."""


@dataclass(frozen=True)
class Weathered:
    """The ground at some points, each (K,).

    Attributes
    ----------
    height, compression, rim : float arrays
        Change of the displayed height; compression and rim for materials [m].
    wetness, fresh, water : float arrays
        How wet it looks and how much of it new snow covers, 0 to 1; depth of standing water [m].
    """

    height: Array
    compression: Array
    rim: Array
    wetness: Array
    fresh: Array
    water: Array


At = Callable[[int, Array, Array, Array], Weathered]
"""The points at a frame of the scene, at which the playback has them at such a height, compression and rim [m]."""


def has_weather(display_mesh: bpy.types.Object) -> bool:
    """True if weather is shown on a ground that carries a bake."""
    modifier = weather_modifier.modifier_of(display_mesh)
    return modifier is not None and modifier.show_viewport


@contextmanager
def weathered_points(
    ground: bpy.types.Object, position: Array, over_time: VertexHistories, water: Array | None, unit_scale: float
) -> Iterator[At]:
    """Points under the weather of a ground that has some.

    Parameters
    ----------
    position : (K, 3) float array
        Their undisturbed world positions [m].
    over_time : VertexHistories
        What happens to them, in frames of the scene.
    water : (K,) float array, optional
        Depth of the water that the bake itself has in its prints [m].
    unit_scale : float
        Metres per Blender unit.

    Raises
    ------
    InputError
        If the bake's inputs are damaged.
    """
    display_mesh = baked_ground.display_mesh_of(ground)
    footprints, about = baked_ground.load(ground)
    with weather.damage_named(ground):
        known, of_ground = weather.of_bake(footprints, about)
    count, table = len(position), keyframe_tables(over_time)
    start, end = np.full(count, NOT_YET), np.full(count, -NOT_YET)
    start[table.point] = known["time_stretch"] * table.frame[table.first[:-1]]
    end[table.point] = known["time_stretch"] * table.frame[table.first[1:] - 1]
    final = over_time.movement.at(np.inf, count)[:, 0]
    points = bpy.data.meshes.new("SoftGround Points")
    try:
        points.vertices.add(count)
        kinds = of_ground.at(display_mesh, about, position)
        matters, region_of = of_ground.regions(ground_mesh.mesh_of(display_mesh))
        depth = of_ground.pressable[kinds]
        places = weather_places(footprints, position, final, start, end, layer_depth=depth, **known)
        places = places.without_prints(kinds == of_ground.hard)
        span = weather_keys.moments_of(display_mesh)
        modifier: Any = weather_modifier.modifier_of(display_mesh)
        hollows = weather.store(points, places, matters, region_of[kinds], span)
        own_data.attribute(points, played.MOVED, "BOOLEAN").data.foreach_set("value", np.ones(count, dtype=bool))
        if water is not None:
            own_data.attribute(points, nodes.WATER, "FLOAT").data.foreach_set("value", water.astype(np.float32))
        up = ground_surface.up_of(display_mesh, unit_scale, baked_ground.frame_in(about["inputs"]))

        with _looking_up(modifier.node_group, hollows) as group:

            def at(frame: int, height: Array, *shading: Array) -> Weathered:
                for name, values in zip((played.COMPRESSION, played.RIM), shading, strict=True):
                    own_data.attribute(points, name, "FLOAT").data.foreach_set("value", values.astype(np.float32))
                ground_mesh.write_positions(points, (height[:, None] * up).astype(np.float32))
                with ground_surface.stand_in(
                    display_mesh, points, weather_at=frame, weather=group, with_users=False
                ) as evaluated:
                    mesh = ground_mesh.mesh_of(evaluated)
                    shown = (played.COMPRESSION, played.RIM, nodes.WETNESS, nodes.FRESH, nodes.WATER)
                    return Weathered(positions(mesh) @ up / (up @ up), *(_values(mesh, name) for name in shown))

            yield at
    finally:
        bpy.data.meshes.remove(points)


@contextmanager
def _looking_up(tree: Any, columns: Mapping[str, Array]) -> Iterator[Any]:
    """A group of weather as one for other hollows, which may be a linked one; None if it looks up none."""
    if not weather.hollows_of(tree):
        yield None
        return
    table, outer, inners = weather_table.new(), tree.copy(), []
    try:
        weather_table.fill(table, columns)
        for holder in [node for node in outer.nodes if node.bl_idname == "GeometryNodeGroup"]:
            inners.append(holder.node_tree.copy())
            holder.node_tree = inners[-1]
            if looking := inners[-1].nodes.get(weather_table.HOLLOWS):
                looking.inputs["Object"].default_value = table
        yield outer
    finally:
        for copy in (outer, *inners):
            bpy.data.node_groups.remove(copy)
        weather_table.remove_unused([table])


def _values(mesh: bpy.types.Mesh, name: str) -> Array:
    attribute: Any = mesh.attributes.get(name)
    values = np.zeros(len(mesh.vertices), dtype=np.float32)
    if attribute is not None:
        attribute.data.foreach_get("value", values)
    return values.astype(np.float64)
