"""Contacts across the borders of regions.

Each kind of ground presses the whole contact as if there were no other; every cell then takes the mean of these
results, weighted by the share of each kind in it (`Regions.under`). Inside a region that is its own kind alone, and
over the width of a border the compression passes from one kind to the other.
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
"""Poisson's ratio with which all compressed volume rises; `Factors.rim` then reduces it in each cell."""
HALF = 0.5
"""Share of kinds with a holding crust from which on the crust of a cell holds."""


def in_shares(values: Sequence[NDArray[np.floating]], shares: Array) -> Array:
    """Mean of the values of K kinds, (N,) or (N, rows, columns) each, weighted by shares (K, rows, columns)."""
    total = np.zeros(1)
    for value, share in zip(values, shares, strict=True):
        total = total + share * (value if value.ndim > 1 else value[:, None, None])
    return total


def across(of_kinds: Sequence[Imprints], shares: Array) -> tuple[Imprints, int]:
    """Imprints of one contact in ground of several kinds.

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
        Number of that kind: the one with the largest part of the area of contact.
    """
    areas = [float((share * each.coverage).sum()) for each, share in zip(of_kinds, shares, strict=True)]
    main = of_kinds[most := int(np.argmax(areas))]
    rising_share = sum(share * 2.0 * each.material.poisson_ratio for each, share in zip(of_kinds, shares, strict=True))
    factors = main.factors or Factors(*np.ones((3, *shares.shape[1:])))
    held = [np.zeros(1) if each.holds is None else each.holds.astype(float) for each in of_kinds]
    imprints = replace(
        main,
        coverage=in_shares([each.coverage for each in of_kinds], shares).astype(np.float32),
        pressing=np.any([each.pressing for each in of_kinds], axis=0),
        target=in_shares([each.target for each in of_kinds], shares),
        rate=in_shares([each.rate for each in of_kinds], shares),
        holds=in_shares(held, shares) > HALF if any(each.holds is not None for each in of_kinds) else None,
        factors=Factors(factors.stiffness, factors.depth, np.asarray(factors.rim * rising_share)),
        material=replace(main.material, poisson_ratio=INCOMPRESSIBLE),
    )
    return imprints, most
