"""Crumbs that lie about a print: of the sizes and shapes that its ground throws, too, half sunk into it.

Each square of a lattice holds one or none; each size has a lattice of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ground import crumbs, surfaces
from .lattice_noise import hashed, uniform
from .layers import Around

Array = NDArray[np.float64]

SUNK = 0.7
"""Largest depth of a crumb's middle below the ground, over its radius."""


@dataclass(frozen=True)
class ScatteredCrumbs:
    """The crumbs of one size about a print, from one to twice it.

    Attributes
    ----------
    side : float
        Of a square of the lattice [m].
    corner : (int, int)
        Column and row of the first square.
    crowns : Crowns
        Their shapes from above.
    x, y, radius : (rows, columns) float arrays
        Of the crumb in each square [m]; the radius is 0 where there is none.
    sunk : (rows, columns) float array
        Depth of its middle below the ground, over its radius.
    turn : (rows, columns) float array
        About the vertical [rad].
    shape : (rows, columns) int array
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
        rows, columns = self.radius.shape
        first = [
            np.floor(place / self.side - 0.5).astype(np.intp) - corner
            for place, corner in zip((around.x, around.y), self.corner, strict=True)
        ]
        highest = np.zeros(len(around.x))
        for right, up in ((0, 0), (1, 0), (0, 1), (1, 1)):
            column, row = first[0] + right, first[1] + up
            square = np.clip(row, 0, rows - 1) * columns + np.clip(column, 0, columns - 1)
            radius = self.radius.ravel()[square]
            dx, dy = around.x - self.x.ravel()[square], around.y - self.y.ravel()[square]
            near = np.flatnonzero(dx * dx + dy * dy < (self.crowns.reach * radius) ** 2)
            square, radius, dx, dy = square[near], radius[near], dx[near], dy[near]
            cos, sin = np.cos(self.turn.ravel()[square]), np.sin(self.turn.ravel()[square])
            top = self.crowns.at(
                self.shape.ravel()[square], (cos * dx + sin * dy) / radius, (cos * dy - sin * dx) / radius
            )
            highest[near] = np.maximum(highest[near], radius * (top - self.sunk.ravel()[square]))
        return highest


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
    """The crumbs of a surface in a rectangle.

    Parameters
    ----------
    surface : str
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
    crowns, largest, layered = crumbs.crowns(surface), surfaces.find(surface).fragments.largest, []
    for number, (size, full) in enumerate(crumbs.octaves(largest * fineness, smallest)):
        layers = max(1, int(np.ceil(share * full)))  # of what is fuller than full
        for layer in range(layers):
            layered.append(_layer(crowns, seed + 10 * number + layer, size, (low, high), share * full / layers, chance))
    return layered


def _layer(
    crowns: crumbs.Crowns,
    seed: int,
    size: float,
    corners: tuple[Array, Array],
    full: float,
    chance: Callable[[Array, Array], Array],
) -> ScatteredCrumbs:
    side = size * crowns.reach  # so that a crumb reaches no further than half a square
    first, last = (np.floor(place / side).astype(np.int64) for place in corners)
    column, row = np.meshgrid(*(np.arange(a - 1, b + 2) for a, b in zip(first, last, strict=True)))
    value = hashed(seed, column, row)
    luck = [uniform(kind, value.astype(np.int64)) for kind in range(5)]
    x = (column + (value & np.uint32(0xFFFF)) * 2.0**-16) * side
    y = (row + (value >> np.uint32(16)) * 2.0**-16) * side
    present = luck[0] < full * chance(x.ravel(), y.ravel()).reshape(x.shape)
    radius = np.where(present, crumbs.diameters((size / 2.0, size), luck[1]) / 2.0, 0.0)
    shape = (luck[4] * len(crowns.heights)).astype(np.intp)
    corner = (int(column[0, 0]), int(row[0, 0]))
    return ScatteredCrumbs(side, corner, crowns, x, y, radius, SUNK * luck[2], 2 * np.pi * luck[3], shape)
