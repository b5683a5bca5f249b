"""The carves of a shot: what bodies cut out of deep ground beside their prints, frame by frame, as footprints.

A carve is recorded per step, from the middle of one swing of its sole to the middle of the next. Like any footprint it
adds to the others: its compression is how far what stands lies below the pressed ground, its rim the loose matter. Both
may fall again, as where a sole presses what a shin had cut before.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ..ground.hard_ground import bare
from ..ground.heightfield import Terrain
from ..ground.regions import GroundKind
from ..ground.soft_ground import SoftGround
from ..ground.surfaces import find
from ..legs.grounding import Response
from ..motion.motion import CharacterMotion
from ..numerics.arrays import Array, Indices
from ..numerics.slices import Slices, sliced
from ..record.edits import UNCHANGED
from ..record.footprints import Footprint, FootprintRecorder
from ..record.moved_carve import placement, shifted
from ..record.record import BakeRecord, EditableStep
from ..record.throws import Throw
from .carved_ground import CarvedGround, Part, numbered
from .carved_step import CarvedStep, is_deep
from .carver import Walls
from .responded_skin import NO_SOLE, RespondedSkin, WornSkin, thinned

FRAMES_AT_ONCE = 16
"""Frames whose skin is worked out together."""
NEAR = 0.4
"""Skin of bones that are further above the ground at all times is left out [m]: nothing is heaped up so high."""
AWAY = 0.2
"""Time after which a sole that takes no more steps here is on its way [s]: half a swing."""


@sliced
def with_carves(
    record: BakeRecord,
    responses: Iterable[tuple[CharacterMotion, Response]],
    skins: Mapping[str, WornSkin],
    ground: SoftGround,
    surface: str,
) -> Slices[BakeRecord]:
    """A record with what the bodies of a shot carve; the same where nobody wades.

    Parameters
    ----------
    responses : iterable of (CharacterMotion, Response)
    skins : mapping of str to WornSkin
        By the names of the characters, of those whose skin was read.
    surface : str
        What it is made of.
    """
    prints = {step.index: _as_the_body_steps(step) for step in record.steps if step.footprint is not None}
    waders = {print.character for print in prints.values() if is_deep(print)}
    responded = [
        (motion.name, [sole.sole.name for sole in motion.soles], RespondedSkin(skins[motion.name], motion, response))
        for motion, response in responses
        if motion.name in skins.keys() & waders
    ]
    if not responded:
        return record
    carves, throws = yield from carves_of.slices(responded, prints, ground, surface, len(record.footprints))
    where = {name: replace(placement(edit), shift_frames=0) for name, edit in record.edits.items()}
    carved_with = {name: edit for name, edit in where.items() if edit != UNCHANGED}
    return replace(record, carves=carves, carved_with=carved_with, throws=throws)


def _as_the_body_steps(step: EditableStep) -> Footprint:
    """The remaining print of a step at the time at which its body takes it, whatever shift its edits ask for."""
    assert step.footprint is not None
    at = shifted(step.footprint, -step.edit.shift_frames) if step.edit.shift_frames else step.footprint
    return at if at.pressed_by else replace(at, pressed_by=step.baked.pressed_by)


@sliced
def carves_of(
    skins: Sequence[tuple[str, Sequence[str], RespondedSkin]],
    footprints: Mapping[int, Footprint],
    ground: SoftGround,
    surface: str,
    count: int,
) -> Slices[tuple[dict[int, Footprint], list[Throw]]]:
    """What bodies carve, by the number of the step that it goes with: of steps that sank beyond the ankle; with throws.

    Parameters
    ----------
    skins : sequence of (str, sequence of str, RespondedSkin)
        Name of each character, the names of its soles, and its skin; at least one, all at the same frames.
    footprints : mapping of int to Footprint
        The prints that the ground is made from, at least one, by their numbers.
    surface : str
        What it is made of, but for its regions: walls are those of the region that bears most of a step.
    count : int
        Of the steps that bodies take; those of higher numbers are copies.
    """
    first, frames = next(iter(footprints.values())), skins[0][2].frames
    deep = _deep(footprints, float(frames[0]), float(frames[-1]))
    steps = {
        number: CarvedStep(
            footprint,
            number in deep,
            FootprintRecorder(first.cell_size, first.frame_step),
            _walls(footprint, ground, surface),
        )
        for number, footprint in footprints.items()
    }
    carving = CarvedGround(ground, first.cell_size, list(steps.values()), skins[0][2].frame_rate)
    taken = [step for number, step in steps.items() if number < count]
    bodies = [_Body(name, soles, skin, taken, bare(ground.terrain), carving.cell_size) for name, soles, skin in skins]
    for number, (since, frame) in enumerate(pairwise([-np.inf, *frames.tolist()])):
        carving.press(since, frame)
        drawn = []
        for body in bodies:
            yield
            around = next(body.poses)
            parts = body.parts(number)
            for behind in body.behind(number):
                carving.leave(behind)
            drawn += [passed for part in parts if (passed := carving.drawn(part, around)) is not None]
        for passed in drawn:
            yield
            carving.carve(passed, drawn, frame)
        carving.slide(drawn, frame)
        carving.settle(drawn, frame)
    for step in steps.values():
        yield
        carving.finish(step, float(frames[-1]))
    carved = {number: carving.footprint(step) for number, step in steps.items() if step.recorder.frames}
    throws = [throw for number, step in steps.items() if number < count and (throw := step.throw(number))]
    return carved, throws


def _deep(footprints: Mapping[int, Footprint], first: float, last: float) -> set[int]:
    """Numbers of the deep prints; with those that an end of the shot cuts, of soles that leave deep ones."""
    deep = {number for number, print in footprints.items() if is_deep(print)}
    soles = {(footprints[number].character, footprints[number].sole) for number in deep}
    cut = {
        number for number, print in footprints.items() if print.start_frame < first + 1 or print.end_frame > last - 1
    }
    return deep | {number for number in cut if (footprints[number].character, footprints[number].sole) in soles}


def _walls(footprint: Footprint, ground: SoftGround, surface: str) -> Walls:
    """How the ground stands that a step is in: of the kind with the largest part of its contact."""
    kind = GroundKind(surface, ground.material)
    if ground.regions:
        window = footprint.window
        numbers, shares = ground.regions.under(window, window, footprint.cell_size)
        parts = (
            np.ones(1) if shares is None else shares.reshape(len(shares), -1)[:, footprint.contact_cells].sum(axis=1)
        )
        kind = ground.regions.kinds[numbers[int(parts.argmax())]]
    return Walls.of(find(kind.surface), kind.material, ground.gravity)


class _Body:
    """A character's skin, part by part, and the steps that these parts take."""

    def __init__(
        self,
        name: str,
        soles: Sequence[str],
        skin: RespondedSkin,
        steps: Sequence[CarvedStep],
        terrain: Terrain,
        cell_size: float,
    ) -> None:
        of_body = [step for step in steps if step.footprint.character == name]
        self._parts = []
        self._away: list[int] = []
        """Frame from which the sole of each part is away from its last step."""
        places = skin.at(np.zeros(1, dtype=np.intp))[0]
        every = thinned(places, skin.triangles, skin.bones, cell_size)
        near = skin.near(terrain, NEAR)
        used = numbered(np.concatenate([each[near[each].any(axis=1)] for each in every.values()]).T, len(near))[0]
        self.poses = _poses(skin, used)
        for sole, triangles in every.items():
            goes = (step.is_deep if sole == NO_SOLE else step.footprint.sole == soles[sole] for step in of_body)
            taken = [step for step, does in zip(of_body, goes, strict=True) if does]
            is_near = near[triangles].any(axis=1)
            if taken and is_near.any():
                of_used = np.searchsorted(used, triangles[is_near].T)
                nearest = _nearest(taken, skin.frames)
                self._parts.append((sole, taken, nearest, *numbered(of_used, len(used))))
                away = taken[nearest[-1]].footprint.end_frame + AWAY * skin.frame_rate
                self._away.append(int(np.searchsorted(skin.frames, away)))

    def parts(self, number: int) -> list[Part]:
        """The step that each part is nearest to at a frame, with the part."""
        return [Part(taken[nearest[number]], *skin) for _, taken, nearest, *skin in self._parts]

    def behind(self, number: int) -> list[CarvedStep]:
        """The steps that soles are not nearest to any more at a frame, or away from for good."""
        before = max(number - 1, 0)
        return [
            taken[nearest[before]]
            for (sole, taken, nearest, *_), away in zip(self._parts, self._away, strict=True)
            if sole != NO_SOLE and (nearest[before] != nearest[number] or number == away)
        ]


def _nearest(steps: Sequence[CarvedStep], frames: Array) -> Indices:
    """Which of the steps each frame is nearest to, (F,)."""
    spans = np.array([(step.footprint.start_frame, step.footprint.end_frame) for step in steps])
    away = np.maximum(spans[:, :1] - frames, frames - spans[:, 1:]).clip(min=0.0)
    nearest: Indices = away.argmin(axis=0)
    return nearest


def _poses(skin: RespondedSkin, vertices: Indices) -> Iterator[Array]:
    """Vertices a frame ago, at each frame, and at the neighbours of both, (4, 3, V) [m], frame by frame."""
    count, starts = len(skin.frames), {0, *skin.jumps}
    for first in range(0, count, FRAMES_AT_ONCE):
        end = min(first + FRAMES_AT_ONCE, count)
        places = np.swapaxes(skin.at(np.arange(first - 2, end + 1).clip(0, count - 1), vertices), 1, 2)
        for number in range(first, end):
            before = number - (number not in starts)
            further = before - (before not in starts)
            after = min(number + 1, count - 1) if number + 1 not in starts and number not in starts else number
            yield places[np.array((further, before, number, after)) - first + 2]
