"""The carves of a shot: what bodies cut out of deep ground beside their prints, frame by frame, as footprints.

A carve is recorded per step, from the middle of one swing of its sole to the middle of the next. Like any footprint it
adds to the others: its compression is how far what stands lies below the pressed ground, its rim the loose matter. Both
may fall again, as where a sole presses what a shin had cut before.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from math import ceil

import numpy as np
from numpy.typing import NDArray

from ..ground.deep_ground import wading
from ..ground.hard_ground import bare
from ..ground.heightfield import TerrainTiles
from ..ground.soft_ground import SoftGround
from ..ground.sparse_grid import SparseGrid, Window
from ..ground.surfaces import find
from ..ground.variation import VariationTiles
from ..legs.grounding import Response
from ..motion.motion import CharacterMotion
from ..numerics.interpolation import cubic
from ..numerics.slices import Slices, sliced
from ..pressing.repose import SWEEPS_TO_REST
from ..record.footprints import QUANTUM, Footprint, FootprintRecorder, quantised
from ..record.record import BakeRecord
from ..soles.undersides import lowest_surface
from .carver import REACH, CarvedCells, Walls
from .responded_skin import NO_SOLE, RespondedSkin, WornSkin

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Indices = NDArray[np.intp]

CUTS = 4
"""Most cuts in a frame."""
POSES_ALONG_SOLE = 14
"""Nothing in the ground moves further from one pose to the next than this part of a sole, or a cell: 2 cm, from which
the outline of a shank has scallops of a millimetre."""
MOST_POSES = 32
"""Most poses of a body in a frame."""
SLIDES_EVERY, SWEEPS = 2, 8
"""Loose matter slides after every so many frames, in so many sweeps (`repose.slid`); the rest goes on in the next, and
comes to rest once the leg is on its way to its next step."""
LEAST = round(1e-3 / QUANTUM)
"""Changes of a cell are recorded once they come to so much, and all of them at the end [QUANTUM]: 1 mm."""
FRAMES_AT_ONCE = 16
"""Frames whose skin is worked out together."""


@dataclass
class _Step:
    """A step and what its leg has carved so far."""

    footprint: Footprint
    is_deep: bool
    recorder: FootprintRecorder
    cut: float = 0.0
    packed: float = 0.0
    unplaced: float = 0.0
    at_rest: bool = True

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
    def contact(self) -> tuple[Indices, Array, Array]:
        """Cells that its sole touched, and from when to when."""
        footprint = self.footprint
        return footprint.contact_cells[:], footprint.contact_start[:], footprint.contact_end[:]

    @property
    def spacing(self) -> float:
        """Distance from one pose of its leg to the next [m]."""
        made_by = self.footprint.pressed_by
        return max(self.footprint.cell_size, made_by.pressing.sole.length / POSES_ALONG_SOLE if made_by else 0.0)


@sliced
def with_carves(
    left: BakeRecord,
    responses: Iterable[tuple[CharacterMotion, Response]],
    skins: Mapping[str, WornSkin],
    ground: SoftGround,
    surface: str,
) -> Slices[BakeRecord]:
    """A record with what the bodies of a shot carve; the same where nobody wades.

    Parameters
    ----------
    left : BakeRecord
    responses : iterable of (CharacterMotion, Response)
    skins : mapping of str to WornSkin
        By the names of the characters, of those whose skin was read.
    ground : SoftGround
    surface : str
        What it is made of.
    """
    prints = {step.index: step.left for step in left.steps if step.left is not None}
    waders = {print.character for print in prints.values() if _is_deep(print)}
    responded = [
        (motion.name, [sole.sole.name for sole in motion.soles], RespondedSkin(skins[motion.name], motion, response))
        for motion, response in responses
        if motion.name in skins.keys() & waders
    ]
    if not responded:
        return left
    walls = Walls.of(find(surface), ground.material, ground.gravity)
    return replace(left, carves=(yield from carves_of.slices(responded, prints, ground, walls)))


@sliced
def carves_of(
    skins: Sequence[tuple[str, Sequence[str], RespondedSkin]],
    footprints: Mapping[int, Footprint],
    ground: SoftGround,
    walls: Walls,
) -> Slices[dict[int, Footprint]]:
    """What bodies carve, by the number of the step that it goes with: of steps that sank beyond the ankle.

    Parameters
    ----------
    skins : sequence of (str, sequence of str, RespondedSkin)
        Name of each character, the names of its soles, and its skin; at least one, all at the same frames.
    footprints : mapping of int to Footprint
        The prints that the ground is made from, at least one, by their numbers.
    ground : SoftGround
    walls : Walls
    """
    some = next(iter(footprints.values()))
    steps = {
        number: _Step(footprint, _is_deep(footprint), FootprintRecorder(some.cell_size, some.frame_step))
        for number, footprint in footprints.items()
    }
    carving = _Carving(ground, walls, some.cell_size, list(steps.values()))
    frames = skins[0][2].frames
    bodies = [_Body(name, soles, skin, list(steps.values())) for name, soles, skin in skins]
    carving.press(-np.inf, float(frames[0]))
    for number, (since, frame) in enumerate(pairwise(frames.tolist()), start=1):
        yield
        carving.press(since, frame)
        for body in bodies:
            around = next(body.poses)
            for step, left, triangles in body.parts(number):
                if left is not None:
                    carving.settle(left, frame)
                if step.is_deep:
                    carving.carve(step, around, triangles, frame)
    for step in steps.values():
        yield
        carving.settle(step, float(frames[-1]))
    return {number: carving.footprint(step) for number, step in steps.items() if step.recorder.frames}


class _Body:
    """A character's skin, part by part, and the steps that these parts take."""

    def __init__(self, name: str, soles: Sequence[str], skin: RespondedSkin, steps: Sequence[_Step]) -> None:
        self.poses = _poses(skin)
        self._jumps = set(skin.jumps)
        own = [step for step in steps if step.footprint.character == name]
        self._parts = []
        for sole, triangles in skin.triangles.items():
            taken = own if sole == NO_SOLE else [step for step in own if step.footprint.sole == soles[sole]]
            if taken:
                self._parts.append((sole, taken, _nearest(taken, skin.frames), triangles))

    def parts(self, number: int) -> Iterator[tuple[_Step, _Step | None, Indices]]:
        """The step that each part is nearest to at a frame, the one that its sole has just left, and triangles.

        None where the body jumps.
        """
        for sole, taken, nearest, triangles in self._parts if number not in self._jumps else ():
            before = nearest[number - 1]
            has_left = sole != NO_SOLE and before != nearest[number]
            yield taken[nearest[number]], taken[before] if has_left else None, triangles


