"""History of each place of the ground during a bake: the record of footprints as ramps and contacts.

Footprints add up and the display blur is linear, so that each footprint is looked at alone, where and while it moves
the ground. Time and memory follow the number of footprints, not the length of the shot or the size of the ground.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..ground.display_blur import blurred_inside, gaussian_kernel
from ..ground.places import Places
from ..ground.sparse_grid import Window
from ..numerics import bilinear
from ..numerics.arrays import Array, Indices, Mask
from ..numerics.slices import Slices, sliced
from ..record.footprints import Footprint
from ..relief.steps import NOTHING, StepRelief
from .blocks import BLOCK, ChangesInBlocks
from .ramps import TOLERANCE, Ramps, fit, grown, joined, side_by_side

SHADING_TOLERANCE = 1e-3
"""Largest error of the compression that materials read, while it grows [m]."""

ROOM = 500_000
"""Changes of the footprints near places up to which they are not packed: six megabytes."""

_NO_RAMPS = Ramps.joined([], 2)

CARVED_TOLERANCE = 5e-3
"""Largest error of ground that bodies carve, while it moves [m]: loose matter that slides to and fro has no edge."""


@dataclass(frozen=True)
class PointContacts:
    """Contacts of soles with places, and their pressure.

    Attributes
    ----------
    point : (N,) int array
        Place of each contact, ascending; each place's contacts are in the order of their start.
    start, end : (N,) float arrays
        First and last scene frame of the contact.
    pressure : (N,) float array
        Largest mean pressure under the sole during the contact [Pa].
    """

    point: Indices
    start: Array
    end: Array
    pressure: Array


@dataclass(frozen=True)
class VertexHistories:
    """The ground over time at K places.

    Attributes
    ----------
    movement : Ramps
        Change of the displayed height, and displayed compression, this to `SHADING_TOLERANCE` [m]; the rim is the sum
        of both.
    error : float
        Largest error of a displayed height, at any place and frame [m].
    """

    movement: Ramps
    contacts: PointContacts
    error: float

    def stretched(self, factor: float) -> VertexHistories:
        """The same on a clock that counts `factor` frames where this one counts 1."""
        ramps, contacts = self.movement, self.contacts
        return VertexHistories(
            replace(ramps, start=factor * ramps.start, end=factor * ramps.end),
            replace(contacts, start=factor * contacts.start, end=factor * contacts.end),
            self.error,
        )


@dataclass(frozen=True)
class Movements:
    """Vertex histories without relief, footprint by footprint.

    Attributes
    ----------
    of_footprints : list of (int, (float, float), Ramps)
        Number of each footprint near the places, the frames between which it moves the ground, and its ramps.
    """

    of_footprints: list[tuple[int, tuple[float, float], Ramps]]
    contacts: PointContacts
    error: float

    def with_relief(self, relief: Sequence[StepRelief]) -> VertexHistories:
        """The vertex histories; relief of each footprint, if there is any, grows with the movement of its step.

        Plates of a crust move as it breaks, also where the step itself moves nothing.
        """
        movements = []
        for number, span, ramps in self.of_footprints:
            its = relief[number] if relief else NOTHING
            movements.append(grown(ramps, its.point, its.change, span) if len(its.point) else ramps)
        for plates in (plates for step in relief for plates in step.plates):
            begin, end = (np.full(len(plates.point), frame) for frame in plates.frames)
            movements.append(Ramps(plates.point, begin, end, plates.change))
        return VertexHistories(Ramps.joined(movements, 2), self.contacts, self.error)


@sliced
def vertex_histories(
    footprints: Sequence[Footprint], x: Array, y: Array, *, blur_sigma: float, relief: Sequence[StepRelief] = ()
) -> Slices[VertexHistories]:
    """The record as it is seen from given places: `movements_at` these, with the relief of each footprint there."""
    return (yield from movements_at.slices(footprints, x, y, blur_sigma=blur_sigma)).with_relief(relief)


@sliced
def movements_at(
    footprints: Sequence[Footprint],
    x: Array,
    y: Array,
    *,
    blur_sigma: float,
    tolerance: float = TOLERANCE,
    in_blocks: dict[int, ChangesInBlocks] | None = None,
) -> Slices[Movements]:
    """The record as it is seen from given places, without relief.

    Parameters
    ----------
    x, y : (K,) float arrays
        World positions [m].
    blur_sigma : float
        Standard deviation of the display blur [m].
    tolerance : float
        Largest error of a displayed height while it moves [m]; where footprints move the same ground at the same
        time, they share it.
    in_blocks : dict, optional
        Cache of the footprints near the places, by their numbers, for the next call at places beside them.
    """
    in_blocks = {} if in_blocks is None else in_blocks
    places = Places(x, y)
    kernels = {size: gaussian_kernel(blur_sigma / size) for size in {footprint.cell_size for footprint in footprints}}
    near = _near(footprints, places, kernels)
    for number in in_blocks.keys() - set(near):
        del in_blocks[number]
    of_near = [changes for number in near for changes in (footprints[number].compression, footprints[number].rim)]
    is_small = sum(int(changes.first[-1]) for changes in of_near) < ROOM
    for number in near:
        in_blocks.setdefault(number, ChangesInBlocks(footprints[number], is_small=is_small))
    footprints = [footprints[number] for number in near]
    spans = np.array([_span(footprint) for footprint in footprints]).reshape(-1, 2)
    reach = [footprint.window.expanded(_margin(kernels[footprint.cell_size])) for footprint in footprints]
    movements: list[tuple[int, tuple[float, float], Ramps]] = []
    contacts = [PointContacts(np.zeros(0, dtype=np.intp), *np.zeros((3, 0)))]
    error = 0.0
    is_carved = np.array([not len(footprint.contact_cells) for footprint in footprints], dtype=bool)
    moving = [_moving(in_blocks[number], window) for number, window in zip(near, reach, strict=True)]
    for number, footprint in enumerate(footprints):
        of_step = [_NO_RAMPS]
        alike = is_carved == is_carved[number]
        together = np.flatnonzero(alike & (spans[:, 0] < spans[number, 1]) & (spans[number, 0] < spans[:, 1]))
        allowed = np.array([tolerance, SHADING_TOLERANCE])
        if is_carved[number]:
            allowed = np.maximum(allowed, CARVED_TOLERANCE)
        of_blocks = _movements(in_blocks[near[number]], places, kernels[footprint.cell_size], moving[number])
        for points, frames, moved in of_blocks:
            shared = np.zeros(len(points))
            for other in together:
                shared += _reached(reach[other], moving[other], footprints[other].cell_size, x[points], y[points])
            margin = allowed / np.maximum(shared, 1.0)[:, None]
            # Of carves, half of the tolerance is for their ends.
            fitted = fit(frames, moved, *([margin / 2] * 2 if is_carved[number] else [margin]))
            of_step.append(replace(fitted.ramps, point=points[fitted.ramps.point]))
            error = max(error, float((fitted.error[:, 0] * shared).max(initial=0.0)))
            yield
        movements.append((near[number], (spans[number, 0], spans[number, 1]), side_by_side(of_step)))
        contacts.append(_point_contacts(footprint, places))
        yield
    return Movements(movements, joined(contacts), error)


def _moving(in_blocks: ChangesInBlocks, reach: Window) -> Mask:
    """Cells of its reach (rows, columns) near which a footprint moves the ground: within the reach's margin."""
    window = in_blocks.footprint.window
    moving = np.zeros((reach.rows, reach.columns), dtype=bool)
    moving[reach.slices(window)] = in_blocks.changed
    for along in (moving, moving.T):
        for _ in range(window.row - reach.row):
            before = along.copy()
            along[1:] |= before[:-1]
            along[:-1] |= before[1:]
    return moving


