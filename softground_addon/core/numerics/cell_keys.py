"""Sets of cells as ascending integers: row by row, and quick to look up."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Keys = NDArray[np.int64]

ROW = 1 << 32
"""A cell's key is row·ROW + column; rows and columns may be negative."""


def keys_of(cells: NDArray[np.integer]) -> Keys:
    """Keys of cells given by column and row, (..., 2)."""
    cells = np.asarray(cells, dtype=np.int64)
    keys: Keys = cells[..., 1] * ROW + cells[..., 0]
    return keys


def cells_of(keys: Keys) -> Keys:
    """Column and row of each key, (..., 2)."""
    row = (keys + ROW // 2) >> 32  # several times faster than a division
    return np.stack([keys - row * ROW, row], axis=-1)


def keys_at(places: NDArray[np.float64], side: float) -> Keys:
    """Keys of the squares of a given side that hold each of the places (N, 2)."""
    return keys_of(np.floor(places / side))


def cells_at(places: NDArray[np.float64], side: float) -> Keys:
    """Keys of the squares of a given side that hold the places (N, 2), each once and ascending."""
    return np.unique(keys_at(places, side))


def parents_of(keys: Keys) -> Keys:
    """Keys of the squares of twice the side that hold the given ones, each once and ascending."""
    return np.unique(keys_of(cells_of(keys) >> 1))


def merged(*ascending: Keys) -> Keys:
    """The keys of arrays that ascend, or nearly so, each once and ascending."""
    keys = np.sort(np.concatenate(ascending), kind="stable")  # merges what ascends already
    return np.concatenate([keys[:1], keys[1:][keys[1:] != keys[:-1]]])


def among(known: Keys, wanted: Keys) -> NDArray[np.bool_]:
    """True for each wanted key that is among the known ones, which ascend."""
    if not len(known):
        return np.zeros(wanted.shape, dtype=bool)
    return np.asarray(known[np.minimum(np.searchsorted(known, wanted), len(known) - 1)] == wanted)


AROUND = keys_of(np.array([(column, row) for row in (-1, 0, 1) for column in (-1, 0, 1)]))
"""Differences from a key to itself and to the keys of the eight cells around."""
