"""Deep ground that a body passes through: it is cut to the lowest underside, and what was cut lies loose around.

Over the pressed ground T, every cell keeps the lowest undersides K that passed its quarters and the loose matter l on
it: what stands is the middle of their min(T, K), the surface lies l above that. So the outline of a hole is smooth. A
cut takes loose matter first. A part of it all is packed into the
wall, as its pores close; the rest is laid around. Loose matter slides at its angle of repose, and walls fall that
are higher than their cohesion holds: of dry sand all, of snow and mud hardly any.

References
----------
Terzaghi 1943, "Theoretical Soil Mechanics", doi:10.1002/9780470172766: the height of a vertical cut.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from math import ceil, isqrt, pi, tan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..ground.material import GroundMaterial
from ..ground.sparse_grid import Window
from ..ground.surfaces import SurfaceRecord
from ..numerics.arrays import Array, Mask
from ..numerics.neighbourhood import lowest_within
from ..pressing.repose import slid
from ..relief.lattice_noise import noise

TOLERANCE = 1e-3
"""Skin that is less deep in the ground does not cut it [m]."""
UNDER_SOLE = 7e-3
"""The same of a sole that presses, or a cell if that is less [m]: within it the print is what the solver says, and the
skin about that, within a centimetre with what is not recorded yet; where the soft edge of a print stands out above the
skin of the shoe, the shoe has cut it."""
SAMPLES = 2
"""Quarters along each side of a cell."""
THINNEST = 0.2
"""Loose matter is laid where it is at least so thick, over its thickest."""
ROUNDING = 1e-12
"""Heights below zero by no more than this are zero [m]."""
EDGE, LEAST_DROP = 0.06, 0.06
"""A wall breaks off within such a distance of ground that lies so much lower [m]."""
PIECES, SEED = (0.09, 0.035), 431
"""Sizes of the pieces [m], and the number that their noise begins with."""
MOST_OF_DROP = 0.7
"""Part of a drop that breaks off at most."""
REACH, THICKEST, HIGHEST, LAYERS = 0.04, 0.04, 0.08, 3
"""How far around a body loose matter is laid, and how thick (tried on the sample walk in snow) [m]: in so many goes,
also under what hovers over it, then higher. Where large bodies leave no room for it, it is laid as high as the cut is
deep, then twice as far around, then evenly on all that is looked at."""


@dataclass(frozen=True)
class Walls:
    """Walls of ground that was cut.

    Attributes
    ----------
    packing : float
        Part of the cut volume that is packed into the wall.
    strength : float
        Height up to which a wall stands [m]: Hc = 4·c/(rho·g)·tan(45° + phi/2) (Terzaghi 1943, a vertical cut).
    repose : float
        Angle of repose of loose matter [rad].
    crumbling : float
        Depth to which their edges break off [m].
    """

    packing: float
    strength: float
    repose: float
    crumbling: float = 0.0

    @classmethod
    def of(cls, surface: SurfaceRecord, material: GroundMaterial, gravity: float) -> Walls:
        """The walls of a ground, under a gravity [m/s²].

        Examples
        --------
        >>> from softground_addon.core.ground.surfaces import SURFACES
        >>> material = GroundMaterial(youngs_modulus=1e5, poisson_ratio=0.1, characteristic_time=0.2)
        >>> [round(Walls.of(SURFACES[name], material, 9.81).strength, 2) for name in ("snow", "sand", "mud")]
        [0.92, 0.0, 0.63]
        """
        repose = material.repose_angle or np.radians(surface.thrown.repose)
        cut = 4.0 * surface.wall_cohesion / (surface.density * gravity) if gravity else np.inf
        strength = cut * tan(pi / 4 + repose / 2) if surface.wall_cohesion else 0.0
        return cls(surface.wall_packing, strength, repose, surface.wall_crumbling)

    def reach(self, change: Array, loose: Array, cell_size: float) -> int:
        """Number of cells around a window that what slides may spread over.

        Parameters
        ----------
        change, loose : (rows, columns) float arrays
            Height over the undisturbed ground, and that of what is loose [m].
        """
        rows, columns = (np.minimum(np.arange(count), np.arange(count)[::-1]) for count in change.shape)
        falls = loose + np.maximum(np.ptp(change) - self.strength, 0.0)
        volume = float((loose + np.abs(change - loose)).sum()) * cell_size**2
        heap = (3.0 / np.pi * tan(self.repose) ** 2 * volume) ** (1 / 3)  # height of a cone that holds all of it
        spread = np.minimum(falls, min(heap, np.ptp(change))) / (tan(self.repose) * cell_size)
        return max(ceil((spread - np.minimum(rows[:, None], columns)).max()), 0) + 1


@dataclass
class CarvedCells:
    """A window of ground that a body is in; `press`, `cut`, `pack` and `slide` change it and count what they do.

    Attributes
    ----------
    cell_size : float
        Side of a cell [m].
    terrain : (rows, columns) float array
        Height of the undisturbed ground [m].
    closed : (rows, columns) bool array
        Cells that nothing is cut from or laid on: off the ground.
    contact : (rows, columns) bool array
        Cells under a sole that presses: these are not cut by its own skin, and nothing is laid there.
    pressed : (rows, columns) or (4, rows, columns) float array
        Height of the pressed ground T, with its rims [m]; of the quarters of each cell, where these are the ground's.
    lowest : (4, rows, columns) float array
        Lowest underside K so far in the quarters of each cell [m], infinite where none passed.
    loose : (rows, columns) float array
        Height of the loose matter [m].
    broken : (rows, columns) float array
        Height that has broken off the edges of walls [m].
    cut_height, packed, unplaced : float
        Sums of the heights that were cut of what stood, fell or rose as a rim, packed, and found no place around [m].
    """

    cell_size: float
    terrain: Array
    closed: Mask
    contact: Mask
    pressed: Array
    lowest: Array
    loose: Array
    broken: Array = field(default_factory=lambda: np.zeros(()))
    cut_height: float = 0.0
    packed: float = 0.0
    unplaced: float = 0.0

    @property
    def standing(self) -> Array:
        """Height of what stands, (rows, columns) [m]: the middle of its quarters, or the mean if each is a cell."""
        return self._whole(np.minimum(self.pressed, self.lowest))

    @property
    def surface(self) -> Array:
        """Height of the ground, (rows, columns) [m]."""
        return self.standing + self.loose

    @property
    def _across(self) -> int:
        """Cells of the ground along the side of a cell."""
        return SAMPLES if self.pressed.ndim == 3 else 1

    @property
    def _standing_cells(self) -> Array:
        """Height of what stands in each cell of the ground, (1 or 4, rows, columns) [m]."""
        return np.minimum(self.pressed, self.lowest) if self._across > 1 else self.standing[None]

    @property
    def cut_of_cells(self) -> Array:
        """How far that lies below the pressed ground, (1 or 4, rows, columns) [m]."""
        return np.asarray(self.pressed - self._standing_cells)

    def _whole(self, quarters: Array) -> Array:
        """What the cells have by their quarters, (rows, columns)."""
        return np.asarray(quarters.mean(axis=0)) if self._across > 1 else _middle(quarters)

    def press(self, pressed: Array) -> None:
        """Go on to the pressed ground of a later moment, as `pressed` [m]; on carved ground its rims are loose."""
        before, raised = self.cut_of_cells, np.reshape(pressed - self.pressed, (-1, *self.loose.shape))
        self.pressed = pressed
        more = np.where(raised > 0, self.cut_of_cells - before, 0.0).mean(axis=0)
        self.cut_height += float(more.sum())
        self.loose += more

    def cut(
        self, underside: Array, way: Array, packing: float, bodies: Array | None = None, *, again: float | None = None
    ) -> Array:
        """Cut the ground to a body's underside.

        Parameters
        ----------
        underside : (4, rows, columns) float array
            Lowest surface of the body over each quarter of a cell [m], infinite where there is none.
        way : (2,) float array
            Way of the body since the cut before, along x and y [m]: what is cut goes ahead of it.
        packing : float
            See `Walls`.
        bodies : (rows, columns) float array, optional
            Lowest surface of all bodies, if there are others: nothing is laid in them [m].
        again : float, optional
            Part of the loose matter that is packed, if not as much: what is pushed ahead is cut again at each frame.

        Returns
        -------
        (rows, columns) float array of what was cut [m].
        """
        standing = np.minimum(self.pressed, self.lowest)
        depth = standing + self.loose - underside
        least = np.where(self.closed, np.inf, least_cut(self.contact, self.cell_size / self._across))
        depth = np.where(depth >= least, depth, 0.0)
        if not depth.any():
            return depth[0]
        before, beyond = self.standing, depth > self.loose
        self.lowest = np.where(beyond, standing - (depth - self.loose), self.lowest)
        of_standing, of_loose = before - self.standing, np.minimum(depth, self.loose)
        of_loose = of_loose.max(axis=0) if self._across > 1 else _middle(of_loose)  # it lies level over all of a cell
        depth = of_standing + of_loose
        self.loose = np.maximum(self.loose - of_loose, 0.0)
        self.cut_height += float(of_standing.sum())
        thrown = (1.0 - packing) * of_standing + (1.0 - (packing if again is None else again)) * of_loose
        self.packed += float((depth - thrown).sum())
        if thrown.any():
            self._lay(thrown, way, underside.min(axis=0) if bodies is None else bodies)
        return depth

    def _lay(self, thrown: Array, way: Array, bodies: Array) -> None:
        """Lay heights (rows, columns) around where they were cut [m], not in bodies."""
        closed = self.closed | self.contact
        highest = bodies - self._standing_cells.max(axis=0) - TOLERANCE
        remaining, pit = float(thrown.sum()), float((self.terrain - self.standing).max())
        for reach, thickest in ((REACH, THICKEST), (REACH, HIGHEST), (REACH, pit), (2 * REACH, pit), (0.0, np.inf)):
            if remaining <= ROUNDING:
                break
            laid = (_around(thrown, way, max(round(reach / self.cell_size), 1)) if reach else 1.0) * ~closed
            room = np.maximum(np.minimum(highest, thickest) - self.loose, 0.0)
            for _ in range(LAYERS):
                share = laid * (room > 0)
                if remaining <= ROUNDING or not (total := share.sum()):
                    break
                more = np.minimum(share * (remaining / total), room)
                self.loose += more
                room -= more
                remaining -= float(more.sum())
        self.unplaced += remaining if remaining > ROUNDING else 0.0

    def pack(self) -> None:
        """Pack the loose matter under soles that press."""
        self.packed += float(self.loose[self.contact].sum())
        self.loose[self.contact] = 0.0

    def gather(self, shown: Array, least: float) -> None:
        """Undo changes of loose matter against what is `shown` (rows, columns) that are less than some height [m].

        What they come to is spread over the cells that changed by more.
        """
        difference = self.loose - shown
        thin = np.abs(difference) < least
        others = ~thin & (self.loose > least)
        share = difference[thin].sum() / max(np.count_nonzero(others), 1)
        if others.any() and abs(share) < least:
            self.loose = np.where(thin, shown, self.loose + share * others)

    def crumble(self, deepest: Array, body: Mask, floor: Array | None = None) -> None:
        """Let the edges of walls to cut or pressed ground break off: what breaks lies loose where it stood.

        Asked to again, a wall recedes hardly any further: a place breaks off to its depth, all in all.

        Parameters
        ----------
        deepest : (rows, columns) float array
            Depth to which each place may break off [m]; see `pieces`.
        body : (rows, columns) bool array
            Cells with a body in the ground, which holds them.
        floor : (rows, columns) float array, optional
            Floor of the layer [m], below which nothing breaks.
        """
        standing = self.standing
        lower = ~self.closed & (standing < self.terrain - ROUNDING)
        depth, surface = self.terrain - standing, np.where(lower, standing + self.loose - self.terrain, np.inf)
        reach = [ceil(part * EDGE / self.cell_size) for part in (1 / 3, 2 / 3, 1)]
        drops = [-depth - lowest_within(surface, cells) for cells in reach]  # a hillside is no wall
        near = np.mean([drop > LEAST_DROP for drop in drops], axis=0)
        broken = np.minimum(deepest * near - self.broken, MOST_OF_DROP * drops[-1])
        if floor is not None:
            broken = np.minimum(broken, standing - floor)
        breaks = (broken > 0) & ~(self.closed | self.contact | body)
        self.lowest[:, breaks] = (np.minimum(self.pressed, self.lowest) - broken)[:, breaks]
        fallen = standing - self.standing
        self.cut_height += float(fallen.sum())
        self.loose += fallen
        self.broken = self.broken + fallen

    def slide(self, walls: Walls, body: Mask, corner: tuple[int, int], sweeps: int) -> None:
        """Let slide what is too steep; a body that stands in the ground holds it.

        Parameters
        ----------
        body : (rows, columns) bool array
            Cells with a body in the ground.
        corner : tuple of int
            Row and column of the first cell in the plane.
        sweeps : int
            Most sweeps (see `repose.slid`).
        """
        standing = self.standing
        before = standing + self.loose
        change = slid(
            before - self.terrain,
            np.zeros_like(before),
            self.terrain,
            angle=walls.repose,
            cell_size=self.cell_size,
            fixed=self.closed | self.contact | body,
            walls=(standing, walls.strength),
            corner=corner,
            sweeps=sweeps,
        ) - (before - self.terrain)
        loose = self.loose + change
        fallen = loose < -ROUNDING
        self.cut_height -= float(loose[fallen].sum())
        self.lowest[:, fallen] = (np.minimum(self.pressed, self.lowest) + loose)[:, fallen]
        self.loose = np.maximum(loose, 0.0)


def least_cut(contact: Mask, cell_size: float) -> Array:
    """Least depth in the ground that is cut, from the cells (rows, columns) under soles that press [m]."""
    return np.where(contact, min(UNDER_SOLE, cell_size), TOLERANCE)


def in_cells(window: Window, values: NDArray[Any], across: int) -> tuple[Window, NDArray[Any]]:
    """The cells, of so many of the ground along each side, around a window of the ground, and its values in them.

    Examples
    --------
    >>> cells, parts = in_cells(Window(3, 0, 2, 2), np.array([[1, 2], [3, 4]]), 2)
    >>> cells, parts[:, 0].tolist()
    (Window(column=1, row=0, columns=2, rows=1), [[0, 2], [1, 0], [0, 4], [3, 0]])
    >>> of_ground(parts).tolist()
    [[0, 1, 2, 0], [0, 3, 4, 0]]
    """
    column, row = window.column // across, window.row // across
    right, up = -(-(window.column + window.columns) // across), -(-(window.row + window.rows) // across)
    cells = Window(column, row, right - column, up - row)
    around = cells.refined(across)
    whole = np.zeros((around.rows, around.columns), values.dtype)
    whole[around.slices(window)] = values
    parts = whole.reshape(cells.rows, across, cells.columns, across).transpose(1, 3, 0, 2)
    return cells, parts.reshape(-1, cells.rows, cells.columns)


def of_ground(parts: NDArray[Any]) -> NDArray[Any]:
    """Values of the ground's cells, (rows, columns), from those in each of carving (N², rows, columns)."""
    number, rows, columns = parts.shape
    across = isqrt(number)
    return parts.reshape(across, across, rows, columns).transpose(2, 0, 3, 1).reshape(rows * across, -1)


