"""Crust of snow that breaks around a hole: plates between open cracks, each tilted toward the hole.

A plate on a soft foundation that is loaded at its edge bends most at pi/4 of its characteristic length from there, and
breaks (Hetényi 1946, "Beams on Elastic Foundation", University of Michigan Press). Cracks that run out from the hole
part it from its neighbours before, as in ice that floats (Kerr 1976, "The bearing capacity of floating ice plates
subjected to static or quasi-static loads", Journal of Glaciology 17).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..ground.field_tests import BOOT_STRESS, DENSITY, ONE_FINGER, PENCIL, POISSON_RATIO, boot_depth, hardness_of
from ..ground.material import GroundMaterial
from ..numerics.arrays import Array, Indices, Mask
from ..numerics.cell_keys import keys_of
from ..numerics.interpolation import smooth_step
from ..record.footprints import Footprint
from .amounts import Amounts, Bend, Chunks
from .lattice_noise import noise, uniform
from .layers import MM, Lumps
from .print_shape import inside_of, outline_of

THICKNESS = 0.02
"""Of the crust [m]: wind crusts that carry no boot are 1 to 3 cm thick (placed)."""
ICE = 917.0
"""Density of ice [kg/m³]."""
POISSON = 0.2
"""Poisson's ratio of dense snow."""
WET = 1.5
"""Snow that raises so many times the rim of dry snow as hard is wet, and gives way without breaking."""
SHALLOW, DEEP = 1.5, 3.5
"""Depth of a print, in thicknesses of the crust, from which on, and down to which, the crust breaks around it."""
RINGS = ((0.5, 1.0, 0.9), (1.3, 1.1, 0.25), (1.9, 0.9, 0.0))
"""Rings of plates: distance of their middles from the hole, and of one from the next, in lengths of plates; share of
those that are loose. The last stands for the ground around, which holds (by eye)."""
BAND = 0.12
"""Distance up to which such a middle is off its ring, in lengths of plates."""
REACH = RINGS[-1][0] + BAND
"""Distance from the hole up to which plates move, in their lengths."""
CLOSE = 2.5
"""Distance along an axis from a square as wide as a plate, from its middle, up to which middles are near [lengths]."""
TILTS, SIDEWAYS = (0.04, 0.13), 0.04
"""Slopes of plates toward the hole, least and most, and across it at most (by eye)."""
BROKEN, LOST = 0.65, (0.2, 0.45)
"""Share of plates at the hole whose inner edge has broken off, and the least and most of their length that has."""
SLID, STEEPER = 0.004, 0.3
"""Depth by which such a piece has slid down [m], and its slope beside that of its plate (by eye)."""
GAPS = (0.0004, 0.0045)
"""Half the width of cracks, least and most [m] (by eye)."""
BENDS = ((0.05, 0.005), (0.016, 0.002))
"""Bends of cracks: sizes and amounts [m]."""
BROKEN_THROUGH = 0.25
"""Share of a print's volume that is pressed when its crust breaks."""
FRAMES = 1.5
"""Recorded frames that breaking takes."""


def tensile_strength(density: float) -> float:
    """Tensile strength of rounded, dry snow of a density [kg/m³], in Pa.

    Jamieson and Johnston 1990, doi:10.1017/S002214300000561X.
    """
    return float(79.7e3 * (density / ICE) ** 1.39)


def elastic_modulus(density: float) -> float:
    """Elastic modulus of snow of a density [kg/m³], in Pa (Scapozza 2004, doi:10.3929/ethz-a-004680249)."""
    return float(1.873e5 * np.exp(0.0149 * density))


def ring(modulus: float, thickness: float, foundation: float) -> float:
    """Distance from its loaded edge at which a plate on a soft foundation [Pa/m] breaks [m].

    Examples
    --------
    >>> bool(np.isclose(ring(12e6 * (1 - POISSON**2), 0.01, 4.0), np.pi / 4))
    True
    """
    rigidity = modulus * thickness**3 / (12.0 * (1.0 - POISSON**2))
    return float(np.pi / 4.0 * (4.0 * rigidity / foundation) ** 0.25)


def overhang(density: float, thickness: float, gravity: float) -> float:
    """Length at which a plate that nothing supports breaks under its own weight [m]."""
    return float(np.sqrt(tensile_strength(density) * thickness / (3.0 * density * gravity)))


