"""Triangles cut into equal parts: each edge in so many pieces, each triangle in the square of that.

Places along an edge are rounded to a grain, a power of two, so that weights and their sums are exact: the parts are
equal to a grain.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array, Indices


@dataclass(frozen=True)
class EqualParts:
    """The parts of T triangles.

    Attributes
    ----------
    points : (N, 3) float array
        The given points, and behind them the new ones.
    corner : (T·n², 3) int array
        Points of each part, turned like its triangle.
    source : (T·n²,) int array
        Triangle of each part.
    weight : (T·n², 3, 3) float32 array
        Barycentric coordinates of each corner in that triangle.
    pieces : (E, n, 2) int array
        Points of the pieces of each edge.
    """

    points: Array
    corner: Indices
    source: Indices
    weight: NDArray[np.float32]
    pieces: Indices


def equal_parts(points: Array, corner: Indices, edge: Indices, ends: Indices, count: int, grain: float) -> EqualParts:
    """Cut triangles into `count`² equal parts each; those that share an edge share its new points.

    Parameters
    ----------
    points : (V, 3) float array
    corner : (T, 3) int array
        Points of each triangle.
    edge : (T, 3) int array
        Its edges; the first lies opposite the first corner.
    ends : (E, 2) int array
        Points of each edge.
    grain : float
        1 / 2^n, of the length of an edge.

    Examples
    --------
    >>> points = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
    >>> ends = np.array([[1, 2], [0, 2], [0, 1]])
    >>> parts = equal_parts(points, np.array([[0, 1, 2]]), np.array([[0, 1, 2]]), ends, 2, 1 / 256)
    >>> parts.points[3:].tolist(), parts.corner.tolist()
    ([[1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]], [[4, 3, 2], [5, 1, 3], [0, 5, 4], [3, 4, 5]])
    """
    lattice, parts = _lattice(count)
    triangles = np.arange(len(corner))
    number = np.empty((len(corner), len(lattice)), dtype=np.intp)
    cuts = np.rint(np.arange(count + 1) / (count * grain)) * grain
    weight = np.stack([cuts[lattice[:, 0]], cuts[lattice[:, 1]], 1.0 - cuts[lattice[:, :2]].sum(axis=1)], axis=1)
    share = cuts[1:-1]
    along = points[ends[:, :1]] + share[:, None] * (points[ends[:, 1:]] - points[ends[:, :1]])
    is_inner = (lattice > 0).all(axis=1)
    within = weight[is_inner] @ points[corner]
    of_edges = len(points) + np.arange(len(ends) * (count - 1)).reshape(len(ends), count - 1)
    of_triangles = len(points) + of_edges.size + np.arange(within.size // 3).reshape(len(corner), -1)
    number[:, is_inner] = of_triangles
    for opposite in range(3):
        first, second = (opposite + 1) % 3, (opposite + 2) % 3
        number[:, lattice[:, opposite] == count] = corner[:, [opposite]]
        on_edge = (lattice[:, opposite] == 0) & (lattice[:, first] > 0) & (lattice[:, second] > 0)
        forward = (ends[edge[:, opposite], 0] == corner[triangles, first])[:, None]
        place = np.where(forward, lattice[on_edge, second], lattice[on_edge, first]) - 1
        number[:, on_edge] = of_edges[edge[:, [opposite]], place]
    chain = np.concatenate([ends[:, :1], of_edges, ends[:, 1:]], axis=1)
    return EqualParts(
        points=np.concatenate([points, along.reshape(-1, 3), within.reshape(-1, 3)]),
        corner=number[:, parts].reshape(-1, 3),
        source=np.repeat(triangles, len(parts)),
        weight=np.tile(weight[parts].astype(np.float32), (len(corner), 1, 1)),
        pieces=np.stack([chain[:, :-1], chain[:, 1:]], axis=-1),
    )


def _lattice(count: int) -> tuple[Indices, Indices]:
    """Points of a triangle that lie at whole steps from its sides, (L, 3), and those of each part, (`count`², 3)."""
    lattice = np.array([(i, j, count - i - j) for i in range(count + 1) for j in range(count + 1 - i)])
    place = {(i, j): number for number, (i, j, _) in enumerate(lattice.tolist())}
    upright = [(place[i + 1, j], place[i, j + 1], place[i, j]) for i in range(count) for j in range(count - i)]
    turned = [
        (place[i, j + 1], place[i + 1, j], place[i + 1, j + 1]) for i in range(count - 1) for j in range(count - 1 - i)
    ]
    return lattice, np.array([*upright, *turned], dtype=np.intp)
