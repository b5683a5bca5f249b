"""Detail where it is wanted: the faces of a coarse surface, bisected along the trail down to the size of the cells.

Two parts at one base are a parallelogram, and become a quad; the others stay triangles. Only the faces near the trail
are looked at; the work does not depend on how large the ground is.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array, Indices, Mask
from ..numerics.slices import Slices, sliced
from ..numerics.triangles import enumerated
from .bisection import Bisection, longest_sides
from .region import Region

Numbers = NDArray[np.int32]

COARSEST_LEG = 2.0**0.25
"""Largest leg of a half square, in cells: halving areas leaves legs from 0.84 to 1.19 cells, about 1 in the middle."""

CURVE_BITS = 24
"""Bits of a coordinate along the curve by which vertices are ordered: 6 cm of 1,000 km."""

FEW_TRIANGLES = 64
"""So many triangles are cut into equal parts, all of them: parts of an edge that does not need them cost little."""
EQUAL_PARTS = (1, 3, 5, 7, 9, 11, 13)
"""Pieces that edges are cut into. Even numbers come to the same as halving; up to 13, halving ends within 4 % of a
cell."""
FINEST_GRAIN = 2.0**-14
"""Shortest part, in lengths of an edge."""
WEIGHT_BITS = 24
"""Bits of a weight in single precision: those of the grain and of the halvings are all that there are."""
LEAST_PART = 8.0
"""Smallest leg of an equal part, in cells: beside the trail, sizes still have some halvings to fall off in."""

AT_ONCE = 1 << 17
"""Corners whose values are worked out together, in double precision: there may be millions."""


@dataclass(frozen=True)
class Surface:
    """Faces of any number of corners, and the triangles that they are shown as.

    Attributes
    ----------
    vertices : (V, 3) float array
        World positions [m], Z up.
    corner_vertex : (L,) int array
        Vertex of each corner, face by face.
    face_start : (P + 1,) int array
        First corner of each face, and the number of corners.
    triangle_corners : (T, 3) int array
        Corners of each triangle.
    triangle_face : (T,) int array
        Face of each triangle, ascending.
    """

    vertices: Array
    corner_vertex: Indices
    face_start: Indices
    triangle_corners: Indices
    triangle_face: Indices

    @cached_property
    def triangle_vertices(self) -> Indices:
        """Vertices of each triangle, (T, 3)."""
        return self.corner_vertex[self.triangle_corners]


@dataclass(frozen=True)
class Refinement:
    """Refinement of a surface: some of its faces are kept, the others become quads and triangles.

    Attributes
    ----------
    kept_faces : (K,) int array
        Faces that stay as they are, ascending.
    corner_vertex : (L,) int array
        Vertices of the new faces' corners, face by face; those from V on are new.
    face_start : (N + 1,) int array
        First corner of each new face, and the number of corners; quads come before triangles. The triangle of a quad's
        first three corners and that of the others are as they were cut.
    source : (N,) int array
        Triangle of the surface that each new face lies in.
    weights : (L, 2) float32 array
        Barycentric coordinates of each corner in that triangle, of its first two corners; the third's are the remainder
        to 1.
    new_vertex : (M,) int array
        The corner at which each new vertex occurs first.
    edges : (E, 2) int array
        New edges that are parts of the surface's edges.
    edge_of : (E, 2) int array
        Vertices of the surface's edge that each is a part of.
    """

    kept_faces: Indices
    corner_vertex: Numbers
    face_start: Numbers
    source: Numbers
    weights: NDArray[np.float32]
    new_vertex: Numbers
    edges: Indices
    edge_of: Indices

    def at_vertices(self, surface: Surface, values: NDArray[Any]) -> NDArray[Any]:
        """Values at all vertices, those of the surface first, (V + M, ...), from those at the surface's (V, ...).

        Real numbers are interpolated; of others, that of the nearest corner is taken.
        """
        source, weights = self._corner_source()[self.new_vertex], self.weights[self.new_vertex]
        return _continued(values, values, surface.triangle_vertices, source, weights)

    def at_corners(self, surface: Surface, values: NDArray[Any], corners: Indices) -> NDArray[Any]:
        """Values at kept corners of the surface, and behind them at those of the new faces, (C + L, ...)."""
        return _continued(values[corners], values, surface.triangle_corners, self._corner_source(), self.weights)

    def _corner_source(self) -> Numbers:
        """Triangle of the surface that each corner's face lies in, (L,)."""
        return np.repeat(self.source, np.diff(self.face_start))


