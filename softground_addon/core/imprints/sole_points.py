"""Heights of a posed sole's underside above the ground, at points fixed to the sole.

They measure height and area whatever the size of the cells and wherever the sole stands, many steps in one go.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import ceil
from typing import Any

import numpy as np

from ..ground.heightfield import Surface
from ..ground.sparse_grid import Window
from ..motion.sole_motion import Sole, SolePatch
from ..numerics.arrays import Array, Mask
from ..numerics.interpolation import in_stretches
from ..numerics.rigid import inverse
from ..soles.patch_maps import Nodes, covered_fraction

TOLERANCE = 0.04
"""What counts as touching, in sole lengths: 1 cm for an adult, the give of a shoe and the error of a pose."""
FINEST_DETAIL = 1 / 24
"""Coarser cells are divided to resolve the sole, in sole lengths: 1.1 cm for an adult."""
POINTS_PER_PATCH = 400
"""A patch is measured at about this many points: its area to 0.1 %."""
LEAST_FACING = 0.2
"""Cosine of the tilt beyond which a patch stands on its edge and has no underside to print with (78°)."""
WALL = 0.1
"""A jump of the ground under a sole that no slope makes between neighbouring points, in sole lengths: 3 cm for an
adult."""
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

    @cached_property
    def box(self) -> tuple[Array, Array]:
        """Middle of the box around the points, and half of its size, (3,) each [m]."""
        low, high = self.positions.min(axis=0), self.positions.max(axis=0)
        return (low + high) / 2, (high - low) / 2


@dataclass(frozen=True)
class SolePoints:
    """Points of all patches of a sole; where patches overlap at a seam, the first one's count.

    Attributes
    ----------
    length : float
        Longest extent of the sole's outline [m], the scale of `TOLERANCE` and `FINEST_DETAIL`.
    """

    patches: tuple[PatchPoints, ...]
    length: float

    @property
    def area(self) -> float:
        """Area of the whole sole [m²]."""
        return sum(float(patch.area.sum()) for patch in self.patches)

    @property
    def width(self) -> float:
        """Mean width [m]."""
        return self.area / self.length

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
        Horizontal area that each point stands for where it is over ground that bears [m²].
    beyond : (N, Q) float array
        The same of points beyond the edge of the ground: what lies there bears its part of the load.
    lowest : (N,) float array
        Height of the lowest point above the undisturbed ground [m].
    """

    clearance: Array
    area: Array
    beyond: Array
    lowest: Array


def sole_points(sole: Sole, transforms: Array) -> SolePoints:
    """Spread points over a sole's underside.

    Parameters
    ----------
    transforms : (F, P, 4, 4) float array
        Its motion, to know how its patches lie to each other when the sole is flat.
    """
    flat = flat_pose(transforms)
    patches: list[PatchPoints] = []
    for number, patch in enumerate(sole.patches):
        points = _patch_points(patch)
        free = points.area
        for earlier, frame in zip(sole.patches[:number], flat[:number], strict=True):
            to_earlier = inverse(frame) @ flat[number]
            places = points.positions @ to_earlier[:3, :3].T + to_earlier[:3, 3]
            distance = Nodes.under(earlier, *places[:, :2].T.astype(np.float32)).interpolate(earlier.signed_distance)
            free = free * (1.0 - covered_fraction(distance, earlier.spacing))
        used = free > 0
        patches.append(PatchPoints(points.positions[used], points.normals[used], free[used]))
    return SolePoints(tuple(patches), float(np.ptp(sole.outline, axis=0).max()))


def flat_pose(transforms: Array) -> Array:
    """Poses (P, 4, 4) of a sole's patches where it is flattest, of a motion (F, P, 4, 4)."""

    def alignment(steps: slice) -> Array:
        rotation = transforms[steps][..., :3, :3]
        return np.einsum("fji,fpji->f", rotation[:, 0], rotation)  # traces of the rotations between the patches

    flattest: Array = transforms[int(in_stretches(alignment, len(transforms)).argmax())]
    return flattest


