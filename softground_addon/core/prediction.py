"""How deep a shot's prints will be, without pressing any cell: the typical one, and the deepest.

What the material does not change is gathered once for each contact: how large it is at any sinkage, how high its
underside is over the ground. Another material then follows all contacts at once, step by step, into the ground under
their lowest points; those into which it gives way the furthest are followed under all of their soles.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .errors import InputError
from .ground.heightfield import Surface, Terrain, Window
from .ground.material import GroundMaterial, Pressure
from .ground.variation import Factors, Variation, layer_factors
from .loads.estimate import CharacterLoads
from .motion.props import posed
from .numerics.intervals import runs
from .numerics.slices import Slices, sliced
from .pressing.contact_layout import landing_drop
from .pressing.deformation import compress, compression_rate, target_compression, touching_fraction
from .pressing.ground_cells import UndisturbedCells
from .pressing.indentation import stress
from .pressing.pressure import pressure_field
from .pressing.prop_imprint import GroundUnder, ground_under
from .pressing.sole_points import (
    FINEST_DETAIL,
    PatchPoints,
    SolePoints,
    contact_window,
    places,
    point_contact,
    sole_points,
)
from .record.typical_depth import main_contacts, median_depth

Array = NDArray[np.float64]
Single = NDArray[np.float32]

FEW = 6
"""Contacts that are followed under all of their soles where an estimate will do, and poses of bodies."""
TYPICAL = 24
"""Contacts that tell the depth of the typical one."""
AT_ONCE = 64
"""Contacts that are followed together: 100 MB at most."""
KNOTS_PER_TOLERANCE = 4
"""Sinkages at which the area of a contact is known, per height that counts as touching."""
KNOTS = 128
"""Number of those sinkages: up to more than the length of the sole."""
MOST_STEPS = 320
"""Steps that a longer contact is followed in: 2.7 s, at the usual 120 a second."""
STEPS_PER_FIT = 6
"""The pressure is fitted once in so many steps: 20 times a second."""
COARSE = 1 / 20
"""Side of the parts of a sole that the pressure is fitted to, in sole lengths."""
MATCH_TOLERANCE = 2e-3
"""Relative error of a matched depth."""
FREE_TRIALS = 6
"""Guesses of the modulus before it is searched by halving."""
MOST_TRIALS = 60
"""Halvings of the interval in which the modulus is searched: its logarithm is then known to rounding."""
POSES = 12
"""Steps of a body's contact that are looked at, and the one that presses hardest."""
SOFTEST, STIFFEST = 1e3, 1e10
"""Range in which a modulus is searched [Pa]."""
ACROSS = 1 << 21
"""Squares across the ground that are told apart: 20 km."""
MOST_SQUARES = ACROSS**2
NEVER_LANDS = 1e-9
"""Landing speed of what does not come down [m/s]: the ground then takes all of its time."""
TAKES_NO_PRINT = (
    "No stiffness gives a print: the ground takes none under the feet. Look at what is painted on it, and at the crust "
    "of its material."
)


@dataclass(frozen=True)
class SoleContact:
    """One foot from touching down to leaving, as the ground feels it at N steps.

    Attributes
    ----------
    start : float
        Scene frame of the first step.
    duration : (N,) float array
        Of each step [s].
    force : (N,) float array
        Normal force [N].
    area : (N, KNOTS) float array
        Area in contact [m²] where the ground has given way by 0, 1, 2, ... parts of the tolerance.
    soft_area : (N, KNOTS) float array or None
        The same with the softness under each point, where the ground varies.
    squares : (C,) int array
        Squares of the ground that it comes over: equal for the contacts of one character that share one.
    cells : (C, 2) float array
        Their centres [m].
    clearance : (N, C) float array
        Height of the underside over each, less that of its lowest point, in tolerances.
    factors : Factors or None
        How the ground varies, (C,) float arrays.
    parts : (4, N, P) float array
        Parts of the underside: their x, y [m], clearance [tolerances] and area [m²].
    centre : (N, 2) float array
        Centre of pressure [m].
    tolerance : float
        See `deformation.touching_fraction` [m].
    landing_speed : float
        See `deformation.compression_rate` [m/s].
    """

    start: float
    duration: Array
    force: Array
    area: Single
    soft_area: Single | None
    squares: NDArray[np.int64]
    cells: Array
    clearance: Single
    factors: Factors | None
    parts: Array
    centre: Array
    tolerance: float
    landing_speed: float


