"""Volume of a body from its skin, cut in slices: it may have holes, layers and parts within parts.

The skin cuts a slice in curves that enclose areas. The area of a closed curve whose faces agree on the inside is exact;
other curves have gaps, and their convex hulls stand for them. Curves within others are clothes, lie inside or are the
same skin with fewer faces, and count once. A curve that encloses next to nothing, such as that of a cape, has no area.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Indices, Mask
from ..numerics.components import components
from ..numerics.slices import Slices, sliced

SLICES = 64
"""Slices along each axis."""
DIRECTIONS = 32
"""Directions in which the extent of a curve is looked for: the hull of a circle then comes out 0.3 % too large."""
ROUND = 0.6
"""Length of an open curve over that around its hull from which it has an inside: 0.5 is a sheet, 0.61 half a circle."""
TWICE, NOTHING = 1.5, 0.1
"""A curve that is so much longer than its hull, around less than this share of it, goes around it both ways."""
WITHIN = 0.05
"""A curve may stick out of one that it lies within by so much of that one's radius: cloth and skin cross."""
SAME = 0.12
"""One of which so much of its own radius sticks out, on average around, is much the same in its place: a copy of the
skin with fewer faces."""
THROUGH = 0.02
"""Share of the extent of a closed piece by which a body goes on at both ends of one that it wears."""
THINNEST = 0.1
"""Share of the volume of a closed piece from which what goes on at both its ends wears it: less is a rod through it."""
MOST_CURVES = 200
"""Curves of one slice that are looked at, the largest first."""
AS_CLOSED = 0.02
"""Slices across another axis than the vertical are taken where so much more of their curves is closed."""
WELD = 1e-5
"""Points nearer than this over the size of the mesh are one: imported meshes are cut open along their edges."""
SHEET = 0.3
"""A piece whose faces come to this share of their area as vectors is an open sheet: a tube or a body comes to 0, a hat
to 0.5, a flat cape to 1."""
OPEN = 2.0
"""A piece is open where the square of its rims' length comes to so many times its area: a sleeve comes to more than 4,
a head that ends at the neck to 1."""
THIN = 0.006
"""A piece of less volume over its area to the power of 1.5 is a sheet of some thickness: 0.09 of a sphere, 0.03 of a
person, 0.02 of a spider's leg."""


def welded(points: Array) -> Indices:
    """Number of the place that each point (V, 3) is at: points that are cut apart have the same."""
    size = max(float(np.ptp(points, axis=0).max(initial=0.0)), 1e-12)
    cell = np.round(points / (WELD * size))
    cell -= cell.min(axis=0)  # less than 2^17 each, so that one number tells all three
    return np.asarray(np.unique(cell @ [2.0**34, 2.0**17, 1.0], return_inverse=True)[1])


@dataclass(frozen=True)
class Pieces:
    """Kind of the piece that each triangle belongs to.

    Attributes
    ----------
    is_sheet : (T,) bool array
        True of an open or a thin sheet, such as a cape, a hat or hair.
    is_cloth : (T,) bool array
        True of a sheet or a piece with wide openings, such as a shirt: if there is skin within, that is the body.
    number : (T,) int array
        The piece of each.
    """

    is_sheet: Mask
    is_cloth: Mask
    number: Indices


