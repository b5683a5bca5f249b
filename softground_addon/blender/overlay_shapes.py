"""What the overlay draws, as plain arrays in world space [m]: footfalls, soles, forces and cells."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..core.contacts import runs
from ..core.footprints import Footprint
from ..core.heightfield import Terrain, Window
from ..core.motion import Sole
from ..core.outlines import convex_hull
from ..core.simulation import CharacterLoads
from ..core.solids import posed

Array = NDArray[np.float64]

BODY_WEIGHT_LENGTH = 0.6
"""Length of the arrow of one body weight, in leg lengths."""
SIDE_BY_SIDE = 0.04
"""Distance between the arrows of one sole, in leg lengths."""
LIFT = 0.004
"""How far above the ground outlines and cells are drawn, so that it does not hide them [m]."""
SMALLEST_FORCE = 0.01
"""Weaker forces are not drawn, in body weights."""


@dataclass(frozen=True)
class Outline:
    """A closed line around a sole.

    Attributes
    ----------
    points : (N, 3) float array [m]
    side : str
        "L", "R" or "".
    frame : float
        Scene frame of its first contact.
    """

    points: Array
    side: str
    frame: float

    @property
    def middle(self) -> Array:
        """Where its number goes [m]."""
        middle: Array = self.points.mean(axis=0)
        return middle


@dataclass(frozen=True)
class Arrow:
    """A force on a sole.

    Attributes
    ----------
    kind : str
        "weight", "momentum" or "total".
    start, end : (3,) float arrays [m]
    """

    kind: str
    start: Array
    end: Array


def footfalls(loads: Sequence[CharacterLoads], terrain: Terrain) -> list[Outline]:
    """Where soles will stand, in the order of their first contact: each outline as posed under its largest force."""
    found = []
    for character in loads:
        for index, motion in enumerate(character.motion.soles):
            strength = np.linalg.norm(character.forces.forces[:, index], axis=-1)
            for first, end in zip(*runs(character.contacts.touching[:, index]), strict=True):
                hardest = int(first) + int(strength[first:end].argmax())
                points = _posed(motion.sole, motion.transforms[hardest])
                heights = terrain.heights(points[:, 0], points[:, 1])
                points[:, 2] = np.where(np.isnan(heights), points[:, 2], heights + LIFT)
                found.append(Outline(points, motion.sole.side, float(character.motion.frames[first])))
    return sorted(found, key=lambda outline: outline.frame)


def soles(loads: Sequence[CharacterLoads], frame: float) -> Iterator[Outline]:
    """The soles of all characters as posed at a frame."""
    for character in loads:
        step = _step(character, frame)
        for motion in character.motion.soles:
            yield Outline(_posed(motion.sole, motion.transforms[step]), motion.sole.side, frame)


def arrows(loads: Sequence[CharacterLoads], frame: float) -> Iterator[Arrow]:
    """Weight, momentum and total force on each loaded sole at a frame (the paper, Fig. 5)."""
    for character in loads:
        step, forces, motion = _step(character, frame), character.forces, character.motion
        body_weight = motion.mass * motion.gravity
        scale = BODY_WEIGHT_LENGTH * motion.leg_length / body_weight
        for index, sole in enumerate(motion.soles):
            total = forces.forces[step, index]
            if np.linalg.norm(total) < SMALLEST_FORCE * body_weight:
                continue
            aside = sole.transforms[step, 0, :3, 1] * SIDE_BY_SIDE * motion.leg_length
            foot = forces.centre_of_pressure[step, index]
            up = np.array([0.0, 0.0, scale])
            for kind, place, vector in (
                ("weight", 1, forces.weight[step, index] * up),
                ("momentum", -1, forces.momentum[step, index] * up),
                ("total", 0, total * scale),
            ):
                if np.linalg.norm(vector) > SMALLEST_FORCE * BODY_WEIGHT_LENGTH * motion.leg_length:
                    yield Arrow(kind, foot + place * aside, foot + place * aside + vector)


def cells_at(footprints: Sequence[Footprint], frame: float) -> tuple[list[Array], list[Array]]:
    """Centres of the cells in contact and of those that rise at a frame, one (N, 2) array of each per footprint [m]."""
    contact, rim = [], []
    for footprint in footprints:
        if footprint.start_frame - footprint.frame_step <= frame <= footprint.end_frame + footprint.frame_step:
            touched = (footprint.contact_start <= frame) & (frame <= footprint.contact_end)
            contact.append(_centres(footprint, footprint.contact_cells[touched]))
            now = np.flatnonzero(np.abs(footprint.rim.frames - frame) < footprint.frame_step / 2)
            cells = [footprint.rim.cells[footprint.rim.first[k] : footprint.rim.first[k + 1]] for k in now]
            rim.append(_centres(footprint, np.concatenate([np.empty(0, np.int32), *cells])))
    return contact, rim


def changed_cells(window: Window, change: Array, cell_size: float) -> tuple[Array, Array]:
    """Centres of the cells of a window whose compression and whose rim grew, (N, 2) each [m].

    Parameters
    ----------
    window : Window
    change : (2, rows, columns) float array
        Change of compression and rim [m].
    cell_size : float
        Side of a cell [m].
    """
    x, y = np.meshgrid(*window.centres(cell_size))
    compressed = change[0] > 0
    risen = (change[1] > 0) & ~compressed
    return np.stack([x[compressed], y[compressed]], -1), np.stack([x[risen], y[risen]], -1)


def squares(centres: Array, size: float, terrain: Terrain) -> Array:
    """Two triangles for each cell, (6·N, 3) [m]."""
    half = 0.42 * size  # a narrow gap lets the cells be told apart
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, -1), (1, 1), (-1, 1)]) * half
    places = (centres[:, None] + corners).reshape(-1, 2)
    heights = np.repeat(terrain.heights(centres[:, 0], centres[:, 1]), 6) + LIFT
    return np.column_stack([places, np.nan_to_num(heights)])


def _centres(footprint: Footprint, cells: NDArray[np.int32]) -> Array:
    row, column = np.divmod(cells, footprint.window.columns)
    place = np.stack([column + footprint.window.column, row + footprint.window.row], axis=-1)
    return (place + 0.5) * footprint.cell_size


def _posed(sole: Sole, transforms: Array) -> Array:
    """The outline in world space, on the underside of the sole's first piece; of a solid, as seen from above."""
    if sole.solid:
        points = posed(sole.solid.probes, transforms[0])
        hull = convex_hull(points[:, :2])
        return np.column_stack([hull, np.full(len(hull), points[:, 2].min())])
    flat = np.column_stack([sole.outline, np.zeros(len(sole.outline))])
    return np.asarray(flat @ transforms[0, :3, :3].T + transforms[0, :3, 3])


def _step(character: CharacterLoads, frame: float) -> int:
    """The step at a scene frame, or the nearest one of the shot."""
    frames = character.motion.frames
    return int(np.clip(np.searchsorted(frames, frame - 1e-6), 0, len(frames) - 1))
