"""Responses of the characters of a shot to the ground that they press, and what is said of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..findings import Finding
from ..ground.heightfield import Terrain
from ..legs.grounding import Response, responding
from ..loads.estimate import CharacterLoads
from ..loads.raised_rests import stands_on_hard
from ..motion.motion import CharacterMotion
from ..numerics.slices import Slices, sliced
from ..record.footprints import Footprint
from ..record.ground_history import pressed_history
from ..record.record import BakeRecord
from ..response.leaving import leaving_early
from ..response.moved_steps import Followed, OutOfReach, follow
from ..response.performance import suggested_speed
from ..response.response import Gaps, at_scene_frames, gaps, mean_sinkage, respond, stood_on
from ..settings import ResponseOptions

NOTICEABLE_LEAN = np.radians(0.25)
"""A body that leans no more than this moves its centre of mass by millimetres: the forces need not be found anew."""
LEAN_PASSES = 4
"""Most times that the ground is pressed anew by the leaning bodies. The lean of a frame follows from the ground before
it, so that each pass makes the shot right further on (Picard iteration); two are mostly enough."""


@dataclass(frozen=True)
class CharacterResponse:
    """One character's response and what it did for its feet.

    Attributes
    ----------
    motion : CharacterMotion
        The source, at scene frames.
    sinkage : float
        Mean depth of the character's prints [m].
    out_of_reach : tuple of OutOfReach
        Moved steps that its legs do not reach.
    """

    motion: CharacterMotion
    response: Response
    before: Gaps
    after: Gaps
    sinkage: float
    out_of_reach: tuple[OutOfReach, ...] = ()


@sliced
def standing_on(
    motions: Sequence[CharacterMotion], terrain: Terrain, options: ResponseOptions | None
) -> Slices[tuple[CharacterMotion, ...]]:
    """The motions as they will walk on the terrain, which is where they press it."""
    if options is None or options.grounding is None:
        return tuple(motions)
    standing = []
    for motion in motions:
        as_it_is = motion.centre is not None or stands_on_hard(motion, terrain)
        yield
        standing.append(motion if as_it_is else (yield from stood_on.slices(motion, terrain)))
    return tuple(standing)


@dataclass(frozen=True)
class Leaning:
    """The motions with the lean that the pressed ground gives them, and by how much each leans, (F, 2) [rad]."""

    motions: tuple[CharacterMotion, ...]
    leans: tuple[NDArray[np.float64], ...]


@sliced
def leaning(
    loads: Sequence[CharacterLoads],
    motions: Sequence[CharacterMotion],
    terrain: Terrain,
    records: Sequence[BakeRecord],
    options: ResponseOptions | None,
) -> Slices[Leaning]:
    """The motions with the lean that the pressed ground gives them, for the forces to see; empty without a tilt.

    `records` has that of each ground.
    """
    moved, leans, history = [], [], pressed_history(terrain, [record.edited for record in records])
    if options is not None and options.tilt is not None:
        for of_character, motion in zip(loads, motions, strict=True):
            if motion.centre is not None:
                moved.append(motion)
                leans.append(np.zeros((len(motion.frames), 2)))
                continue
            touching = at_scene_frames(of_character.contacts.standing, of_character.motion.frames, motion)
            yield
            response = yield from respond.slices(motion, touching, history, tilt=options.tilt, grounding=None)
            moved.append(responding(motion, response))
            leans.append(response.lean)
    return Leaning(tuple(moved), tuple(leans))


def leans_anew(now: Leaning, before: Leaning | None) -> bool:
    """True if a lean differs so much from the one that pressed the ground that the forces must be found anew."""
    then = before.leans if before is not None else [np.zeros(2)] * len(now.leans)
    return any(float(np.abs(lean - was).max()) > NOTICEABLE_LEAN for lean, was in zip(now.leans, then, strict=True))


@sliced
def responses_of(
    loads: Sequence[CharacterLoads],
    motions: Sequence[CharacterMotion],
    terrain: Terrain,
    records: Sequence[BakeRecord],
    options: ResponseOptions | None,
) -> Slices[list[CharacterResponse]]:
    """Each rigged character's response to the pressed ground, on top of its source; its feet follow moved steps.

    `records` has that of each ground.
    """
    responses: list[CharacterResponse] = []
    if options is None:
        return responses
    history = pressed_history(terrain, [record.edited for record in records])
    footprints, edited = (
        [footprint for part in parts for footprint in part]
        for parts in ([record.footprints for record in records], [record.edited for record in records])
    )
    edits = {name: edit for record in records for name, edit in record.edits.items()}
    for of_character, motion in zip(loads, motions, strict=True):
        if motion.centre is not None:
            continue
        touching = at_scene_frames(of_character.contacts.standing, of_character.motion.frames, motion)
        followed = follow(motion, touching, footprints, edits) if options.grounding else Followed()
        standing = leaving_early(motion, touching, edited) if options.grounding else touching
        yield
        response = yield from respond.slices(
            motion,
            touching,
            history,
            tilt=options.tilt,
            grounding=options.grounding,
            standing=standing,
            followed=followed,
        )
        yield
        before = yield from gaps.slices(motion, standing, history)
        yield
        after = yield from gaps.slices(responding(motion, response), standing, history)
        sinkage = mean_sinkage(edited, motion.name)
        responses.append(CharacterResponse(motion, response, before, after, sinkage, followed.out_of_reach))
    return responses


@sliced
def gap_table(
    responses: Sequence[CharacterResponse],
    loads: Sequence[CharacterLoads],
    motions: Sequence[CharacterMotion],
    terrain: Terrain,
    records: Sequence[BakeRecord],
) -> Slices[dict[str, object]]:
    """Penetration and float of the standing soles before and after [mm], for the report.

    Where no character responds, those of all as they are.
    """
    if responses:
        return {
            when: {character.motion.name: _statistics(getattr(character, when)) for character in responses}
            for when in ("before", "after")
        }
    table, history = {}, pressed_history(terrain, [record.edited for record in records])
    for of_character, motion in zip(loads, motions, strict=True):
        touching = at_scene_frames(of_character.contacts.standing, of_character.motion.frames, motion)
        yield
        remaining = yield from gaps.slices(motion, touching, history)
        table[motion.name] = _statistics(remaining)
    return {"before": table, "after": table}


def floating_mm(gaps_mm: Mapping[str, Any]) -> float:
    """Height of feet above their prints, apart from a few frames [mm], of a report's gaps."""
    remaining = gaps_mm.get("after", gaps_mm["before"])
    return max((of_character["float"]["p95"] for of_character in remaining.values()), default=0.0)


