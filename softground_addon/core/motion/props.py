"""Rigid bodies that print by whatever faces down: a sphere, a wheel, a ski, a cane, the skin around a hand."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..errors import InputError
from ..numerics.arrays import Array, Indices

FEW_VERTICES = 400
"""Meshes with fewer vertices are probed between them too: the faces of a box are larger than bumps of the ground."""
_CAPSULE_RINGS, _CAPSULE_SIDES = 6, 24
"""Rings of each round end of a capsule, and corners of each."""
_DIRECTIONS = 64
"""Directions in which the outermost points of a body are looked for."""
_FLATTEST = 0.1
"""Least size of a body over its longest extent: a sheet has no volume."""


@dataclass(frozen=True)
class Prop:
    """A rigid body's surface, in a frame that is fixed to it.

    Attributes
    ----------
    vertices : (V, 3) float array
        [m]
    triangles : (T, 3) int array
        Their winding does not matter.
    give : float
        How far the surface itself gives way where it touches [m]: 0 for what is hard, some millimetres for skin.
    """

    vertices: Array
    triangles: Indices
    give: float = 0.0

    @cached_property
    def extent(self) -> Array:
        """Size along the axes of its frame, (3,) [m]."""
        used = self.vertices[np.unique(self.triangles)]
        return np.asarray(np.ptp(used, axis=0))

    @cached_property
    def size(self) -> float:
        """Side of a cube of the volume of its bounding box [m]: the scale of what counts as touching."""
        return float(max(np.cbrt(self.extent.prod()), _FLATTEST * self.extent.max()))

    @cached_property
    def probes(self) -> Array:
        """Points of the surface that tell how high it is above the ground, (Q, 3) [m]."""
        used = self.vertices[np.unique(self.triangles)]
        if len(used) > FEW_VERTICES:
            return used
        corners = self.vertices[self.triangles]
        between = [(corners[:, k] + corners[:, (k + 1) % 3]) / 2 for k in range(3)]
        return np.concatenate([used, *between, corners.mean(axis=1)])


@dataclass(frozen=True)
class MassProperties:
    """Volume [m³] and its centre (3,) [m] of what a surface encloses."""

    volume: float
    centre: Array


def mass_properties(vertices: Array, triangles: Indices) -> MassProperties:
    """Volume and centroid of a closed surface, by the divergence theorem.

    Parameters
    ----------
    vertices : (V, 3) float array [m]
    triangles : (T, 3) int array
        Wound alike.

    Raises
    ------
    InputError
        If there is no triangle.

    Notes
    -----
    A surface that encloses nothing, such as a sheet, has no volume and the centroid of its area.

    Examples
    --------
    >>> corner = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    >>> faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    >>> found = mass_properties(corner, faces)
    >>> round(found.volume, 6), found.centre
    (0.166667, array([0.25, 0.25, 0.25]))
    """
    if not len(triangles):
        raise InputError("A body without faces has no mass: give it faces, or choose another object.", "no_faces")
    corners = np.asarray(vertices, dtype=float)[triangles]
    origin = corners.reshape(-1, 3).mean(axis=0)
    a, b, c = np.moveaxis(corners - origin, 1, 0)
    normal = np.cross(b - a, c - a) / 2
    area = np.linalg.norm(normal, axis=1)
    parts = np.einsum("ni,ni->n", a, normal) / 3
    volume = float(parts.sum())
    third = np.sqrt(max(area.sum(), 1e-300)) ** 3
    if abs(volume) <= 1e-6 * third:
        middle = (area[:, None] * (a + b + c)).sum(axis=0) / (3 * max(area.sum(), 1e-300))
        return MassProperties(0.0, origin + middle)
    centre = (parts[:, None] * (a + b + c)).sum(axis=0) / (4 * volume)
    return MassProperties(abs(volume), origin + centre)


def capsule(start: Array, end: Array, radius: float) -> tuple[Array, Indices]:
    """Vertices (V, 3) and triangles (T, 3) of a rounded bar around a segment: a limb without a skin [m]."""
    along = np.asarray(end, float) - start
    length = float(np.linalg.norm(along))
    axis = along / length if length > 0 else np.array([0.0, 0.0, 1.0])
    aside = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    aside /= np.linalg.norm(aside)
    frame = np.stack([aside, np.cross(axis, aside), axis])
    rings, around = _CAPSULE_RINGS, np.arange(_CAPSULE_SIDES) / _CAPSULE_SIDES * 2 * np.pi
    latitude = np.concatenate([np.linspace(-np.pi / 2, 0, rings), np.linspace(0, np.pi / 2, rings)])
    height = radius * np.sin(latitude) + np.repeat([0.0, length], rings)
    wide = radius * np.cos(latitude)
    circle = np.stack([np.cos(around), np.sin(around)], -1)
    points = np.concatenate(
        [wide[:, None, None] * circle, np.broadcast_to(height[:, None, None], (2 * rings, len(around), 1))], axis=-1
    )
    row, column = np.indices((2 * rings - 1, len(around)))
    a, b = row * len(around) + column, row * len(around) + (column + 1) % len(around)
    halves = [np.stack([a, b, a + len(around)], -1), np.stack([b, b + len(around), a + len(around)], -1)]
    return points.reshape(-1, 3) @ frame + start, np.concatenate(halves).reshape(-1, 3)


def supports(points: Array) -> Array:
    """Those of the points that are furthest out in evenly spread directions, (K, 3) with K at most `_DIRECTIONS`."""
    step = np.arange(_DIRECTIONS) + 0.5
    z = 1 - 2 * step / _DIRECTIONS
    turn = np.pi * (1 + np.sqrt(5.0)) * step  # the golden angle: Fibonacci's lattice on the sphere
    around = np.sqrt(1 - z**2)
    directions = np.stack([around * np.cos(turn), around * np.sin(turn), z], axis=-1)
    return np.asarray(points[np.unique((points @ directions.T).argmax(axis=0))])


def posed(points: Array, pose: Array) -> Array:
    """Points (Q, 3) of a body in the world at a pose (4, 4) or at poses (N, 4, 4), (..., Q, 3) [m]."""
    return np.asarray(points @ np.swapaxes(pose[..., :3, :3], -1, -2) + pose[..., None, :3, 3])
