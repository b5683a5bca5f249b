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
from math import ceil, floor

import numpy as np
from numpy.typing import NDArray

from ..ground.deep_ground import wading
from ..ground.hard_ground import bare
from ..ground.heightfield import TerrainTiles
from ..ground.soft_ground import SoftGround
from ..ground.sparse_grid import TILE, SampledGrid, Window
from ..ground.surfaces import find
from ..ground.variation import VariationTiles
from ..legs.grounding import Response
from ..motion.motion import CharacterMotion
from ..numerics.interpolation import cubic
from ..numerics.slices import Slices, sliced
from ..record.footprints import QUANTUM, Changes, Footprint, FootprintRecorder, quantised
from ..record.record import BakeRecord
from ..soles.undersides import lowest_surface
from .carver import REACH, CarvedCells, Walls
from .responded_skin import NO_SOLE, RespondedSkin, WornSkin

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Indices = NDArray[np.intp]

POSES_ALONG_SOLE = 14
"""Nothing in the ground moves further from one pose to the next than this part of a sole, or a cell: 2 cm, from which
the outline of a shank has scallops of a millimetre."""
MOST_POSES = 32
"""Most poses of a body in a frame."""
SLIDES_EVERY, SWEEPS = 1 / 8, 8
"""Loose matter slides after every so many seconds in so many sweeps (`repose.slid`); the rest goes on in the next."""
SETTLING, SWEEPS_TO_SETTLE = 0.2, 96
"""It comes to rest once the leg is on its way to its next step, within this time [s], in at most so many sweeps."""
LEAST = round(3e-3 / QUANTUM)
"""Changes of a cell are recorded once they come to so much, and all of them at the end [QUANTUM]: 3 mm."""
THINNEST = 2e-3
"""Loose matter that comes to rest is gathered where it is thinner [m]."""
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
        window, raised = self.footprint.window, None
        for changes, cells, amounts in self._changes:
            first, last = np.searchsorted(changes.frames, (since + 1e-6, frame + 1e-6))
            part = slice(changes.first[first], changes.first[last])
            if part.start < part.stop:
                more = np.bincount(cells[part], amounts[part], window.cells)
                raised = more if raised is None else raised + more
        return None if raised is None else raised.reshape(window.rows, window.columns)

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
    frames = skins[0][2].frames
    carving = _Carving(ground, walls, some.cell_size, list(steps.values()), skins[0][2].frame_rate)
    bodies = [_Body(name, soles, skin, list(steps.values())) for name, soles, skin in skins]
    carving.press(-np.inf, float(frames[0]))
    for number, (since, frame) in enumerate(pairwise(frames.tolist()), start=1):
        yield
        carving.press(since, frame)
        for body in bodies:
            around = next(body.poses)
            for step, left, triangles in body.parts(number):
                if left is not None:
                    carving.settle(left, frame, float(frames[-1]))
                if step.is_deep:
                    carving.carve(step, around, triangles, frame)
    for step in steps.values():
        yield
        carving.settle(step, float(frames[-1]), float(frames[-1]))
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

    def __init__(self, ground: SoftGround, walls: Walls, cell_size: float, steps: Sequence[_Step], rate: float) -> None:
        self._walls, self._cell_size = walls, cell_size
        self._coming = sorted(steps, key=lambda step: step.begins, reverse=True)
        self._pressing: list[_Step] = []
        """Steps whose prints are changing."""
        self._slides_every, self._settling = (max(1, round(time * rate)) for time in (SLIDES_EVERY, SETTLING))
        self._undisturbed = TerrainTiles(bare(ground.terrain), cell_size)
        self._highest = 0.0
        """Highest surface over the undisturbed ground so far [m]."""
        self._layer_depth = ground.material.layer_depth
        self._variation = VariationTiles(ground.variation, cell_size) if ground.variation else None
        self._cells = SampledGrid(self._untouched, cell_size, channels=8)
        """Terrain, its openness, the layer's floor, T, K, loose matter; what is recorded of the cut and of this."""
        self._contacts: list[tuple[Window, Mask]] = []

    def _untouched(self, x: Array, y: Array) -> Array:
        """The channels of a tile, from its cell centres."""
        window = Window(floor(x[0, 0] / self._cell_size), floor(y[0, 0] / self._cell_size), TILE, TILE)
        surface = self._undisturbed.surface(window)
        terrain, nothing = np.nan_to_num(surface.heights), np.zeros(x.shape)
        depth = self._layer_depth * (self._variation.factors(window).depth if self._variation else 1.0)
        bottom = terrain - depth
        return np.stack([terrain, surface.bears, bottom, terrain, nothing + np.inf, nothing, nothing, nothing])

    def press(self, since: float, frame: float) -> None:
        """Go on to the ground as soles have pressed it by a frame; what is loose under them is packed."""
        while self._coming and self._coming[-1].begins <= frame:
            self._pressing.append(self._coming.pop())
        self._contacts = [(step.footprint.window, step.touches(since, frame)) for step in self._pressing]
        for step, (window, touching) in zip(self._pressing, self._contacts, strict=True):
            change = step.change(since, frame)
            if change is None and not touching.any():
                continue
            cells, channels = self._read(window)
            if change is not None:
                cells.press(cells.pressed + change)
            cells.pack()
            self._write(step, window, cells, channels, frame, LEAST)
        self._pressing = [step for step in self._pressing if step.ends > frame or step.release()]

    def carve(self, step: _Step, around: Array, triangles: Indices, frame: float) -> None:
        """Cut the ground to a part of a body over the frame before, from its vertices (4, V, 3) around that span."""
        if not np.isfinite(around).all():
            return
        both = around[1:3]
        box = Window.around(both[..., :2].min(axis=(0, 1)), both[..., :2].max(axis=(0, 1)), self._cell_size)
        terrain = self._undisturbed.heights(box)
        over = both[..., 2] - terrain[box.cells_under(both[..., 0], both[..., 1], self._cell_size)]
        low = (over < self._highest).any(axis=0)
        triangles = triangles[low[triangles].any(axis=1)]
        if not len(triangles):
            return
        used, triangles = np.unique(triangles, return_inverse=True)
        around, low = around[:, used], low[used]
        before, after = around[1:3]
        way = (after - before)[low]
        distance = np.linalg.norm(way, axis=1)
        poses = ceil(min(max(distance.max() / step.spacing, 1.0), MOST_POSES))
        places = cubic(around, 1.0 + np.arange(1, poses + 1) / poses)
        margin = ceil(2 * REACH / self._cell_size) + 2
        flat = places[..., :2].reshape(-1, 2)
        window = Window.around(flat.min(axis=0), flat.max(axis=0), self._cell_size).expanded(margin)
        cells, channels = self._read(window)
        numbers = triangles.reshape(-1, 3) + len(used) * np.arange(poses)[:, None, None]
        origin = (np.array((window.column, window.row)) + 0.5) * self._cell_size
        shape = window.rows, window.columns
        underside = lowest_surface(places.reshape(-1, 3), numbers.reshape(-1, 3), origin, shape, self._cell_size)
        underside = np.maximum(underside, channels[2])
        cells.cut(underside, way[distance.argmax(), :2], self._walls.packing)
        if round(frame) % self._slides_every == 0:
            body = underside < cells.surface + self._cell_size
            cells.slide(self._walls, body, (window.row, window.column), SWEEPS)
        self._write(step, window, cells, channels, frame, LEAST)

    def settle(self, step: _Step, frame: float, last: float) -> None:
        """Let what a step has carved come to rest, and record all of it; nothing happens where it has."""
        if step.at_rest or not step.recorder.frames:
            return
        window = step.recorder.window
        cells, _ = self._read(window)
        window = window.expanded(self._walls.reach(cells.surface, cells.loose, self._cell_size))
        cells, channels = self._read(window)
        cells.slide(self._walls, np.zeros_like(cells.closed), (window.row, window.column), SWEEPS_TO_SETTLE)
        cells.gather(channels[7] * QUANTUM, THINNEST)
        self._write(step, window, cells, channels, frame, 1, max(1, min(self._settling, round(last - frame) + 1)))

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

    def _read(self, window: Window) -> tuple[CarvedCells, Array]:
        """The cells of a window, and their channels."""
        channels = self._cells.read(window)
        contact = np.zeros((window.rows, window.columns), dtype=bool)
        for around, touching in self._contacts:
            if (shared := around.intersection(window)) is not None:
                contact[window.slices(shared)] |= touching[around.slices(shared)]
        terrain, bears, _, pressed, lowest, loose, _, _ = channels
        return CarvedCells(self._cell_size, terrain, bears == 0, contact, pressed, lowest, loose), channels

    def _write(
        self, step: _Step, window: Window, cells: CarvedCells, channels: Array, frame: float, least: int, frames: int = 1
    ) -> None:
        """Write cells back, and record over some frames what of their changes comes to the least [QUANTUM]."""
        step.at_rest = least == 1
        step.cut += cells.cut_height
        step.packed += cells.packed
        step.unplaced += cells.unplaced
        self._highest = max(self._highest, float((cells.surface - cells.terrain).max()))
        carved = np.stack([np.maximum(cells.pressed - cells.lowest, 0.0), cells.loose])
        change = quantised(carved) - channels[6:].astype(np.int64)
        counts = (np.abs(change) >= least).any(axis=0)
        change *= counts
        channels[3:6] = cells.pressed, cells.lowest, cells.loose
        channels[6:] += change
        self._cells.write(window, channels)
        rows, columns = (np.flatnonzero(counts.any(axis=axis)) for axis in (1, 0))
        if not len(rows):
            return
        part = Window(
            window.column + int(columns[0]), window.row + int(rows[0]), int(np.ptp(columns)) + 1, int(np.ptp(rows)) + 1
        )
        change = change[:, *window.slices(part)]
        for number in range(frames):
            share = change * (number + 1) // frames - change * number // frames
            step.recorder.add(frame + number, part, share, np.zeros(change.shape[1:], bool))
