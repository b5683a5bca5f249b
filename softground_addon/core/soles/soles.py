"""Soles: the undersides of feet and objects, from their meshes or from the proportions of a human foot.

Everything is built in the *sole frame*: x toward the toes, y left, z up, as the sole lies flat on the ground.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..motion.props import Prop, supports
from ..motion.sole_motion import Sole, SolePatch
from ..numerics.arrays import Array
from ..numerics.bilinear import sample_map
from ..numerics.interpolation import cubic
from .outlines import area, as_one_polygon, convex_hull, signed_distance, trace_loops
from .undersides import SUPERSAMPLING, continue_outside, underside_map

FOOT_BREADTH = 0.373
"""Breadth over length of a foot: 10.06 cm / 26.97 cm, means of 1774 men (Gordon et al. 1989, NATICK/TR-89/044)."""

BALL_POSITION = 0.73
"""Distance heel to ball over foot length: 19.7 cm / 26.97 cm (same survey)."""

ANKLE_POSITION = 0.26
"""Distance from the back of the heel to the ankle joint over foot length (talus and calcaneus of Delp et al. 1990 with
2 cm of heel pad)."""

ANKLE_HEIGHT = 0.26
"""Height of the ankle joint over foot length: 0.039 H / 0.152 H (Drillis and Contini 1966)."""

FOOT_TO_LEG = 0.152 / (0.245 + 0.246)
"""Foot length over thigh plus shank, from the same proportions of stature H."""

NODES_PER_LENGTH = 54
"""Nodes along a sole: 5 mm apart for a foot of 27 cm."""

SOLES_REMEMBERED = 8
"""Soles of meshes that are not worked out again when a rig is read again."""

_MARGIN = 3
"""Nodes of a map around the sole."""

_SEAM = 0.06
"""Overlap of foot and toes over sole length, so that bent toes leave no gap under the ball."""

_BEND = 0.3
"""Distance behind and before the ball in which the skin of a bare foot moves with both foot and toes, over sole length:
feet that roll slide least on the captured motions with this."""

_WIDEST_BEND = 0.5
"""The most of it that is looked for in a skin."""

_UNDERSIDE_BAND = 0.10
"""Part of the foot that counts as its underside: up to this height over sole length (arches yes, instep no)."""

_LANDMARK_INSET = 0.05
"""Distance of heel and toe landmarks from the ends over sole length: where the pad carries, not where it curls up."""

_OUTLINE = np.array(
    [
        (0.000, 0.00), (0.025, 0.20), (0.090, 0.325), (0.220, 0.36), (0.420, 0.405), (0.600, 0.465), (0.720, 0.475),
        (0.830, 0.42), (0.920, 0.29), (0.975, 0.09), (1.000, -0.14), (0.990, -0.30), (0.940, -0.42), (0.850, -0.49),
        (0.730, -0.525), (0.600, -0.44), (0.450, -0.30), (0.300, -0.27), (0.180, -0.31), (0.090, -0.32), (0.025, -0.20),
    ]
)  # fmt: skip
"""Outline of a left foot: (distance from the heel over length, distance to the left of the axis over breadth); the big
toe and the arch are on the right (medial) side. Drawn after the outline of a standing foot of the proportions above."""

_CURVE_POINTS = 6
"""Points of the outline from one of these to the next."""

_ARCH_RELIEF, _HEEL_RELIEF, _TOE_RELIEF = 0.020, 0.012, 0.020
"""Heights over foot length of the medial arch, the back of the heel and the toe tips: slight, as under load."""


@dataclass(frozen=True)
class PlacedSole:
    """A sole and where its patches lie in the sole frame it was built in.

    Attributes
    ----------
    placements : (P, 4, 4) float array
        Patch frame to sole frame [m].
    """

    sole: Sole
    placements: Array


def anatomical_sole(
    length: float,
    *,
    name: str,
    side: str,
    ball: float | None = None,
    medial: float | None = None,
) -> PlacedSole:
    """Sole of a human foot of the given size, heel at x = 0 and toes at x = `length`.

    Parameters
    ----------
    length : float
        Foot length [m].
    name, side : str
        As in `Sole`.
    ball : float, optional
        Where the toes bend, as distance from the heel [m]; none gives a sole of one piece.
    medial : float, optional
        Side of the other foot: -1 right (a left foot), +1 left, 0 a symmetric sole; from `side` where not given.

    Returns
    -------
    PlacedSole
        About 200 cm² for an adult.

    Raises
    ------
    InputError
        If the length is not a positive number.
    """
    if not (np.isfinite(length) and length > 0):
        raise InputError(f"The sole '{name}' would be {length} m long: give it a positive size.", "sole_length")
    breadth = FOOT_BREADTH * length
    medial = {"L": -1.0, "R": 1.0}.get(side, 0.0) if medial is None else medial
    outline = _smooth_loop(_outline_for(medial)) * (length, breadth)

    grid = _Grid.around(outline, length / NODES_PER_LENGTH)
    x, y = grid.nodes[..., 0] / length, grid.nodes[..., 1] / breadth
    toward_medial = 0.5 + 0.5 * np.tanh(6.0 * y * medial) if medial else 0.5
    heights = length * (
        _ARCH_RELIEF * np.exp(-(((x - 0.42) / 0.13) ** 2)) * toward_medial
        + _HEEL_RELIEF * np.clip(1 - x / 0.10, 0.0, 2.0) ** 2
        + _TOE_RELIEF * np.clip((x - 0.86) / 0.14, 0.0, 2.0) ** 2
    )
    ball_x = BALL_POSITION * length if ball is None else ball
    placed = _assemble(grid, heights, [outline], ball_x, split=ball is not None, name=name, side=side)
    return dataclasses.replace(placed, sole=dataclasses.replace(placed.sole, bend=_BEND * length))


def sole_from_underside(
    vertices: Array,
    triangles: NDArray[np.intp],
    *,
    name: str,
    side: str,
    ball: float | None = None,
    toe_weight: Array | None = None,
) -> PlacedSole:
    """Sole of a foot from its mesh: boots, heels and bare feet print differently.

    Parameters
    ----------
    vertices : (V, 3) float array
        The foot in the sole frame, lying flat [m].
    triangles : (T, 3) int array
    name, side : str
        As in `Sole`.
    ball : float, optional
        x of the line about which the toes bend [m]; none gives a sole of one piece.
    toe_weight : (V,) float array, optional
        Share of each vertex that moves with the toes.

    Returns
    -------
    PlacedSole

    Raises
    ------
    InputError
        If the mesh has no underside to speak of.
    """
    arrays = (vertices, float), (triangles, np.intp), (toe_weight, float)
    content = (None if values is None else np.asarray(values, kind).tobytes() for values, kind in arrays)
    return _from_underside(*content, name, side, ball)


@lru_cache(SOLES_REMEMBERED)
def _from_underside(
    places: bytes, corners: bytes, weights: bytes | None, name: str, side: str, ball: float | None
) -> PlacedSole:
    """See `sole_from_underside`: each reading of a rig asks for the same again."""
    vertices, triangles = np.frombuffer(places).reshape(-1, 3), np.frombuffer(corners, np.intp).reshape(-1, 3)
    toe_weight = None if weights is None else np.frombuffer(weights)
    used = vertices[np.unique(triangles)] if len(triangles) else np.empty((0, 3))
    extent = np.ptp(used[:, :2], axis=0) if len(used) else np.zeros(2)
    if not np.isfinite(extent).all() or min(extent) <= 1e-4 * max(*extent, 1e-9):
        raise _no_underside(name, ": it needs faces that look down when it stands")
    length = float(max(extent))
    grid = _Grid.around(used[:, :2], length / NODES_PER_LENGTH)
    heights, coverage, samples = underside_map(
        vertices, triangles, grid.origin, grid.shape, grid.spacing, band=_UNDERSIDE_BAND * length
    )
    loops = trace_loops(coverage, grid.origin, grid.spacing)
    loops = [loop for loop in loops if abs(area([loop])) > 2 * grid.spacing**2]
    if not loops:
        raise _no_underside(name, " larger than a point")
    ball_x = float(used[:, 0].min() + BALL_POSITION * extent[0]) if ball is None else ball
    placed = _assemble(grid, continue_outside(heights), loops, ball_x, split=ball is not None, name=name, side=side)
    first = _MARGIN * SUPERSAMPLING + SUPERSAMPLING // 2
    columns, rows = first + np.ceil(extent / grid.spacing * SUPERSAMPLING).astype(int)
    drawn = samples[first:rows, first:columns]
    bend = 0.0 if ball is None or toe_weight is None else _bend(used, toe_weight[np.unique(triangles)], ball_x)
    return dataclasses.replace(placed, sole=dataclasses.replace(placed.sole, underside=drawn[::-1].T, bend=bend))


def _no_underside(name: str, why: str) -> InputError:
    remedy = "Give the sole another object, or let it use the foot bones."
    return InputError(f"The mesh of the sole '{name}' has no underside{why}. {remedy}", "no_underside", sole=name)


def _bend(vertices: Array, toe_weight: Array, ball: float) -> float:
    """Distance behind and before the ball in which the underside's weights go from foot to toes [m], by least squares.

    0 for a crease that is no wider than the seam of the pieces.
    """
    length = float(np.ptp(vertices[:, 0]))
    low = vertices[:, 2] < vertices[:, 2].min() + _UNDERSIDE_BAND * length
    tried = np.linspace(0.0, _WIDEST_BEND, 51)[1:] * length
    ramp = np.clip(0.5 + (vertices[low, 0] - ball) / (2 * tried[:, None]), 0.0, 1.0)
    bend = float(tried[((ramp - toe_weight[low]) ** 2).sum(axis=1).argmin()])
    return bend if bend > _SEAM * length / 2 + 1e-9 else 0.0


def prop_sole(vertices: Array, triangles: NDArray[np.intp], *, name: str, side: str = "", give: float = 0.0) -> Sole:
    """Sole of a rigid body that prints by whatever faces down: a ball, a wheel, a snowshoe, a hand.

    Parameters
    ----------
    vertices : (V, 3) float array
        The body in a frame of its own, best with its centre of mass at the origin [m].
    triangles : (T, 3) int array
    name, side : str
        As in `Sole`.
    give : float
        Compression of its own surface, over its size; see `props.Prop`.

    Raises
    ------
    InputError
        If it has no faces.
    """
    if not len(triangles):
        raise InputError(f"The mesh of '{name}' has no faces to print with: choose another object.", "no_faces")
    hard = Prop(np.asarray(vertices, dtype=float), triangles)
    prop = dataclasses.replace(hard, give=give * hard.size)
    landmarks = supports(prop.probes)
    outline = convex_hull(prop.probes[:, :2])
    return Sole(name, side, (), landmarks, np.zeros(len(landmarks), dtype=np.intp), outline, prop)


@dataclass(frozen=True)
class _Grid:
    """Nodes of a map in the sole frame."""

    origin: Array
    spacing: float
    shape: tuple[int, int]

    @classmethod
    def around(cls, points: Array, spacing: float) -> _Grid:
        low, high = points.min(axis=0), points.max(axis=0)
        columns, rows = np.ceil((high - low) / spacing).astype(int) + 2 * _MARGIN
        return cls(low - _MARGIN * spacing, spacing, (int(rows), int(columns)))

    @property
    def nodes(self) -> Array:
        row, column = np.indices(self.shape)
        return np.asarray(self.origin + self.spacing * np.stack([column, row], axis=-1), dtype=float)


def _assemble(
    grid: _Grid, heights: Array, loops: Sequence[Array], ball: float, *, split: bool, name: str, side: str
) -> PlacedSole:
    """Cut the flat sole at the ball, give each piece its own frame, and mark heel, ball and toe tip."""
    distance = signed_distance(grid.nodes, loops)
    x = grid.nodes[..., 0]
    back = float(min(loop[:, 0].min() for loop in loops))
    front = float(max(loop[:, 0].max() for loop in loops))
    length = front - back
    split = split and back + 0.3 * length < ball < front - 0.05 * length
    half_seam = _SEAM * length / 2
    pieces = (
        [np.maximum(distance, x - ball - half_seam), np.maximum(distance, ball - half_seam - x)]
        if split
        else [distance]
    )

    patches, placements = _patches(grid, heights, pieces)
    inset = _LANDMARK_INSET * length
    stations = np.array([back + inset, np.clip(ball, back + 2 * inset, front - 2 * inset), front - inset])
    landmark_patch = np.array([0, 0, len(patches) - 1])
    middle = [_middle(grid, distance, station) for station in stations]
    flat = np.column_stack([stations, middle])
    z = sample_map(heights, flat, grid.origin, grid.spacing) - placements[landmark_patch, 2, 3]
    return PlacedSole(
        sole=Sole(
            name=name,
            side=side,
            patches=patches,
            landmarks=np.column_stack([flat, z]),
            landmark_patch=landmark_patch,
            outline=as_one_polygon(loops),
        ),
        placements=placements,
    )


def _patches(grid: _Grid, heights: Array, pieces: Sequence[Array]) -> tuple[tuple[SolePatch, ...], Array]:
    """Pieces of a sole, by the distance from their outline, each in a frame of its own; where those are, (P, 4, 4)."""
    patches = []
    placements = np.tile(np.eye(4), (len(pieces), 1, 1))
    for piece, placement in zip(pieces, placements, strict=True):
        rows, columns = _window(piece < 2 * grid.spacing)
        inside = piece < 0
        lowest = float(heights[inside].min()) if inside.any() else float(heights.min())
        placement[2, 3] = lowest
        patches.append(
            SolePatch(
                heights=heights[rows, columns] - lowest,
                signed_distance=piece[rows, columns],
                origin=grid.origin + grid.spacing * np.array([columns.start, rows.start]),
                spacing=grid.spacing,
            )
        )
    return tuple(patches), placements


def _window(mask: NDArray[np.bool_]) -> tuple[slice, slice]:
    """Smallest window that holds all of a mask."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return slice(int(rows[0]), int(rows[-1]) + 1), slice(int(columns[0]), int(columns[-1]) + 1)