def plate_length(material: GroundMaterial, gravity: float) -> float:
    """Length from the hole to the crack around it of the plates of snow [m]; 0 of what breaks into none.

    What is soft or wet gives way without breaking, as does the paper's snow.
    """
    hardness = hardness_of(material)
    wet = material.poisson_ratio > WET * np.interp(hardness, *POISSON_RATIO)
    if material.linear or wet or not (material.crust_stress or hardness >= ONE_FINGER):
        return 0.0
    hard = PENCIL if material.crust_stress else hardness
    density = float(np.interp(hard, np.arange(1, 1 + len(DENSITY)), DENSITY))
    around = ring(elastic_modulus(density), THICKNESS, BOOT_STRESS / boot_depth(material))
    return min(around, overhang(density, THICKNESS, gravity))


def angular(amounts: Amounts, length: float) -> Amounts:
    """The amounts of prints in a crust: fewer crumbs, edges broken along straight lines in pieces of plates."""
    size = 0.5 * length / MM
    return replace(
        amounts,
        bends=tuple(Bend(bend.size, 0.4 * bend.amount) for bend in amounts.bends),
        chunks=Chunks(size, 0.55 * size, 0.7),
        layers=tuple(layer for layer in amounts.layers if not isinstance(layer, Lumps)),
        crumbs=amounts.crumbs and replace(amounts.crumbs, share=0.4 * amounts.crumbs.share),
    )


