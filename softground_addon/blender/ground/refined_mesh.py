"""A copy of a mesh, refined along the trail, with all that its faces, corners, edges and vertices carry."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.meshing.refinement import Refinement, Surface
from .. import mesh_arrays
from ..playback import own_data

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

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


def surface_of(mesh: bpy.types.Mesh, to_world: Array) -> Surface:
    """The faces of a mesh with world positions [m], and the triangles that Blender shows them as."""
    positions = mesh_arrays.positions(mesh).astype(np.float64)
    corners, face = mesh_arrays.triangle_corners(mesh)
    size = np.bincount(face, minlength=len(mesh.polygons)) + 2
    return Surface(
        vertices=positions @ to_world[:3, :3].T + to_world[:3, 3],
        corner_vertex=mesh_arrays.corner_vertices(mesh).astype(np.intp),
        face_start=np.concatenate([[0], np.cumsum(size)]),
        triangle_corners=corners,
        triangle_face=face,
    )


def build(
    name: str, source: bpy.types.Mesh, surface: Surface, refinement: Refinement, groups: Sequence[str] = ()
) -> bpy.types.Mesh:
    """A new mesh: the kept faces of the source and the new ones, with all that the source carries.

    Vertices of the source keep their numbers and their positions, bit for bit.

    Parameters
    ----------
    name : str
    source : bpy.types.Mesh
    surface : Surface
        Of the source.
    refinement : Refinement
        Of the surface.
    groups : sequence of str
        Names of the vertex groups of the source, which only its object knows.
    """
    mesh = bpy.data.meshes.new(name)
    unrefined = refinement.kept_faces
    size = np.diff(surface.face_start)
    kept_corners = _runs(surface.face_start[unrefined], size[unrefined])
    corner_vertex = np.concatenate([surface.corner_vertex[kept_corners].astype(np.int32), refinement.corner_vertex])
    kept_start = np.cumsum(size[unrefined]) - size[unrefined]
    face_start = np.concatenate([kept_start, len(kept_corners) + refinement.face_start[:-1]])

    mesh.vertices.add(len(surface.vertices) + len(refinement.new_vertex))
    _add_loose_edges(mesh, source)
    mesh_arrays.add_faces(mesh, corner_vertex, face_start)
    del corner_vertex, face_start
    position: Any = mesh.attributes["position"]
    position.data.foreach_set("vector", refinement.at_vertices(surface, mesh_arrays.positions(source)).ravel())
    mesh.update(calc_edges=True)

    for material in source.materials:
        mesh.materials.append(material and material.original)  # an evaluated mesh holds evaluated materials
    edges = _edge_sources(mesh, source, refinement)
    for attribute in source.attributes:
        if attribute.data_type not in LAYOUT or not _comes_along(attribute.name):
            continue
        values = _values(attribute)
        if attribute.domain == "POINT":
            values = refinement.at_vertices(surface, values)
        elif attribute.domain == "CORNER":
            values = refinement.at_corners(surface, values, kept_corners)
        elif attribute.domain == "FACE":
            values = values[np.concatenate([unrefined, surface.triangle_face[refinement.source]])]
        else:
            values = np.where((edges >= 0).reshape(-1, *[1] * (values.ndim - 1)), values[edges], 0).astype(values.dtype)
        _write(mesh, attribute, values)
    _copy_choices(mesh, source)
    if groups:
        _copy_vertex_groups(mesh, source, surface, refinement, groups)
    mesh.update()
    return mesh


def _copy_vertex_groups(
    mesh: bpy.types.Mesh, source: bpy.types.Mesh, surface: Surface, refinement: Refinement, groups: Sequence[str]
) -> None:
    """Give the refined mesh the vertex groups of its source, which Blender reads vertex by vertex only."""
    members = [(item.group, vertex.index, item.weight) for vertex in source.vertices for item in vertex.groups]
    of_group, vertex, weight = np.array(members, dtype=np.float64).reshape(-1, 3).T
    holder = bpy.data.objects.new("SoftGround Groups", mesh)  # the names are the mesh's, but only objects give them
    for number, name in enumerate(groups):
        group = holder.vertex_groups.new(name=name)
        chosen = of_group == number
        weights = np.zeros(len(source.vertices))
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


def _add_loose_edges(mesh: bpy.types.Mesh, source: bpy.types.Mesh) -> None:
    """Edges without a face, which no face would bring back."""
    used = np.zeros(len(source.edges), dtype=bool)
    if len(source.loops):
        used[_values(source.attributes[".corner_edge"])] = True  # a hundred times faster than `loops`
    loose = np.flatnonzero(~used)
    if len(loose):
        mesh.edges.add(len(loose))
        mesh.edges.foreach_set("vertices", _bulk(source.edges, "vertices", 2)[loose].ravel().astype(np.int32))


def _edge_sources(mesh: bpy.types.Mesh, source: bpy.types.Mesh, refinement: Refinement) -> Indices:
    """The source's edge that each edge of the mesh is, or is a part of, (E,); -1 where it is a new one."""
    if not any(attribute.domain == "EDGE" and _comes_along(attribute.name) for attribute in source.attributes):
        return np.zeros(0, dtype=np.intp)
    size = len(mesh.vertices)
    given = _edge_keys(_bulk(source.edges, "vertices", 2), size)
    whole = _find(given, _edge_keys(refinement.edge_of, size))  # none where it parts the diagonal of a face
    known = np.concatenate([given, _edge_keys(refinement.edges, size)])
    numbers = np.concatenate([np.arange(len(given)), whole])
    place = _find(known, _edge_keys(_bulk(mesh.edges, "vertices", 2), size))
    return np.where(place >= 0, numbers[place], -1)


