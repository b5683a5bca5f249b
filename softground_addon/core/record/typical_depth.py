"""How deep the typical step is: not the hardest landing, and not a hand that brushes the ground."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .footprints import Footprint

Array = NDArray[np.float64]

BORNE = 0.9
"""Share of the whole load that the main contacts bear."""
SHOWS = 1e-4
"""Depth from which on a print shows [m]: what comes down on a print that is there may add nothing."""


def main_contacts(impulse: Array) -> NDArray[np.bool_]:
    """The contacts that bear the most, as many as together bear nine tenths of the load.

    Parameters
    ----------
    impulse : (N,) float array
        Force times time of each contact [N·s].

    Examples
    --------
    >>> main_contacts(np.array([300.0, 290.0, 5.0, 310.0, 8.0])).tolist()
    [True, True, False, True, False]
    """
    order = np.argsort(-impulse, kind="stable")
    before = np.cumsum(impulse[order]) - impulse[order]
    main = np.zeros(len(impulse), bool)
    main[order] = before < BORNE * impulse.sum()
    return main


def median_depth(depth: Array) -> float:
    """Median depth of the contacts that left a print [m], 0 if there is none."""
    shown = depth[depth > SHOWS]
    return float(np.median(shown)) if len(shown) else 0.0


def typical_of(footprints: Sequence[Footprint]) -> float:
    """Depth of the typical one of some footprints [m]."""
    depths = np.array([footprint.max_depth_m for footprint in footprints])
    impulse = np.array([float(footprint.load_n.sum()) for footprint in footprints])
    return median_depth(depths[main_contacts(impulse)]) or median_depth(depths)
