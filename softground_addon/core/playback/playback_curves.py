"""KeyframeTables as curves over time, the form in which Blender's nodes sample them.

Between two points all is linear; where something jumps, two points share a frame. The pressure of a contact, which
the tables keep as its frames and its peak, becomes points too. Some thirty places lie end to end on one: fewer curves
are looked up faster. They are made part by part of the ground and packed, so that little takes memory everywhere at
once.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..ground.sparse_grid import SparseGrid, Window
from ..numerics.arrays import Array, Indices
from ..numerics.intervals import in_order
from ..numerics.packed import PackedArray
from ..numerics.slices import Slices, sliced
from ..record.footprints import Changes, Footprint
from ..relief.steps import NOTHING, StepRelief
from .blocks import ChangesInBlocks
from .keyframe_tables import NO_CONTACT, KeyframeTables, keyframe_tables
from .ramps import TOLERANCE
from .vertex_histories import Movements, VertexHistories, movements_at

Integers = NDArray[np.int32]
Floats = NDArray[np.float32]

LOADING = 0.2
"""Part of a contact over which the pressure rises, and again falls: about that of a walking step."""

NARROW = 2.0**-30
"""Scale of heights across a curve, so small that the length along it is the time to the last bit."""

LENGTH = 512.0
"""Length of a curve at which its last place begins [frames]: single precision resolves it to a `TICK`."""

TICK = 2.0**-14
"""Resolution of the time along a curve [frames]."""

CONTACTS_AT_ONCE = 20_000
"""Footprints' cells over places whose histories are computed together: some forty megabytes."""

CONTACTS_HELD = 400_000
"""Those up to which movements are held for the next curves: some sixty megabytes."""

SMALL = 1 << 19
"""Points of curves up to which they are not packed: eight megabytes."""

WIDER, LONGEST = 1.25, 192
"""Carves are worked out together while the box around them is hardly larger than all of theirs, over this many frames
at most."""
SAME = 1e-6
"""Frames nearer to each other than this are the same."""

PART = 1.0
"""Side of the squares by which places are put together [m]: as large as a few footprints."""


@dataclass(frozen=True)
class PlaybackCurves:
    """The state of places over time, as R points of S curves; the places of each lie end to end.

    Attributes
    ----------
    size : (S,) int array
        Points of each curve.
    position : (R, 3) packed float32 array
        Time along the curve [frames]; change of the displayed height, and displayed compression [m], both times
        `NARROW`.
    contact : (R,) packed float32 array
        While a contact lasts its pressure [Pa], after it minus the time since [s], before the first -`NO_CONTACT`.
    """

    size: Indices
    position: PackedArray[np.float32]
    contact: PackedArray[np.float32]


@dataclass(frozen=True)
class Spans:
    """Time spans of the changes at P places, and their position on the curves.

    Attributes
    ----------
    point : (P,) int array
        The places.
    start, end : (P,) float32 arrays
        First and last frame of each place: before, nothing has happened to it; after, all but the time since the
        contact stays as it is at the last, where nothing presses any more.
    curve : (P,) int32 array
        Curve that it lies on.
    offset : (P,) float32 array
        Its start on that curve [frames].
    last_height : (P,) float32 array
        Change of the displayed height at the last frame [m].
    last_contact : (P,) float32 array
        Last frame of the last contact; `keyframe_tables.NO_CONTACT` where there was none.
    frame_rate : float
        Frames per second [Hz].
    error : float
        Largest error of a displayed height, at any place and frame [m].
    """

    point: Indices
    start: Floats
    end: Floats
    curve: Integers
    offset: Floats
    last_height: Floats
    last_contact: Floats
    frame_rate: float
    error: float


