"""The record of a bake: an ordered list of footprints, from which the ground at any frame is put together again.

Changes of the ground are recorded as whole multiples of `QUANTUM`. Whole numbers add up exactly, so that footprints
may be put together in any order, overlapping or not, and give the simulation's ground to the rounding of one quantum.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..ground.heightfield import HeightField
from ..ground.sparse_grid import SparseGrid, Window
from ..numerics.arrays import Array
from ..numerics.packed import Packed
from .contact_steps import ContactSteps

Indices = NDArray[np.int32]

QUANTUM = 2.0**-30
"""Unit of the recorded changes [m]: 1 nm, so that volumes are kept to 1e-6 and heights beyond 32-bit floats."""
LARGEST_AMOUNT = 2**31 - 1
"""Largest change that is stored as one [QUANTUM]: 2 m."""
PARTS_OF_A_FRAME = 2**16
"""Fractions of a frame are whole multiples of one over this, so that changes under way add up exactly too."""
NEVER = -1.0
"""Age of ground that was never touched [s]."""


@dataclass(frozen=True)
class Changes:
    """Changes of one quantity of a footprint's cells over time.

    Attributes
    ----------
    frames : (K,) float array
        Scene frame at which each change is complete, ascending; it grows over the frame before.
    first : (K + 1,) int array
        Where each change starts in the following two.
    cells : (M,) int array
        Cell within the window, row·columns + column.
    amounts : (M,) int array
        Change of height [QUANTUM].
    """

    frames: Array
    first: Indices
    cells: Packed[np.int32] = Packed()
    amounts: Packed[np.int32] = Packed()

    @cached_property
    def total(self) -> Array:
        """Sum of the changes of each cell, up to the last cell that changes [QUANTUM]."""
        return np.bincount(self.cells, self.amounts).astype(np.float64)


@dataclass(frozen=True)
class Footprint:
    """Effect of one contact of a sole on the ground.

    Attributes
    ----------
    character, sole : str
        Names of its character and of the sole.
    start_frame, end_frame : float
        First and last scene frame of the contact.
    position : (3,) float array
        Middle of the pressure over the contact, on the undisturbed ground [m].
    heading : float
        Direction of the toes, counter-clockwise from world x [rad].
    area_m2 : float
        Largest area of contact [m²].
    peak_force_n : float
        Largest normal force [N].
    compressed_m3, rim_m3 : float
        Volumes that it compressed and raised [m³].
    unplaced_rim_m3 : float
        Displaced volume that found no ground around the contact to rise on [m³].
    load_frames, load_n : (K,) float arrays
        Scene frames of the contact and normal force at each [N].
    cell_size : float
        Side of a cell [m].
    frame_step : float
        Scene frames between recorded frames.
    window : Window
        The cells that its changes refer to.
    compression, rim : Changes
        Changes of compression and rim.
    contact_cells : (C,) int array
        Cells that it touched, row·columns + column.
    contact_start, contact_end : (C,) float arrays
        First and last scene frame at which it touched each of them.
    pressed_by : ContactSteps or None
        Movement of the sole, to press it again elsewhere; None of a print that was itself edited.
    surface : str
        What bears most of it (see `ground.surfaces`), where the ground has regions; else empty.
    """

    character: str
    sole: str
    start_frame: float
    end_frame: float
    position: Array
    heading: float
    area_m2: float
    peak_force_n: float
    compressed_m3: float
    rim_m3: float
    unplaced_rim_m3: float
    load_frames: Array
    load_n: Array
    cell_size: float
    frame_step: float
    window: Window
    compression: Changes
    rim: Changes
    contact_cells: Packed[np.int32] = Packed()
    contact_start: Packed[np.float64] = Packed()
    contact_end: Packed[np.float64] = Packed()
    pressed_by: ContactSteps | None = None
    surface: str = ""

    def tile(self, changes: Changes, frame: float = np.inf) -> Array:
        """Sum of the compression or rim changes up to a frame, (rows, columns) of its window [m]."""
        # The change that is under way counts for the fraction of its frame that has passed.
        whole = int(np.searchsorted(changes.frames, frame, side="right"))
        under_way = int(np.searchsorted(changes.frames - self.frame_step, frame, side="left"))
        total = np.zeros(self.window.cells)
        if whole == len(changes.frames):
            total[: len(changes.total)] = changes.total
        else:
            cells, amounts, end = changes.cells, changes.amounts, changes.first[whole]
            total += np.bincount(cells[:end], amounts[:end], len(total))
        for k in range(whole, under_way):
            passed = 1.0 - (changes.frames[k] - frame) / self.frame_step
            passed = round(passed * PARTS_OF_A_FRAME) / PARTS_OF_A_FRAME
            part = slice(changes.first[k], changes.first[k + 1])
            total += np.bincount(cells[part], weights=amounts[part] * passed, minlength=len(total))
        return (total * QUANTUM).reshape(self.window.rows, self.window.columns)

    def middle(self, frames: Array) -> int:
        """The sample, of those at some scene frames (F,), that is nearest to the middle of the contact."""
        return int(np.abs(frames - (self.start_frame + self.end_frame) / 2).argmin())

    @property
    def load_spacing(self) -> float:
        """Scene frames from one of `load_frames` to the next."""
        frames = self.load_frames
        return float(frames[-1] - frames[0]) / (len(frames) - 1) if len(frames) > 1 else self.frame_step

    @property
    def pressing(self) -> Changes:
        """Compression by the contact itself, without that by weather before it."""
        changes = self.compression
        began = self.contact_start[:].min(initial=np.inf) - 0.5 * self.frame_step
        count = int(np.searchsorted(changes.frames, began)) if len(self.contact_start) else 0
        if not count:
            return changes
        begin = int(changes.first[count])
        first = changes.first[count:] - changes.first[count]
        return Changes(changes.frames[count:], first, changes.cells[begin:], changes.amounts[begin:])

    @cached_property
    def max_depth_m(self) -> float:
        """Largest compression of a cell by this contact [m], on top of earlier ones."""
        return float(self.tile(self.pressing).max(initial=0.0))


def quantised(heights: Array) -> NDArray[np.int64]:
    """Heights as whole multiples of `QUANTUM`."""
    return np.rint(heights * (1.0 / QUANTUM)).astype(np.int64)


class FootprintRecorder:
    """Collects the effect of one contact, frame by frame.

    Parameters
    ----------
    cell_size : float
        Side of a cell [m].
    frame_step : float
        Scene frames between recorded frames.
    """

    def __init__(self, cell_size: float, frame_step: float) -> None:
        self.cell_size = cell_size
        self.frame_step = frame_step
        self._frames: list[float] = []
        self._windows: list[Window] = []
        self._changes: tuple[list[Any], list[Any]] = ([], [])
        self._contacts: list[NDArray[np.intp]] = []

    @property
    def frames(self) -> Sequence[float]:
        """Scene frames of all changes so far."""
        return self._frames

    @property
    def window(self) -> Window:
        """The cells of all changes so far."""
        union = self._windows[0]
        for window in self._windows[1:]:
            union = union.union(window)
        return union

    def add(self, frame: float, window: Window, change: NDArray[np.int64], touched: NDArray[np.bool_]) -> None:
        """Add the change of a window that was complete at a frame.

        Parameters
        ----------
        frame : float
            Scene frame, not before that of the last call.
        change : (2, rows, columns) int array
            Change of compression and rim [QUANTUM]; the rim of ground that slides down falls.
        touched : (rows, columns) bool array
            Cells that were in contact.
        """
        self._frames.append(frame)
        self._windows.append(window)
        self._contacts.append(np.flatnonzero(touched))
        largest = max(int(change.max(initial=0)), -int(change.min(initial=0)))
        storable = change if largest <= LARGEST_AMOUNT else np.clip(change, -LARGEST_AMOUNT, LARGEST_AMOUNT)
        for channel, values in zip(self._changes, storable.reshape(2, -1), strict=True):
            cells = np.flatnonzero(values)
            channel.append((cells, values[cells].astype(np.int32)))
        if storable is not change:
            self.add(frame, window, change - storable, touched)

    def footprint(self, **other_fields: Any) -> Footprint:
        """The footprint so far.

        Parameters
        ----------
        **other_fields
            All other fields of `Footprint`: names, times, place and load.
        """
        union = self.window
        frames = np.array(self._frames)
        touched, counts = self._gather(self._contacts, union)
        when = np.repeat(frames, counts)
        cells, first_touch = np.unique(touched, return_index=True)
        last_touch = len(touched) - 1 - np.unique(touched[::-1], return_index=True)[1]
        compression, rim = (self._combined(channel, frames, union) for channel in self._changes)
        return Footprint(
            cell_size=self.cell_size,
            frame_step=self.frame_step,
            window=union,
            compression=compression,
            rim=rim,
            contact_cells=cells,
            contact_start=when[first_touch],
            contact_end=when[last_touch],
            **other_fields,
        )

    def _combined(self, channel: list[Any], frames: Array, union: Window) -> Changes:
        cells, counts = self._gather([cells for cells, _ in channel], union)
        amounts = np.concatenate([amounts for _, amounts in channel])
        changed = counts > 0
        first = np.concatenate([[0], np.cumsum(counts[changed])]).astype(np.int32)
        return Changes(frames[changed], first, cells, amounts)

    def _gather(self, cells_of_windows: list[NDArray[np.intp]], union: Window) -> tuple[Indices, NDArray[np.intp]]:
        """Cells of the single windows as cells of their union, one after the other, and how many of each."""
        gathered = [np.empty(0, np.int32)]
        for cells, window in zip(cells_of_windows, self._windows, strict=True):
            row, column = np.divmod(cells, window.columns)
            row += window.row - union.row
            column += window.column - union.column
            gathered.append((row * union.columns + column).astype(np.int32))
        return np.concatenate(gathered), np.array([len(cells) for cells in cells_of_windows], np.intp)


def extent(footprints: Iterable[Footprint]) -> tuple[Array, Array]:
    """Lower and upper corner of the box around at least one footprint, (2,) each [m]."""
    lows, highs = zip(*(each.window.corners(each.cell_size) for each in footprints), strict=True)
    return np.min(lows, axis=0), np.max(highs, axis=0)


def recompose(footprints: Iterable[Footprint], frame: float = np.inf, *, cell_size: float | None = None) -> HeightField:
    """The ground at any frame, from the record and without simulating.

    Parameters
    ----------
    footprints : iterable of Footprint
        In any order; the result does not depend on it, bit for bit.
    frame : float
        Scene frame; between frames the changes grow linearly. By default, after the last.
    cell_size : float, optional
        Side of a cell [m], needed only where there may be no footprint.

    Returns
    -------
    HeightField

    Raises
    ------
    InputError
        If the footprints are of different cell sizes, or there are none and no cell size is given.
    """
    footprints = list(footprints)
    sizes = {footprint.cell_size for footprint in footprints} | ({cell_size} if cell_size else set())
    if len(sizes) != 1:
        raise InputError(
            f"The footprints are recorded at cell sizes of {sorted(sizes) or 'no'} m and cannot share one ground: "
            "bake them again at one cell size.",
            "cell_sizes_differ",
            cell_sizes=sorted(sizes),
        )
    ground = HeightField(sizes.pop())
    for footprint in footprints:
        if footprint.start_frame - footprint.frame_step <= frame:
            change = np.stack([footprint.tile(changes, frame) for changes in (footprint.compression, footprint.rim)])
            ground.write(footprint.window, ground.read(footprint.window) + change)
    return ground


def last_contact(footprints: Iterable[Footprint], frame: float, cell_size: float) -> SparseGrid:
    """The scene frame at which each cell was last in contact, up to a frame; -inf where it never was.

    Parameters
    ----------
    frame : float
        Scene frame.
    cell_size : float
        Side of a cell [m].
    """
    latest = SparseGrid(cell_size, channels=1, fill=-np.inf)
    for footprint in footprints:
        if footprint.start_frame <= frame:
            touched = footprint.contact_start <= frame
            values = latest.read(footprint.window)
            flat = values.reshape(-1)
            cells = footprint.contact_cells[touched]
            flat[cells] = np.maximum(flat[cells], np.minimum(footprint.contact_end[touched], frame))
            latest.write(footprint.window, values)
    return latest
