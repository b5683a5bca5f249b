"""The relief of one print: its outline broken, its wall rebuilt, and the layers of its ground on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array
from ..numerics.interpolation import smooth_step
from ..record.footprints import Footprint
from .amounts import Amounts, Chunks
from .drag import Drag, drags_of
from .lattice_noise import cells, noise, uniform
from .layers import MM, Around
from .print_shape import BETWEEN, CORE, PrintShape, shape_of
from .scattered_crumbs import ScatteredCrumbs, scattered
from .tread import GROOVE, LENGTH, SoleTread, Under

SHALLOW = 0.5
"""Prints down to this part of the depth that heights are given for carry them whole; shallower ones lower heights."""
NEARLY = 0.8
"""Sizes down to this part of the vertices' distance are shown."""
FINEST_CRUMB = 1.5
"""Least diameter of crumbs that are shown, over the finest size."""
FULL = 0.9
"""Share of pressing from which on water may stand: within the walls."""
MEAN_TREAD = 0.3
"""Part of a tread that is grooves, about."""
FLESH, ARCH = 0.7, 0.018
"""Height of a bare foot's ridges over the depth of its print, and the most of it [m]: its arch comes down into deep
prints as well."""
CELLS_FOR_VOLUME = 1500
"""Cells of a print from which its volume is the sum over their centres alone, whatever finer detail is shown."""
MOST_VOLUME = 0.2
"""Largest part by which a print is made deeper or shallower to keep its volume."""


@dataclass(frozen=True)
class Relief:
    """Effect of relief at places, all (N,) arrays [m].

    Attributes
    ----------
    height, compression : array
        Change of the displayed height, and of the displayed compression.
    water : array
        Depth of the water that stands on it.
    pressed : array
        Share of earlier prints' relief that this one wipes out, from 0 to 1.
    """

    height: Array
    compression: Array
    water: Array
    pressed: Array


