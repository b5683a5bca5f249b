"""Closed outlines in the plane: traced from a coverage map, measured, and turned into signed distances.

An outline is a list of loops, (M, 2) arrays of vertices in order; the outer loops run counter-clockwise and the holes
clockwise, so that signed areas add up.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array

_BOTTOM, _RIGHT, _TOP, _LEFT = range(4)

_CROSSINGS: dict[int, tuple[tuple[int, int], ...]] = {
    1: ((_BOTTOM, _LEFT),),
    2: ((_RIGHT, _BOTTOM),),
    3: ((_RIGHT, _LEFT),),
    4: ((_TOP, _RIGHT),),
    5: ((_BOTTOM, _LEFT), (_TOP, _RIGHT)),
    6: ((_TOP, _BOTTOM),),
    7: ((_TOP, _LEFT),),
    8: ((_LEFT, _TOP),),
    9: ((_BOTTOM, _TOP),),
    10: ((_RIGHT, _BOTTOM), (_LEFT, _TOP)),
    11: ((_RIGHT, _TOP),),
    12: ((_LEFT, _RIGHT),),
    13: ((_BOTTOM, _RIGHT),),
    14: ((_LEFT, _BOTTOM),),
}
"""Marching squares: sides that the contour enters and leaves by, the inside on its left. The four bits of the key tell
which corners are inside: bottom left, bottom right, top right, top left."""

_DISTANCE_BLOCK = 8_000
"""Point-segment pairs handled at once: tables so small that their memory is used again, and not had anew."""


def trace_loops(coverage: Array, origin: Array, spacing: float) -> list[Array]:
    """Loops along which a map crosses one half, through linear interpolation between nodes.

    Parameters
    ----------
    coverage : (rows, columns) float array
        1 inside, 0 outside, and in between on the edge; taken as 0 beyond its border.
    origin : (2,) float array
        Position of node (0, 0) [m].
    spacing : float
        Distance between nodes [m].

    Returns
    -------
    list of (M, 2) float arrays
        Loops, longest first [m].
    """
    field = np.pad(np.asarray(coverage, dtype=float), 1) - 0.5
    columns = field.shape[1]
    inside = field > 0
    kind = inside[:-1, :-1] + 2 * inside[:-1, 1:] + 4 * inside[1:, 1:] + 8 * inside[1:, :-1]

    follower: dict[int, int] = {}
    for case, crossings in _CROSSINGS.items():
        row, column = np.nonzero(kind == case)
        node = row * columns + column
        sides = np.stack([2 * node, 2 * (node + 1) + 1, 2 * (node + columns), 2 * node + 1])
        for start, end in crossings:
            follower.update(zip(sides[start].tolist(), sides[end].tolist(), strict=True))

    loops = []
    while follower:
        first, current = follower.popitem()
        edges = [first]
        while current != first:
            edges.append(current)
            current = follower.pop(current)
        loops.append(_edge_points(field, np.array(edges)))
    loops.sort(key=len, reverse=True)
    return [np.asarray(origin) + (loop - 1.0) * spacing for loop in loops]


def _edge_points(field: Array, edges: NDArray[np.intp]) -> Array:
    """Crossings of the zero level and the given grid edges, as (x, y) in nodes; even edges run along x, odd along y."""
    node, along_y = np.divmod(edges, 2)
    row, column = np.divmod(node, field.shape[1])
    start = field[row, column]
    end = field[row + along_y, column + 1 - along_y]
    fraction = start / (start - end)
    return np.column_stack([column + fraction * (1 - along_y), row + fraction * along_y])


def area(loops: Sequence[Array]) -> float:
    """Area inside the loops [m²], holes taken off (shoelace formula)."""
    total = 0.0
    for loop in loops:
        x, y = loop.T
        total += float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
    return total


def signed_distance(points: Array, loops: Sequence[Array]) -> Array:
    """Exact distance from points to the nearest loop, negative inside.

    Parameters
    ----------
    points : (..., 2) float array
    loops : sequence of (M, 2) float arrays

    Returns
    -------
    (...) float array
        Same unit as the points.
    """
    start = np.concatenate(loops)
    end = np.concatenate([np.roll(loop, -1, axis=0) for loop in loops])
    flat = np.asarray(points, dtype=float).reshape(-1, 2)
    block = max(1, _DISTANCE_BLOCK // len(start))
    distance = np.concatenate(
        [_distance_to_segments(flat[first : first + block], start, end) for first in range(0, len(flat), block)]
    )
    return distance.reshape(np.shape(points)[:-1])


def _distance_to_segments(points: Array, start: Array, end: Array) -> Array:
    x, y = points.T[..., None]
    along_x, along_y = (end - start).T
    length_squared = np.maximum(along_x**2 + along_y**2, np.finfo(float).tiny)
    offset_x, offset_y = x - start[:, 0], y - start[:, 1]
    position = np.clip((offset_x * along_x + offset_y * along_y) / length_squared, 0.0, 1.0)
    gap_x, gap_y = offset_x - position * along_x, offset_y - position * along_y
    distance = np.sqrt((gap_x**2 + gap_y**2).min(axis=1))

    point, segment = np.nonzero((start[:, 1] > y) != (end[:, 1] > y))
    crossing = start[segment, 0] + offset_y[point, segment] / along_y[segment] * along_x[segment]
    crossings = np.bincount(point[crossing > x[point, 0]], minlength=len(points))
    return np.where(crossings % 2 == 1, -distance, distance)


def as_one_polygon(loops: Sequence[Array]) -> Array:
    """The loops as one polygon, joined by bridges of no width, so that its area is that of all the loops.

    Returns
    -------
    (N, 2) float array
    """
    joined = loops[0]
    for loop in loops[1:]:
        gaps = np.linalg.norm(joined[:, None] - loop, axis=-1)
        leave, enter = np.unravel_index(int(gaps.argmin()), gaps.shape)
        ring = np.roll(loop, -enter, axis=0)
        joined = np.concatenate([joined[: leave + 1], ring, ring[:1], joined[leave:]])
    return joined


def convex_hull(points: Array) -> Array:
    """Corners of the smallest convex outline around points (N, 2), counter-clockwise (Andrew's monotone chain)."""
    ordered = np.unique(points, axis=0)
    if len(ordered) < 3:
        return ordered

    def chain(places: Array) -> list[Array]:
        corners: list[Array] = []
        for place in places:
            while len(corners) > 1 and _turn(corners[-2], corners[-1], place) <= 0:
                corners.pop()
            corners.append(place)
        return corners[:-1]

    return np.array(chain(ordered) + chain(ordered[::-1]))


def _turn(a: Array, b: Array, c: Array) -> float:
    """Positive where the way from a over b to c turns left."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
