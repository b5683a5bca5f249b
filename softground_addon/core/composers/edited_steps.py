"""Footprints as the artist's edits leave them: the steps that changed, and those that meet them, are pressed again.

The result is a function of the record, the edits and the undisturbed ground alone. Whoever makes a ground, be it a bake
or an edit of a single step, gets the same footprints from them, bit for bit.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from weakref import WeakKeyDictionary

import numpy as np

from ..errors import InputError, damaged_record
from ..ground.heightfield import HeightField
from ..ground.soft_ground import SoftGround
from ..ground.sparse_grid import Window
from ..imprints.sole_points import SolePoints, sole_points
from ..numerics.arrays import Mask
from ..numerics.cell_keys import Keys, among
from ..numerics.slices import Slices, sliced, without_warnings
from ..playback.blocks import changed_by
from ..pressing.contact_layout import ContactLayout
from ..pressing.edited_contacts import edited_contact
from ..pressing.ground_cells import GroundCells, UndisturbedCells
from ..pressing.open_contact import OpenContact
from ..pressing.prop_layout import PropLayout
from ..pressing.sole_layout import SoleLayout
from ..pressing.solver import GroundSolver
from ..record.edits import UNCHANGED, StepEdit, edits_by_number, feet, sole_of
from ..record.footprints import Footprint
from ..record.mesh_sole import MeshSole
from ..record.record import BakeRecord
from .replayed_step import Layout, ReplayedStep, grid_of, keys_of_cells, window_of

Change = tuple[int, StepEdit]
"""Number of a step, and what was changed of it."""

VISIBLE = 5e-5
"""Change of a print that makes those meet it that come later be pressed again [m]: a quarter of what playback keeps."""
MOST_CELLS, MOST_PRINTS = 2**22, 64
"""A step is pressed in at most so many cells (10 m along each side, where they suit a foot), or so many times those of
its print, at the scale of that: what is stored of one with more is damaged."""
_DAMAGE = (ArithmeticError, IndexError, MemoryError, ValueError, np.linalg.LinAlgError)
"""What pressing steps may raise that a stranger's file says: soles of no area, poses that are none."""
_SAME_TIME = 1e-3
"""Scene frames."""
SLIDING = 0.25
"""How far around a step ground may slide into it, where the material has an angle of repose [m]."""


@sliced
def with_edits(
    record: BakeRecord, edits: Mapping[str, StepEdit], ground: SoftGround, cell_size: float
) -> Slices[BakeRecord]:
    """A record with other edits in place of those that it has.

    Parameters
    ----------
    ground : SoftGround
        That it was baked on.
    cell_size : float
        Side of a cell [m].

    Raises
    ------
    InputError
        See `EditedSteps.pressed_again`.
    """
    return (yield from EditedSteps.record_with.slices(EditedSteps(record.footprints, ground, cell_size), record, edits))


