"""Marks on hard floors as images in the floors' UV maps, beside those of the ground."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree
from mathutils.geometry import barycentric_transform

from ...core.carried.ageing import aged
from ...core.ground import surfaces
from ...core.meshing.uv_raster import rasterise
from ...core.numerics.arrays import Array, Indices
from ...core.record.footprints import NEVER
from ...core.rig.recording import SceneUnits
from .. import mesh_arrays
from ..carried import marks_nodes as nodes
from ..carried import marks_object
from ..placement import world_matrix

NEAR = 0.01
"""Largest distance of a mark from the floor that it is on [m]."""
TORN = 4.0
"""A face that is so many times larger in the UV map than most goes from one island to another, and is left out."""


@dataclass(frozen=True)
class FloorImage:
    """Pixels of a floor's UV map under marks, of several as often.

    Attributes
    ----------
    floor : str
        Name of the object.
    index : (N,) int array
        As of `Pixels`.
    place : (K,) int array
        Number of the pixel of each value.
    mass, birth : (K,) float arrays
        [kg/m²], scene frame.
    marks : bpy.types.Object
        Whose sliders count.
    units : SceneUnits
    """

    floor: str
    index: Indices
    place: Indices
    mass: Array
    birth: Array
    marks: bpy.types.Object
    units: SceneUnits

    def at(self, frame: float) -> Array:
        """Mass [kg/m²], wet look from 1 to 0, and time since the latest mark [s], (N + 1, 3); last, of all others."""
        surface = surfaces.sticking(marks_object.floors_of(self.marks).kind)
        sliders = marks_object.sliders_of(self.marks, frame * self.units.time_stretch)
        made = (self.birth <= frame) & (self.mass > 0)
        place, seconds = self.place[made], (frame - self.birth[made]) / self.units.frame_rate
        passed = seconds * sliders["Time Scale"]
        now = aged(self.mass[made], passed, surface, *(sliders[name] for name in ("Drying", "Rain", "Temperature")))
        channels = np.zeros((len(self.index) + 1, 3))
        channels[:, 2] = np.inf
        np.add.at(channels[:, 0], place, now.mass)
        np.maximum.at(channels[:, 1], place, now.wetness)
        np.minimum.at(channels[:, 2], place, seconds)
        channels[np.isinf(channels[:, 2]), 2] = NEVER
        return channels


def floor_images(
    marks: bpy.types.Object, floors: Iterable[bpy.types.Object], units: SceneUnits, resolution: int
) -> Iterator[FloorImage]:
    """Images of marks, for each floor that has a UV map and some of them within its image."""
    mesh: bpy.types.Mesh = marks.data  # type: ignore[assignment]
    triangles = mesh_arrays.triangles(mesh)
    if not len(triangles):
        return
    place = _in_world(marks, mesh_arrays.positions(mesh))
    mass, birth, step = (marks_object.values(mesh, name) for name in (nodes.MASS, nodes.BIRTH, nodes.STEP))
    carried, step = np.stack([mass, birth], axis=-1)[triangles], step[triangles[:, 0]]
    edges = np.linalg.norm(np.diff(place[triangles], axis=1), axis=2).max(axis=1)
    for floor in floors:
        uv = _uv_of(floor, place, NEAR / units.unit_scale_m)[triangles]
        size = np.linalg.norm(np.diff(uv, axis=1), axis=2).max(axis=1) / edges
        whole = np.isfinite(size)
        if not whole.any():
            continue
        whole &= size < TORN * np.median(size[whole])
        layers = [
            rasterise(uv[each], carried[each], resolution, resolution)
            for number in np.unique(step[whole])
            if (each := whole & (step == number)).any()
        ]
        if not any(len(layer.index) for layer in layers):
            continue
        index, pixel = np.unique(np.concatenate([layer.index for layer in layers]), return_inverse=True)
        mass, birth = np.concatenate([layer.position for layer in layers]).T
        yield FloorImage(floor.name, index, pixel, mass, birth / units.time_stretch, marks, units)


def _in_world(obj: bpy.types.Object, place: Any) -> Array:
    """Places (N, 3) of an object in the world, also before Blender has updated the object."""
    matrix = world_matrix(obj)
    return np.asarray(place @ matrix[:3, :3].T + matrix[:3, 3])


def _uv_of(floor: bpy.types.Object, place: Array, near: float) -> Array:
    """Places (N, 2) in the UV map of a floor, NaN where it is not near [Blender units] or has none."""
    shown: Any = floor.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh, uv = shown.to_mesh(), np.full((len(place), 2), np.nan)
    layer = next((each for each in mesh.uv_layers if each.active_render), None) if mesh else None
    if layer is not None:
        corners = [each.vector.to_3d() for each in layer.uv]
        at: list[Any] = [Vector(vertex) for vertex in _in_world(floor, mesh_arrays.positions(mesh)).tolist()]
        mesh.calc_loop_triangles()
        triangles = [(tuple(each.vertices), tuple(each.loops)) for each in mesh.loop_triangles]
        tree: Any = BVHTree.FromPolygons(at, [of_vertices for of_vertices, _ in triangles])
        for number, point in enumerate(place.tolist()):
            on, _, triangle, _ = tree.find_nearest(point, near)
            if on is not None:
                of_vertices, of_corners = triangles[triangle]
                ends = [at[each] for each in of_vertices] + [corners[each] for each in of_corners]
                uv[number] = barycentric_transform(on, *ends)[:2]
    shown.to_mesh_clear()
    return uv
