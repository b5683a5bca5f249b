"""Meshes as arrays, by the ways through Blender's interface that are fast: a look-up per element is not."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.intp]


def positions(mesh: bpy.types.Mesh) -> NDArray[np.float32]:
    """Positions of the vertices, (V, 3)."""
    values = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    if len(values):  # a mesh without vertices has no positions either
        attribute: Any = mesh.attributes["position"]
        attribute.data.foreach_get("vector", values)
    return values.reshape(-1, 3)


def corner_vertices(mesh: bpy.types.Mesh) -> NDArray[np.int32]:
    """Vertex of each corner, face by face, (L,)."""
    corners = np.empty(len(mesh.loops), dtype=np.int32)
    if len(corners):
        attribute: Any = mesh.attributes[".corner_vert"]  # a hundred times faster than `loops`
        attribute.data.foreach_get("value", corners)
    return corners


def add_faces(mesh: bpy.types.Mesh, corner_vertex: NDArray[np.integer], face_start: NDArray[np.integer]) -> None:
    """Add faces to a mesh without, by the vertex of each corner (L,) and the first corner of each face (P,)."""
    mesh.loops.add(len(corner_vertex))
    if len(corner_vertex):
        attribute: Any = mesh.attributes[".corner_vert"]
        attribute.data.foreach_set("value", corner_vertex.astype(np.int32))
    mesh.polygons.add(len(face_start))
    mesh.polygons.foreach_set("loop_start", face_start.astype(np.int32))


def triangles(mesh: bpy.types.Mesh) -> Indices:
    """Vertices of the triangles that Blender shows the faces as, (T, 3)."""
    corners, _ = triangle_corners(mesh)
    return corner_vertices(mesh).astype(np.intp)[corners]


def triangle_corners(mesh: bpy.types.Mesh) -> tuple[Indices, Indices]:
    """Corners of the triangles that Blender shows the faces as, (T, 3), and the face of each, (T,).

    What Blender does to faces of up to four corners is repeated here, thirty times faster than it can be asked: two
    triangles at the diagonal from the first corner, or at the other one where that lies outside of the face
    (`mesh_tessellate.cc`).
    """
    mesh.calc_loop_triangles()
    face = np.empty(len(mesh.loop_triangles), dtype=np.int32)
    mesh.loop_triangle_polygons.foreach_get("value", face)
    count = np.bincount(face, minlength=len(mesh.polygons))
    if count.min(initial=1) < 1 or count.max(initial=0) > 2:
        corners = np.empty(len(face) * 3, dtype=np.int32)
        mesh.loop_triangles.foreach_get("loops", corners)
        return corners.reshape(-1, 3).astype(np.intp), face.astype(np.intp)
    first = np.cumsum(count + 2) - (count + 2)
    start = first[face]
    second = np.zeros(len(face), dtype=np.intp)
    second[1:] = face[1:] == face[:-1]
    second += start
    corners = np.stack([start, second + 1, second + 2], axis=-1)
    quads = first[count == 2]
    place, vertex = positions(mesh), corner_vertices(mesh)
    bent = quads[_has_outer_diagonal(*(place[vertex[quads + corner]] for corner in range(4)))]
    half = np.searchsorted(start, bent)
    corners[half], corners[half + 1] = bent[:, None] + (0, 1, 3), bent[:, None] + (1, 2, 3)
    return corners, face.astype(np.intp)


def _has_outer_diagonal(*corners: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Return whether the diagonal from the first of a quad's corners (N, 3) has the two others on one side."""
    first, diagonal, last = (corner - corners[0] for corner in corners[1:])

    def dot(a: NDArray[np.float32], other: NDArray[np.float32]) -> NDArray[np.float32]:
        return np.einsum("ni,ni->n", a, other)

    # (first x diagonal) . (last x diagonal), by Lagrange's identity.
    return dot(first, last) * dot(diagonal, diagonal) > dot(first, diagonal) * dot(last, diagonal)
