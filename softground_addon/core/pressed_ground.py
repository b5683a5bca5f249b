"""The ground of a bake at one frame, ready to be looked up at any place: raw, blurred, and what shading needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .footprints import NEVER, Footprint, last_contact, recompose
from .heightfield import TILE, HeightField, SparseGrid, Window
from .smoothing import blurred

Array = NDArray[np.float64]

_AROUND = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)]


@dataclass(frozen=True)
class GroundSample:
    """The pressed ground at K places, all (K,) float arrays.

    Attributes
    ----------
    raw, display : array
        Change of height against the undisturbed ground, as simulated and blurred [m].
    compression, rim : array
        Blurred depth pressed down and height piled up [m].
    age : array
        Time since the last contact [s], `footprints.NEVER` where there was none.
    """

    raw: Array
    display: Array
    compression: Array
    rim: Array
    age: Array


@dataclass(frozen=True)
class PressedGround:
    """The ground at one frame.

    Attributes
    ----------
    raw, smooth : HeightField
        Compression and rim as simulated, and blurred for display.
    contact : SparseGrid
        Frame of the last contact of each cell.
    frame : float
        Scene frame.
    frame_rate : float
        Scene frames per second [Hz].
    """

    raw: HeightField
    smooth: HeightField
    contact: SparseGrid
    frame: float
    frame_rate: float

    @classmethod
    def at(
        cls, footprints: Sequence[Footprint], *, frame: float, frame_rate: float, cell_size: float, blur_sigma: float
    ) -> PressedGround:
        """The ground at a frame, recomposed from the record."""
        raw = recompose(footprints, frame, cell_size=cell_size)
        contact = last_contact(footprints, frame, cell_size)
        return cls(raw, blurred(raw, blur_sigma), contact, frame, frame_rate)

    def covers(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Which of the places (N,) lie where the ground has changed, to the reach of a look-up."""
        near = np.flatnonzero(self._near_tiles(x, y))
        covered = np.zeros(len(x), dtype=bool)
        covered[near] = self._changed().nearest(x[near], y[near])[0] > 0
        return covered

    def _near_tiles(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Which places lie in a tile of the ground or one beside it: leaves few for the closer look."""
        size = TILE * self.smooth.cell_size
        tiles = np.array(sorted(self.smooth.tiles), dtype=np.int64).reshape(-1, 2)
        if not len(tiles):
            return np.zeros(len(x), dtype=bool)
        first = tiles.min(axis=0) - 1
        known = np.zeros(tiles.max(axis=0) - first + 2, dtype=bool)
        for i, j in _AROUND:
            known[tuple((tiles - first + (i, j)).T)] = True
        place = np.stack([np.floor(x / size), np.floor(y / size)], axis=-1).astype(np.int64) - first
        inside = ((place >= 0) & (place < known.shape)).all(axis=1)
        near = np.zeros(len(x), dtype=bool)
        near[inside] = known[tuple(place[inside].T)]
        return near

    def _changed(self) -> SparseGrid:
        """1 in cells that changed and in those around them, whose look-ups reach them."""
        changed = SparseGrid(self.smooth.cell_size, channels=1)
        for column, row in {(c + i, r + j) for c, r in self.smooth.tiles for i, j in _AROUND}:
            window = Window(column * TILE, row * TILE, TILE, TILE)
            near = window.expanded(1)
            touched = (self.smooth.read(near) != 0).any(axis=0) | np.isfinite(self.contact.read(near)[0])
            if touched.any():
                wide = touched[:-2] | touched[1:-1] | touched[2:]
                changed.write(window, (wide[:, :-2] | wide[:, 1:-1] | wide[:, 2:])[None].astype(float))
        return changed

    def sample(self, x: Array, y: Array) -> GroundSample:
        """Look the ground up at places (K,), bilinear between the centres of cells."""
        compression, rim = self.raw.sample(x, y)
        smooth_compression, smooth_rim = self.smooth.sample(x, y)
        since = self.frame - self.contact.nearest(x, y)[0]
        age = np.where(np.isfinite(since), since / self.frame_rate, NEVER)
        return GroundSample(rim - compression, smooth_rim - smooth_compression, smooth_compression, smooth_rim, age)
