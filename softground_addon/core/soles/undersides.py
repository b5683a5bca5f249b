"""The underside of a mesh as a map: a vectorised z-buffer seen from below."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array
from ..numerics.triangles import SLACK

SUPERSAMPLING = 4
"""Samples per node along each axis; edges are then known to a few per cent of the node distance."""

_TRIANGLE_BLOCK, _PAIR_BLOCK = 1 << 12, 1 << 14
"""Triangles, and pairs of these and samples, that are handled at once: as many as the processor's cache holds."""

_DISTANCE_BLOCK = 2_000_000
"""Pairs of nodes whose distances are known at once, to bound memory."""

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
    *across, up = np.ascontiguousarray(vertices.T)
    x_of, y_of = ((along - start) / spacing for along, start in zip(across, origin, strict=True))
    buffer = np.full(rows * columns, np.inf)
    for start in range(0, len(triangles), _TRIANGLE_BLOCK):
        corners = np.ascontiguousarray(triangles[start : start + _TRIANGLE_BLOCK].T)
        x, y = x_of.take(corners), y_of.take(corners)
        (left, right), (low, high) = _nodes_within(x, columns), _nodes_within(y, rows)
        lying = np.abs((x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0])) > _UPRIGHT
        holds = np.flatnonzero((left <= right) & (low <= high) & lying)  # few triangles of a fine mesh
        places = np.stack([x.take(holds, axis=1), y.take(holds, axis=1), up.take(corners.take(holds, axis=1))])
        first = left.take(holds), low.take(holds)
        size = right.take(holds) - first[0] + 1, high.take(holds) - first[1] + 1
        order = np.cumsum(size[0] * size[1])
        begin = 0
        while begin < len(holds):
            done = order[begin - 1] if begin else 0
            end = max(begin + 1, int(np.searchsorted(order, done + _PAIR_BLOCK, side="right")))
            block = slice(begin, end)
            _draw(
                buffer,
                columns,
                places[..., block],
                *((of_column[block], of_row[block]) for of_column, of_row in (first, size)),
            )
            begin = end
    return buffer.reshape(shape)


def _nodes_within(along: Array, nodes: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First and last of the nodes along an axis in the box around each triangle (3, T), (T,) each."""
    a, b, c = along
    first = np.clip(np.ceil(np.minimum(np.minimum(a, b), c)), 0, nodes)
    last = np.clip(np.floor(np.maximum(np.maximum(a, b), c)), -1, nodes - 1)
    return first.astype(np.intp), last.astype(np.intp)


def _draw(
    buffer: Array,
    columns: int,
    places: Array,
    first: tuple[NDArray[np.intp], NDArray[np.intp]],
    size: tuple[NDArray[np.intp], NDArray[np.intp]],
) -> None:
    """Lower the buffer to triangles (x y z, corner, T), all pairs of triangle and node in its box at once."""
    # Barycentric coordinates and height are linear over the nodes of a triangle's box: at its first node, and per step.
    a, b, c = places.swapaxes(0, 1)
    (along_b, up_b, rise_b), (along_c, up_c, rise_c) = b - a, c - a
    determinant = along_b * up_c - up_b * along_c
    x, y = first[0] - a[0], first[1] - a[1]
    v = np.array([x * up_c - y * along_c, up_c, -along_c]) / determinant
    w = np.array([along_b * y - up_b * x, -up_b, along_b]) / determinant
    height = v * rise_b + w * rise_c
    height[0] += a[2]

    count = size[0] * size[1]
    of = np.repeat(np.arange(len(count)), count)
    within = np.arange(len(of)) - (np.cumsum(count) - count).take(of)
    wide = size[0].take(of)
    row = within // wide
    column = within - row * wide

    def over(linear: Array, of: NDArray[np.intp], column: NDArray[np.intp], row: NDArray[np.intp]) -> Array:
        values: Array = linear[0].take(of)
        values += linear[1].take(of) * column
        values += linear[2].take(of) * row
        return values

    part_b, part_c = over(v, of, column, row), over(w, of, column, row)
    covered = np.flatnonzero((part_b >= -SLACK) & (part_c >= -SLACK) & (part_b + part_c <= 1 + SLACK))
    of, column, row = of.take(covered), column.take(covered), row.take(covered)
    index = (first[1] * columns + first[0]).take(of) + row * columns + column
    np.minimum.at(buffer, index, over(height, of, column, row))


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
    block = max(1, _DISTANCE_BLOCK // max(len(source), 1))
    for first in range(0, len(target), block):
        part = target[first : first + block]
        nearest = ((part[:, None] - source) ** 2).sum(axis=-1).argmin(axis=1)
        filled[tuple(part.T)] = heights[tuple(source[nearest].T)]
    return filled