@sliced
def playback_curves_at(
    footprints: Sequence[Footprint],
    x: Array,
    y: Array,
    *,
    blur_sigma: float,
    frame_rate: float,
    time_stretch: float = 1.0,
    tolerance: float = TOLERANCE,
    relief: Sequence[StepRelief] = (),
    known: list[Movements] | None = None,
) -> Slices[tuple[Spans, PlaybackCurves]]:
    """The record as curves at given places.

    Parameters
    ----------
    footprints, x, y, blur_sigma, tolerance
        See `vertex_histories.movements_at`.
    frame_rate : float
        Frames of the footprints per second [Hz].
    time_stretch : float
        Frames of the curves for each frame of the footprints.
    relief : sequence of StepRelief
        Of each footprint at the places, if there is any.
    known : list of Movements, optional
        Those of an earlier call of the same footprints and places, or an empty list that is filled.
    """
    groups = carves_together(footprints)
    relief = [_relief_of_all([relief[number] for number in group]) for group in groups] if relief else relief
    footprints = [_as_one([footprints[number] for number in group]) for group in groups]
    nowhere = np.zeros(0, dtype=np.intp)
    nothing = np.zeros(0, dtype=np.float32)
    sizes, count, error = [nowhere], 0, 0.0
    whole: dict[str, PackedArray[Any]] = {
        "point": PackedArray(nowhere),
        "curve": PackedArray(nowhere.astype(np.int32)),
        **{name: PackedArray(nothing) for name in ("start", "end", "offset", "last_height", "last_contact")},
    }
    position, contact = PackedArray(nothing.reshape(0, 3)), PackedArray(nothing)
    parts = _parts(footprints, x, y)
    in_blocks: dict[int, ChangesInBlocks] = {}
    holds = known is not None and len(parts) * CONTACTS_AT_ONCE <= CONTACTS_HELD
    held = known if known is not None and holds else []
    for number, (places, reliefs) in enumerate(zip(parts, _relief_of_parts(relief, parts, len(x)), strict=True)):
        if number < len(held):
            movements = held[number]
        else:
            movements = yield from movements_at.slices(
                footprints, x[places], y[places], blur_sigma=blur_sigma, tolerance=tolerance, in_blocks=in_blocks
            )
            if holds:
                held.append(movements)
        yield
        over_time = movements.with_relief(reliefs)
        is_small = len(position) < SMALL
        spans, lines = curves(over_time.stretched(time_stretch), frame_rate * time_stretch, is_small=is_small)
        part = replace(spans, point=places[spans.point], curve=spans.curve + np.int32(count))
        for name, packed in whole.items():
            packed.extend(PackedArray(getattr(part, name), is_small=is_small))
        position.extend(lines.position)
        contact.extend(lines.contact)
        sizes.append(lines.size)
        count += len(lines.size)
        error = max(error, spans.error)
        yield
    arrays: dict[str, NDArray[Any]] = {name: packed.unpacked() for name, packed in whole.items()}
    spans = Spans(**arrays, frame_rate=frame_rate * time_stretch, error=error)
    return spans, PlaybackCurves(np.concatenate(sizes), position, contact)


def carves_together(footprints: Sequence[Footprint]) -> list[list[int]]:
    """Numbers of the footprints, each alone but for carves that overlap: these move the same ground, to and fro."""
    groups, carves, around, cells = [], list[int](), Window(0, 0, 0, 0), 0
    for number, footprint in enumerate(footprints):
        window = footprint.window
        if len(footprint.contact_cells):
            groups.append([number])
        elif (
            carves
            and _goes_with(footprints[carves[0]], footprint)
            and (around.union(window).cells <= WIDER * (cells + window.cells))
        ):
            carves.append(number)
            around, cells = around.union(window), cells + window.cells
        else:
            carves, around, cells = [number], window, window.cells
            groups.append(carves)
    return groups


def _goes_with(first: Footprint, carve: Footprint) -> bool:
    """True if a carve is in the cells and at the frames of another, and not long after it."""
    frames = (carve.start_frame - first.start_frame) / first.frame_step
    alike = (first.cell_size, first.frame_step) == (carve.cell_size, carve.frame_step)
    return alike and abs(frames - round(frames)) < SAME and abs(frames) < LONGEST


