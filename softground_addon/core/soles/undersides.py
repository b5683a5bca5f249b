"""The underside of a mesh as a map: a vectorised z-buffer seen from below."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array
from ..numerics.triangles import SLACK, cross

SUPERSAMPLING = 4
"""Samples per node along each axis; edges are then known to a few per cent of the node distance."""

_PAIR_BLOCK = 2_000_000
"""Triangle-sample pairs handled at once, to bound memory."""

_UPRIGHT = 1e-12
"""Triangles that cover less than this are upright, in squares of the node distance."""

_RELAXATIONS = 200
"""Sweeps that smooth the continuation outside; it only has to be smooth near the edge."""


def underside_map(
    vertices: Array,
    triangles: NDArray[np.intp],
    origin: Array,
    shape: tuple[int, int],
    spacing: float,
    *,
    band: float = np.inf,
) -> tuple[Array, Array, Array]:
    """Height of the lowest surface over each node of a grid, and the share of the node's cell that it covers.

    Parameters
    ----------
    vertices : (V, 3) float array
        Positions, z up [m].
    triangles : (T, 3) int array
    origin : (2,) float array
        Position of node (0, 0) [m].
    shape : (rows, columns)
    spacing : float
        Distance between nodes [m].
    band : float
        Surfaces higher than this above the lowest one do not count [m].

    Returns
    -------
    heights : (rows, columns) float array
        Mean height of the underside in the node's cell [m], NaN where nothing counts.
    coverage : (rows, columns) float array
        Covered fraction of the node's cell.
    samples : (rows·SUPERSAMPLING, columns·SUPERSAMPLING) float array
        Height at each sample [m], infinite where nothing counts.
    """
    fine = spacing / SUPERSAMPLING
    fine_origin = np.asarray(origin) - spacing / 2 + fine / 2
    rows, columns = shape
    lowest = lowest_surface(vertices, triangles, fine_origin, (rows * SUPERSAMPLING, columns * SUPERSAMPLING), fine)
    lowest[lowest > lowest.min() + band] = np.inf
    counts = np.isfinite(lowest)

    cells = (rows, SUPERSAMPLING, columns, SUPERSAMPLING)
    samples = counts.reshape(cells).sum(axis=(1, 3))
    total = np.where(counts, lowest, 0.0).reshape(cells).sum(axis=(1, 3))
    with np.errstate(invalid="ignore"):
        heights = np.where(samples > 0, total / samples, np.nan)
    return heights, samples / SUPERSAMPLING**2, lowest


def lowest_surface(
    vertices: Array, triangles: NDArray[np.intp], origin: Array, shape: tuple[int, int], spacing: float
) -> Array:
    """Lowest z of the triangles (T, 3) over each node, (rows, columns), infinite where there is none.

    Upright triangles have no underside and are left out.
    """
    rows, columns = shape
    places = (vertices[:, :2] - origin) / spacing
    first, last = _nodes_within(places, triangles, (columns, rows))
    holds = np.flatnonzero((first[:, 0] <= last[:, 0]) & (first[:, 1] <= last[:, 1]))  # few triangles of a fine mesh
    triangles, first, last = triangles[holds], first[holds], last[holds]
    flat = places[triangles]
    lying = np.abs(cross(flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0])) > _UPRIGHT
    heights, flat, first, last = vertices[triangles[lying], 2], flat[lying], first[lying], last[lying]
    size = last - first + 1
    count = size.prod(axis=1)
    order = np.cumsum(count)

    buffer = np.full(rows * columns, np.inf)
    start = 0
    while start < len(heights):
        done = order[start - 1] if start else 0
        stop = max(start + 1, int(np.searchsorted(order, done + _PAIR_BLOCK, side="right")))
        block = slice(start, stop)
        _draw(buffer, columns, flat[block], heights[block], first[block], size[block], count[block])
        start = stop
    return buffer.reshape(shape)


def _nodes_within(
    places: Array, triangles: NDArray[np.intp], nodes: tuple[int, int]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """First and last column and row of the nodes in the box around each triangle, (T, 2) each."""
    first, last = np.empty((2, len(triangles), 2), dtype=np.int32)
    a, b, c = np.ascontiguousarray(triangles.T)
    for axis, (count, along) in enumerate(zip(nodes, places.T, strict=True)):
        after = np.clip(np.ceil(along), 0, count).astype(np.int32)
        before = np.clip(np.floor(along), -1, count - 1).astype(np.int32)
        np.minimum(np.minimum(after.take(a), after.take(b)), after.take(c), out=first[:, axis])
        np.maximum(np.maximum(before.take(a), before.take(b)), before.take(c), out=last[:, axis])
    return first, last


def _draw(
    buffer: Array,
    columns: int,
    flat: Array,
    z: Array,
    first: NDArray[np.intp],
    size: NDArray[np.intp],
    count: NDArray[np.intp],
) -> None:
    """Lower the buffer to a block of triangles, all pairs of triangle and covered node at once."""
    # Barycentric coordinates and height are linear over the nodes of a triangle's box: at its first node, and per step.
    a, b, c = (flat[:, corner] for corner in range(3))
    (along_b, up_b), (along_c, up_c) = (b - a).T, (c - a).T
    determinant = along_b * up_c - up_b * along_c
    x, y = (first - a).T
    v = np.array([x * up_c - y * along_c, up_c, -along_c]) / determinant
    w = np.array([along_b * y - up_b * x, -up_b, along_b]) / determinant
    height = v * (z[:, 1] - z[:, 0]) + w * (z[:, 2] - z[:, 0])
    height[0] += z[:, 0]

    within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    row, column = np.divmod(within, np.repeat(size[:, 0], count))

    def over(at_first: Array, per_column: Array, per_row: Array) -> Array:
        values: Array = np.repeat(at_first, count)
        values += np.repeat(per_column, count) * column
        values += np.repeat(per_row, count) * row
        return values

    part_b, part_c = over(*v), over(*w)
    covered = np.flatnonzero((part_b >= -SLACK) & (part_c >= -SLACK) & (part_b + part_c <= 1 + SLACK))
    index = np.repeat(first[:, 1] * columns + first[:, 0], count) + row * columns + column
    np.minimum.at(buffer, index[covered], over(*height)[covered])


def continue_outside(heights: Array) -> Array:
    """A map with its NaN nodes filled: the nearest known height first, then smoothed toward a harmonic continuation.

    Parameters
    ----------
    heights : (rows, columns) float array

    Returns
    -------
    (rows, columns) float array
        Equal to the input where that is a number.
    """
    known = np.isfinite(heights)
    border = np.pad(_spread_nearest(heights, known), 1, mode="edge")
    inner, mean, unknown = border[1:-1, 1:-1], np.empty_like(heights), ~known
    for _ in range(_RELAXATIONS):
        border[0], border[-1], border[:, 0], border[:, -1] = border[1], border[-2], border[:, 1], border[:, -2]
        np.add(border[:-2, 1:-1], border[2:, 1:-1], out=mean)
        mean += border[1:-1, :-2]
        mean += border[1:-1, 2:]
        mean *= 0.25
        np.copyto(inner, mean, where=unknown)
    return inner.copy()


def _spread_nearest(heights: Array, known: NDArray[np.bool_]) -> Array:
    """Each unknown node takes the height of the nearest known one."""
    around = np.pad(known, 1, mode="edge")
    enclosed = around[:-2, 1:-1] & around[2:, 1:-1] & around[1:-1, :-2] & around[1:-1, 2:]
    source = np.argwhere(known & ~enclosed)  # of the enclosed ones none is the nearest
    target = np.argwhere(~known)
    filled = heights.copy()
    block = max(1, _PAIR_BLOCK // max(len(source), 1))
    for first in range(0, len(target), block):
        part = target[first : first + block]
        nearest = ((part[:, None] - source) ** 2).sum(axis=-1).argmin(axis=1)
        filled[tuple(part.T)] = heights[tuple(source[nearest].T)]
    return filled
