"""The characters' side of a bake: checks that their rigs can respond as the settings ask, and the layers that do it."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np

from ...core.composers.responses import CharacterResponse, worst_gaps
from ...core.errors import InputError
from ...core.findings import Finding
from ...core.response.performance import suggested_speed
from ...core.settings import BakeSettings, CharacterSettings
from .. import settings
from ..animation_layer.constraint_layer import (
    LayerKind,
    check_layerable,
    has_layer,
    put_layer,
    remove_layer,
    set_strength,
)
from ..animation_layer.layer_curves import LayerCurve
from ..jobs import Job, counted
from ..placement import world_matrix
from .character_keys import ReadRig, controls_of, mapping_with_legs, response_curves

ROUNDED = 2e-3
"""Rounding of places from which feet would jump about, in units of the armature."""

SHARE_OF_WRITING = 0.1
"""Part of a bake's last stage in which the layers are worked out."""


@dataclass(frozen=True)
class Layer:
    """One character's keys, and the panel's notes on them."""

    curves: list[LayerCurve]
    notes: dict[str, str]


def rigged(characters: Iterable[CharacterSettings]) -> list[tuple[CharacterSettings, bpy.types.Object]]:
    """Characters that can respond to the ground, with their armatures: props without a rig cannot."""
    return [(each, settings.resolve(each.armature)) for each in characters if each.armature]


def check_characters(characters: Iterable[CharacterSettings]) -> None:
    """Raise InputError, naming the remedy, where a character can take no layer."""
    for _, armature in rigged(characters):
        check_layerable(armature)
        far = float(np.abs(world_matrix(armature)[:3, 3]).max())
        if (step := float(np.spacing(np.float32(far)))) > ROUNDED * armature.matrix_world.median_scale:
            raise InputError(
                f"'{armature.name}' is so far from the world's origin that Blender rounds what constraints do to its "
                f"bones to {step:.2g} units: move the shot to the origin, and the feet can be put on the ground."
            )


def _refusal(view_layer: bpy.types.ViewLayer, characters: Sequence[CharacterSettings]) -> str:
    """Reason why a layer cannot let feet down, with the remedy; empty if it can."""
    try:
        check_characters(characters)
        for character, armature in rigged(characters):
            controls_of(view_layer, armature, mapping_with_legs(character))
    except InputError as error:
        return str(error)
    return ""


def without_sinking(view_layer: bpy.types.ViewLayer, wanted: BakeSettings) -> tuple[BakeSettings, list[Finding]]:
    """The settings without the layer that lowers feet, where a rig cannot take it, and the finding about it.

    Raises InputError if another response is wanted.
    """
    if wanted.response is None or wanted.output == "PRINTS":
        return wanted, []
    if not wanted.sink_feet or wanted.output != "BOTH" or wanted.response.tilt:
        check_characters(wanted.characters)
        return wanted, []
    why = _refusal(view_layer, wanted.characters)
    if not why:
        return wanted, []
    said = Finding(
        "feet_not_sunk", "note", f"Feet were not lowered into their prints. {why}", "Or switch Sink Feet off."
    )
    return replace(wanted, response=None), [said]


SOURCE = "softground_source"
"""Property of an action with a response in its keys: name of the action that it was made from."""


def keyed_responses(wanted: BakeSettings) -> list[Finding]:
    """Warnings that characters play keys in which a response is already, and would respond twice."""
    return [
        Finding(
            "response_in_keys",
            "warning",
            f"'{armature.name}' plays '{action.name}', whose feet are in the prints of an earlier bake already.",
            f"Assign {repr(action[SOURCE]) if action[SOURCE] else 'the animation without them'} and bake again.",
        )
        for _, armature in rigged(wanted.characters)
        if armature.animation_data and (action := armature.animation_data.action) and SOURCE in action.keys()  # noqa: SIM118
    ]


def layers_of(
    wanted: BakeSettings,
    rigs: Sequence[ReadRig],
    responses: Sequence[CharacterResponse],
    *,
    accuracy: float = 1.0,
) -> Job[list[Layer]]:
    """The keys of each character's layer, of rigs as they were read; none without responses."""
    layers: list[Layer] = []
    names = [each.armature for each in wanted.characters if each.armature]
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
"""Note of the frames where a gap remains, as JSON."""


def speed_in(notes: Mapping[str, str]) -> float:
    """The suggested speed in the notes of a layer; 1 where none is noted, or something else."""
    try:
        speed = float(notes[SPEED])
    except (KeyError, ValueError):
        return 1.0
    return speed if 0.01 <= speed <= 10.0 else 1.0


def worst_gaps_in(notes: Mapping[str, str]) -> list[tuple[float, float, str]]:
    """Frame, gap [mm] and sole of the remaining gaps in the notes of a layer; nothing if the note is damaged."""
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


def put_layers(
    options: Any, wanted: BakeSettings, layers: Sequence[Layer], kind: LayerKind = LayerKind.RESPONSE
) -> None:
    """Put each character's layer in the place of an earlier one; take that off where there is none now."""
    for number, (_, armature) in enumerate(rigged(wanted.characters)):
        if number < len(layers) and layers[number].curves:
            show_layer(options, armature, kind, layers[number])
        else:
            remove_layer(armature, kind)


def show_layer(options: Any, armature: bpy.types.Object, kind: LayerKind, layer: Layer) -> None:
    """Put a layer on an armature, as strong as its character has it."""
    put_layer(armature, kind, layer.curves, layer.notes)
    for character in options.characters:
        if character.armature == armature:
            set_strength(armature, kind, settings.typed(getattr(character, kind.strength)))
    options.has_layers |= kind in BAKED


BAKED = (LayerKind.CLEAN_FEET, LayerKind.RESPONSE)
"""Layers that Clear Bake removes: root motion is a part of the animation."""


def has_layers(options: Any) -> bool:
    """True if an armature of the scene may have a layer that Clear Bake removes; quick enough for `poll`."""
    armatures = (each.armature for each in options.characters if each.armature)
    return options.has_layers or any(has_layer(armature, kind) for armature in armatures for kind in BAKED)


def remove_layers(scene: bpy.types.Scene, *kinds: LayerKind) -> None:
    """Take layers of these kinds off all armatures of the scene, also of those that are no characters any more."""
    armatures = [obj for obj in scene.objects if obj.type == "ARMATURE" and obj.library is None]
    removed = [remove_layer(armature, kind) for armature in armatures for kind in kinds]
    scene.softground.has_layers = any(has_layer(armature, kind) for armature in armatures for kind in BAKED)
    for view_layer in scene.view_layers if any(removed) else ():  # Blender goes through all objects for it
        view_layer.update()
