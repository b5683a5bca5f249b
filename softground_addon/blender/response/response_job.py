"""The characters' side of a bake: what the settings ask for, the response to the pressed ground, and its layer."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.errors import InputError
from ...core.findings import Finding
from ...core.ground.heightfield import Terrain
from ...core.loads.estimate import CharacterLoads
from ...core.motion.motion import CharacterMotion
from ...core.record.footprints import Footprint
from ...core.record.record import BakeRecord
from ...core.response.grounding import Response, responding
from ...core.response.moved_steps import Followed, OutOfReach, follow
from ...core.response.performance import suggested_speed
from ...core.response.response import (
    Gaps,
    at_scene_frames,
    gaps,
    mean_sinkage,
    respond,
    stood_on,
)
from ...core.rig.mapping import RigMapping
from ...core.settings import BakeSettings, CharacterSettings, ResponseOptions
from .. import settings
from ..animation_layer import nla_layer
from ..jobs import Job, Progress, counted, meanwhile
from .character_keys import ReadRig, controls_of, response_curves

NOTICEABLE_LEAN = np.radians(0.25)
"""A body that leans no more than this moves its centre of mass by millimetres: the forces need not be found anew."""
LEAN_PASSES = 4
"""Most times that the ground is pressed anew by the leaning bodies. The lean of a frame follows from the ground before
it, so that each pass makes the shot right further on (Picard iteration); two are mostly enough."""

SHARE_OF_WRITING = 0.1
"""Part of a bake's last stage in which the layers are worked out."""


@dataclass(frozen=True)
class Layer:
    """One character's keys, and what the panel says of them."""

    curves: list[nla_layer.LayerCurve]
    notes: dict[str, str]


@dataclass(frozen=True)
class CharacterResponse:
    """One character's response and what it did for its feet.

    Attributes
    ----------
    motion : CharacterMotion
        The source, at scene frames.
    response : Response
    before, after : Gaps
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


def rigged(characters: Iterable[CharacterSettings]) -> list[tuple[CharacterSettings, bpy.types.Object]]:
    """Those that can respond to the ground, with their armatures: props without a rig cannot."""
    return [(one, settings.found(one.armature)) for one in characters if one.armature]


def check_characters(characters: Iterable[CharacterSettings]) -> None:
    """Raise InputError, naming the remedy, where a character can take no layer."""
    for _, armature in rigged(characters):
        nla_layer.check_layerable(armature)


def _refusal(scene: bpy.types.Scene, characters: Sequence[CharacterSettings]) -> str:
    """Why feet cannot be let down by a layer, and what to do; empty where they can."""
    try:
        check_characters(characters)
        for one, armature in rigged(characters):
            controls_of(scene, armature, RigMapping(one.joints, one.soles, "settings"))
    except InputError as error:
        return str(error)
    return ""


def without_sinking(scene: bpy.types.Scene, wanted: BakeSettings) -> tuple[BakeSettings, list[Finding]]:
    """The settings without the layer that lets feet down, where a rig cannot take it; the finding that says so."""
    if not wanted.sink_feet or wanted.output != "BOTH" or wanted.response is None or wanted.response.tilt:
        return wanted, []
    why = _refusal(scene, wanted.characters)
    if not why:
        return wanted, []
    said = Finding(
        "feet_not_sunk", "note", f"Feet were not lowered into their prints. {why}", "Or switch Sink Feet off."
    )
    return replace(wanted, response=None), [said]


def standing_on(
    motions: Sequence[CharacterMotion], terrain: Terrain, options: ResponseOptions | None
) -> Job[tuple[CharacterMotion, ...]]:
    """The motions as they will walk on the terrain, which is where they press it."""
    if options is None or options.grounding is None:
        return tuple(motions)
    standing = []
    for motion in motions:
        as_it_is = motion.centre is not None
        work = stood_on.slices(motion, terrain)
        standing.append(motion if as_it_is else (yield from meanwhile(Progress("sample", 1.0), work)))
    return tuple(standing)


@dataclass(frozen=True)
class Leaning:
    """The motions with the lean that the pressed ground gives them, and by how much each leans, (F, 2) [rad]."""

    motions: tuple[CharacterMotion, ...]
    leans: tuple[NDArray[np.float64], ...]


def leaning(
    loads: Sequence[CharacterLoads],
    motions: Sequence[CharacterMotion],
    terrain: Terrain,
    footprints: Sequence[Footprint],
    options: ResponseOptions | None,
) -> Job[Leaning]:
    """The motions with the lean that the pressed ground gives them, for the forces to see; empty without a tilt."""
    moved, leans = [], []
    if options is not None and options.tilt is not None:
        for of_character, motion in zip(loads, motions, strict=True):
            if motion.centre is not None:
                moved.append(motion)
                leans.append(np.zeros((len(motion.frames), 2)))
                continue
            touching = at_scene_frames(of_character.contacts.touching, of_character.motion.frames, motion)
            work = respond.slices(motion, touching, terrain, footprints, tilt=options.tilt, grounding=None)
            response = yield from meanwhile(Progress("simulate", 1.0), work)
            moved.append(responding(motion, response))
            leans.append(response.lean)
    return Leaning(tuple(moved), tuple(leans))


def leans_anew(now: Leaning, before: Leaning | None) -> bool:
    """Whether a lean differs from the one that pressed the ground by so much that the forces must be found anew."""
    then = before.leans if before is not None else [np.zeros(2)] * len(now.leans)
    return any(float(np.abs(lean - was).max()) > NOTICEABLE_LEAN for lean, was in zip(now.leans, then, strict=True))


def responses_of(
    loads: Sequence[CharacterLoads],
    motions: Sequence[CharacterMotion],
    terrain: Terrain,
    left: BakeRecord,
    options: ResponseOptions | None,
) -> Job[list[CharacterResponse]]:
    """Each rigged character's response to the pressed ground, on top of its source; its feet follow moved steps."""
    responses: list[CharacterResponse] = []
    now = Progress("simulate", 1.0)
    if options is None:
        return responses
    for of_character, motion in zip(loads, motions, strict=True):
        if motion.centre is not None:
            continue
        touching = at_scene_frames(of_character.contacts.touching, of_character.motion.frames, motion)
        pressed = touching, terrain, left.edited
        followed = follow(motion, touching, left.footprints, left.edits) if options.grounding else Followed()
        work = respond.slices(motion, *pressed, tilt=options.tilt, grounding=options.grounding, followed=followed)
        response = yield from meanwhile(now, work)
        before = yield from meanwhile(now, gaps.slices(motion, *pressed))
        after = yield from meanwhile(now, gaps.slices(responding(motion, response), *pressed))
        sinkage = mean_sinkage(left.edited, motion.name)
        responses.append(CharacterResponse(motion, response, before, after, sinkage, followed.out_of_reach))
    return responses


