"""Where a posed sole meets the ground: how much of its underside is how high above it, and which cells lie beneath.

Two views of the same contact. Points fixed to the sole measure height and area, whatever the size of the cells and
wherever the sole stands. Cells are mapped back into the frame of each patch to see which part of them it covers. Both
treat many steps in one go.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from .deformation import touching_fraction
from .heightfield import TerrainTiles, Window
from .motion import Sole, SolePatch

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

TOLERANCE = 0.04
"""What counts as touching, in sole lengths: 1 cm for an adult, the give of a shoe and the error of a pose."""
FINEST_DETAIL = 1 / 24
"""Coarser cells are divided to resolve the sole, in sole lengths: 1.1 cm for an adult."""
POINTS_PER_PATCH = 400
"""A patch is measured at about this many points: its area to 0.1 %."""
LEAST_FACING = 0.2
"""Cosine of the tilt beyond which a patch stands on its edge and has no underside to print with (78°)."""
STEEPEST_CELL = np.tan(np.radians(60.0))
"""Slope of the steepest cell that takes a print: more is a wall."""
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
            distance = _Nodes.under(earlier, places[:, 0], places[:, 1]).interpolate(earlier.signed_distance)
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


def point_contact(points: SolePoints, transforms: Array, ground: TerrainTiles) -> PointContact:
    """Heights of a posed sole's points above the undisturbed ground.

    Parameters
    ----------
    points : SolePoints
    transforms : (N, P, 4, 4) float array
        Poses of the patches.
    ground : TerrainTiles

    Returns
    -------
    PointContact
        Points off the ground, over a wall or turned away from the ground have no area.
    """
    window = Window.around(*reach(points, transforms), ground.cell_size)
    heights, slope_x, slope_y = ground.slopes(window)
    bears = _bears(heights, slope_x, slope_y)
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
            rise = slope_x[j, i] * (column - i - 0.5) + slope_y[j, i] * (row - j - 0.5)
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


def contact_window(points: SolePoints, transforms: Array, cell_size: float) -> Window:
    """The cells that a sole may touch during these steps."""
    low, high = reach(points, transforms)
    return Window.around(low - cell_size / 2, high + cell_size / 2, cell_size)


def cell_coverage(
    sole: Sole,
    transforms: Array,
    ground: TerrainTiles,
    window: Window,
    *,
    lowest: Array,
    sinkage: Array,
    tolerance: float,
    divisions: int,
) -> Array:
    """Fraction of each cell that is in contact, at each of N steps.

    Parameters
    ----------
    sole : Sole
    transforms : (N, P, 4, 4) float array
        Poses of the patches.
    ground : TerrainTiles
        With cells that are `divisions` times smaller than those of the window.
    window : Window
        The cells to look at.
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
    fine = window.refined(divisions)
    heights, slope_x, slope_y = ground.slopes(fine)
    bears = _bears(heights, slope_x, slope_y)
    base = np.where(bears, heights, 0.0)
    x, y = fine.centres(ground.cell_size)
    coverage = np.zeros((len(transforms), fine.rows, fine.columns))
    for number, patch in enumerate(sole.patches):
        pose = transforms[:, number]
        facing = pose[:, 2, 2] >= LEAST_FACING
        if facing.any():
            rows, columns = _slices(fine, patch, pose[facing], ground.cell_size)
            underside, covered = _underside(patch, pose, x[columns], y[rows], ground.cell_size)
            underside -= base[rows, columns]
            underside -= lowest[:, None, None]
            covered *= touching_fraction(underside, sinkage[:, None, None], tolerance)
            covered[~facing] = 0.0
            part = coverage[:, rows, columns]
            np.maximum(part, covered, out=part)
    if not bears.all():
        coverage *= bears
    if divisions > 1:
        coverage = coverage.reshape(-1, window.rows, divisions, window.columns, divisions).mean(axis=(2, 4))
    return coverage


def bearing(ground: TerrainTiles, window: Window) -> Array:
    """1 for cells of a window that can be pressed or raised, 0 for those off the ground or on a wall."""
    return _bears(*ground.slopes(window)).astype(float)


def _bears(heights: Array, slope_x: Array, slope_y: Array) -> Mask:
    mask: Mask = np.isfinite(heights) & (slope_x**2 + slope_y**2 <= STEEPEST_CELL**2)
    return mask


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


def _slices(window: Window, patch: SolePatch, pose: Array, cell_size: float) -> tuple[slice, slice]:
    """Rows and columns of a window that a patch may cover at any of the steps."""
    row, column = np.nonzero(patch.signed_distance <= patch.spacing)
    heights = patch.heights[row, column]
    x, y = patch.origin[0] + column * patch.spacing, patch.origin[1] + row * patch.spacing
    low = np.array([x.min(), y.min(), heights.min()])
    high = np.array([x.max(), y.max(), heights.max()])
    centre = pose[:, :2, :3] @ ((low + high) / 2) + pose[:, :2, 3]
    extent = np.abs(pose[:, :2, :3]) @ ((high - low) / 2) + cell_size
    first = np.floor((centre - extent).min(axis=0) / cell_size).astype(int) - (window.column, window.row)
    last = np.floor((centre + extent).max(axis=0) / cell_size).astype(int) - (window.column, window.row)
    return slice(max(0, first[1]), max(0, last[1] + 1)), slice(max(0, first[0]), max(0, last[0] + 1))


