"""Triangles cut in two across their base, again and again, and their neighbours with them wherever an edge is cut.

No crack opens, and the sizes fall off gradually (newest vertex bisection). Halving alone would end anywhere between
0.84 and 1.19 cells, depending on the size of the triangles: a few of them can be cut into equal parts first, from which
it ends at a cell.

References
----------
Mitchell, "Adaptive refinement for arbitrary finite-element spaces with hierarchical bases" (1991).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array, Indices, Mask
from ..numerics.slices import Slices
from .equal_parts import equal_parts
from .region import Region

Numbers = NDArray[np.int32]
"""Numbers of vertices, edges and triangles, as wide as in meshes: there are many while they are cut."""

AT_ONCE = 1 << 16
"""Triangles that are looked at together."""


def longest_sides(points: Array, triangles: NDArray[Any]) -> Array:
    """Length of the longest side of each triangle (T, 3), (T,) [m]."""
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


def _lengthened(values: NDArray[Any], more: int) -> NDArray[Any]:
    """Values (N, ...) with room for more behind them."""
    longer = np.empty((len(values) + more, *values.shape[1:]), dtype=values.dtype)
    longer[: len(values)] = values
    return longer


def _stacked(*parts: Sequence[NDArray[Any]]) -> list[NDArray[Any]]:
    """Values at three corners side by side, (N, 3), of each of the parts."""
    return [np.stack(part, axis=1) for part in parts]


def _counted(count: int, first: int = 0) -> Numbers:
    return np.arange(first, first + count, dtype=np.int32)


class Bisection:
    """Triangles that are cut in two across their base, which lies opposite their first corner.

    Edge k of a triangle lies opposite its corner k. A cut edge has two halves, which end in its middle; the first is at
    its first end. The weights of a corner are its barycentric coordinates in the given triangle that it lies in: there
    is an array for each of that triangle's first two corners, and the third's are the remainder to 1.

    Attributes
    ----------
    vertex : (G,) int array
        The given vertices that the triangles are of, ascending.
    points : (P, 3) float array
        Places of those, and behind them of the middles [m].
    corner, edge : (T, 3) int arrays
        Points and edges of each triangle.
    weight : list of two (T, 3) float32 arrays
        See above.
    source : (T,) int array
        Given triangle that each lies in.
    ends : (E, 2) int array
        Points of each edge, the given ones first.
    root : (E,) int array
        Given edge that each is a part of, -1 where it is none.
    half : (E,) int array
        First half of each cut edge, -1 of the others.
    roots : (R, 2) int array
        Points of the given edges.
    """

    def __init__(self, vertices: Array, triangles: Indices, parts: int, grain: float) -> None:
        self.vertex, local = np.unique(triangles, return_inverse=True)
        self.points = vertices[self.vertex]
        self.corner: Numbers = local.reshape(-1, 3).astype(np.int32)
        self.ends, self.edge = _edges(self.corner, len(self.vertex))
        self.root = _counted(len(self.ends))
        self.half = np.full(len(self.ends), -1, dtype=np.int32)
        self.source = _counted(len(triangles))
        self.weight = [np.tile(share, (len(triangles), 1)) for share in np.eye(3, dtype=np.float32)[:2]]
        self.roots = self.ends
        side = self.points[np.roll(self.corner, -1, axis=1)] - self.points[np.roll(self.corner, 1, axis=1)]
        base = np.argmax(np.einsum("tki,tki->tk", side, side), axis=1)
        if parts > 1:
            self._cut_evenly(parts, grain)
        # The parts of a triangle are alike, and have their bases side by side.
        turn = (base[self.source, None] + np.arange(3)) % 3
        self.corner, self.edge, *self.weight = (
            np.take_along_axis(of, turn, axis=1) for of in (self.corner, self.edge, *self.weight)
        )

    def _cut_evenly(self, count: int, grain: float) -> None:
        """Cut all triangles into equal parts."""
        parts = equal_parts(self.points, self.corner, self.edge, self.ends, count, grain)
        self.points, self.weight = parts.points, [parts.weight[:, :, corner] for corner in range(2)]
        self.corner, self.source = parts.corner.astype(np.int32), parts.source.astype(np.int32)
        ends, edge = _edges(self.corner, len(self.points))
        pieces = np.sort(parts.pieces.reshape(-1, 2), axis=1) @ (len(self.points), 1)
        root = np.full(len(ends), -1, dtype=np.int32)
        root[np.searchsorted(ends @ (len(self.points), 1), pieces)] = np.repeat(self.root, count)
        pieces_from = self._add_edges(ends, root)[0]
        self.half[: len(self.roots)] = pieces_from  # whichever: no triangle has a whole edge any more
        self.edge = np.int32(len(self.roots)) + edge

    def run(self, region: Region, leg: float) -> Slices[None]:
        """Cut until no triangle with a longer leg reaches into the region, round by round."""
        fresh = _counted(len(self.corner))
        while True:
            parts = [fresh[first : first + AT_ONCE] for first in range(0, len(fresh), AT_ONCE)]
            wanted = np.concatenate([fresh[:0], *(self._wanted(part, region, leg) for part in parts)])
            if not len(wanted):
                return
            marked = np.zeros(len(self.ends), dtype=bool)
            marked[self.edge[wanted, 0]] = True
            yield
            self._close(marked)
            self._cut_edges(np.flatnonzero(marked))
            fresh = yield from self._cut_triangles()

    def _wanted(self, triangles: Numbers, region: Region, leg: float) -> Numbers:
        """Triangles that are too large and reach into the region."""
        long = triangles[longest_sides(self.points, self.corner[triangles]) > leg * np.sqrt(2)]
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
        middle = _counted(len(edges), len(self.points))
        self.points = np.concatenate([self.points, (self.points[ends[:, 0]] + self.points[ends[:, 1]]) / 2])
        halves = np.stack([ends, np.stack([middle, middle], axis=-1)], axis=-1).reshape(-1, 2)
        self.half[edges] = self._add_edges(halves, np.repeat(self.root[edges], 2))[::2]

    def _add_edges(self, ends: Numbers, root: Numbers) -> Numbers:
        added = _counted(len(ends), len(self.ends))
        self.ends = np.concatenate([self.ends, ends])
        self.root = np.concatenate([self.root, root])
        self.half = np.concatenate([self.half, np.full(len(ends), -1, dtype=np.int32)])
        return added

    def _cut_triangles(self) -> Slices[Numbers]:
        """Cut every triangle whose base is cut, and again where a part's base is; returns the parts."""
        is_part = np.zeros(len(self.corner), dtype=bool)
        candidates = _counted(len(self.corner))
        while True:
            yield
            cut = candidates[self.half[self.edge[candidates, 0]] >= 0]
            if not len(cut):
                return np.flatnonzero(is_part).astype(np.int32)
            is_part[cut] = True
            is_part = np.concatenate([is_part, np.ones(len(cut), dtype=bool)])
            candidates = np.concatenate([cut, _counted(len(cut), len(self.corner))])
            self._halve(cut)

    def _halve(self, triangles: Numbers) -> None:
        """Cut triangles in two: the first part takes their place, the second comes behind all."""
        first_across, behind, more = len(self.ends), len(self.corner), len(triangles)
        for name in ("corner", "edge", "source"):
            setattr(self, name, _lengthened(getattr(self, name), more))
        for number in range(len(self.weight)):
            self.weight[number] = _lengthened(self.weight[number], more)
        across_ends = np.empty((more, 2), dtype=np.int32)
        for begin in range(0, more, AT_ONCE):
            whole = triangles[begin : begin + AT_ONCE]
            part = slice(behind + begin, behind + begin + len(whole))
            apex, left, right = self.corner[whole].T
            base, by_right, by_left = self.edge[whole].T  # edges opposite apex, left and right
            middle = self.ends[self.half[base], 1]
            across = _counted(len(whole), first_across + begin)
            across_ends[begin : begin + AT_ONCE] = np.stack([apex, middle], axis=-1)
            at_left = self.half[base] + (self.ends[base, 0] != left)
            at_right = self.half[base] + (self.ends[base, 0] != right)
            self.corner[whole], self.corner[part] = _stacked((middle, apex, left), (middle, right, apex))
            self.edge[whole], self.edge[part] = _stacked((by_left, at_left, across), (by_right, across, at_right))
            for weight in self.weight:
                apex, left, right = weight[whole].T
                between = (left + right) / 2
                weight[whole], weight[part] = _stacked((between, apex, left), (between, right, apex))
            self.source[part] = self.source[whole]
        self._add_edges(across_ends, np.full(more, -1, dtype=np.int32))

    def pairs(self) -> Numbers:
        """Triangles at either side of one base, both in the same given triangle, (Q, 2): parallelograms, to a grain."""
        base, number = self.edge[:, 0], _counted(len(self.edge))
        first, last = np.zeros((2, base.max(initial=-1) + 1), dtype=np.int32)
        first[base[::-1]], last[base] = number[::-1], number
        shared = np.flatnonzero(first != last)
        pairs = np.stack([first[shared], last[shared]], axis=-1)
        return pairs[self.source[pairs[:, 0]] == self.source[pairs[:, 1]]]

    def cut_edges(self) -> Indices:
        """The given edges that were cut, as ascending pairs of vertices, (E, 2)."""
        return self.vertex[self.roots[self.half[: len(self.roots)] >= 0]]

    def leaves_of_roots(self) -> Indices:
        """Parts of the given edges that are not cut themselves."""
        behind = len(self.roots)
        return behind + np.flatnonzero((self.half[behind:] < 0) & (self.root[behind:] >= 0))