def layers_of(
    wanted: BakeSettings,
    rigs: Sequence[ReadRig],
    responses: Sequence[CharacterResponse],
    *,
    accuracy: float = 1.0,
) -> Job[list[Layer]]:
    """The keys of each character's layer, of rigs as they were read; none without responses."""
    layers: list[Layer] = []
    names = [one.armature for one in wanted.characters if one.armature]
    for number, (name, rig, character) in enumerate(zip(names, rigs, responses, strict=False)):
        work = response_curves(
            name,
            rig,
            character.motion,
            character.response,
            metre=wanted.unit_scale_m,
            stretch=wanted.time_stretch,
            accuracy=accuracy,
        )
        count, parts = len(rig.controls), len(responses)
        curves = yield from counted(work, "write", count, part=number, parts=parts, share=SHARE_OF_WRITING)
        layers.append(Layer(curves, _notes(rig.controls[0].bone, character)))
    return layers


ROOT_CONTROL = "softground_carrier"
"""Note of the bone that carries the body."""
SPEED = "softground_suggested_speed"
"""Note of the speed that people would choose on this ground, over that on hard ground."""
WORST = "softground_worst_gaps"
"""Note of the frames where a gap is left, as JSON."""


def speed_in(notes: Mapping[str, str]) -> float:
    """The suggested speed in the notes of a layer; 1 where none is noted, or something else."""
    try:
        speed = float(notes[SPEED])
    except (KeyError, ValueError):
        return 1.0
    return speed if 0.01 <= speed <= 10.0 else 1.0


def worst_gaps_in(notes: Mapping[str, str]) -> list[tuple[float, float, str]]:
    """Frame, gap [mm] and sole of what is noted with a layer as left; nothing where something else is noted."""
    try:
        gaps = json.loads(notes[WORST])
        return [(float(gap["frame"]), float(gap["gap_mm"]), str(gap["contact"])) for gap in gaps]
    except (KeyError, ValueError, TypeError, OverflowError, RecursionError):
        return []


