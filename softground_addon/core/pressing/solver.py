"""One contact after the other into one ground: the part of the simulation that works on cells."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ..ground.heightfield import HeightField
from ..ground.soft_ground import SoftGround
from ..ground.sparse_grid import SparseGrid, Window
from ..numerics.arrays import Array, Mask
from ..record.footprints import FootprintRecorder, quantised
from .deformation import compress
from .ground_cells import GroundCells, Imprints, Timing, UndisturbedCells
from .open_contact import OpenContact
from .repose import STEPS_PER_SLIDE, SWEEPS_PER_SLIDE, SWEEPS_TO_REST, slid, slide_reach
from .rim import displaced_volume
from .weathered_cells import WeatheredCells

ROOM = 16
"""Cells around those that slide whose undisturbed surface is looked up along with theirs: more slide later."""


class GroundSolver:
    """A ground to be pressed, and on what terms.

    Parameters
    ----------
    state : HeightField
        What was pressed of it so far; it is worked on.
    undisturbed : UndisturbedCells
        Its cells as they are before anything presses them.
    """

    def __init__(self, ground: SoftGround, state: HeightField, undisturbed: UndisturbedCells) -> None:
        self.state = state
        self.contact: list[tuple[Window, Mask]] = []
        """Cells that were in contact in the steps pressed last."""
        self.cells = GroundCells(ground, undisturbed)
        self.weathered: WeatheredCells | None = None
        """What weather does between contacts, where steps feel it."""
        if ground.weathering:
            self.weathered = WeatheredCells(ground.weathering, state.cell_size)

    @property
    def cell_size(self) -> float:
        """Side of a cell [m]."""
        return self.state.cell_size

    def step(
        self, contacts: list[OpenContact], start: int, end: int, frame: float, timing: Timing, *, is_last: bool = False
    ) -> tuple[tuple[Window, ...], list[OpenContact]]:
        """Press the steps of a recorded frame, from start to before end, and let go of the contacts that end in it.

        Parameters
        ----------
        contacts : list of OpenContact
            Those that are open by its end; at last without those that have ended.
        frame : float
            Scene frame.
        is_last : bool
            All contacts end.

        Returns
        -------
        changed : tuple of Window
            Where the ground may have changed.
        ended : list of OpenContact
        """
        changed = self._advance(contacts, start, end, frame, timing)
        ended = [contact for contact in contacts if contact.layout.end <= end or is_last]
        for contact in ended:
            contacts.remove(contact)
            changed += self._settle(contact, frame)
        return changed, ended

    def _advance(
        self, contacts: Sequence[OpenContact], start: int, end: int, frame: float, timing: Timing
    ) -> tuple[Window, ...]:
        """Press the steps from start to before end; where contacts share ground, all of them step by step."""
        parts = []
        self.contact = []
        for contact in contacts:
            first, last = max(start, contact.layout.first), min(end, contact.layout.end)
            if first < last:
                parts.append((contact, contact.imprints(first, last, self.cells, timing), first, last))
        windows = [imprints.window for _, imprints, _, _ in parts]
        spans = [(start, end)]
        if any(window.intersects(other) for window, other in combinations(windows, 2)):
            spans = [(step, step + 1) for step in range(start, end)]
        for begin, stop in spans:
            for contact, imprints, first, last in parts:
                if max(first, begin) < min(last, stop):
                    windows += self._press(contact, imprints, max(first, begin), min(last, stop), frame, timing)
        return tuple(windows)

    def _settle(self, contact: OpenContact, frame: float) -> tuple[Window, ...]:
        """Let slide what a contact that has ended left too steep; where the ground may have changed by that."""
        angle = contact.material.repose_angle if contact.material else 0.0
        if not angle or contact.recorder is None:
            return ()
        window = self._around(contact.recorder.window, angle)
        state = self.state.read(window)
        before = quantised(state)
        lowered = self._lowered(window, contact)
        state[0] += lowered
        terrain, bears = self._undisturbed(contact, window)
        state[1] = self._slid(state, window, terrain, ~bears, angle, SWEEPS_TO_REST)
        state[0] -= lowered
        change = quantised(state) - before
        if not change.any():
            return ()
        self.state.write(window, state)
        self._record(contact.recorder, frame, window, change, np.zeros(change.shape[1:], bool))
        return (window,)

    def _press(
        self, contact: OpenContact, imprints: Imprints, start: int, end: int, frame: float, timing: Timing
    ) -> list[Window]:
        first, last = ((step - imprints.first) * imprints.parts for step in (start, end))
        steps = first + np.flatnonzero(imprints.pressing[first:last])
        if not len(steps):
            return []
        self._meet(contact, imprints, frame, timing)
        material = contact.material = imprints.material
        window = self._around(imprints.window, material.repose_angle) if material.repose_angle else imprints.window
        whole = self.state.read(window)
        before = quantised(whole)
        inside = window.slices(imprints.window)
        state = whole[:, inside[0], inside[1]]
        lowered = self._lowered(window, contact)
        whole[0] += lowered
        compacted = self._compacted_before(contact, imprints.window, state) if material.hardening else None
        deeper = self._deeper(imprints.window, contact)
        heights, displaced = np.zeros(len(steps)), np.zeros(len(steps))
        earlier = state[0].copy()
        for k, step in enumerate(steps):
            compression = compress(
                state[0],
                imprints.coverage[step],
                imprints.target[step] * deeper,
                imprints.rate[step],
                holds=False if imprints.holds is None else imprints.holds[step],
                compacted=compacted,
                hardening=material.hardening,
            )
            newly = compression - state[0]
            heights[k] = newly.sum()
            if heights[k] > 0:
                if imprints.factors is None:
                    displaced[k] = displaced_volume(heights[k], material)
                else:
                    displaced[k] = displaced_volume(newly, material, imprints.factors.rim).sum()
                state[0] = compression
                state[1] += displaced[k] * imprints.rim[step]
            number = imprints.first + step // imprints.parts - contact.layout.first
            if material.repose_angle and number % STEPS_PER_SLIDE == 0:
                terrain, bears = self._undisturbed(contact, window)
                fixed = ~bears
                fixed[inside] |= imprints.contact[step]
                whole[1] = self._slid(whole, window, terrain, fixed, material.repose_angle, SWEEPS_PER_SLIDE)
        if contact.compression is not None and compacted is not None:
            contact.compression.write(imprints.window, (state[0] - compacted)[None])
        if self.weathered:
            self.weathered.press(imprints.window, state[0] - earlier)
        whole[0] -= lowered
        self.state.write(window, whole)
        contact.add_loads(imprints, first, last)
        cell_area = self.cell_size**2
        contact.compressed += float(heights.sum()) * cell_area
        placed = imprints.placed[steps]
        contact.raised += float(displaced[placed].sum()) * cell_area
        contact.unplaced += float(displaced[~placed].sum()) * cell_area
        if contact.recorder is None:
            contact.recorder = FootprintRecorder(self.cell_size, timing.frame_step)
        touched = np.zeros(whole.shape[1:], bool)
        touched[inside] = imprints.contact[steps].any(axis=0)
        self._record(contact.recorder, frame, window, quantised(whole) - before, touched)
        self.contact.append((window, touched))
        return [window] if material.repose_angle else []

    def _meet(self, contact: OpenContact, imprints: Imprints, frame: float, timing: Timing) -> None:
        """Let a contact find under new imprints what weather has left by the frame before."""
        if self.weathered is None or contact.met is imprints:
            return
        before = frame - timing.frame_step
        if contact.met is None:
            contact.met_since = before
        contact.met = imprints
        met = self.weathered.met(self.state, imprints, contact.met_since, before, timing.frame_step)
        change = quantised(met) - quantised(self.state.read(imprints.window))
        self.state.write(imprints.window, met)
        if change.any():
            if contact.recorder is None:
                contact.recorder = FootprintRecorder(self.cell_size, timing.frame_step)
            self._record(contact.recorder, before, imprints.window, change, np.zeros(change.shape[1:], bool))

    def _lowered(self, window: Window, contact: OpenContact) -> Array | float:
        """Depth below open ground that is not recorded, for each trodden cell of a window [m]."""
        if self.weathered is None:
            return 0.0
        return self.weathered.trodden(window) * self.weathered.level(contact.met_since, window)

    def _deeper(self, window: Window, contact: OpenContact) -> Array | float:
        """Factor of the depth of cells: of a layer that new snow has made deeper, or melt less deep."""
        if self.weathered is None:
            return 1.0
        layer_depth = self.cells.ground.layer_depths(window, self.cell_size)
        return np.maximum(1.0 + self.weathered.level(contact.met_since, window) / layer_depth, 0.0)

    def _record(
        self, recorder: FootprintRecorder, frame: float, window: Window, change: NDArray[np.int64], touched: Mask
    ) -> None:
        recorder.add(frame, window, change, touched)
        if self.weathered:
            self.weathered.note(window, np.where(change.any(axis=0) | touched, frame, -np.inf), touched)

    def _compacted_before(self, contact: OpenContact, window: Window, state: Array) -> Array:
        """Compression of a window that a contact met when it began: all but its own (rows, columns) [m]."""
        if contact.compression is None and contact.earlier is not None:
            contact.compression = contact.earlier.compression
        if contact.compression is None:
            contact.compression = SparseGrid(self.cell_size, channels=1)
        return np.maximum(state[0] - contact.compression.read(window)[0], 0.0)

    def _around(self, window: Window, angle: float) -> Window:
        """A window with the ground around it that may slide with it."""
        compression, rim = self.state.read(window)
        return window.expanded(slide_reach(rim, compression, angle, self.cell_size))

    def _undisturbed(self, contact: OpenContact, window: Window) -> tuple[Array, Mask]:
        """Heights of the undisturbed ground, and what of it bears, over a window around a contact."""
        if contact.surface is None or contact.surface.window.union(window) != contact.surface.window:
            contact.surface = self.cells.surface(window.expanded(ROOM))
        inside = contact.surface.window.slices(window)
        return contact.surface.heights[inside], contact.surface.bears[inside]

    def _slid(self, state: Array, window: Window, terrain: Array, fixed: Mask, angle: float, sweeps: int) -> Array:
        """The rim of a window after what is too steep has slid down."""
        return slid(
            state[1],
            state[0],
            terrain,
            angle=angle,
            cell_size=self.cell_size,
            fixed=fixed,
            corner=(window.row, window.column),
            sweeps=sweeps,
        )
