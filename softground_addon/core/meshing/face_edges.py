"""Edges of the faces of a mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..numerics.slices import Slices, sliced

Numbers = NDArray[np.int32]

AT_ONCE = 1 << 19
"""Corners whose edges are looked for together, about: a tenth of a second."""


@sliced
def face_edges(corner_vertex: NDArray[np.integer], face_start: NDArray[np.integer]) -> Slices[tuple[Numbers, Numbers]]:
    """Edges of faces, each once.

    Parameters
    ----------
    corner_vertex : (L,) int array
        Vertex of each corner, face by face.
    face_start : (P,) int array
        First corner of each face.

    Returns
    -------
    edges : (E, 2) int32 array
        Vertices of each edge, ascending.
    corner_edge : (L,) int32 array
        Edge from each corner to the next one of its face.

    Examples
    --------
    A square and a triangle at its side:

    >>> edges, corner_edge = face_edges(np.array([0, 1, 2, 3, 1, 4, 2]), np.array([0, 4]))
    >>> edges.tolist(), corner_edge.tolist()
    ([[0, 1], [0, 3], [1, 2], [1, 4], [2, 3], [2, 4]], [0, 2, 4, 1, 3, 5, 2])
    """
    count, size = len(corner_vertex), int(corner_vertex.max(initial=-1)) + 1
    following = np.empty(count, dtype=np.int32)
    following[:-1] = corner_vertex[1:]
    following[np.append(face_start, count)[1:] - 1] = corner_vertex[face_start]
    low, high = np.minimum(corner_vertex, following), np.maximum(corner_vertex, following)
    corner_edge, edges, known = np.empty(count, dtype=np.int32), [np.empty((0, 2), dtype=np.int32)], 0
    vertices = max(1, size * AT_ONCE // max(1, count))
    for first in range(0, size, vertices):
        yield
        here = np.flatnonzero((low >= first) & (low < first + vertices))
        keys, edge = np.unique(low[here].astype(np.int64) * size + high[here], return_inverse=True)
        corner_edge[here] = known + edge
        edges.append(np.stack([keys // size, keys % size], axis=-1).astype(np.int32))
        known += len(keys)
    return np.concatenate(edges), corner_edge
