"""Each contact judged by its own skin: absent, early, late or elsewhere, and feet that are two contacts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from ..findings import Finding, listed
from ..loads.estimate import CharacterLoads
from ..motion.motion import LowSkin
from ..motion.sole_motion import SoleMotion
from ..numerics.arrays import Array, Mask
from ..numerics.intervals import close_short, runs
from ..numerics.slices import Slices
from ..skin.merging import ALIKE
from ..skin.skin_motion import CALM_SPEED

NEAR, ALOFT = 0.015, 0.02
"""Calm skin below the first height over the ground rests, a part above the second is in the air, in body heights."""
LONGEST, LEAST_FRAMES = 0.067, 2
"""Longest disagreement of skin and contact [s], two frames at 30 Hz, for legs up to a metre."""
SLOWEST = 2.0
"""How many times as long it may be for the largest, whose legs swing slower."""
SHORTEST = 0.04
"""Time over which skin is seen to move [s]."""
RESTS = 0.25
"""Skin that rests as long wants a print within reach, also where it is of no contact, or others touch [s]."""
MOST_NAMED = 8
"""Feet that a message names at most."""
TOGETHER = 0.5
"""Share of the rarer one's time for which two contacts of one foot both touch, and of their breadth within which."""


def contact_check(character: CharacterLoads, skin: LowSkin, rise: Array, on_ground: Mask) -> Slices[list[Finding]]:
    """Findings that name contacts and bones.

    Parameters
    ----------
    rise : (F, P) float array
        Height of each part over the ground, in body heights.
    on_ground : (F, P) bool array
        True over soft ground.
    """
    motion = character.motion
    touching = character.contacts.touching[motion.on_frames]
    if not skin.soles or len(skin.frames) < 2 or not touching.any():
        return []
    rate = len(skin.frames) / (skin.frames[-1] - skin.frames[0] + 1) * motion.frame_rate
    slow = float(np.clip(np.sqrt(motion.leg_length), 1.0, SLOWEST)) * rate
    longest = max(LONGEST * slow, LEAST_FRAMES)
    rests = on_ground & (np.abs(rise) < NEAR) & (skin.rise < CALM_SPEED * skin.height)
    rests &= _still(skin, rests, rate)
    numbers = {sole.sole.name: number for number, sole in enumerate(motion.soles)}
    owner = np.array([numbers.get(name, -1) for name in skin.soles])
    absent: dict[str, int] = {}
    idle: dict[str, int] = {}
    aloft: dict[str, int] = {}
    for number in np.unique(owner[owner >= 0]):
        yield
        of_sole, on = owner == number, touching[:, number]
        name = motion.soles[number].sole.name
        bears = np.where(touching.any(axis=1), max(RESTS * slow, LEAST_FRAMES), longest)  # or it brushes the ground
        idle |= _first(name, rests[:, of_sole].any(axis=1) & ~on, np.where(_borders(on), longest, bears))
        aloft |= _first(name, on & (rise[:, of_sole] > ALOFT).all(axis=1), max(LONGEST * rate, LEAST_FRAMES))
        bears = motion.soles[number].bears
        if bears is not None and name not in aloft:  # it lands before its skin does, or leaves after it; at no ledge
            is_low = ((rise[:, of_sole] > -ALOFT) & (rise[:, of_sole] < 2 * ALOFT)).any(axis=1)
            aloft |= _first(name, on & is_low & ~bears[motion.on_frames], max(longest, LEAST_FRAMES + 1))
    least = max(RESTS * slow, LEAST_FRAMES)
    lengths = [sole.sole.length for sole in motion.soles]
    marks = [sole.landmark_positions()[motion.on_frames, :, :2] for sole in motion.soles]
    for part in np.flatnonzero((owner < 0) & rests.any(axis=0)):
        yield
        alone = rests[:, part].copy()
        if _first("", alone, least):  # which most parts that rest do not
            alone[alone] = ~_beside(skin.position[alone, part, :2], marks, lengths, touching, alone)
            absent |= _first(skin.bones[part] or motion.name, alone, least)
    findings = [*_doubled(character, skin.height)]
    without = "rests on the ground without a print"
    slides = "see whether it slides there too fast for a step, or has the wrong bone."
    for parts, kind, code, what, remedy in (
        (absent, "", "skin_without_step", without, "add what rests there to its contacts."),
        (idle, "The contact ", "contact_without_step", without, slides),
        (aloft, "", "step_without_skin", "prints while its skin is in the air", "check the bone of each."),
    ):
        if parts:
            first = skin.frames[min(parts.values())]
            message = f"{kind}{listed(parts, MOST_NAMED)} of '{motion.name}' {what}, from frame {first:.0f} on"
            findings.append(Finding(code, "warning", message, remedy, {"character": motion.name, "parts": [*parts]}))
    return findings


