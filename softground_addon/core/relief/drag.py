"""Marks of soles that slide as they land or leave: scratches along the way, a gap in the wall, a heap before it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array
from ..numerics.interpolation import smooth_step
from ..record.footprints import Footprint
from .lattice_noise import noise
from .layers import Around

LEAST, WHOLE = 0.01, 0.04
"""Ways that leave a first mark, and a whole one [m]: a planted sole gives way by some millimetres as it rolls."""
LOADED = 0.05
"""Part of the peak force from which a sole presses."""
PART = 1 / 3
"""Part of a contact in which a sole lands, and in which it lifts."""
BREADTH = 0.16
"""Half the breadth of a mark over the length of the print."""
SCRATCH, RAMP, HEAP = 0.12, 0.45, 0.2
"""Heights over the depth of the print: of scratches, of the gap in the wall ahead, of the heap before it."""
FINE, LONG = 7.0, 12.0
"""Breadth of scratches [mm], and their length over it."""


@dataclass(frozen=True)
class Drag:
    """The mark of one slide.

    Attributes
    ----------
    start, way : (2,) float arrays
        Middle of the pressure at its begin, and displacement of the sole [m].
    radius : float
        Half its breadth [m].
    depth : float
        Of the print [m].
    is_last : bool
        True if the sole lifted with it, and wiped its tread out; after a landing, it stood still on it.
    """

    start: Array
    way: Array
    radius: float
    depth: float
    is_last: bool = True

    @property
    def length(self) -> float:
        """Length of the way [m]."""
        return float(np.hypot(*self.way))

    @property
    def share(self) -> float:
        """Share of a whole mark, from 0 to 1."""
        return float(smooth_step(np.asarray((self.length - LEAST) / (WHOLE - LEAST))))

    def spared(self, around: Around) -> Array:
        """Part of a tread that it leaves."""
        along, across = self._places(around)
        return np.asarray(1.0 - self.is_last * self.share * self._within(along, across))

    def _places(self, around: Around) -> tuple[Array, Array]:
        """Distances of places along the way and to its left [m]."""
        x, y = around.x - self.start[0], around.y - self.start[1]
        cos, sin = self.way / self.length
        return x * cos + y * sin, y * cos - x * sin

    def _within(self, along: Array, across: Array) -> Array:
        """1 on the way, 0 beside it."""
        beside = np.hypot(across, along - np.clip(along, 0.0, self.length))
        return smooth_step(2.0 - 2.0 * beside / self.radius)

    def heights(self, around: Around) -> Array:
        """Heights [m]."""
        length = self.length
        along, across = self._places(around)
        within = self._within(along, across)
        to_end = along - length - 1.4 * self.radius
        size = around.length(FINE)
        lines = noise(around.seed + 191, size, across, along / LONG) if size >= around.finest else 0.0 * along
        ramp = smooth_step(along / length) * (1.0 - around.pressed)
        before = np.maximum(1.0 - (to_end**2 + across**2) / self.radius**2, 0.0) * smooth_step(
            to_end / self.radius + 0.5
        )
        heights = within * (SCRATCH * lines - RAMP * ramp) + HEAP * before * (1.0 - around.pressed)
        return np.asarray(self.share * self.depth * heights)


def drags_of(footprint: Footprint, length: float, depth: float) -> list[Drag]:
    """The marks of a footprint that slid as it landed or lifted; none if it did not, or its poses are not known.

    Parameters
    ----------
    length, depth : float
        Of the print [m].
    """
    if footprint.pressed_by is None or footprint.pressed_by.pressing.sole.prop is not None:
        return []
    steps = footprint.pressed_by.steps(footprint.load_frames)
    force = np.linalg.norm(steps.forces, axis=-1)
    pressing = np.flatnonzero(force > LOADED * force.max(initial=0.0))
    count = int(PART * len(pressing))
    if not count:
        return []
    drags = []
    for part, patch in ((pressing[:count], 0), (pressing[-count - 1 : -1], -1)):
        poses, centre = steps.poses[:, patch], steps.centres[part]
        local = np.linalg.solve(poses[part, :3, :3], (centre - poses[part, :3, 3])[..., None])
        moved = (poses[part + 1, :3, :3] @ local)[..., 0] + poses[part + 1, :3, 3] - centre
        way = moved[:, :2].sum(axis=0)
        slid, radius = float(np.hypot(*way)), BREADTH * length
        if slid > LEAST:
            behind = way / slid * radius if patch == 0 else 0.0  # a landing sole covers the way that it slid
            drags.append(Drag(centre[0, :2] - behind, way, radius, depth, patch != 0))
    return drags
