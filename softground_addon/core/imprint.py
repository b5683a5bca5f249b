"""Where a posed sole meets the ground: how much of its underside is how high above it, and which cells lie beneath.

Two views of the same contact. Points fixed to the sole measure height and area, whatever the size of the cells and
wherever the sole stands. Cells are mapped back into the frame of each patch to see which part of them it covers. Both
treat many steps in one go.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .deformation import touching_fraction
from .heightfield import Surface, Window
from .motion import Sole, SolePatch

Array = NDArray[np.float64]
Single = NDArray[np.float32]
"""What is said of many cells at many steps: fractions and heights near the ground, where 32 bits are plenty."""

TOLERANCE = 0.04
"""What counts as touching, in sole lengths: 1 cm for an adult, the give of a shoe and the error of a pose."""
FINEST_DETAIL = 1 / 24
"""Coarser cells are divided to resolve the sole, in sole lengths: 1.1 cm for an adult."""
POINTS_PER_PATCH = 400
"""A patch is measured at about this many points: its area to 0.1 %."""
LEAST_FACING = 0.2
"""Cosine of the tilt beyond which a patch stands on its edge and has no underside to print with (78°)."""
NEGLIGIBLE_SHIFT = 0.02
"""Sideways shift of the underside by its height that need not be followed, in cells."""
FAR = 1e9
"""Clearance of what is not over the ground [m]."""


@dataclass(frozen=True)
class PatchPoints:
    """Points spread evenly over the underside of one patch, in its frame.

    Attributes
    ----------
    positions : (Q, 3) float array [m]
    normals : (Q, 3) float array
        Upward, scaled so that z is 1: the area of the underside over the area it stands for.
    area : (Q,) float array
        Area of the outline that each point stands for [m²].
    """

    positions: Array
    normals: Array
    area: Array


@dataclass(frozen=True)
class SolePoints:
    """Points of all patches of a sole; where patches overlap at a seam, the first one's count.

    Attributes
    ----------
    patches : tuple of PatchPoints
    length : float
        Longest extent of the sole's outline [m], the scale of `TOLERANCE` and `FINEST_DETAIL`.
    """

    patches: tuple[PatchPoints, ...]
    length: float

    @property
    def tolerance(self) -> float:
        """Height above the lowest point that still counts as touching [m]."""
        return TOLERANCE * self.length

    def cell_divisions(self, cell_size: float) -> int:
        """Number of parts that cells of this size are divided in, along each side, to resolve the sole."""
        return max(1, ceil(cell_size / (FINEST_DETAIL * self.length) - 1e-6))


@dataclass(frozen=True)
class PointContact:
    """A sole's points over the ground, at each of N steps.

    Attributes
    ----------
    clearance : (N, Q) float array
        Height above the undisturbed ground, less that of the lowest point [m].
    area : (N, Q) float array
        Horizontal area that each point stands for [m²].
    lowest : (N,) float array
        Height of the lowest point above the undisturbed ground [m].
    """

    clearance: Array
    area: Array
    lowest: Array


def sole_points(sole: Sole, transforms: Array) -> SolePoints:
    """Spread points over a sole's underside.

    Parameters
    ----------
    sole : Sole
    transforms : (F, P, 4, 4) float array
        Its motion, to know how its patches lie to each other when the sole is flat.
    """
    rotation = transforms[..., :3, :3]
    alignment = np.einsum("fji,fpji->f", rotation[:, 0], rotation)  # traces of the rotations between the patches
    flat = transforms[int(alignment.argmax())]
    patches: list[PatchPoints] = []
    for number, patch in enumerate(sole.patches):
        points = _patch_points(patch)
        free = points.area
        for earlier, frame in zip(sole.patches[:number], flat[:number], strict=True):
            to_earlier = np.linalg.inv(frame) @ flat[number]
            places = points.positions @ to_earlier[:3, :3].T + to_earlier[:3, 3]
            distance = _Nodes.under(earlier, *places[:, :2].T.astype(np.float32)).interpolate(earlier.signed_distance)
            free = free * (1.0 - _covered(distance, earlier.spacing))
        used = free > 0
        patches.append(PatchPoints(points.positions[used], points.normals[used], free[used]))
    return SolePoints(tuple(patches), float(np.ptp(sole.outline, axis=0).max()))


def reach(points: SolePoints, transforms: Array) -> tuple[Array, Array]:
    """Lower and upper corner (x, y, z) of the box that holds all points of a sole at all steps [m]."""
    corners = []
    for number, patch in enumerate(points.patches):
        if len(patch.positions):
            low, high = patch.positions.min(axis=0), patch.positions.max(axis=0)
            middle, half = (low + high) / 2, (high - low) / 2
            pose = transforms[:, number]
            centre = pose[:, :3, :3] @ middle + pose[:, :3, 3]
            extent = np.abs(pose[:, :3, :3]) @ half
            corners.append((centre - extent).min(axis=0))
            corners.append((centre + extent).max(axis=0))
    return np.min(corners, axis=0), np.max(corners, axis=0)


def point_contact(points: SolePoints, transforms: Array, ground: Surface) -> PointContact:
    """Heights of a posed sole's points above the undisturbed ground.

    Parameters
    ----------
    points : SolePoints
    transforms : (N, P, 4, 4) float array
        Poses of the patches.
    ground : Surface
        Of all cells that the points lie over, at least.

    Returns
    -------
    PointContact
        Points off the ground, over a wall or turned away from the ground have no area.
    """
    window, heights, bears = ground.window, ground.heights, ground.bears
    level = bool(bears.all()) and np.ptp(heights) == 0
    clearances, areas = [], []
    for number, patch in enumerate(points.patches):
        rotation, place = transforms[:, number, :3, :3], transforms[:, number, :3, 3]
        height = rotation[:, 2] @ patch.positions.T + place[:, 2:]
        area = np.maximum(rotation[:, 2] @ patch.normals.T, 0.0) * patch.area
        area[rotation[:, 2, 2] < LEAST_FACING] = 0.0
        if level:
            height -= heights[0, 0]
        else:
            # The ground's plane in the cell under each point.
            column = (rotation[:, 0] @ patch.positions.T + place[:, :1]) / ground.cell_size - window.column
            row = (rotation[:, 1] @ patch.positions.T + place[:, 1:2]) / ground.cell_size - window.row
            i = np.clip(column.astype(int), 0, window.columns - 1)
            j = np.clip(row.astype(int), 0, window.rows - 1)
            rise = ground.slope_x[j, i] * (column - i - 0.5) + ground.slope_y[j, i] * (row - j - 0.5)
            on_ground = bears[j, i]
            height -= np.where(on_ground, heights[j, i] + rise * ground.cell_size, 0.0)
            area *= on_ground
        height[area == 0] = FAR
        clearances.append(height)
        areas.append(area)
    clearance = np.concatenate(clearances, axis=1)
    lowest = clearance.min(axis=1)
    return PointContact(clearance - lowest[:, None], np.concatenate(areas, axis=1), lowest)


def centroid(points: SolePoints, transforms: Array, pressing: Array) -> Array:
    """World position of the middle of pressure at each step, (N, 3) [m].

    Parameters
    ----------
    points : SolePoints
    transforms : (N, P, 4, 4) float array
    pressing : (N, Q) float array
        Area in contact of each point [m²].
    """
    total = np.zeros((len(pressing), 4))
    first = 0
    for number, patch in enumerate(points.patches):
        share = pressing[:, first : first + len(patch.positions)]
        local = np.column_stack([share @ patch.positions, share.sum(axis=1)])
        total += np.einsum("nij,nj->ni", transforms[:, number], local)
        first += len(patch.positions)
    return np.divide(total[:, :3], total[:, 3:], out=np.zeros((len(total), 3)), where=total[:, 3:] > 0)


def places(points: SolePoints, transforms: Array) -> tuple[Array, Array]:
    """World x and y of a sole's points at each step, (N, Q) each [m]."""
    along = []
    for axis in (0, 1):
        parts = [
            transforms[:, number, axis, :3] @ patch.positions.T + transforms[:, number, axis, 3:]
            for number, patch in enumerate(points.patches)
        ]
        along.append(np.concatenate(parts, axis=1))
    return along[0], along[1]


