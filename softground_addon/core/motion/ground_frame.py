"""The frame in which a bake is solved: the ground stands still in it near its origin, and up is Z."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..numerics.arrays import Array
from .ground_ride import GroundRide

Rows = tuple[tuple[float, ...], ...]

ALIGNED = 1e-5
"""Largest angle between axes that count as parallel [rad]: single precision resolves no less."""


@dataclass(frozen=True)
class GroundFrame:
    """Frame in which a shot is solved on ground that moves, is far away, or has sideways gravity.

    Attributes
    ----------
    matrix : tuple of 4 rows
        World to this frame, or where it moves, the ground's own space to this frame [Blender units].
    moves : bool
    first : float
        Scene frame of the first sample of its path.
    path : (F, 4, 4) float array or None
        World to this frame, at each scene frame, while a moving ground is read [Blender units].
    ride : GroundRide or None
        Accelerations of a moving ground, while it is read.
    riding : mapping of str to (4, 4) float array
        Objects that move with the ground, by full name: their own space to this frame [Blender units].
    """

    matrix: Rows
    moves: bool = field(default=False, metadata={"said_if_on": True})
    first: float = field(default=0.0, compare=False)
    path: Array | None = field(default=None, compare=False)
    ride: GroundRide | None = field(default=None, compare=False)
    riding: Mapping[str, Array] = field(default_factory=dict, compare=False)

    @classmethod
    def still(cls, ground: Array, up: Array) -> GroundFrame:
        """The frame of a ground (4, 4) that stands still, where some direction (3,) is up in the world."""
        return cls(rows(np.linalg.inv(placed(ground, up))))

    def from_world(self, frames: Array | Sequence[int]) -> Array:
        """World to this frame at scene frames (F,), (F, 4, 4) [Blender units]; outside its path as at the ends."""
        if self.path is None:
            return np.broadcast_to(np.array(self.matrix), (len(frames), 4, 4))
        at = np.clip(np.rint(np.asarray(frames) - self.first).astype(int), 0, len(self.path) - 1)
        return self.path[at]


def in_world(table: Sequence[Mapping[str, Any]], to_world: Array) -> list[dict[str, Any]]:
    """Rows with their places and normals in the world, to which a matrix (4, 4) leads from a frame [m]."""
    turn, shift = to_world[:3, :3], to_world[:3, 3]
    placed_rows = []
    for row in table:
        place = {"position": np.round(turn @ row["position"] + shift, 5).tolist()}
        normal = {"normal": np.round(turn @ row["normal"], 4).tolist()} if "normal" in row else {}
        placed_rows.append({**row, **place, **normal})
    return placed_rows


def rows(matrix: Array) -> Rows:
    """A matrix as plain numbers."""
    return tuple(map(tuple, matrix.tolist()))


def axes_of(ground: Array) -> Array:
    """Axes (..., 3, 3) of a ground's matrices (..., 4, 4), without scale and shear: they turn as the ground does."""
    axes, stretch = np.linalg.qr(ground[..., :3, :3])
    axes = axes * np.sign(np.diagonal(stretch, axis1=-2, axis2=-1))[..., None, :]
    axes[..., 0] *= np.linalg.det(axes)[..., None]  # no mirror image
    return np.asarray(axes)


def upright(up: Array) -> Array:
    """The least rotation (3, 3) that turns a direction (3,) to Z."""
    x, y, z = up / np.linalg.norm(up)
    if np.hypot(x, y) < ALIGNED and z > 0:
        return np.eye(3)
    if np.hypot(x, y) < ALIGNED:
        return np.diag([1.0, -1.0, -1.0])
    cross = np.array([[0.0, 0.0, -x], [0.0, 0.0, -y], [x, y, 0.0]])
    return np.asarray(np.eye(3) + cross + cross @ cross / (1.0 + z))


def placed(ground: Array, up: Array) -> Array:
    """The frame of a ground (4, 4) as it lies in the world, (4, 4): its Z is up (3,), the rest is the ground's own."""
    frame, axes = np.eye(4), axes_of(ground)
    frame[:3, :3] = axes @ upright(axes.T @ up).T
    frame[:3, 3] = ground[:3, 3]
    return frame