def _reached(reach: Window, moving: Mask, cell_size: float, x: Array, y: Array) -> Mask:
    """True at places (N,) that a footprint moves: those in the moving cells of its reach."""
    column, row = np.floor(np.stack([x, y]) / cell_size).astype(np.intp)
    return reach.holds(row, column) & moving[reach.cells_under(x, y, cell_size)]


def _near(footprints: Sequence[Footprint], places: Places, kernels: Mapping[float, Array]) -> list[int]:
    """Numbers of the footprints that may reach some of the places."""
    if not len(places.x) or not footprints:
        return []
    margin = {size: _margin(kernel) for size, kernel in kernels.items()}
    windows = [(footprint.window, footprint.cell_size) for footprint in footprints]
    first = np.array([(window.column, window.row) for window, _ in windows])
    cells = np.array([(window.columns, window.rows) for window, _ in windows])
    size, reach = np.array([(size, margin[size]) for _, size in windows]).T[..., None]
    low, high = (np.array([bound(places.x), bound(places.y)]) for bound in (np.min, np.max))
    near = ((first - reach) * size <= high) & ((first + cells + reach) * size >= low)
    return [int(number) for number in np.flatnonzero(near.all(axis=1))]


def _margin(kernel: Array) -> int:
    """Cells around a change that the display moves: the blur's, and one for the look-up between cell centres."""
    return len(kernel) // 2 + 1


