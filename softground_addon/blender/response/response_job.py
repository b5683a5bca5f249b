"""The characters' side of a bake: whether their rigs can take what the settings ask for, and the layers that do it."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import bpy

from ...core.composers.responses import CharacterResponse, worst_gaps
from ...core.errors import InputError
from ...core.findings import Finding
from ...core.response.performance import suggested_speed
from ...core.rig.mapping import RigMapping
from ...core.settings import BakeSettings, CharacterSettings
from .. import settings
from ..animation_layer import nla_layer
from ..jobs import Job, counted
from .character_keys import ReadRig, controls_of, response_curves

SHARE_OF_WRITING = 0.1
"""Part of a bake's last stage in which the layers are worked out."""


@dataclass(frozen=True)
class Layer:
    """One character's keys, and what the panel says of them."""

    curves: list[nla_layer.LayerCurve]
    notes: dict[str, str]


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
