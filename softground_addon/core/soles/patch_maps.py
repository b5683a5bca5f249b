"""Looking up the maps of a sole's patch, heights and distances to the outline, between their nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..motion.sole_motion import SolePatch
from ..numerics.arrays import Array

Single = NDArray[np.float32]
"""Values of many cells at many steps: fractions and heights near the ground, where 32 bits are plenty."""


@dataclass(frozen=True)
class Nodes:
    """Position of places between the nodes of a patch's maps."""

    index: NDArray[np.intp]
    u: Single
    v: Single
    columns: int

    @classmethod
    def under(cls, patch: SolePatch, x: Single, y: Single) -> Nodes:
        """Nodes under places in the patch's frame [m]; beyond the maps, those under the nearest place on them."""
        rows, columns = patch.heights.shape
        u, v = (
            _before_last((along - np.float32(start)) * np.float32(1 / patch.spacing), count)
            for along, start, count in zip((x, y), patch.origin, (columns, rows), strict=True)
        )
        column, index = np.floor(u), np.floor(v)
        u -= column
        v -= index
        index *= np.float32(columns)  # whole numbers up to 2^24 are exact
        index += column
        return cls(index.astype(np.intp), u, v, columns)

    def interpolate(self, values: Array) -> Single:
        flat = values.ravel().astype(np.float32)
        low = self._between(flat)
        high = self._between(flat[self.columns :])
        high -= low
        high *= self.v
        high += low
        return high

    def _between(self, flat: Single) -> Single:
        near, far = flat.take(self.index), flat[1:].take(self.index)
        far -= near
        far *= self.u
        far += near
        return far


def _before_last(along: Single, count: int) -> Single:
    """Places along a row of nodes, brought between the first and the last where they are not, in place."""
    np.maximum(along, np.float32(0), out=along)
    return np.minimum(along, np.nextafter(np.float32(count - 1), np.float32(0)), out=along)


def distance_beyond(patch: SolePatch, x: Single, y: Single) -> Single:
    """Distance of places in a patch's frame beyond its maps [m]."""
    last = patch.origin + (np.array(patch.heights.shape[::-1]) - 1) * patch.spacing
    beyond = [
        np.maximum(np.maximum(low - along, along - high), np.float32(0))
        for along, low, high in zip((x, y), patch.origin.astype(np.float32), last.astype(np.float32), strict=True)
    ]
    return beyond[0] + beyond[1]


def covered_fraction(distance: Any, size: float) -> Any:
    """Fraction of a cell of this size that lies inside an outline at a signed distance from its centre."""
    return np.minimum(np.maximum(0.5 - distance * (1.0 / size), 0.0), 1.0)
