"""Loose ground slides down where it is steeper than its angle of repose, and none of it is lost.

The erosion step of Sumner, O'Brien and Hodgins, "Animating Sand, Mud, and Snow" (1999), with pairs of cells taken in
turn: each pair that is too steep moves half of the excess from the higher to the lower cell. No cell takes part in two
pairs at once, so that nothing overshoots and the volume is kept to rounding.
"""

from __future__ import annotations

from functools import cache
from math import ceil, sqrt, tan

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SWEEPS_PER_STEP = 4
"""Sweeps over the ground around a sole that presses; what still slides goes on in the next step."""
SWEEPS_TO_REST = 400
"""Most sweeps over a print that was left: deep ones in fine cells take some hundred."""
AT_REST = 0.01
"""A slope is at rest when it is too steep by no more than this part of the angle's tangent."""


Pair = tuple[tuple[slice, slice], tuple[slice, slice], float]
"""Slices of the one and the other cells of many pairs, and how many cells apart they are."""


@cache
def _pairs(row: int, column: int) -> tuple[Pair, ...]:
    """Pairs of neighbours in eight disjoint sets, the same in the plane wherever a window starts: in a row or column
    that is even (0) or odd (1)."""
    whole, ahead, behind = slice(None), slice(1, None), slice(None, -1)
    pairs: list[Pair] = []
    for number in (0, 1):
        (row_one, row_other), (column_one, column_other) = (
            (slice(first, -1, 2), slice(first + 1, None, 2)) for first in (number ^ row, number ^ column)
        )
        pairs += [((whole, column_one), (whole, column_other), 1.0), ((row_one, whole), (row_other, whole), 1.0)]
        pairs += [
            ((row_one, behind), (row_other, ahead), sqrt(2.0)),
            ((row_one, ahead), (row_other, behind), sqrt(2.0)),
        ]
    return tuple(pairs)


def slide_reach(rim: Array, compression: Array, angle: float, cell_size: float) -> int:
    """Number of cells around a disturbed window that what slides may spread over."""
    relief = rim - compression
    return ceil(float(np.ptp(relief)) / (tan(angle) * cell_size)) + 1 if relief.size else 1


def slid(
    rim: Array,
    compression: Array,
    terrain: Array,
    *,
    angle: float,
    cell_size: float,
    fixed: Mask,
    corner: tuple[int, int] = (0, 0),
    sweeps: int = SWEEPS_TO_REST,
) -> Array:
    """The rim after what is steeper than the angle of repose has slid down.

    The undisturbed terrain holds as steep as it is.

    Parameters
    ----------
    rim, compression : (rows, columns) float arrays
        Of the ground [m]. The rim of ground that slid away is negative.
    terrain : (rows, columns) float array
        Height of the undisturbed ground [m].
    angle : float
        Angle of repose [rad].
    cell_size : float
        Side of a cell [m].
    fixed : (rows, columns) bool array
        Cells that nothing leaves or enters: under a sole, off the ground.
    corner : tuple of int
        Row and column of the first cell in the plane, so that the same cells pair up whatever the window.
    sweeps : int
        Most sweeps; fewer where the ground comes to rest earlier.

    Returns
    -------
    (rows, columns) float array of the same sum, the same bits where nothing slides.
    """
    slid = rim.copy()
    ground = np.where(fixed, 0.0, terrain)
    base = ground - compression
    steepest = tan(angle) * cell_size
    pairs = []
    for one, other, distance in _pairs(corner[0] % 2, corner[1] % 2):
        rest = np.maximum(np.abs(ground[one] - ground[other]), steepest * distance)
        rest[fixed[one] | fixed[other]] = np.inf
        pairs.append((one, other, base[one] - base[other], rest))
    for _ in range(sweeps):
        most = 0.0
        for one, other, drop, rest in pairs:
            difference = slid[one] - slid[other]
            difference += drop
            excess = np.abs(difference)
            excess -= rest
            largest = np.maximum.reduce(excess, axis=None, initial=0.0)  # max() takes twice as long to call
            if largest <= AT_REST * steepest:
                continue
            most = max(most, largest)
            np.maximum(excess, 0.0, out=excess)
            excess *= 0.5
            move = np.copysign(excess, difference)
            slid[one] -= move
            slid[other] += move
        if not most:
            break
    return slid
