"""Crumbs of grounds, at the edge of a print and in the air alike: one law of sizes, one set of shapes.

References
----------
Turcotte 1986, "Fractals and fragmentation", J. Geophys. Res. 91, doi:10.1029/JB091iB02p01921: that the number of
fragments falls as a power of their size.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..ground import surfaces
from ..numerics.arrays import Array

SIZE_FALL = 2.5
"""Exponent with which the number of crumbs falls over their diameter, n(d) ~ d^-2.5: by eye."""

_NEAREST_CUT, _FARTHEST_CUT = 0.6, 0.9
"""Of the flat sides, from the middle of a lump of radius 1."""
_TEXELS = 21
"""Along a side of a `Crowns` map."""


def diameters(sizes: tuple[float, float], part: Array) -> Array:
    """Diameters below which a part of the crumbs between two sizes is, (N,) [m].

    Parameters
    ----------
    sizes : (float, float)
        Smallest and largest [m].
    part : (N,) float array
        From 0 to 1.

    Examples
    --------
    >>> diameters((0.001, 0.004), np.array([0.0, 0.5, 1.0])).round(5)
    array([0.001  , 0.00147, 0.004  ])
    """
    power = 1.0 - SIZE_FALL
    low, high = sizes[0] ** power, sizes[1] ** power
    return np.asarray((low + part * (high - low)) ** (1.0 / power))


def mean_cube(sizes: tuple[float, float]) -> float:
    """Mean of d³ over the crumbs between two sizes [m³].

    Examples
    --------
    >>> part = (np.arange(10**5) + 0.5) / 10**5
    >>> round(mean_cube((1.0, 3.0)) / float(np.mean(diameters((1.0, 3.0), part) ** 3)), 4)
    1.0
    """
    power, (low, high) = 1.0 - SIZE_FALL, sizes
    share = power / (power + 3.0)
    return float(share * (high ** (power + 3.0) - low ** (power + 3.0)) / (high**power - low**power))


def octaves(largest: float, smallest: float) -> Iterator[tuple[float, float]]:
    """Ranges of diameters on lattices, and how full each is, from the largest on, down to a smallest diameter [m].

    The squares of a lattice grow with its crumbs: filled alike, there would be d^-2 of them in a range, and d^-1.5 have
    to be. So the part of the squares that hold one goes as d^(a - 1 - 2) from the coarsest lattice to the next: as the
    square root of its size, if it falls with `SIZE_FALL`.

    Examples
    --------
    >>> [(size, round(float(full), 3)) for size, full in octaves(0.024, 0.0025)]
    [(0.024, 1.0), (0.012, 0.707), (0.006, 0.5)]
    """
    size = largest
    while size / 2.0 >= smallest:
        yield size, (size / largest) ** (3.0 - SIZE_FALL)
        size /= 2.0


@dataclass(frozen=True)
class Lump:
    """A closed surface that has the volume of a sphere of radius 1.

    Attributes
    ----------
    vertices : (V, 3) float array
    faces : (F, 3) int array
        Counter-clockwise from outside.
    """

    vertices: Array
    faces: NDArray[np.intp]


@cache
def lumps(surface: str) -> tuple[Lump, ...]:
    """The shapes that the crumbs of a surface have."""
    like = surfaces.find(surface).fragments
    return tuple(_lump(like, number, stretch) for number, stretch in enumerate(like.stretch))


def _lump(like: surfaces.Fragments, number: int, stretch: tuple[float, float, float]) -> Lump:
    random = np.random.default_rng(number)
    way, faces = _sphere()
    waves = random.normal(size=(6, 3)) * 3.5
    radius = 1.0 + like.roughness * np.sin(way @ waves.T + 2 * np.pi * random.random(len(waves))).sum(axis=1) / 2
    cuts = random.normal(size=(like.cuts, 3))
    cuts /= np.linalg.norm(cuts, axis=1, keepdims=True)
    for cut, far in zip(cuts, random.uniform(_NEAREST_CUT, _FARTHEST_CUT, len(cuts)), strict=True):
        radius = np.minimum(radius, far / np.maximum(way @ cut, 1e-3))
    vertices = way * radius[:, None] * stretch
    volume = np.linalg.det(vertices[faces]).sum() / 6.0
    return Lump(vertices * (4 / 3 * np.pi / volume) ** (1 / 3), faces)


def _sphere() -> tuple[Array, NDArray[np.intp]]:
    """Points on a sphere, nearly as far from each other, and the triangles between them: an icosahedron, refined."""
    golden = (1.0 + np.sqrt(5.0)) / 2.0
    corners = [(0.0, side, other) for side in (-1.0, 1.0) for other in (-golden, golden)]
    points = np.array([np.roll(corner, axis) for axis in range(3) for corner in corners])
    apart = np.linalg.norm(points[:, None] - points, axis=-1)
    near = np.abs(apart - 2.0) < 1e-6
    faces = np.array([
        (i, j, k) for i in range(12) for j in range(i) for k in range(j) if near[i, j] and near[j, k] and near[i, k]
    ])  # fmt: skip
    inward = np.linalg.det(points[faces]) < 0
    faces[inward] = faces[inward][:, ::-1]
    for _ in range(2):
        sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1), axis=-1)
        edges, of_face = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
        (a, b, c), (ab, bc, ca) = faces.T, len(points) + of_face.reshape(-1, 3).T
        points = np.concatenate([points, points[edges].mean(axis=1)])
        points /= np.linalg.norm(points, axis=1, keepdims=True)
        faces = np.concatenate(
            [np.stack(three, axis=-1) for three in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))]
        )
    return points / np.linalg.norm(points, axis=1, keepdims=True), faces


@dataclass(frozen=True)
class Crowns:
    """The upper sides of a surface's lumps, as height fields can show them.

    Attributes
    ----------
    reach : float
        How far they reach from their middle, over their radius.
    heights : (shapes, texels, texels) float array
        Of the upper side over the middle, over the radius, in squares of half a side `reach`; -1 beside it.
    """

    reach: float
    heights: Array

    def at(self, shape: NDArray[np.intp], x: Array, y: Array) -> Array:
        """Heights of shapes at places from their middles, (N,) each, over the radius; linear between texels."""
        texels = self.heights.shape[1]
        column, row = (
            np.clip((place / self.reach + 1.0) / 2.0 * (texels - 1), 0.0, texels - 1.001) for place in (x, y)
        )
        left, low = column.astype(np.intp), row.astype(np.intp)
        u, v = column - left, row - low
        corner, flat = (shape * texels + low) * texels + left, self.heights.ravel()
        below = flat[corner] * (1.0 - u) + flat[corner + 1] * u
        above = flat[corner + texels] * (1.0 - u) + flat[corner + texels + 1] * u
        return np.asarray(below * (1.0 - v) + above * v)


@cache
def crowns(surface: str) -> Crowns:
    """The upper sides of the shapes of a surface's crumbs, as they lie."""
    shapes = lumps(surface)
    reach = float(max(np.linalg.norm(lump.vertices[:, :2], axis=1).max() for lump in shapes))
    x, y = (place.ravel() for place in np.meshgrid(*[np.linspace(-reach, reach, _TEXELS)] * 2))
    heights = np.stack([_upper_side(lump, x, y) for lump in shapes])
    return Crowns(reach, heights.reshape(len(shapes), _TEXELS, _TEXELS))


def _upper_side(lump: Lump, x: Array, y: Array) -> Array:
    """Highest point of a lump over places (N,), -1 beside it."""
    a, b, c = np.moveaxis(lump.vertices[lump.faces], 0, -1)[..., None]  # (3 axes, faces, 1) each
    along, across = b - a, c - a
    double = along[0] * across[1] - along[1] * across[0]
    a, along, across, double = (each[..., double[:, 0] > 1e-12, :] for each in (a, along, across, double))  # from above
    u = ((x - a[0]) * across[1] - (y - a[1]) * across[0]) / double
    v = (along[0] * (y - a[1]) - along[1] * (x - a[0])) / double
    inside = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9)
    height = a[2] + u * along[2] + v * across[2]
    return np.asarray(np.max(height, axis=0, initial=-1.0, where=inside))
