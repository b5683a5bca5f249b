"""Simulation of loads from a character's motion, and of footprints from loads."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..ground.heightfield import HeightField
from ..ground.soft_ground import SoftGround
from ..ground.sparse_grid import Window
from ..imprints.sole_points import SolePoints, flat_pose, sole_points
from ..loads.estimate import CharacterLoads
from ..loads.tracks import tracks
from ..numerics.arrays import Array
from ..pressing.contact_layout import ContactLayout
from ..pressing.ground_cells import Timing, UndisturbedCells
from ..pressing.open_contact import OpenContact
from ..pressing.prop_layout import PropLayout
from ..pressing.sole_layout import SoleLayout
from ..pressing.solver import GroundSolver
from ..record.contact_steps import ContactSteps, PressingSole, Steps, kept_sole, kept_steps
from ..record.footprints import Footprint

MOST_VERTICES = 20_000
"""Most vertices of a contact shape that is kept with its prints, so that they can be moved."""


@dataclass(frozen=True)
class FrameResult:
    """The ground at one scene frame.

    Attributes
    ----------
    frame : float
        Scene frame.
    ground : HeightField
        Its state at this frame; the simulation goes on working on it.
    changed : tuple of Window
        Where it changed since the frame before.
    contact : tuple of (Window, (rows, columns) bool array)
        Cells that were in contact since then.
    footprints : tuple of Footprint
        Those whose contact ended since the frame before; at the last frame, all that were still open.
    touching : tuple of (S,) bool arrays
        Which soles of each character touch.
    forces : tuple of (S, 3) float arrays
        Ground reaction force on each of them [N].
    """

    frame: float
    ground: HeightField
    changed: tuple[Window, ...]
    contact: tuple[tuple[Window, NDArray[np.bool_]], ...]
    footprints: tuple[Footprint, ...]
    touching: tuple[NDArray[np.bool_], ...]
    forces: tuple[Array, ...]


def simulate(
    loads: Sequence[CharacterLoads],
    ground: SoftGround,
    cell_size: float,
    *,
    pressed: HeightField | None = None,
    undisturbed: UndisturbedCells | None = None,
) -> Iterator[FrameResult]:
    """Press footprints into the ground, frame by frame.

    Each step of the loads presses over the time that ends at it; their first is the undisturbed ground.

    Parameters
    ----------
    loads : sequence of CharacterLoads
        Characters that share the ground, on time grids of the same step.
    cell_size : float
        Side of a cell [m].
    pressed : HeightField, optional
        What was pressed of it before, such as from `footprints.recompose`; it is worked on.
    undisturbed : UndisturbedCells, optional
        The cells of its terrain, where another simulation has looked some of them up.

    Yields
    ------
    FrameResult
        One for each scene frame. The footprints of all results are the record of the bake, the ground of the last
        one is its end.

    Raises
    ------
    InputError
        If the cell size is not positive, or the characters do not share a time grid.
    """
    state = HeightField(cell_size) if pressed is None else pressed
    solver = GroundSolver(ground, state, undisturbed or UndisturbedCells(ground, cell_size))
    grid = time_grid(loads)
    waiting = _Waiting(loads, grid)
    contacts: list[OpenContact] = []
    start = 1
    for end in grid.shown + 1:
        contacts += waiting.due(int(end))
        frame = float(grid.frames[end - 1])
        is_last = end == grid.shown[-1] + 1
        changed, ended = solver.step(contacts, start, int(end), frame, grid.timing, is_last=is_last)
        if weathered := solver.weathered:
            for contact in ended:
                last = float(contact.layout.steps.frames[-1])
                weathered.ended(last, contact.compressed, contact.area, contact.made_of)
        start = int(end)
        yield FrameResult(
            frame,
            solver.state,
            changed,
            tuple(solver.contact),
            tuple(contact.footprint() for contact in ended if contact.recorder),
            *_state_at(loads, grid.offsets, start - 1),
        )


class _Waiting:
    """Contacts to come, by their first step, in the order of the scene where they start together.

    Each is opened when its time comes: its poses at all steps take memory.
    """

    def __init__(self, loads: Sequence[CharacterLoads], grid: TimeGrid) -> None:
        self._frames = grid.frames
        self._latest: dict[tuple[int, int], OpenContact] = {}
        contacts = [
            contact
            for number, (character, offset) in enumerate(zip(loads, grid.offsets, strict=True))
            for index in range(len(character.motion.soles))
            for contact in contacts_of(character, number, index, offset)
        ]
        self._contacts = deque(sorted(contacts, key=lambda contact: contact.first))

    def due(self, end: int) -> Iterator[OpenContact]:
        """The contacts that start before a step."""
        while self._contacts and self._contacts[0].first < end:
            contact = self._contacts.popleft()
            earlier = self._latest.get(contact.of)
            goes_on = earlier is not None and earlier.layout.end == contact.since
            layout = contact.layout(self._frames)
            opened = OpenContact(layout, earlier if goes_on else None, contact.recorded(layout.steps))
            self._latest[contact.of] = opened
            yield opened


@dataclass(frozen=True)
class ShotContact:
    """A sole from touching down to leaving.

    Attributes
    ----------
    of : (int, int)
        Number of the character and of its sole.
    during : slice
        Its steps, of the character's.
    since, first : int
        Steps of the time grid from which it touches, and presses.
    points : SolePoints or None
        Of the sole, None of a prop.
    pressing : PressingSole or None
        What is kept of the sole; None of one that is too large for that.
    """

    character: CharacterLoads
    of: tuple[int, int]
    during: slice
    since: int
    first: int
    points: SolePoints | None
    pressing: PressingSole | None

    def recorded(self, steps: Steps) -> ContactSteps | None:
        """Record of its steps for its footprint."""
        return kept_steps(self.pressing, steps, self.character.motion.time_step) if self.pressing else None

    def layout(self, frames: Array, stride: int = 1) -> ContactLayout:
        """Its layout, at steps of the time grid that are at these scene frames; at each of so many only."""
        motion, contacts, forces = self.character.motion, self.character.contacts, self.character.forces
        index, during = self.of[1], slice(self.during.start, self.during.stop, stride)
        sole, poses = motion.soles[index].sole, motion.soles[index].transforms
        steps = Steps(
            self.first,
            frames[self.first : self.first + during.stop - during.start : stride],
            poses[during],
            poses[max(during.start % stride, during.start - 2 * stride) : during.start : stride],
            forces.forces[during, index],
            contacts.normal[during, index],
            forces.centre_of_pressure[during, index],
        )
        if self.points is None:
            return PropLayout(motion.name, sole, steps)
        return SoleLayout(motion.name, sole, steps, self.points)


def contacts_of(character: CharacterLoads, number: int, index: int, offset: int) -> Iterator[ShotContact]:
    """The contacts of a sole of a character, which appears at a step of the time grid."""
    motion, pieces = character.motion.soles[index], list(tracks(character, index))
    points = sole_points(motion.sole, motion.transforms) if pieces and not motion.sole.prop else None
    keeps = pieces and (motion.sole.prop is None or len(motion.sole.prop.vertices) <= MOST_VERTICES)
    pressing = kept_sole(motion.sole, flat_pose(motion.transforms)) if keeps else None
    for piece in pieces:
        begin = max(piece.start, 1 - offset)  # the first step of the grid is a state, it presses nothing
        if begin < piece.stop:
            during, since = slice(begin, piece.stop), piece.start + offset
            yield ShotContact(character, (number, index), during, since, begin + offset, points, pressing)


@dataclass(frozen=True)
class TimeGrid:
    """The steps that all characters share.

    Attributes
    ----------
    frames : (N,) float array
        Scene frame of each step.
    shown : (K,) int array
        Steps at whole frames.
    offsets : list of int
        Step at which each character appears.
    """

    frames: Array
    shown: NDArray[np.intp]
    offsets: list[int]
    timing: Timing


def time_grid(loads: Sequence[CharacterLoads]) -> TimeGrid:
    if not loads:
        raise InputError("There are no loads to press: give those of at least one body.", "no_loads")
    motions = [character.motion for character in loads]
    first = min(motion.frames[0] for motion in motions)
    spacing = max(motion.time_step * motion.frame_rate for motion in motions)
    offsets = []
    for motion in motions:
        offset = (motion.frames[0] - first) / spacing
        if abs(motion.time_step - motions[0].time_step) > 1e-9 or abs(offset - round(offset)) > 1e-3:
            raise InputError(
                f"'{motion.name}' is sampled at other times than '{motions[0].name}': sample all characters at the "
                "same frames of the same scene.",
                "other_times",
            )
        offsets.append(round(offset))
    count = max(offset + len(motion.frames) for offset, motion in zip(offsets, motions, strict=True))
    frames = first + spacing * np.arange(count)
    shown = np.flatnonzero(np.abs(frames - first - np.rint(frames - first)) < 1e-6)
    frames[shown] = first + np.rint(frames[shown] - first)
    steps = int(shown[1] - shown[0]) if len(shown) > 1 else 1
    return TimeGrid(frames, shown, offsets, Timing(motions[0].time_step, steps, spacing * steps))


def _state_at(
    loads: Sequence[CharacterLoads], offsets: Sequence[int], step: int
) -> tuple[tuple[NDArray[np.bool_], ...], tuple[Array, ...]]:
    """Soles that touch, and the force on each, at a step of the common grid; nothing outside a character's time."""
    touching, forces = [], []
    for character, offset in zip(loads, offsets, strict=True):
        index = step - offset
        present = 0 <= index < len(character.motion.frames)
        touching.append(character.contacts.touching[index] if present else np.zeros(len(character.motion.soles), bool))
        forces.append(character.forces.forces[index] if present else np.zeros((len(character.motion.soles), 3)))
    return tuple(touching), tuple(forces)
