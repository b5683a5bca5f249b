"""Feet beside or beyond the edge of the ground: they carry their part of the body, and press nothing of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..ground.hard_ground import HardOnSoft, bare
from ..ground.heightfield import Terrain
from ..motion.motion import CharacterMotion
from ..motion.sole_motion import SoleMotion
from ..numerics.arrays import Array, Mask
from ..numerics.interpolation import in_stretches
from ..numerics.intervals import runs
from .contacts import TOUCH_HEIGHT, Contacts
from .forces import ContactForces

MOST_PLACES = 300
"""Places along the way from which the edge of the ground is looked for."""
HALVINGS = 12
"""How often the way from such a place to one without ground is halved: a metre to a quarter of a millimetre."""
RASTER = 0.005
"""Places beyond the edge that are nearer to each other than this share its height [m]."""
NODES = 8
"""Places along either side of a patch of a sole under which ground is looked for."""
EVERY = 4
"""Steps of which one is looked at for places without ground."""


class LevelBeyondEdge:
    """A ground that goes on level from its nearest edge.

    Parameters
    ----------
    places : (K, 2) float array
        World positions that have ground [m].
    """

    def __init__(self, terrain: Terrain, places: Array) -> None:
        self.terrain, self.places = terrain, places

    def heights(self, x: Array, y: Array) -> Array:
        """Heights at world positions [m]."""
        height = np.array(self.terrain.heights(x, y))
        missing = ~np.isfinite(height)
        if missing.any():
            across, along = (np.rint(np.broadcast_to(each, height.shape)[missing] / RASTER) for each in (x, y))
            place, same = np.unique(across + 1j * along, return_inverse=True)
            beyond = np.stack([place.real, place.imag], axis=-1) * RASTER
            height[missing] = in_stretches(lambda part: self._at_edge(beyond[part]), len(beyond))[same]
        return height

    def _at_edge(self, beyond: Array) -> Array:
        """Height of the edge between places without ground (N, 2) and the nearest that have some, (N,) [m]."""
        places = self.places - self.places[0]
        apart = (places**2).sum(axis=-1) - 2 * (beyond - self.places[0]) @ places.T  # squared, but for what all share
        inside = self.places[apart.argmin(axis=1)]
        height = self.terrain.heights(*inside.T)
        for _ in range(HALVINGS):
            middle = (inside + beyond) / 2
            here = self.terrain.heights(*middle.T)
            known = np.isfinite(here)
            inside, beyond = np.where(known[:, None], middle, inside), np.where(known[:, None], beyond, middle)
            height = np.where(known, here, height)
        return np.asarray(height)


def beyond_edge(motion: CharacterMotion, terrain: Terrain) -> Terrain:
    """The ground, level from its edges on where some sole of a motion is beyond them."""
    steps = np.arange(0, len(motion.frames), EVERY)
    places = np.concatenate([spots(sole, steps).reshape(-1, 2) for sole in motion.soles])
    known = np.isfinite(terrain.heights(*places.T))
    if known.all() or not known.any():
        return terrain
    return LevelBeyondEdge(terrain, places[known][:: -(-np.count_nonzero(known) // MOST_PLACES)])


def without_missing(
    motion: CharacterMotion, terrain: Terrain, contacts: Contacts, forces: ContactForces
) -> tuple[Contacts, ContactForces]:
    """Contacts and forces on the ground that is there, of those found `beyond_edge`; those on hard objects bear."""
    hard = _on_hard(motion, terrain, contacts) if isinstance(terrain, HardOnSoft) else None
    missing, soft = contacts.touching.copy(), bare(terrain)
    for index, sole in enumerate(motion.soles):
        steps = np.flatnonzero(contacts.touching[:, index])
        missing[steps, index] = ~_has_ground(sole, steps, soft.heights)
    touching = contacts.touching & ~missing
    if hard is not None:
        touching, missing = touching & ~hard, missing & ~hard
    clearance = np.where(missing, np.inf, contacts.clearance)
    return replace(contacts, touching=touching, clearance=clearance, hard=hard), forces.of(~missing)


def _on_hard(motion: CharacterMotion, terrain: HardOnSoft, contacts: Contacts) -> Mask:
    """The contacts (N, S) on hard objects: mostly over them, with nothing at the level of the soft ground beside.

    What rolls or slides on is on them for as long as it is over them.
    """
    on_hard, soft = np.zeros_like(contacts.touching), bare(terrain)
    for index, sole in enumerate(motion.soles):
        steps = np.flatnonzero(contacts.touching[:, index])
        level = float(contacts.offset[index]) + TOUCH_HEIGHT * motion.leg_length
        on_hard[steps, index] = _has_ground(sole, steps, terrain.hard_heights)
        on_hard[steps, index] &= ~_has_ground(sole, steps, soft.heights, level)
        for first, last in zip(*runs(contacts.touching[:, index] & (sole.sole.prop is None)), strict=True):
            on_hard[first:last, index] = on_hard[first:last, index].mean() > 0.5
    return on_hard


def _has_ground(
    sole: SoleMotion, steps: NDArray[np.intp], heights: Callable[[Array, Array], Array], level: float = np.inf
) -> Mask:
    """True where some of a sole is over ground, and at most at a level above it [m], (N,)."""

    def highest(part: slice) -> Array:
        x, y, *z = np.moveaxis(spots(sole, steps[part], axes=2 if level == np.inf else 3), -1, 0)
        height = heights(x, y)
        near = np.where(z[0] - height <= level, height, np.nan) if z else height
        return np.asarray(np.fmax.reduce(near, axis=1))

    return np.isfinite(in_stretches(highest, len(steps)))


def spots(sole: SoleMotion, steps: NDArray[np.intp], axes: int = 2) -> Array:
    """Places all over a sole, by x, y and perhaps z, (N, K, axes) [m]."""
    spots = [sole.landmark_positions()[steps, :, :axes]]
    for number, patch in enumerate(sole.sole.patches):
        rows, columns = (np.linspace(0, size - 1, NODES).astype(int) for size in patch.heights.shape)
        row, column = (each.ravel() for each in np.meshgrid(rows, columns, indexing="ij"))
        under = patch.signed_distance[row, column] < 0
        row, column = row[under], column[under]
        flat = [patch.origin[0] + column * patch.spacing, patch.origin[1] + row * patch.spacing]
        nodes = np.stack([*flat, patch.heights[row, column], np.ones(len(row))])
        spots.append(np.swapaxes(sole.transforms[steps, number, :axes] @ nodes, 1, 2))
    return np.concatenate(spots, axis=1)