def _continued(
    first: NDArray[Any], values: NDArray[Any], sources: Indices, number: Numbers, weights: NDArray[np.float32]
) -> NDArray[Any]:
    """Some values, and behind them those at N places within triangles.

    Where the values of triangles are is in `sources` (T, 3), which triangle each place is in is in `number` (N,), and
    where it is there in `weights` (N, 2).
    """
    whole = np.empty((len(first) + len(number), *values.shape[1:]), dtype=values.dtype)
    whole[: len(first)] = first
    behind = whole[len(first) :]
    for begin in range(0, len(number), AT_ONCE):
        part = slice(begin, begin + AT_ONCE)
        source, weight = sources[number[part]], np.empty((len(number[part]), 3))
        weight[:, :2] = weights[part]
        weight[:, 2] = 1.0 - weight[:, :2].sum(axis=1)
        if np.issubdtype(values.dtype, np.floating):
            behind[part] = np.einsum("nk,nk...->n...", weight, values[source].astype(np.float64, copy=False))
        else:
            behind[part] = values[source[np.arange(len(source)), weight.argmax(axis=1)]]
    return whole


@sliced
def refine(
    surface: Surface, region: Region, spacing: float, closer: tuple[Region, float] | None = None
) -> Slices[Refinement]:
    """Cut the faces of a surface until their corners are about `spacing` apart where the region is.

    Parameters
    ----------
    spacing : float
        Distance between vertices [m].
    closer : (Region, float), optional
        Part of the region where they are closer, by halving, and how close.

    Returns
    -------
    Refinement
        Its undisplaced surface is the given one: every new vertex lies in one of its triangles, those on an edge
        belong to all faces at the edge.
    """
    triangle_vertices = surface.triangle_vertices
    legs = [(where, COARSEST_LEG * distance) for where, distance in ((region, spacing), *([closer] if closer else []))]
    at_work = np.zeros(len(surface.face_start) - 1, dtype=bool)
    for where, leg in legs:
        at_work |= yield from _faces_at(surface, triangle_vertices, where, leg)
    yield
    finest = closer[1] if closer else spacing
    parts, grain = _equal_parts(surface, triangle_vertices[at_work[surface.triangle_face]], finest)
    if parts > 1:
        at_work[:] = True
    while True:
        yield
        chosen = np.flatnonzero(at_work[surface.triangle_face])
        mesh = Bisection(surface.vertices, triangle_vertices[chosen], parts, grain)
        yield
        for where, leg in legs:
            yield from mesh.run(where, leg)
        reached = _faces_with_edges(surface, mesh.cut_edges()) & ~at_work
        if not reached.any():
            return (yield from _result(surface, chosen, mesh))
        at_work |= reached


def _equal_parts(surface: Surface, wanted: Indices, spacing: float) -> tuple[int, float]:
    """Pieces that the edges of a surface are cut in before its wanted triangles, (N, 3), are halved; the grain."""
    if not 0 < len(wanted) <= len(surface.triangle_face) <= FEW_TRIANGLES:
        return 1, 1.0
    leg = float(np.median(longest_sides(surface.vertices, wanted))) / np.sqrt(2) / spacing
    counts = np.array([count for count in EQUAL_PARTS if count == 1 or leg / count > LEAST_PART])
    halvings = 2 * np.log2(leg / counts)
    best = int(np.abs(halvings - np.rint(halvings)).argmin())
    return int(counts[best]), max(FINEST_GRAIN, 2.0 ** (np.ceil(halvings[best] / 2) - WEIGHT_BITS))


def _faces_at(surface: Surface, triangle_vertices: Indices, region: Region, leg: float) -> Slices[Mask]:
    """Faces that are too large and reach into the region, with all faces that share a vertex with them."""
    place = surface.vertices[:, :2]
    touched = np.zeros(len(place), dtype=bool)
    for begin in range(0, len(triangle_vertices), AT_ONCE):
        yield
        triangles = triangle_vertices[begin : begin + AT_ONCE]
        corners = [place[corner] for corner in triangles.T]
        low, high = reduce(np.minimum, corners), reduce(np.maximum, corners)
        near = triangles[region.touches(low, high)]
        touched[near[longest_sides(surface.vertices, near) > leg * np.sqrt(2)]] = True
    yield
    return np.logical_or.reduceat(touched[surface.corner_vertex], surface.face_start[:-1])