def _underside(patch: SolePatch, pose: Array, x: Array, y: Array, cell_size: float) -> tuple[Array, Array]:
    """World height of a patch over cells and the fraction of each that its outline covers, (N, rows, columns)."""
    rotation, place = pose[:, :3, :3], pose[:, :3, 3]
    facing = np.maximum(rotation[:, 2, 2], LEAST_FACING)
    # x = a·u + b·v + (terms of the height h), solved for the patch's (u, v) first at h = 0, then at the h found there.
    (a, b), (c, d) = rotation[:, 0, :2].T, rotation[:, 1, :2].T
    inverse = np.array([[d, -b], [-c, a]]) / facing
    along_x = inverse[:, 0, :, None] * (x - place[:, :1])[None]
    along_y = inverse[:, 1, :, None] * (y - place[:, 1:2])[None]
    u = along_x[0][:, None, :] + along_y[0][:, :, None]
    v = along_x[1][:, None, :] + along_y[1][:, :, None]
    shift = np.einsum("ijn,nj->in", inverse, rotation[:, :2, 2])
    if np.abs(shift).max() * np.abs(patch.heights).max() > NEGLIGIBLE_SHIFT * cell_size:
        height = _Nodes.under(patch, u, v).interpolate(patch.heights)
        u -= shift[0][:, None, None] * height
        v -= shift[1][:, None, None] * height
    nodes = _Nodes.under(patch, u, v)
    distance, slope_u, slope_v = nodes.interpolate_with_slopes(patch.signed_distance, patch.spacing)
    distance += nodes.beyond * patch.spacing
    # A tilted patch covers its outline foreshortened: the distance grows that much faster over the ground.
    slope_x = slope_u * inverse[0, 0][:, None, None] + slope_v * inverse[1, 0][:, None, None]
    slope_y = slope_u * inverse[0, 1][:, None, None] + slope_v * inverse[1, 1][:, None, None]
    steepness = np.sqrt(slope_x**2 + slope_y**2)
    covered = _covered(distance, np.maximum(steepness, 0.5) * cell_size)
    height = nodes.interpolate(patch.heights) * rotation[:, 2, 2][:, None, None]
    height += rotation[:, 2, 0][:, None, None] * u
    height += rotation[:, 2, 1][:, None, None] * v
    height += place[:, 2][:, None, None]
    return height, covered


@dataclass(frozen=True)
class _Nodes:
    """Where places lie between the nodes of a patch's maps."""

    index: NDArray[np.intp]
    u: Array
    v: Array
    columns: int
    beyond: Array
    """How far outside the maps [nodes]."""

    @classmethod
    def under(cls, patch: SolePatch, x: Array, y: Array) -> _Nodes:
        rows, columns = patch.heights.shape
        u, v = (x - patch.origin[0]) / patch.spacing, (y - patch.origin[1]) / patch.spacing
        inside_u, inside_v = np.clip(u, 0.0, columns - 1.0), np.clip(v, 0.0, rows - 1.0)
        beyond = np.abs(u - inside_u) + np.abs(v - inside_v)
        column = np.minimum(inside_u.astype(np.intp), columns - 2)
        row = np.minimum(inside_v.astype(np.intp), rows - 2)
        return cls(row * columns + column, inside_u - column, inside_v - row, columns, beyond)

    def interpolate(self, values: Array) -> Array:
        low, high = self._along_u(values)
        return low + (high - low) * self.v

    def interpolate_with_slopes(self, values: Array, spacing: float) -> tuple[Array, Array, Array]:
        flat = values.ravel()
        near, far = flat[self.index], flat[self.index + 1]
        near_up, far_up = flat[self.index + self.columns], flat[self.index + self.columns + 1]
        slope_low, slope_high = far - near, far_up - near_up
        low, high = near + slope_low * self.u, near_up + slope_high * self.u
        slope_u = (slope_low + (slope_high - slope_low) * self.v) / spacing
        return low + (high - low) * self.v, slope_u, (high - low) / spacing

    def _along_u(self, values: Array) -> tuple[Array, Array]:
        flat = values.ravel()
        near, near_up = flat[self.index], flat[self.index + self.columns]
        low = near + (flat[self.index + 1] - near) * self.u
        return low, near_up + (flat[self.index + self.columns + 1] - near_up) * self.u


def _covered(distance: Array, size: Array | float) -> Array:
    """Fraction of a cell of this size that lies inside an outline at a signed distance from its centre."""
    return np.clip(0.5 - distance / size, 0.0, 1.0)
