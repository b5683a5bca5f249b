"""Fallout of what steps throw, per area of the ground: for images of it."""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array
from ..numerics.cell_keys import among, keys_at

SPOTS = 13
"""Spots that the disk of a piece is taken as, which may reach over several cells."""
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))


class Fallout:
    """Pieces that have come down, as seen from points of the ground.

    Parameters
    ----------
    place : (N, 2) float array
        Where pieces come to rest [m].
    radius : (N,) float array
        [m]
    landed : (N,) float array
        Scene frame at which each comes down.
    points : (P, 2) float array
        Where the ground is looked at [m].
    cell_size : float
        Side of the squares over which pieces are summed [m].

    Examples
    --------
    >>> place, points = np.array([[0.55, 0.55]]), np.array([[0.51, 0.59], [3.0, 0.5]])
    >>> one = Fallout(place, np.array([0.01]), np.array([7.0]), points, 0.1)
    >>> thickness, cover, latest = one.at(8.0)
    >>> (thickness * 1e3).round(3).tolist()  # 4/3·π·1 cm³ over 100 cm² is 0.4 mm
    [0.419, 0.0]
    >>> latest.tolist()
    [7.0, -inf]
    """

    def __init__(self, place: Array, radius: Array, landed: Array, points: Array, cell_size: float) -> None:
        number = np.arange(SPOTS)
        turn = number * _GOLDEN
        spiral = np.sqrt((number + 0.5) / SPOTS)[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        spots = place[:, None] + radius[:, None, None] * spiral
        known, self._cell = np.unique(keys_at(spots.reshape(-1, 2), cell_size), return_inverse=True)
        wanted = keys_at(points, cell_size)
        self._of_point = np.where(among(known, wanted), np.searchsorted(known, wanted), len(known))
        self._count = len(known) + 1  # the last is that of points on which nothing falls
        self._landed = landed
        self._depth = 4 / 3 * np.pi * radius**3 / (SPOTS * cell_size**2)
        self._area = np.pi * radius**2 / (SPOTS * cell_size**2)

    def at(self, frame: float) -> tuple[Array, Array, Array]:
        """Fallout at the points at a scene frame.

        Returns
        -------
        thickness : (P,) float array
            Volume over area [m].
        cover : (P,) float array
            Share of the ground that is covered, 0 to 1, where pieces lie at random.
        latest : (P,) float array
            Scene frame at which something came down last; -inf where nothing did.
        """
        down = self._landed <= frame
        cell = self._cell.reshape(-1, SPOTS)[down].ravel()

        def summed(values: Array) -> Array:
            return np.bincount(cell, np.repeat(values[down], SPOTS), self._count)[self._of_point]

        latest = np.full(self._count, -np.inf)
        np.maximum.at(latest, cell, np.repeat(self._landed[down], SPOTS))
        return summed(self._depth), -np.expm1(-summed(self._area)), latest[self._of_point]
