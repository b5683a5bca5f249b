"""A step in deep ground, and what its leg carves."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..numerics.arrays import Array, Indices, Mask
from ..record.footprints import QUANTUM, Changes, Footprint, FootprintRecorder
from ..record.throws import WADE, WEIGHT, Throw, ThrowKind
from ..soles.deep_ground import wading
from .carver import Walls

POSES_ALONG_SOLE = 9
"""Nothing in the ground moves further from one pose to the next than this part of a sole, or a cell: 3 cm, from which
the outline of a shank has scallops of two millimetres."""


@dataclass(eq=False)
class CarvedStep:
    """A step and what its leg has carved so far."""

    footprint: Footprint
    is_deep: bool
    recorder: FootprintRecorder
    walls: Walls
    cut: float = 0.0
    packed: float = 0.0
    unplaced: float = 0.0
    at_rest: bool = True
    ploughed: dict[float, Array] = field(default_factory=dict)
    """Samples of what it threw (see `record.throws.Throw`), by frame."""

    @cached_property
    def begins(self) -> float:
        """Scene frame from which its print may change."""
        changes = (self.footprint.compression, self.footprint.rim)
        return min(self.footprint.start_frame, *(float(each.frames.min(initial=np.inf)) for each in changes)) - 1.0

    @cached_property
    def ends(self) -> float:
        """Scene frame from which on its print stays as it is."""
        changes = (self.footprint.compression, self.footprint.rim)
        return max(self.footprint.end_frame, *(float(each.frames.max(initial=-np.inf)) for each in changes)) + 1.0

    @cached_property
    def _contact(self) -> tuple[Indices, Array, Array]:
        footprint = self.footprint
        return footprint.contact_cells[:], footprint.contact_start[:], footprint.contact_end[:]

    @cached_property
    def _changes(self) -> list[tuple[Changes, Indices, Array]]:
        footprint = self.footprint
        both = ((footprint.compression, -QUANTUM), (footprint.rim, QUANTUM))
        return [(changes, changes.cells, changes.amounts * sign) for changes, sign in both]

    def release(self) -> None:
        """Forget what takes memory."""
        for name in ("_contact", "_changes"):
            self.__dict__.pop(name, None)

    def touches(self, since: float, frame: float) -> Mask:
        """Cells of its print that its sole touches between two frames, (rows, columns)."""
        window = self.footprint.window
        contact = np.zeros(window.cells, dtype=bool)
        cells, start, end = self._contact
        contact[cells[(start <= frame) & (end > since)]] = True
        return contact.reshape(window.rows, window.columns)

    def change(self, since: float, frame: float) -> Array | None:
        """How far its print raised the ground between two frames, (rows, columns) [m]; None if nowhere."""
        window, moves = self.footprint.window, False
        raised = np.zeros(window.cells)
        for changes, cells, amounts in self._changes:
            first, last = np.searchsorted(changes.frames, (since + 1e-6, frame + 1e-6))
            part = slice(changes.first[first], changes.first[last])
            if part.start < part.stop:
                raised += np.bincount(cells[part], amounts[part], window.cells)
                moves = True
        return raised.reshape(window.rows, window.columns) if moves else None

    def plough(self, frame: float, volume: float, points: Array, velocity: Array) -> None:
        """Note a volume that flies from points (L, 3), and the velocity (3,) of what ploughs [m³, m, m/s]."""
        if volume < self.ploughed.get(frame, np.zeros(1))[WEIGHT]:  # of several parts, what throws most
            return
        aim, velocities = velocity / np.linalg.norm(velocity), np.tile(velocity, (len(points), 1))
        self.ploughed[frame] = np.concatenate([[volume], aim, points.ravel(), velocities.ravel()])

    def throw(self, number: int) -> Throw | None:
        """What it threw as it ploughed, as that of a step of a number; None if nothing."""
        if not self.ploughed:
            return None
        first, last, step = min(self.ploughed), max(self.ploughed), self.footprint.frame_step
        rows = np.zeros((round((last - first) / step) + 1, len(self.ploughed[first])))
        for frame, row in self.ploughed.items():
            rows[round((frame - first) / step)] = row
        return Throw(number, WADE, ThrowKind.PLOUGH, False, first, step, 0.0, first, rows.astype(np.float32))

    @property
    def spacing(self) -> float:
        """Distance from one pose of its leg to the next [m]."""
        made_by = self.footprint.pressed_by
        return max(self.footprint.cell_size, made_by.pressing.sole.length / POSES_ALONG_SOLE if made_by else 0.0)


def is_deep(footprint: Footprint) -> bool:
    """True if a foot sank beyond its ankle, or a hand or knee as far for its length."""
    made_by = footprint.pressed_by
    return bool(made_by and wading(footprint.max_depth_m, made_by.pressing.sole.length) > 0)