def _nearest(steps: Sequence[_Step], frames: Array) -> Indices:
    """Which of the steps each frame is nearest to, (F,)."""
    spans = np.array([(step.footprint.start_frame, step.footprint.end_frame) for step in steps])
    away = np.maximum(spans[:, :1] - frames, frames - spans[:, 1:]).clip(min=0.0)
    nearest: Indices = away.argmin(axis=0)
    return nearest


def _is_deep(footprint: Footprint) -> bool:
    """True if a foot sank beyond its ankle."""
    made_by = footprint.pressed_by
    if made_by is None or made_by.pressing.sole.prop is not None:
        return False
    return bool(wading(footprint.max_depth_m, made_by.pressing.sole.length) > 0)


def _poses(skin: RespondedSkin) -> Iterator[Array]:
    """The vertices at the two frames of each span and at their neighbours, (4, V, 3) [m], span by span."""
    last = len(skin.frames) - 1
    for first in range(0, last, FRAMES_AT_ONCE):
        end = min(first + FRAMES_AT_ONCE, last)
        places = skin.at(np.arange(first - 1, end + 2).clip(0, last))
        for number in range(end - first):
            before, after = (0 if place in skin.jumps else 1 for place in (first + number, first + number + 2))
            yield places[[number + 1 - before, number + 1, number + 2, number + 2 + after]]


