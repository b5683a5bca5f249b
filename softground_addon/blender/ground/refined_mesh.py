"""A copy of a mesh, refined along the trail, with all that its faces, corners, edges and vertices carry."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.meshing.face_edges import face_edges
from ...core.meshing.refinement import Refinement, Surface
from ...core.numerics.arrays import Array, Indices
from ...core.numerics.slices import Slices, sliced
from ...core.numerics.triangles import enumerated
from ...core.settings import ObjectName
from .. import mesh_arrays
from ..drafts import none_left_if_it_fails
from ..playback import own_data
from ..rigs.object_data import mesh_of
from ..settings import resolve

LAYOUT = {
    "FLOAT": ("value", 1, np.float32),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color_srgb", 4, np.float32),
    "QUATERNION": ("value", 4, np.float32),
    "FLOAT4X4": ("value", 16, np.float32),
    "INT": ("value", 1, np.int32),
    "INT8": ("value", 1, np.int32),
    "INT32_2D": ("value", 2, np.int32),
    "BOOLEAN": ("value", 1, np.bool_),
}
"""How values of each type are read in bulk: property, numbers per element, type. Texts stay behind."""

NOT_COPIED = ("position", "custom_normal")
"""Positions are made first; custom normals are coded against the faces around, which have changed."""
SEAM = ".uv_seam"
"""Seams, as 4.2 to 4.4 call them; other names with a leading dot are Blender's own."""

_EMPTY: Indices = np.empty((0, 2), dtype=np.intp)


@sliced
def surface_of(faces: mesh_arrays.Faces, to_world: Array) -> Slices[Surface]:
    """Faces with world positions [m], and the triangles that Blender shows them as."""
    corners = yield from mesh_arrays.triangle_corners.slices(faces)
    yield
    return Surface(
        vertices=faces.positions.astype(np.float64) @ to_world[:3, :3].T + to_world[:3, 3],
        corner_vertex=faces.corner_vertex.astype(np.intp),
        face_start=np.concatenate([[0], np.cumsum(faces.size)]),
        triangle_corners=corners,
        triangle_face=faces.triangle_face.astype(np.intp),
    )


@dataclass(frozen=True)
class _Layer:
    """An attribute: its name, type and domain, and its values, (N, ...)."""

    name: str
    kind: str
    domain: str
    values: NDArray[Any]


@dataclass(frozen=True)
class Carried:
    """All that the faces, corners, edges and vertices of a mesh carry, to be given to a refined copy of it.

    Attributes
    ----------
    positions : (V, 3) float32 array
    edges, loose_edges : (E, 2) int array
        Vertices of its edges if attributes are on them, and of those without a face, which no face would bring back.
    uv_maps : tuple of (str, bool, bool)
        Name of each, and whether it is active, and rendered.
    colours : dict of str to str
        Names of the colours that are active and rendered, by the property that says so.
    groups : tuple of str
        Names of the vertex groups, which only its object knows.
    members : (N, 3) float array
        Group, vertex and weight of what is in them.
    """

    positions: NDArray[np.float32]
    edges: Indices
    loose_edges: Indices
    layers: tuple[_Layer, ...]
    uv_maps: tuple[tuple[str, bool, bool], ...]
    colours: dict[str, str]
    groups: tuple[str, ...]
    members: Array


def read(source: bpy.types.Mesh, groups: Sequence[str] = ()) -> Carried:
    """Data of a mesh; `groups` are the names of its vertex groups."""
    coming = [given for given in source.attributes if given.data_type in LAYOUT and _comes_along(given.name)]
    edges, loose = _EMPTY, np.ones(len(source.edges), dtype=bool)
    if len(source.loops):
        loose[_values(source.attributes[".corner_edge"])] = False  # a hundred times faster than `loops`
    if loose.any() or any(attribute.domain == "EDGE" for attribute in coming):
        edges = _values(source.attributes[".edge_verts"]).astype(np.intp)
    colours: Any = source.color_attributes
    chosen = {choice: getattr(colours, choice) for choice in ("active_color_index", "render_color_index")}
    members = [
        (item.group, vertex.index, item.weight)
        for vertex in (source.vertices if groups else ())
        for item in vertex.groups
    ]
    return Carried(
        positions=mesh_arrays.positions(source),
        edges=edges,
        loose_edges=edges[loose] if loose.any() else _EMPTY,
        layers=tuple(_Layer(given.name, given.data_type, given.domain, _values(given)) for given in coming),
        uv_maps=tuple((layer.name, bool(layer.active), bool(layer.active_render)) for layer in source.uv_layers),
        colours={choice: colours[index].name for choice, index in chosen.items() if 0 <= index < len(colours)},
        groups=tuple(groups),
        members=np.array(members, dtype=np.float64).reshape(-1, 3),
    )


