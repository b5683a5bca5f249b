"""Cells that a posed sole meets: they are mapped back into the frame of each patch, to see what it covers of them.

How much of the sole meets the ground is measured at points of its own (`sole_points`), whatever the size of the cells.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from ..ground.heightfield import Surface
from ..ground.sparse_grid import Window
from ..motion.sole_motion import Sole, SolePatch
from ..numerics.arrays import Array
from ..soles.patch_maps import Nodes, Single, covered_fraction, distance_beyond
from .sole_points import FAR, LEAST_FACING, TOLERANCE, WALL, has_steps, touching_fraction

PatchOverCells = tuple[NDArray[np.intp], Single, Single]
"""See `patches_over_cells`."""

NEGLIGIBLE_SHIFT = 0.02
"""Sideways shift of the underside by its height that need not be followed, in cells."""


def cell_coverage(
    patches: Iterable[PatchOverCells], fine: Window, *, sinkage: Array, tolerance: float, divisions: int
) -> Single:
    """Fraction of each cell that is in contact, at each of N steps.

    Parameters
    ----------
    fine : Window
        Cells that are `divisions` times smaller than those looked for.
    sinkage : (N,) float array
        See `sole_points.touching_fraction` [m].
    tolerance : float
        See `sole_points.touching_fraction` [m].
    divisions : int
        From `SolePoints.cell_divisions`.

    Returns
    -------
    (N, rows, columns) float array
    """
    coverage = np.zeros((len(sinkage), fine.cells), np.float32)
    for number, (cells, clearance, covered) in enumerate(patches):
        touching = covered * touching_fraction(clearance, sinkage[:, None].astype(np.float32), tolerance)
        coverage[:, cells] = np.maximum(coverage[:, cells], touching) if number else touching
    coverage = coverage.reshape(-1, fine.rows, fine.columns)
    if divisions > 1:
        parts = (-1, fine.rows // divisions, divisions, fine.columns // divisions, divisions)
        coverage = coverage.reshape(parts).mean(axis=(2, 4))
    return coverage


def patches_over_cells(
    sole: Sole, transforms: Array, ground: Surface, *, lowest: Array, tolerance: float
) -> Iterator[PatchOverCells]:
    """Cover of the ground's cells by each patch of a sole, whether it touches them or not, at each of N steps.

    Parameters
    ----------
    transforms : (N, P, 4, 4) float array
        Poses of the patches.
    lowest : (N,) float array
        Height of the sole's lowest point above the undisturbed ground [m].
    tolerance : float
        See `sole_points.touching_fraction` [m].

    Yields
    ------
    cells : (C,) int array
        row·columns + column within the window of the ground.
    clearance : (N, C) float array
        Height of the underside over each, less that of the sole's lowest point [m].
    covered : (N, C) float array
        Fraction of each that bears and is under the patch.
    """
    fine = ground.window
    level = float(np.min(ground.heights, where=ground.bears, initial=FAR))  # 32 bits suffice for what lies above it
    base = np.where(ground.bears, ground.heights - level, 0.0).astype(np.float32).ravel()
    above = (lowest + level).astype(float)
    x, y = fine.centres(ground.cell_size)
    indices = np.arange(fine.cells).reshape(fine.rows, fine.columns)
    inside = WALL / TOLERANCE * tolerance  # cells that are so far above the lowest point are those of walls
    walled = has_steps(ground, inside)
    for number, patch in enumerate(sole.patches):
        pose = transforms[:, number]
        columns, rows = _columns_and_rows(patch, pose, x, y)
        cells, underside, covered = _underside(patch, pose, x[columns], y[rows], above, ground.cell_size)
        cells = indices[rows, columns].ravel()[cells]
        underside -= base[cells]
        covered[pose[:, 2, 2] < LEAST_FACING] = 0.0
        if walled:
            covered[underside < -inside] = 0.0
        if not ground.bears.all():
            covered *= ground.bears.ravel()[cells]
        yield cells, underside, covered


def _underside(
    patch: SolePatch, pose: Array, x: Array, y: Array, above: Array, cell_size: float
) -> tuple[NDArray[np.intp], Single, Single]:
    """The cells that a patch covers at any of N steps, its height over each and the fraction that it covers of each.

    Returns
    -------
    cells : (C,) int array
        row·columns + column.
    underside : (N, C) float array
        Height above the level `above` (N,) [m].
    covered : (N, C) float array
    """
    rotation, place = pose[:, :3, :3], pose[:, :3, 3]
    # x = a·u + b·v + (terms of the height h), solved for the patch's (u, v) first at h = 0, then at the h found there.
    (a, b), (c, d) = rotation[:, 0, :2].T, rotation[:, 1, :2].T
    inverse = np.array([[d, -b], [-c, a]]) / np.maximum(rotation[:, 2, 2], LEAST_FACING)
    along_x = (inverse[:, 0, :, None] * (x - place[:, :1])).astype(np.float32)
    along_y = (inverse[:, 1, :, None] * (y - place[:, 1:2])).astype(np.float32)
    u = along_x[0][:, None, :] + along_y[0][:, :, None]
    v = along_x[1][:, None, :] + along_y[1][:, :, None]
    shift = np.einsum("ijn,nj->in", inverse, rotation[:, :2, 2]).astype(np.float32)[..., None]
    sideways = np.abs(shift).max(axis=(1, 2)) * np.abs(patch.heights).max()
    low, high = patch.box
    slack_u, slack_v = cell_size + sideways
    near = (u > low[0] - slack_u) & (u < high[0] + slack_u) & (v > low[1] - slack_v) & (v < high[1] + slack_v)
    cells = np.flatnonzero(near.any(axis=0))
    u, v = (
        coordinate.reshape(len(pose), -1).take(cells, axis=1) for coordinate in (u, v)
    )  # in C order, as fancy indexing is not
    if sideways.max() > NEGLIGIBLE_SHIFT * cell_size:
        height = Nodes.under(patch, u, v).interpolate(patch.heights)
        u -= shift[0] * height
        v -= shift[1] * height
    nodes = Nodes.under(patch, u, v)
    distance = nodes.interpolate(patch.signed_distance)
    edge = min(float(patch.signed_distance[ends].min()) for ends in (np.s_[[0, -1]], np.s_[:, [0, -1]]))
    if edge < 0.5 * cell_size:  # else no cell beyond the maps is covered
        distance += distance_beyond(patch, u, v)
    along_u, along_v, along_h = rotation[:, 2].T.astype(np.float32)[..., None]
    height = nodes.interpolate(patch.heights)
    height *= along_h
    height += along_u * u
    height += along_v * v
    height += (place[:, 2] - above).astype(np.float32)[:, None]
    return cells, height, covered_fraction(distance, cell_size)


def _columns_and_rows(patch: SolePatch, pose: Array, x: Array, y: Array) -> tuple[slice, slice]:
    """The columns at x and the rows at y that a patch may cover at any of the steps, and one around them."""
    low, high = patch.box
    centre = pose[:, :2, :3] @ ((low + high) / 2) + pose[:, :2, 3]
    extent = np.abs(pose[:, :2, :3]) @ ((high - low) / 2)
    first, last = (centre - extent).min(axis=0), (centre + extent).max(axis=0)
    columns, rows = (
        slice(max(0, int(np.searchsorted(at, first[k])) - 1), int(np.searchsorted(at, last[k])) + 1)
        for k, at in enumerate((x, y))
    )
    return columns, rows