def pieces(points: Array, triangles: Indices) -> Pieces:
    """Distinguish sheets and clothes from bodies, by connected pieces.

    Parameters
    ----------
    points : (V, 3) float array
        [m]
    triangles : (T, 3) int array
        Vertices at one place are one where `welded` merges them.
    """
    ends = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)]).T
    piece = components(len(points), *ends)[triangles[:, 0]]
    count = int(piece.max(initial=-1)) + 1

    def total(values: Array) -> Array:
        return np.bincount(piece, values, count).astype(float)

    a, b, c = np.moveaxis(points[triangles], 1, 0)
    normal = np.cross(b - a, c - a) / 2
    area = total(np.linalg.norm(normal, axis=1))
    opening = np.linalg.norm([total(along) for along in normal.T], axis=0)
    middle = np.stack([total(along) for along in a.T], axis=-1) / np.maximum(total(np.ones(len(a))), 1.0)[:, None]
    volume = np.abs(total(np.einsum("ti,ti->t", a - middle[piece], normal) / 3))
    edge = np.minimum(*ends) * len(points) + np.maximum(*ends)
    ordered = np.sort(edge)
    twice = ordered[1:] == ordered[:-1]
    lone = np.append(ordered[~(np.append(twice, False) | np.append(False, twice))], -1)  # few, of most skins
    rim = np.flatnonzero(lone[np.searchsorted(lone[:-1], edge)] == edge)
    length = np.linalg.norm(np.subtract(*points[ends[:, rim]]), axis=1)
    around = np.bincount(piece[rim % len(triangles)], length, count)
    sheet = (opening > SHEET * area) | (volume < THIN * area**1.5)
    return Pieces(sheet[piece], (sheet | (around**2 > OPEN * area))[piece], piece)


