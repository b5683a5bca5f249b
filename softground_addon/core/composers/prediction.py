"""Depth of the prints before a bake: its solver presses every contact of the shot, on cells as coarse as soles allow.

Contacts that turn out about as deep as the typical one are then pressed into whatever material is asked about.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import ceil

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..ground.ground_law import SOFTEST, next_modulus
from ..ground.hard_ground import SeveralGrounds, soft_ground
from ..ground.heightfield import HeightField
from ..ground.material import GroundMaterial, Pressure
from ..ground.soft_ground import SoftGround
from ..loads.estimate import CharacterLoads
from ..loads.shared_ground import grounds_under, loads_on
from ..numerics.arrays import Array
from ..numerics.slices import Slices, sliced
from ..pressing.contact_layout import STEPS_AT_ONCE as STEPS_AHEAD
from ..pressing.contact_layout import ContactLayout
from ..pressing.ground_cells import Timing, UndisturbedCells
from ..pressing.open_contact import OpenContact
from ..pressing.solver import GroundSolver
from ..record.footprints import Footprint
from ..record.typical_depth import main_contacts, median_depth, typical_contacts
from .simulation import ShotContact, contacts_of, time_grid

CELLS_ALONG_SOLE = 60
"""Finer cells show the same depths, to a hundredth."""
MOST_STEPS = 320
"""Steps that a longer contact is pressed in: 2.7 s, at the usual 120 a second."""
SAMPLE, FEW = 11, 5
"""Contacts around the median that are pressed into another material, fewer where they are alike, ..."""
BENEATH = 11
"""... and earlier ones, on which they tread."""
STEPS_AT_ONCE, BODY_STEPS_AT_ONCE = 48, 1
"""Steps of a foot and of a body that are pressed in a slice."""
MATCH_TOLERANCE, CLOSE_ENOUGH, CERTAIN = 1e-2, 5e-3, 4e-2
"""Relative error of a matched depth of the middle contacts, and of all; and of all where one more guess suffices."""
ALIKE = 0.03
"""Relative difference of depths by which contacts are alike."""
MOST_TRIALS = 40
"""Moduli that are tried in all."""


@dataclass(frozen=True)
class _Contact:
    """A contact of a shot, as it is laid out on coarse cells and steps, so many of them at once."""

    source: ShotContact
    layout: ContactLayout
    timing: Timing
    at_once: int
    cells: UndisturbedCells

    @property
    def impulse(self) -> float:
        """Force times time [N s]."""
        return float(self.layout.force.sum()) * self.timing.step


@dataclass(frozen=True, eq=False)
class ShotContacts:
    """Every contact of a shot, pressed once and to be pressed into other materials.

    Attributes
    ----------
    ground : SoftGround
        Into which they were pressed.
    contacts : tuple
        Those of one character after those of another, as they come.
    depths : (C,) float array
        Depth of each print [m].
    typical : float
        Of the typical one [m]; see `record.typical_depth`.
    sample, beneath : list of int
        Contacts about as deep, and those on which they tread.
    """

    ground: SoftGround
    contacts: tuple[_Contact, ...]
    depths: Array
    typical: float
    sample: list[int]
    beneath: list[int]

    def is_in(self, material: GroundMaterial, pressure: Pressure) -> bool:
        """True if they were pressed into this material by this pressure."""
        return (self.ground.material, self.ground.pressure) == (material, pressure)


@sliced
def pressed_contacts(loads: Sequence[CharacterLoads], ground: SoftGround, cell_size: float) -> Slices[ShotContacts]:
    """Every contact of the characters, pressed as if the ground had no regions; each character treads on its own prints
    only, and no weather on them. Of several grounds, those on the first; all of them where none is.

    Parameters
    ----------
    cell_size : float
        Side of a cell of the bake [m].
    """
    contacts: list[_Contact] = []
    ground = replace(ground, regions=None)
    if isinstance(several := soft_ground(ground.terrain), SeveralGrounds):
        of_first = [loads_on(character, grounds_under(character, several), 0) for character in loads]
        loads = of_first if any(character.contacts.touching.any() for character in of_first) else loads
    for number, character in enumerate(loads):
        cells = UndisturbedCells(ground, max(cell_size, _coarsest(character)))
        contacts += sorted(_laid_out(character, number, cells), key=lambda contact: contact.source.first)
        yield
    return (yield from _sampled(contacts, replace(ground, weathering=None)))


@sliced
def pressed_again(contacts: ShotContacts, material: GroundMaterial, pressure: Pressure) -> Slices[ShotContacts]:
    """The same contacts, all of them pressed into another material."""
    ground = replace(contacts.ground, material=material, pressure=pressure)
    return (yield from _sampled(contacts.contacts, ground))


@sliced
def typical_depth(contacts: ShotContacts, material: GroundMaterial, pressure: Pressure) -> Slices[float]:
    """Depth of the typical print in a material [m], from the contacts that were about as deep in that of `contacts`."""
    ground = replace(contacts.ground, material=material, pressure=pressure)
    prints = yield from _press(contacts.contacts, sorted(contacts.sample + contacts.beneath), ground)
    return median_depth(_depths(prints, len(contacts.contacts))[contacts.sample])


def _coarsest(character: CharacterLoads) -> float:
    """Side of the coarsest cells that show the feet of a character, or its bodies where it has none [m]."""
    soles = [sole.sole for sole in character.motion.soles]
    feet = [sole for sole in soles if sole.prop is None] or soles
    return min(float(np.ptp(sole.outline, axis=0).max()) for sole in feet) / CELLS_ALONG_SOLE


def _laid_out(character: CharacterLoads, number: int, cells: UndisturbedCells) -> Iterator[_Contact]:
    """The contacts of a character of a number."""
    grid, motion = time_grid([character]), character.motion
    for index, sole in enumerate(motion.soles):
        at_once = BODY_STEPS_AT_ONCE if sole.sole.prop else STEPS_AT_ONCE
        for contact in contacts_of(character, number, index, 0):
            stride = ceil((contact.during.stop - contact.during.start) / MOST_STEPS)
            step = stride * motion.time_step
            timing = Timing(step, STEPS_AHEAD, STEPS_AHEAD * step * motion.frame_rate)  # so none are laid out ahead
            yield _Contact(contact, contact.layout(grid.frames, stride), timing, at_once, cells)


def _sampled(contacts: Sequence[_Contact], ground: SoftGround) -> Slices[ShotContacts]:
    """Press all contacts, and choose those that tell the typical depth in other materials."""
    for contact in contacts:
        contact.layout.remembers |= len(contacts) <= SAMPLE + BENEATH  # of more, those that are asked about below
    prints = yield from _press(contacts, range(len(contacts)), ground)
    depths = _depths(prints, len(contacts))
    feet = np.array([contact.layout.sole.prop is None for contact in contacts], bool)
    asked = np.flatnonzero(feet if feet.any() else ~feet)
    impulse = np.array([contact.impulse for contact in contacts])[asked]
    typical = asked[typical_contacts(depths[asked], impulse)]
    among = typical if len(typical) else asked[main_contacts(impulse)]
    sample = _middle(among[np.argsort(depths[among], kind="stable")], SAMPLE)
    if len(sample) > FEW and np.ptp(depths[sample]) <= ALIKE * depths[sample].mean():
        sample = _middle(sample, FEW)
    beneath = _beneath(contacts, sample.tolist(), prints)
    for number in [*sample, *beneath]:
        contacts[number].layout.remembers = True
    return ShotContacts(ground, tuple(contacts), depths, median_depth(depths[typical]), sample.tolist(), beneath)


def _middle(ordered: NDArray[np.intp], count: int) -> NDArray[np.intp]:
    """The middle `count` of the ordered numbers, or one more."""
    beside = max(0, (len(ordered) - count) // 2)
    return ordered[beside : len(ordered) - beside]


def _press(contacts: Sequence[_Contact], chosen: Iterable[int], ground: SoftGround) -> Slices[dict[int, Footprint]]:
    """Press contacts of these numbers into the ground, one after the other; the prints of those that leave one."""
    # What rises beside a print does not deepen it.
    flat = replace(ground.material, poisson_ratio=0.0, rim_reach=0.0, repose_angle=0.0)
    solvers: dict[int, GroundSolver] = {}
    latest: dict[tuple[int, int], tuple[int, OpenContact]] = {}
    prints = {}
    for number in chosen:
        contact = contacts[number]
        layout, cells, timing, during = contact.layout, contact.cells, contact.timing, contact.source.during
        if id(cells) not in solvers:
            state = HeightField(cells.cell_size)
            solvers[id(cells)] = GroundSolver(replace(ground, material=flat), state, cells)
        until, earlier = latest.get(contact.source.of, (None, None))
        opened = OpenContact(layout, earlier if until == during.start else None)
        latest[contact.source.of] = during.stop, opened
        for start in range(layout.first, layout.end, contact.at_once):
            end = min(start + contact.at_once, layout.end)
            solvers[id(cells)].step([opened], start, end, float(layout.steps.frames[end - layout.first - 1]), timing)
            yield
        if opened.recorder:
            prints[number] = opened.footprint()
    return prints


def _depths(prints: dict[int, Footprint], count: int) -> Array:
    """Depth of so many contacts [m], 0 of those that leave no print."""
    return np.array([prints[number].max_depth_m if number in prints else 0.0 for number in range(count)])


def _beneath(contacts: Sequence[_Contact], sample: Sequence[int], prints: dict[int, Footprint]) -> list[int]:
    """Contacts on which those of a sample tread, first those that came shortly before."""
    shared = [
        (number - earlier, earlier)
        for number in sample
        for earlier in range(number)
        if earlier not in sample
        and {number, earlier} <= prints.keys()
        and contacts[earlier].cells is contacts[number].cells
        and prints[earlier].window.intersects(prints[number].window)
    ]
    return list(dict.fromkeys(earlier for _, earlier in sorted(shared)))[:BENEATH]


@sliced
def matching_modulus(
    contacts: ShotContacts, material: GroundMaterial, depth: float, pressure: Pressure
) -> Slices[float]:
    """The modulus [Pa] at which the typical print gets a depth, everything else being equal.

    Parameters
    ----------
    depth : float
        Wanted depth of the typical print [m].
    pressure : 'UNIFORM' or 'CENTRE_OF_PRESSURE'

    Raises
    ------
    InputError
        If no modulus gives that depth.
    """
    if not 0 < depth <= material.deepest:
        raise InputError(
            f"No stiffness gives prints of {depth * 100:.3g} cm: choose a depth between 0 and that of the layer when "
            f"packed, {material.deepest * 100:.3g} cm.",
            "depth_of_print",
            depth=depth,
            deepest=material.deepest,
        )
    middle = _middle(np.array(contacts.sample, int), 1).tolist()
    few, pressed = replace(contacts, sample=middle, beneath=[]), contacts.ground.material
    tried = []
    if contacts.ground.pressure == pressure and pressed == replace(material, youngs_modulus=pressed.youngs_modulus):
        tried = [(pressed.youngs_modulus, median_depth(contacts.depths[middle]))]
    yield from _try(few, material, depth, pressure, MATCH_TOLERANCE, tried)
    modulus, near = tried[-1]
    reached = yield from typical_depth.slices(contacts, replace(material, youngs_modulus=modulus), pressure)
    if near and abs(reached - depth) <= CERTAIN * depth:
        return next_modulus([(before, deep * reached / near) for before, deep in tried], depth, material)
    tried = [(modulus, reached)]
    yield from _try(contacts, material, depth, pressure, CLOSE_ENOUGH, tried)
    modulus, reached = tried[-1]
    if abs(reached - depth) <= CLOSE_ENOUGH * depth:
        return modulus
    if not any(reached for _, reached in tried):
        message = "No stiffness gives a print: the ground takes none under the feet."
        raise InputError(message, "no_print_at_all", remedy="Check its masks and its crust.")
    message = f"The feet touch the ground too briefly for prints of {depth * 100:.3g} cm"
    remedy = "choose a smaller depth, or ground that settles faster."
    raise InputError(message, "settles_too_slowly", remedy=remedy, depth=depth)


def _try(
    contacts: ShotContacts,
    material: GroundMaterial,
    depth: float,
    pressure: Pressure,
    tolerance: float,
    tried: list[tuple[float, float]],
) -> Slices[None]:
    """Add the moduli [Pa] on the way to a depth [m], with their depths; the first is that of the material."""
    while len(tried) < MOST_TRIALS:
        modulus = next_modulus(tried, depth, material) if tried else material.youngs_modulus
        reached = yield from typical_depth.slices(contacts, replace(material, youngs_modulus=modulus), pressure)
        tried.append((modulus, reached))
        if abs(reached - depth) <= tolerance * depth or (modulus == SOFTEST and reached < depth):
            break
