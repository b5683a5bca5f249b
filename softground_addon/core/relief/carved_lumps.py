"""Lumps in the loose matter that bodies carve, of all sizes by the law of crumbs.

They depend on the place alone, so that none moves and none lies twice where several steps have carved. What they rise
by, the matter between them sinks: the loose volume stays what it is.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..ground.heightfield import HeightField
from ..numerics.arrays import Array
from ..record.footprints import Footprint, recompose
from .amounts import Amounts
from .layers import Around
from .scattered_crumbs import scattered

SEED = 977
THICK = 0.012
"""Thickness of loose matter from which on it is full of lumps, as thick as half the largest [m]."""
SHARE = 0.5
"""Their density, over that of the crumbs at the edge of a print (by eye)."""
DEEPEST = 0.5
"""The loose matter between lumps sinks by no more than this part of it."""


def lying(footprints: Sequence[Footprint]) -> HeightField | None:
    """The ground as all bodies carved it; None if they did not."""
    carves = [footprint for footprint in footprints if not len(footprint.contact_cells)]
    return recompose(carves) if carves else None


def lumps(carve: Footprint, loose: HeightField, x: Array, y: Array, amounts: Amounts, smallest: float) -> Array:
    """Change of height by lumps where a carve laid loose matter, at places (N,) [m].

    Parameters
    ----------
    loose : HeightField
        See `lying`.
    smallest : float
        Least diameter that is shown [m].
    """
    if amounts.crumbs is None or not len(x):
        return np.zeros(len(x))

    window, laid = carve.window, carve.tile(carve.rim) > 0

    def thickness(x: Array, y: Array) -> Array:
        column, row = (np.floor(place / carve.cell_size).astype(np.intp) for place in (x, y))
        lies = window.holds(row, column) & laid[window.cells_under(x, y, carve.cell_size)]
        thick = np.zeros(len(x))
        thick[lies] = np.maximum(loose.sample(x[lies], y[lies])[1], 0.0)
        return thick

    low, high = window.corners(carve.cell_size)
    sizes = scattered(
        amounts.surface, SEED, low, high, lambda x, y: np.minimum(thickness(x, y) / THICK, 1.0),
        share=SHARE * amounts.crumbs.share, smallest=smallest, fineness=1.0,
    )  # fmt: skip

    def raised_at(x: Array, y: Array, thick: Array) -> Array:
        lies = thick > 0
        x, y, nothing = x[lies], y[lies], np.zeros(np.count_nonzero(lies))
        around, risen = Around(SEED, x, y, x, y, nothing, nothing, smallest, 1.0), np.zeros(len(lies))
        risen[lies] = sum((size.heights(around) for size in sizes), nothing)
        return risen

    across, up = window.centres(carve.cell_size)
    row, column = np.nonzero(laid)
    thick = thickness(across[column], up[row])
    raised = float(raised_at(across[column], up[row], thick).sum()) / max(float(thick.sum()), 1e-12)
    part, thick = min(1.0, DEEPEST / max(raised, 1e-12)), thickness(x, y)
    return part * (raised_at(x, y, thick) - raised * thick)
