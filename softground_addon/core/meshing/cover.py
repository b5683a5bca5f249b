"""Cover of what lies on things: a layer of one thickness on the upward faces of a mesh, rounded off at their edges."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np

from ..errors import InputError
from ..ground.terrain import MeshTerrain
from ..numerics.arrays import Array, Indices

STEEPEST = np.radians(50.0)
"""Slope on which nothing stays [rad]: fresh snow lies on roofs of up to about 50 degrees."""
ACROSS_EDGE = (5, 16)
"""Vertices from the edge of a cover to where it is as thick as it gets: at least, and at most."""
ACROSS = 6
"""Vertices across the narrowest cover, at least."""
MOST = 400_000
"""Vertices of a cover."""
LIFT = 2e-4
"""Height of its edge over what it lies on [m]."""


@dataclass(frozen=True)
class Cover:
    """Upper side of a layer, as a mesh.

    Attributes
    ----------
    vertices : (V, 3) float array
        World positions [m].
    faces : (F, 4) int array
        Counter-clockwise from above.
    thickness : (V,) float array
        Of the layer at each vertex [m].
    """

    vertices: Array
    faces: Indices
    thickness: Array


def cover(vertices: Array, triangles: Indices, thickness: float, spacing: float) -> Cover:
    """The layer on the highest upward faces of a mesh.

    Its profile at an edge is a quarter of a circle. It goes on against what rises beside it, and ends where that drops.

    Parameters
    ----------
    vertices : (V, 3) float array
        World positions of the mesh [m], Z up.
    triangles : (T, 3) int array
        Counter-clockwise from outside.
    thickness : float
        [m]
    spacing : float
        Largest distance of the cover's vertices [m]; less where it is thin or narrow, and more where there would be
        too many.

    Raises
    ------
    InputError
        If no face looks up, or what does is too narrow.
    """
    corners = vertices[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    upward = normal[:, 2] > np.cos(STEEPEST) * np.linalg.norm(normal, axis=1)
    if not upward.any():
        raise InputError("It has no faces that look up", "faces_down", remedy="turn it, or flip its normals.")
    terrain, flat = MeshTerrain.from_mesh(vertices, triangles[upward]), corners[upward][..., :2]
    low, high = flat.min(axis=(0, 1)), flat.max(axis=(0, 1))
    fine = max(min(spacing, thickness / ACROSS_EDGE[0]), thickness / ACROSS_EDGE[1])
    fine = max(min(fine, float((high - low).min()) / ACROSS), sqrt(float(np.prod(high - low)) / MOST))
    count = np.ceil((high - low) / fine * (1.0 - 1e-9)).astype(int)
    x, y = (np.linspace(*each) for each in zip(low, high, count + 1, strict=True))
    steps = (high - low) / count
    base = terrain.heights(*np.meshgrid(x, y))
    distance = _to_edge(base, steps, thickness)
    profile = thickness * np.sqrt(1.0 - (1.0 - np.clip(distance / thickness, 0.0, 1.0)) ** 2)
    around = np.stack([base[:-1, :-1], base[:-1, 1:], base[1:, 1:], base[1:, :-1]])
    lies = np.ptp(around, axis=0) <= np.tan(STEEPEST) * float(np.hypot(*steps))  # which NaN is not
    number = np.arange(base.size).reshape(base.shape)
    faces = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=-1)[lies]
    if not len(faces):
        raise InputError("What of it looks up is too narrow, or its pieces are: choose a larger mesh.", "too_narrow")
    used, faces = np.unique(faces, return_inverse=True)
    place = np.stack([*(each.ravel() for each in np.meshgrid(x, y)), (base + profile + LIFT).ravel()], axis=-1)
    return Cover(place[used], faces.reshape(-1, 4), profile.ravel()[used])


def _to_edge(base: Array, steps: Array, reach: float) -> Array:
    """Distance of places to the nearest where their surface ends or drops, (rows, columns) [m], up to a reach.

    The places are steps (2,) [m] apart, along x and y.
    """
    rows, columns = (min(ceil(reach / steps[1 - axis]) + 1, base.shape[axis]) for axis in (0, 1))
    padded, distance = np.pad(base, ((rows, rows), (columns, columns)), constant_values=np.nan), base * 0.0 + reach
    for row in range(-rows, rows + 1):
        for column in range(-columns, columns + 1):
            away = float(np.hypot(*(steps * (column, row))))
            nearer = away - away / max(abs(row), abs(column), 1)
            if away == 0.0 or nearer >= reach:
                continue
            other = padded[rows + row :, columns + column :][: base.shape[0], : base.shape[1]]
            ends = ~(other >= base - np.tan(STEEPEST) * away)
            distance = np.where(ends, np.minimum(distance, nearer), distance)
    return distance
