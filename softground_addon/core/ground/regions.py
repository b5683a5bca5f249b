"""Regions of a ground that are made of something else than the rest: snow beside sand, mud between grass."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .material import GroundMaterial
from .sparse_grid import SampledGrid, Window
from .terrain import MeshTerrain

Array = NDArray[np.float64]

MOST = 16
"""Kinds of ground that one ground may have."""
BORDER = 1
"""Cells on each side of a border over which one kind goes over into the other."""
NOWHERE = -1.0
"""Number of the kind beside the ground, and where it is hard."""


@dataclass(frozen=True)
class GroundKind:
    """What a region is made of.

    Attributes
    ----------
    surface : str
        See `surfaces`.
    material : GroundMaterial
    """

    surface: str
    material: GroundMaterial


@dataclass(frozen=True)
class Regions:
    """Where a ground is of which kind.

    Attributes
    ----------
    kinds : tuple of GroundKind
        First what the ground is made of where nothing else is said.
    where : MeshTerrain
        Its surface, with the number of the kind as the last of its values.
    """

    kinds: tuple[GroundKind, ...]
    where: MeshTerrain

    def numbers(self, x: Array, y: Array) -> Array:
        """Numbers of the kinds at world positions of any shape [m], `NOWHERE` beside the ground."""
        return np.nan_to_num(self.where.interpolated(x, y)[-1], nan=NOWHERE)

    def near(self, low: Array, high: Array) -> list[int]:
        """Numbers of the kinds, ascending, of which there is some near the box from low to high, (2,) each [m]."""
        return np.unique(self.where.values[self.where.within(low, high), 0, -1]).astype(int).tolist()


def numbered(
    own: GroundKind, of_slots: Mapping[int, GroundKind | None]
) -> tuple[tuple[GroundKind, ...], dict[int, float]]:
    """Each kind of ground once, and its number for each slot that names one; `NOWHERE` of those that are hard.

    Parameters
    ----------
    own : GroundKind
        What the ground is made of where no slot says otherwise: the first kind.
    of_slots : mapping of int to GroundKind or None
        None of what is hard.
    """
    kinds = list(dict.fromkeys([own, *(kind for kind in of_slots.values() if kind)]))
    return tuple(kinds), {slot: float(kinds.index(kind)) if kind else NOWHERE for slot, kind in of_slots.items()}


class RegionTiles:
    """Kinds of ground at cell centres, looked up once per tile.

    Parameters
    ----------
    regions : Regions
    cell_size : float
        Side of a cell [m].
    """

    def __init__(self, regions: Regions, cell_size: float) -> None:
        self._regions = regions
        self._grid = SampledGrid(lambda x, y: regions.numbers(x, y)[None], cell_size, channels=1)

    def kinds(self, window: Window) -> list[int]:
        """Numbers of the kinds that have a share in a window, ascending; the first where there is no ground."""
        around = window.expanded(BORDER)
        near = self._regions.near(*around.corners(self._grid.cell_size))
        if len(near) > 1:
            near = [int(number) for number in np.unique(self._grid.read(around)) if number != NOWHERE]
        return near or [0]

    def shares(self, window: Window, kinds: Sequence[int]) -> Array:
        """Share that each of some kinds has in the cells of a window, (K, rows, columns), 1 in sum.

        It falls evenly from 1 to 0 across a border.
        """
        numbers = self._grid.read(window.expanded(BORDER))[0]
        shares = _mean_around(numbers == np.array(kinds, float)[:, None, None])
        total = shares.sum(axis=0)
        return np.divide(shares, total, out=np.full(shares.shape, 1.0 / len(kinds)), where=total > 0)


def _mean_around(values: NDArray[np.bool_]) -> Array:
    """Sum of values (K, rows + 2·BORDER, columns + 2·BORDER) over the cells around each of (K, rows, columns)."""
    width = 2 * BORDER + 1
    whole = np.pad(np.cumsum(np.cumsum(values, axis=1, dtype=np.float64), axis=2), ((0, 0), (1, 0), (1, 0)))
    rows = whole[:, width:] - whole[:, :-width]
    return np.asarray(rows[..., width:] - rows[..., :-width])
