"""A simulation that follows a playhead: forward by pressing, backward by taking back."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ground.heightfield import HeightField
from ..ground.soft_ground import SoftGround
from ..ground.sparse_grid import SparseGrid, Window
from ..loads.estimate import CharacterLoads
from ..numerics.arrays import Array
from ..numerics.intervals import runs
from ..numerics.slices import Slices, sliced
from ..pressing.ground_cells import UndisturbedCells
from ..record.footprints import Footprint
from .simulation import FrameResult, simulate

NEWEST = 48
"""Frames at the end of what is shown that are pressed anew first: two steps of a walk at least."""


@dataclass(frozen=True)
class _Change:
    """Change of the ground by one frame.

    Attributes
    ----------
    frame : float
        Scene frame.
    before, after : tuple of (2, rows, columns) float arrays
        State of each window [m], with the windows taken one after the other.
    contact : tuple of (Window, (rows, columns) bool array)
        Cells that were in contact.
    earlier : tuple of (1, rows, columns) float arrays
        Last contact of their windows before it [scene frames], taken one after the other.
    """

    frame: float
    windows: tuple[Window, ...] = ()
    before: tuple[Array, ...] = ()
    after: tuple[Array, ...] = ()
    contact: tuple[tuple[Window, NDArray[np.bool_]], ...] = ()
    earlier: tuple[Array, ...] = ()


class Playhead:
    """The ground at the frame that a timeline shows.

    Each frame is pressed once and remembered: going back and forth over it gives the same ground, bit for bit.

    Parameters
    ----------
    cell_size : float
        Side of a cell [m].
    pressed : HeightField, optional
        What was pressed of it before the loads begin.
    undisturbed : UndisturbedCells, optional
        The cells of its terrain, where another playhead has looked some of them up.

    Attributes
    ----------
    ground : HeightField
        At the frame that is shown; only to be read.
    contact : SparseGrid
        Scene frame at which each cell was last in contact by then, -inf where it never was; only to be read.
    """

    def __init__(
        self,
        loads: Sequence[CharacterLoads],
        ground: SoftGround,
        cell_size: float,
        pressed: HeightField | None = None,
        undisturbed: UndisturbedCells | None = None,
    ) -> None:
        self.undisturbed = undisturbed or UndisturbedCells(ground, cell_size)
        self.ground = pressed.copy() if pressed else HeightField(cell_size)
        self.contact = SparseGrid(cell_size, channels=1, fill=-np.inf)
        self._loads, self._soft_ground, self._before = tuple(loads), ground, self.ground.copy()
        self._results = self.press(self._loads)
        self._changes = [_Change(next(self._results).frame)]
        self._shown = 0

    @property
    def frame(self) -> float:
        """Scene frame that the ground shows."""
        return self._changes[self._shown].frame

    @property
    def first_frame(self) -> float:
        """Scene frame at which the ground is still as it was before."""
        return self._changes[0].frame

    def go_to(self, frame: float) -> list[Window]:
        """Show the ground at a scene frame, or at the shot's nearest one; returns where it may have changed."""
        windows: list[Window] = []
        while self._shown and self.frame > frame:
            change = self._changes[self._shown]
            for window, state in zip(reversed(change.windows), reversed(change.before), strict=True):
                self.ground.write(window, state)
            for (window, _), state in zip(reversed(change.contact), reversed(change.earlier), strict=True):
                self.contact.write(window, state)
            self._shown -= 1
            windows += change.windows
        while self.advance(frame):
            windows += self._changes[self._shown].windows
        return windows

    def advance(self, frame: float) -> bool:
        """Go on to the shot's next frame, if it has one by a scene frame; whether it has."""
        if self.frame + 1.0 > frame:
            return False
        if self._shown + 1 < len(self._changes):
            change = self._changes[self._shown + 1]
            for window, state in zip(change.windows, change.after, strict=True):
                self.ground.write(window, state)
            self._touch(change.contact, change.frame)
        else:
            result = next(self._results, None)
            if result is None:
                return False
            self._changes.append(self._taken_over(result))
        self._shown += 1
        return True

    def before_newest(self) -> float:
        """Scene frame before the contacts that are going on, or ended last: at most `NEWEST` frames back."""
        first = self.first_frame
        began = [_began_last(self.frame, character) for character in self._loads]
        return max(first, self.frame - NEWEST, np.floor(min(began, default=first)) - 1.0)

    def changed_since(self, frame: float) -> list[Window]:
        """Windows in which the shown ground may differ from the ground at a scene frame."""
        shown = self._changes[: self._shown + 1]
        return [window for change in shown if change.frame > frame for window in change.windows]

    def pressed_anew(self, frame: float, loads: Sequence[CharacterLoads], ground: SoftGround) -> Playhead:
        """A playhead that goes on from this one's ground at an earlier scene frame, under other loads or with another
        material: what is under way at that frame, and what follows, is pressed anew, what came before stays."""
        shown = self.frame
        self.go_to(frame)
        since = [_since(self.frame, character) for character in loads]
        later = Playhead(
            [character for character in since if len(character.motion.frames)],
            ground,
            self.ground.cell_size,
            self.ground,
            self.undisturbed,
        )
        later.contact = self.contact.copy()
        self.go_to(shown)
        return later

    def in_contact(self) -> tuple[tuple[Window, NDArray[np.bool_]], ...]:
        """The cells (rows, columns) of some windows that were in contact since the frame before the shown one."""
        return self._changes[self._shown].contact

    def loads_by_now(self) -> list[CharacterLoads]:
        """Loads that have pressed the ground that is shown."""
        return [_until(self.frame, character) for character in self._loads]

    def _taken_over(self, result: FrameResult) -> _Change:
        """Bring the ground that is shown to the frame that was just pressed."""
        before, after = [], []
        for window in result.changed:
            before.append(self.ground.read(window))
            after.append(result.ground.read(window))
            self.ground.write(window, after[-1])
        earlier = self._touch(result.contact, result.frame)
        return _Change(result.frame, result.changed, tuple(before), tuple(after), result.contact, earlier)

    def _touch(self, contact: Sequence[tuple[Window, NDArray[np.bool_]]], frame: float) -> tuple[Array, ...]:
        """Note a contact of cells at a frame; when they were in contact before."""
        earlier = []
        for window, cells in contact:
            earlier.append(self.contact.read(window))
            self.contact.write(window, np.where(cells, frame, earlier[-1]))
        return tuple(earlier)

    def press(self, loads: Sequence[CharacterLoads]) -> Iterator[FrameResult]:
        """Press loads into the ground as it was before, frame by frame."""
        before = self._before.copy()
        return simulate(loads, self._soft_ground, before.cell_size, pressed=before, undisturbed=self.undisturbed)