@sliced
def body_volume(points: Array, triangles: Indices) -> Slices[float]:
    """Volume that a skin encloses [m³], 0 where it encloses nothing.

    Parameters
    ----------
    points : (V, 3) float array
        [m]
    triangles : (T, 3) int array
        Vertices at one place are one where `welded` merges them.
    """
    if not len(triangles):
        return 0.0
    # From the least corner on: those that face the other way, as of a skin with two sides, are no copies.
    corners = np.take_along_axis(triangles, (triangles.argmin(axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    _, once = np.unique((corners[:, 0] * len(points) + corners[:, 1]) * len(points) + corners[:, 2], return_index=True)
    triangles = triangles[once]  # a copy of the skin in its place, as an outline or another level of detail, is none
    known = pieces(points, triangles)
    best, closed = 0.0, -1.0
    for axis in (2, 0, 1):
        if closed > 1 - AS_CLOSED:
            break
        yield
        volume, share = _volume_along(np.roll(points, 2 - axis, axis=1), triangles, known)
        if share > closed + AS_CLOSED:
            best, closed = volume, share
    return best


def _volume_along(points: Array, triangles: Indices, known: Pieces) -> tuple[float, float]:
    """Volume by slices across z, and the share of the curves' length that is of closed ones."""
    low, high = points[triangles, 2].min(), points[triangles, 2].max()
    spacing = (high - low) / SLICES
    if not spacing > 0:
        return 0.0, 0.0
    cut = _cut(points, (points[:, 2] - low) / spacing - 0.5, triangles)
    curve = components(len(cut.points), cut.start, cut.end)
    order = np.argsort(curve, kind="stable")
    first = np.flatnonzero(np.diff(curve[order], prepend=-1))
    count = len(first)
    of_segment = curve[cut.start]
    balance = np.bincount(cut.start, minlength=len(curve)) - np.bincount(cut.end, minlength=len(curve))
    closed = np.maximum.reduceat(np.abs(balance)[order], first) == 0
    begin, end = cut.points[cut.start], cut.points[cut.end]
    length = np.bincount(of_segment, np.linalg.norm(end - begin, axis=1), count)
    encloses = np.abs(np.bincount(of_segment, begin[:, 0] * end[:, 1] - begin[:, 1] * end[:, 0], count)) / 2
    turn = np.arange(DIRECTIONS) * 2 * np.pi / DIRECTIONS
    support = np.maximum.reduceat((cut.points @ [np.cos(turn), np.sin(turn)])[order], first, axis=0)
    hull, around = _hulls(support)
    of_curve = cut.triangle[np.unique(of_segment, return_index=True)[1]]
    is_round = (length > ROUND * around) & ~known.is_sheet[of_curve]
    area = np.where(closed, np.minimum(encloses, hull), np.where(is_round, hull, 0.0))
    area = np.where(closed & (encloses < NOTHING * hull) & (length > TWICE * around), hull, area)
    height = points[triangles, 2]
    ends = np.full((2, known.number.max() + 1), [[np.inf], [-np.inf]])
    np.minimum.at(ends[0], known.number, height.min(axis=1))
    np.maximum.at(ends[1], known.number, height.max(axis=1))
    ends = np.append(ends, [np.bincount(known.number[of_curve], area, ends.shape[1])], axis=0)
    ends, cloth = ends[:, known.number[of_curve]], known.is_cloth[of_curve]
    slices = _by_slice(cut.slice[order[first]], area)
    total = sum(_united(support[at], area[at], around[at], cloth[at], ends[:, at]) for at in slices)
    return float(total) * spacing, float(length[closed].sum() / max(length.sum(), 1e-300))


@dataclass(frozen=True)
class _Cut:
    """Curves of a skin in its slices: points (N, 2), the slice of each (N,), segments between them and the triangle of
    each (S,)."""

    points: Array
    slice: Indices
    start: Indices
    end: Indices
    triangle: Indices


def _cut(points: Array, level: Array, triangles: Indices) -> _Cut:
    """The curves of triangles at whole levels; the inside is to the left of a segment where faces face outward."""
    corner = level[triangles]
    first = np.ceil(corner.min(axis=1)).astype(np.intp)
    number = np.ceil(corner.max(axis=1)).astype(np.intp) - first
    which = np.repeat(np.arange(len(triangles)), number)
    plane = np.arange(len(which)) - np.repeat(np.cumsum(number) - number, number) + first[which]
    below = corner[which] <= plane[:, None]
    upward = below.sum(axis=1) == 1  # one corner below and two above, or the other way round
    lone = np.where(upward, below.argmax(axis=1), below.argmin(axis=1))
    at, after, before = (triangles[which, (lone + step) % 3] for step in range(3))
    ends = np.where(upward, after, before), np.where(upward, before, after)
    count = len(points)
    keys = np.concatenate(
        [(plane * count + np.minimum(at, to)) * count + np.maximum(at, to) for to in ends]
    )  # a crossing belongs to an edge, so that neighbours share it
    keys, node = np.unique(keys, return_inverse=True)
    plane, (tail, head) = keys // count**2, np.divmod(keys % count**2, count)
    share = (plane - level[tail]) / (level[head] - level[tail])
    crossing = points[tail, :2] + share[:, None] * (points[head, :2] - points[tail, :2])
    start, end = np.split(node.ravel(), 2)
    return _Cut(crossing - points[:, :2].mean(axis=0), plane, start, end, which)


def _hulls(support: Array) -> tuple[Array, Array]:
    """Area of the convex hulls of curves with some extents (C, DIRECTIONS), and the length around them."""
    step = 2 * np.pi / DIRECTIONS
    beside = np.roll(support, 1, axis=1) + np.roll(support, -1, axis=1)
    side = (beside - 2 * support * np.cos(step)) / np.sin(step)
    return (support * side).sum(axis=1) / 2, side.sum(axis=1)


def _by_slice(number: Indices, area: Array) -> list[Indices]:
    """Curves of each slice, the largest first, without those that enclose nothing."""
    order = np.lexsort((-area, number))
    order = order[area[order] > 0]
    return [curves[:MOST_CURVES] for curves in np.split(order, np.flatnonzero(np.diff(number[order])) + 1)]


def _united(support: Array, area: Array, around: Array, cloth: Mask, ends: Array) -> float:
    """Area of curves, the largest first, without those within a larger one and without cloth around skin.

    Cloth is also a closed piece, such as a skirt, through which another goes on at both ends that is no thin rod.
    `ends` (3, C) are the lowest and the highest height of the piece of each curve, and the area that it has in all.
    """
    sticks_out = np.maximum(support[None] - support[:, None], 0.0)
    within = sticks_out.max(axis=2) <= WITHIN * around[:, None] / (2 * np.pi)
    within = np.triu(within | (sticks_out.mean(axis=2) <= SAME * around / (2 * np.pi)), 1)
    low, high, holds = ends
    reach = THROUGH * (high - low)[:, None]
    through = (low < low[:, None] - reach) & (high > high[:, None] + reach) & (holds > THINNEST * holds[:, None])
    visible = ~(within & (cloth[:, None] | through) & ~cloth).any(axis=1)
    return float(area[visible & ~(within & visible[:, None]).any(axis=0)].sum())