def _middle(grid: _Grid, distance: Array, station: float) -> float:
    """y of the deepest place inside the outline at a station along the sole."""
    column = int(np.clip(round((station - grid.origin[0]) / grid.spacing), 0, grid.shape[1] - 1))
    weight = np.clip(-distance[:, column], 0.0, None)
    y = grid.nodes[:, column, 1]
    return float(weight @ y / weight.sum()) if weight.any() else float(y[distance[:, column].argmin()])


def _outline_for(medial: float) -> Array:
    """Control points of the outline with the arch on the given side, counter-clockwise."""
    if medial < 0:
        return _OUTLINE[::-1].copy()
    mirrored: Array = _OUTLINE * (1.0, -1.0)
    if medial > 0:
        return mirrored
    half = len(_OUTLINE) // 2 + 1
    breadth = (np.abs(_OUTLINE[1:half, 1]) + np.abs(_OUTLINE[: half - 1 : -1, 1])[: half - 1]) / 2
    right = np.column_stack([_OUTLINE[1:half, 0], -breadth])
    ends = np.array([[(0.0, 0.0)], [(1.0, 0.0)]])
    return np.concatenate([ends[0], right, ends[1], (right * (1, -1))[::-1]])


def _smooth_loop(control: Array) -> Array:
    """Closed Catmull-Rom curve through control points (N, 2)."""
    around = np.concatenate([control[-1:], control, control[:2]])
    return cubic(around, 1 + np.arange(len(control) * _CURVE_POINTS) / _CURVE_POINTS)
