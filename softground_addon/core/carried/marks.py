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
from ..ground.surfaces import CarriedFilm
from ..imprints.sole_points import flat_pose
from ..loads.contacts import LEAVE_HEIGHT, REST_SPEED
from ..loads.estimate import CharacterLoads
from ..numerics.arrays import Array
from ..numerics.intervals import runs
from ..numerics.slices import Slices, sliced
from ..record.record import EditableStep
from .film import ZONES, CarriedMass, Meeting, carry, share_left
from .hard_print import HardPrint, SoleGrid, laid, sole_grid

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
    """A contact of a sole with a hard floor: as it meets it, where it lies, the share each node leaves, its frames."""

    meeting: Meeting
    laid: HardPrint
    shares: Array
    frames: Array


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
    """What soles leave on the hard floors of a shot; None where there is none, or the ground does not stick.

    Parameters
    ----------
    steps : sequence of EditableStep
        On the soft ground, as the artist leaves them: those that are muted are not stepped into.
    surface : str
        What soles take up, of all that the ground is made of.
    shed : mapping of int to float, optional
        Mass that each step sheds in the air, by its number [kg].
    treads : mapping of (str, str) to float, optional
        Depth of the grooves of soles that have some, by character and sole [m].
    brought : mapping of str to float, optional
        Film on the soles of a character as the shot starts, over the thickest, by its name.
    """
    carried = surfaces.find(surface).carried
    if carried is None or not isinstance(terrain, HardOnSoft):
        return None
    parts: list[Marks] = []
    booked, count = CarriedMass(), 0
    for character in loads:
        for index, motion in enumerate(character.motion.soles):
            yield
            if motion.sole.prop is not None:
                continue
            sticky = [step for step in steps if step.left and step.left.surface in ("", surface)]
            soft = list(_soft_meetings(character, index, sticky, shed))
            hard = character.contacts.hard
            dirty = brought.get(character.motion.name, 0.0)
            if not (soft or dirty) or hard is None or not hard[:, index].any():
                continue
            grid = sole_grid(motion.sole, flat_pose(motion.transforms))
            contacts = []
            for during in _pieces(hard[:, index], slid := _slid(character, index)):
                contacts.append(_contact(character, index, grid, during, slid, terrain, carried))
                yield
            meetings = sorted([*soft, *(contact.meeting for contact in contacts)], key=lambda meeting: meeting.frame)
            giving, of_sole = carry(meetings, carried, _by_zone(grid, grid.area), dirty)
            booked += of_sole
            given = {id(meeting): film for meeting, film in zip(meetings, giving, strict=True)}
            for contact in contacts:
                film = given[id(contact.meeting)]
                if (film[grid.zone] * contact.shares > 0).any():
                    depth = treads.get((character.motion.name, motion.sole.name), 0.0)
                    parts.append(_mark(grid, contact, film, count, depth))
                    count += 1
    return replace(_joined(parts, booked), surface=surface)


def _soft_meetings(
    character: CharacterLoads, index: int, steps: Sequence[EditableStep], shed: Mapping[int, float]
) -> Iterator[Meeting]:
    """A sole as it leaves the soft ground, which it does not with its last step if that goes on to the end."""
    of_sole = character.motion.name, character.motion.soles[index].sole.name
    for step in steps:
        if step.left is None or step.is_copy or (step.left.character, step.left.sole) != of_sole:
            continue
        if step.left.end_frame < character.motion.frames[-1]:
            yield Meeting(step.left.end_frame, shed=shed.get(step.index, 0.0))


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
    character: CharacterLoads,
    index: int,
    grid: SoleGrid,
    during: slice,
    slid: Array,
    terrain: HardOnSoft,
    carried: CarriedFilm,
) -> _Contact:
    motion = character.motion
    steps = np.arange(during.start, during.stop, max(1, (during.stop - during.start) // LOOKED_AT))
    poses = motion.soles[index].transforms[steps].copy()
    lift = character.contacts.offset[index] * character.contacts.normal[steps, index]
    poses[..., :3, 3] -= lift[:, None]  # the float or sink of the source
    force, tolerance = normal_force(character, index)[steps], LEAVE_HEIGHT * motion.leg_length
    print_ = laid(grid, poses, force, terrain, tolerance)
    shares = share_left(print_.pressure, carried, float(slid[during.stop - 1] - slid[during.start]))
    of_zones = _by_zone(grid, shares * grid.area) / np.maximum(_by_zone(grid, grid.area), 1e-300)
    frames = motion.frames[steps]
    return _Contact(Meeting(float(frames[0]), of_zones), print_, shares, frames)


def _by_zone(grid: SoleGrid, values: Array) -> Array:
    return np.asarray(np.bincount(grid.zone, values, len(ZONES)), float)


def _mark(grid: SoleGrid, contact: _Contact, film: Array, number: int, tread: float) -> Marks:
    """The mark of one contact that takes its shares of a film (4,) [kg/m²]."""
    used, faces = np.unique(contact.laid.faces, return_inverse=True)
    return Marks(
        contact.laid.position[used],
        faces.reshape(-1, 4),
        contact.frames[contact.laid.touched[used]],
        (film[grid.zone] * contact.shares)[used],
        grid.area[used],
        grid.sole[used],
        np.full(len(used), tread),
        np.full(len(used), number),
    )


def _joined(parts: Sequence[Marks], carried: CarriedMass) -> Marks:
    first = np.cumsum([0, *(len(part.position) for part in parts)])
    none, places, numbers = np.zeros(0), np.zeros((0, 3)), np.zeros(0, np.intp)
    nothing = Marks(places, np.zeros((0, 4), np.intp), none, none, none, places, none, numbers)
    names = ("position", "birth", "mass", "area", "sole", "tread", "step")
    whole: Any = {name: np.concatenate([getattr(part, name) for part in (nothing, *parts)]) for name in names}
    faces = [part.faces + start for part, start in zip(parts, first, strict=False)]
    return Marks(faces=np.concatenate([nothing.faces, *faces]), **whole, carried=carried)