class EditedSteps:
    """The footprints of a record, of which some are edited.

    Parameters
    ----------
    footprints : sequence of Footprint
        As they were baked.
    ground : SoftGround
        That they were baked on.
    cell_size : float
        Side of a cell [m].
    """

    def __init__(self, footprints: Sequence[Footprint], ground: SoftGround, cell_size: float) -> None:
        self._footprints, self._ground, self._cell_size = footprints, ground, cell_size
        self._undisturbed = UndisturbedCells(ground, cell_size)
        self._cells = GroundCells(ground, self._undisturbed)
        self._weather_reach = int(ground.weathering.reach / cell_size) if ground.weathering else 0
        """How many cells around a step what weather leaves there depends on."""
        sliding = int(SLIDING / cell_size) if ground.slides else 0
        self._margin = max(sliding, self._weather_reach)
        self._feet = feet(footprints)
        self._points: dict[tuple[int | MeshSole, float], SolePoints] = {}
        """Of soles and their scales."""
        self._layouts: dict[Change, Layout] = {}
        """Of the group that was pressed last: they take memory."""
        self._unpacked: dict[int, ReplayedStep] = {}
        """Prints around the steps that were pressed last, which a step that is dragged meets again and again."""
        self._known: dict[frozenset[Change], _Group] = {}
        self._windows = np.array([footprint.window for footprint in footprints]).reshape(-1, 4)
        self._frames = np.array([(footprint.start_frame, footprint.end_frame) for footprint in footprints])

    @sliced
    def record_with(self, record: BakeRecord, edits: Mapping[str, StepEdit]) -> Slices[BakeRecord]:
        """The record that the footprints are of, with other edits; errors as `pressed_again`."""
        again = yield from EditedSteps.pressed_again.slices(self, edits_by_number(record.footprints, edits))
        return replace(record, edits=dict(edits), pressed_again=again)

    @sliced
    def pressed_again(self, edits: Mapping[int, StepEdit]) -> Slices[dict[int, Footprint | None]]:
        """Footprints in place of some of the baked ones.

        Parameters
        ----------
        edits : mapping of int to StepEdit
            From `record.edits.edits_by_number`.

        Returns
        -------
        dict of int to Footprint or None
            By the number of the footprint or copy; None where nothing of it is left.

        Raises
        ------
        InputError
            If a step is to be moved of which the record keeps too little.
        """
        count = len(self._footprints)
        edits = {number: edit for number, edit in edits.items() if edit != UNCHANGED or number >= count}
        groups = []
        for change in sorted(edits.items(), key=lambda item: item[0]):
            groups.append((yield from self._group(frozenset({change}))))
        while pair := next((pair for pair in _near(groups) if self._meet(*pair)), None):
            groups = [group for group in groups if group not in pair]
            groups.append((yield from self._group(pair[0].edits | pair[1].edits)))
        self._known = {changes: group for changes, group in self._known.items() if _within(changes, edits)}
        return dict(sorted(item for group in groups for item in group.prints.items()))

    def _baked(self, number: int) -> Footprint:
        """A step as it was baked; of a copy, that which it is a copy of."""
        return self._footprints[number % len(self._footprints)]

    def _before(self, number: int) -> Footprint | None:
        """The print that a bake without edits has."""
        return self._footprints[number] if number < len(self._footprints) else None

    def _group(self, edits: frozenset[Change]) -> Slices[_Group]:
        """Steps that were edited, and those that meet them."""
        if edits not in self._known:
            try:
                self._known[edits] = yield from without_warnings(self._pressed(edits))
            except _DAMAGE as error:
                raise damaged_record(error, "motion") from None
        return self._known[edits]

    def _pressed(self, edits: frozenset[Change]) -> Slices[_Group]:
        members = dict(edits)
        while True:
            prints = yield from self._press(members)
            changed = {n: self._changed_cells(n, footprint) for n, footprint in prints.items()}
            later = {
                other
                for n, cells in changed.items()
                for other in self._meeting(cells, self._start(n, members[n]))
                if other not in members and self._footprints[other].pressed_by
            }
            if not later:
                break
            members |= dict.fromkeys(later, UNCHANGED)
        self._layouts = {change: self._layouts[change] for change in members.items() if change in self._layouts}
        changing = {n: footprint for n, footprint in prints.items() if n in dict(edits) or len(changed[n])}
        windows = [footprint.window for footprint in changing.values() if footprint]
        window = reduce(Window.union, [*windows, *(self._baked(n).window for n in changing)])
        return _Group(edits, changing, {n: changed[n] for n in changing}, window.expanded(self._weather_reach))

    def _start(self, number: int, edit: StepEdit) -> float:
        """The first scene frame at which a step presses, or pressed."""
        return self._baked(number).start_frame + min(0, edit.shift_frames)

    def _meet(self, group: _Group, other: _Group) -> bool:
        """True if steps of one group meet what another one changed."""
        if other not in group.meets:
            group.meets[other] = bool(group.prints.keys() & other.prints.keys()) or self._touch(group, other)
        return group.meets[other]

    def _touch(self, first: _Group, other: _Group) -> bool:
        return any(
            self._reads(number, group.prints[number], cells)
            for group, another in ((first, other), (other, first))
            for number in group.prints
            for cells in another.changed.values()
        )

    def _meeting(self, cells: Keys, since: float) -> Iterable[int]:
        """Steps that press cells at a frame or later."""
        if not len(cells):
            return []
        near = self._over(window_of(cells).expanded(self._weather_reach)) & (self._frames[:, 1] >= since)
        return [n for n in np.flatnonzero(near).tolist() if self._reads(n, None, cells)]

    def _over(self, window: Window) -> Mask:
        """The steps as they were baked, (N,), that lie over a window."""
        low, size = self._windows[:, :2], self._windows[:, 2:]
        before_end = low < (window.column + window.columns, window.row + window.rows)
        return np.asarray((before_end & (low + size > (window.column, window.row))).all(axis=1))

    def _reads(self, number: int, footprint: Footprint | None, cells: Keys) -> bool:
        """True if a step, as it was baked or as it is now, presses some cells."""
        prints = (self._before(number), footprint)
        return any(
            bool(among(cells, pressed).any())
            for other_print in prints
            if other_print is not None
            for pressed in [self._read_by(other_print)]
        )

    def _read_by(self, footprint: Footprint) -> Keys:
        """The cells that a print depends on."""
        if self._ground.weathering or self._ground.slides:
            window = footprint.window.expanded(self._weather_reach)
            return keys_of_cells(window, np.arange(window.cells))
        return keys_of_cells(footprint.window, footprint.contact_cells[:])

    def _changed_cells(self, number: int, after: Footprint | None) -> Keys:
        """Cells in which the print of a step differs visibly from that of the bake."""
        either = self._ground.slides or self._ground.weathering
        before, window = self._before(number), self._baked(number).window
        window = window.union(after.window) if after else window
        difference = np.zeros((2 if either else 1, window.rows, window.columns))
        for footprint, sign in ((before, -1.0), (after, 1.0)):
            if footprint is not None:
                for of_quantity, changes in zip(difference, (footprint.compression, footprint.rim), strict=False):
                    of_quantity[window.slices(footprint.window)] += sign * footprint.tile(changes)
        differs = (np.abs(difference) > VISIBLE).any(axis=0)
        if self._ground.weathering and not _at_once(before, after):  # of other age, whatever its depth
            for footprint in (before, after):
                if footprint is not None:
                    differs[window.slices(footprint.window)] |= changed_by(footprint)
        return keys_of_cells(window, np.flatnonzero(differs))

    def _press(self, members: Mapping[int, StepEdit]) -> Slices[dict[int, Footprint | None]]:
        """The prints of some steps, on what all others leave."""
        moving = {n: edit for n, edit in sorted(members.items()) if not edit.mute}
        layouts = {change[0]: self._layout(change) for change in moving.items()}
        prints: dict[int, Footprint | None] = dict.fromkeys(sorted(members))
        if layouts:
            prints |= yield from self._run(layouts, members)
        return prints

    def _run(self, laid: Mapping[int, Layout], members: Mapping[int, StepEdit]) -> Slices[dict[int, Footprint | None]]:
        layouts = {n: item.layout for n, item in laid.items()}
        grid = grid_of(self._baked(next(iter(layouts))))
        start = min(layout.first for layout in layouts.values())
        end = max(layout.end for layout in layouts.values())
        others = self._others(layouts, members, grid.frame(grid.number(end - 1)))
        first = grid.number(start)
        solver = GroundSolver(self._ground, HeightField(self._cell_size), self._undisturbed)
        if weathered := solver.weathered:
            for item in self._footprints:
                weathered.ended(item.end_frame, item.compressed_m3, item.area_m2, item.surface)
        contacts = [OpenContact(item.layout, laid_out=item.imprints) for item in laid.values()]
        number_of = dict(zip(contacts, laid, strict=True))
        prints: dict[int, Footprint | None] = {}
        before = -np.inf
        for number in range(first - 1, grid.number(end - 1) + 1):
            yield
            frame, steps = grid.frame(number), grid.steps(number)
            for other in others:
                other.replay(solver, before, frame)
            before = frame
            _, ended = solver.step(contacts, steps.start, steps.stop, frame, grid.timing)
            for contact in ended:
                prints[number_of[contact]] = contact.footprint() if contact.recorder else None
        return prints

    def _others(
        self, layouts: Mapping[int, ContactLayout], members: Mapping[int, StepEdit], end: float
    ) -> list[ReplayedStep]:
        """The prints around some steps that stay as they were baked."""
        windows = [layout.window(self._cells).expanded(self._margin) for layout in layouts.values()]
        near = np.any([self._over(window) for window in windows], axis=0) & (self._frames[:, 0] <= end)
        around = np.flatnonzero(near).tolist()
        self._unpacked = {n: self._unpacked.get(n) or ReplayedStep(self._footprints[n]) for n in around}
        return [baked for n, baked in self._unpacked.items() if n not in members]

    def _layout(self, change: Change) -> Layout:
        if change not in self._layouts:
            self._layouts[change] = Layout(self._laid_out(self._baked(change[0]), change[1]))
        return self._layouts[change]

    def _laid_out(self, footprint: Footprint, edit: StepEdit) -> ContactLayout:
        """A step where it is pressed now."""
        baked = footprint.pressed_by
        if baked is None:
            raise InputError(
                f"The print of '{footprint.character}', {footprint.sole}, at frame {footprint.start_frame:.0f} was "
                "pressed by a mesh of too many vertices, and can only be muted: give it fewer, and bake again.",
                "too_many_vertices",
            )
        steps = grid_of(footprint).shifted(baked.steps(footprint.load_frames), edit.shift_frames)
        other = sole_of(edit, baked.pressing, self._feet)
        pressing, steps = edited_contact(baked.pressing, steps, other, edit, footprint.position, self._ground.terrain)
        sole, strength = pressing.sole, edit.strength
        layout: ContactLayout
        if sole.prop is not None:
            layout = PropLayout(footprint.character, sole, steps, strength=strength)
        else:
            key = edit.mesh if edit.mesh and other is edit.mesh.pressing else id(other), edit.scale
            if key not in self._points:
                self._points[key] = sole_points(sole, pressing.flat[None])
            layout = SoleLayout(footprint.character, sole, steps, self._points[key], strength=strength)
        most = max(MOST_CELLS, MOST_PRINTS * footprint.window.cells) * max(1.0, edit.scale**2)
        if layout.window(self._cells).cells > most:
            raise InputError(
                f"The stored print of '{footprint.character}', {footprint.sole}, at frame "
                f"{footprint.start_frame:.0f} is larger than it can be: clear the bake and bake again.",
                "damaged_record",
            )
        return layout


