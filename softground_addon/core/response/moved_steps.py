"""Displacement of the feet to the artist's moved and turned steps, as far as the legs reach."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..legs.foot_lock import eased, turned_level
from ..legs.grounding import leg_of, leg_soles, out_of_reach
from ..legs.hips import hips_go_along
from ..motion.motion import CharacterMotion
from ..numerics.arrays import Array, Mask
from ..numerics.intervals import runs
from ..numerics.rigid import carried
from ..record.edits import StepEdit, edits_by_number, step_id
from ..record.footprints import Footprint

HIPS_TIME = 0.2
"""Standard deviation of the smoothing of hips that go along with moved steps [s], for an adult: half of a step."""
DEEPEST = 0.1
"""The hips come down by at most so much for a moved step, in leg lengths."""
_PARTS = np.linspace(1.0, 0.0, 101)
"""Parts of the way to a moved step that are tried."""


@dataclass(frozen=True)
class OutOfReach:
    """A step that was moved further than the leg can follow.

    Attributes
    ----------
    step : str
        Its id.
    part : float
        Part of the way that the foot goes.
    """

    step: str
    part: float


@dataclass(frozen=True)
class Followed:
    """Displacements of feet to their moved steps.

    Attributes
    ----------
    carries : mapping of int to (F, 4, 4) float array
        By sole, its level displacement.
    hips : (F, 2) float array
        Displacement of the hips [m].
    """

    carries: Mapping[int, Array] = field(default_factory=dict)
    hips: Array | None = None
    out_of_reach: tuple[OutOfReach, ...] = ()


@dataclass(frozen=True)
class _Moved:
    step: str
    side: str
    sole: int
    during: slice
    pivot: Array
    move: Array
    turn: float
    part: float = 1.0

    def shifts(self, points: Array, part: Array) -> Array:
        """Displacements of level points (K, 2) after parts (P,) of the way, (P, K, 2)."""
        turned = turned_level(part[:, None] * self.turn, points - self.pivot)
        return np.asarray(turned + self.pivot - points + part[:, None, None] * self.move)


def follow(
    motion: CharacterMotion, touching: Mask, footprints: Sequence[Footprint], edits: Mapping[str, StepEdit]
) -> Followed:
    """Displacements of a character's feet to their moved steps, as far as its legs reach.

    Parameters
    ----------
    motion : CharacterMotion
        The source, at scene frames.
    touching : (F, S) bool array
    footprints : sequence of Footprint
        As they were baked, of all characters.
    """
    moved = list(_moved(motion, touching, footprints, edits))
    if not moved:
        return Followed()
    wanted = _hips(motion, touching, moved)
    moved = [replace(step, part=_reached(motion, step, wanted)) for step in moved]
    carries = _carries(motion, touching, moved)
    short = tuple(OutOfReach(step.step, step.part) for step in moved if step.part < 1.0)
    return Followed(carries, _hips(motion, touching, moved), short)


def _moved(
    motion: CharacterMotion, touching: Mask, footprints: Sequence[Footprint], edits: Mapping[str, StepEdit]
) -> Iterable[_Moved]:
    feet = leg_soles(motion)
    of_name = {motion.soles[sole].sole.name: (side, sole) for side, sole in feet.items()}
    for number, edit in edits_by_number(footprints, edits).items():
        if number >= len(footprints):  # a copy, which no foot made
            continue
        footprint = footprints[number]
        stays = edit.mute or (edit.move_m == (0.0, 0.0) and edit.turn_deg == 0.0)
        if stays or footprint.character != motion.name or footprint.sole not in of_name:
            continue
        side, sole = of_name[footprint.sole]
        contact = _contact(motion.frames, touching[:, sole], footprint)
        if contact is not None:
            move, turn = np.array(edit.move_m), float(np.radians(edit.turn_deg))
            yield _Moved(step_id(footprint), side, sole, contact, footprint.position[:2], move, turn)


def _contact(frames: Array, touching: Mask, footprint: Footprint) -> slice | None:
    """The samples of the contact that made a print."""
    middle = (footprint.start_frame + footprint.end_frame) / 2
    spans = [slice(first, end) for first, end in zip(*runs(touching), strict=True)]
    nearest = min(spans, key=lambda span: abs(frames[span].mean() - middle), default=None)
    if nearest is None or not frames[nearest][0] - 1 <= middle <= frames[nearest][-1] + 1:
        return None
    return nearest


def _carries(motion: CharacterMotion, touching: Mask, moved: Sequence[_Moved]) -> dict[int, Array]:
    """The displacement of each sole: as its steps, eased between contacts."""
    carries = {}
    for sole in {step.sole for step in moved}:
        middle = motion.soles[sole].landmark_positions()[..., :2].mean(axis=1)
        turn, shift = np.zeros(len(middle)), np.zeros_like(middle)
        for step in moved:
            if step.sole == sole:
                turn[step.during] = step.part * step.turn
                shift[step.during] = step.shifts(middle[step.during], np.array([step.part]))[0]
        carries[sole] = eased(middle, turn, shift, touching[:, sole])
    return carries


def _hips(motion: CharacterMotion, touching: Mask, moved: Sequence[_Moved]) -> Array:
    """Displacement of the hips, (F, 2) [m]."""
    carries, offsets = _carries(motion, touching, moved), []
    feet = leg_soles(motion)
    for side, sole in feet.items():
        ankle = leg_of(motion, side, sole).ankle
        offsets.append((carried(carries[sole], ankle) - ankle)[:, :2] if sole in carries else np.zeros((len(ankle), 2)))
    return hips_go_along(motion, list(feet.values()), offsets, touching, HIPS_TIME)


def _reached(motion: CharacterMotion, step: _Moved, hips: Array) -> float:
    """The largest part of the way to a step for which the hips need not come down too far."""
    leg, during = leg_of(motion, step.side, step.sole), step.during
    part = _PARTS[:, None, None]
    aside, along = step.shifts(leg.ankle[during, :2], _PARTS), part * hips[during]
    level = np.zeros((*aside.shape[:2], 1))
    hip = leg.hip[during] + np.concatenate([along, level], axis=-1)
    ankle = leg.ankle[during] + np.concatenate([aside, level], axis=-1)
    farther = out_of_reach(leg, hip, ankle, during) - out_of_reach(leg, leg.hip[during], leg.ankle[during], during)
    within = farther.max(axis=1) <= DEEPEST * motion.leg_length
    return float(_PARTS[within.argmax()])
