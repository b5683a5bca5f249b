"""Marks of a shot: what all soles leave on hard floors of what they took up from the soft ground."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import compress
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
from ..motion.sole_motion import Sole, SoleMotion
from ..numerics.arrays import Array
from ..numerics.intervals import runs
from ..numerics.slices import Slices, sliced
from ..record.edits import LONGEST_SHIFT
from ..record.record import EditableStep
from .film import ZONES, CarriedMass, Meeting, share_left
from .floor_steps import FloorSteps, SoleOnFloors
from .hard_print import HardPrint, SoleGrid, laid, prop_spacing, sole_grid, swept

LOOKED_AT = 32
"""Steps of a contact at which it is looked at, about."""
AT_ONCE = 20
"""Faces of a mark that are shown together: a third of a shoe, three rows of a tyre."""


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
    pad : (V, 3) float array
        Under bare feet, as of `relief.tread.PADS`: ahead over length, left of a right foot over breadth, breadth [m].
    share : (V,) float array
        Of the film on the sole that is left there.
    zone : (V,) int array
        See `film.ZONES`.
    floors : FloorSteps
        From which the mass follows.
    """

    position: Array
    faces: NDArray[np.intp]
    birth: Array
    mass: Array
    area: Array
    sole: Array
    tread: Array
    pad: Array
    step: NDArray[np.intp]
    share: Array
    zone: NDArray[np.intp]
    floors: FloorSteps
    carried: CarriedMass = field(default_factory=CarriedMass)

    def in_turn(self) -> Marks:
        """The same marks in pieces that are there at once: faces that share vertices have one birth, the latest."""
        step, latest = self.step[self.faces[:, 0]], self.birth[self.faces].max(axis=1)
        order = np.lexsort((latest, step))
        ahead = np.searchsorted(step[order], step[order])
        same = np.concatenate([[True], (np.diff(latest[order]) != 0) | (np.diff(step[order]) != 0)])
        rank = np.maximum.accumulate(np.where(same, np.arange(len(order)), 0)) - ahead
        piece = np.empty_like(step)
        piece[order] = np.cumsum(np.concatenate([[0], np.diff(step[order] * len(order) + rank // AT_ONCE) != 0]))
        birth = np.zeros(piece.max(initial=-1) + 1)
        np.maximum.at(birth, piece, latest)
        corners, faces = np.unique(self.faces * len(birth) + piece[:, None], return_inverse=True)
        vertex, piece = np.divmod(corners, len(birth))
        parts = {name: getattr(self, name)[vertex] for name in OF_VERTEX if name != "birth"}
        parts["area"] = parts["area"] / np.bincount(vertex)[vertex]
        return replace(self, faces=faces.reshape(-1, 4), birth=birth[piece], **parts)

    def with_steps(self, steps: Sequence[EditableStep], shed: Mapping[int, float]) -> Marks:
        """The same marks with the mass that they have after other steps on the soft ground; see `FloorSteps.films`."""
        films, booked = self.floors.films(steps, shed)
        each = np.array([films[number] for number in range(len(films))]).reshape(-1, len(ZONES))
        return replace(self, mass=each[self.step, self.zone] * self.share, carried=booked)


@dataclass(frozen=True)
class _Contact:
    """A contact of a sole with a hard floor: where it lies, its slide in sole lengths, frames, and what wets it."""

    grid: SoleGrid
    laid: HardPrint
    slid: float
    frames: Array
    wet: str


@dataclass(frozen=True)
class _Under:
    """Underside of a sole: the depth of its grooves [m], and itself where it is bare."""

    tread: float
    bare: Sole | None

    def pads(self, places: Array) -> Array:
        """Places (N, 3) of `SoleGrid` as `Marks.pad` has them."""
        if self.bare is None:
            return np.zeros_like(places)
        along, across, _ = places.T
        left = across * (-1.0 if self.bare.side == "L" else 1.0) / self.bare.breadth
        return np.stack([along / self.bare.length - 0.5, left, np.full(len(places), self.bare.breadth)], axis=-1)


OF_VERTEX = ("position", "birth", "mass", "area", "sole", "tread", "pad", "step", "share", "zone")
"""Fields of `Marks` that have a row for each vertex."""
_Mark = dict[str, Any]
"""The faces of a mark, and the values of its vertices, as `Marks` has them."""
_NOTHING: _Mark = {
    **dict.fromkeys(("birth", "mass", "area", "tread", "share"), np.zeros(0)),
    **dict.fromkeys(("position", "sole", "pad"), np.zeros((0, 3))),
    **{"zone": np.zeros(0, np.intp), "faces": np.zeros((0, 4), np.intp)},
}


@sliced
def marks_of(
    loads: Sequence[CharacterLoads],
    steps: Sequence[EditableStep],
    terrain: Terrain,
    *,
    surface: str,
    shed: Mapping[int, float] = MappingProxyType({}),
    treads: Mapping[tuple[str, str], float] = MappingProxyType({}),
    bare: Collection[tuple[str, str]] = (),
    carried: tuple[float, float] = (1.0, 1.0),
    brought: Mapping[str, tuple[str, float]] = MappingProxyType({}),
) -> Slices[Marks | None]:
    """What soles leave on the hard floors of a shot; None where there is none, or nothing sticks.

    Of several grounds and liquids that stick, that of which most is left.

    Parameters
    ----------
    steps : sequence of EditableStep
        On the soft ground, as the artist leaves them: those that are muted are not stepped into.
    surface : str
        What the ground is made of; a step in another kind of it says so.
    shed : mapping of int to float, optional
        Volume that each step sheds in the air, by its number [m³].
    treads : mapping of (str, str) to float, optional
        Depth of the grooves of soles that have some, by character and sole [m].
    bare : collection of (str, str), optional
        Feet without shoes, whose toes show.
    carried : (float, float), optional
        How much sticks and how far it goes, as of `CarriedFilm.scaled`.
    brought : mapping of str to (str, float), optional
        What is on the soles of a character as the shot starts, and its film over the thickest, by its name.
    """
    if not isinstance(terrain, HardOnSoft):
        return None
    prints = [step.footprint or step.baked for step in steps]
    dirt = [kind for kind, film in brought.values() if film]
    of_prints = [footprint.surface for footprint in prints if footprint.surface]
    kinds = dict.fromkeys([surface, *of_prints, *terrain.wet, *dirt])
    sticking = [kind for kind in map(surfaces.sticking, kinds) if kind.carried is not None]
    if not sticking:
        return None
    laid_out: list[tuple[Sequence[_Contact], SoleOnFloors, _Under]] = []
    for character in loads:
        for index, motion in enumerate(character.motion.soles):
            yield
            of, hard = (character.motion.name, motion.sole.name), character.contacts.hard
            _, dirty = brought.get(of[0], ("", 0.0))
            on_soft = any((step.baked.character, step.baked.sole) == of for step in steps)
            takes = on_soft or dirty or terrain.wet
            if not takes or hard is None or not hard[:, index].any():
                continue
            grid = None if motion.sole.prop else sole_grid(motion.sole, flat_pose(motion.transforms))
            contacts = []
            slid, turned = _slid(character, index), _turned(motion)
            for during in _pieces(hard[:, index], slid + turned):
                contacts += _contacts(character, index, grid, during, slid, terrain, hard[:, index])
                yield
            if contacts:
                areas = np.max([_by_zone(each.grid, each.grid.area) for each in contacts], axis=0)
                sole = SoleOnFloors(of, areas, float(character.motion.frames[-1]), dirty, (), ())
                laid_out.append((contacts, sole, _Under(treads.get(of, 0.0), motion.sole if of in bare else None)))
    whole = [
        _of_kind(kind, FloorSteps(kind.name, surface, (), carried), laid_out, steps, shed, brought) for kind in sticking
    ]
    return max(whole, key=lambda marks: (marks.carried.left_behind, len(marks.faces)))


def _of_kind(
    kind: SurfaceRecord | Liquid,
    floors: FloorSteps,
    laid_out: Sequence[tuple[Sequence[_Contact], SoleOnFloors, _Under]],
    steps: Sequence[EditableStep],
    shed: Mapping[int, float],
    brought: Mapping[str, tuple[str, float]],
) -> Marks:
    """All marks of one kind, and those that there would be if steps on soft ground are muted no more, or shifted."""
    parts: list[_Mark] = []
    soles = []
    for contacts, sole, under in laid_out:
        meetings, marks = [], []
        for contact in sorted(contacts, key=lambda each: each.frames[0]):
            is_wet = contact.wet == kind.name
            share = share_left(contact.laid.pressure, floors.carried, contact.slid)
            of_zones = _by_zone(contact.grid, share * contact.grid.area) / np.maximum(sole.areas, 1e-300)
            meetings.append(Meeting(float(contact.frames[-1 if is_wet else 0]), None if is_wet else of_zones))
            marks.append(-1 if is_wet else len(parts))
            parts += [] if is_wet else [_mark(contact, share, under)]
        dirty = sole.dirty if sole.of[0] in brought and brought[sole.of[0]][0] == kind.name else 0.0
        soles.append(replace(sole, meetings=tuple(meetings), marks=tuple(marks), dirty=dirty))
    floors = replace(floors, soles=tuple(soles))
    baked = [replace(step, footprint=step.baked) for step in steps if not step.is_copy]
    at_most, _ = floors.films(baked, {})
    for sole in soles:
        ends = [meeting.frame for meeting in floors.soft_meetings(replace(sole, last_frame=np.inf), baked, {})]
        for number, meeting in zip(sole.marks, sole.meetings, strict=True):
            if number >= 0 and any(abs(end - meeting.frame) <= LONGEST_SHIFT for end in ends):
                at_most[number] = np.ones(len(ZONES))
    weighs = [bool((at_most[n][part["zone"]] * part["share"]).any()) for n, part in enumerate(parts)]
    numbers = np.append(np.where(weighs, np.cumsum(weighs) - 1, -1), -1).astype(int)
    soles = [replace(sole, marks=tuple(numbers[list(sole.marks)].tolist())) for sole in soles]
    parts, floors = list(compress(parts, weighs)), replace(floors, soles=tuple(soles))
    return _joined(parts, floors).with_steps(steps, shed)


def _slid(character: CharacterLoads, index: int) -> Array:
    """Way that a sole has slid under load up to each step, (N,), in sole lengths."""
    motion, speed = character.motion, slide_speed(character, index)
    slides = (speed > REST_SPEED * motion.froude_speed) & (normal_force(character, index) > 0)
    return np.cumsum(speed * slides) * motion.time_step / motion.soles[index].sole.length


def _turned(motion: SoleMotion) -> Array:
    """Turns up to each step, (N,), of a body that may roll."""
    if motion.sole.prop is None:
        return np.zeros(len(motion.transforms))
    rotation = motion.transforms[:, 0, :3, :3]
    cosine = (np.einsum("nij,nij->n", rotation[1:], rotation[:-1]) - 1.0) / 2.0
    return np.concatenate([[0.0], np.cumsum(np.arccos(np.clip(cosine, -1.0, 1.0)))]) / (2 * np.pi)


def _pieces(hard: NDArray[np.bool_], slid: Array) -> Iterator[slice]:
    """The contacts of a sole with hard floors, cut where it has slid on by its length or turned once."""
    for first, end in zip(*runs(hard), strict=True):
        cuts = first + 1 + np.flatnonzero(np.diff(np.floor(slid[first:end] - slid[first])))
        yield from map(slice, (first, *cuts), (*cuts, end))


def _along(
    place: Array, during: slice, on_hard: NDArray[np.bool_], spacing: float
) -> tuple[NDArray[np.intp], tuple[bool, bool]]:
    """Steps at which a body is looked at, about one for each spacing of its way, with one before and one after of the
    pieces there, and whether there are.
    """
    way = np.linalg.norm(np.diff(place[during], axis=0), axis=1)
    every = max(1, int(spacing / max(way.mean(), 1e-9))) if len(way) else 1
    every = min(every, max(1, (during.stop - during.start) // LOOKED_AT))
    before = bool(during.start > 0 and on_hard[during.start - 1])
    after = bool(during.stop < len(on_hard) and on_hard[during.stop])
    inside = {*range(during.start, during.stop, every), during.stop - 1}
    ends = [during.start - 1] * before + [during.stop] * after
    return np.array(sorted(inside.union(ends))), (before, after)


def _contacts(
    character: CharacterLoads,
    index: int,
    grid: SoleGrid | None,
    during: slice,
    slid: Array,
    terrain: HardOnSoft,
    on_hard: NDArray[np.bool_],
) -> list[_Contact]:
    """One contact of a sole with a grid or of a body, or none where no floor is under it."""
    motion = character.motion
    sole, prop = motion.soles[index], motion.soles[index].sole.prop
    steps, others = (
        np.arange(during.start, during.stop, max(1, (during.stop - during.start) // LOOKED_AT)),
        (False, False),
    )
    if prop is not None:
        steps, others = _along(sole.transforms[:, 0, :3, 3], during, on_hard, prop_spacing(prop))
    poses = sole.transforms[steps].copy()
    lift = character.contacts.offset[index] * character.contacts.normal[steps, index]
    poses[..., :3, 3] -= lift[:, None]  # the float or sink of the source
    force, tolerance = normal_force(character, index)[steps], LEAVE_HEIGHT * motion.leg_length
    if prop is not None:
        of_body = swept(prop, poses[:, 0], force, terrain, tolerance, others)
        if of_body is None:
            return []
        grid, print_ = of_body
    else:
        assert grid is not None
        print_ = laid(grid, poses, force, terrain, tolerance)
    x, y, z = print_.position.T
    weight = print_.pressure * grid.area
    wet = ""
    for liquid, floor in terrain.wet.items():
        on_it = np.abs(floor.heights(x, y, z) - z) < SAME_LAYER
        wet = liquid if weight[on_it].sum() > 0.5 * weight.sum() else wet
    return [_Contact(grid, print_, float(slid[during.stop - 1] - slid[during.start]), motion.frames[steps], wet)]


def _by_zone(grid: SoleGrid, values: Array) -> Array:
    return np.asarray(np.bincount(grid.zone, values, len(ZONES)), float)


def _mark(contact: _Contact, share: Array, under: _Under) -> _Mark:
    """The mark of one contact that leaves a share at each node of its grid."""
    grid = contact.grid
    used, faces = np.unique(contact.laid.faces, return_inverse=True)
    return {
        "faces": faces.reshape(-1, 4),
        "position": contact.laid.position[used],
        "birth": contact.frames[contact.laid.touched[used]],
        "mass": np.zeros(len(used)),
        "area": grid.area[used],
        "sole": grid.sole[used],
        "tread": np.full(len(used), under.tread),
        "pad": under.pads(grid.sole[used]),
        "share": share[used],
        "zone": grid.zone[used],
    }


def _joined(parts: Sequence[_Mark], floors: FloorSteps) -> Marks:
    counts = [len(part["mass"]) for part in parts]
    first = np.cumsum([0, *counts])
    parts = [part | {"faces": part["faces"] + start} for part, start in zip(parts, first, strict=False)]
    whole: Any = {name: np.concatenate([none, *(part[name] for part in parts)]) for name, none in _NOTHING.items()}
    return Marks(step=np.repeat(np.arange(len(parts)), np.array(counts, int)), floors=floors, **whole)
