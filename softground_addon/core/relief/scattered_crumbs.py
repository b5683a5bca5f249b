"""Crumbs that lie about a print: of the sizes and shapes that its ground throws, too, half sunk into it.

Each square of a lattice holds one or none; each size has a lattice of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ground import surfaces
from ..meshing import crumbs
from ..numerics.arrays import Array
from .lattice_noise import hashed, uniform
from .layers import Around

SUNK = 0.7
"""Largest depth of a crumb's middle below the ground, over its radius."""


@dataclass(frozen=True)
class ScatteredCrumbs:
    """The crumbs of one size about a print, from one to twice it, in layers upon each other.

    Attributes
    ----------
    side : float
        Of a square of the lattice [m].
    corner : (int, int)
        Column and row of the first square.
    crowns : Crowns
        Their shapes from above.
    x, y, radius : (layers, rows, columns) float arrays
        Of the crumb in each square [m]; the radius is 0 where there is none.
    sunk : (layers, rows, columns) float array
        Depth of its middle below the ground, over its radius.
    turn : (layers, rows, columns) float array
        About the vertical [rad].
    shape : (layers, rows, columns) int array
        Number among the crowns.
    """

    side: float
    corner: tuple[int, int]
    crowns: crumbs.Crowns
    x: Array
    y: Array
    radius: Array
    sunk: Array
    turn: Array
    shape: NDArray[np.intp]

    def heights(self, around: Around) -> Array:
        """Heights [m]."""
        layers, rows, columns = self.radius.shape
        first = [
            np.floor(place / self.side - 0.5).astype(np.intp) - corner
            for place, corner in zip((around.x, around.y), self.corner, strict=True)
        ]
        highest = np.zeros((layers, len(around.x)))
        for right, up in ((0, 0), (1, 0), (0, 1), (1, 1)):
            column, row = np.clip(first[0] + right, 0, columns - 1), np.clip(first[1] + up, 0, rows - 1)
            dx, dy = around.x - self.x[:, row, column], around.y - self.y[:, row, column]
            reach = self.crowns.reach * self.radius[:, row, column]
            near = np.nonzero(dx * dx + dy * dy < reach * reach)
            crumb, dx, dy = (near[0], row[near[1]], column[near[1]]), dx[near], dy[near]
            radius, cos, sin = self.radius[crumb], np.cos(self.turn[crumb]), np.sin(self.turn[crumb])
            top = self.crowns.at(self.shape[crumb], (cos * dx + sin * dy) / radius, (cos * dy - sin * dx) / radius)
            highest[near] = np.maximum(highest[near], radius * (top - self.sunk[crumb]))
        return np.asarray(highest.sum(axis=0))


def scattered(
    surface: str,
    seed: int,
    low: Array,
    high: Array,
    chance: Callable[[Array, Array], Array],
    *,
    share: float,
    smallest: float,
    fineness: float,
) -> list[ScatteredCrumbs]:
    """The crumbs of a surface in a rectangle, size by size.

    Parameters
    ----------
    seed : int
        The print's own.
    low, high : (2,) float arrays
        Corners of the rectangle [m].
    chance : callable
        Density of crumbs at places x, y (N,) [m], from 0 to 1.
    share : float
        Of the largest, for each square of their lattice, where it is 1.
    smallest : float
        Least diameter that is shown [m].
    fineness : float
        See `PrintShape`.
    """
    crowns, largest = crumbs.crowns(surface), surfaces.find(surface).fragments.largest
    return [
        _of_size(crowns, seed + 10 * number, size, (low, high), share * full, chance)
        for number, (size, full) in enumerate(crumbs.octaves(largest * fineness, smallest))
    ]


def _of_size(
    crowns: crumbs.Crowns,
    seed: int,
    size: float,
    corners: tuple[Array, Array],
    share: float,
    chance: Callable[[Array, Array], Array],
) -> ScatteredCrumbs:
    layers = max(1, int(np.ceil(share)))  # of what is fuller than full
    side = size * crowns.reach  # so that a crumb reaches no further than half a square
    first, last = (np.floor(place / side).astype(np.int64) for place in corners)
    column, row = np.meshgrid(*(np.arange(a - 1, b + 2) for a, b in zip(first, last, strict=True)))
    value = np.stack([hashed(seed + layer, column, row) for layer in range(layers)])
    luck = [uniform(kind, value) for kind in range(5)]
    x = (column + (value & np.uint32(0xFFFF)) * 2.0**-16) * side
    y = (row + (value >> np.uint32(16)) * 2.0**-16) * side
    radius = np.zeros(value.shape)
    drawn = luck[0] < share / layers  # however dense they lie here
    drawn[drawn] = luck[0][drawn] < share / layers * chance(x[drawn], y[drawn])
    radius[drawn] = crumbs.diameters((size / 2.0, size), luck[1][drawn]) / 2.0
    shape = (luck[4] * len(crowns.heights)).astype(np.intp)
    corner = (int(column[0, 0]), int(row[0, 0]))
    return ScatteredCrumbs(side, corner, crowns, x, y, radius, SUNK * luck[2], 2 * np.pi * luck[3], shape)
