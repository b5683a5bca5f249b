"""Detail where it is wanted: the faces of a coarse surface, bisected along the trail down to the size of the cells.

Triangles are cut in two across their base, again and again, and their neighbours with them wherever an edge is cut
(newest vertex bisection), so that no crack opens and the sizes fall off gradually. Only the faces near the trail are
looked at; the work does not depend on how large the ground is. Halving alone would end anywhere between 0.84 and 1.19
cells, depending on the size of the faces: a ground of few faces is cut into equal parts first, from which it ends at a
cell.

References
----------
Mitchell, "Adaptive refinement for arbitrary finite-element spaces with hierarchical bases" (1991).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .cell_keys import Keys, among, keys_of, parents_of
from .equal_parts import equal_parts
from .triangles import enumerated
from .z_order import along_curve

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
Numbers = NDArray[np.int32]
"""Of vertices, edges and triangles, of which meshes hold no more either: there are many while they are cut."""
Mask = NDArray[np.bool_]

COARSEST_LEG = 2.0**0.25
"""Largest leg of a half square, in cells: halving areas leaves legs from 0.84 to 1.19 cells, about 1 in the middle."""

FEW_TRIANGLES = 64
"""So many triangles are cut into equal parts, all of them: parts of an edge that does not need them cost little."""
EQUAL_PARTS = (1, 3, 5, 7, 9, 11, 13)
"""Pieces that edges are cut into. Even numbers come to the same as halving; up to 13, halving ends within 4 % of a
cell."""
FINEST_GRAIN = 2.0**-14
"""Of the parts, in lengths of an edge."""
WEIGHT_BITS = 24
"""Bits of a weight in single precision: those of the grain and of the halvings are all that there are."""
LEAST_PART = 8.0
"""Smallest leg of an equal part, in cells: beside the trail, sizes still have some halvings to fall off in."""

AT_ONCE = 1 << 16
"""Triangles that are looked at together."""


class Region:
    """The part of the plane where detail is wanted, as cells, with a pyramid of coarser ones above them.

    Parameters
    ----------
    columns, rows : (N,) int arrays
        The cells.
    cell_size : float
        Side of a cell [m].
    """

    def __init__(self, columns: Indices, rows: Indices, cell_size: float) -> None:
        self.cell_size = cell_size
        self._levels = [np.unique(keys_of(np.stack([columns, rows], axis=-1)))]

    def touches(self, low: Array, high: Array) -> Mask:
        """Which of the boxes from `low` to `high`, (N, 2) [m], reach into the region, to about a cell."""
        if not len(self._levels[0]):
            return np.zeros(len(low), dtype=bool)
        extent = (high - low).max(axis=1) / (2 * self.cell_size)
        level = np.ceil(np.log2(np.maximum(extent, 1.0))).astype(int)
        touched = np.zeros(len(low), dtype=bool)
        for number in np.unique(level):
            boxes = np.flatnonzero(level == number)
            size = self.cell_size * 2.0**number
            first, last = (np.floor(corner[boxes] / size).astype(np.int64) for corner in (low, high))
            found = np.zeros(len(boxes), dtype=bool)
            for row in (first[:, 1], (first[:, 1] + last[:, 1]) // 2, last[:, 1]):
                for column in (first[:, 0], (first[:, 0] + last[:, 0]) // 2, last[:, 0]):
                    found |= self._holds(keys_of(np.stack([column, row], axis=-1)), int(number))
            touched[boxes] = found
        return touched

    def _holds(self, cells: Keys, level: int) -> Mask:
        while len(self._levels) <= level:
            self._levels.append(parents_of(self._levels[-1]))
        return among(self._levels[level], cells)


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


@dataclass(frozen=True)
class Refinement:
    """What becomes of a surface: some of its faces are kept, the others become triangles.

    Attributes
    ----------
    kept_faces : (K,) int array
        Faces that stay as they are, ascending.
    triangles : (N, 3) int array
        Vertices of the new triangles; those from V on are new.
    face : (N,) int array
        Face that each lies in.
    corners : (N, 3) int array
        Corners of the surface's triangle that each lies in.
    weights : (N, 3, 3) float32 array
        Barycentric coordinates of each corner in that triangle.
    new_vertex : (M,) int array
        Where each new vertex occurs first among the triangles' corners, 3·triangle + corner.
    edges : (E, 2) int array
        New edges that are parts of the surface's edges.
    edge_of : (E, 2) int array
        Vertices of the surface's edge that each is a part of.
    """

    kept_faces: Indices
    triangles: Numbers
    face: Numbers
    corners: Numbers
    weights: NDArray[np.float32]
    new_vertex: Numbers
    edges: Indices
    edge_of: Indices

    def vertex_sources(self, surface: Surface) -> tuple[Indices, NDArray[np.float32]]:
        """Vertices of the surface that each new vertex lies between, (M, 3), and their weights (M, 3)."""
        triangle, corner = np.divmod(self.new_vertex, 3)
        return surface.corner_vertex[self.corners[triangle]], self.weights[triangle, corner]

    def vertices(self, surface: Surface) -> Array:
        """World positions of all vertices, those of the surface first, (V + M, 3) [m]."""
        sources, weights = self.vertex_sources(surface)
        between = np.einsum("nk,nki->ni", weights.astype(np.float64), surface.vertices[sources])
        return np.concatenate([surface.vertices, between])


def refine(surface: Surface, region: Region, spacing: float) -> Refinement:
    """Cut the faces of a surface until their corners are about `spacing` apart where the region is.

    Parameters
    ----------
    surface : Surface
    region : Region
    spacing : float
        Distance between vertices [m].

    Returns
    -------
    Refinement
        Its undisplaced surface is the given one: every new vertex lies in one of its triangles, those on an edge
        belong to all faces at the edge.
    """
    triangle_vertices = surface.corner_vertex[surface.triangle_corners]
    at_work = _faces_at(surface, triangle_vertices, region, COARSEST_LEG * spacing)
    parts, grain = _equal_parts(surface, triangle_vertices[at_work[surface.triangle_face]], spacing)
    if parts > 1:
        at_work[:] = True
    while True:
        chosen = np.flatnonzero(at_work[surface.triangle_face])
        mesh = _Bisection(surface.vertices, triangle_vertices[chosen], parts, grain)
        mesh.run(region, COARSEST_LEG * spacing)
        reached = _faces_with_edges(surface, mesh.cut_edges()) & ~at_work
        if not reached.any():
            return mesh.result(surface, chosen)
        at_work |= reached


def _equal_parts(surface: Surface, wanted: Indices, spacing: float) -> tuple[int, float]:
    """Into how many pieces to cut the edges of a surface before its wanted triangles, (N, 3), are halved; the grain."""
    if not 0 < len(wanted) <= len(surface.triangle_face) <= FEW_TRIANGLES:
        return 1, 1.0
    leg = float(np.median(_longest(surface.vertices, wanted))) / np.sqrt(2) / spacing
    counts = np.array([count for count in EQUAL_PARTS if count == 1 or leg / count > LEAST_PART])
    halvings = 2 * np.log2(leg / counts)
    best = int(np.abs(halvings - np.rint(halvings)).argmin())
    return int(counts[best]), max(FINEST_GRAIN, 2.0 ** (np.ceil(halvings[best] / 2) - WEIGHT_BITS))


def _faces_at(surface: Surface, triangle_vertices: Indices, region: Region, leg: float) -> Mask:
    """Faces that are too large and reach into the region, with all faces that share a vertex with them."""
    place = surface.vertices[:, :2]
    corners = place[triangle_vertices]
    low, high = corners.min(axis=1), corners.max(axis=1)
    wanted = region.touches(low, high)
    wanted[wanted] = _longest(surface.vertices, triangle_vertices[wanted]) > leg * np.sqrt(2)
    touched = np.zeros(len(place), dtype=bool)
    touched[triangle_vertices[wanted]] = True
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
    here = surface.corner_vertex[first + within]
    there = surface.corner_vertex[first + (within + 1) % count[owner]]
    size = len(surface.vertices)
    keys = np.minimum(here, there) * size + np.maximum(here, there)
    faces[face[np.isin(keys, edges[:, 0] * size + edges[:, 1])]] = True
    return faces


def _longest(points: Array, triangles: Indices) -> Array:
    longest = np.zeros(len(triangles))
    for corner in range(3):
        side = points[triangles[:, corner]] - points[triangles[:, corner - 1]]
        np.maximum(longest, np.einsum("ni,ni->n", side, side), out=longest)
    return np.sqrt(longest)


def _edges(corner: Numbers, points: int) -> tuple[Numbers, Numbers]:
    """Edges of triangles, (E, 2) in ascending order, and those opposite each triangle's corners, (T, 3)."""
    ends = np.sort(np.stack([np.roll(corner, -1, axis=1), np.roll(corner, 1, axis=1)], axis=-1), axis=-1)
    keys, edge = np.unique(ends.reshape(-1, 2) @ (points, 1), return_inverse=True)
    pairs = np.stack(np.divmod(keys, max(points, 1)), axis=-1)
    return pairs.astype(np.int32), edge.reshape(-1, 3).astype(np.int32)


