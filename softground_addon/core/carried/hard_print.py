"""A sole on a hard floor: a small grid that is fixed to it, how hard it presses, and where it lies on the floor.

What prints by whatever faces down, such as a wheel, presses a grid that lies on the floor.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..ground.hard_ground import HardOnSoft, up_to
from ..ground.terrain import SAME_LAYER
from ..motion.props import Prop, posed
from ..motion.sole_motion import Sole
from ..numerics.arrays import Array, Indices
from ..numerics.rigid import inverse
from ..soles.patch_maps import Nodes, covered_fraction, distance_beyond
from ..soles.undersides import lowest_surface
from .film import zone_of

ALONG_SOLE = 11.5
"""Cells of the grid along a sole, no even number, so that no node is right on a straight outline: 2.6 cm for an adult,
10 kB a step in a file. The outline between them is that of the
distances to it."""
ACROSS_PROP = 24
"""Nodes along a cube as large as a wheel, a ball or a hand."""
BEDDING = 1e7
"""Stiffness of a sole [Pa/m]: 2 cm of midsole of 0.2 MPa. It gives 4 mm under a person, which forgives poses."""
CLEARANCE = 0.3e-3
"""Height of a mark over its floor [m]."""
STEEPEST = 1.0
"""Slope of the floor from node to node beyond which a mark ends, as at the edge of a stair."""


@dataclass(frozen=True)
class SoleGrid:
    """Nodes all over the underside of a sole, and one ring around it.

    Attributes
    ----------
    points : (N, 3) float array
        In the frames of their patches [m].
    patch : (N,) int array
    sole : (N, 3) float array
        Distance from the heel along the sole, from its middle to the left, and to the outline, negative inside [m].
    area : (N,) float array
        That each node stands for [m²].
    zone : (N,) int array
        See `film.ZONES`.
    faces : (F, 4) int array
        Nodes of each, counter-clockwise from above.
    spacing : float
        [m]
    """

    points: Array
    patch: Indices
    sole: Array
    area: Array
    zone: Indices
    faces: Indices
    spacing: float


@dataclass(frozen=True)
class HardPrint:
    """A sole's grid as a contact lays it on a hard floor.

    Attributes
    ----------
    position : (N, 3) float array
        [m], NaN where no floor is.
    pressure : (N,) float array
        Largest during the contact [Pa].
    touched : (N,) int array
        Step of the contact at which each node first presses, or one that shares a face with it.
    faces : (F, 4) int array
        Those of the grid that lie on the floor and have been pressed.
    """

    position: Array
    pressure: Array
    touched: Indices
    faces: Indices


def sole_grid(sole: Sole, flat: Array) -> SoleGrid:
    """The grid of a sole whose patches have these poses (P, 4, 4) while it is flat."""
    low, high = sole.outline.min(axis=0), sole.outline.max(axis=0)
    spacing = float(high[0] - low[0]) / ALONG_SOLE
    middle, reach = (low + high) / 2, np.ceil((high - low) / 2 / spacing) + 1
    x, y = (m + spacing * np.arange(-r, r + 1) for m, r in zip(middle, reach, strict=True))
    place = np.stack(
        [*(axis.ravel() for axis in np.meshgrid(x, y)), np.zeros(len(x) * len(y)), np.ones(len(x) * len(y))]
    )
    points, distance = [], []
    for patch, pose in zip(sole.patches, flat, strict=True):
        local = (inverse(pose) @ flat[0] @ place)[:3]
        across = [axis.astype(np.float32) for axis in local[:2]]
        nodes = Nodes.under(patch, *across)
        distance.append(nodes.interpolate(patch.signed_distance) + distance_beyond(patch, *across))
        points.append(np.stack([*local[:2], nodes.interpolate(patch.heights)], axis=-1))
    owner, each = np.argmin(distance, axis=0), np.arange(place.shape[1])
    nearest = np.asarray(np.min(distance, axis=0), float)
    corner = (np.arange(len(y) - 1)[:, None] * len(x) + np.arange(len(x) - 1)).ravel()
    faces = corner[:, None] + np.array([0, 1, len(x) + 1, len(x)])
    faces = faces[(nearest[faces] < 0).any(axis=1)]
    used, faces = np.unique(faces, return_inverse=True)
    along = place[0, used] - low[0]
    return SoleGrid(
        np.array(points)[owner, each][used],
        owner[used],
        np.stack([along, place[1, used] - middle[1], nearest[used]], axis=-1),
        covered_fraction(nearest[used], spacing) * spacing**2,
        zone_of(along / (high[0] - low[0])),
        faces.reshape(-1, 4),
        spacing,
    )


def bedded(gap: Array, area: Array, force: Array) -> Array:
    """Pressures (T, N) under an elastic sole that forces (T,) press onto a floor [Pa].

    Each node presses by `BEDDING` times how far it is pushed in (Winkler's foundation): so far that all bear the force.

    Parameters
    ----------
    gap : (T, N) float array
        Heights of the unloaded sole over the floor [m], from any level; infinite where nothing bears.
    area : (N,) float array
        [m²]
    force : (T,) float array
        [N]
    """
    order = np.argsort(gap, axis=1)
    height = np.take_along_axis(gap, order, axis=1)
    known = np.isfinite(height)
    lowest = np.where(known[:, :1], height[:, :1], 0.0)
    height = np.where(known, height - lowest, 0.0)
    bearing = area[order] * known
    total, moment = np.cumsum(bearing, axis=1), np.cumsum(bearing * height, axis=1)
    pushed = (force[:, None] / BEDDING + moment) / np.maximum(total, 1e-300)
    bears = known & (pushed > height) & (total > 0)
    last = np.where(bears.any(axis=1), bears.shape[1] - 1 - bears[:, ::-1].argmax(axis=1), 0)
    depth = np.where(bears.any(axis=1), np.take_along_axis(pushed, last[:, None], axis=1)[:, 0], 0.0) + lowest[:, 0]
    return np.asarray(BEDDING * np.maximum(depth[:, None] - gap, 0.0) * (area > 0))


def laid(grid: SoleGrid, poses: Array, force: Array, terrain: HardOnSoft, tolerance: float) -> HardPrint:
    """The print of a contact on a hard floor.

    Parameters
    ----------
    poses : (T, P, 4, 4) float array
        Of the sole's patches during the contact.
    force : (T,) float array
        Normal force [N].
    tolerance : float
        Height above a node up to which a surface is its floor [m].
    """
    pose = poses[:, grid.patch]
    places = np.einsum("tnij,nj->tni", pose[..., :3, :3], grid.points) + pose[..., :3, 3]
    x, y, z = np.moveaxis(places, -1, 0)
    gap = z - _floor(terrain, x, y, z + tolerance)
    gap = np.where(np.isfinite(gap), gap, np.inf)
    pressure = bedded(gap, grid.area, force)
    # Where it is pressed most it lies; what is not pressed, where it was while most of the sole was.
    weight = pressure**2 + 1e-3 * (pressure > 0).mean(axis=1, keepdims=True) ** 4 + 1e-12
    position = (weight[..., None] * places).sum(axis=0) / weight.sum(axis=0)[:, None]
    x, y, z = position.T
    position[:, 2] = _floor(terrain, x, y, z + tolerance) + CLEARANCE
    return _pressed(grid, position, pressure)


def prop_spacing(prop: Prop) -> float:
    """Distance between the nodes that a body presses [m]."""
    return prop.size / ACROSS_PROP


def swept(
    prop: Prop,
    poses: Array,
    force: Array,
    terrain: HardOnSoft,
    tolerance: float,
    others: tuple[bool, bool] = (False, False),
) -> tuple[SoleGrid, HardPrint] | None:
    """What a body sweeps on hard floors as it rolls, slides or rests there; None where no floor is under it.

    Parameters
    ----------
    poses : (T, 4, 4) float array
    force, terrain, tolerance
        As of `laid`.
    others : (bool, bool), optional
        True if the first and the last pose are those of prints before and after: what they press most is of these.

    Returns
    -------
    SoleGrid
        Nodes on the floor, all in the first zone; along the way of the body, from its left side.
    HardPrint
    """
    spacing, bodies = prop_spacing(prop), posed(prop.vertices, poses)
    near = bodies[..., 2] < bodies[..., 2].min(axis=1, keepdims=True) + 2 * spacing + prop.give
    low, high = (bodies[near, :2].min(axis=0) - spacing, bodies[near, :2].max(axis=0) + spacing)
    columns, rows = np.ceil((high - low) / spacing).astype(int) + 1
    lower = np.stack([lowest_surface(body, prop.triangles, low, (rows, columns), spacing).ravel() for body in bodies])
    y, x = (
        low[axis] + spacing * index.ravel() for axis, index in zip((1, 0), np.indices((rows, columns)), strict=True)
    )
    floor = _floor(terrain, x, y, lower.min(axis=0) + tolerance)
    if np.isnan(floor).all():
        return None
    gap = np.where(np.isnan(floor), np.inf, lower - floor)
    pressure = bedded(gap, np.full(len(x), spacing**2), force)
    most = pressure.argmax(axis=0)
    pressure *= ~((most == 0) & others[0] | (most == len(poses) - 1) & others[1])
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    way = poses[-1, :2, 3] - poses[0, :2, 3]
    ahead = way / np.linalg.norm(way) if np.linalg.norm(way) > spacing else np.array((1.0, 0.0))
    offset = np.stack([x, y], axis=-1) - poses[0, :2, 3]
    presses = pressure.max(axis=0) > 0
    grid = SoleGrid(
        np.zeros((len(x), 3)),
        np.zeros(len(x), np.intp),
        np.stack([offset @ ahead, offset @ (-ahead[1], ahead[0]), spacing * (0.5 - presses)], axis=-1),
        presses * spacing**2,
        np.zeros(len(x), np.intp),
        corner[:, None] + np.array([0, 1, columns + 1, columns]),
        spacing,
    )
    return grid, _pressed(grid, np.stack([x, y, floor + CLEARANCE], axis=-1), pressure)


def _pressed(grid: SoleGrid, position: Array, pressure: Array) -> HardPrint:
    """The print of pressures (T, N) on nodes that lie at positions (N, 3)."""
    largest = pressure.max(axis=0)
    height = position[grid.faces, 2]
    is_even = np.ptp(height, axis=1) <= STEEPEST * grid.spacing  # false where a corner has no floor
    faces = grid.faces[is_even & (largest[grid.faces] > 0).any(axis=1)]
    retained = np.zeros(len(largest), bool)
    retained[faces] = True
    touched = np.where(largest > 0, (pressure > 0).argmax(axis=0), len(pressure))
    first = touched[faces].min(axis=1, initial=len(pressure))
    beside = touched.copy()
    np.minimum.at(beside, faces, first[:, None])
    return HardPrint(position, largest * retained, np.where(largest > 0, touched, beside), faces)


def _floor(terrain: HardOnSoft, x: Array, y: Array, limit: Array) -> Array:
    """Heights of hard surfaces up to a limit, NaN where there is none or soft ground lies over it [m]."""
    below = up_to(terrain, limit)
    assert isinstance(below, HardOnSoft)
    hard, soft = below.hard_heights(x, y), terrain.ground.heights(x, y)
    return np.where(soft > hard + SAME_LAYER, np.nan, hard)
