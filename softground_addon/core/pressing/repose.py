"""Loose ground slides down where it is steeper than its angle of repose, and none of it is lost.

The erosion step of Sumner, O'Brien and Hodgins, "Animating Sand, Mud, and Snow" (1999), with pairs of cells taken in
turn: each pair that is too steep moves half of the excess from the higher to the lower cell. No cell takes part in two
pairs at once, so that nothing overshoots and the volume is kept to rounding. Only the box around what is too steep is
swept: most of the ground around a sole lies still.
"""

from __future__ import annotations

from math import ceil, hypot, tan

import numpy as np

from ..numerics.arrays import Array, Mask

Cells = tuple[slice, slice]

STEPS_PER_SLIDE, SWEEPS_PER_SLIDE = 4, 4
"""The ground around a sole that presses slides after every so many steps, in so many sweeps; the rest goes on next."""
SWEEPS_TO_REST = 400
"""Most sweeps over a print that was left: deep ones in fine cells take some hundred."""
SWEEPS_AT_ONCE = 8
"""Sweeps before it is looked again where the ground is too steep."""
SPREAD = 4
"""Cells around what is too steep that slide along with it in so many sweeps."""
AT_REST = 0.01
"""A slope is at rest when it is too steep by no more than this part of the angle's tangent."""

_ALL, _FIRST, _LAST = slice(None), slice(None, -1), slice(1, None)
NEIGHBOURS: tuple[tuple[Cells, Cells, tuple[int, int]], ...] = (
    ((_ALL, _FIRST), (_ALL, _LAST), (0, 1)),
    ((_FIRST, _ALL), (_LAST, _ALL), (1, 0)),
    ((_FIRST, _FIRST), (_LAST, _LAST), (1, 1)),
    ((_FIRST, _LAST), (_LAST, _FIRST), (1, -1)),
)
"""The one and the other cells of all pairs of neighbours along x, y and both diagonals, and the way between them."""


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
    walls: tuple[Array, float] | None = None,
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
    walls : ((rows, columns) float array, float), optional
        Heights of what stands below loose matter, and the height up to which its walls hold, however steep [m].
    corner : tuple of int
        Row and column of the first cell in the plane, so that the same cells pair up whatever the window.
    sweeps : int
        Most sweeps; fewer where the ground comes to rest earlier.

    Returns
    -------
    (rows, columns) float array of the same sum, the same bits where nothing slides.
    """
    ground = np.where(fixed, 0.0, terrain)
    steepest = tan(angle) * cell_size
    rests = np.full((len(NEIGHBOURS), *rim.shape), np.inf)
    for rest, (near, other, way) in zip(rests, NEIGHBOURS, strict=True):
        rest[near] = np.maximum(np.abs(ground[near] - ground[other]), steepest * hypot(*way))
        if walls is not None:
            rest[near] = np.maximum(rest[near], np.minimum(np.abs(walls[0][near] - walls[0][other]), walls[1]))
        rest[near][fixed[near] | fixed[other]] = np.inf
    before = ground - compression + rim
    height, box = before.copy(), (slice(0, len(rim)), slice(0, rim.shape[1]))
    for first in range(0, sweeps, SWEEPS_AT_ONCE):
        steep = _around_steep(height, rests, box, AT_REST * steepest)
        if steep is None:
            break
        box = steep
        odd_row, odd_column = ((start + cells.start) % 2 for start, cells in zip(corner, box, strict=True))
        height[box] = _swept(height[box], rests[:, *box], odd_row, odd_column, min(SWEEPS_AT_ONCE, sweeps - first))
    return rim + (height - before)


def _around_steep(height: Array, rests: Array, box: Cells, bound: float) -> Cells | None:
    """The cells that what is too steep in or at a box may slide over in some sweeps; None where all is at rest."""
    box = _grown(box, height.shape, 1)
    part = height[box]
    steep = np.zeros(part.shape, bool)
    for rest, (near, other, _) in zip(rests[:, *box], NEIGHBOURS, strict=True):
        excess = np.abs(part[near] - part[other])
        excess -= rest[near]
        above = excess > bound
        steep[near] |= above
        steep[other] |= above
    rows, columns = np.divmod(np.flatnonzero(steep), steep.shape[1])
    if not len(rows):
        return None
    around_rows, around_columns = (
        slice(cells.start + int(of.min()), cells.start + int(of.max()) + 1)
        for cells, of in zip(box, (rows, columns), strict=True)
    )
    return _grown((around_rows, around_columns), height.shape, SPREAD)


def _grown(box: Cells, shape: tuple[int, ...], by: int) -> Cells:
    """A box with so many more cells on every side, as far as there are any."""
    rows, columns = (
        slice(max(0, cells.start - by), min(size, cells.stop + by)) for cells, size in zip(box, shape, strict=True)
    )
    return rows, columns


def _swept(height: Array, rests: Array, odd_row: int, odd_column: int, sweeps: int) -> Array:
    """Heights of a box, (rows, columns), after some sweeps; its first row and column in the plane may be odd.

    Rows that are even in the plane are laid out before those that are odd. Neighbours are then as far apart in memory
    all over the box, and each set of pairs is two stretches of it.
    """
    rows, columns = height.shape
    inside = slice(odd_row, odd_row + rows), slice(0, columns)
    of_cells = np.zeros((-(-inside[0].stop // 2) * 2, -(-columns // 2) * 2))
    of_cells[inside] = height
    of_pairs = np.full((len(NEIGHBOURS), *of_cells.shape), np.inf)
    for pairs, rest, (near, _, _) in zip(of_pairs[:, *inside], rests, NEIGHBOURS, strict=True):
        pairs[near] = rest[near]
    cells, most = _even_first(of_cells), _even_first(of_pairs)
    width, count = of_cells.shape[1], of_cells.size // 2
    turns = []
    for number in (0, 1):
        along = (number + odd_column) % 2
        ones, others = slice(along, 2 * count - 1, 2), slice(along + 1, None, 2)
        turns.append((cells[ones], cells[others], most[0, ones]))
        even, odd = cells[:count], cells[count:]
        for rest, (_, _, (_, right)) in zip(most[1:], NEIGHBOURS[1:], strict=True):
            ahead = number * width + right
            ones, others = slice(max(0, -ahead), count - max(0, ahead)), slice(max(0, ahead), count + min(0, ahead))
            pair = (odd[ones], even[others]) if number else (even[ones], odd[others])
            turns.append((*pair, rest[count * number : count * (number + 1)][ones]))
    sets = [(*turn, -turn[-1], *np.empty((2, len(turn[-1])))) for turn in turns]
    for _ in range(sweeps):
        for near, other, rest, opposite, move, held in sets:
            np.subtract(near, other, out=move)
            np.minimum(move, rest, out=held)
            np.maximum(held, opposite, out=held)
            np.subtract(move, held, out=move)
            np.multiply(move, 0.5, out=move)
            np.subtract(near, move, out=near)
            np.add(other, move, out=other)
    together = np.empty_like(of_cells)
    together[0::2], together[1::2] = cells.reshape(2, -1, width)
    return together[inside]


def _even_first(values: Array) -> Array:
    """Values (..., rows, columns), those of even rows first, (..., cells)."""
    *more, rows, columns = values.shape
    return np.moveaxis(values.reshape(*more, rows // 2, 2, columns), -2, -3).reshape(*more, -1)
