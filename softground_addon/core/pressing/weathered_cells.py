"""Cells that weather acts on between contacts: when each changed last, and what a new contact finds of it.

Ground is recorded as it lies without weather. Where a contact presses ground that weather has raised or lowered, the
record takes that in: its compression is less than 0 where a step lies on new snow.
"""

from __future__ import annotations

from math import fsum

import numpy as np

from ..ground.heightfield import HeightField
from ..ground.soft_ground import Weathering
from ..ground.sparse_grid import SparseGrid, Window
from ..numerics.arrays import Array, Mask
from .ground_cells import Imprints


class WeatheredCells:
    """Facts of a pressed ground that weather needs.

    Parameters
    ----------
    cell_size : float
        Side of a cell [m].
    """

    def __init__(self, weathering: Weathering, cell_size: float) -> None:
        self._weathering, self._cell_size = weathering, cell_size
        self._last = SparseGrid(cell_size, channels=1, fill=-np.inf)
        """Scene frame at which each cell changed last."""
        self._trodden = SparseGrid(cell_size, channels=1)
        """1 where it was ever in contact."""
        self._pressed = SparseGrid(cell_size, channels=1)
        """How far steps compressed it, all together [m]."""
        self._sections: list[tuple[float, float, str]] = []

    def ended(self, frame: float, compressed: float, area: float, surface: str) -> None:
        """A contact ended at a scene frame, after it compressed a volume [m³] with an area [m²] of some surface."""
        if area > 0:
            self._sections.append((frame, compressed / np.sqrt(area), surface))

    def note(self, window: Window, changed: Array, touched: Mask) -> None:
        """Cells of a window (rows, columns) changed at scene frames, -inf where none did, and some were in contact."""
        self._last.write(window, np.maximum(self._last.read(window), changed))
        self._trodden.write(window, np.maximum(self._trodden.read(window), touched))

    def press(self, window: Window, newly: Array) -> None:
        """Steps compressed the cells of a window (rows, columns) by so much [m]."""
        self._pressed.write(window, self._pressed.read(window) + newly)

    def trodden(self, window: Window) -> Mask:
        """Cells of a window that were ever in contact, (rows, columns)."""
        return self._trodden.read(window)[0] > 0

    def level(self, frame: float, window: Window) -> Array | float:
        """Height of open ground in the cells of a window [m]."""
        return self._weathering.levels(frame, *np.meshgrid(*window.centres(self._cell_size)))

    def met(self, ground: HeightField, imprints: Imprints, since: float, frame: float, frame_step: float) -> Array:
        """Compression and rim that a contact begins on, (2, rows, columns), as they are recorded [m].

        Parameters
        ----------
        imprints : Imprints
            Where it will press and raise the ground.
        since : float
            Scene frame of the open ground for what it has not touched yet.
        frame, frame_step : float
            Scene frame before it begins, and how many are between those that are recorded.
        """
        window, pressing = imprints.window, imprints.pressing
        pressed = imprints.contact[pressing].any(axis=0)
        last = self._last.read(window)[0]
        # What changes all along has no age.
        stale = (pressed | (imprints.rim[pressing] > 0).any(axis=0)) & (last > -np.inf)
        stale &= last < frame - 0.5 * frame_step
        state = ground.read(window)
        if stale.any():
            aged = self._weathering.aged(
                ground,
                window,
                since=np.where(stale, last, frame),
                trodden=self._trodden,
                pressed=self._pressed.read(window)[0],
                frame=frame,
                sections=self._mean_sections(frame),
            )
            state = np.where(stale, aged, state)
        new = pressed & ~self.trodden(window)
        state[0] -= new * self.level(since, window)
        self.note(window, np.where(new, frame, -np.inf), new)
        return state

    def _mean_sections(self, frame: float) -> dict[str, float]:
        """Mean volume over width of the prints that ended by a frame, by their surface [m²]."""
        known: dict[str, list[float]] = {}
        for ended, section, surface in self._sections:
            if ended <= frame:
                known.setdefault(surface, []).append(section)
        return {surface: fsum(sections) / len(sections) for surface, sections in known.items()}