def pieces(window: Window, cell_size: float, crumbling: float | Array) -> Array:
    """Depth to which each cell of a window may break off, (rows, columns) [m], in pieces of all `PIECES`.

    Of all cells at most the same `crumbling`, or each its own (rows, columns) [m].
    """
    x, y = (axis.ravel() for axis in np.meshgrid(*window.centres(cell_size)))
    above = sum((noise(SEED + number, size, x, y) for number, size in enumerate(PIECES)), np.zeros(len(x)))
    return np.asarray(crumbling * np.maximum(above, 0.0).reshape(window.rows, window.columns))


def _middle(quarters: Array) -> Array:
    """Mean of the two in the middle of four values (4, rows, columns).

    A quarter that stands out alone does not count: no wall fills a slot that is hardly wider than a cell.
    """
    a, b, c, d = quarters
    low, high = np.maximum(np.minimum(a, b), np.minimum(c, d)), np.minimum(np.maximum(a, b), np.maximum(c, d))
    return np.asarray((low + high) / 2)


def _around(thrown: Array, way: Array, reach: int) -> Array:
    """Heights (rows, columns) laid so many cells around where they are, and as many ahead along a way (2,)."""
    length = float(np.hypot(*way))
    ahead = np.rint(way[::-1] / length * reach).astype(int) if length > 0 else np.zeros(2, int)
    over_rows, over_columns = (_smoothing(count, reach | 1) for count in thrown.shape)
    laid = over_rows @ thrown @ over_columns
    to, since = (
        tuple(
            slice(max(sign * step, 0), count + min(sign * step, 0))
            for step, count in zip(ahead, laid.shape, strict=True)
        )
        for sign in (1, -1)
    )
    spread = laid.copy()
    laid[to] += spread[since]
    return np.where(laid > THINNEST * laid.max(), laid, 0.0)


@lru_cache(16)
def _smoothing(count: int, width: int) -> Array:
    """The matrix (count, count) that takes means over an odd number of cells twice; nothing is beyond the edges."""
    away = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    return np.maximum(width - away, 0) / width**2