class PrintRelief:
    """The relief of one print, at any place.

    Parameters
    ----------
    seed : int
        The print's own.
    finest : float
        Least size that the ground shows [m].
    tread : SoleTread, optional
        That the sole has; nothing of it is shown where its grooves are too narrow for that.
    tread_strength : float
        Its height over that of the amounts.
    drags : sequence of Drag
        Where the sole slid.
    in_raster : bool
        True if it is shown at centres of squares as large as the finest size: then it is worked out once for both.

    Attributes
    ----------
    crumbs : list of ScatteredCrumbs
        That lie about it.
    """

    def __init__(
        self,
        shape: PrintShape,
        amounts: Amounts,
        seed: int,
        finest: float,
        tread: SoleTread | None = None,
        tread_strength: float = 1.0,
        drags: Sequence[Drag] = (),
        *,
        in_raster: bool = False,
    ) -> None:
        self._shape, self._amounts, self._seed = shape, amounts, seed
        self._finest = finest * NEARLY
        self._size = (shape.along[1] - shape.along[0]) / LENGTH
        self._tread = tread if GROOVE * self._size > 1.5 * finest else None
        self._tread_strength = tread_strength
        self._drags = drags
        self._wider, self._deeper, self._level, self._part = 0.0, 0.0, -np.inf, 1.0
        self.crumbs: list[ScatteredCrumbs] = []
        self._raster = shape.moved(shape.cell_size)
        if len(self._raster.x) < CELLS_FOR_VOLUME or in_raster:
            self._raster = shape.moved(finest)
        places = self._look_up(self._raster.x, self._raster.y)
        self._wider = self._widening(places)
        rebuilt = self._rebuilt(places, self._wider)
        self.crumbs = self._crumbs(places, rebuilt[2])
        made = self._made(places, rebuilt)
        self._deeper = self._balance(places, made)
        self._level = self._water_level(places, made)
        self._at_raster = self._relief(places, made)

    @property
    def has_tread(self) -> bool:
        """True if it includes a tread."""
        return self._tread is not None and self._amounts.tread is not None

    def at(self, x: Array, y: Array) -> Relief:
        """The relief at world places (N,)."""
        number, whole = self._raster.numbers(x, y), np.zeros((4, len(x)))
        whole[:, number >= 0] = self._at_raster[:, number[number >= 0]]
        others = np.flatnonzero(number == BETWEEN)
        moves = others[self._shape.moves(x[others], y[others])]
        if len(moves):
            places = self._look_up(x[moves], y[moves])
            whole[:, moves] = self._relief(places, self._made(places, self._rebuilt(places, self._wider)))
        return Relief(*whole)

    def _balance(self, places: _Places, made: _Made) -> float:
        """Deepening that keeps the print's volume, over its depth; layers that ask for more than `MOST_VOLUME` are
        lowered: no print throws up more than it has pressed."""
        weight = max(float((places.fade * made.pressed * places.floor).sum()), 1e-12)
        of_wall, whole = made.height.sum() / weight, self._relief(places, made)[0].sum() / weight
        asked = float(whole)
        possible = float(np.clip(asked, -MOST_VOLUME, MOST_VOLUME))
        if possible != asked:
            self._part = float(np.clip((possible - of_wall) / (asked - of_wall), 0.0, 1.0))
            asked = of_wall + self._part * (asked - of_wall)
        return float(np.clip(asked, -MOST_VOLUME, MOST_VOLUME))

    def _widening(self, places: _Places) -> float:
        """Shift of the wall outward that keeps the print's volume [m]; 0 without a wall of its own."""
        if not self._amounts.wall:
            return 0.0
        step = 0.5 * self._shape.cell_size
        excess, wider = (float(self._rebuilt(places, by)[0].sum()) for by in (0.0, step))
        growth = (wider - excess) / step
        limit = self._amounts.wall * MM
        return float(np.clip(-excess / growth, -limit, limit)) if growth < 0 else 0.0

    def _crumbs(self, places: _Places, pressed: Array) -> list[ScatteredCrumbs]:
        """The crumbs about the print, by its values at the raster."""
        wanted, shape = self._amounts.crumbs, self._shape
        if wanted is None:
            return []

        near = self._around(places, pressed).near(wanted.width)
        chances = np.append(near * (1.0 - (1.0 - wanted.within) * pressed), 0.0)

        def chance(x: Array, y: Array) -> Array:
            return np.asarray(chances[self._raster.nearest(x, y)])

        low, high = (np.array([place(places.x), place(places.y)]) for place in (np.min, np.max))
        return scattered(
            self._amounts.surface, self._seed + 181, low, high, chance,
            share=wanted.share, smallest=FINEST_CRUMB * self._finest, fineness=shape.fineness,
        )  # fmt: skip

    def _around(self, places: _Places, pressed: Array) -> Around:
        return Around(
            self._seed, places.x, places.y, places.foot_x, places.foot_y, places.inward + self._wider, pressed,
            self._finest, self._shape.fineness,
        )  # fmt: skip

    def _look_up(self, x: Array, y: Array) -> _Places:
        shape, amounts = self._shape, self._amounts
        outline, _, compression, rim, _, fade, inward_x, inward_y = shape.at(x, y)
        bend = [np.zeros(len(x)), np.zeros(len(x))]
        depth = [-compression] if amounts.bends_with_depth else []
        for number, octave in enumerate(amounts.bends):
            size, amount = octave.size * MM * shape.fineness, octave.amount * MM * shape.fineness
            if size >= self._finest:
                for axis in (0, 1):
                    bend[axis] += amount * noise(self._seed + 2 * number + axis, size, x, y, *depth)
        bent = shape.at(x + bend[0], y + bend[1], 5)
        inward = bent[0]
        if amounts.chunks and amounts.chunks.size * MM * shape.fineness >= 2 * self._finest:
            inward = inward + self._chunks(amounts.chunks, x + 0.5 * bend[0], y + 0.5 * bend[1])
        return _Places(
            x, y, x - outline * inward_x, y - outline * inward_y, inward, bent[1], compression, rim, bent[2], bent[3],
            bent[4], fade,
        )  # fmt: skip

    def _chunks(self, chunks: Chunks, x: Array, y: Array) -> Array:
        """Shift of places inward from the outline, by pieces of the edge that broke [m]."""
        size = chunks.size * MM * self._shape.fineness
        pieces = cells(self._seed + 31, size, x, y)
        (middle,) = self._shape.at(x - pieces.x, y - pieces.y, 1)
        shift = (uniform(32, pieces.number) - 0.62) * chunks.shift * MM * self._shape.fineness
        shift = np.where(shift < 0, 0.5 * shift, shift)
        return np.where((np.abs(middle) < 0.6 * size) & (uniform(33, pieces.number) < chunks.share), shift, 0.0)

    def _rebuilt(self, places: _Places, wider: float) -> tuple[Array, Array, Array]:
        """Change of height and compression by the broken wall, and share of pressing; the wall is `wider` [m]."""
        wall = self._amounts.wall * MM * self._shape.fineness
        if wall:
            pressed = smooth_step((places.inward + wider) / wall + 0.5)
            pressed = smooth_step((places.inward + wider + self._ledges(places, places.floor * pressed)) / wall + 0.5)
            compression, rim = places.floor * pressed, places.continued * (1.0 - pressed)
        else:
            pressed = smooth_step(places.inward / (2.0 * self._shape.cell_size) + 0.5)
            compression, rim = places.bent_compression, places.bent_rim
        deeper = (compression - places.compression) * places.fade
        return (rim - places.rim) * places.fade - deeper, deeper, pressed

    def _ledges(self, places: _Places, depth: Array) -> Array:
        """Shift of the wall's places inward at their depth [m]: walls are no prisms."""
        further = np.zeros(len(depth))
        on_wall = np.flatnonzero(np.abs(places.inward) < 2.0 * self._amounts.wall * MM)
        at = (places.x[on_wall], places.y[on_wall], depth[on_wall])
        for number, octave in enumerate(self._amounts.ledges):
            size, amount = (length * MM * self._shape.fineness for length in (octave.size, octave.amount))
            if size >= self._finest:
                further[on_wall] += amount * noise(self._seed + 51 + number, size, *at)
        return further

    def _made(self, places: _Places, rebuilt: tuple[Array, Array, Array]) -> _Made:
        height, compression, pressed = rebuilt
        around = self._around(places, pressed)
        made_of = (*self._amounts.layers, *self.crumbs, *self._drags)
        layers = sum((layer.heights(around) for layer in made_of), np.zeros(len(places.x)))
        return _Made(height, compression, pressed, layers + self._standing(places, around))

    def _relief(self, places: _Places, made: _Made) -> Array:
        """The values of a `Relief`, (4, N)."""
        share = self._part * min(1.0, self._shape.depth / (SHALLOW * self._amounts.depth * MM))
        deeper = self._deeper * made.pressed * places.floor * places.fade
        height = made.height + share * made.layers * places.fade - deeper
        water = np.maximum(self._level - (places.rim - places.compression + height), 0.0) * (made.pressed > FULL)
        return np.stack([height, made.compression + deeper, water, made.pressed])

    def _water_level(self, places: _Places, made: _Made) -> float:
        """Height of the water in the print, from the undisturbed ground [m]."""
        water, floor = self._amounts.water, places.inward > CORE * self._shape.fineness
        if water is None or not floor.any():
            return -np.inf
        heights = (places.rim - places.compression + self._relief(places, made)[0])[floor]
        return float(np.percentile(heights, 50.0 * water.share) + water.above * MM * self._shape.fineness)

    def _standing(self, places: _Places, around: Around) -> Array:
        """Ridges of the tread in the print [m]."""
        tread, shape = self._amounts.tread, self._shape
        if tread is None or self._tread is None:
            return np.zeros(len(places.x))
        bent = [around.length(1.2) * around.noise(number, 20.0) for number in (41, 42)]
        along, across = shape.under_sole(places.x + bent[0], places.y + bent[1])
        under = Under(
            (along - sum(shape.along) / 2) / self._size,
            (across - sum(shape.across) / 2) / self._size,
            around.inward / self._size,
            (shape.across[1] - shape.across[0]) / self._size,
        )
        ridges = self._tread(under) - MEAN_TREAD
        for drag in self._drags:
            ridges = ridges * drag.spared(around)
        if self._tread.is_flesh:
            height = np.minimum(places.floor * FLESH, ARCH * self._size) * (1.0 - tread.least_lost)
            return ridges * around.pressed * height * min(1.0, self._tread_strength)
        worn = np.clip(0.45 + 0.4 * around.noise(43, 30.0) + 0.25 * around.noise(44, 11.0), 0.0, 1.0)
        lost = tread.least_lost + (tread.lost - tread.least_lost) * worn * worn
        within = smooth_step((around.inward - around.length(3.0)) / around.length(6.0))
        return ridges * (1.0 - lost) * within * tread.height * MM * self._size * self._tread_strength