def _find(known: Indices, wanted: Indices) -> Indices:
    """Place of each wanted value among the known ones, -1 where it is none of them."""
    order = np.argsort(known)
    place = order[np.minimum(np.searchsorted(known[order], wanted), len(known) - 1)]
    return np.where(known[place] == wanted, place, -1)


def _edge_keys(edges: Indices, size: int) -> Indices:
    return np.asarray(edges.min(axis=1) * size + edges.max(axis=1))


def _copy_choices(mesh: bpy.types.Mesh, source: bpy.types.Mesh) -> None:
    """Which UV map and colours are active and rendered."""
    for layer in source.uv_layers:
        copy: Any = mesh.uv_layers.get(layer.name)
        if copy is not None:
            copy.active, copy.active_render = layer.active, layer.active_render
    colours: Any = mesh.color_attributes
    for choice in ("active_color_index", "render_color_index"):
        index = getattr(source.color_attributes, choice)
        if 0 <= index < len(source.color_attributes):
            wanted = source.color_attributes[index].name
            names = [attribute.name for attribute in colours]
            if wanted in names:
                setattr(colours, choice, names.index(wanted))


def _runs(start: Indices, count: Indices) -> Indices:
    """For starts (5, 9) and counts (2, 3): 5, 6, 9, 10, 11."""
    return np.repeat(start - np.cumsum(count) + count, count) + np.arange(int(count.sum()))


def _bulk(collection: Any, name: str, width: int = 1) -> Indices:
    values = np.empty(len(collection) * width, dtype=np.int32)
    collection.foreach_get(name, values)
    return values.astype(np.intp) if width == 1 else values.astype(np.intp).reshape(-1, width)


def _values(attribute: Any) -> NDArray[Any]:
    name, width, kind = LAYOUT[attribute.data_type]
    values = np.empty(len(attribute.data) * width, dtype=kind)
    attribute.data.foreach_get(name, values)
    return values if width == 1 else values.reshape(-1, width)


def _write(mesh: bpy.types.Mesh, attribute: Any, values: NDArray[Any]) -> None:
    target: Any = mesh.attributes.get(attribute.name)
    if target is None or target.domain != attribute.domain or target.data_type != attribute.data_type:
        target = mesh.attributes.new(attribute.name, attribute.data_type, attribute.domain)
    target.data.foreach_set(LAYOUT[attribute.data_type][0], np.ascontiguousarray(values).ravel())