@dataclass(frozen=True)
class _Rows:
    """The steps of some contacts, all first steps first: what goes on at a step is a stretch of them.

    Attributes
    ----------
    contacts : sequence of SoleContact
        Those of the most steps first.
    active : (S,) int array
        Number of contacts that have a step of each number.
    first : (S,) int array
        First row of each step.
    """

    contacts: Sequence[SoleContact]
    active: NDArray[np.intp]
    first: NDArray[np.intp]

    @classmethod
    def of(cls, contacts: Sequence[SoleContact]) -> _Rows:
        counts = np.array([len(contact.force) for contact in contacts])
        active = np.searchsorted(-counts, -np.arange(counts.max()), side="left")
        return cls(contacts, active, np.cumsum(active) - active)

    def gather(self, name: str) -> Array:
        """An attribute (N, ...) of the contacts, row by row."""
        steps = [getattr(contact, name) for contact in self.contacts]
        step = np.concatenate([np.arange(len(values)) for values in steps])
        number = np.repeat(np.arange(len(steps)), [len(values) for values in steps])
        gathered: Array = np.concatenate(steps)[np.lexsort((number, step))]
        return gathered

    def each(self, name: str) -> Array:
        """A number of each contact."""
        return np.array([getattr(contact, name) for contact in self.contacts])

    def rows_of(self, number: int) -> NDArray[np.intp]:
        """The rows of a contact."""
        return self.first[: len(self.contacts[number].force)] + number


@dataclass(frozen=True)
class _Sinking:
    """How contacts sink in: what `deformation.Sinking` says of one, row by row; and how far each has sunk at last."""

    area: Array
    target: Array
    sinkage: Array
    reached: Array


