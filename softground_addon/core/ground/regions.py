"""Regions of a ground that are made of something else than the rest: snow beside sand, mud between grass."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array
from .material import GroundMaterial
from .sparse_grid import Window
from .terrain import MeshTerrain

MOST = 16
"""Kinds of ground that one ground may have."""
BORDER = 1
"""Cells on each side of a border over which one kind goes over into the other."""
HARD = -1.0
"""Number where the ground is hard, and of no kind."""


@dataclass(frozen=True)
class GroundKind:
    """Surface and material of a region.

    Attributes
    ----------
    surface : str
        See `surfaces`.
    """

    surface: str
    material: GroundMaterial


@dataclass(frozen=True)
class Regions:
    """Map of the kinds of a ground.

    Attributes
    ----------
    kinds : tuple of GroundKind
        First what the ground is made of where nothing else is said.
    where : MeshTerrain
        Its surface, with the number of the kind as the last of its values.
    """

    kinds: tuple[GroundKind, ...]
    where: MeshTerrain

    def under(self, within: Window, window: Window, cell_size: float) -> tuple[list[int], Array | None]:
        """Kinds of ground under a part of a window of cells, and the share of each in the cells of the window.

        A share falls evenly from 1 to 0 across a border.

        Returns
        -------
        kinds : list of K int
            Ascending; the first of all where there is no ground.
        shares : (K, rows, columns) float array or None
            1 in sum; None of a single kind.
        """
        inner, around = within.expanded(BORDER), window.expanded(BORDER)
        kinds = np.unique(self.where.values[self.where.within(*inner.corners(cell_size)), 0, -1])
        if len(kinds) > 1:
            numbers = self.where.interpolated(*np.meshgrid(*around.centres(cell_size)))[-1]
            kinds = np.unique(numbers[around.slices(inner)])
            kinds = kinds[~np.isnan(kinds)]  # beside the ground
        present = kinds.astype(int).tolist() or [0]
        if len(present) == 1:
            return present, None
        shares = _sum_around(numbers == kinds[:, None, None])
        total = shares.sum(axis=0)
        return present, np.divide(shares, total, out=np.full(shares.shape, 1.0 / len(present)), where=total > 0)


def numbered(
    ground_kind: GroundKind, of_slots: Mapping[int, GroundKind | None]
) -> tuple[tuple[GroundKind, ...], dict[int, float]]:
    """Each kind of ground once, and its number for each slot that names one; `HARD` of those that are hard.

    Parameters
    ----------
    ground_kind : GroundKind
        What the ground is made of where no slot says otherwise: the first kind.
    of_slots : mapping of int to GroundKind or None
        None of what is hard.
    """
    kinds = list(dict.fromkeys([ground_kind, *(kind for kind in of_slots.values() if kind)]))
    return tuple(kinds), {slot: float(kinds.index(kind)) if kind else HARD for slot, kind in of_slots.items()}


def _sum_around(values: NDArray[np.bool_]) -> Array:
    """Sum of values (K, rows + 2·BORDER, columns + 2·BORDER) over the cells around each of (K, rows, columns)."""
    width = 2 * BORDER + 1
    whole = np.pad(np.cumsum(np.cumsum(values, axis=1, dtype=np.float64), axis=2), ((0, 0), (1, 0), (1, 0)))
    rows = whole[:, width:] - whole[:, :-width]
    return np.asarray(rows[..., width:] - rows[..., :-width])
