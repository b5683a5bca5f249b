"""Marks of a shot: what all soles leave on hard floors of what they took up from the soft ground."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..events.phases import normal_force, slide_speed
from ..ground import surfaces
from ..ground.hard_ground import HardOnSoft
from ..ground.heightfield import Terrain
from ..ground.surfaces import Liquid, SurfaceRecord
from ..ground.terrain import SAME_LAYER
from ..imprints.sole_points import flat_pose
from ..loads.contacts import LEAVE_HEIGHT, REST_SPEED
from ..loads.estimate import CharacterLoads
from ..numerics.intervals import runs
from ..numerics.slices import Slices, sliced
from ..record.record import EditableStep
from .film import ZONES, CarriedMass, Meeting, carry, share_left
from .hard_print import HardPrint, SoleGrid, laid, sole_grid

Array = NDArray[np.float64]

LOOKED_AT = 32
"""Steps of a contact at which it is looked at, about."""


@dataclass(frozen=True)
class Marks:
    """Marks of all soles as one mesh, and what they carry.

    Attributes
    ----------
    position : (V, 3) float array
        World positions [m].
    faces : (F, 4) int array
    birth : (V,) float array
        Scene frame at which each vertex was first pressed.
    mass : (V,) float array
        Left there [kg/m²].
    area : (V,) float array
        That each stands for [m²].
    sole : (V, 3) float array
        As of `SoleGrid` [m].
    tread : (V,) float array
        Depth of the grooves of the sole [m].
    step : (V,) int array
        Number of the contact with a hard floor, in the order of time for each sole.
    carried : CarriedMass
    surface : str
        What they are of.
    """

    position: Array
    faces: NDArray[np.intp]
    birth: Array
    mass: Array
    area: Array
    sole: Array
    tread: Array
    step: NDArray[np.intp]
    carried: CarriedMass = field(default_factory=CarriedMass)
    surface: str = ""


@dataclass(frozen=True)
class _Contact:
    """A contact of a sole with a hard floor: where it lies, its slide in sole lengths, frames, and what wets it."""

    laid: HardPrint
    slid: float
    frames: Array
    wet: str


@sliced
def marks_of(
    loads: Sequence[CharacterLoads],
    steps: Sequence[EditableStep],
    terrain: Terrain,
    *,
    surface: str,
    shed: Mapping[int, float] = MappingProxyType({}),
    treads: Mapping[tuple[str, str], float] = MappingProxyType({}),
    brought: Mapping[str, float] = MappingProxyType({}),
) -> Slices[Marks | None]:
    """What soles leave on the hard floors of a shot; None where there is none, or nothing sticks.

    Of several grounds and liquids that stick, that of which most is left.

    Parameters
    ----------
    loads : sequence of CharacterLoads
    steps : sequence of EditableStep
        On the soft ground, as the artist leaves them: those that are muted are not stepped into.
    terrain : Terrain
    surface : str
        What the ground is made of; a step in another kind of it says so.
    shed : mapping of int to float, optional
        Volume that each step sheds in the air, by its number [m³].
    treads : mapping of (str, str) to float, optional
        Depth of the grooves of soles that have some, by character and sole [m].
    brought : mapping of str to float, optional
        Film of `surface` on the soles of a character as the shot starts, over the thickest, by its name.
    """
    if not isinstance(terrain, HardOnSoft):
        return None
    kinds = dict.fromkeys([surface, *(step.left.surface for step in steps if step.left and step.left.surface)])
    sticking = [surfaces.sticking(kind) for kind in (*kinds, *terrain.wet)]
    sticking = [kind for kind in sticking if kind.carried is not None]
    parts: dict[str, list[Marks]] = {kind.name: [] for kind in sticking}
    booked = dict.fromkeys(parts, CarriedMass())
    for character in loads:
        for index, motion in enumerate(character.motion.soles):
            yield
            soft = {kind: list(_soft_meetings(character, index, steps, kind, surface, shed)) for kind in parts}
            dirty, hard = brought.get(character.motion.name, 0.0), character.contacts.hard
            takes = any(soft.values()) or dirty or terrain.wet
            if not takes or motion.sole.prop is not None or hard is None or not hard[:, index].any():
                continue
            grid = sole_grid(motion.sole, flat_pose(motion.transforms))
            contacts = []
            for during in _pieces(hard[:, index], slid := _slid(character, index)):
                contacts.append(_contact(character, index, grid, during, slid, terrain))
                yield
            tread = treads.get((character.motion.name, motion.sole.name), 0.0)
            for kind in sticking:
                starts = dirty if kind.name == surface else 0.0
                marks, of_sole = _of_sole(grid, contacts, soft[kind.name], kind, starts, tread)
                parts[kind.name] += marks
                booked[kind.name] += of_sole
    if not parts:
        return None
    most = max(parts, key=lambda kind: booked[kind].left_behind)
    return replace(_joined(parts[most], booked[most]), surface=most)


def _of_sole(
    grid: SoleGrid,
    contacts: Sequence[_Contact],
    soft: Sequence[Meeting],
    kind: SurfaceRecord | Liquid,
    dirty: float,
    tread: float,
) -> tuple[list[Marks], CarriedMass]:
    """Marks of a sole of one kind, and what it has carried."""
    carried, meetings = kind.carried, list(soft)
    shares: dict[int, list[tuple[_Contact, Array]]] = {}
    assert carried is not None
    for contact in contacts:
        if contact.wet == kind.name:
            meetings.append(Meeting(float(contact.frames[-1])))
            continue
        share = share_left(contact.laid.pressure, carried, contact.slid)
        of_zones = _by_zone(grid, share * grid.area) / np.maximum(_by_zone(grid, grid.area), 1e-300)
        meetings.append(meeting := Meeting(float(contact.frames[0]), of_zones))
        shares[id(meeting)] = [(contact, share)]
    meetings.sort(key=lambda one: one.frame)
    giving, of_sole = carry(meetings, carried, _by_zone(grid, grid.area), dirty)
    marks = []
    for meeting, film in zip(meetings, giving, strict=True):
        for contact, share in shares.get(id(meeting), ()):
            if (mass := film[grid.zone] * share).any():
                marks.append(_mark(grid, contact, mass, tread))
    return marks, of_sole


def _soft_meetings(
    character: CharacterLoads,
    index: int,
    steps: Sequence[EditableStep],
    kind: str,
    surface: str,
    shed: Mapping[int, float],
) -> Iterator[Meeting]:
    """A sole as it leaves soft ground of a kind, which it does not with its last step if that goes on to the end."""
    of_sole = character.motion.name, character.motion.soles[index].sole.name
    density = surfaces.sticking(kind).density
    for step in steps:
        if step.left is None or step.is_copy or (step.left.character, step.left.sole) != of_sole:
            continue
        if (step.left.surface or surface) == kind and step.left.end_frame < character.motion.frames[-1]:
            yield Meeting(step.left.end_frame, shed=shed.get(step.index, 0.0) * density)


def _slid(character: CharacterLoads, index: int) -> Array:
    """Way that a sole has slid under load up to each step, (N,), in sole lengths."""
    motion, speed = character.motion, slide_speed(character, index)
    slides = (speed > REST_SPEED * motion.froude_speed) & (normal_force(character, index) > 0)
    return np.cumsum(speed * slides) * motion.time_step / motion.soles[index].sole.length


def _pieces(hard: NDArray[np.bool_], slid: Array) -> Iterator[slice]:
    """The contacts of a sole with hard floors, cut where it has slid on by its length."""
    for first, end in zip(*runs(hard), strict=True):
        cuts = first + 1 + np.flatnonzero(np.diff(np.floor(slid[first:end] - slid[first])))
        yield from map(slice, (first, *cuts), (*cuts, end))


def _contact(
    character: CharacterLoads, index: int, grid: SoleGrid, during: slice, slid: Array, terrain: HardOnSoft
) -> _Contact:
    motion = character.motion
    steps = np.arange(during.start, during.stop, max(1, (during.stop - during.start) // LOOKED_AT))
    poses = motion.soles[index].transforms[steps].copy()
    lift = character.contacts.offset[index] * character.contacts.normal[steps, index]
    poses[..., :3, 3] -= lift[:, None]  # the float or sink of the source
    force, tolerance = normal_force(character, index)[steps], LEAVE_HEIGHT * motion.leg_length
    print_ = laid(grid, poses, force, terrain, tolerance)
    x, y, z = print_.position.T
    weight = print_.pressure * grid.area
    wet = ""
    for liquid, floor in terrain.wet.items():
        on_it = np.abs(floor.heights(x, y, z) - z) < SAME_LAYER
        wet = liquid if weight[on_it].sum() > 0.5 * weight.sum() else wet
    return _Contact(print_, float(slid[during.stop - 1] - slid[during.start]), motion.frames[steps], wet)


def _by_zone(grid: SoleGrid, values: Array) -> Array:
    return np.asarray(np.bincount(grid.zone, values, len(ZONES)), float)


def _mark(grid: SoleGrid, contact: _Contact, mass: Array, tread: float) -> Marks:
    """The mark of one contact that leaves a mass at each node of the grid [kg/m²]; `_joined` numbers it."""
    used, faces = np.unique(contact.laid.faces, return_inverse=True)
    return Marks(
        contact.laid.position[used],
        faces.reshape(-1, 4),
        contact.frames[contact.laid.touched[used]],
        mass[used],
        grid.area[used],
        grid.sole[used],
        np.full(len(used), tread),
        np.zeros(len(used), np.intp),
    )


def _joined(parts: Sequence[Marks], carried: CarriedMass) -> Marks:
    first = np.cumsum([0, *(len(part.position) for part in parts)])
    none, places, numbers = np.zeros(0), np.zeros((0, 3)), np.zeros(0, np.intp)
    nothing = Marks(places, np.zeros((0, 4), np.intp), none, none, none, places, none, numbers)
    names = ("position", "birth", "mass", "area", "sole", "tread")
    whole: Any = {name: np.concatenate([getattr(part, name) for part in (nothing, *parts)]) for name in names}
    whole["step"] = np.repeat(np.arange(len(parts)), [len(part.position) for part in parts])
    faces = [part.faces + start for part, start in zip(parts, first, strict=False)]
    return Marks(faces=np.concatenate([nothing.faces, *faces]), **whole, carried=carried)
