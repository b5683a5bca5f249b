"""The only composer: from a character's motion to its loads, and from loads to footprints in the ground."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .body_dynamics import body_dynamics
from .contact_timing import refine_contacts
from .contacts import Contacts, detect_contacts, runs
from .deformation import (
    GroundMaterial,
    compress,
    compression_rate,
    displaced_volume,
    in_contact,
    rim_weights,
    sink,
    touching_fraction,
)
from .errors import InputError
from .footprints import Footprint, FootprintRecorder, quantised
from .forces import ContactForces, impulse_forces, whole_body_forces
from .heightfield import HeightField, Surface, Terrain, TerrainTiles, Window
from .imprint import SolePoints, cell_coverage, centroid, contact_window, point_contact, sole_points
from .motion import CharacterMotion, SoleMotion, steps_per_frame

Array = NDArray[np.float64]

STEPS_AT_ONCE = 128
"""Steps of one contact that are laid out in one go: about one stance of a walk."""
LARGEST_SPREAD = 4
"""A sliding sole is laid out in fewer steps, so that its window stays within so many times the sole's own."""

ForceModel = Literal["WHOLE_BODY", "IMPULSE"]


@dataclass(frozen=True)
class CharacterLoads:
    """What one character does to the ground, on the simulation's time grid."""

    motion: CharacterMotion
    contacts: Contacts
    forces: ContactForces


def estimate_loads(
    motion: CharacterMotion, terrain: Terrain, *, force_model: ForceModel, material: GroundMaterial
) -> CharacterLoads:
    """Resample the motion to the simulation's time grid, find its contacts and estimate its forces.

    Parameters
    ----------
    motion : CharacterMotion
        At scene frames.
    terrain : Terrain
        The undisturbed ground.
    force_model : 'WHOLE_BODY' or 'IMPULSE'
    material : GroundMaterial
        Its characteristic time shapes the impulse model; the whole-body model does not depend on it.
    """
    fine = motion.resampled(steps_per_frame(motion.frame_rate))
    contacts = detect_contacts(fine, terrain)
    if force_model == "IMPULSE":
        forces = impulse_forces(fine, contacts, material.characteristic_time)
    else:
        contacts = refine_contacts(fine, contacts, body_dynamics(fine))
        forces = whole_body_forces(fine, contacts)
    return CharacterLoads(fine, contacts, forces)


@dataclass(frozen=True)
class FrameResult:
    """The ground at one scene frame.

    Attributes
    ----------
    frame : float
        Scene frame.
    ground : HeightField
        Its state at this frame; the simulation goes on working on it.
    changed : tuple of Window
        Where it changed since the frame before.
    footprints : tuple of Footprint
        Those whose contact ended since the frame before; at the last frame, all that were still open.
    touching : tuple of (S,) bool arrays
        Which soles of each character touch.
    forces : tuple of (S, 3) float arrays
        Ground reaction force on each of them [N].
    """

    frame: float
    ground: HeightField
    changed: tuple[Window, ...]
    footprints: tuple[Footprint, ...]
    touching: tuple[NDArray[np.bool_], ...]
    forces: tuple[Array, ...]


def simulate(
    loads: Sequence[CharacterLoads], terrain: Terrain, material: GroundMaterial, cell_size: float
) -> Iterator[FrameResult]:
    """Press footprints into the ground, frame by frame.

    Each step of the loads presses over the time that ends at it; their first is the undisturbed ground.

    Parameters
    ----------
    loads : sequence of CharacterLoads
        Characters that share the ground, on time grids of the same step.
    terrain : Terrain
        The undisturbed ground.
    material : GroundMaterial
    cell_size : float
        Side of a cell [m].

    Yields
    ------
    FrameResult
        One for each scene frame. The footprints of all results are the record of the bake, the ground of the last
        one is its end.

    Raises
    ------
    InputError
        If the cell size is not positive, or the characters do not share a time grid.
    """
    ground = HeightField(cell_size)
    frames, offsets, shown = _common_grid(loads)
    steps_between = int(shown[1] - shown[0]) if len(shown) > 1 else 1
    press = _Press(terrain, material, ground, loads[0].motion, steps_between)
    waiting = [contact for pair in zip(loads, offsets, strict=True) for contact in _contacts(*pair)]
    waiting.sort(key=lambda contact: contact.first)  # stable: in the order of the scene where they start together
    active: list[_Contact] = []
    start = 1
    for end in shown + 1:
        while waiting and waiting[0].first < end:
            active.append(waiting.pop(0))
        changed = press.advance(active, start, int(end), float(frames[end - 1]))
        over = end == shown[-1] + 1
        ended = [contact for contact in active if contact.end <= end or over]
        active = [contact for contact in active if contact.end > end]
        yield FrameResult(
            float(frames[end - 1]),
            ground,
            changed,
            tuple(contact.footprint(frames) for contact in ended if contact.pressed),
            *_state_at(loads, offsets, int(end) - 1),
        )
        start = int(end)