def _statistics(of_soles: Gaps) -> dict[str, dict[str, float]]:
    millimetres = of_soles.heights * 1e3
    return {
        name: {
            "max": round(float(size.max(initial=0.0)), 3),
            "p95": round(float(np.percentile(size, 95)) if len(size) else 0.0, 3),
        }
        for name, size in (("penetration", np.maximum(-millimetres, 0.0)), ("float", np.maximum(millimetres, 0.0)))
    }


NOTICEABLE_GAP_MM = 1.0
"""Gaps from this on are worth a look [mm]."""
WORST_GAPS = 10
"""Frames that the report lists as the worst."""


def worst_gaps(responses: Sequence[CharacterResponse]) -> list[dict[str, object]]:
    """The largest gaps that are left, largest first, one for each character, sole and frame."""
    gaps_left = [
        (abs(height), character.motion.name, character.motion.soles[sole].sole.name, frame, height)
        for character in responses
        for frame, sole, height in zip(
            character.after.frames, character.after.soles, character.after.heights, strict=True
        )
    ]
    return [
        {"character": name, "contact": sole, "frame": round(float(frame), 3), "gap_mm": round(float(height) * 1e3, 3)}
        for _, name, sole, frame, height in sorted(gaps_left, reverse=True)[:WORST_GAPS]
    ]


def response_findings(responses: Sequence[CharacterResponse]) -> list[Finding]:
    """Findings about the responses."""
    without_legs = [
        Finding(
            "no_legs",
            "warning",
            f"'{character.motion.name}' has no leg with hip, knee and ankle: only its body responds.",
            "Complete its joints.",
            {"character": character.motion.name},
        )
        for character in responses
        if not character.response.legs
    ]
    too_far = [
        Finding(
            "step_out_of_reach",
            "warning",
            f"The leg of '{character.motion.name}' cannot follow step '{short.step}' to where it was moved: the foot "
            f"goes {short.part:.0%} of the way, so it does not stand in its print.",
            "Move the step less, or key the hips closer to it.",
            {"character": character.motion.name, "step": short.step, "part": round(short.part, 3)},
        )
        for character in responses
        for short in character.out_of_reach
    ]
    return without_legs + too_far + [_too_deep(each) for each in responses if _wades_too_deep(each)]


DEEP_FOR_A_WALK = 0.6
"""Mean depth from which a walk that is lowered into its prints does not look like wading any more, in leg lengths."""


def _wades_too_deep(character: CharacterResponse) -> bool:
    return bool(character.response.legs) and character.sinkage > DEEP_FOR_A_WALK * character.motion.leg_length


def _too_deep(character: CharacterResponse) -> Finding:
    name, depth, leg = character.motion.name, character.sinkage, character.motion.leg_length
    return Finding(
        "deep_for_this_walk",
        "warning",
        f"'{name}' sinks {depth * 100:.0f} cm deep, {depth / leg:.0%} of its legs: a walk made for firm ground does "
        "not become wading by being lowered so far, and its knees stay bent.",
        "Choose a firmer or shallower ground, or an animation of somebody who wades.",
        {"character": name, "depth": round(depth, 4), "leg": round(leg, 4)},
    )


def suggested_speeds(motions: Sequence[CharacterMotion], footprints: Sequence[Footprint]) -> dict[str, float]:
    """Speed that people would choose on this ground, over that of level hard ground, by character."""
    return {
        motion.name: round(suggested_speed(mean_sinkage(footprints, motion.name)), 3)
        for motion in motions
        if motion.centre is None
    }