def reach(points: SolePoints, transforms: Array) -> tuple[Array, Array]:
    """Lower and upper corner (x, y, z) of the box that holds all points of a sole at all steps [m]."""
    corners = []
    for number, patch in enumerate(points.patches):
        if len(patch.positions):
            middle, half = patch.box
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
    transforms : (N, P, 4, 4) float array
        Poses of the patches.
    ground : Surface
        Of all cells that the points lie over, at least.

    Returns
    -------
    PointContact
        Points over a wall or inside of one, or turned away from the ground, have no area. Beyond its edge, the ground
        is taken to go on as it is under the rest of the sole; there is none where all of the sole is beyond.
    """
    height, facing = _posed(points, transforms)
    if ground.bears.all() and np.ptp(ground.heights) == 0:
        clearance, area, beyond = height - ground.heights[0, 0], facing, np.zeros_like(facing)
    else:
        x, y = places(points, transforms)
        level, plane = ground.planes_at(x, y)
        off = np.isnan(plane)
        clearance, area = np.where(off, FAR, height - plane), np.where(off, 0.0, facing)
        if has_steps(ground, WALL * points.length):
            area[_inside_walls(np.where(area > 0, clearance, FAR), level, WALL * points.length)] = 0.0
        beyond = np.zeros_like(facing)
        if off.any():
            level, rise_x, rise_y = ground.mean_plane(x, y, area)
            plane = level + rise_x * x + rise_y * y
            off = ground.beyond(x, y) & ~np.isnan(plane)
            beyond[off], clearance[off] = facing[off], (height - plane)[off]
    clearance[area + beyond == 0] = FAR
    lowest = clearance.min(axis=1)
    return PointContact(clearance - lowest[:, None], area, beyond, lowest)


def _posed(points: SolePoints, transforms: Array) -> tuple[Array, Array]:
    """Height of a sole's points and the horizontal area that each stands for where it faces down, (N, Q) each."""
    heights, areas = [], []
    for number, patch in enumerate(points.patches):
        rotation = transforms[:, number, :3, :3]
        heights.append(rotation[:, 2] @ patch.positions.T + transforms[:, number, 2, 3:])
        area = np.maximum(rotation[:, 2] @ patch.normals.T, 0.0) * patch.area
        area[rotation[:, 2, 2] < LEAST_FACING] = 0.0
        areas.append(area)
    return np.concatenate(heights, axis=1), np.concatenate(areas, axis=1)


def has_steps(ground: Surface, jump: float) -> bool:
    """True if neighbouring cells of the ground differ in height by more than a jump [m]."""
    heights = np.where(ground.bears, ground.heights, np.nan)
    with np.errstate(invalid="ignore"):
        return (
            any(bool((np.abs(np.diff(heights, axis=axis)) > jump).any()) for axis in (0, 1)) or not ground.bears.all()
        )


def _inside_walls(clearance: Array, level: Array, jump: float) -> Mask:
    """Points (N, Q) that an animated foot pushes into a riser, a curb or a wall while it stands beside it.

    Where the ground under the sole falls into an upper and a lower part, the sole stands on the one that it is nearer
    to; in the upper one it would stick.

    Parameters
    ----------
    clearance : (N, Q) float array
        Height above the ground, `FAR` where there is none [m].
    level : (N, Q) float array
        Height of the ground [m].
    jump : float
        Least difference between the parts [m].
    """
    near = clearance < FAR
    level = np.where(near, level, np.inf)
    ordered = np.sort(level, axis=1)
    with np.errstate(invalid="ignore"):
        rise = np.diff(ordered, axis=1)
    rise[~np.isfinite(rise)] = 0.0
    edge = np.take_along_axis(ordered, rise.argmax(axis=1)[:, None], axis=1)
    upper, lower = near & (level > edge), near & (level <= edge)
    on_upper, on_lower = (np.where(part, clearance, np.inf).min(axis=1) for part in (upper, lower))
    sticks = (rise.max(axis=1) > jump) & (on_upper < 0) & (-on_upper > np.abs(on_lower))
    return np.asarray(upper & sticks[:, None])


def centroid(points: SolePoints, transforms: Array, pressing: Array) -> Array:
    """World position of the middle of pressure at each step, (N, 3) [m].

    Parameters
    ----------
    transforms : (N, P, 4, 4) float array
    pressing : (N, Q) or (1, Q) float array
        Area in contact of each point [m²].
    """
    total = np.zeros((len(transforms), 4))
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


def _patch_points(patch: SolePatch) -> PatchPoints:
    """Every stride-th node of a patch, together of the same area as its outline."""
    stride = max(1, round(np.sqrt(patch.area / POINTS_PER_PATCH) / patch.spacing))
    slope_y, slope_x = np.gradient(patch.heights, patch.spacing)
    nodes = tuple(slice(((count - 1) % stride) // 2, None, stride) for count in patch.heights.shape)
    row, column = np.mgrid[tuple(slice(0, count) for count in patch.heights.shape)]
    x = patch.origin[0] + column[nodes] * patch.spacing
    y = patch.origin[1] + row[nodes] * patch.spacing
    covered = covered_fraction(patch.signed_distance[nodes], patch.spacing * stride)
    inside = covered > 0
    positions = np.stack([x, y, patch.heights[nodes]], axis=-1)[inside]
    normals = np.stack([-slope_x[nodes], -slope_y[nodes], np.ones_like(x)], axis=-1)[inside]
    return PatchPoints(positions, normals, covered[inside] * (patch.area / covered.sum()))


def touching_fraction(clearance: Any, sinkage: Any, tolerance: float) -> Any:
    """Share of each piece of a posed sole that touches the ground, 0 to 1.

    The animated sole does not sink, so that whatever is posed within the sinkage of its lowest point has reached the
    ground too. A tolerance on top stands for what is not known: the softness of skin and shoe and the exact pose.
    It ends in a ramp as wide as itself, so that the area is continuous over space and time.

    Parameters
    ----------
    clearance : float array
        Height above the undisturbed ground, less that of the sole's lowest point [m].
    sinkage : float array
        How far the ground has given way under the lowest point [m].
    tolerance : float [m]
    """
    fraction = sinkage - clearance
    fraction *= 1.0 / tolerance
    fraction += 1.5
    return np.minimum(np.maximum(fraction, 0.0, out=fraction), 1.0, out=fraction)
