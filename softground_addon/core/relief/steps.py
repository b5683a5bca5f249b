"""The relief of all steps at the places of a ground: each adds its own and wipes out that of earlier ones."""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..ground.display_blur import gaussian_kernel
from ..ground.heightfield import HeightField
from ..ground.places import Places
from ..numerics.arrays import Array, Indices, Mask
from ..numerics.cell_keys import AROUND, Keys, cells_at, merged
from ..numerics.interpolation import smooth_step
from ..numerics.slices import Slices, sliced
from ..record.edits import step_id
from ..record.footprints import Footprint
from ..record.pressed_ground import Trail
from .amounts import Amounts
from .broken_crust import BrokenCrust, angular
from .carved_lumps import lumps, lying
from .carved_walls import room
from .print_relief import FINEST_CRUMB, relief_of_print
from .print_shape import SAME
from .tread import SoleTread

QUANTUM = 2.0**-20
"""Step of heights [m], as of those that are played (`playback.ramps.QUANTUM`)."""


HIDDEN = 0.012
"""Movement of ground by what bodies carve that hides a broken crust [m]."""


def _whole(values: Array) -> Array:
    """Values in whole quanta."""
    return np.asarray(np.round(values / QUANTUM) * QUANTUM)


@dataclass(frozen=True)
class BrokenPlates:
    """Movement of the plates of a crust, which break all at once.

    Attributes
    ----------
    point : (B,) int array
        Places on them, each once.
    change : (B, 2) float array
        As of `StepRelief`.
    frames : (float, float)
        Between which they move.
    """

    point: Indices
    change: Array
    frames: tuple[float, float]

    def at(self, chosen: Mask, number: Indices) -> BrokenPlates:
        """Those at chosen places (B,), by other numbers of places."""
        return BrokenPlates(number[self.point[chosen]], self.change[chosen], self.frames)


@dataclass(frozen=True)
class StepRelief:
    """Relief that one step adds to the ground while it presses.

    Attributes
    ----------
    point : (N,) int array
        The places, each once.
    change : (N, 2) float array
        Of the displayed height and the displayed compression [m].
    water : (N,) float array
        Depth of the water that stands there after the step [m].
    tread : bool
        True if it includes the tread of the sole.
    plates : tuple of BrokenPlates
        Of a crust that the step has broken.
    """

    point: Indices
    change: Array
    water: Array
    tread: bool = False
    plates: tuple[BrokenPlates, ...] = ()

    def scaled(self, strength: float) -> StepRelief:
        """The same with so many times the change, in whole quanta."""
        plates = tuple(replace(each, change=_whole(strength * each.change)) for each in self.plates)
        return replace(self, change=_whole(strength * self.change), plates=plates)


NOTHING = StepRelief(np.zeros(0, dtype=np.intp), np.zeros((0, 2)), np.zeros(0))
"""Relief of a step that has none."""


@dataclass(frozen=True)
class ReliefSettings:
    """Settings of the relief that a ground shows.

    Attributes
    ----------
    amounts : Amounts
        Of the ground's look.
    strength : float
        Factor of all of it: 1 for the amounts as given.
    treads : mapping of (str, str) to SoleTread
        Of the soles that have one, by character and name.
    tread_strength : float
        Height of the tread over that of the amounts.
    of_surfaces : mapping of str to Amounts
        Of the looks of regions.
    plates : mapping of str to float
        Length of the plates [m] that a crust breaks into, by the surfaces of regions; of the ground itself, by "".
    """

    amounts: Amounts
    strength: float = 1.0
    treads: Mapping[tuple[str, str], SoleTread] = field(default_factory=dict)
    tread_strength: float = 1.0
    of_surfaces: Mapping[str, Amounts] = field(default_factory=dict)
    plates: Mapping[str, float] = field(default_factory=dict)

    def amounts_of(self, footprint: Footprint) -> Amounts:
        """The amounts of the ground that a footprint is in."""
        amounts, length = self.of_surfaces.get(footprint.surface, self.amounts), self.plates.get(footprint.surface)
        return angular(amounts, length) if length else amounts

    def crust_around(self, footprint: Footprint) -> BrokenCrust | None:
        """The crust that breaks around a footprint; None where there is none."""
        length = self.plates.get(footprint.surface)
        return BrokenCrust(footprint, length, _seed(footprint)) if length else None


