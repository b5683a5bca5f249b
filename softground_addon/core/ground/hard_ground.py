"""Hard objects on soft grounds: soles stand on the highest surface within their reach, and print in what is soft."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..numerics import cell_keys
from ..numerics.arrays import Array
from ..numerics.slices import Slices, sliced
from .heightfield import Terrain
from .terrain import SAME_LAYER, MeshTerrain


@dataclass(frozen=True, eq=False)
class Reach:
    """Heights up to which soles can stand, by square of the plane: nobody below a bridge stands on its deck.

    Attributes
    ----------
    side : float
        Of a square [m].
    keys : (K,) int array
        Squares on or beside the way of a sole, ascending (`numerics.cell_keys`).
    heights : (K,) float array
        World heights [m].
    """

    side: float
    keys: cell_keys.Keys
    heights: Array

    @staticmethod
    def of(points: Array, side: float) -> Reach:
        """The reach of soles that could stand at these world positions (N, 3) [m], and anywhere below them.

        Examples
        --------
        >>> reach = Reach.of(np.array([[0.5, 0.5, 0.2], [0.5, 0.6, 0.3]]), 1.0)
        >>> reach.at(np.array([0.1, 1.9, 2.1]), np.zeros(3))
        array([ 0.3,  0.3, -inf])
        """
        keys, heights = _highest(cell_keys.keys_at(points[:, :2], side), points[:, 2])
        beside = (keys[:, None] + cell_keys.AROUND).ravel()
        return Reach(side, *_highest(beside, np.repeat(heights, len(cell_keys.AROUND))))

    def at(self, x: Array, y: Array) -> Array:
        """World heights at places of any shape (...,) [m], -inf far from the way of all soles."""
        wanted = cell_keys.keys_at(np.stack([x, y], axis=-1), self.side)
        nearest = np.minimum(np.searchsorted(self.keys, wanted), len(self.keys) - 1)
        return np.where(self.keys[nearest] == wanted, self.heights[nearest], -np.inf)


@dataclass(frozen=True, eq=False)
class _Lower:
    """A reach that ends at a limit for each place, if that is lower."""

    reach: Reach | _Lower
    limit: Array

    def at(self, x: Array, y: Array) -> Array:
        """As `Reach.at`, for as many places as there are limits."""
        return np.minimum(self.reach.at(x, y), self.limit)


def _highest(keys: cell_keys.Keys, heights: Array) -> tuple[cell_keys.Keys, Array]:
    """Each key once, ascending, with the largest of its heights."""
    once, number = np.unique(keys, return_inverse=True)
    highest = np.full(len(once), -np.inf)
    np.maximum.at(highest, number, heights)
    return once, highest


@dataclass(frozen=True, eq=False)
class HardOnSoft:
    """A terrain of soft ground and the hard objects that stand on it.

    Attributes
    ----------
    ground : Terrain
        The soft ground, whole, or all of several.
    hard : MeshTerrain
        Upper sides of the hard objects.
    reach : Reach
        Up to where soles can stand on them.
    wet : mapping of str to MeshTerrain
        Those of the hard objects that are wet, by the name of the liquid (`surfaces.LIQUIDS`).
    """

    ground: Terrain
    hard: MeshTerrain
    reach: Reach | _Lower
    wet: Mapping[str, MeshTerrain] = field(default_factory=dict)

    def heights(self, x: Array, y: Array) -> Array:
        """Heights of the highest surface within reach at world positions [m], NaN where there is none."""
        return np.asarray(np.fmax(self.ground.heights(x, y), self.hard_heights(x, y)))

    def hard_heights(self, x: Array, y: Array) -> Array:
        """Heights of the highest hard surface within reach at world positions [m], NaN where there is none."""
        across, along = np.broadcast_arrays(x, y)
        return self.hard.heights(across, along, self.reach.at(across, along))


@dataclass(frozen=True, eq=False)
class SeveralGrounds:
    """The soft grounds of a shot as one terrain: a floor, the stairs and the crates on it.

    Attributes
    ----------
    grounds : tuple of MeshTerrain
        Where two lie in one plane, the first counts.
    reach : Reach
        Up to where soles can stand on them.
    limit : array or None
        A limit for each place that is looked at, from `up_to` [m]: where all within reach are above it, as where feet
        are keyed in deep snow, the lowest counts.
    """

    grounds: tuple[MeshTerrain, ...]
    reach: Reach | _Lower
    limit: Array | None = None

    def heights(self, x: Array, y: Array) -> Array:
        """Heights of the surface that bears at world positions [m], NaN where there is none."""
        across, along = np.broadcast_arrays(x, y)
        reach = self.reach.at(across, along)
        below = reach if self.limit is None else np.minimum(reach, self.limit)
        height = np.fmax.reduce([ground.heights(across, along, below) for ground in self.grounds])
        if self.limit is not None and (above := np.isnan(height)).any():
            place = across[above], along[above], reach[above]
            height[above] = np.fmin.reduce([ground.heights(*place) for ground in self.grounds])
        return np.asarray(height)

    def numbers(self, x: Array, y: Array) -> NDArray[np.intp]:
        """Number of the ground that bears at world positions, -1 where there is none."""
        across, along = np.broadcast_arrays(x, y)
        height = self.heights(across, along)
        numbers = np.full(height.shape, -1)
        for number, ground in reversed(list(enumerate(self.grounds))):
            numbers[ground.heights(across, along, height + SAME_LAYER) > height - SAME_LAYER] = number
        return numbers

    @sliced
    def apart(self, hard: Sequence[MeshTerrain]) -> Slices[list[HardOnSoft]]:
        """Each ground by itself, on which the others stand like hard objects, and the objects that are hard."""
        terrains = []
        for number, ground in enumerate(self.grounds):
            later = [replace(other, corners=other.corners - LOWER) for other in self.grounds[number + 1 :]]
            others = yield from MeshTerrain.joined.slices([*hard, *self.grounds[:number], *later])
            terrains.append(HardOnSoft(ground, others, self.reach))
        return terrains


LOWER = np.array((0.0, 0.0, 2.0 * SAME_LAYER))
"""By which later grounds are lowered, so that in one plane the first is the upper one [m]."""


class _Bare:
    """Soft ground that no hard object covers."""

    def __init__(self, terrain: HardOnSoft) -> None:
        self.terrain = terrain

    def heights(self, x: Array, y: Array) -> Array:
        """Heights at world positions [m], NaN where there is no ground or something hard on it."""
        height, hard = self.terrain.ground.heights(x, y), self.terrain.hard_heights(x, y)
        return np.where(hard > height - SAME_LAYER, np.nan, height)


def up_to(terrain: Terrain, limit: Array) -> Terrain:
    """A terrain for arrays of places, without hard surfaces, or further grounds, above a limit at each, of their shape
    [m].

    What a sole is beside, or within by mistake, does not bear it.
    """
    if isinstance(terrain, HardOnSoft):
        return replace(terrain, reach=_Lower(terrain.reach, limit), ground=up_to(terrain.ground, limit))
    return replace(terrain, limit=limit) if isinstance(terrain, SeveralGrounds) else terrain


class _Through:
    """All of a terrain for a motion that goes through it: what `up_to` leaves out counts too."""

    def __init__(self, terrain: Terrain) -> None:
        self.heights = terrain.heights


def through(terrain: Terrain) -> Terrain:
    """A terrain for a motion that may go through one of its several grounds, as one does that is made for a level."""
    return _Through(terrain) if isinstance(soft_ground(terrain), SeveralGrounds) else terrain


def bare(terrain: Terrain) -> Terrain:
    """The part of a terrain that takes prints: without what hard objects cover, or all of it."""
    return _Bare(terrain) if isinstance(terrain, HardOnSoft) else terrain


def soft_ground(terrain: Terrain) -> Terrain:
    """The soft ground of a terrain, whole."""
    return terrain.ground if isinstance(terrain, HardOnSoft) else terrain
