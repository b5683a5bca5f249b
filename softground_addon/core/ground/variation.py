"""Variation of the ground from place to place: factors on stiffness, layer depth and rim, as painted on its surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from ..numerics.arrays import Array
from .sparse_grid import SampledGrid, Window
from .terrain import MeshTerrain

CHANNELS = ("stiffness", "depth", "rim")
"""What may vary, in the order of `Variation.factors`."""
SOFTEST = 0.01
"""Smallest factor on the stiffness: 0 would be no ground at all."""


class Variation(Protocol):
    """Factors on what the material says."""

    def factors(self, x: Array, y: Array) -> Array:
        """Factors at world positions [m], (3, ...) in the order of `CHANNELS`; 1 is as the material says."""
        ...


@dataclass(frozen=True)
class PaintedSurface:
    """Factors as painted on the vertices of a mesh, interpolated over its triangles.

    Attributes
    ----------
    surface : MeshTerrain
        With the factors as its first values, in the order of `CHANNELS`.
    """

    surface: MeshTerrain

    def factors(self, x: Array, y: Array) -> Array:
        """Factors at world positions [m], (3, ...); NaN off the surface."""
        return self.surface.interpolated(x, y)[: len(CHANNELS)]


class Factors(NamedTuple):
    """Factors in the cells of a window, each (rows, columns)."""

    stiffness: Array
    depth: Array
    rim: Array

    def softness(self, exponent: float) -> Array:
        """Compression per that of the material under the same stress, which grows with a power of the strain."""
        return self.depth / (self.stiffness if exponent == 1.0 else self.stiffness ** (1.0 / exponent))


def layer_factors(factors: Factors | None) -> dict[str, Array]:
    """Factors on the loose layer as keywords of `deformation.target_compression`; none where the ground is even."""
    return {"stiffness": factors.stiffness, "depth": factors.depth} if factors else {}


class VariationTiles:
    """Factors at cell centres, looked up once per tile and kept within what is possible.

    Parameters
    ----------
    cell_size : float
        Side of a cell [m].
    """

    def __init__(self, variation: Variation, cell_size: float) -> None:
        self._variation = variation
        self._grid = SampledGrid(self._sample, cell_size, channels=len(CHANNELS))

    def factors(self, window: Window) -> Factors:
        """Factors in the cells of a window."""
        return Factors(*self._grid.read(window))

    def _sample(self, x: Array, y: Array) -> Array:
        stiffness, depth, rim = np.nan_to_num(self._variation.factors(x, y), nan=1.0)
        return np.stack([np.maximum(stiffness, SOFTEST), np.maximum(depth, 0.0), np.maximum(rim, 0.0)])
