"""The undisturbed ground as a function of place: a plane, or the upper side of a triangle mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..numerics.arrays import Array, Indices
from ..numerics.slices import Slices, sliced
from ..numerics.triangles import barycentric, enumerated
from .heightfield import FlatTerrain

UPWARD = 0.05
"""Smallest z of a face's unit normal that still counts as ground; steeper faces are walls."""

CROWDED = 10
"""Triangles per bin from which smaller bins are worth their table: those of a grid have 8 each. Where the mesh's faces
are slivers, as at the pole of a sphere, or are fine along a trail and coarse beyond, each has hundreds."""
LARGEST_TABLE = 1 << 21
"""Triangles in all bins, each as often as it is in one, up to which the bins are made smaller."""

PLACES_AT_ONCE = 1 << 14
"""Places that are looked up together; what it takes for a moment follows this, and not how many there are."""

SLACK = 1e-8
"""By which a triangle's box is wider than it, over its size: more than that of `triangles.barycentric`."""

SAME_LAYER = 1e-3
"""Surfaces over one place that are closer than this are one [m]."""


@sliced
def plane_of(vertices: Array, triangles: Indices) -> Slices[FlatTerrain | None]:
    """The plane of a mesh that is a level rectangle along the axes without a hole; None of any other,
    and where a vertex is not finite.

    Every edge that is not on its sides has as many triangles to its right as to its left: so as many of them cover one
    place as any other, and they do not turn over.

    Parameters
    ----------
    vertices : (V, 3) float array
        World positions [m].
    triangles : (T, 3) int array
        Corners of each triangle.
    """
    if not len(triangles) or not np.isfinite(vertices).all() or np.ptp(vertices[:, 2]) > 0:
        return None
    place = np.ascontiguousarray(vertices[:, :2].T)
    low, high = place.min(axis=1), place.max(axis=1)
    ends = (at == end for at, *both in zip(place, low, high, strict=True) for end in both)
    sides = np.packbits([*ends], axis=0)[0]
    first, second = np.random.default_rng(0).integers(2**63, size=(2, len(vertices)), dtype=np.uint64)
    sum_of_edges = np.zeros(1, dtype=np.uint64)  # each adds what it takes off the other way round
    for number in range(0, len(triangles), PLACES_AT_ONCE):
        yield
        begin = triangles[number : number + PLACES_AT_ONCE].T
        end = begin[[1, 2, 0]]
        along_x, along_y = (axis.take(end) - axis.take(begin) for axis in place)
        if not (along_x[0] * along_y[1] > along_y[0] * along_x[1]).all():
            return None
        inner = (sides.take(begin) & sides.take(end)) == 0
        begin, end = begin[inner], end[inner]
        sum_of_edges += (first.take(begin) * second.take(end) - first.take(end) * second.take(begin)).sum()
    if sum_of_edges.any():
        return None
    return FlatTerrain(float(vertices[0, 2]), tuple(low.tolist()), tuple(high.tolist()))