@dataclass(frozen=True)
class _Imprints:
    """A contact over the cells at each of N steps from `first` on."""

    first: int
    window: Window
    coverage: NDArray[np.float32]
    contact: NDArray[np.bool_]
    rim: Array
    target: Array

    @property
    def end(self) -> int:
        return self.first + len(self.target)


class _Contact:
    """One sole from touching down to leaving; its footprint as it grows. Steps count on the common time grid."""

    def __init__(self, loads: CharacterLoads, sole: int, points: SolePoints, offset: int, first: int, end: int) -> None:
        self.loads, self.sole, self.points, self.offset = loads, sole, points, offset
        self.first, self.end = first, end
        forces = np.einsum("ni,ni->n", loads.forces.forces[:, sole], loads.contacts.normal[:, sole])
        self.force = np.maximum(forces[first - offset : end - offset], 0.0)
        self.pressed = bool((self.force > 0).any())
        self.compressed = self.raised = self.unplaced = 0.0
        self.recorder: FootprintRecorder | None = None
        self._sinkage = 0.0
        self._area = 0.0
        self._moment, self._load = np.zeros(3), 0.0
        self._imprints: _Imprints | None = None

    @property
    def motion(self) -> SoleMotion:
        return self.loads.motion.soles[self.sole]

    def poses(self, start: int, end: int) -> Array:
        return self.motion.transforms[start - self.offset : end - self.offset]

    def imprints(self, start: int, end: int, press: _Press) -> _Imprints:
        """The imprints of these steps, laid out together with as many later ones as pays."""
        if self._imprints is None or self._imprints.end < end:
            ahead = press.steps_per_frame * max(1, STEPS_AT_ONCE // press.steps_per_frame)
            last = min(self.end, end - press.steps_per_frame + ahead)
            allowed = LARGEST_SPREAD * contact_window(self.points, self.poses(start, start + 1), press.cell_size).cells
            window = contact_window(self.points, self.poses(start, last), press.cell_size)
            while last > end and window.cells > allowed:
                last = end + (last - end) // (2 * press.steps_per_frame) * press.steps_per_frame
                window = contact_window(self.points, self.poses(start, last), press.cell_size)
            self._imprints = self._lay_out(start, last, window, press)
        return self._imprints

    def _lay_out(self, start: int, end: int, window: Window, press: _Press) -> _Imprints:
        poses, points = self.poses(start, end), self.points
        force = self.force[start - self.first : end - self.first]
        reach = press.material.rim_reach / press.cell_size
        window = window.expanded(max(1, int(reach + 1e-6)))
        divisions = points.cell_divisions(press.cell_size)
        cells = press.surface(window)
        ground = press.surface(window, divisions) if divisions > 1 else cells
        over_ground = point_contact(points, poses, ground)
        upright = self.loads.contacts.normal[start - self.offset : end - self.offset, self.sole, 2]
        area = over_ground.area / upright[:, None]
        sinking = sink(
            over_ground.clearance,
            area,
            force,
            tolerance=points.tolerance,
            step=press.step,
            material=press.material,
            sinkage=self._sinkage,
        )
        self._sinkage = sinking.reached
        self._area = max(self._area, float(sinking.area[force > 0].max(initial=0.0)))
        touching = area * touching_fraction(over_ground.clearance, sinking.sinkage[:, None], points.tolerance)
        self._moment += force @ centroid(points, poses, touching)
        self._load += force.sum()
        coverage = cell_coverage(
            self.motion.sole,
            poses,
            ground,
            lowest=over_ground.lowest,
            sinkage=sinking.sinkage,
            tolerance=points.tolerance,
            divisions=divisions,
        )
        contact = in_contact(coverage)
        rim = rim_weights(coverage, contact, reach, cells.bears)
        return _Imprints(start, window, coverage, contact, rim, sinking.target)

    def footprint(self, frames: Array) -> Footprint:
        """The record of what was pressed."""
        assert self.recorder is not None
        forward = self.poses(self.first, self.end)[int(self.force.argmax()), 0, :3, 0]
        steps = np.arange(self.first, self.end)
        return self.recorder.footprint(
            character=self.loads.motion.name,
            sole=self.motion.sole.name,
            start_frame=float(frames[self.first]),
            end_frame=float(frames[self.end - 1]),
            position=self._moment / self._load,
            heading=float(np.arctan2(forward[1], forward[0])),
            area_m2=self._area,
            peak_force_n=float(self.force.max()),
            compressed_m3=self.compressed,
            rim_m3=self.raised,
            unplaced_rim_m3=self.unplaced,
            load_frames=frames[steps],
            load_n=self.force,
        )


class _Press:
    """The ground that is pressed, and on what terms."""

    def __init__(
        self,
        terrain: Terrain,
        material: GroundMaterial,
        ground: HeightField,
        motion: CharacterMotion,
        steps_per_frame: int,
    ) -> None:
        self.terrain, self.material, self.ground = terrain, material, ground
        self.step, self.steps_per_frame = motion.time_step, steps_per_frame
        self.frame_step = motion.time_step * motion.frame_rate * steps_per_frame
        self._tiles: dict[int, TerrainTiles] = {}

    @property
    def cell_size(self) -> float:
        return self.ground.cell_size

    def surface(self, window: Window, divisions: int = 1) -> Surface:
        """The undisturbed ground under a window, its cells divided in so many parts along each side."""
        if divisions not in self._tiles:
            self._tiles[divisions] = TerrainTiles(self.terrain, self.cell_size / divisions)
        return self._tiles[divisions].surface(window.refined(divisions))

    def advance(self, contacts: Sequence[_Contact], start: int, end: int, frame: float) -> tuple[Window, ...]:
        """Press the steps from start to before end, all contacts of a step before the next where they share ground."""
        parts = []
        for contact in contacts:
            first, last = max(start, contact.first), min(end, contact.end)
            if first < last and contact.pressed:
                parts.append((contact, contact.imprints(first, last, self), first, last))
        windows = [imprints.window for _, imprints, _, _ in parts]
        if any(one.intersects(other) for one, other in combinations(windows, 2)):
            spans = [(step, step + 1) for step in range(start, end)]
        else:
            spans = [(start, end)]
        for begin, stop in spans:
            for contact, imprints, first, last in parts:
                if max(first, begin) < min(last, stop):
                    self._press(contact, imprints, max(first, begin), min(last, stop), frame)
        return tuple(windows)

    def _press(self, contact: _Contact, imprints: _Imprints, start: int, end: int, frame: float) -> None:
        if contact.recorder is None:
            contact.recorder = FootprintRecorder(self.cell_size, self.frame_step)
        steps = start - imprints.first + np.flatnonzero(imprints.target[start - imprints.first : end - imprints.first])
        if not len(steps):
            return
        state = self.ground.read(imprints.window)
        before = quantised(state)
        rate = compression_rate(self.step, self.material)
        heights = np.zeros(len(steps))
        for k, step in enumerate(steps):
            compression = compress(state[0], imprints.coverage[step], imprints.target[step], rate)
            heights[k] = (compression - state[0]).sum()
            state[0] = compression
        displaced = displaced_volume(heights, self.material)
        rise = displaced @ imprints.rim[steps].reshape(len(steps), -1)
        state[1] += rise.reshape(state[1].shape)
        self.ground.write(imprints.window, state)
        cell_area = self.cell_size**2
        contact.compressed += float(heights.sum()) * cell_area
        contact.raised += float(rise.sum()) * cell_area
        contact.unplaced += float(displaced[~imprints.rim[steps].any(axis=(1, 2))].sum()) * cell_area
        contact.recorder.add(frame, imprints.window, quantised(state) - before, imprints.contact[steps].any(axis=0))


def _contacts(loads: CharacterLoads, offset: int) -> Iterator[_Contact]:
    """All contacts of a character; `offset` is the step on the common grid at which it appears."""
    for number, sole in enumerate(loads.motion.soles):
        points = sole_points(sole.sole, sole.transforms)
        for first, end in zip(*runs(loads.contacts.touching[:, number]), strict=True):
            first_pressed = max(int(first) + offset, 1)  # the first step of all is the undisturbed ground
            if first_pressed < end + offset:
                yield _Contact(loads, number, points, offset, first_pressed, int(end) + offset)


def _common_grid(loads: Sequence[CharacterLoads]) -> tuple[Array, list[int], NDArray[np.intp]]:
    """Frame numbers of all steps, the step at which each character appears, and the steps at whole frames."""
    if not loads:
        raise InputError("There is no character to bake: add one with 'Add Character'.")
    motions = [character.motion for character in loads]
    first = min(motion.frames[0] for motion in motions)
    spacing = max(motion.time_step * motion.frame_rate for motion in motions)
    offsets = []
    for motion in motions:
        offset = (motion.frames[0] - first) / spacing
        if abs(motion.time_step - motions[0].time_step) > 1e-9 or abs(offset - round(offset)) > 1e-3:
            raise InputError(
                f"'{motion.name}' is sampled at other times than '{motions[0].name}': sample all characters at the "
                "same frames of the same scene."
            )
        offsets.append(round(offset))
    count = max(offset + len(motion.frames) for offset, motion in zip(offsets, motions, strict=True))
    frames = first + spacing * np.arange(count)
    shown = np.flatnonzero(np.abs(frames - first - np.rint(frames - first)) < 1e-6)
    frames[shown] = first + np.rint(frames[shown] - first)
    return frames, offsets, shown


def _state_at(
    loads: Sequence[CharacterLoads], offsets: Sequence[int], step: int
) -> tuple[tuple[NDArray[np.bool_], ...], tuple[Array, ...]]:
    """Which soles touch, and the force on each, at a step of the common grid; nothing outside a character's time."""
    touching, forces = [], []
    for character, offset in zip(loads, offsets, strict=True):
        index = step - offset
        present = 0 <= index < len(character.motion.frames)
        touching.append(character.contacts.touching[index] if present else np.zeros(len(character.motion.soles), bool))
        forces.append(character.forces.forces[index] if present else np.zeros((len(character.motion.soles), 3)))
    return tuple(touching), tuple(forces)