@sliced
def footprints_of(playhead: Playhead, loads: Sequence[CharacterLoads]) -> Slices[list[Footprint]]:
    """The record of the ground that a playhead shows after its `loads_by_now`, with the contacts that are under way as
    they are by then."""
    footprints: list[Footprint] = []
    for result in playhead.press(loads):
        footprints += result.footprints
        yield
    return sorted(footprints, key=lambda footprint: (footprint.start_frame, footprint.character, footprint.sole))


def _until(frame: float, character: CharacterLoads) -> CharacterLoads:
    """The loads up to a scene frame."""
    return _of(character, slice(int(np.searchsorted(character.motion.frames, frame, side="right"))))


def _since(frame: float, character: CharacterLoads) -> CharacterLoads:
    """The loads from a scene frame on."""
    return _of(character, slice(int(np.searchsorted(character.motion.frames, frame, side="left")), None))


def _of(character: CharacterLoads, steps: slice) -> CharacterLoads:
    return CharacterLoads(character.motion.of(steps), character.contacts.during(steps), character.forces.during(steps))


def _began_last(frame: float, character: CharacterLoads) -> float:
    """Scene frame at which the earlier of a character's two newest contacts began by some frame."""
    until = _until(frame, character)
    firsts = [runs(touching)[0] for touching in until.contacts.touching.T]
    newest = sorted(float(until.motion.frames[first[-1]]) for first in firsts if len(first))[-2:]
    return newest[0] if newest else frame
