"""A contact across borders of the ground: each cell takes its share of what each kind of ground alone would do.

The law of no kind is asked about what is none of its own: a cell in the middle of a region is pressed as if the whole
ground were like it, and between two regions the compression goes over from the one's to the other's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..ground.variation import Factors
from ..numerics.arrays import Array
from .ground_cells import Imprints

INCOMPRESSIBLE = 0.5
"""Poisson's ratio of ground all of which rises that is compressed; in each cell a factor takes off what does not."""
HALF = 0.5
"""Share of a cell from which on its crust holds."""


def in_shares(values: Sequence[NDArray[np.floating]], shares: Array) -> Array:
    """Sum of the values of each kind, (N,) or (N, rows, columns), times their shares (K, rows, columns)."""
    total = np.zeros(1)
    for value, share in zip(values, shares, strict=True):
        total = total + share * (value if value.ndim > 1 else value[:, None, None])
    return total


def across(of_kinds: Sequence[Imprints], shares: Array) -> tuple[Imprints, int]:
    """Compression of cells where each kind of ground has a share in them.

    Parameters
    ----------
    of_kinds : sequence of K Imprints
        The same steps over the same window, as if all of the ground were of each kind.
    shares : (K, rows, columns) float array
        From `Regions.under`.

    Returns
    -------
    imprints : Imprints
        With the contact, the rim and the loads of the kind that bears most.
    most : int
        Which that is: it has most of the area of contact.
    """
    areas = [float((share * each.coverage).sum()) for each, share in zip(of_kinds, shares, strict=True)]
    laid = of_kinds[most := int(np.argmax(areas))]
    raised = sum(share * 2.0 * each.material.poisson_ratio for each, share in zip(of_kinds, shares, strict=True))
    even = laid.factors or Factors(*np.ones((3, *shares.shape[1:])))
    held = [np.zeros(1) if each.holds is None else each.holds.astype(float) for each in of_kinds]
    imprints = replace(
        laid,
        coverage=in_shares([each.coverage for each in of_kinds], shares).astype(np.float32),
        pressing=np.any([each.pressing for each in of_kinds], axis=0),
        target=in_shares([each.target for each in of_kinds], shares),
        rate=in_shares([each.rate for each in of_kinds], shares),
        holds=in_shares(held, shares) > HALF if any(each.holds is not None for each in of_kinds) else None,
        factors=Factors(even.stiffness, even.depth, np.asarray(even.rim * raised)),
        material=replace(laid.material, poisson_ratio=INCOMPRESSIBLE),
    )
    return imprints, most