def _as_one(carves: Sequence[Footprint]) -> Footprint:
    """The changes of some carves as those of one, for `ChangesInBlocks`: frame after frame of each."""
    if len(carves) == 1:
        return carves[0]
    windows = [carve.window for carve in carves]
    window = reduce(Window.union, windows)

    def joined(parts: Sequence[Changes]) -> Changes:
        cells = []
        for changes, part in zip(parts, windows, strict=True):
            row, column = np.divmod(changes.cells[:], part.columns)
            cells.append((row + part.row - window.row) * window.columns + column + part.column - window.column)
        counts = np.concatenate([np.diff(changes.first) for changes in parts])
        return Changes(
            np.concatenate([changes.frames for changes in parts]),
            np.concatenate([[0], np.cumsum(counts)]).astype(np.int32),
            np.concatenate(cells).astype(np.int32),
            np.concatenate([changes.amounts[:] for changes in parts]),
        )

    compression, rim = (joined([getattr(carve, name) for carve in carves]) for name in ("compression", "rim"))
    return replace(carves[0], window=window, compression=compression, rim=rim)


def _relief_of_all(steps: Sequence[StepRelief]) -> StepRelief:
    """The sum of relief."""
    if len(steps) == 1:
        return steps[0]
    point, place = np.unique(np.concatenate([step.point for step in steps]), return_inverse=True)
    change = np.zeros((len(point), 2))
    np.add.at(change, place, np.concatenate([step.change for step in steps]))
    return StepRelief(point, change, np.zeros(len(point)), plates=sum((step.plates for step in steps), ()))


