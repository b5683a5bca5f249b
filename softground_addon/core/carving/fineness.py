"""How fine a mesh shows ground that bodies carve, but for close-ups: no finer than it may be off while it moves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..meshing.region import Region
from ..numerics.cell_keys import AROUND, Keys, among, cells_of, keys_of
from ..record.footprints import Footprint

SPACING, MOST_CELLS = 0.01, 2
"""Vertices of ground that only bodies carve are so far apart [m], but no further than so many cells."""
PRINT_SQUARES = 2
"""Around prints, the ground is as fine as its cells in squares of 2 to this power of them."""


def fineness(
    moved: Keys, footprints: Sequence[Footprint], cell_size: float
) -> tuple[Region, float, tuple[Region, float] | None]:
    """Where vertices are, how far apart [m], and where closer; as `meshing.refinement.refine` takes it.

    Parameters
    ----------
    moved : (M,) int array
        Cells whose displayed height changed.
    footprints : sequence of Footprint
        Prints, and what bodies carve.
    """
    spacing = float(np.clip(SPACING, cell_size, MOST_CELLS * cell_size))
    prints = [footprint for footprint in footprints if len(footprint.contact_cells)]
    if len(prints) == len(footprints) or spacing == cell_size:
        return Region(moved, cell_size), cell_size, None
    squares = np.unique(np.concatenate([AROUND[:0], *map(_squares, prints)])[:, None] + AROUND)
    near = moved[among(squares, keys_of(cells_of(moved) >> PRINT_SQUARES))]
    return Region(moved, cell_size), spacing, (Region(near, cell_size), cell_size)


def _squares(footprint: Footprint) -> Keys:
    """Squares that a print changes."""
    window, cells = footprint.window, [changes.cells[:] for changes in (footprint.compression, footprint.rim)]
    row, column = np.divmod(np.unique(np.concatenate(cells)), window.columns)
    squares = np.stack([column + window.column, row + window.row], axis=-1) >> PRINT_SQUARES
    return np.unique(keys_of(squares))
