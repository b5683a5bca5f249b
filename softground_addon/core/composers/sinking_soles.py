"""All contacts of feet, followed at once into a ground: by how far it gives way under each, and what each adds."""

from __future__ import annotations

from collections.abc import Sequence
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
Single = NDArray[np.float32]

SQUARES_AT_ONCE = 100_000
"""Squares under contacts that are followed in a slice, summed over their steps: 4 ms."""
STEPS_AT_ONCE = 200
"""Steps whose pressure is fitted in a slice, or those of one contact: 4 ms."""
CONTACTS_AT_ONCE = 64
"""Contacts that are put into a table in a slice: 4 ms."""


@dataclass(frozen=True)
class SinkingSoles:
    """How contacts sink in: what `deformation.Sinking` says of one, row by row; and how far each has sunk at last."""

    area: Array
    target: Array
    sinkage: Array
    reached: Array


@dataclass(frozen=True)
class ContactTable:
    """Contacts to be followed all at once: a row for each step, those of one contact after those of another.

    Attributes
    ----------
    contacts : sequence of SoleContact
        Those of the most steps first.
    first, steps : (C,) int array
        First row of each, and the number of its rows.
    force, duration : (R,) float array
    area, soft_area : (R, KNOTS) float array
        See `SoleContact`; there is no `soft_area` where the ground is the same everywhere.
    tolerance, landing_speed : (C,) float array
    squares : sequence of (N,) int array
        Those that each contact comes over, numbered from 0.
    square_count : int
    under : sequence of list of int
        The contacts that each lies on.
    """

    contacts: Sequence[SoleContact]
    first: NDArray[np.intp]
    steps: NDArray[np.intp]
    force: Array
    duration: Array
    area: Single
    soft_area: Single | None
    tolerance: Array
    landing_speed: Array
    squares: Sequence[NDArray[np.intp]]
    square_count: int
    under: Sequence[list[int]]

    @classmethod
    def of(cls, contacts: Sequence[SoleContact]) -> Slices[ContactTable]:
        """The table of contacts, at least one; those of the most steps first."""
        steps = np.array([len(contact.force) for contact in contacts])
        first = np.cumsum(steps) - steps
        numbers, number = np.unique(np.concatenate([contact.squares for contact in contacts]), return_inverse=True)
        squares = np.split(number.ravel(), np.cumsum([len(contact.squares) for contact in contacts])[:-1])
        yield
        area = np.empty((steps.sum(), KNOTS), np.float32)
        soft_area = np.empty_like(area) if contacts[0].soft_area is not None else None
        latest = np.full(len(numbers), -1)
        under: list[list[int]] = [[] for _ in contacts]
        for count, k in enumerate(np.argsort([contact.start for contact in contacts], kind="stable").tolist(), 1):
            under[k] = [earlier for earlier in np.unique(latest[squares[k]]).tolist() if earlier >= 0]
            latest[squares[k]] = k
            area[first[k] : first[k] + steps[k]] = contacts[k].area
            if soft_area is not None:
                soft_area[first[k] : first[k] + steps[k]] = contacts[k].soft_area
            if count % CONTACTS_AT_ONCE == 0:
                yield
        return cls(
            contacts=contacts,
            first=first,
            steps=steps,
            force=np.concatenate([contact.force for contact in contacts]),
            duration=np.concatenate([contact.duration for contact in contacts]),
            area=area,
            soft_area=soft_area,
            tolerance=np.array([contact.tolerance for contact in contacts]),
            landing_speed=np.array([contact.landing_speed for contact in contacts]),
            squares=squares,
            square_count=len(numbers),
            under=under,
        )

    def impulse(self) -> Array:
        """Of each contact (C,) [N s]."""
        impulse: Array = np.add.reduceat(self.force * self.duration, self.first)
        return impulse

    def with_those_under(self, chosen: NDArray[np.intp], most: int) -> NDArray[np.intp]:
        """Contacts and those that they lie on, the latest first; so many at most."""
        together = dict.fromkeys(chosen.tolist())
        waiting = list(together)
        while waiting and len(together) < most:
            under = [number for number in self.under[waiting.pop(0)] if number not in together]
            together |= dict.fromkeys(under)
            waiting += under
        return np.array(list(together)[: max(most, len(chosen))], int)

    def sink(self, material: GroundMaterial) -> SinkingSoles:
        """Follow all contacts into the ground; see `deformation.sink`."""
        area, target, sinkage = np.zeros((3, len(self.force)))
        reached = np.zeros(len(self.contacts))
        spacing = self.tolerance / KNOTS_PER_TOLERANCE
        for step, count in enumerate(_active(self.steps)):
            now, depth = self.first[:count] + step, reached[:count]
            sinkage[now] = depth
            at = np.minimum(depth / spacing[:count], KNOTS - 1.001)
            touching = _at_knot(self.area, now, at)
            normal_stress = np.divide(self.force[now], touching, out=np.zeros(count), where=touching > 0)
            softness: Array | float = 1.0
            if self.soft_area is not None:
                soft = _at_knot(self.soft_area, now, at)
                softness = np.divide(soft, touching, out=np.zeros(count), where=touching > 0)
            fresh = np.minimum(target_compression(normal_stress, material) * softness, material.layer_depth)
            further = compression_rate(self.duration[now], material, fresh, self.landing_speed[:count]) * fresh
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
        compression, depths = np.zeros(self.square_count), np.zeros(len(self.contacts))
        for contacts in self._in_turn(chosen):
            squares = np.concatenate([self.squares[number] for number in contacts])
            before = compression[squares]
            compression[squares] = yield from self._pressed(before, contacts, sinking, material, pressure)
            added = np.append(compression[squares] - before, 0.0)
            counts = [len(self.squares[number]) for number in contacts]
            deepest = np.maximum.reduceat(added, np.cumsum(counts) - counts)
            depths[contacts] = np.where(np.array(counts) > 0, deepest, 0.0)
        return depths

    def _in_turn(self, chosen: NDArray[np.intp]) -> list[NDArray[np.intp]]:
        """Contacts that share no ground, those before that others lie on."""
        turn_of_square = np.zeros(self.square_count, int)
        turns: list[list[int]] = []
        for number in sorted(chosen.tolist(), key=lambda number: self.contacts[number].start):
            squares = self.squares[number]
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
    ) -> Slices[Array]:
        """Compression of the squares under some contacts, from that before them [m]."""
        contacts, steps = [self.contacts[number] for number in chosen], self.steps[chosen]
        own_first, owner = np.cumsum(steps) - steps, np.repeat(chosen, steps)
        of_all = np.arange(len(owner)) + np.repeat(self.first[chosen] - own_first, steps)
        force, area, target = self.force[of_all], sinking.area[of_all], sinking.target[of_all]
        normal_stress = np.divide(force, area, out=np.zeros(len(force)), where=area > 0)
        rate = compression_rate(self.duration[of_all], material, target, self.landing_speed[owner])
        sunk = sinking.sinkage[of_all] / self.tolerance[owner]
        field = None
        if pressure == "CENTRE_OF_PRESSURE":
            field = yield from _pressure(contacts, sunk, float(self.tolerance[chosen].min()))
        counts = np.array([len(contact.centres) for contact in contacts])
        first, ends = np.repeat(own_first, counts), np.cumsum(counts)
        x, y = np.concatenate([contact.centres for contact in contacts]).T
        factors = None
        if contacts[0].factors:
            factors = Factors(*(np.concatenate(parts) for parts in zip(*(c.factors for c in contacts), strict=True)))
        compression, followed = before.copy(), 0
        for step, active in enumerate(_active(steps)):
            cells = slice(ends[active - 1])
            row = first[cells] + step
            clearance = np.concatenate([contact.clearance[step] for contact in contacts[:active]])
            covered = np.concatenate([contact.covered[step] for contact in contacts[:active]])
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
            followed += len(row)
            if followed > SQUARES_AT_ONCE:
                followed = 0
                yield
        return compression