def _parts(footprints: Sequence[Footprint], x: Array, y: Array) -> list[Indices]:
    """Places (K,) in parts that lie together, of which each takes about as much to work out."""
    order = in_order(np.floor(y / PART), np.floor(x / PART))
    contacts = SparseGrid(footprints[0].cell_size if footprints else PART, channels=1)
    for footprint in footprints:
        contacts.write(footprint.window, contacts.read(footprint.window) + 1)
    so_far = np.cumsum(contacts.nearest(x[order], y[order])[0])
    return np.split(order, np.flatnonzero(np.diff(so_far // CONTACTS_AT_ONCE)) + 1)


def _relief_of_parts(
    relief: Sequence[StepRelief], parts: Sequence[Indices], places: int
) -> Iterator[Sequence[StepRelief]]:
    """The relief of all steps at the places of each part, nothing where there is none."""
    part_of, within = np.empty(places, dtype=np.intp), np.empty(places, dtype=np.intp)
    for number, part in enumerate(parts):
        part_of[part], within[part] = number, np.arange(len(part))
    reached: list[list[tuple[int, StepRelief]]] = [[] for _ in parts]
    for step_number, step in enumerate(relief):
        points = np.concatenate([step.point, *(plates.point for plates in step.plates)])
        for number in np.unique(part_of[points]).tolist():
            reached[number].append((step_number, step))
    for number in range(len(parts)):
        reliefs = [NOTHING] * len(relief)
        for step_number, step in reached[number]:
            in_part = part_of[step.point] == number
            plates = tuple(each.at(part_of[each.point] == number, within) for each in step.plates)
            reliefs[step_number] = replace(
                step,
                point=within[step.point[in_part]],
                change=step.change[in_part],
                water=step.water[in_part],
                plates=plates,
            )
        yield reliefs


def curves(over_time: VertexHistories, frame_rate: float, *, is_small: bool = False) -> tuple[Spans, PlaybackCurves]:
    """The vertex histories as curves; frames per second give the time since a contact. `is_small` as of `PackedArray`.

    Examples
    --------
    A contact from frame 2 to 12 on ground that does not move:

    >>> from softground_addon.core.playback.vertex_histories import PointContacts
    >>> from softground_addon.core.playback.ramps import Ramps
    >>> contacts = PointContacts(np.array([7]), np.array([2.0]), np.array([12.0]), np.array([5e4]))
    >>> spans, lines = curves(VertexHistories(Ramps.joined([], 2), contacts, 0.0), 24.0)
    >>> spans.start.tolist(), lines.position.unpacked()[:, 0].tolist(), lines.contact.unpacked().tolist()
    ([2.0], [0.0, 2.0, 8.0, 10.0], [0.0, 50000.0, 50000.0, 0.0])
    """
    table = keyframe_tables(over_time)
    place = np.repeat(np.arange(len(table.point)), np.diff(table.first))
    row, frame = _with_turns(table, place)
    jumps = table.frame == table.contact_start
    jumps[table.first[:-1]] = False
    jump = np.flatnonzero(jumps)
    # A point on either side of each jump: that before belongs to the contact of the row before.
    rows = np.concatenate([jump - 1, row])
    when = np.concatenate([table.frame[jump], frame])
    order = in_order(place[rows], when)
    rows, when = rows[order], when[order]
    size = np.bincount(place[rows], minlength=len(table.point))
    last = table.first[1:] - 1
    start, end = table.frame[table.first[:-1]], table.frame[last]
    curve, offset = _end_to_end(end - start)
    position = np.empty((len(rows), 3), dtype=np.float32)
    position[:, 0] = np.round((when + np.repeat(offset - start, size)) / TICK) * TICK
    position[:, 1:] = _movement(table, rows, when) * NARROW
    spans = Spans(
        point=table.point,
        start=start.astype(np.float32),
        end=end.astype(np.float32),
        curve=curve.astype(np.int32),
        offset=offset.astype(np.float32),
        last_height=table.movement[last, 0].astype(np.float32),
        last_contact=table.contact_end[last].astype(np.float32),
        frame_rate=frame_rate,
        error=over_time.error,
    )
    sizes = np.bincount(curve, size).astype(np.intp)
    contact = _contact(table, rows, when, frame_rate)
    return spans, PlaybackCurves(sizes, *(PackedArray(values, is_small=is_small) for values in (position, contact)))


def _end_to_end(length: Array) -> tuple[Indices, Array]:
    """Curve of each place if their lengths are laid end to end, and the start of each on it [frames].

    The gap behind each is at least a frame. PlaybackCurves begin no place beyond `LENGTH`.
    """
    begin = np.cumsum(np.ceil(length) + 1.0) - np.ceil(length) - 1.0
    _, first, curve = np.unique(begin // LENGTH, return_index=True, return_inverse=True)
    return curve, begin - begin[first[curve]]


def _with_turns(table: KeyframeTables, place: Indices) -> tuple[Indices, Array]:
    """The rows and frames of all points but those before jumps: the table's own, and where the pressure turns."""
    contact = np.flatnonzero((table.frame == table.contact_start) & (table.contact_end > table.contact_start))
    length = table.contact_end[contact] - table.contact_start[contact]
    turns = [table.contact_start[contact] + part * length for part in (LOADING, 1.0 - LOADING)]
    rows = np.arange(len(place))
    when = np.concatenate([table.frame, *turns])
    source = np.concatenate([rows, contact, contact])
    order = in_order(place[source], when)
    row = np.maximum.accumulate(np.where(order < len(rows), order, -1))
    # A turn counts while its contact is the latest, and where there is no row already.
    current = (order < len(rows)) | (
        (table.contact_start[row] == table.contact_start[source[order]]) & (table.frame[row] < when[order])
    )
    return row[current], when[order][current]


def _movement(table: KeyframeTables, row: Indices, frame: Array) -> Array:
    """Height and compression at given frames, each between a row and the next, (N, 2)."""
    following = np.minimum(row + 1, max(len(table.frame) - 1, 0))
    run = table.frame[following] - table.frame[row]
    since = frame - table.frame[row]
    share = np.divide(since, run, out=np.zeros(len(row)), where=since > 0)[:, None]
    moved: Array = table.movement[row] + share * (table.movement[following] - table.movement[row])
    return moved


def _contact(table: KeyframeTables, row: Indices, frame: Array, frame_rate: float) -> Floats:
    """See `PlaybackCurves.contact`, at given frames, each between a row and the next, (N,)."""
    begin, end = table.contact_start[row], table.contact_end[row]
    passed = np.divide(frame - begin, end - begin, out=np.zeros(len(row)), where=end > begin)
    pressure = np.clip(np.minimum(passed, 1.0 - passed) / LOADING, 0.0, 1.0) * table.pressure[row]
    contact = np.where(frame < end, pressure, (end - frame) / frame_rate)
    return np.where(begin < NO_CONTACT, contact, -NO_CONTACT).astype(np.float32)
