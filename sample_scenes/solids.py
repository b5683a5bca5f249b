"""Smooth closed surfaces from signed distances: a few primitives, their smooth union, and a mesh of the zero level."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Solid = Callable[[Array], Array]
"""Points (..., 3) [m] to signed distance [m], negative inside."""


def round_cone(start: ArrayLike, end: ArrayLike, start_radius: float, end_radius: float) -> Solid:
    """A limb: the spheres swept from `start` to `end` while the radius changes linearly."""
    a, b = np.asarray(start, float), np.asarray(end, float)
    axis = b - a

    def distance(points: Array) -> Array:
        along = np.clip((points - a) @ axis / (axis @ axis), 0.0, 1.0)
        radius = start_radius + along * (end_radius - start_radius)
        return np.linalg.norm(points - a - along[..., None] * axis, axis=-1) - radius

    return distance


def ellipsoid(centre: ArrayLike, radii: ArrayLike, axes: ArrayLike | None = None) -> Solid:
    """An ellipsoid whose axes are the rows of `axes` (default: the world's). The distance is first-order exact."""
    c, r = np.asarray(centre, float), np.asarray(radii, float)
    frame = np.eye(3) if axes is None else np.asarray(axes, float)

    def distance(points: Array) -> Array:
        local = (points - c) @ frame.T
        reach = np.linalg.norm(local / r, axis=-1)
        slope = np.linalg.norm(local / r**2, axis=-1)
        return reach * (reach - 1) / np.maximum(slope, 1e-9)

    return distance


def union(solids: Iterable[Solid], blend: float) -> Solid:
    """Several solids as one, with fillets of about `blend` [m] where they meet (polynomial smooth minimum)."""
    parts = tuple(solids)

    def distance(points: Array) -> Array:
        result = parts[0](points)
        for part in parts[1:]:
            other = part(points)
            overlap = np.maximum(blend - np.abs(result - other), 0.0) / blend
            result = np.minimum(result, other) - overlap**2 * blend / 4
        return result

    return distance


def cut(solid: Solid, point: ArrayLike, normal: ArrayLike, rounding: float) -> Solid:
    """The part of a solid behind a plane, the edge rounded by about `rounding` [m]."""
    p, n = np.asarray(point, float), np.asarray(normal, float)
    n = n / np.linalg.norm(n)

    def distance(points: Array) -> Array:
        inside, behind = solid(points), (points - p) @ n
        overlap = np.maximum(rounding - np.abs(inside - behind), 0.0) / rounding
        return np.maximum(inside, behind) + overlap**2 * rounding / 4

    return distance


def mesh_of(solid: Solid, low: ArrayLike, high: ArrayLike, spacing: float) -> tuple[Array, NDArray[np.intp]]:
    """Vertices (V, 3) and outward quads (Q, 4) of a solid's surface within a box: naive surface nets (Gibson 1998).

    Each grid cell that the surface crosses holds one vertex, which two Newton steps put on the surface itself.
    """
    low, high = np.asarray(low, float), np.asarray(high, float)
    counts = np.ceil((high - low) / spacing).astype(int) + 1
    grid = low + spacing * np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1)
    inside = _without_checkerboards(solid(grid) < 0)

    corners = sum(
        inside[i : i + counts[0] - 1, j : j + counts[1] - 1, k : k + counts[2] - 1].astype(int)
        for i in (0, 1)
        for j in (0, 1)
        for k in (0, 1)
    )
    crossed = (corners > 0) & (corners < 8)
    index = np.full(crossed.shape, -1)
    index[crossed] = np.arange(crossed.sum())
    vertices = low + spacing * (np.argwhere(crossed) + 0.5)

    quads = []
    for axis in range(3):
        ahead = np.take(inside, np.arange(1, counts[axis]), axis)
        here = np.take(inside, np.arange(counts[axis] - 1), axis)
        edges = np.argwhere(here != ahead)
        u, v = np.eye(3, dtype=int)[[(axis + 1) % 3, (axis + 2) % 3]]
        ring = np.stack([index[tuple((edges - du * u - dv * v).T)] for du, dv in ((0, 0), (1, 0), (1, 1), (0, 1))], -1)
        leaves = here[tuple(edges.T)]  # the surface normal points along the axis where the solid ends ahead
        ring[~leaves] = ring[~leaves, ::-1]
        quads.append(ring)

    for _ in range(2):
        vertices = vertices - solid(vertices)[:, None] * _gradient(solid, vertices, spacing / 8)
    return vertices, np.concatenate(quads)


def _without_checkerboards(inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The samples with every grid face filled whose inner corners touch only diagonally.

    Through such a face surface nets would join four quads at one edge.
    """
    inside = inside.copy()
    while True:
        filled = 0
        for i, j in ((0, 1), (1, 2), (2, 0)):
            samples = np.moveaxis(inside, (i, j), (0, 1))  # a view: writing to it writes to `inside`
            a, b, c, d = samples[:-1, :-1], samples[1:, :-1], samples[1:, 1:], samples[:-1, 1:]
            checkered = (a == c) & (b == d) & (a != b)
            filled += np.count_nonzero(checkered)
            for corners in (a, b, c, d):
                corners[checkered] = True
        if not filled:
            return inside


def _gradient(solid: Solid, points: Array, step: float) -> Array:
    """Unit gradient of a signed distance, from four points of a tetrahedron."""
    corners = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)], dtype=float)
    gradient = sum(corner * solid(points + step * corner)[:, None] for corner in corners)
    return gradient / np.maximum(np.linalg.norm(gradient, axis=1), 1e-12)[:, None]