def _halved(values: NDArray[Any], triangles: Indices, *parts: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Values at the corners of triangles (T, 3) after some were cut in two: the first part in its place, the second
    behind all."""
    first, second = parts
    values[triangles] = np.stack(first, axis=1)
    return np.concatenate([values, np.stack(second, axis=1)])


def _count(many: int, first: int = 0) -> Numbers:
    return np.arange(first, first + many, dtype=np.int32)


class _Bisection:
    """Triangles that are cut in two across their base, which lies opposite their first corner.

    Edge k of a triangle lies opposite its corner k. A cut edge has two halves, which end in its middle; the first is at
    its first end. Of the weights there is an array for each corner of the surface's triangle.
    """

    def __init__(self, vertices: Array, triangles: Indices, parts: int = 1, grain: float = 1.0) -> None:
        self.vertex, local = np.unique(triangles, return_inverse=True)
        self.points = vertices[self.vertex]
        self.corner: Numbers = local.reshape(-1, 3).astype(np.int32)
        self.ends, self.edge = _edges(self.corner, len(self.vertex))
        self.root = _count(len(self.ends))
        self.half = np.full(len(self.ends), -1, dtype=np.int32)
        self.source = _count(len(triangles))
        self.weight = [np.tile(share, (len(triangles), 1)) for share in np.eye(3, dtype=np.float32)]
        self._roots = self.ends
        if parts > 1:
            self._cut_evenly(parts, grain)
        side = self.points[np.roll(self.corner, -1, axis=1)] - self.points[np.roll(self.corner, 1, axis=1)]
        base = np.argmax(np.einsum("tki,tki->tk", side, side), axis=1)
        turn = (base[:, None] + np.arange(3)) % 3
        self.corner, self.edge, *self.weight = (
            np.take_along_axis(of, turn, axis=1) for of in (self.corner, self.edge, *self.weight)
        )

    def _cut_evenly(self, count: int, grain: float) -> None:
        """Cut all triangles into equal parts."""
        parts = equal_parts(self.points, self.corner, self.edge, self.ends, count, grain)
        self.points, self.weight = parts.points, [parts.weight[:, :, corner] for corner in range(3)]
        self.corner, self.source = parts.corner.astype(np.int32), parts.source.astype(np.int32)
        ends, edge = _edges(self.corner, len(self.points))
        pieces = np.sort(parts.pieces.reshape(-1, 2), axis=1) @ (len(self.points), 1)
        root = np.full(len(ends), -1, dtype=np.int32)
        root[np.searchsorted(ends @ (len(self.points), 1), pieces)] = np.repeat(self.root, count)
        pieces_from = self._add_edges(ends, root)[0]
        self.half[: len(self._roots)] = pieces_from  # whichever: no triangle has a whole edge any more
        self.edge = np.int32(len(self._roots)) + edge

    def run(self, region: Region, leg: float) -> None:
        """Cut until no triangle with a longer leg reaches into the region."""
        fresh = np.arange(len(self.corner))
        while True:
            parts = [fresh[first : first + AT_ONCE] for first in range(0, len(fresh), AT_ONCE)]
            wanted = np.concatenate([fresh[:0], *(self._wanted(part, region, leg) for part in parts)])
            if not len(wanted):
                return
            marked = np.zeros(len(self.ends), dtype=bool)
            marked[self.edge[wanted, 0]] = True
            self._close(marked)
            self._cut_edges(np.flatnonzero(marked))
            fresh = self._cut_triangles()

    def _wanted(self, triangles: Indices, region: Region, leg: float) -> Indices:
        """Those triangles that are too large and reach into the region."""
        long = triangles[_longest(self.points, self.corner[triangles]) > leg * np.sqrt(2)]
        place = self.points[self.corner[long], :2]
        return long[region.touches(place.min(axis=1), place.max(axis=1))]

    def _close(self, marked: Mask) -> None:
        """Mark the base of every triangle that has a marked edge."""
        while True:
            behind = (marked[self.edge[:, 1]] | marked[self.edge[:, 2]]) & ~marked[self.edge[:, 0]]
            if not behind.any():
                return
            marked[self.edge[behind, 0]] = True

    def _cut_edges(self, edges: Indices) -> None:
        ends = self.ends[edges]
        middle = _count(len(edges), len(self.points))
        self.points = np.concatenate([self.points, (self.points[ends[:, 0]] + self.points[ends[:, 1]]) / 2])
        halves = np.stack([ends, np.stack([middle, middle], axis=-1)], axis=-1).reshape(-1, 2)
        self.half[edges] = self._add_edges(halves, np.repeat(self.root[edges], 2))[::2]

    def _add_edges(self, ends: Numbers, root: Numbers) -> Numbers:
        added = _count(len(ends), len(self.ends))
        self.ends = np.concatenate([self.ends, ends])
        self.root = np.concatenate([self.root, root])
        self.half = np.concatenate([self.half, np.full(len(ends), -1, dtype=np.int32)])
        return added

    def _cut_triangles(self) -> Indices:
        """Cut every triangle whose base is cut, and again where a part's base is; returns the parts."""
        parts = [np.zeros(0, dtype=np.intp)]
        candidates = np.arange(len(self.corner))
        while True:
            cut = candidates[self.half[self.edge[candidates, 0]] >= 0]
            if not len(cut):
                return np.unique(np.concatenate(parts))
            candidates = np.concatenate([cut, len(self.corner) + np.arange(len(cut))])
            self._halve(cut)
            parts.append(candidates)

    def _halve(self, triangles: Indices) -> None:
        apex, left, right = self.corner[triangles].T
        base, by_right, by_left = self.edge[triangles].T  # edges opposite apex, left and right
        middle = self.ends[self.half[base], 1]
        across = self._add_edges(np.stack([apex, middle], axis=-1), np.full(len(triangles), -1, dtype=np.int32))
        at_left = self.half[base] + (self.ends[base, 0] != left)
        at_right = self.half[base] + (self.ends[base, 0] != right)
        self.corner = _halved(self.corner, triangles, (middle, apex, left), (middle, right, apex))
        self.edge = _halved(self.edge, triangles, (by_left, at_left, across), (by_right, across, at_right))
        for corner, weight in enumerate(self.weight):
            apex, left, right = weight[triangles].T
            between = (left + right) / 2
            self.weight[corner] = _halved(weight, triangles, (between, apex, left), (between, right, apex))
        self.source = np.concatenate([self.source, self.source[triangles]])

    def cut_edges(self) -> Indices:
        """The surface's edges that were cut, as ascending pairs of its vertices, (E, 2)."""
        return self.vertex[self._roots[self.half[: len(self._roots)] >= 0]]

    def result(self, surface: Surface, chosen: Indices) -> Refinement:
        """The refinement, where the triangles were those of the surface that were chosen; they are cut no more."""
        del self.edge
        given = len(self.vertex)
        face = surface.triangle_face[chosen]
        parts = np.bincount(self.source, minlength=len(chosen))
        changed = np.zeros(len(surface.face_start) - 1, dtype=bool)
        changed[face[parts > 1]] = True
        ours = np.flatnonzero(changed[face[self.source]])
        place = along_curve(self.points[:, :2])
        begin = reduce(np.minimum, (place[self.corner[ours, number]] for number in range(3)))
        ours = ours[np.argsort(begin, kind="stable")]
        corner = self.corner[ours]
        by_place = given + np.argsort(place[given:], kind="stable")
        vertex = np.empty(len(self.points), dtype=np.int32)
        vertex[:given] = self.vertex
        vertex[by_place] = _count(len(by_place), len(surface.vertices))
        first = np.zeros(len(self.points), dtype=np.int32)
        first[corner.ravel()[::-1]] = _count(corner.size)[::-1]
        leaf = np.flatnonzero((self.half < 0) & (self.root >= 0) & (np.arange(len(self.ends)) >= len(self._roots)))
        weights = np.empty((len(ours), 3, 3), dtype=np.float32)
        for number in (2, 1, 0):
            weights[:, :, number] = self.weight.pop()[ours]
        return Refinement(
            kept_faces=np.flatnonzero(~changed),
            triangles=vertex[corner],
            face=face[self.source[ours]].astype(np.int32),
            corners=surface.triangle_corners[chosen].astype(np.int32)[self.source[ours]],
            weights=weights,
            new_vertex=first[by_place],
            edges=vertex[self.ends[leaf]].astype(np.intp),
            edge_of=self.vertex[self._roots[self.root[leaf]]],
        )
