"""Looking up the maps of a sole's patch, heights and distances to the outline, between their nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..motion.motion import SolePatch

Array = NDArray[np.float64]
Single = NDArray[np.float32]
"""What is said of many cells at many steps: fractions and heights near the ground, where 32 bits are plenty."""


@dataclass(frozen=True)
class Nodes:
    """Where places lie between the nodes of a patch's maps."""

    index: NDArray[np.intp]
    u: Single
    v: Single
    columns: int
    beyond: Single
    """How far outside the maps [m]."""

    @classmethod
    def under(cls, patch: SolePatch, x: Single, y: Single) -> Nodes:
        rows, columns = patch.heights.shape
        u = (x - np.float32(patch.origin[0])) * np.float32(1 / patch.spacing)
        v = (y - np.float32(patch.origin[1])) * np.float32(1 / patch.spacing)
        inside_u = np.minimum(np.maximum(u, np.float32(0)), np.float32(columns - 1))
        inside_v = np.minimum(np.maximum(v, np.float32(0)), np.float32(rows - 1))
        u -= inside_u
        v -= inside_v
        beyond = (np.abs(u, out=u) + np.abs(v, out=v)) * np.float32(patch.spacing)
        column = np.minimum(inside_u.astype(np.int32), columns - 2)
        row = np.minimum(inside_v.astype(np.int32), rows - 2)
        inside_u -= column.astype(np.float32)
        inside_v -= row.astype(np.float32)
        row *= columns
        row += column
        return cls(row.astype(np.intp), inside_u, inside_v, columns, beyond)

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


def covered_fraction(distance: Any, size: float) -> Any:
    """Fraction of a cell of this size that lies inside an outline at a signed distance from its centre."""
    return np.minimum(np.maximum(0.5 - distance * (1.0 / size), 0.0), 1.0)