def _faces_with_edges(surface: Surface, edges: Indices) -> Mask:
    """Faces that have one of the given edges, (E, 2) ascending pairs."""
    faces = np.zeros(len(surface.face_start) - 1, dtype=bool)
    if not len(edges):
        return faces
    ends = np.zeros(len(surface.vertices), dtype=bool)
    ends[edges] = True
    near = np.flatnonzero(np.logical_or.reduceat(ends[surface.corner_vertex], surface.face_start[:-1]))
    count = np.diff(surface.face_start)[near]
    owner, within = enumerated(count)
    face = near[owner]
    first = surface.face_start[face]
    start = surface.corner_vertex[first + within]
    end = surface.corner_vertex[first + (within + 1) % count[owner]]
    size = len(surface.vertices)
    keys = np.minimum(start, end) * size + np.maximum(start, end)
    faces[face[np.isin(keys, edges[:, 0] * size + edges[:, 1])]] = True
    return faces


def _result(surface: Surface, chosen: Indices, mesh: Bisection) -> Slices[Refinement]:
    """The refinement by a mesh that was made from the chosen triangles of a surface; it is of no use afterwards."""
    leaves = mesh.leaves_of_roots()
    leaf_ends, leaf_roots = mesh.ends[leaves], mesh.roots[mesh.root[leaves]]
    del mesh.ends, mesh.root, mesh.half
    pairs = mesh.pairs()
    del mesh.edge
    yield
    given = len(mesh.vertex)
    face = surface.triangle_face[chosen]
    parts = np.bincount(mesh.source, minlength=len(chosen))
    changed = np.zeros(len(surface.face_start) - 1, dtype=bool)
    changed[face[parts > 1]] = True
    single = changed[face[mesh.source]]
    single[pairs] = False
    place = _along_curve(mesh.points[:, :2])
    corner = mesh.corner.ravel()
    yield
    of_mesh, face_start = _faces(pairs, np.flatnonzero(single).astype(np.int32), place, corner)
    del pairs, single
    yield
    by_place = given + np.argsort(place[given:], kind="stable")
    point = corner[of_mesh]
    del place, corner, mesh.corner
    yield
    vertex = np.empty(len(mesh.points), dtype=np.int32)
    vertex[:given] = mesh.vertex
    vertex[by_place] = np.arange(len(surface.vertices), len(surface.vertices) + len(by_place))
    first = np.zeros(len(mesh.points), dtype=np.int32)
    first[point[::-1]] = np.arange(len(point))[::-1]
    weights = np.empty((len(of_mesh), 2), dtype=np.float32)
    for number in (1, 0):
        weights[:, number] = mesh.weight.pop().ravel()[of_mesh]
    return Refinement(
        kept_faces=np.flatnonzero(~changed),
        corner_vertex=vertex[point],
        face_start=face_start,
        source=chosen[mesh.source[of_mesh[face_start[:-1]] // 3]].astype(np.int32),
        weights=weights,
        new_vertex=first[by_place],
        edges=vertex[leaf_ends].astype(np.intp),
        edge_of=mesh.vertex[leaf_roots],
    )


def _faces(pairs: Numbers, single: Numbers, place: NDArray[np.int64], corner: Numbers) -> tuple[Numbers, Numbers]:
    """Corners of a bisection's triangles (`3·triangle + corner`) that make up quads and triangles, and their starts.

    Both are in order of the first of their places, which are given for the points that those corners are at.
    """
    kinds = []
    for faces in (
        3 * pairs[:, [0, 1, 0, 0]] + np.array([1, 0, 2, 0], dtype=np.int32),  # cut in two from their first corner
        3 * single[:, None] + np.arange(3, dtype=np.int32),
    ):
        begin = reduce(np.minimum, (place[corner[column]] for column in faces.T))
        kinds.append(faces[np.argsort(begin, kind="stable")])
    size = np.repeat(np.array([4, 3], dtype=np.int32), [len(faces) for faces in kinds])
    start = np.concatenate([[0], np.cumsum(size)]).astype(np.int32)
    return np.concatenate([faces.ravel() for faces in kinds]), start


def _along_curve(place: Array) -> NDArray[np.int64]:
    """Position of each place (N, 2) along a Z-order curve, on which neighbours lie near each other in memory."""
    if not len(place):
        return np.zeros(0, dtype=np.int64)
    extent = max(float(np.ptp(place, axis=0).max()), 1e-9)
    cell = ((place - place.min(axis=0)) * ((2**CURVE_BITS - 1) / extent)).astype(np.int64)
    code = np.zeros(len(place), dtype=np.int64)
    for bit in range(CURVE_BITS):
        code |= ((cell[:, 0] >> bit & 1) << 2 * bit) | ((cell[:, 1] >> bit & 1) << (2 * bit + 1))
    return code