@dataclass(frozen=True)
class MeshTerrain:
    """The upper side of a triangle mesh, looked up by place.

    Triangles are binned over the plane once; a look-up tests the few that share the point's bin. Where several
    upward-facing surfaces lie over one place, the highest counts.

    Attributes
    ----------
    corners : (T, 3, 3) float array
        World positions of the upward-facing triangles' corners [m].
    origin, bin_size : (2,) float arrays
        Lower corner and size of the bins [m].
    shape : (2,) int array
        Number of bins along x and y.
    first : (bins + 1,) int array
        Where each bin's triangles start in `members`.
    members : (M,) int array
        Triangles by bin.
    box : (4, T) float array
        Least and greatest x, and y, of each triangle, with some slack: most of a bin's are told apart by it.
    values : (T, 3, C) float array
        What is said of the triangles' corners, if anything.
    """

    corners: Array
    origin: Array
    bin_size: Array
    shape: Indices
    first: Indices
    members: Indices
    box: Array
    values: Array

    @staticmethod
    @sliced
    def from_mesh(
        vertices: Array,
        triangles: Indices,
        bounds: Array | None = None,
        values: Array | None = None,
        *,
        of_faces: Array | None = None,
        name: str = "The ground",
    ) -> Slices[MeshTerrain]:
        """Bin the triangles of a mesh.

        Parameters
        ----------
        vertices : (V, 3) float array
            World positions [m], Z up.
        triangles : (T, 3) int array
            Corners of each triangle, counter-clockwise from outside. Where none faces upward, as on a plane whose
            normals are flipped, they are taken from their other side.
        bounds : (2, 2) float array, optional
            Lower and upper corner of the region of interest in the plane [m]; triangles outside it are dropped.
        values : (V, C) float array, optional
            What is said of the vertices, to be interpolated between them.
        of_faces : (T,) array, optional
            What is said of the triangles, as the last of the values.
        name : str
            For messages.

        Raises
        ------
        InputError
            If within the bounds there is none, or nothing but walls.
        """
        if bounds is not None and len(triangles):
            place = vertices[:, :2]
            sides = (place < bounds[0]) @ (1, 2) + (place > bounds[1]) @ (4, 8)  # one bit for each that it is beyond
            a, b, c = sides[triangles].T
            inside = a & b & c == 0
            triangles, of_faces = triangles[inside], None if of_faces is None else of_faces[inside]
            yield
        corners = vertices[triangles].astype(np.float64, copy=False)
        yield
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(normal, axis=1)
        steep = UPWARD * np.maximum(length, 1e-300)
        upward = normal[:, 2] > steep
        if not upward.any():
            upward = normal[:, 2] < -steep
            corners, triangles = corners[:, ::-1], triangles[:, ::-1]
        yield
        if not upward.all():
            corners, triangles = corners[upward], triangles[upward]
        if not len(corners):
            raise InputError(f"{name} has no face under the path to stand on: move it under the feet.", "no_ground")
        bins = yield from _bins(corners[..., :2])
        of_corners = np.zeros((len(corners), 3, 0)) if values is None else np.asarray(values, float)[triangles]
        if of_faces is not None:
            repeated = np.broadcast_to(np.asarray(of_faces, float)[upward, None, None], (len(corners), 3, 1))
            of_corners = np.concatenate([of_corners, repeated], axis=2)
        return MeshTerrain(corners, *bins, of_corners)

    def heights(self, x: Array, y: Array, limit: Array | None = None) -> Array:
        """Height of the highest upward-facing surface at each place [m], or of those up to a limit; NaN without any."""
        across, along = np.ravel(x), np.ravel(y)
        highest = np.full(np.size(x), -np.inf)
        for first in range(0, len(highest), PLACES_AT_ONCE):
            part = slice(first, first + PLACES_AT_ONCE)
            hits = self._surfaces(across[part], along[part])
            point, z = hits.point, hits.z
            if limit is not None:
                below = z <= np.ravel(limit)[part][point]
                point, z = point[below], z[below]
            np.maximum.at(highest[part], point, z)
        return np.where(np.isinf(highest), np.nan, highest).reshape(np.shape(x))

    @staticmethod
    @sliced
    def joined(terrains: Sequence[MeshTerrain]) -> Slices[MeshTerrain]:
        """One of the triangles of several, without their values."""
        corners = np.concatenate([terrain.corners for terrain in terrains])
        bins = yield from _bins(corners[..., :2])
        return MeshTerrain(corners, *bins, np.zeros((len(corners), 3, 0)))

    def interpolated(self, x: Array, y: Array) -> Array:
        """The values of the highest upward-facing surface at each place, (C, ...); NaN where there is none."""
        across, along = np.ravel(x), np.ravel(y)
        values = np.full((np.size(x), self.values.shape[2]), np.nan)
        for first in range(0, len(values), PLACES_AT_ONCE):
            part = slice(first, first + PLACES_AT_ONCE)
            hits = self._surfaces(across[part], along[part])
            order = np.argsort(hits.z, kind="stable")  # the highest is written last
            a, b, c = np.moveaxis(self.values[hits.triangle[order]], 1, 0)
            u, v = hits.u[order, None], hits.v[order, None]
            values[part][hits.point[order]] = a + u * (b - a) + v * (c - a)
        return values.T.reshape(-1, *np.shape(x))

    def within(self, low: Array, high: Array) -> Indices:
        """The triangles whose bounding boxes meet that from low to high in the plane, (2,) each [m]."""
        from_bin, to_bin = (
            np.clip(np.floor((corner - self.origin) / self.bin_size), 0, self.shape - 1).astype(np.intp)
            for corner in (low, high)
        )
        rows = np.arange(from_bin[1], to_bin[1] + 1) * self.shape[0]
        pair, within = enumerated(self.first[rows + to_bin[0] + 1] - self.first[rows + from_bin[0]])
        near: Indices = self.members[self.first[rows + from_bin[0]][pair] + within]
        place = self.corners[near, :, :2]
        return near[((place.min(axis=1) <= high) & (place.max(axis=1) >= low)).all(axis=1)]

    def is_height_field(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """True if no second upward-facing surface lies below the highest one, for each place."""
        across, along = np.ravel(x), np.ravel(y)
        top = self.heights(across, along)
        single = np.ones(np.size(x), dtype=bool)
        for first in range(0, len(single), PLACES_AT_ONCE):
            part = slice(first, first + PLACES_AT_ONCE)
            hits = self._surfaces(across[part], along[part])
            single[part][hits.point[hits.z < top[part][hits.point] - SAME_LAYER]] = False
        return single.reshape(np.shape(x))

    def _surfaces(self, x: Array, y: Array) -> _Hits:
        """Every pair of a point and a triangle that lies over or under it."""
        place = np.stack([x, y], axis=-1)
        at_bin = np.floor((place - self.origin) / self.bin_size)
        inside = np.flatnonzero(((at_bin >= 0) & (at_bin < self.shape)).all(axis=1))
        at_bin = at_bin[inside].astype(np.intp)
        bin_index = at_bin[:, 1] * self.shape[0] + at_bin[:, 0]
        start, stop = self.first[bin_index], self.first[bin_index + 1]
        pair, within = enumerated(stop - start)
        triangle = self.members[start[pair] + within]
        point = inside[pair]
        for low, high, of_point in zip(self.box[::2], self.box[1::2], (x, y), strict=True):
            at = of_point.take(point)
            near = np.flatnonzero((at >= low.take(triangle)) & (at <= high.take(triangle)))
            triangle, point = triangle.take(near), point.take(near)
        corners = self.corners[triangle]
        u, v, hit = barycentric(corners[..., :2], place[point])
        a, b, c = corners[..., 2].T
        return _Hits(point[hit], triangle[hit], u[hit], v[hit], (a + u * (b - a) + v * (c - a))[hit])


def _bins(corners: Array) -> Slices[tuple[Array, Array, Indices, Indices, Indices, Array]]:
    """Bins over the triangles (T, 3, 2): origin, size, shape, first, members and box, as in `MeshTerrain`."""
    a, b, c = np.moveaxis(corners, 1, 0)
    low, high = (least(least(a, b), c) for least in (np.minimum, np.maximum))
    origin = low.min(axis=0)
    extent = high.max(axis=0) - origin
    size = np.maximum(
        np.sqrt(2.0 * extent.prod() / len(corners)), (high - low).mean(axis=0)
    )  # square over a long trail
    size = np.maximum(np.minimum(size, extent), 1e-9)
    while True:
        yield
        shape = np.floor(extent / size).astype(np.intp) + 1
        from_bin = np.floor((low - origin) / size).astype(np.intp)
        span = np.floor((high - origin) / size).astype(np.intp) - from_bin + 1
        members = span.prod(axis=1).sum()
        middle = np.floor(((low + high) / 2 - origin) / size).astype(np.intp)
        near = np.bincount(middle[:, 1] * shape[0] + middle[:, 0])
        crowd = max(members / shape.prod(), near @ near / len(corners))  # on average, and where the triangles are
        if crowd <= CROWDED or members > LARGEST_TABLE / 4:  # half the size: up to four times
            break
        size = size / 2
    triangle, within = enumerated(span.prod(axis=1))
    yield
    up, right = np.divmod(within, span[:, 0].take(triangle))
    bin_index = (from_bin[:, 1] * shape[0] + from_bin[:, 0]).take(triangle) + up * shape[0] + right
    yield
    order = np.argsort(bin_index, kind="stable")
    yield
    first = np.searchsorted(bin_index[order], np.arange(shape.prod() + 1))
    slack = SLACK * (high - low)
    box = np.empty((4, len(corners)))
    box[::2], box[1::2] = (low - slack).T, (high + slack).T
    return origin, size, shape, first, triangle[order], box


class _Hits(NamedTuple):
    """Points and the triangles over or under them: place on the triangle a + u·(b - a) + v·(c - a), and its height."""

    point: Indices
    triangle: Indices
    u: Array
    v: Array
    z: Array
