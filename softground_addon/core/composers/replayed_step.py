"""A step as it was baked, replayed from the record, and the grid of cells and times that it lies on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..ground.sparse_grid import Window
from ..numerics.arrays import Array
from ..numerics.cell_keys import ROW, Keys
from ..pressing.contact_layout import ContactLayout
from ..pressing.ground_cells import Imprints, Timing
from ..pressing.solver import GroundSolver
from ..record.contact_steps import Steps
from ..record.footprints import QUANTUM, Changes, Footprint


@dataclass(frozen=True, eq=False)
class Layout:
    """A contact to be pressed, and what was laid out of it, which is the same whatever lies there."""

    layout: ContactLayout
    imprints: dict[tuple[int, int], Imprints] = field(default_factory=dict)


@dataclass(frozen=True)
class StepGrid:
    """The steps of a simulation, and the frames that are recorded of it.

    Attributes
    ----------
    begin : float
        Scene frame of step 0.
    """

    timing: Timing
    begin: float

    def number(self, step: int) -> int:
        """The recorded frame that a step belongs to, in a row from that of step 0."""
        return -(-step // self.timing.steps_per_frame)

    def frame(self, number: int) -> float:
        """Its scene frame."""
        return self.begin + number * self.timing.frame_step

    def steps(self, number: int) -> range:
        """The steps up to it, after the one before."""
        per_frame = self.timing.steps_per_frame
        return range((number - 1) * per_frame + 1, number * per_frame + 1)

    def shifted(self, steps: Steps, frames: int) -> Steps:
        """The steps so many scene frames later, or as near to that as the recorded frames allow."""
        by = round(frames / self.timing.frame_step)
        first = steps.first + by * self.timing.steps_per_frame
        return replace(steps, first=first, frames=steps.frames + by * self.timing.frame_step)


def grid_of(footprint: Footprint) -> StepGrid:
    baked, frames = footprint.pressed_by, footprint.load_frames
    assert baked is not None
    per_frame = max(1, round(footprint.frame_step / footprint.load_spacing))
    begin = frames[0] - baked.first * footprint.frame_step / per_frame
    whole = float(np.rint(begin))
    timing = Timing(baked.time_step, per_frame, footprint.frame_step)
    return StepGrid(timing, whole if abs(begin - whole) < 1e-3 else float(begin))


class ReplayedStep:
    """A print as it was baked, frame by frame; what is looked at of it is unpacked once."""

    def __init__(self, footprint: Footprint) -> None:
        self._footprint = footprint

    @cached_property
    def _pressing(self) -> Changes:
        return self._footprint.pressing

    @cached_property
    def _changes(self) -> list[tuple[Array, NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]]:
        both = (self._footprint.compression, self._footprint.rim)
        return [(change.frames, change.first, change.cells, change.amounts) for change in both]

    def replay(self, solver: GroundSolver, since: float, frame: float) -> None:
        """Change a ground as it did after one recorded frame, up to another."""
        window = self._footprint.window
        during = [slice(*np.searchsorted(frames, (since + 1e-6, frame + 1e-6))) for frames, *_ in self._changes]
        if any(part.start < part.stop for part in during):
            solver.state.write(window, solver.state.read(window) + self._sum(during))
        if weathered := solver.weathered:
            weathered.note(*self._known(frame))
            after, before = (self._footprint.tile(self._pressing, time + 1e-6) for time in (frame, since))
            weathered.press(window, after - before)

    def _known(self, frame: float) -> tuple[Window, Array, NDArray[np.bool_]]:
        """Frame by which each cell of its window changed last, and the cells in contact, as `WeatheredCells.note`."""
        footprint, window = self._footprint, self._footprint.window
        last, touched = np.full(window.cells, -np.inf), np.zeros(window.cells, bool)
        for frames, first, cells, _ in self._changes:
            count = int(np.searchsorted(frames, frame + 1e-6))
            np.maximum.at(last, cells[: first[count]], np.repeat(frames[:count], np.diff(first[: count + 1])))
            if count:
                touched[footprint.contact_cells[:]] = True
        cells, start, end = footprint.contact_cells[:], footprint.contact_start[:], footprint.contact_end[:]
        by_now = start <= frame + 1e-6
        last[cells[by_now]] = np.maximum(last[cells[by_now]], np.minimum(end[by_now], frame))
        shape = (window.rows, window.columns)
        return window, last.reshape(shape), touched.reshape(shape)

    def _sum(self, during: Sequence[slice]) -> Array:
        """Sum of its changes in some of its recorded frames, (2, rows, columns) [m]."""
        window = self._footprint.window
        sums = []
        for part, (_, first, cells, amounts) in zip(during, self._changes, strict=True):
            within = slice(first[part.start], first[part.stop])
            sums.append(np.bincount(cells[within], amounts[within], window.cells))
        return np.asarray(np.stack(sums).reshape(2, window.rows, window.columns) * QUANTUM)


def keys_of_cells(window: Window, cells: NDArray[np.integer]) -> Keys:
    """Keys of cells of a window, ascending."""
    row, column = np.divmod(cells.astype(np.int64), window.columns)
    keys: Keys = (row + window.row) * ROW + column + window.column
    return keys


def window_of(keys: Keys) -> Window:
    row = (keys + ROW // 2) // ROW
    column = keys - row * ROW
    low = int(column.min()), int(row.min())
    return Window(*low, int(column.max()) - low[0] + 1, int(row.max()) - low[1] + 1)
