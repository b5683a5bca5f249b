"""The carve of a step that the artist moved, turned, scaled or shifted in time: what a leg cut goes with the print."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..ground.sparse_grid import Window
from ..numerics import bilinear
from ..numerics.arrays import Array
from .edits import StepEdit
from .footprints import Changes, Footprint


def placement(edit: StepEdit) -> StepEdit:
    """What an edit does to a carve: where and when it is, and how large."""
    return StepEdit(move_m=edit.move_m, turn_deg=edit.turn_deg, scale=edit.scale, shift_frames=edit.shift_frames)


def moved_carve(carve: Footprint, pivot: Array, before: StepEdit, now: StepEdit) -> Footprint:
    """A carve where its step is now; its volumes follow the square of the scale.

    Cells are looked up between those of the bake, so that floors stay level, and all of it is made as much as that was.

    Parameters
    ----------
    carve : Footprint
        As it was baked.
    pivot : (3,) float array
        Position of the step without edits [m].
    before, now : StepEdit
        Edit of the step when it was carved, and now.
    """
    shift, before, now = now.shift_frames - before.shift_frames, placement(before), placement(now)
    if replace(before, shift_frames=0) != replace(now, shift_frames=0):
        carve = _placed(carve, pivot[:2], before, now)
    return shifted(carve, shift) if shift else carve


def shifted(footprint: Footprint, frames: float) -> Footprint:
    """A footprint so many frames later."""
    compression, rim = (replace(each, frames=each.frames + frames) for each in (footprint.compression, footprint.rim))
    return replace(
        footprint,
        start_frame=footprint.start_frame + frames,
        end_frame=footprint.end_frame + frames,
        load_frames=footprint.load_frames + frames,
        contact_start=footprint.contact_start[:] + frames,
        contact_end=footprint.contact_end[:] + frames,
        compression=compression,
        rim=rim,
    )


def _placed(carve: Footprint, pivot: Array, before: StepEdit, now: StepEdit) -> Footprint:
    cell, scale = carve.cell_size, now.scale / before.scale
    turn = np.radians(now.turn_deg - before.turn_deg)
    ahead = scale * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    origin, target = pivot + before.move_m, pivot + now.move_m
    low, high = carve.window.expanded(1).corners(cell)
    corners = np.array([(x, y) for x in (low[0], high[0]) for y in (low[1], high[1])])
    placed = target + (corners - origin) @ ahead.T
    window = Window.around(placed.min(axis=0), placed.max(axis=0), cell)
    places = np.stack(np.meshgrid(*window.centres(cell)), axis=-1).reshape(-1, 2)
    source = origin + (places - target) @ np.linalg.inv(ahead).T
    compression, rim = (_looked_up(carve, changes, source, scale**2) for changes in (carve.compression, carve.rim))
    position = carve.position.copy()
    position[:2] = target + ahead @ (position[:2] - origin)
    return replace(
        carve,
        window=window,
        position=position,
        heading=carve.heading + turn,
        compression=compression,
        rim=rim,
        compressed_m3=carve.compressed_m3 * scale**2,
        rim_m3=carve.rim_m3 * scale**2,
        unplaced_rim_m3=carve.unplaced_rim_m3 * scale**2,
    )


def _looked_up(carve: Footprint, changes: Changes, source: Array, larger: float) -> Changes:
    """Changes at cells of which each shows a place (N, 2) [m] of the carve as it was baked."""
    around = carve.window.expanded(1)
    column, row = (source / carve.cell_size - 0.5 - (around.column, around.row)).T
    left, low = np.floor(column).astype(np.intp), np.floor(row).astype(np.intp)
    inside = np.flatnonzero((left >= 0) & (low >= 0) & (left < around.columns - 1) & (low < around.rows - 1))
    u, v = (column - left)[inside], (row - low)[inside]
    first = (low * around.columns + left)[inside]
    corners = [first, first + 1, first + around.columns, first + around.columns + 1]
    cells, amounts = changes.cells, changes.amounts
    down, across = np.divmod(cells, carve.window.columns)
    cells = (down + 1) * around.columns + across + 1
    total = np.bincount(cells, amounts, around.cells)
    whole = bilinear.between((total[at] for at in corners), u, v).sum()
    more = larger * total.sum() / whole if whole else 1.0
    so_far, before = np.zeros(around.cells), np.zeros(len(inside))
    frames, where, by = [], [], []
    for number, frame in enumerate(changes.frames.tolist()):
        part = slice(changes.first[number], changes.first[number + 1])
        so_far += np.bincount(cells[part], amounts[part], around.cells)
        after = np.rint(more * bilinear.between((so_far[at] for at in corners), u, v))
        changed = np.flatnonzero(after != before)
        if len(changed):
            frames.append(frame)
            where.append(inside[changed].astype(np.int32))
            by.append((after - before)[changed].astype(np.int32))
        before = after
    counts = np.cumsum([0, *map(len, where)]).astype(np.int32)
    nothing = np.zeros(0, np.int32)
    return Changes(np.array(frames), counts, np.concatenate([nothing, *where]), np.concatenate([nothing, *by]))