def _active(steps: NDArray[np.intp]) -> list[int]:
    """How many contacts, those of the most steps first, have a step of each number."""
    active: list[int] = np.searchsorted(-steps, -np.arange(steps.max()), side="left").tolist()
    return active


def _at_knot(by_sinkage: Single, rows: NDArray[np.intp], at: Array) -> Array:
    """Area [m²] at some rows of a table, between its knots."""
    knot = at.astype(np.intp)
    low, high = by_sinkage[rows, knot], by_sinkage[rows, knot + 1]
    between: Array = low + (at - knot) * (high - low)
    return between


def _pressure(contacts: Sequence[SoleContact], sunk: Array, tolerance: float) -> Slices[Array]:
    """Pressure over its mean as level + slope·(x, y), and the highest, row by row: (4, R)."""
    fields = []
    ends = np.cumsum([len(contact.force) for contact in contacts])
    stretch = np.flatnonzero(np.diff(ends // STEPS_AT_ONCE)) + 1
    for some in np.split(np.arange(len(contacts)), stretch):
        together = [contacts[number] for number in some]
        fields.append(_fitted(together, sunk[ends[some[0]] - len(together[0].force) : ends[some[-1]]], tolerance))
        yield
    return np.concatenate(fields, axis=1)


def _fitted(contacts: Sequence[SoleContact], sunk: Array, tolerance: float) -> Array:
    """See `_pressure`."""
    most = max(contact.parts.shape[2] for contact in contacts)
    parts = [np.pad(contact.parts, ((0, 0), (0, 0), (0, most - contact.parts.shape[2]))) for contact in contacts]
    x, y, clearance, area = np.concatenate(parts, axis=1)
    touching = area * touching_fraction(clearance, sunk[:, None], 1.0)
    field = pressure_field(x, y, touching, np.concatenate([contact.centre for contact in contacts]), tolerance)
    level = field.level - (field.slope * field.middle).sum(axis=1)
    return np.stack([level, *field.slope.T, field.highest])
