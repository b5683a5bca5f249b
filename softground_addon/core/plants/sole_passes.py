"""What the soles of one step do to plants: passes over the cells that they tread on, and over those beside them."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ..ground.sparse_grid import Window
from ..numerics.arrays import Array
from ..record.footprints import Footprint
from .bending import Pass, lasting_of

Indices = NDArray[np.int64]

BESIDE = 0.05
"""How far beside a sole blades are pushed aside by the shoe [m]."""
BESIDE_BEND = 40.0 / 90.0
"""Bend of those right beside it, in right angles."""
SLOWEST = 0.5
"""Least speed at which a sole comes down on plants and leaves them [m/s]."""
ALONG_HEADING = 0.01
"""Travel along its heading that a sole has beside what it moves while it touches down [m]."""
LIFTED = 0.015
"""Height above its lowest from which on a piece of a sole has left a place [m]."""
MOVEMENT_STEPS = 2
"""Steps of a contact over which the sole's movement is taken."""
RIM, LEAST_CHANGE = 0.2, 2e-4
"""How far beside a sole litter moves with the ground, and from which change of its height on [m]."""
FRAME_RATE = 24.0
"""Of footprints that were edited, which do not know [1/s]."""

OF_PASS = tuple(field.name for field in fields(Pass))
COLUMNS = (*OF_PASS, "x", "y", "sink", "slope_x", "slope_y", "settled")
"""Of a pass: its own fields, the direction in which blades lean, the change of the ground's height and its slope, and
the frame from which on the ground does not change any more, about."""


def passes_of(step: Footprint, side: float) -> tuple[Indices, dict[str, Array]]:
    """Cells (N, 2) that a step acts on, and what it does to each."""
    window = Window.around(*step.window.corners(step.cell_size), side).expanded(int(np.ceil(BESIDE / side)))
    x, y = (values.ravel() for values in np.meshgrid(*step.window.centres(step.cell_size)))
    row, column = window.cells_under(x, y, side)
    coarse = row * window.columns + column

    touched = coarse[step.contact_cells]
    start, end = np.full(window.cells, np.inf), np.full(window.cells, -np.inf)
    np.minimum.at(start, touched, step.contact_start[:])
    np.maximum.at(end, touched, step.contact_end[:])
    change = (step.tile(step.rim) - step.tile(step.compression)).ravel()
    count = np.bincount(coarse, minlength=window.cells)
    sink = np.bincount(coarse, change, window.cells) / np.maximum(count, 1)
    shape = (window.rows, window.columns)
    slope_y, slope_x = (values.ravel() for values in np.gradient(sink.reshape(shape), side))

    under = np.flatnonzero(np.isfinite(start))
    centre = np.stack([values.ravel() for values in np.meshgrid(*window.centres(side))], axis=1)
    owner = _nearest(np.isfinite(start).reshape(shape), int(np.ceil(max(BESIDE, RIM) / side))).ravel()
    gap = np.linalg.norm(centre - centre[owner], axis=1) - 0.5 * side
    acted = (gap < BESIDE) | (np.abs(sink) > LEAST_CHANGE)
    others = np.flatnonzero(~np.isfinite(start) & (owner >= 0) & acted)
    gap = gap[others]

    movement = _movement(step, centre[under], start[under], end[under])
    outward = centre[others] - centre[owner[others]]
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    cell = np.concatenate([under, others])
    source = np.searchsorted(under, owner[cell])
    is_under = np.arange(len(cell)) < len(under)
    direction = np.concatenate([movement.along, outward])
    table = {
        "start": start[under][source],
        "end": movement.end[source],
        "down": movement.down[source],
        "up": movement.up[source],
        "reach": np.concatenate([np.ones(len(under)), BESIDE_BEND * np.clip(1.0 - gap / BESIDE, 0.0, 1.0)]),
        "lasting": is_under * lasting_of(step.peak_force_n / max(step.area_m2, side**2)),
        "passes": is_under.astype(float),
        "above": np.zeros(len(cell)),
        "x": direction[:, 0],
        "y": direction[:, 1],
        "sink": sink[cell],
        "slope_x": slope_x[cell],
        "slope_y": slope_y[cell],
        "settled": _settled(step, coarse, window.cells, start[under][source], cell),
    }
    row, column = np.divmod(cell, window.columns)
    return np.stack([column + window.column, row + window.row], axis=1).astype(np.int64), table


