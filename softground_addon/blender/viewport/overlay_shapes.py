"""Shapes of the overlay, as plain arrays in world space [m]: footfalls, soles, forces and cells."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.ground.heightfield import Terrain
from ...core.ground.sparse_grid import Window
from ...core.loads.estimate import CharacterLoads
from ...core.motion.props import posed
from ...core.motion.sole_motion import Sole
from ...core.numerics.arrays import Array
from ...core.numerics.cell_keys import cells_of, keys_of
from ...core.numerics.intervals import runs
from ...core.pressing.rim import dilate
from ...core.record.footprints import Footprint
from ...core.soles.outlines import convex_hull

Cells = NDArray[np.integer[Any]]
"""Column and row of each cell, (N, 2)."""

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
        """Place of its number [m]."""
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
    """Outlines of soles to come, in the order of their first contact, each as posed under its largest force."""
    outlines = []
    for character in loads:
        for index, motion in enumerate(character.motion.soles):
            strength = np.linalg.norm(character.forces.forces[:, index], axis=-1)
            for first, end in zip(*runs(character.contacts.touching[:, index]), strict=True):
                hardest = int(first) + int(strength[first:end].argmax())
                points = _posed(motion.sole, motion.transforms[hardest])
                heights = terrain.heights(points[:, 0], points[:, 1])
                points[:, 2] = np.where(np.isnan(heights), points[:, 2], heights + LIFT)
                outlines.append(Outline(points, motion.sole.side, float(character.motion.frames[first])))
    return sorted(outlines, key=lambda outline: outline.frame)


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


def touched_at(footprints: Sequence[Footprint], frame: float) -> Iterator[Cells]:
    """The cells that each sole touches at a frame."""
    for footprint in footprints:
        if footprint.start_frame - footprint.frame_step <= frame <= footprint.end_frame + footprint.frame_step:
            yield touched(footprint, (footprint.contact_start <= frame) & (frame <= footprint.contact_end))


def touched(footprint: Footprint, when: NDArray[np.bool_] | slice = slice(None)) -> Cells:
    """The cells that a sole touches, or some of them."""
    return _placed(footprint.window, *np.divmod(footprint.contact_cells[when], footprint.window.columns))


def marked(window: Window, mask: NDArray[np.bool_]) -> Cells:
    """The cells of a window that are marked in a mask (rows, columns)."""
    return _placed(window, *np.nonzero(mask))


def _placed(window: Window, row: Cells, column: Cells) -> Cells:
    """The cells (N, 2) in the rows and columns (N,) of a window."""
    return np.stack([column + window.column, row + window.row], axis=-1)


def contact_and_rim(touched: Iterable[Cells], reach: float) -> tuple[Cells, Cells]:
    """The cells in contact, and those around them that the rim rises on (the paper, Fig. 3).

    Parameters
    ----------
    touched : iterable of (N, 2) int arrays
        Column and row of the cells that each sole touches.
    reach : float
        Of the rim, in cells.

    Returns
    -------
    two (M, 2) int arrays
        Column and row of each cell, each once.
    """
    soles = [cells for cells in touched if len(cells)]
    contact = keys_of(np.concatenate([np.empty((0, 2), np.int64), *soles]))
    near = keys_of(np.concatenate([np.empty((0, 2), np.int64), *(_near(cells, reach) for cells in soles)]))
    return cells_of(np.unique(contact)), cells_of(np.setdiff1d(near, contact))


def _near(cells: Cells, reach: float) -> Cells:
    """Cells within reach of some, and these."""
    corner = cells.min(axis=0) - int(reach) - 1
    column, row = (cells - corner).T
    mask = np.zeros((1, row.max() + int(reach) + 2, column.max() + int(reach) + 2), dtype=bool)
    mask[0, row, column] = True
    _, row, column = np.nonzero(dilate(mask, reach))
    return np.stack([column, row], axis=-1) + corner


def squares(cells: Cells, size: float, terrain: Terrain, *, side: float = 0.84) -> Array:
    """Two triangles for each of the cells (N, 2) of some size [m], (6·N, 3) [m].

    They cover a part of its `side`: a narrow gap lets the cells be told apart.
    """
    centres = (cells + 0.5) * size
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, -1), (1, 1), (-1, 1)]) * (side * size / 2)
    places = (centres[:, None] + corners).reshape(-1, 2)
    heights = np.repeat(terrain.heights(centres[:, 0], centres[:, 1]), 6) + LIFT
    return np.column_stack([places, np.nan_to_num(heights)])


def _posed(sole: Sole, transforms: Array) -> Array:
    """The outline in world space, on the underside of the sole's first piece; of a prop, as seen from above."""
    if sole.prop:
        points = posed(sole.prop.probes, transforms[0])
        hull = convex_hull(points[:, :2])
        return np.column_stack([hull, np.full(len(hull), points[:, 2].min())])
    flat = np.column_stack([sole.outline, np.zeros(len(sole.outline))])
    return np.asarray(flat @ transforms[0, :3, :3].T + transforms[0, :3, 3])


def _step(character: CharacterLoads, frame: float) -> int:
    """The step at a scene frame, or the nearest one of the shot."""
    frames = character.motion.frames
    return int(np.clip(np.searchsorted(frames, frame - 1e-6), 0, len(frames) - 1))