class _Table:
    """Contacts row by row, to be followed all at once.

    Parameters
    ----------
    contacts : sequence of SoleContact
        At least one; those of the most steps first.
    """

    def __init__(self, contacts: Sequence[SoleContact]) -> None:
        rows = self._rows = _Rows.of(contacts)
        self._force, self._area = rows.gather("force"), rows.gather("area")
        self._soft_area = rows.gather("soft_area") if contacts[0].soft_area is not None else None
        self._duration, self._speed = rows.gather("duration"), rows.each("landing_speed")
        self._knot = rows.each("tolerance") / KNOTS_PER_TOLERANCE
        squares, square = np.unique(np.concatenate([contact.squares for contact in contacts]), return_inverse=True)
        self._squares = np.split(square.ravel(), np.cumsum([len(contact.squares) for contact in contacts])[:-1])
        self._square_count = len(squares)
        latest = np.full(len(squares), -1)
        self._under: list[list[int]] = [[] for _ in contacts]
        for number in np.argsort(rows.each("start"), kind="stable").tolist():
            self._under[number] = [k for k in np.unique(latest[self._squares[number]]).tolist() if k >= 0]
            latest[self._squares[number]] = number

    def with_those_under(self, chosen: NDArray[np.intp], most: int) -> NDArray[np.intp]:
        """Contacts and those that they lie on, the latest first; so many at most."""
        together = dict.fromkeys(chosen.tolist())
        waiting = list(together)
        while waiting and len(together) < most:
            under = [number for number in self._under[waiting.pop(0)] if number not in together]
            together |= dict.fromkeys(under)
            waiting += under
        return np.array(list(together)[: max(most, len(chosen))], int)

    def sink(self, material: GroundMaterial) -> _Sinking:
        """Follow all contacts into the ground; see `deformation.sink`."""
        rows = self._rows
        area, target, sinkage = np.zeros((3, len(self._force)))
        reached = np.zeros(len(rows.contacts))
        numbers = np.arange(len(reached))
        for first, count in zip(rows.first.tolist(), rows.active.tolist(), strict=True):
            now = slice(first, first + count)
            depth = reached[:count]
            sinkage[now] = depth
            at = np.minimum(depth / self._knot[:count], KNOTS - 1.001)
            knot = at.astype(np.intp)
            between = at - knot
            pair = self._area[first + numbers[:count], knot], self._area[first + numbers[:count], knot + 1]
            touching = pair[0] + between * (pair[1] - pair[0])
            normal_stress = np.divide(self._force[now], touching, out=np.zeros(count), where=touching > 0)
            softness: Array | float = 1.0
            if self._soft_area is not None:
                pair = (
                    self._soft_area[first + numbers[:count], knot],
                    self._soft_area[first + numbers[:count], knot + 1],
                )
                soft = pair[0] + between * (pair[1] - pair[0])
                softness = np.divide(soft, touching, out=np.zeros(count), where=touching > 0)
            fresh = np.minimum(target_compression(normal_stress, material) * softness, material.layer_depth)
            further = compression_rate(self._duration[now], material, fresh, self._speed[:count]) * fresh
            further = np.maximum(np.minimum(further, fresh - depth), 0.0)
            if material.crust_stress:
                further[(depth == 0) & (normal_stress < material.crust_stress)] = 0.0
            area[now], target[now] = touching, fresh
            reached[:count] += further
        return _Sinking(area, target, sinkage, reached)

    def pressing(
        self, chosen: NDArray[np.intp], sinking: _Sinking, material: GroundMaterial, pressure: Pressure
    ) -> Slices[Array]:
        """Depth of each contact [m], 0 of those that are not chosen: what it adds to those that it lies on."""
        compression, depths = np.zeros(self._square_count), np.zeros(len(self._rows.contacts))
        for together in self._in_turn(chosen):
            for first in range(0, len(together), AT_ONCE):
                contacts = together[first : first + AT_ONCE]
                squares = np.concatenate([self._squares[number] for number in contacts])
                before = compression[squares]
                compression[squares] = self._pressed(before, contacts, sinking, material, pressure)
                added = np.append(compression[squares] - before, 0.0)
                counts = [len(self._squares[number]) for number in contacts]
                deepest = np.maximum.reduceat(added, np.cumsum(counts) - counts)
                depths[contacts] = np.where(np.array(counts) > 0, deepest, 0.0)
                yield
        return depths

    def _in_turn(self, chosen: NDArray[np.intp]) -> list[NDArray[np.intp]]:
        """Contacts that share no ground, those before that others lie on."""
        turn_of_square = np.zeros(self._square_count, int)
        turns: list[list[int]] = []
        for number in sorted(chosen.tolist(), key=lambda number: self._rows.contacts[number].start):
            squares = self._squares[number]
            turn = int(turn_of_square[squares].max(initial=0))
            turn_of_square[squares] = turn + 1
            if turn == len(turns):
                turns.append([])
            turns[turn].append(number)
        return [np.sort(turn) for turn in turns]

    def _pressed(
        self,
        before: Array,
        chosen: NDArray[np.intp],
        sinking: _Sinking,
        material: GroundMaterial,
        pressure: Pressure,
    ) -> Array:
        """Compression of the squares under some contacts, from that before them [m]."""
        rows = _Rows.of([self._rows.contacts[number] for number in chosen])
        of_all = np.concatenate([self._rows.rows_of(number) for number in chosen])
        step = np.concatenate([np.arange(len(contact.force)) for contact in rows.contacts])
        of_all = of_all[np.argsort(step, kind="stable")]
        force, area, target = self._force[of_all], sinking.area[of_all], sinking.target[of_all]
        normal_stress = np.divide(force, area, out=np.zeros(len(force)), where=area > 0)
        number = np.concatenate([chosen[:count] for count in rows.active])
        rate = compression_rate(self._duration[of_all], material, target, self._speed[number])
        tolerance = self._knot[chosen] * KNOTS_PER_TOLERANCE
        sunk = sinking.sinkage[of_all] / (self._knot[number] * KNOTS_PER_TOLERANCE)
        field = self._pressure(rows, sunk, float(tolerance.min())) if pressure == "CENTRE_OF_PRESSURE" else None
        counts = np.array([len(contact.cells) for contact in rows.contacts])
        owner, ends = np.repeat(np.arange(len(counts)), counts), np.cumsum(counts)
        x, y = np.concatenate([contact.cells for contact in rows.contacts]).T
        factors = None
        if rows.contacts[0].factors:
            factors = Factors(
                *(np.concatenate(parts) for parts in zip(*(c.factors for c in rows.contacts), strict=True))
            )
        compression = before.copy()
        for k, (first, count) in enumerate(zip(rows.first.tolist(), rows.active.tolist(), strict=True)):
            cells = slice(ends[count - 1])
            row = first + owner[cells]
            clearance = np.concatenate([contact.clearance[k] for contact in rows.contacts[:count]])
            coverage = touching_fraction(clearance, sunk[row], 1.0)
            loaded, aim = normal_stress[row], target[row]
            if field is not None:
                level, along_x, along_y, highest = field[:, row]
                loaded = loaded * np.clip(level + along_x * x[cells] + along_y * y[cells], 0.0, highest)
            if field is not None or factors:
                varying = layer_factors(Factors(*(factor[cells] for factor in factors)) if factors else None)
                aim = np.where(aim > 0, target_compression(loaded, material, **varying), 0.0)
            compression[cells] = compress(
                compression[cells],
                coverage,
                aim,
                rate[row] if np.ndim(rate) else rate,
                holds=loaded < material.crust_stress if material.crust_stress else False,
                compacted=before[cells],
                hardening=material.hardening,
            )
        return compression

    @staticmethod
    def _pressure(rows: _Rows, sunk: Array, tolerance: float) -> Array:
        """Pressure over its mean as level + slope·(x, y), and the highest, row by row: (4, R)."""
        parts = max(contact.parts.shape[2] for contact in rows.contacts)
        posed, centres, depths, fit_of_row = [], [], [], np.empty(len(sunk), int)
        moved = np.empty((len(sunk), 2))
        count = 0
        for number, contact in enumerate(rows.contacts):
            steps, of_contact = np.arange(len(contact.force)), rows.rows_of(number)
            middle = steps // STEPS_PER_FIT * STEPS_PER_FIT + STEPS_PER_FIT // 2
            fitted, fit = np.unique(np.minimum(middle, steps[-1]), return_inverse=True)
            fit_of_row[of_contact] = count + fit
            place = contact.parts[:2].mean(axis=2).T
            moved[of_contact] = place - place[fitted[fit]]
            count += len(fitted)
            posed.append(np.pad(contact.parts[:, fitted], ((0, 0), (0, 0), (0, parts - contact.parts.shape[2]))))
            centres.append(contact.centre[fitted])
            depths.append(sunk[of_contact[fitted]])
        x, y, clearance, area = np.concatenate(posed, axis=1)
        touching = area * touching_fraction(clearance, np.concatenate(depths)[:, None], 1.0)
        field = pressure_field(x, y, touching, np.concatenate(centres), tolerance)
        slope, middle = field.slope[fit_of_row], field.middle[fit_of_row] + moved
        level = field.level[fit_of_row] - (slope * middle).sum(axis=1)
        return np.stack([level, *slope.T, field.highest[fit_of_row]])