@sliced
def broken_cells(footprints: Sequence[Footprint], wanted: ReliefSettings | None) -> Slices[tuple[Keys, Keys]]:
    """Keys of cells in which a crust breaks around footprints, and of those at its cracks."""
    broken, cracks = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for footprint in footprints:
        if wanted and (crust := wanted.crust_around(footprint)):
            broken.append(crust.cells)
            cracks.append(crust.cells[crust.is_edge])
            yield
    return np.unique(np.concatenate(broken)), np.unique(np.concatenate(cracks))


@sliced
def with_broken(trail: Trail, footprints: Sequence[Footprint], wanted: ReliefSettings | None) -> Slices[Trail]:
    """A trail with the plates of crusts that break around its footprints, which move as planes but for their cracks."""
    broken, cracks = yield from broken_cells.slices(footprints, wanted)
    if not len(broken):
        return trail
    touched, moved = (merged(*(keys + step for step in AROUND)) for keys in (broken, cracks))
    return replace(trail, touched=merged(trail.touched, touched), moved=merged(trail.moved, moved))


@sliced
def relief_of_steps(
    footprints: Sequence[Footprint], x: Array, y: Array, wanted: ReliefSettings, *, blur_sigma: float
) -> Slices[list[StepRelief]]:
    """Relief that each step adds to the displayed ground at places (K,), in the order of the footprints.

    A step flattens the relief of earlier ones where it presses, as it comes.

    Parameters
    ----------
    footprints : sequence of Footprint
        In the order of their first contact.
    x, y : (K,) float arrays
        World positions [m].
    blur_sigma : float
        Standard deviation of the display blur [m].
    """
    places = Places(x, y)
    standing, water = np.zeros((len(places.x), 2)), np.zeros(len(places.x))
    loose, lumped = lying(footprints) if len(places.x) else None, np.zeros(len(places.x))
    between = (yield from room.slices(footprints, places, blur_sigma)) if loose else None
    steps, whole = [], np.ones(len(places.x))
    for footprint in footprints:
        yield
        crust = wanted.crust_around(footprint) if len(places.x) else None
        if loose and not len(footprint.contact_cells):
            step = _carve(footprint, loose, places, lumped, water, wanted)
        else:
            step = _step(footprint, places, standing, water, wanted, blur_sigma, between, whole if crust else None)
        if crust:
            step = _broken(step, crust, places, standing, whole, loose)
        steps.append(step.scaled(wanted.strength))
    return steps


def _seed(footprint: Footprint) -> int:
    """The seed of a footprint's relief."""
    return zlib.crc32(step_id(footprint).encode())


def _step(
    footprint: Footprint,
    places: Places,
    standing: Array,
    water: Array,
    wanted: ReliefSettings,
    blur_sigma: float,
    between: tuple[Array, Array] | None,
    whole: Array | None,
) -> StepRelief:
    """Relief of full strength that a step adds; updates the relief (K, 2) and the water (K,) at all places.

    The relief stays between two heights (K,), if given; of a crust, it updates the share (K,) that is `whole`.
    """
    if not len(footprint.contact_cells):
        return NOTHING
    margin = len(gaussian_kernel(blur_sigma / footprint.cell_size)) // 2 + 1
    point = places.within(footprint.window.expanded(margin), footprint.cell_size) if len(places.x) else NOTHING.point
    if not len(point):
        return NOTHING
    tread = wanted.treads.get((footprint.character, footprint.sole)) if wanted.tread_strength > 0 else None
    finest = _finest(places, point, footprint.cell_size)
    of_print = relief_of_print(
        footprint,
        wanted.amounts_of(footprint),
        blur_sigma=blur_sigma,
        finest=finest,
        in_raster=_in_raster(places, point, finest),
        seed=_seed(footprint),
        tread=tread,
        tread_strength=wanted.tread_strength,
    )
    if of_print is None:
        return NOTHING
    relief = of_print.at(places.x[point], places.y[point])
    change = np.stack([relief.height, relief.compression], axis=-1)
    change -= relief.pressed[:, None] * standing[point]
    if between:
        height = standing[point, 0] + change[:, 0]
        beyond = height - np.clip(height, *(end[point] for end in between))
        change += beyond[:, None] * (-1.0, 1.0)  # what rises less is compressed more
    change = _whole(change)
    standing[point] += change
    water[point] = np.maximum(water[point] * (1.0 - relief.pressed), relief.water)
    if whole is not None:
        whole[point] *= 1.0 - relief.pressed
    changed = change.any(axis=1)
    return StepRelief(point[changed], change[changed], water[point[changed]], of_print.has_tread)


