"""A footprint's changes in blocks of cells that unpack alone: fine cells take as many looks as there are blocks."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ..ground.sparse_grid import Window
from ..numerics.arrays import Array, Mask
from ..numerics.packed import PackedArray
from ..record.footprints import QUANTUM, Footprint

BLOCK = 64
"""Cells along the sides of a block: most footprints fit into one."""


class ChangesInBlocks:
    """Changes of a footprint's compression and rim, sorted into blocks of its window at the first use.

    Parameters
    ----------
    is_small : bool
        As of `PackedArray`.
    """

    def __init__(self, footprint: Footprint, *, is_small: bool = False) -> None:
        self.footprint, self._is_small = footprint, is_small

    @cached_property
    def changed(self) -> Mask:
        """See `changed_by`."""
        return changed_by(self.footprint)

    @cached_property
    def _blocks(self) -> list[list[PackedArray[np.int32]]]:
        """Changes by row and column of blocks: number of the frame, cell and amount of each."""
        window, both = self.footprint.window, (self.footprint.compression, self.footprint.rim)
        cell = np.concatenate([changes.cells for changes in both])
        row, column = np.divmod(cell, window.columns)
        across, down = _blocks_along(window.columns), _blocks_along(window.rows)
        block = row // BLOCK * across + column // BLOCK
        order = np.argsort(block, kind="stable")
        ends = np.cumsum(np.bincount(block, minlength=down * across))[:-1]
        counts = np.concatenate([np.diff(changes.first) for changes in both])
        number = np.repeat(np.arange(len(counts), dtype=np.int32), counts)
        amount = np.concatenate([changes.amounts for changes in both])
        parts = zip(*(np.split(values[order], ends) for values in (number, cell, amount)), strict=True)
        packed = [PackedArray(np.stack(part), is_small=self._is_small) for part in parts]
        return [packed[first : first + across] for first in range(0, len(packed), across)]

    def within(self, window: Window) -> tuple[Array, Array]:
        """Changes of compression and rim within a window, (T, 2, rows, columns) [m], at frames (T,).

        They are those at which anything changes there, each with the frame before it, and the first.
        """
        whole, step = self.footprint.window, self.footprint.frame_step
        first_row, first_column = window.row - whole.row, window.column - whole.column
        near = [np.zeros((3, 0), dtype=np.int32)]
        for blocks in self._blocks[_reached(first_row, window.rows)]:
            near += [block.unpacked() for block in blocks[_reached(first_column, window.columns)]]
        number, cell, amount = np.concatenate(near, axis=1)
        row, column = np.divmod(cell, whole.columns)
        row, column = row - first_row, column - first_column
        within = (row >= 0) & (row < window.rows) & (column >= 0) & (column < window.columns)
        number = number[within]
        if not len(number):
            return np.zeros(0), np.zeros((0, 2, window.rows, window.columns))
        compression, rim = self.footprint.compression.frames, self.footprint.rim.frames
        frame = np.concatenate([compression, rim])
        start = frame[number].min()
        after = np.rint((frame - start) / step).astype(np.intp)[number]
        changes = np.unique(after)
        needed = np.unique(np.concatenate([changes, np.maximum(changes - 1, 0)]))
        after, count = np.searchsorted(needed, after), len(needed)
        where = (2 * after + (number >= len(compression))) * window.cells
        where += row[within] * window.columns + column[within]
        sums = np.bincount(where, weights=amount[within] * QUANTUM, minlength=count * 2 * window.cells)
        heights = np.asarray(sums, dtype=np.float64).reshape(count, 2, window.rows, window.columns)
        return start + needed * step, heights


def _blocks_along(cells: int) -> int:
    return -(-cells // BLOCK)


def _reached(first: int, cells: int) -> slice:
    """Numbers of the blocks along a side that hold cells; the first cell may be negative."""
    return slice(max(first, 0) // BLOCK, max(_blocks_along(first + cells), 0))


def changed_by(footprint: Footprint) -> Mask:
    """The cells that a print changed or touched, (rows, columns) of its window."""
    window = footprint.window
    changed = np.zeros(window.cells, bool)
    for cells in (footprint.contact_cells, footprint.compression.cells, footprint.rim.cells):
        changed[cells[:]] = True
    return changed.reshape(window.rows, window.columns)