@dataclass(frozen=True, eq=False)
class _Group:
    """Steps that were edited, with those that meet them, the cells that each changed visibly, their window, and which
    other groups meet them, as far as that was asked."""

    edits: frozenset[Change]
    prints: dict[int, Footprint | None]
    changed: dict[int, Keys]
    window: Window
    meets: WeakKeyDictionary[_Group, bool] = field(default_factory=WeakKeyDictionary)


def _near(groups: Sequence[_Group]) -> Iterable[tuple[_Group, _Group]]:
    """Pairs of groups whose windows share cells."""
    windows = np.array([group.window for group in groups]).reshape(-1, 4)
    low, high = windows[:, :2], windows[:, :2] + windows[:, 2:]
    near = ((low[:, None] < high) & (low < high[:, None])).all(axis=-1)
    return ((groups[a], groups[other]) for a, other in np.argwhere(np.triu(near, 1)).tolist())


def _within(changes: frozenset[Change], edits: Mapping[int, StepEdit]) -> bool:
    return all(edits.get(number) == edit for number, edit in changes)


def _at_once(footprint: Footprint | None, other: Footprint | None) -> bool:
    """True if two prints were made at the same time."""
    if footprint is None or other is None:
        return False
    return abs(footprint.start_frame - other.start_frame) + abs(footprint.end_frame - other.end_frame) < _SAME_TIME