def _broken(
    step: StepRelief,
    crust: BrokenCrust,
    places: Places,
    standing: Array,
    whole: Array,
    loose: HeightField | None,
) -> StepRelief:
    """A step with the crust broken around it; updates the relief (K, 2) and the share (K,) that is whole.

    What lies `loose` where bodies carve hides it.
    """
    point = places.within(crust.window, crust.cell_size)
    finest = _finest(places, point, crust.cell_size) if len(point) else 0.0
    point = point[crust.reaches(places.x[point], places.y[point]) & (whole[point] > 0)]
    if not len(point):
        return step
    bare = whole[point]
    if loose:
        bare = bare * smooth_step(1.0 - loose.sample(places.x[point], places.y[point]).sum(axis=0) / HIDDEN)
    height, on_plates = crust.at(places.x[point], places.y[point], finest)
    change = _whole(np.stack([height * bare, np.zeros(len(point))], axis=-1))
    standing[point] += change
    whole[point[on_plates]] = 0.0
    moved = change.any(axis=1)
    return replace(step, plates=(BrokenPlates(point[moved], change[moved], crust.frames),))


def _carve(
    carve: Footprint, loose: HeightField, places: Places, lumped: Array, water: Array, wanted: ReliefSettings
) -> StepRelief:
    """Lumps of full strength in what a body carved; updates those (K,) at all places."""
    point = places.within(carve.window, carve.cell_size)
    if not len(point):
        return NOTHING
    amounts = wanted.amounts_of(carve)
    smallest = FINEST_CRUMB * _finest(places, point, carve.cell_size)
    height = lumps(carve, loose, places.x[point], places.y[point], amounts, smallest)
    height = _whole(height)
    change = np.where(height, height - lumped[point], 0.0)
    lumped[point] += change
    point, change = point[change != 0], change[change != 0]
    return StepRelief(point, np.stack([change, np.zeros(len(point))], axis=-1), water[point])


def _finest(places: Places, point: Indices, cell_size: float) -> float:
    """Distance between places around a print [m], as a whole part of a cell: finer detail cannot be shown there."""
    cells = len(cells_at(np.stack([places.x[point], places.y[point]], axis=-1), cell_size))
    return float(cell_size / max(1.0, np.round(np.sqrt(len(point) / cells))))


def _in_raster(places: Places, point: Indices, spacing: float) -> bool:
    """True if most places around a print are centres of the squares of a spacing [m], as on a ground that is made."""
    x, y = (axis[point] / spacing % 1.0 - 0.5 for axis in (places.x, places.y))
    return bool(np.median(np.maximum(np.abs(x), np.abs(y))) < SAME)


def all_together(steps: Sequence[StepRelief], places: int) -> Array:
    """The sum of all steps at each of the places, (places, 2)."""
    total = np.zeros((places, 2))
    for step in steps:
        total[step.point] += step.change
        for plates in step.plates:
            total[plates.point] += plates.change
    return total


def water_at(steps: Sequence[StepRelief], places: int) -> Array | None:
    """Depth of the water at each of the places after all steps, (places,) [m]; None where there is none."""
    depth = np.zeros(places)
    for step in steps:
        depth[step.point] = step.water
    return depth if depth.any() else None