def _notes(root_control: str, character: CharacterResponse) -> dict[str, str]:
    return {
        ROOT_CONTROL: root_control,
        WORST: json.dumps(worst_gaps([character])),
        SPEED: f"{suggested_speed(character.sinkage):.3f}",
    }


def put_layers(scene: bpy.types.Scene, wanted: BakeSettings, layers: Sequence[Layer]) -> None:
    """Put each character's layer in the place of the one of an earlier bake; take that off where there is none now."""
    start, end = (frame * wanted.time_stretch for frame in wanted.frames)
    for number, (_, armature) in enumerate(rigged(wanted.characters)):
        if number < len(layers) and layers[number].curves:
            nla_layer.add_layer(armature, layers[number].curves, (start, end), layers[number].notes)
            for shown in scene.softground.characters:  # how much of it shows is told at any time, and not by a bake
                if shown.armature == armature:
                    nla_layer.set_strength(armature, settings.typed(shown.response_strength))
            scene.softground.has_layers = True
        else:
            nla_layer.remove_layer(armature)


def remove_layers(scene: bpy.types.Scene) -> bool:
    """Take the layers off all armatures of the scene; whether there was one."""
    layered = list(_layered(scene))
    for armature in layered:
        nla_layer.remove_layer(armature)
    scene.softground.has_layers = False
    for layer in scene.view_layers:
        layer.update()
    return bool(layered)


def has_layers(scene: bpy.types.Scene) -> bool:
    """Whether any armature of the scene may have a layer; quick enough for `poll`."""
    options = scene.softground
    armatures = (one.armature for one in options.characters if one.armature)
    return options.has_layers or any(map(nla_layer.has_layer, armatures))  # files of 0.1 have no note of it


def _layered(scene: bpy.types.Scene) -> Iterator[bpy.types.Object]:
    """Armatures with a layer: of characters, and of what was one when it was baked."""
    armatures = (obj for obj in scene.objects if obj.type == "ARMATURE" and obj.library is None)
    return (armature for armature in armatures if nla_layer.has_layer(armature))


def gap_table(responses: Sequence[CharacterResponse]) -> dict[str, object] | None:
    """Penetration and float of the standing soles before and after [mm], for the report; None without a response."""
    if not responses:
        return None
    return {
        when: {character.motion.name: _statistics(getattr(character, when)) for character in responses}
        for when in ("before", "after")
    }


def gaps_left(
    loads: Sequence[CharacterLoads],
    motions: Sequence[CharacterMotion],
    terrain: Terrain,
    footprints: Sequence[Footprint],
) -> Job[dict[str, object]]:
    """Penetration and float of the standing soles of characters that do not respond [mm], for the report."""
    table = {}
    for of_character, motion in zip(loads, motions, strict=True):
        touching = at_scene_frames(of_character.contacts.touching, of_character.motion.frames, motion)
        left = yield from meanwhile(Progress("write", 0.0), gaps.slices(motion, touching, terrain, footprints))
        table[motion.name] = _statistics(left)
    return {"before": table, "after": table}


def floating_mm(gaps_mm: Mapping[str, Any]) -> float:
    """How far feet float above their prints, apart from a few frames [mm], of a report's gaps."""
    left = gaps_mm.get("after", gaps_mm["before"])
    return max((of_character["float"]["p95"] for of_character in left.values()), default=0.0)


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


def findings(responses: Sequence[CharacterResponse]) -> list[Finding]:
    """What the user should know about the responses."""
    without_legs = [
        Finding(
            "no_legs",
            "warning",
            f"'{character.motion.name}' has no leg with hip, knee and ankle: only its body responds.",
            "Complete its joints in Advanced > Body Bones.",
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
        )
        for character in responses
        for short in character.out_of_reach
    ]
    return without_legs + too_far


def suggested_speeds(motions: Sequence[CharacterMotion], footprints: Sequence[Footprint]) -> dict[str, float]:
    """Speed that people would choose on this ground, over that of level hard ground, by character."""
    return {
        motion.name: round(suggested_speed(mean_sinkage(footprints, motion.name)), 3)
        for motion in motions
        if motion.centre is None
    }
