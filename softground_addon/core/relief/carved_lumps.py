"""Lumps in the loose matter that bodies carve, of all sizes by the law of crumbs.

They depend on the place alone, so that none moves and none lies twice where several steps have carved. What they rise
by, the matter between them sinks: the loose volume stays what it is.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..ground.heightfield import HeightField
from ..numerics.arrays import Array, Mask
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

    def thickness(x: Array, y: Array) -> Array:
        return np.asarray(np.maximum(loose.sample(x, y)[1], 0.0) * _laid_by(carve, x, y))

    low, high = carve.window.corners(carve.cell_size)
    sizes = scattered(
        amounts.surface, SEED, low, high, lambda x, y: np.minimum(thickness(x, y) / THICK, 1.0),
        share=SHARE * amounts.crumbs.share, smallest=smallest, fineness=1.0,
    )  # fmt: skip

    def heights(x: Array, y: Array) -> Array:
        nothing = np.zeros(len(x))
        around = Around(SEED, x, y, x, y, nothing, nothing, smallest, 1.0)
        return np.asarray(sum((size.heights(around) for size in sizes), nothing) * (thickness(x, y) > 0))

    of_cells = [place.ravel() for place in np.meshgrid(*carve.window.centres(carve.cell_size))]
    raised = float(heights(*of_cells).sum()) / max(float(thickness(*of_cells).sum()), 1e-12)
    part = min(1.0, DEEPEST / max(raised, 1e-12))
    return part * (heights(x, y) - raised * thickness(x, y))


def _laid_by(carve: Footprint, x: Array, y: Array) -> Mask:
    """True at places (N,) where a carve laid loose matter."""
    laid = carve.tile(carve.rim) > 0
    column, row = (np.floor(place / carve.cell_size).astype(np.intp) for place in (x, y))
    holds = carve.window.holds(row, column)
    return (
        holds
        & laid[
            np.clip(row - carve.window.row, 0, carve.window.rows - 1),
            np.clip(column - carve.window.column, 0, carve.window.columns - 1),
        ]
    )
