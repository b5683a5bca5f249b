"""The ground of a bake at one frame, ready to be looked up at any place: raw, blurred, and for shading."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..ground.display_blur import blurred, gaussian_kernel
from ..ground.heightfield import HeightField
from ..ground.sparse_grid import PLACES_AT_ONCE, TILE, SparseGrid, Window, side_by_side
from ..numerics.arrays import Array
from ..numerics.cell_keys import ROW, Keys, among, cells_of, keys_at, keys_of
from ..numerics.intervals import in_order
from ..numerics.slices import Slices, sliced
from .footprints import NEVER, Footprint, last_contact, recompose

PART = 1 << 15
"""Places for which the ground is made together."""
SQUARE = 1.0
"""Side of the squares by which these are put together [m]: as large as a few footprints."""


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

    def with_relief(self, height: Array, compression: Array) -> GroundSample:
        """The same with so much more displayed height and compression (K,) [m]."""
        return replace(
            self,
            display=self.display + height,
            compression=self.compression + compression,
            rim=self.rim + height + compression,
        )

    def moved_at(self, points: NDArray[np.intp]) -> GroundSample:
        """The same with heights that change at some of the places only."""
        moves = np.zeros(len(self.raw), dtype=bool)
        moves[points] = True
        return replace(self, raw=np.where(moves, self.raw, 0.0), display=np.where(moves, self.display, 0.0))


@dataclass(frozen=True)
class Trail:
    """Cells in which a ground has changed, without the amounts: far smaller than the ground.

    Attributes
    ----------
    touched : (T,) int array
        `cell_keys` of the cells that changed and of those around them, whose look-ups reach them; like the following,
        ascending.
    moved : (M,) int array
        Those whose displayed height changed by more than a floor.
    printed : (P,) int array
        Those that were compressed.
    cell_size : float
        Side of a cell [m].
    """

    touched: Keys
    moved: Keys
    printed: Keys
    cell_size: float

    def covers(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """True for places (N,) where the ground has changed, to the reach of a look-up."""
        return _covers(self.touched, self.cell_size, x, y)


def _covers(touched: Keys, cell_size: float, x: Array, y: Array) -> NDArray[np.bool_]:
    tiles = np.unique(keys_of(cells_of(touched) // TILE))  # most places of a large ground lie in none
    covered = np.zeros(len(x), dtype=bool)
    for first in range(0, len(x), PLACES_AT_ONCE):
        place = np.stack([x[first : first + PLACES_AT_ONCE], y[first : first + PLACES_AT_ONCE]], axis=-1)
        near = np.flatnonzero(among(tiles, keys_at(place, TILE * cell_size)))
        covered[first + near] = among(touched, keys_at(place[near], cell_size))
    return covered


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

    @staticmethod
    @sliced
    def at(
        footprints: Sequence[Footprint], *, frame: float, frame_rate: float, cell_size: float, blur_sigma: float
    ) -> Slices[PressedGround]:
        """The ground at a frame, recomposed from the record."""
        raw = recompose(footprints, frame, cell_size=cell_size)
        yield
        contact = last_contact(footprints, frame, cell_size)
        yield
        return PressedGround(raw, blurred(raw, blur_sigma), contact, frame, frame_rate)

    def trail(self, floor: float) -> Trail:
        """Cells in which the ground has changed, and its displayed height by more than a floor [m]."""
        moved = _cells((tile, values.sum(axis=0) > floor) for tile, values in self.smooth.tiles.items())
        printed = _cells((tile, values[0] > 0) for tile, values in self.raw.tiles.items())
        return Trail(self._touched(), moved, printed, self.smooth.cell_size)

    def covers(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """True for places (N,) where the ground has changed, to the reach of a look-up."""
        return _covers(self._touched(), self.smooth.cell_size, x, y)

    def _touched(self) -> Keys:
        changed = ((tile, values.any(axis=0)) for tile, values in self.smooth.tiles.items())
        trodden = ((tile, np.isfinite(values[0])) for tile, values in self.contact.tiles.items())
        cells = np.union1d(_cells(changed), _cells(trodden))
        for along in (1, ROW):  # one direction after the other keeps the intermediate sets small
            cells = np.unique(np.concatenate([cells - along, cells, cells + along]))
        return cells

    def sample(self, x: Array, y: Array) -> GroundSample:
        """Look the ground up at places (K,), bilinear between the centres of cells."""
        compression, rim, smooth_compression, smooth_rim = side_by_side([self.raw, self.smooth]).sample(x, y)
        since = self.frame - self.contact.nearest(x, y)[0]
        age = np.where(np.isfinite(since), since / self.frame_rate, NEVER)
        return GroundSample(rim - compression, smooth_rim - smooth_compression, smooth_compression, smooth_rim, age)


@sliced
def sample_at(
    footprints: Sequence[Footprint],
    x: Array,
    y: Array,
    *,
    frame: float,
    frame_rate: float,
    cell_size: float,
    blur_sigma: float,
) -> Slices[GroundSample]:
    """The ground at a frame, looked up at places (K,): made part by part, as all of it takes more than its mesh."""
    values = np.empty((5, len(x)))
    order = in_order(np.floor(y / SQUARE), np.floor(x / SQUARE))
    margin = len(gaussian_kernel(blur_sigma / cell_size)) // 2 + 1  # a look-up reaches a cell further than the blur
    for first in range(0, len(order), PART):
        part = order[first : first + PART]
        place = np.stack([x[part], y[part]])
        window = Window.around(place.min(axis=1), place.max(axis=1), cell_size).expanded(margin)
        near = [footprint for footprint in footprints if footprint.window.intersects(window)]
        ground = yield from PressedGround.at.slices(
            near, frame=frame, frame_rate=frame_rate, cell_size=cell_size, blur_sigma=blur_sigma
        )
        yield
        values[:, part] = astuple(ground.sample(*place))
    return GroundSample(*values)


def _cells(masks: Iterable[tuple[tuple[int, int], NDArray[np.bool_]]]) -> Keys:
    """Keys of the cells that are marked in tiles (`TILE`, `TILE`), ascending."""
    keys = [keys_of(np.argwhere(mask)[:, ::-1] + np.array(tile) * TILE) for tile, mask in masks]
    return np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *keys]))
