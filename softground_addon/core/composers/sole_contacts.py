"""Contacts of feet as the ground feels them, whatever it is made of: their area at any sinkage, and what they cover."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import ceil

import numpy as np
from numpy.typing import NDArray

from ..ground.heightfield import Surface
from ..ground.variation import Factors
from ..loads.cell_limits import pressed_area
from ..loads.estimate import CharacterLoads
from ..loads.tracks import tracks
from ..motion.motion import Sole
from ..numerics.intervals import runs
from ..numerics.slices import Slices
from ..pressing.contact_layout import landing_drop
from ..pressing.ground_cells import UndisturbedCells
from ..pressing.sole_imprint import patches_over_cells
from ..pressing.sole_points import (
    FINEST_DETAIL,
    PatchPoints,
    SolePoints,
    contact_window,
    places,
    point_contact,
    sole_points,
)

Array = NDArray[np.float64]
Single = NDArray[np.float32]

KNOTS_PER_TOLERANCE = 4
"""Sinkages at which the area of a contact is known, per height that counts as touching."""
KNOTS = 128
"""Number of those sinkages: up to more than the length of the sole."""
MOST_STEPS = 320
"""Steps that a longer contact is followed in: 2.7 s, at the usual 120 a second."""
SQUARES_AT_ONCE = 24_000
"""Squares, summed over steps, for which it is looked at together what a sole covers."""
COARSE = 1 / 20
"""Side of the parts of a sole that the pressure is fitted to, in sole lengths."""
SQUARES_IN_ALL = 16_000_000
"""Squares under the contacts of a shot, summed over their steps, beyond which they are larger than cells: 128 MB."""
ACROSS = 1 << 21
"""Squares across the ground that are told apart: 2 km at 1 mm."""
MOST_SQUARES = ACROSS**2
NEVER_LANDS = 1e-9
"""Landing speed of what does not come down [m/s]: the ground then takes all of its time."""


@dataclass(frozen=True)
class SoleContact:
    """One foot from touching down to leaving, as the ground feels it at N steps.

    Attributes
    ----------
    start : float
        Scene frame of the first step.
    duration : (N,) float array
        Of each step [s].
    force : (N,) float array
        Normal force [N].
    area : (N, KNOTS) float array
        Area in contact [m²] where the ground has given way by 0, 1, 2, ... parts of the tolerance.
    soft_area : (N, KNOTS) float array or None
        The same with the softness under each point, where the ground varies.
    squares : (C,) int array
        Squares of the ground that it comes over, cells where they are few: equal for the contacts of one character
        that share one.
    centres : (C, 2) float array
        Their centres [m].
    clearance : (N, C) float array
        Height of the underside over each, less that of its lowest point, in tolerances.
    covered : (N, C) float array
        Fraction of each that is under the sole.
    factors : Factors or None
        How the ground varies, (C,) float arrays.
    parts : (4, N, P) float array
        Parts of the underside: their x, y [m], clearance [tolerances] and area [m²].
    centre : (N, 2) float array
        Centre of pressure [m].
    tolerance : float
        See `deformation.touching_fraction` [m].
    landing_speed : float
        See `deformation.compression_rate` [m/s].
    """

    start: float
    duration: Array
    force: Array
    area: Single
    soft_area: Single | None
    squares: NDArray[np.int64]
    centres: Array
    clearance: Single
    covered: Single
    factors: Factors | None
    parts: Array
    centre: Array
    tolerance: float
    landing_speed: float


def square_sizes(loads: Sequence[CharacterLoads], cell_size: float) -> list[float]:
    """Side of the squares in which the ground under each character is looked at [m].

    They are the cells of a bake, or the parts that it divides them in to resolve a sole, of which then cells are made
    up; a few cells each where they would be too many, as long as a sole is resolved.
    """
    sizes, counts = [], []
    for character in loads:
        length = min((float(np.ptp(sole.sole.outline, axis=0).max()) for sole in character.motion.soles), default=1.0)
        size = cell_size / max(1, ceil(cell_size / (FINEST_DETAIL * length) - 1e-6))
        sizes.append((size, max(1, int(FINEST_DETAIL * length / size + 1e-6))))
        touching = character.contacts.touching
        contacts = sum(len(runs(foot)[0]) for foot in touching.T)
        steps = min(MOST_STEPS, touching.sum() / max(1, contacts))
        counts.append(steps * pressed_area([character]) / size**2)
    wanted = max(1, ceil(np.sqrt(sum(counts) / SQUARES_IN_ALL)))
    return [size * min(most, wanted) for size, most in sizes]


def contacts_of(character: CharacterLoads, index: int) -> Iterator[slice]:
    """The steps of each print of a sole, without the first of all: that is a state, it presses nothing."""
    for piece in tracks(character, index):
        if piece.stop > max(piece.start, 1):
            yield slice(max(piece.start, 1), piece.stop)


def sole_contacts(
    character: CharacterLoads, number: int, index: int, cells: UndisturbedCells, squares: UndisturbedCells
) -> Slices[list[SoleContact]]:
    """Every contact of a foot.

    Parameters
    ----------
    character : CharacterLoads
    number : int
        Of the character.
    index : int
        Of the foot.
    cells : UndisturbedCells
        Those of a bake.
    squares : UndisturbedCells
        Of a size from `square_sizes`.
    """
    sole = character.motion.soles[index]
    points = sole_points(sole.sole, sole.transforms)
    coarse = _coarse(points)
    found = []
    for steps in contacts_of(character, index):
        contact = yield from _sole_contact(character, index, steps, points, coarse, cells, squares)
        found.append(replace(contact, squares=contact.squares + number * MOST_SQUARES))
    return found


def _sole_contact(
    character: CharacterLoads,
    index: int,
    steps: slice,
    points: SolePoints,
    coarse: SolePoints,
    cells: UndisturbedCells,
    squares: UndisturbedCells,
) -> Slices[SoleContact]:
    motion, sole = character.motion, character.motion.soles[index]
    normals = character.contacts.normal[steps, index]
    force = np.maximum(np.einsum("ni,ni->n", character.forces.forces[steps, index], normals), 0.0)
    first = _steps_followed(force, sole.transforms[steps])
    counts = np.diff(first, append=len(force))
    middle = first + counts // 2
    poses, normals = sole.transforms[steps][middle], normals[middle]
    window = contact_window(points, poses, cells.cell_size)
    ground = cells.surface(window, points.cell_divisions(cells.cell_size))
    contact = point_contact(points, poses, ground)
    area = (contact.area + contact.beyond) / normals[:, 2:]
    above = contact.clearance / points.tolerance
    factors = cells.factors(window)
    softness = factors.softness[window.cells_under(*places(points, poses), cells.cell_size)] if factors else None
    yield
    surface = squares.surface(contact_window(points, poses, squares.cell_size))
    parts = max(1, round(cells.cell_size / squares.cell_size))
    numbers, centres, clearance, covered = yield from _over_squares(
        sole.sole, poses, surface, contact.lowest, points.tolerance, parts
    )
    under = window.cells_under(centres[:, 0], centres[:, 1], cells.cell_size)
    landing = sole.transforms[max(0, steps.start - 2) : steps.start + 1]
    drop = landing_drop(sole.sole, landing, character.contacts.normal[steps.start, index])
    return SoleContact(
        start=float(motion.frames[steps.start]),
        duration=counts * motion.time_step,
        force=np.add.reduceat(force, first) / counts,
        area=_area_by_sinkage(above, area),
        soft_area=_area_by_sinkage(above, area * softness) if softness is not None else None,
        squares=numbers,
        centres=centres,
        clearance=clearance,
        covered=covered,
        factors=Factors(*(factor[under] for factor in factors)) if factors else None,
        parts=_parts(coarse, poses, ground, contact.lowest, points.tolerance),
        centre=character.forces.centre_of_pressure[steps, index, :2][middle],
        tolerance=points.tolerance,
        landing_speed=max(drop / motion.time_step, NEVER_LANDS),
    )


def _steps_followed(force: Array, poses: Array) -> NDArray[np.intp]:
    """First of the steps (M,) that are followed as one: in a longer contact, most of those in which little changes."""
    count = len(force)
    if count <= MOST_STEPS:
        return np.arange(count)
    passed = np.zeros(count)
    for what in (np.arange(count, dtype=float), force, poses[:, :, 2].reshape(count, -1)):
        change = np.abs(np.diff(what, axis=0, prepend=what[:1])).reshape(count, -1).sum(axis=1)
        passed += np.cumsum(change) / max(change.sum(), NEVER_LANDS)
    return np.unique((passed / passed[-1] * (MOST_STEPS - 1)).astype(int), return_index=True)[1]


def _coarse(points: SolePoints) -> SolePoints:
    """Parts of a sole as one point each, in their middles."""
    patches = []
    for patch in points.patches:
        square = np.floor(patch.positions[:, :2] / (COARSE * points.length)).astype(int)
        _, part = np.unique(square, axis=0, return_inverse=True)
        part = part.ravel()
        area = np.bincount(part, patch.area).astype(float)
        positions, normals = (
            np.stack([np.bincount(part, patch.area * along) / area for along in values.T], axis=-1)
            for values in (patch.positions, patch.normals)
        )
        patches.append(PatchPoints(positions.reshape(-1, 3), normals.reshape(-1, 3), area))
    return SolePoints(tuple(patches), points.length)


def _parts(coarse: SolePoints, poses: Array, ground: Surface, lowest: Array, tolerance: float) -> Array:
    """See `SoleContact.parts`."""
    contact = point_contact(coarse, poses, ground)
    clearance = (contact.clearance + (contact.lowest - lowest)[:, None]) / tolerance
    return np.stack([*places(coarse, poses), clearance, contact.area + contact.beyond])


def _area_by_sinkage(clearance: Array, area: Array) -> Single:
    """Area in contact (N, KNOTS), from points (N, Q) with their clearance in tolerances.

    A point touches by clip(sinkage - clearance + 1.5, 0, 1), which is straight from knot to knot: shared between the
    two knots that it lies between, it counts for the same at all of them.
    """
    count, knots = len(clearance), KNOTS + 2 * KNOTS_PER_TOLERANCE
    at = np.minimum(clearance * KNOTS_PER_TOLERANCE, knots - 1.0)
    knot = np.minimum(at.astype(np.intp), knots - 2)
    into = (knot + np.arange(count)[:, None] * knots).ravel()
    upper = (area * (at - knot)).ravel()
    total = np.bincount(into, area.ravel() - upper, count * knots)
    total += np.bincount(into + 1, upper, count * knots)
    whole = np.cumsum(total.reshape(count, knots), axis=1)
    first = KNOTS_PER_TOLERANCE // 2  # it touches wholly so many knots above the sinkage
    steps = [whole[:, first + k : first + k + KNOTS] for k in range(KNOTS_PER_TOLERANCE)]
    return np.asarray(np.mean(steps, axis=0), np.float32)


def _over_squares(
    sole: Sole, poses: Array, ground: Surface, lowest: Array, tolerance: float, parts: int
) -> Slices[tuple[NDArray[np.int64], Array, Single, Single]]:
    """See `squares`, `centres`, `clearance` and `covered` of `SoleContact`, of so many cells of a surface along a side.

    Where patches overlap, that counts of which more is covered and which is the closer.
    """
    stretches = []
    used = np.zeros(ground.window.cells, bool)
    at_once = max(1, SQUARES_AT_ONCE // ground.window.cells)
    for first in range(0, len(poses), at_once):
        steps = slice(first, first + at_once)
        for near, clearance, covered in patches_over_cells(
            sole, poses[steps], ground, lowest=lowest[steps], tolerance=tolerance
        ):
            reached = covered.any(axis=0)
            cells, above = near[reached], clearance[:, reached] / np.float32(tolerance)
            used[cells] = True
            stretches.append((steps, cells, above, covered[:, reached]))
        yield
    number = np.cumsum(used) - 1
    over, share = np.zeros((2, len(poses), int(used.sum())), np.float32)
    for steps, cells, clearance, covered in stretches:
        at = steps, number[cells]
        further, before = over[at], share[at]
        closer = covered * (1.0 + np.maximum(further, 0.0)) > before * (1.0 + np.maximum(clearance, 0.0))
        over[at], share[at] = np.where(closer, clearance, further), np.where(closer, covered, before)
    row, column = np.divmod(np.flatnonzero(used), ground.window.columns)
    row, column = (row + ground.window.row) // parts, (column + ground.window.column) // parts
    if parts > 1:
        row, column, over, share = _of_whole_cells(row, column, over, share, parts)
    centres = (np.stack([column, row], axis=1) + 0.5) * ground.cell_size * parts
    return (row + ACROSS // 2) * ACROSS + column + ACROSS // 2, centres, over, share


def _of_whole_cells(
    row: NDArray[np.intp], column: NDArray[np.intp], clearance: Single, covered: Single, parts: int
) -> tuple[NDArray[np.intp], NDArray[np.intp], Single, Single]:
    """Mean clearance (N, C) and covered fraction of cells from those of their parts; (C,) their rows and columns."""
    order = np.lexsort([column, row])
    begins = np.diff(row[order], prepend=np.inf).astype(bool) | np.diff(column[order], prepend=np.inf).astype(bool)
    first = np.flatnonzero(begins)
    if not len(first):
        return row, column, clearance, covered
    covered, height = covered[:, order], clearance[:, order]
    share = np.add.reduceat(covered, first, axis=1)
    height = np.add.reduceat(covered * height, first, axis=1) / np.maximum(share, np.float32(1e-9))
    return row[order][first], column[order][first], height, share / np.float32(parts**2)