@dataclass(frozen=True)
class _Places:
    """Places around a print and their values, all (N,) arrays: see `Around` and `PrintShape`."""

    x: Array
    y: Array
    foot_x: Array
    foot_y: Array
    inward: Array
    floor: Array
    compression: Array
    rim: Array
    bent_compression: Array
    bent_rim: Array
    continued: Array
    fade: Array


@dataclass(frozen=True)
class _Made:
    """Parts of a relief at places, all (N,) arrays: what the broken wall changes, see `_rebuilt`, and layers [m]."""

    height: Array
    compression: Array
    pressed: Array
    layers: Array


def relief_of_print(
    footprint: Footprint,
    amounts: Amounts,
    *,
    blur_sigma: float,
    finest: float,
    seed: int,
    tread: SoleTread | None = None,
    tread_strength: float = 1.0,
    in_raster: bool = False,
) -> PrintRelief | None:
    """The relief of a footprint; None where it pressed next to nothing. See `PrintRelief`."""
    shape = shape_of(footprint, blur_sigma)
    if shape is None or not shape.depth > 0:
        return None
    drags = drags_of(footprint, shape.along[1] - shape.along[0], shape.depth)
    return PrintRelief(shape, amounts, seed, finest, tread, tread_strength, drags, in_raster=in_raster)