def _settled(step: Footprint, coarse: Indices, count: int, start: Array, cell: Indices) -> Array:
    """Frames (N,) to which the ground of cells changes evenly from `start`, so that half of the change is in time."""
    changes = step.compression, step.rim
    of_cell = coarse[np.concatenate([change.cells[:] for change in changes])]
    amount = np.abs(np.concatenate([change.amounts[:] for change in changes]))
    frame = np.concatenate([np.repeat(change.frames, np.diff(change.first)) for change in changes])
    weight = np.bincount(of_cell, amount, count)
    total = np.bincount(of_cell, amount * (frame - 0.5 * step.frame_step), count)
    mean = np.divide(total, weight, out=np.full(count, -np.inf), where=weight > 0)[cell]
    return np.maximum(2.0 * mean - start, start + step.frame_step)


def _nearest(marked: NDArray[np.bool_], rings: int) -> Indices:
    """Number of the marked cell that is nearest to each, about; -1 of cells that are further than some rings."""
    rows, columns = marked.shape
    number = np.arange(marked.size).reshape(rows, columns)
    row, column = np.mgrid[:rows, :columns]
    owner = np.where(marked, number, -1)
    best = np.where(marked, 0, np.iinfo(np.int64).max)
    for _ in range(rings):
        padded = np.pad(owner, 1, constant_values=-1)
        for down, right in ((i, j) for i in range(3) for j in range(3) if (i, j) != (1, 1)):
            other = padded[down : down + rows, right : right + columns]
            apart = (row - other // columns) ** 2 + (column - other % columns) ** 2
            nearer = (other >= 0) & (apart < best)
            owner, best = np.where(nearer, other, owner), np.where(nearer, apart, best)
    return owner


@dataclass(frozen=True)
class _Movement:
    """A sole over places: its travel, unit vectors (N, 2), speeds [m per frame] and the frames it stays to."""

    along: Array
    down: Array
    up: Array
    end: Array


def _movement(step: Footprint, place: Array, start: Array, end: Array) -> _Movement:
    """Movement of the sole over places (N, 2) that it touches from one frame to another, (N,) each.

    It stays until it has left the place by `LIFTED`: the arch of a foot hardly touches, and lies over plants too.
    """
    heading = np.array((np.cos(step.heading), np.sin(step.heading)))
    if step.pressed_by is None:  # of a print that was edited
        slow = np.full(len(place), SLOWEST / FRAME_RATE)
        return _Movement(np.tile(heading, (len(place), 1)), slow, slow, end)
    frames = np.asarray(step.load_frames)
    steps = step.pressed_by.steps(frames)
    poses, before = np.concatenate([steps.approach, steps.poses]), len(steps.approach)
    slowest, last, each = SLOWEST * step.pressed_by.time_step, len(poses) - 1, np.arange(len(place))
    came = before + np.clip(np.searchsorted(frames, start), 0, last - before)
    point = np.column_stack([place, np.full(len(place), step.position[2])])
    patch = _patch_over(step, poses, came, point)
    arrived, earlier = poses[came, patch], np.maximum(came - MOVEMENT_STEPS, 0)
    local = np.ones((len(place), 4))  # of what touches there, in its patch
    local[:, :3] = np.einsum("nji,nj->ni", arrived[:, :3, :3], point - arrived[:, :3, 3])
    way = point - np.einsum("nij,nj->ni", poses[earlier, patch], local)[:, :3]
    along = way[:, :2] + ALONG_HEADING * heading
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    down = np.maximum(-way[:, 2] / np.maximum(came - earlier, 1), slowest)
    height = np.empty((len(poses), len(place)))
    for number in range(poses.shape[1]):
        height[:, patch == number] = poses[:, number, 2] @ local[patch == number].T
    is_low = height <= height[before:].min(axis=0) + LIFTED
    leaves = last - is_low[::-1].argmax(axis=0)
    later, at = np.minimum(leaves + MOVEMENT_STEPS, last), np.minimum(leaves, np.maximum(last - 1, 0))
    rise = (height[later, each] - height[at, each]) / np.maximum(later - at, 1)
    stays = np.maximum(end, frames[np.maximum(leaves - before, 0)])
    return _Movement(along, down / step.load_spacing, np.maximum(rise, slowest) / step.load_spacing, stays)


def _patch_over(step: Footprint, poses: Array, at: Indices, point: Array) -> Indices:
    """Number of the sole's patch whose middle is nearest to each point at its time."""
    assert step.pressed_by is not None
    middles = np.zeros((poses.shape[1], 3))
    for number, patch in enumerate(step.pressed_by.pressing.sole.patches):
        middles[number, :2] = patch.origin + 0.5 * patch.spacing * (np.array(patch.heights.shape[::-1]) - 1)
    placed = np.einsum("npij,pj->npi", poses[at][..., :3, :3], middles) + poses[at][..., :3, 3]
    return np.linalg.norm(placed - point[:, None], axis=2).argmin(axis=1)
