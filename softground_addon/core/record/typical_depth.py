"""Depth of the typical step: not of the hardest landing, and not of a hand that brushes the ground."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array
from .footprints import Footprint

BORNE = 0.9
"""Share of the whole load that the main contacts bear."""
SHOWS = 1e-4
"""Depth from which on a print shows [m]: a step into an earlier print may add nothing."""


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
    """Median depth of the contacts that made a print [m], 0 if there is none."""
    shown = depth[depth > SHOWS]
    return float(np.median(shown)) if len(shown) else 0.0


def typical_contacts(depth: Array, impulse: Array) -> NDArray[np.bool_]:
    """The main contacts that left a print; where none of them did, all that left one."""
    shown = depth > SHOWS
    main = main_contacts(impulse) & shown
    return main if main.any() else shown


def typical_of(footprints: Sequence[Footprint]) -> float:
    """Depth of the typical step among some footprints [m]; without a foot among them, of the typical one of bodies."""
    steps = [footprint for footprint in footprints if not _is_of_body(footprint)] or footprints
    depths = np.array([footprint.max_depth_m for footprint in steps])
    impulse = np.array([float(footprint.load_n.sum()) for footprint in steps])
    return median_depth(depths[typical_contacts(depths, impulse)])


def _is_of_body(footprint: Footprint) -> bool:
    """True if a ball, a hand or a head made it."""
    return footprint.pressed_by is not None and footprint.pressed_by.pressing.sole.prop is not None
