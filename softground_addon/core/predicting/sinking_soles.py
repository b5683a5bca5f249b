"""All contacts of feet, followed at once into a ground: by how far it gives way under each, and what each adds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ground.material import GroundMaterial, Pressure
from ..ground.variation import Factors, layer_factors
from ..numerics.slices import Slices
from ..pressing.deformation import compress, compression_rate, target_compression, touching_fraction
from ..pressing.pressure import pressure_field
from .sole_contacts import KNOTS, KNOTS_PER_TOLERANCE, SoleContact

Array = NDArray[np.float64]

SQUARES_AT_ONCE = 200_000
"""Squares under contacts that are followed together, summed over their steps: 5 ms."""
STEPS_PER_FIT = 3
"""The pressure is fitted once in so many steps: 40 times a second."""


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
class SinkingSoles:
    """How contacts sink in: what `deformation.Sinking` says of one, row by row; and how far each has sunk at last."""

    area: Array
    target: Array
    sinkage: Array
    reached: Array


class ContactTable:
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

    def sink(self, material: GroundMaterial) -> SinkingSoles:
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
        return SinkingSoles(area, target, sinkage, reached)

    def pressing(
        self, chosen: NDArray[np.intp], sinking: SinkingSoles, material: GroundMaterial, pressure: Pressure
    ) -> Slices[Array]:
        """Depth of each contact [m], 0 of those that are not chosen: what it adds to those that it lies on."""
        compression, depths = np.zeros(self._square_count), np.zeros(len(self._rows.contacts))
        for together in self._in_turn(chosen):
            for contacts in self._stretches(together):
                squares = np.concatenate([self._squares[number] for number in contacts])
                before = compression[squares]
                compression[squares] = self._pressed(before, contacts, sinking, material, pressure)
                added = np.append(compression[squares] - before, 0.0)
                counts = [len(self._squares[number]) for number in contacts]
                deepest = np.maximum.reduceat(added, np.cumsum(counts) - counts)
                depths[contacts] = np.where(np.array(counts) > 0, deepest, 0.0)
                yield
        return depths

    def _stretches(self, contacts: NDArray[np.intp]) -> Iterator[NDArray[np.intp]]:
        """Contacts that together are no more than is followed at once, or one."""
        squares = np.cumsum([self._rows.contacts[number].covered.size for number in contacts])
        stretch = squares // SQUARES_AT_ONCE
        yield from np.split(contacts, np.flatnonzero(np.diff(stretch)) + 1)

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
        sinking: SinkingSoles,
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
        counts = np.array([len(contact.centres) for contact in rows.contacts])
        owner, ends = np.repeat(np.arange(len(counts)), counts), np.cumsum(counts)
        x, y = np.concatenate([contact.centres for contact in rows.contacts]).T
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
            covered = np.concatenate([contact.covered[k] for contact in rows.contacts[:count]])
            coverage = covered * touching_fraction(clearance, sunk[row], 1.0)
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