class _Carving:
    """The ground of a shot as it is carved."""

    def __init__(self, ground: SoftGround, walls: Walls, cell_size: float, steps: Sequence[_Step]) -> None:
        self._walls, self._cell_size, self._steps = walls, cell_size, steps
        self._undisturbed = TerrainTiles(bare(ground.terrain), cell_size)
        self._highest = 0.0
        """Highest surface over the undisturbed ground so far [m]."""
        self._layer_depth = ground.material.layer_depth
        self._variation = VariationTiles(ground.variation, cell_size) if ground.variation else None
        self._pressed = SparseGrid(cell_size, channels=1)
        self._lowest = SparseGrid(cell_size, channels=1, fill=np.inf)
        self._loose = SparseGrid(cell_size, channels=1)
        self._recorded = SparseGrid(cell_size, channels=2)
        self._contact = SparseGrid(cell_size, channels=1)

    def press(self, since: float, frame: float) -> None:
        """Go on to the ground as soles have pressed it by a frame; what is loose under them is packed."""
        self._contact = SparseGrid(self._cell_size, channels=1)
        for step in self._steps:
            footprint = step.footprint
            if not step.begins <= frame or since >= step.ends:
                continue
            window = footprint.window
            change = _change(footprint, since, frame)
            touched, start, end = step.contact
            touching = (start <= frame) & (end > since)
            if change is None and not touching.any():
                continue
            contact = self._contact.read(window)[0]
            contact.reshape(-1)[touched[touching]] = 1.0
            self._contact.write(window, contact[None])
            cells = self._cells(window)
            if change is not None:
                self._pressed.write(window, self._pressed.read(window) + change)
                cells.press(cells.pressed + change)
            cells.pack()
            self._keep(step, window, cells, frame, LEAST)

    def carve(self, step: _Step, around: Array, triangles: Indices, frame: float) -> None:
        """Cut the ground to a part of a body over the frame before, from its vertices (4, V, 3) around that span."""
        used, triangles = np.unique(triangles, return_inverse=True)
        triangles, around = triangles.reshape(-1, 3), around[:, used]
        both = around[1:3]
        if not np.isfinite(around).all():
            return
        box = Window.around(both[..., :2].min(axis=(0, 1)), both[..., :2].max(axis=(0, 1)), self._cell_size)
        terrain = self._undisturbed.heights(box)
        over = both[..., 2] - terrain[box.cells_under(both[..., 0], both[..., 1], self._cell_size)]
        low = (over < self._highest).any(axis=0)
        triangles = triangles[low[triangles].any(axis=1)]
        if not len(triangles):
            return
        corners = both[:, np.unique(triangles), :2]
        margin = ceil(2 * REACH / self._cell_size) + 2
        window = Window.around(corners.min(axis=(0, 1)), corners.max(axis=(0, 1)), self._cell_size).expanded(margin)
        cells = self._cells(window)
        way = both[1, low] - both[0, low]
        distance = np.linalg.norm(way, axis=1)
        ahead, poses = way[distance.argmax(), :2], ceil(min(max(distance.max() / step.spacing, 1.0), MOST_POSES))
        floor = cells.terrain - self._layer_depth * (self._variation.factors(window).depth if self._variation else 1.0)
        cuts = min(poses, CUTS)
        underside = np.empty(0)
        for part in np.array_split(np.arange(1, poses + 1) / poses, cuts):
            underside = self._underside(cubic(around, 1.0 + part), triangles, window)
            underside = np.maximum(underside, floor)
            cells.cut(underside, ahead, self._walls.packing)
        if round(frame) % SLIDES_EVERY == 0:
            body = underside < cells.surface + self._cell_size
            cells.slide(self._walls, body, (window.row, window.column), SWEEPS)
        self._keep(step, window, cells, frame, LEAST)

    def _underside(self, poses: Array, triangles: Indices, window: Window) -> Array:
        """Lowest surface of some poses (N, V, 3) over the cells of a window."""
        origin = (np.array((window.column, window.row)) + 0.5) * self._cell_size
        numbers = triangles + poses.shape[1] * np.arange(len(poses))[:, None, None]
        shape = window.rows, window.columns
        return lowest_surface(poses.reshape(-1, 3), numbers.reshape(-1, 3), origin, shape, self._cell_size)

    def settle(self, step: _Step, frame: float) -> None:
        """Let what a step has carved come to rest, and record all of it; nothing happens where it has."""
        if step.at_rest or not step.recorder.frames:
            return
        window = step.recorder.window
        cells = self._cells(window)
        window = window.expanded(self._walls.reach(cells.surface, cells.loose, self._cell_size))
        cells = self._cells(window)
        cells.slide(self._walls, np.zeros_like(cells.closed), (window.row, window.column), SWEEPS_TO_REST)
        cells.gather(self._recorded.read(window)[1] * QUANTUM, LEAST * QUANTUM)
        self._keep(step, window, cells, frame, 1)

    def footprint(self, step: _Step) -> Footprint:
        """What a step has carved."""
        footprint, area = step.footprint, self._cell_size**2
        frames = step.recorder.frames
        return step.recorder.footprint(
            character=footprint.character,
            sole=footprint.sole,
            start_frame=min(frames),
            end_frame=max(frames),
            position=footprint.position,
            heading=footprint.heading,
            area_m2=0.0,
            peak_force_n=0.0,
            compressed_m3=step.cut * area,
            rim_m3=(step.cut - step.packed - step.unplaced) * area,
            unplaced_rim_m3=step.unplaced * area,
            load_frames=np.zeros(0),
            load_n=np.zeros(0),
        )

    def _cells(self, window: Window) -> CarvedCells:
        surface = self._undisturbed.surface(window)
        terrain = np.nan_to_num(surface.heights)
        return CarvedCells(
            cell_size=self._cell_size,
            terrain=terrain,
            closed=~surface.bears,
            contact=self._contact.read(window)[0] > 0,
            pressed=terrain + self._pressed.read(window)[0],
            lowest=self._lowest.read(window)[0],
            loose=self._loose.read(window)[0],
        )

    def _keep(self, step: _Step, window: Window, cells: CarvedCells, frame: float, least: int) -> None:
        """Write cells back, and record what of their changes comes to the least [QUANTUM]."""
        step.at_rest = least == 1
        step.cut += cells.cut_height
        step.packed += cells.packed
        step.unplaced += cells.unplaced
        self._highest = max(self._highest, float((cells.surface - cells.terrain).max()))
        self._lowest.write(window, cells.lowest[None])
        self._loose.write(window, cells.loose[None])
        carved = np.stack([np.maximum(cells.pressed - cells.lowest, 0.0), cells.loose])
        before = self._recorded.read(window)
        change = quantised(carved) - before.astype(np.int64)
        counts = (np.abs(change) >= least).any(axis=0)
        rows, columns = (np.flatnonzero(counts.any(axis=axis)) for axis in (1, 0))
        if not len(rows):
            return
        change *= counts
        part = Window(
            window.column + int(columns[0]), window.row + int(rows[0]), int(np.ptp(columns)) + 1, int(np.ptp(rows)) + 1
        )
        change = change[:, *window.slices(part)]
        step.recorder.add(frame, part, change, np.zeros(change.shape[1:], bool))
        self._recorded.write(part, self._recorded.read(part) + change)


def _change(footprint: Footprint, since: float, frame: float) -> Array | None:
    """How far a print raised the ground between two frames, (rows, columns) of its window [m]; None if nowhere."""
    raised, window = np.zeros(footprint.window.cells), footprint.window
    moves = False
    for changes, sign in ((footprint.compression, -1.0), (footprint.rim, 1.0)):
        first, last = np.searchsorted(changes.frames, (since + 1e-6, frame + 1e-6))
        part = slice(changes.first[first], changes.first[last])
        moves |= part.start < part.stop
        raised += sign * np.bincount(changes.cells[part], changes.amounts[part], window.cells)
    return (raised * QUANTUM).reshape(window.rows, window.columns) if moves else None