def _span(footprint: Footprint) -> tuple[float, float]:
    """Frames between which a footprint moves the ground."""
    frames = np.concatenate([footprint.compression.frames, footprint.rim.frames])
    if not len(frames):
        return footprint.start_frame, footprint.start_frame
    return float(frames.min()) - footprint.frame_step, float(frames.max())


def _movements(
    in_blocks: ChangesInBlocks, places: Places, kernel: Array, moving: Mask
) -> Iterator[tuple[Indices, Array, Array]]:
    """Displayed height and compression of the places that a footprint moves, block by block; see `_reached`.

    Yields
    ------
    points : (N,) int array
    frames : (T,) float array
        From the frame before the first movement.
    moved : (T, N, 2) float array
        Change of height, and compression, by this footprint alone [m]; 0 at the first frame.
    """
    footprint = in_blocks.footprint
    reach = footprint.window.expanded(_margin(kernel))
    for part in _blocks(reach):
        points = places.within(part, footprint.cell_size)
        points = points[_reached(reach, moving, footprint.cell_size, places.x[points], places.y[points])]
        if not len(points):
            continue
        block = places.window(points, footprint.cell_size)
        frames, changes = in_blocks.within(block.expanded(_margin(kernel)))
        if not len(frames):
            continue
        blurred = blurred_inside(changes, kernel)
        grown = np.zeros((len(frames) + 1, 2, len(points)))
        grown[1:] = _look_up(blurred, block.expanded(1), footprint.cell_size, places, points)
        for before, after in pairwise(grown):  # faster than a cumulative sum over points side by side
            np.add(before, after, out=after)
        grown[:, 1] -= grown[:, 0]
        yield points, np.append(frames[0] - footprint.frame_step, frames), grown[:, ::-1].swapaxes(1, 2)


def _blocks(window: Window) -> Iterator[Window]:
    """A window in parts of at most `BLOCK` cells along each side."""
    for row in range(0, window.rows, BLOCK):
        for column in range(0, window.columns, BLOCK):
            yield Window(
                window.column + column,
                window.row + row,
                min(BLOCK, window.columns - column),
                min(BLOCK, window.rows - row),
            )


def _look_up(values: Array, window: Window, cell_size: float, places: Places, points: Indices) -> Array:
    """Values (T, channels, rows, columns) of a window at places, bilinear between cell centres: (T, channels, N)."""
    column = places.x[points] / cell_size - 0.5 - window.column
    row = places.y[points] / cell_size - 0.5 - window.row
    first, low = np.floor(column).astype(np.intp), np.floor(row).astype(np.intp)
    u, v = column - first, row - low
    flat = values.reshape(*values.shape[:2], -1)
    corner = low * window.columns + first
    above = corner + window.columns
    return bilinear.between((flat[..., at] for at in (corner, corner + 1, above, above + 1)), u, v)


def _point_contacts(footprint: Footprint, places: Places) -> PointContacts:
    """Contacts of a footprint with the places in its cells."""
    window = footprint.window
    points = places.within(window, footprint.cell_size)
    column = np.floor(places.x[points] / footprint.cell_size).astype(np.intp) - window.column
    row = np.floor(places.y[points] / footprint.cell_size).astype(np.intp) - window.row
    contact = np.full(window.cells, -1, dtype=np.intp)
    contact[footprint.contact_cells] = np.arange(len(footprint.contact_cells))
    touched = contact[row * window.columns + column]
    points, touched = points[touched >= 0], touched[touched >= 0]
    pressure = np.full(len(points), footprint.peak_force_n / footprint.area_m2 if footprint.area_m2 > 0 else 0.0)
    start, end = footprint.contact_start[touched], footprint.contact_end[touched]
    return PointContacts(points, start, end, pressure)