def building(name: ObjectName, carried: Carried, surface: Surface, refinement: Refinement) -> Slices[None]:
    """Give the empty mesh of an object the kept faces of a source and the new ones, with all that the source carries.

    Vertices of the source keep their numbers and their positions, bit for bit.

    Parameters
    ----------
    carried : Carried
        Of the source.
    surface : Surface
        Of the source.
    refinement : Refinement
        Of the surface.
    """
    unrefined = refinement.kept_faces
    size = np.diff(surface.face_start)
    face, corner = enumerated(size[unrefined])
    kept_corners = surface.face_start[unrefined][face] + corner
    corner_vertex = np.concatenate([surface.corner_vertex[kept_corners].astype(np.int32), refinement.corner_vertex])
    kept_start = np.cumsum(size[unrefined]) - size[unrefined]
    face_start = np.concatenate([kept_start, len(kept_corners) + refinement.face_start[:-1]])
    yield
    edges, corner_edge = yield from face_edges.slices(corner_vertex, face_start)
    edges = np.concatenate([edges, carried.loose_edges.astype(np.int32)])
    mesh = mesh_of(resolve(name))
    mesh.vertices.add(len(surface.vertices) + len(refinement.new_vertex))
    mesh_arrays.add_faces(mesh, corner_vertex, face_start, edges, corner_edge)
    del corner_vertex, face_start, corner_edge
    yield
    position: Any = mesh_of(resolve(name)).attributes["position"]
    position.data.foreach_set("vector", refinement.at_vertices(surface, carried.positions).ravel())
    edge_source = _edge_sources(edges, carried, refinement)
    for layer in carried.layers:
        yield
        values = layer.values
        if layer.domain == "POINT":
            values = refinement.at_vertices(surface, values)
        elif layer.domain == "CORNER":
            values = refinement.at_corners(surface, values, kept_corners)
        elif layer.domain == "FACE":
            values = values[np.concatenate([unrefined, surface.triangle_face[refinement.source]])]
        else:
            is_known = (edge_source >= 0).reshape(-1, *[1] * (values.ndim - 1))
            values = np.where(is_known, values[edge_source], 0).astype(values.dtype)
        _write(mesh_of(resolve(name)), layer, values)
    yield
    mesh = mesh_of(resolve(name))
    _copy_choices(mesh, carried)
    if carried.groups:
        with none_left_if_it_fails():
            _copy_vertex_groups(mesh, carried, surface, refinement)
    mesh.update()


def _copy_vertex_groups(mesh: bpy.types.Mesh, carried: Carried, surface: Surface, refinement: Refinement) -> None:
    """Give the refined mesh the vertex groups of its source, which Blender writes vertex by vertex only."""
    of_group, vertex, weight = carried.members.T
    holder = bpy.data.objects.new("SoftGround Groups", mesh)  # the names are the mesh's, but only objects give them
    for number, name in enumerate(carried.groups):
        group = holder.vertex_groups.new(name=name)
        chosen = of_group == number
        weights = np.zeros(len(surface.vertices))
        weights[vertex[chosen].astype(np.intp)] = weight[chosen]
        everywhere = refinement.at_vertices(surface, weights).astype(np.float32)
        inside = np.flatnonzero(everywhere)
        order = inside[np.argsort(everywhere[inside], kind="stable")]
        levels, first = np.unique(everywhere[order], return_index=True)
        for level, alike in zip(levels.tolist(), np.split(order, first)[1:], strict=True):
            group.add(alike.tolist(), level, "REPLACE")
    bpy.data.objects.remove(holder)


def _comes_along(name: str) -> bool:
    return name == SEAM or not (name.startswith(".") or name in NOT_COPIED or name in own_data.ATTRIBUTES)


def _edge_sources(edges: Indices, carried: Carried, refinement: Refinement) -> Indices:
    """The source's edge that each edge is, or is a part of, (E,); -1 where it is a new one."""
    if not any(layer.domain == "EDGE" for layer in carried.layers):
        return np.zeros(0, dtype=np.intp)
    size = len(carried.positions) + len(refinement.new_vertex)
    given = _edge_keys(carried.edges, size)
    whole = _find(given, _edge_keys(refinement.edge_of, size))  # none where it parts the diagonal of a face
    known = np.concatenate([given, _edge_keys(refinement.edges, size)])
    numbers = np.concatenate([np.arange(len(given)), whole])
    place = _find(known, _edge_keys(edges.astype(np.intp), size))
    return np.where(place >= 0, numbers[place], -1)


def _find(known: Indices, wanted: Indices) -> Indices:
    """Place of each wanted value among the known ones, -1 where it is none of them."""
    order = np.argsort(known)
    place = order[np.minimum(np.searchsorted(known[order], wanted), len(known) - 1)]
    return np.where(known[place] == wanted, place, -1)


def _edge_keys(edges: Indices, size: int) -> Indices:
    return np.asarray(edges.min(axis=1) * size + edges.max(axis=1))


def _copy_choices(mesh: bpy.types.Mesh, carried: Carried) -> None:
    """Make the same UV map and colours active and rendered."""
    for name, active, active_render in carried.uv_maps:
        copy: Any = mesh.uv_layers.get(name)
        if copy is not None:
            copy.active, copy.active_render = active, active_render
    colours: Any = mesh.color_attributes
    names = [attribute.name for attribute in colours]
    for choice, wanted in carried.colours.items():
        if wanted in names:
            setattr(colours, choice, names.index(wanted))


def _values(attribute: Any) -> NDArray[Any]:
    name, width, kind = LAYOUT[attribute.data_type]
    values = np.empty(len(attribute.data) * width, dtype=kind)
    attribute.data.foreach_get(name, values)
    return values if width == 1 else values.reshape(-1, width)


def _write(mesh: bpy.types.Mesh, layer: _Layer, values: NDArray[Any]) -> None:
    target: Any = mesh.attributes.get(layer.name)
    if target is None or target.domain != layer.domain or target.data_type != layer.kind:
        target = mesh.attributes.new(layer.name, cast("Any", layer.kind), cast("Any", layer.domain))
    target.data.foreach_set(LAYOUT[layer.kind][0], np.ascontiguousarray(values).ravel())