def contact_window(points: SolePoints, transforms: Array, cell_size: float) -> Window:
    """The cells that a sole may touch during these steps."""
    low, high = reach(points, transforms)
    return Window.around(low - cell_size / 2, high + cell_size / 2, cell_size)


def cell_coverage(
    sole: Sole,
    transforms: Array,
    ground: Surface,
    *,
    lowest: Array,
    sinkage: Array,
    tolerance: float,
    divisions: int = 1,
) -> Single:
    """Fraction of each cell that is in contact, at each of N steps.

    Parameters
    ----------
    sole : Sole
    transforms : (N, P, 4, 4) float array
        Poses of the patches.
    ground : Surface
        With cells that are `divisions` times smaller than those looked for.
    lowest : (N,) float array
        Height of the sole's lowest point above the undisturbed ground [m].
    sinkage : (N,) float array
        See `deformation.touching_fraction` [m].
    tolerance : float
        See `deformation.touching_fraction` [m].
    divisions : int
        From `SolePoints.cell_divisions`.

    Returns
    -------
    (N, rows, columns) float array
    """
    fine = ground.window
    level = float(np.min(ground.heights, where=ground.bears, initial=FAR))  # 32 bits suffice for what lies above it
    base = np.where(ground.bears, ground.heights - level, 0.0).astype(np.float32).ravel()
    above = (lowest + level).astype(float)
    x, y = fine.centres(ground.cell_size)
    indices = np.arange(fine.cells).reshape(fine.rows, fine.columns)
    coverage = np.zeros((len(transforms), fine.cells), np.float32)
    for number, patch in enumerate(sole.patches):
        pose = transforms[:, number]
        columns, rows = _columns_and_rows(patch, pose, x, y)
        cells, underside, covered = _underside(patch, pose, x[columns], y[rows], above, ground.cell_size)
        cells = indices[rows, columns].ravel()[cells]
        underside -= base[cells]
        covered *= touching_fraction(underside, sinkage[:, None].astype(np.float32), tolerance)
        covered[pose[:, 2, 2] < LEAST_FACING] = 0.0
        coverage[:, cells] = np.maximum(coverage[:, cells], covered) if number else covered
    coverage = coverage.reshape(-1, fine.rows, fine.columns)
    if not ground.bears.all():
        coverage *= ground.bears
    if divisions > 1:
        parts = (-1, fine.rows // divisions, divisions, fine.columns // divisions, divisions)
        coverage = coverage.reshape(parts).mean(axis=(2, 4))
    return coverage


def _patch_points(patch: SolePatch) -> PatchPoints:
    """Every stride-th node of a patch, together of the same area as its outline."""
    stride = max(1, round(np.sqrt(patch.area / POINTS_PER_PATCH) / patch.spacing))
    slope_y, slope_x = np.gradient(patch.heights, patch.spacing)
    nodes = tuple(slice(((count - 1) % stride) // 2, None, stride) for count in patch.heights.shape)
    row, column = np.mgrid[tuple(slice(0, count) for count in patch.heights.shape)]
    x = patch.origin[0] + column[nodes] * patch.spacing
    y = patch.origin[1] + row[nodes] * patch.spacing
    covered = _covered(patch.signed_distance[nodes], patch.spacing * stride)
    inside = covered > 0
    positions = np.stack([x, y, patch.heights[nodes]], axis=-1)[inside]
    normals = np.stack([-slope_x[nodes], -slope_y[nodes], np.ones_like(x)], axis=-1)[inside]
    return PatchPoints(positions, normals, covered[inside] * (patch.area / covered.sum()))


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
    low, high = _outline_box(patch)
    slack_u, slack_v = cell_size + sideways
    near = (u > low[0] - slack_u) & (u < high[0] + slack_u) & (v > low[1] - slack_v) & (v < high[1] + slack_v)
    cells = np.flatnonzero(near.any(axis=0))
    u, v = u.reshape(len(pose), -1)[:, cells], v.reshape(len(pose), -1)[:, cells]
    if sideways.max() > NEGLIGIBLE_SHIFT * cell_size:
        height = _Nodes.under(patch, u, v).interpolate(patch.heights)
        u -= shift[0] * height
        v -= shift[1] * height
    nodes = _Nodes.under(patch, u, v)
    distance = nodes.interpolate(patch.signed_distance)
    distance += nodes.beyond
    along_u, along_v, along_h = rotation[:, 2].T.astype(np.float32)[..., None]
    height = nodes.interpolate(patch.heights)
    height *= along_h
    height += along_u * u
    height += along_v * v
    height += (place[:, 2] - above).astype(np.float32)[:, None]
    return cells, height, _covered(distance, cell_size)


def _outline_box(patch: SolePatch) -> tuple[Array, Array]:
    """Lower and upper corner (x, y, height) of the underside within a patch's outline, and a node around it."""
    row, column = np.nonzero(patch.signed_distance <= patch.spacing)
    x, y = patch.origin[0] + column * patch.spacing, patch.origin[1] + row * patch.spacing
    points = np.stack([x, y, patch.heights[row, column]])
    return points.min(axis=1), points.max(axis=1)


def _columns_and_rows(patch: SolePatch, pose: Array, x: Array, y: Array) -> tuple[slice, slice]:
    """The columns at x and the rows at y that a patch may cover at any of the steps, and one around them."""
    low, high = _outline_box(patch)
    centre = pose[:, :2, :3] @ ((low + high) / 2) + pose[:, :2, 3]
    extent = np.abs(pose[:, :2, :3]) @ ((high - low) / 2)
    first, last = (centre - extent).min(axis=0), (centre + extent).max(axis=0)
    columns, rows = (
        slice(max(0, int(np.searchsorted(at, first[k])) - 1), int(np.searchsorted(at, last[k])) + 1)
        for k, at in enumerate((x, y))
    )
    return columns, rows


@dataclass(frozen=True)
class _Nodes:
    """Where places lie between the nodes of a patch's maps."""

    index: NDArray[np.intp]
    u: Single
    v: Single
    columns: int
    beyond: Single
    """How far outside the maps [m]."""

    @classmethod
    def under(cls, patch: SolePatch, x: Single, y: Single) -> _Nodes:
        rows, columns = patch.heights.shape
        u = (x - np.float32(patch.origin[0])) * np.float32(1 / patch.spacing)
        v = (y - np.float32(patch.origin[1])) * np.float32(1 / patch.spacing)
        inside_u = np.minimum(np.maximum(u, np.float32(0)), np.float32(columns - 1))
        inside_v = np.minimum(np.maximum(v, np.float32(0)), np.float32(rows - 1))
        u -= inside_u
        v -= inside_v
        beyond = (np.abs(u, out=u) + np.abs(v, out=v)) * np.float32(patch.spacing)
        column = np.minimum(inside_u.astype(np.int32), columns - 2)
        row = np.minimum(inside_v.astype(np.int32), rows - 2)
        inside_u -= column.astype(np.float32)
        inside_v -= row.astype(np.float32)
        row *= columns
        row += column
        return cls(row.astype(np.intp), inside_u, inside_v, columns, beyond)

    def interpolate(self, values: Array) -> Single:
        flat = values.ravel().astype(np.float32)
        low = self._between(flat)
        high = self._between(flat[self.columns :])
        high -= low
        high *= self.v
        high += low
        return high

    def _between(self, flat: Single) -> Single:
        near, far = flat.take(self.index), flat[1:].take(self.index)
        far -= near
        far *= self.u
        far += near
        return far


def _covered(distance: Any, size: float) -> Any:
    """Fraction of a cell of this size that lies inside an outline at a signed distance from its centre."""
    return np.minimum(np.maximum(0.5 - distance * (1.0 / size), 0.0), 1.0)