@dataclass(frozen=True)
class ContactLoads:
    """Every contact of a shot, as the ground feels it.

    Attributes
    ----------
    soles : tuple of SoleContact
        Those of the most steps first.
    poses : tuple of (GroundUnder, float)
        The ground under bodies at some steps, and the normal force at those [N]; the hardest first.
    """

    soles: tuple[SoleContact, ...]
    poses: tuple[tuple[GroundUnder, float], ...]

    @cached_property
    def _impulse(self) -> Array:
        return np.array([contact.force @ contact.duration for contact in self.soles])

    @cached_property
    def _table(self) -> _Table:
        return _Table(self.soles)

    def deepest(self, material: GroundMaterial, pressure: Pressure = "UNIFORM", most: int | None = None) -> float:
        """Depth of the deepest print [m], 0 if there is none.

        Parameters
        ----------
        material : GroundMaterial
        pressure : 'UNIFORM' or 'CENTRE_OF_PRESSURE'
            Of soles; that of bodies follows from their shape.
        most : int, optional
            Look at so many contacts only, where the ground gives way the furthest, with as many that they lie on; and
            at so many poses of bodies, which press the hardest.
        """
        depth = max((_depth_under(under, force, material) for under, force in self.poses[:most]), default=0.0)
        if not self.soles:
            return depth
        sinking = self._table.sink(material)
        furthest = np.argsort(-sinking.reached, kind="stable")[:most]
        furthest = furthest[sinking.reached[furthest] > 0]
        if most is not None:
            furthest = self._table.with_those_under(furthest, 2 * most)
        return max(depth, float(_depths(self._table, furthest, sinking, material, pressure).max()))

    def typical(self, material: GroundMaterial, pressure: Pressure = "UNIFORM") -> float:
        """Depth of the typical print [m]; see `typical_depth`."""
        return typical_depth(self, material, pressure)

    def working_out_typical(self, material: GroundMaterial, pressure: Pressure) -> Slices[float]:
        """See `typical_depth`."""
        sinking = self._table.sink(material)
        main = np.flatnonzero(main_contacts(self._impulse))
        main = main[np.argsort(sinking.reached[main], kind="stable")]
        beside = max(0, (len(main) - TYPICAL) // 2)
        chosen = main[beside : len(main) - beside]
        together = self._table.with_those_under(chosen, 2 * TYPICAL)
        yield
        depths = yield from self._table.pressing(together, sinking, material, pressure)
        return median_depth(depths[chosen])

    def modulus_for(self, material: GroundMaterial, share: float) -> float:
        """The modulus [Pa] with which prints are about so many times as deep: by how far the ground gives way under
        the lowest points alone, which is known at once."""
        if not self.soles:
            return material.youngs_modulus / share
        main = main_contacts(self._impulse)

        def reached(modulus: float) -> float:
            return float(np.median(self._table.sink(replace(material, youngs_modulus=modulus)).reached[main]))

        modulus = material.youngs_modulus
        aim = share * reached(modulus)
        for _ in range(FREE_TRIALS):
            modulus = float(np.clip(modulus * reached(modulus) / max(aim, NEVER_LANDS), SOFTEST, STIFFEST))
        return modulus


@sliced
def typical_depth(contacts: ContactLoads, material: GroundMaterial, pressure: Pressure = "UNIFORM") -> Slices[float]:
    """Depth of the typical print [m]; see `record.typical_depth`. Of bodies alone, that of the deepest.

    Of many contacts, those are looked at into which the ground gives way about as far as into the median one.

    Parameters
    ----------
    contacts : ContactLoads
    material : GroundMaterial
    pressure : 'UNIFORM' or 'CENTRE_OF_PRESSURE'
    """
    if not contacts.soles:
        return contacts.deepest(material, pressure, most=FEW)
    return (yield from contacts.working_out_typical(material, pressure))


@sliced
def _depths(
    table: _Table, chosen: NDArray[np.intp], sinking: _Sinking, material: GroundMaterial, pressure: Pressure
) -> Slices[Array]:
    return (yield from table.pressing(chosen, sinking, material, pressure))


def _depth_under(under: GroundUnder, force: float, material: GroundMaterial) -> float:
    """Largest compression under a lasting force, where the crust gives way to it [m]."""
    springs = under.springs
    compression = springs.compression(springs.sinkage(force, material), material) * under.bears
    loaded = stress(compression, material, stiffness=springs.stiffness, depth=springs.depth)
    return float(compression.max(initial=0.0, where=loaded >= material.crust_stress))


@sliced
def contact_loads(
    loads: Sequence[CharacterLoads], terrain: Terrain, cell_size: float, variation: Variation | None = None
) -> Slices[ContactLoads]:
    """Every contact of the characters.

    Parameters
    ----------
    loads : sequence of CharacterLoads
    terrain : Terrain
        The undisturbed ground.
    cell_size : float
        Side of a cell [m]: the ground's height is looked up once per cell.
    variation : Variation, optional
        How the ground varies from place to place.
    """
    cells = UndisturbedCells(terrain, variation, cell_size)
    soles: list[SoleContact] = []
    poses: list[tuple[GroundUnder, float]] = []
    for number, character in enumerate(loads):
        for index, sole in enumerate(character.motion.soles):
            if sole.sole.prop:
                for pose in _prop_poses(character, index, cells):
                    poses.append(pose)
                    yield
            else:
                for contact in _sole_contacts(character, number, index, cells):
                    soles.append(contact)
                    yield
    soles.sort(key=lambda contact: -len(contact.force))
    poses.sort(key=lambda pose: -pose[1])
    return ContactLoads(tuple(soles), tuple(poses))


def _contacts_of(character: CharacterLoads, index: int) -> Iterator[slice]:
    """The steps of each contact of a sole, without the first of all: that is a state, it presses nothing."""
    for first, end in zip(*runs(character.contacts.touching[:, index]), strict=True):
        if end > max(first, 1):
            yield slice(max(int(first), 1), int(end))


def _sole_contacts(
    character: CharacterLoads, number: int, index: int, cells: UndisturbedCells
) -> Iterator[SoleContact]:
    """Every contact of a foot of a character of some number."""
    motion = character.motion
    sole = motion.soles[index]
    points = sole_points(sole.sole, sole.transforms)
    coarse = _coarse(points)
    divisions = points.cell_divisions(cells.cell_size)
    size = FINEST_DETAIL * min(float(np.ptp(other.sole.outline, axis=0).max()) for other in motion.soles)
    for steps in _contacts_of(character, index):
        normals = character.contacts.normal[steps, index]
        force = np.maximum(np.einsum("ni,ni->n", character.forces.forces[steps, index], normals), 0.0)
        first = np.arange(0, len(force), -(-len(force) // MOST_STEPS))
        counts = np.diff(first, append=len(force))
        middle = first + counts // 2
        poses, normals = sole.transforms[steps][middle], normals[middle]
        window = contact_window(points, poses, cells.cell_size)
        ground = cells.surface(window, divisions)
        contact = point_contact(points, poses, ground)
        clearance = contact.clearance / points.tolerance
        printing, area = contact.area / normals[:, 2:], (contact.area + contact.beyond) / normals[:, 2:]
        x, y = places(points, poses)
        factors = cells.factors(window)
        softness = factors.softness[window.cells_under(x, y, cells.cell_size)] if factors else None
        squares, centres, over = _over_squares(x, y, clearance, printing, size)
        under = window.cells_under(centres[:, 0], centres[:, 1], cells.cell_size)
        landing = sole.transforms[max(0, steps.start - 2) : steps.start + 1]
        drop = landing_drop(sole.sole, landing, character.contacts.normal[steps.start, index])
        yield SoleContact(
            start=float(motion.frames[steps.start]),
            duration=counts * motion.time_step,
            force=np.add.reduceat(force, first) / counts,
            area=_area_by_sinkage(clearance, area),
            soft_area=_area_by_sinkage(clearance, area * softness) if softness is not None else None,
            squares=squares + number * MOST_SQUARES,
            cells=centres,
            clearance=over,
            factors=Factors(*(factor[under] for factor in factors)) if factors else None,
            parts=_parts(coarse, poses, ground, contact.lowest, points.tolerance),
            centre=character.forces.centre_of_pressure[steps, index, :2][middle],
            tolerance=points.tolerance,
            landing_speed=max(drop / motion.time_step, NEVER_LANDS),
        )


def _coarse(points: SolePoints) -> SolePoints:
    """Parts of a sole as one point each, in their middles."""
    patches = []
    for patch in points.patches:
        square = np.floor(patch.positions[:, :2] / (COARSE * points.length)).astype(int)
        _, part = np.unique(square, axis=0, return_inverse=True)
        part = part.ravel()
        area = np.bincount(part, patch.area).astype(float)
        positions, normals = (
            np.stack([np.bincount(part, patch.area * along) / area for along in values.T], axis=-1)
            for values in (patch.positions, patch.normals)
        )
        patches.append(PatchPoints(positions.reshape(-1, 3), normals.reshape(-1, 3), area))
    return SolePoints(tuple(patches), points.length)


def _parts(coarse: SolePoints, poses: Array, ground: Surface, lowest: Array, tolerance: float) -> Array:
    """See `SoleContact.parts`."""
    contact = point_contact(coarse, poses, ground)
    clearance = (contact.clearance + (contact.lowest - lowest)[:, None]) / tolerance
    return np.stack([*places(coarse, poses), clearance, contact.area + contact.beyond])


def _area_by_sinkage(clearance: Array, area: Array) -> Single:
    """Area in contact (N, KNOTS), from points (N, Q) with their clearance in tolerances.

    A point touches by clip(sinkage - clearance + 1.5, 0, 1), which is straight from knot to knot: shared between the
    two knots that it lies between, it counts for the same at all of them.
    """
    count, knots = len(clearance), KNOTS + 2 * KNOTS_PER_TOLERANCE
    at = np.minimum(clearance * KNOTS_PER_TOLERANCE, knots - 1.0)
    knot = np.minimum(at.astype(np.intp), knots - 2)
    into = (knot + np.arange(count)[:, None] * knots).ravel()
    upper = (area * (at - knot)).ravel()
    total = np.bincount(into, area.ravel() - upper, count * knots)
    total += np.bincount(into + 1, upper, count * knots)
    whole = np.cumsum(total.reshape(count, knots), axis=1)
    first = KNOTS_PER_TOLERANCE // 2  # it touches wholly so many knots above the sinkage
    steps = [whole[:, first + k : first + k + KNOTS] for k in range(KNOTS_PER_TOLERANCE)]
    return np.asarray(np.mean(steps, axis=0), np.float32)


def _over_squares(
    x: Array, y: Array, clearance: Array, area: Array, size: float
) -> tuple[NDArray[np.int64], Array, Single]:
    """Numbers (C,) and centres (C, 2) of the squares under points (N, Q), and the mean clearance over each, (N, C).

    What is covered by less than half counts as not covered.
    """
    far = 2.0 * KNOTS / KNOTS_PER_TOLERANCE
    near = (area > 0) & (clearance < far)
    if not near.any():
        return np.zeros(0, np.int64), np.zeros((0, 2)), np.zeros((len(x), 0), np.float32)
    low, high = (np.array([pick(x[near]), pick(y[near])]) for pick in (np.min, np.max))
    window = Window.around(low, high, size)
    row, column = window.cells_under(x, y, size)
    cell = row * window.columns + column
    used = np.zeros(window.cells, bool)
    used[cell[near]] = True
    count = int(used.sum())
    number = np.cumsum(used) - 1
    into = (number[cell] + np.arange(len(x))[:, None] * count)[near]
    covered = np.bincount(into, area[near], len(x) * count)
    total = np.bincount(into, (area * clearance)[near], len(x) * count)
    mean = np.divide(total, covered, out=np.full(len(total), far), where=covered > size**2 / 2)
    across = np.meshgrid(*window.centres(size))
    centres = np.stack([along.ravel()[used] for along in across], axis=-1)
    rows, columns = np.divmod(np.flatnonzero(used), window.columns)
    squares = (rows + window.row + ACROSS // 2) * ACROSS + columns + window.column + ACROSS // 2
    return squares, centres, mean.reshape(len(x), count).astype(np.float32)


def _prop_poses(character: CharacterLoads, index: int, cells: UndisturbedCells) -> Iterator[tuple[GroundUnder, float]]:
    """The ground under a body at some steps of each contact, and the force on it.

    Each is taken as if it rested there: too large for one that rolls on before the ground gives way.
    """
    motion = character.motion
    sole, force = motion.soles[index], character.forces.forces[:, index]
    prop = sole.sole.prop
    assert prop is not None, sole.sole.name
    normal_force = np.maximum(np.einsum("ni,ni->n", force, character.contacts.normal[:, index]), 0.0)
    for contact in _contacts_of(character, index):
        steps = np.arange(contact.start, contact.stop)
        chosen = np.unique([*np.linspace(steps[0], steps[-1], POSES).astype(int), steps[normal_force[steps].argmax()]])
        for step in chosen:
            pose = sole.transforms[step, 0]
            across = posed(prop.vertices, pose)[:, :2]
            window = Window.around(across.min(axis=0), across.max(axis=0), cells.cell_size)
            under = ground_under(prop, pose, cells.surface(window), np.inf, cells.factors(window))
            if under is not None:
                yield under, float(normal_force[step])


def matching_modulus(
    contacts: ContactLoads, material: GroundMaterial, depth: float, pressure: Pressure = "UNIFORM"
) -> float:
    """The modulus [Pa] at which the typical print gets a depth, everything else being equal.

    Parameters
    ----------
    contacts : ContactLoads
    material : GroundMaterial
    depth : float
        Wanted depth of the typical print [m].
    pressure : 'UNIFORM' or 'CENTRE_OF_PRESSURE'

    Raises
    ------
    InputError
        If no modulus gives that depth.
    """

    def reached(modulus: float) -> float:
        return contacts.typical(replace(material, youngs_modulus=modulus), pressure)

    modulus = material.youngs_modulus
    for _ in range(FREE_TRIALS):
        found = reached(modulus)
        if abs(found - depth) <= MATCH_TOLERANCE * depth:
            return modulus
        if not found > 0:
            break
        modulus = float(np.clip(modulus * found / depth, SOFTEST, STIFFEST))  # depths are about inverse to it
    low, high = SOFTEST, STIFFEST
    if not reached(high) <= depth <= material.layer_depth:
        raise InputError(
            f"No stiffness gives prints of {depth * 100:.3g} cm: choose a depth between 0 and the layer's, "
            f"{material.layer_depth * 100:.3g} cm."
        )
    if not reached(low) > 0:
        raise InputError(TAKES_NO_PRINT)
    for _ in range(MOST_TRIALS):
        modulus = float(np.sqrt(low * high))
        found = reached(modulus)
        if abs(found - depth) <= MATCH_TOLERANCE * depth:
            return modulus
        low, high = (modulus, high) if found > depth else (low, modulus)
    raise InputError(
        f"Prints of {depth * 100:.3g} cm cannot be reached with feet that rest so briefly on the ground: shorten the "
        "ground's time, or choose a smaller depth."
    )
