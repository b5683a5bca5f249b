"""Meshes as arrays, by the ways through Blender's interface that are fast: a look-up per element is not."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.numerics.arrays import Indices
from ..core.numerics.slices import Slices, sliced

AT_ONCE = 1 << 17
"""Faces that are looked at together: a hundredth of a second."""


def positions(mesh: bpy.types.Mesh) -> NDArray[np.float32]:
    """Positions of the vertices, (V, 3)."""
    values = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    if len(values):  # a mesh without vertices has no positions either
        attribute: Any = mesh.attributes["position"]
        attribute.data.foreach_get("vector", values)
    return values.reshape(-1, 3)


Column = tuple[str, Any, NDArray[Any]]
"""Name, data type and values (V,), (V, 2) or (V, 3) of an attribute of points."""


def points(name: str, place: NDArray[np.floating], columns: Iterable[Column]) -> bpy.types.Mesh:
    """A mesh of vertices alone, at places (V, 3) [Blender units]."""
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(place))
    mesh.vertices.foreach_set("co", place.astype(np.float32).ravel())
    add_attributes(mesh, columns)
    return mesh


def add_attributes(geometry: bpy.types.Mesh | bpy.types.Curves, columns: Iterable[Column]) -> None:
    """Give the points of a geometry attributes."""
    for name, kind, values in columns:
        attribute: Any = geometry.attributes.new(name, kind, "POINT")
        flat = values.astype(np.int32 if kind.startswith("INT") else np.float32).ravel()
        attribute.data.foreach_set("vector" if values.ndim > 1 else "value", flat)


def corner_vertices(mesh: bpy.types.Mesh) -> NDArray[np.int32]:
    """Vertex of each corner, face by face, (L,)."""
    corners = np.empty(len(mesh.loops), dtype=np.int32)
    if len(corners):
        attribute: Any = mesh.attributes[".corner_vert"]  # a hundred times faster than `loops`
        attribute.data.foreach_get("value", corners)
    return corners


def of_corners(mesh: bpy.types.Mesh, of_faces: NDArray[Any]) -> tuple[NDArray[np.int32], NDArray[Any]]:
    """Vertex of each corner, and of values of faces (P,) that of its face, both (L,)."""
    starts, corners = np.empty(len(of_faces), np.int32), corner_vertices(mesh)
    mesh.polygons.foreach_get("loop_start", starts)
    return corners, np.repeat(of_faces, np.diff(np.append(starts, len(corners))))


def add_faces(
    mesh: bpy.types.Mesh,
    corner_vertex: NDArray[np.integer],
    face_start: NDArray[np.integer],
    edges: NDArray[np.int32],
    corner_edge: NDArray[np.int32],
) -> None:
    """Add faces to a mesh without, and edges as of `face_edges`, which Blender would look for in one step.

    Parameters
    ----------
    corner_vertex : (L,) int array
        Vertex of each corner.
    face_start : (P,) int array
        First corner of each face.
    edges : (E, 2) int32 array
        Vertices of each edge.
    corner_edge : (L,) int32 array
        Edge from each corner to the next.
    """
    mesh.edges.add(len(edges))
    mesh.loops.add(len(corner_vertex))
    mesh.polygons.add(len(face_start))
    for name, values in ((".edge_verts", edges), (".corner_vert", corner_vertex), (".corner_edge", corner_edge)):
        if len(values):
            attribute: Any = mesh.attributes[name]  # a hundred times faster than `edges` and `loops`
            attribute.data.foreach_set("value", values.astype(np.int32, copy=False).ravel())
    mesh.polygons.foreach_set("loop_start", face_start.astype(np.int32))


def triangles(mesh: bpy.types.Mesh) -> Indices:
    """Vertices of the triangles that Blender shows the faces as, (T, 3)."""
    return triangle_vertices(read_faces(mesh))


@dataclass(frozen=True)
class Faces:
    """Faces as they are read of a mesh, to be split into triangles.

    Attributes
    ----------
    positions : (V, 3) float32 array
        Of the vertices.
    corner_vertex : (L,) int array
        Vertex of each corner, face by face.
    triangle_face : (T,) int array
        Face of each triangle.
    corners : (T, 3) int array, optional
        Corners of each triangle, where faces have more than four.
    size : (P,) int array
        Corners of each face.
    """

    positions: NDArray[np.float32]
    corner_vertex: NDArray[np.int32]
    triangle_face: NDArray[np.int32]
    corners: Indices | None
    size: Indices


def read_faces(mesh: bpy.types.Mesh) -> Faces:
    """The faces of a mesh, of which nothing else need be asked."""
    mesh.calc_loop_triangles()
    face = np.empty(len(mesh.loop_triangles), dtype=np.int32)
    mesh.loop_triangle_polygons.foreach_get("value", face)
    count, corners = np.bincount(face, minlength=len(mesh.polygons)), None
    if count.min(initial=1) < 1 or count.max(initial=0) > 2:
        asked = np.empty(len(face) * 3, dtype=np.int32)
        mesh.loop_triangles.foreach_get("loops", asked)
        corners = asked.reshape(-1, 3).astype(np.intp)
    return Faces(positions(mesh), corner_vertices(mesh), face, corners, count + 2)


@sliced
def triangle_vertices(faces: Faces) -> Slices[Indices]:
    """Vertices of the triangles that Blender shows faces as, (T, 3)."""
    corners = yield from triangle_corners.slices(faces)
    yield
    vertices: Indices = faces.corner_vertex.take(corners).astype(np.intp)
    return vertices


@sliced
def triangle_corners(faces: Faces) -> Slices[Indices]:
    """Corners of the triangles that Blender shows faces as, (T, 3).

    What Blender does to faces of up to four corners is repeated here, thirty times faster than it can be asked: two
    triangles at the diagonal from the first corner, or at the other one where that lies outside of the face
    (`mesh_tessellate.cc`).
    """
    if faces.corners is not None:
        return faces.corners
    face, place, vertex = faces.triangle_face, faces.positions, faces.corner_vertex
    first = np.cumsum(faces.size) - faces.size
    start = first[face]
    second = np.zeros(len(face), dtype=np.intp)
    second[1:] = face[1:] == face[:-1]
    second += start
    yield
    corners = np.stack([start, second + 1, second + 2], axis=-1)
    quads = first[faces.size == 4]
    for begin in range(0, len(quads), AT_ONCE):
        yield
        part = quads[begin : begin + AT_ONCE]
        bent = part[_has_outer_diagonal(*(place.take(vertex.take(part + corner), axis=0) for corner in range(4)))]
        half = np.searchsorted(start, bent)
        corners[half], corners[half + 1] = bent[:, None] + (0, 1, 3), bent[:, None] + (1, 2, 3)
    return corners


def _has_outer_diagonal(*corners: NDArray[np.float32]) -> NDArray[np.bool_]:
    """True if the diagonal from the first of a quad's corners (N, 3) has the two others on one side."""
    first, diagonal, last = (corner - corners[0] for corner in corners[1:])

    def dot(a: NDArray[np.float32], other: NDArray[np.float32]) -> NDArray[np.float32]:
        return np.einsum("ni,ni->n", a, other)

    # (first x diagonal) . (last x diagonal), by Lagrange's identity.
    return dot(first, last) * dot(diagonal, diagonal) > dot(first, diagonal) * dot(last, diagonal)