def _first(name: str, state: Mask, longest: Array | float) -> dict[str, int]:
    """The first step of a state that lasts for more than `longest` steps, by a name; feet that tremble interrupt it.

    `longest` (F,) may differ: the least within a state counts.
    """
    least = np.broadcast_to(longest, state.shape)
    start, end = runs(close_short(state, int(least.min() / 2) + 1))
    lasts = [first for first, last in zip(start, end, strict=True) if last - first > least[first:last].min()]
    return {name: int(lasts[0])} if lasts else {}


def _borders(on: Mask) -> Mask:
    """True beside a contact, (F,)."""
    borders = np.zeros_like(on)
    borders[1:] |= on[:-1]
    borders[:-1] |= on[1:]
    return borders


def _still(skin: LowSkin, rests: Mask, rate: float) -> Mask:
    """True while parts go with the ground, or with the belt of a body on the spot, before or after a frame, (F, P)."""
    lag = min(max(round(SHORTEST * rate), 1), len(skin.frames) - 1)  # feet that tremble stand
    ways = (skin.position[lag:, :, :2] - skin.position[:-lag, :, :2]) * (rate / lag)
    belt = np.median(ways[rests[lag:] & rests[:-lag]], axis=0) if skin.on_the_spot else np.zeros(2)
    speed = np.linalg.norm(ways - belt, axis=-1)
    before, after = np.full((2, *skin.rise.shape), np.inf)
    before[lag:], after[:-lag] = speed, speed
    return np.minimum(before, after) < skin.calm


def _beside(place: Array, marks: Sequence[Array], lengths: Sequence[float], touching: Mask, frames: Mask) -> Mask:
    """True while some sole touches within half its length of a place (N, 2) at N of the frames (F,), (N,)."""
    beside = np.zeros(len(place), dtype=bool)
    for of_sole, length, on in zip(marks, lengths, touching[frames].T, strict=True):
        beside[on] |= np.linalg.norm(of_sole[frames][on] - place[on, None], axis=-1).min(axis=1) < length / 2
    return beside


def _doubled(character: CharacterLoads, height: float) -> Iterator[Finding]:
    """A finding where two contacts lie against each other, move alike and touch together: one foot."""
    motion, touching = character.motion, character.contacts.touching
    pairs = [
        [this.sole.name, other.sole.name]
        for (first, this), (second, other) in combinations(enumerate(motion.soles), 2)
        if {this.sole.side, other.sole.side} != {"L", "R"}
        and this.bears is not None
        and other.bears is not None
        and _are_one(this, other, touching[:, first], touching[:, second], height)
    ]
    if pairs:
        message = f"{listed(pairs[0])} of '{motion.name}' press the same place at the same time: one foot, twice"
        remedy = "remove one of them from its contacts."
        yield Finding("foot_twice", "warning", message, remedy, {"character": motion.name, "contacts": pairs[0]})


def _are_one(this: SoleMotion, other: SoleMotion, on: Mask, also: Mask, height: float) -> bool:
    both = on & also
    if not both.any() or both.sum() < TOGETHER * min(on.sum(), also.sum()) or not (~on & ~also).any():
        return False  # what never lifts cannot be seen to move alike
    marks, others = this.landmark_positions(), other.landmark_positions()
    if np.ptp(np.linalg.norm(marks.mean(axis=1) - others.mean(axis=1), axis=-1)) > ALIKE * height:
        return False
    middle = int(np.flatnonzero(both)[both.sum() // 2])
    apart = np.linalg.norm(marks[middle, :, None, :2] - others[middle, None, :, :2], axis=-1).min()
    return bool(apart < TOGETHER * (this.sole.breadth + other.sole.breadth) / 2)