class BrokenCrust:
    """The crust around one print.

    Parameters
    ----------
    length : float
        Of its plates [m].
    seed : int
        The print's own.

    Attributes
    ----------
    window : Window
        Cells up to which it is broken.
    frames : (float, float)
        Scene frames between which it breaks.
    cells : (N,) int array
        Keys of every other cell, along each axis, in which plates are loose.
    is_edge : (N,) bool array
        True for those at cracks; elsewhere, plates are plane.
    """

    def __init__(self, footprint: Footprint, length: float, seed: int) -> None:
        self._seed, self.cell_size, self._length = seed, footprint.cell_size, length
        reach = REACH * length
        far = int(np.ceil(reach / self.cell_size)) + 1
        window = footprint.window.expanded(far)
        compression = np.pad(footprint.tile(footprint.pressing), far)
        inside = inside_of(compression)
        out = -outline_of(inside, far) * self.cell_size
        self.window, self.frames = window, _breaking(footprint)
        depth = float(compression[inside].mean()) if inside.any() else 0.0
        self._strength = float(smooth_step(np.array((depth / THICKNESS - SHALLOW) / (DEEP - SHALLOW))))
        x, y = window.centres(self.cell_size)
        self._slopes = np.stack(np.gradient(out, self.cell_size)[::-1], axis=-1)
        self._near = (out > 0) & (out < reach)
        row, column = np.nonzero(self._near)
        others = ((row + window.row) % 2 == 0) & ((column + window.column) % 2 == 0)
        row, column = row[others], column[others]
        place, out = np.stack([x[column], y[row]], axis=-1), out[row, column]
        chance = uniform(seed, column + window.column, row + window.row)
        self._middles, self._is_loose = self._plates(place[order := np.argsort(chance)], out[order])
        self._lift, self.cells, self.is_edge = 0.0, np.zeros(0, dtype=np.int64), np.zeros(0, dtype=bool)
        self._breaks = self._strength > 0 and len(self._middles) > 1
        if self._breaks:
            plate, height, to_edge = self._heights(place[:, 0], place[:, 1], 0.0)
            loose = self._is_loose[plate]
            self._lift = -float(height.sum()) / max(1, np.count_nonzero(loose))
            self.is_edge = to_edge[loose] < self.cell_size
            self.cells = keys_of(np.stack([column + window.column, row + window.row], axis=-1)[loose])

    def reaches(self, x: Array, y: Array) -> Mask:
        """True for places (N,) that are near enough to be on its plates."""
        near: Mask = self._near[self.window.cells_under(x, y, self.cell_size)]
        return near & self._breaks

    def at(self, x: Array, y: Array, finest: float) -> tuple[Array, Mask]:
        """Change of height (N,) [m] at places that it reaches, and True where a plate is loose.

        `finest` is the least size that the ground shows [m].
        """
        plate, moved, _ = self._heights(x, y, finest)
        return self._strength * moved, self._is_loose[plate]

    def _plates(self, place: Array, out: Array) -> tuple[Array, Mask]:
        """Middles of plates (P, 2) and whether each is loose: in rings, of places (N, 2) in an order of chance."""
        middles, loose = [np.zeros((0, 2))], [np.zeros(0, dtype=bool)]
        for number, (at, apart, share) in enumerate(RINGS):
            remaining = place[np.abs(out / self._length - at) < BAND]
            chosen: list[Array] = []
            while len(remaining):
                chosen.append(remaining[0])
                away = np.linalg.norm(remaining - remaining[0], axis=1)
                remaining = remaining[away > apart * self._length]
            middles.append(np.array(chosen).reshape(-1, 2))
            loose.append(uniform(self._seed + number, np.arange(len(chosen))) < share)
        self._at_hole = len(middles[1])
        return np.concatenate(middles), np.concatenate(loose)

    def _nearest(self, place: Array) -> tuple[Indices, Indices, Array]:
        """The plate that each place (N, 2) is on, the one beside it, and the distance to their edge [m]."""
        both, to_edge = np.zeros((2, len(place)), dtype=np.intp), np.zeros(len(place))
        squares = np.floor(place / self._length).astype(np.intp)
        order = np.argsort(keys_of(squares), kind="stable")
        for points in np.split(order, np.flatnonzero(np.diff(keys_of(squares)[order])) + 1):
            away = np.abs(self._middles / self._length - squares[points[0]] - 0.5).max(axis=1)
            close = np.argsort(away, kind="stable")[: max(2, np.count_nonzero(away < CLOSE))]
            square = ((place[points][:, None] - self._middles[close]) ** 2).sum(axis=-1)
            two = np.argpartition(square, 1, axis=1)[:, :2]
            first, second = np.take_along_axis(square, two, axis=1).T
            both[:, points] = close[two].T
            between = np.linalg.norm(self._middles[both[0, points]] - self._middles[both[1, points]], axis=1)
            to_edge[points] = (second - first) / (2.0 * between)
        return both[0], both[1], to_edge

    def _heights(self, x: Array, y: Array, finest: float) -> tuple[Indices, Array, Array]:
        """The plate that each place (N,) is on, its change of height and its distance to a crack [m]."""
        for axis_seed, (size, amount) in enumerate(BENDS):
            bend = [amount * noise(self._seed + 60 + 2 * axis_seed + axis, size, x, y) for axis in (0, 1)]
            x, y = x + bend[0], y + bend[1]
        place = np.stack([x, y], axis=-1)
        plate, beside, to_edge = self._nearest(place)
        chance = [uniform(self._seed + number, np.arange(len(self._middles)))[plate] for number in (71, 72, 73, 74)]
        slopes = self._slopes[self.window.cells_under(self._middles[:, 0], self._middles[:, 1], self.cell_size)]
        ahead = (slopes / np.maximum(np.linalg.norm(slopes, axis=1), 1e-9)[:, None])[plate]
        from_middle = place - self._middles[plate]
        along = (from_middle * ahead).sum(axis=1)
        across = from_middle[:, 0] * -ahead[:, 1] + from_middle[:, 1] * ahead[:, 0]
        slope = TILTS[0] + (TILTS[1] - TILTS[0]) * chance[0]
        height = slope * along + SIDEWAYS * (2.0 * chance[1] - 1.0) * across
        cut = self._length * (LOST[0] + (LOST[1] - LOST[0]) * chance[2] - 0.5)
        has_cut = (chance[3] < BROKEN) & (plate < self._at_hole)
        off = np.where(has_cut, np.maximum(cut - along, 0.0), 0.0)
        height = height - STEEPER * off - SLID * (off > 0) + self._lift
        loose = self._is_loose[plate]
        to_edge = np.where(has_cut & loose, np.minimum(to_edge, np.abs(along - cut)), to_edge)
        pair = uniform(self._seed + 75, np.minimum(plate, beside), np.maximum(plate, beside))
        width = GAPS[0] + (GAPS[1] - GAPS[0]) * pair**2
        shown = np.maximum(width, 0.55 * finest)
        gap = np.maximum(1.0 - (to_edge / shown) ** 2, 0.0) * THICKNESS * np.sqrt(width / shown)
        moved = np.where(loose, height, 0.0) - np.where(loose | self._is_loose[beside], gap, 0.0)
        return plate, moved, to_edge


def _breaking(footprint: Footprint) -> tuple[float, float]:
    """Scene frames between which a crust breaks around a footprint: as its sole goes through."""
    changes = footprint.pressing
    amounts = np.cumsum(np.append(changes.amounts[:], 0))[changes.first[1:] - 1]
    through = int(np.searchsorted(amounts, BROKEN_THROUGH * amounts[-1])) if len(amounts) else 0
    end = float(changes.frames[through]) if len(amounts) else footprint.start_frame
    return end - FRAMES * footprint.frame_step, end
