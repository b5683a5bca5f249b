"""A simulation that follows a playhead: forward by pressing, backward by taking back, with materials that change."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count as numbers

import numpy as np
from numpy.typing import NDArray

from .ground.heightfield import HeightField, SparseGrid, Window
from .ground.material import GroundMaterial
from .ground.soft_ground import SoftGround
from .loads.estimate import CharacterLoads
from .record.footprints import Footprint
from .simulation import FrameResult, Simulation

Array = NDArray[np.float64]


@dataclass(frozen=True)
class _Change:
    """What one frame did to the ground.

    Attributes
    ----------
    frame : float
        Scene frame.
    material : GroundMaterial
        What it was pressed with.
    windows : tuple of Window
    before, after : tuple of (2, rows, columns) float arrays
        State of each window [m], with the windows taken one after the other.
    contact : tuple of (Window, (rows, columns) bool array)
        Cells that were in contact.
    earlier : tuple of (1, rows, columns) float arrays
        Last contact of their windows before it [scene frames], taken one after the other.
    """

    frame: float
    material: GroundMaterial
    windows: tuple[Window, ...] = ()
    before: tuple[Array, ...] = ()
    after: tuple[Array, ...] = ()
    contact: tuple[tuple[Window, NDArray[np.bool_]], ...] = ()
    earlier: tuple[Array, ...] = ()


class Playhead:
    """The ground at the frame that a timeline shows.

    Each frame is pressed once, with the material of the moment, and remembered: going back and forth over it gives
    the same ground, bit for bit. When the material changes, what lies ahead is pressed anew when it is reached.

    Parameters
    ----------
    loads : sequence of CharacterLoads
    ground : SoftGround
        With the material that the first frames are pressed with.
    cell_size : float
        Side of a cell [m].

    Attributes
    ----------
    material : GroundMaterial
        What frames are pressed with from now on.
    ground : HeightField
        At the frame that is shown; only to be read.
    contact : SparseGrid
        Scene frame at which each cell was last in contact by then, -inf where it never was; only to be read.
    """

    def __init__(self, loads: Sequence[CharacterLoads], ground: SoftGround, cell_size: float) -> None:
        self.material = ground.material
        self.ground = HeightField(cell_size)
        self.contact = SparseGrid(cell_size, channels=1, fill=-np.inf)
        self._loads, self._pressed = tuple(loads), ground
        self._changes: list[_Change] = []
        self._results = self._press(self._loads)
        self._changes.append(_Change(next(self._results).frame, ground.material))
        self._shown = 0

    @property
    def frame(self) -> float:
        """Scene frame that the ground shows."""
        return self._changes[self._shown].frame

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
        while self.frame + 1.0 <= frame and self._advance():
            windows += self._changes[self._shown].windows
        return windows

    def in_contact(self) -> tuple[tuple[Window, NDArray[np.bool_]], ...]:
        """The cells (rows, columns) of some windows that were in contact since the frame before the shown one."""
        return self._changes[self._shown].contact

    def materials(self) -> list[GroundMaterial]:
        """What the ground that is shown was pressed with, in order."""
        pressed = dict.fromkeys(change.material for change in self._changes[1 : self._shown + 1])
        return list(pressed) or [self.material]

    def footprints(self) -> list[Footprint]:
        """The record of the ground that is shown, with the contacts that are under way as they are by now."""
        until_now = [_until(self.frame, character) for character in self._loads]
        footprints = [footprint for result in self._press(until_now) for footprint in result.footprints]
        return sorted(footprints, key=lambda footprint: (footprint.start_frame, footprint.character, footprint.sole))

    def _advance(self) -> bool:
        """Go on to the shot's next frame; False if there is none."""
        ahead = self._changes[self._shown + 1 :]
        if any(not change.material.presses_like(self.material) for change in ahead):
            del self._changes[self._shown + 1 :]
            self._results = self._press(self._loads)
            for _ in self._changes:
                next(self._results)
            ahead = []
        if ahead:
            for window, state in zip(ahead[0].windows, ahead[0].after, strict=True):
                self.ground.write(window, state)
            self._touch(ahead[0].contact, ahead[0].frame)
        else:
            result = next(self._results, None)
            if result is None:
                return False
            self._changes.append(self._taken_over(result))
        self._shown += 1
        return True

    def _taken_over(self, result: FrameResult) -> _Change:
        """Bring the ground that is shown to the frame that was just pressed."""
        before, after = [], []
        for window in result.changed:
            before.append(self.ground.read(window))
            after.append(result.ground.read(window))
            self.ground.write(window, after[-1])
        earlier = self._touch(result.contact, result.frame)
        return _Change(
            result.frame, self.material, result.changed, tuple(before), tuple(after), result.contact, earlier
        )

    def _touch(self, contact: Sequence[tuple[Window, NDArray[np.bool_]]], frame: float) -> tuple[Array, ...]:
        """Note a contact of cells at a frame; when they were in contact before."""
        earlier = []
        for window, cells in contact:
            earlier.append(self.contact.read(window))
            self.contact.write(window, np.where(cells, frame, earlier[-1]))
        return tuple(earlier)

    def _press(self, loads: Sequence[CharacterLoads]) -> Iterator[FrameResult]:
        """Press from the first frame on: frames that are known with the material they had, new ones with the newest."""
        ground = replace(self._pressed, material=self.material)
        simulation = Simulation(ground, HeightField(self.ground.cell_size))
        results = simulation.run(loads)
        for number in numbers():
            known = number < len(self._changes)
            simulation.material = self._changes[number].material if known else self.material
            result = next(results, None)
            if result is None:
                return
            yield result


def _until(frame: float, character: CharacterLoads) -> CharacterLoads:
    """The loads up to a scene frame."""
    motion = character.motion
    count = int(np.searchsorted(motion.frames, frame, side="right"))
    steps = slice(count)
    return CharacterLoads(motion.first(count), character.contacts.during(steps), character.forces.during(steps))
