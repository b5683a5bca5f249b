"""Comparison of a bake with its inputs, by hash: the settings, the ground's mesh, the animation."""

from __future__ import annotations

import json
import zlib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.files import report
from ...core.settings import DOWN, Acts, BakeSettings, CharacterSettings
from .. import ground_slots, settings
from ..compat import SERIES
from ..ground import baked_ground, ground_mesh, ground_surface, painted_ground
from ..ground.baked_ground import display_mesh_of
from ..ground.still_ground import mover_of
from ..plants import trampling_table
from ..playback import playback, weather_modifier
from ..playback.own_data import BUILD_STAMP
from ..rigs.carried import held_with
from ..rigs.frame_ranges import ancestors, leaders
from ..rigs.worn_rigs import worn_rigs
from ..sampling.body_sampling import meshes_of
from ..sampling.sampling_scene import object_named
from ..sampling.skin_sampling import enveloping, meshes_on
from ..translation import translated
from . import input_hashes

SETTINGS, GROUND, SURFACE, PRINTS = "settings", "ground", "surface", "prints"
ANIMATION, PLACE, MOVEMENT, BODY, SOLE = "animation", "place", "movement", "body", "sole"
HARD = "hard"
BESIDE = "beside"
VERSION = "version"
_OF_MOVERS = (ANIMATION, PLACE, MOVEMENT, BODY, HARD)
_OF_VERSION = (SURFACE, MOVEMENT, BODY, SOLE, HARD, BESIDE)
"""What depends on the settings that a version of Blender has: only that version can compare it."""

_UNKNOWN = "The bake has no record of its settings"
CHANGED = {
    SETTINGS: "The settings have changed",
    GROUND: "The mesh or the position of '{name}' has changed",
    SURFACE: "The modifiers of '{name}', or what is painted on it, have changed",
    PRINTS: "The mesh of '{name}' has been edited",
    ANIMATION: "The animation of '{name}' has changed",
    PLACE: "'{name}' or a parent of it was moved",
    MOVEMENT: "The rig of '{name}', or what it follows, has changed",
    BODY: "The mesh of '{name}' that prints has changed",
    SOLE: "The mesh of '{name}', whose sole presses steps, has changed",
    HARD: "The mesh or the position of '{name}', which is hard ground, has changed",
    BESIDE: "Another ground than '{name}' has changed",
}
"""What is said of each kind of change."""


def store(inputs: Mapping[str, Any], ground: bpy.types.Object, hashes: Mapping[str, str]) -> None:
    """Note with the bake that was just written to a ground what it was made from.

    Parameters
    ----------
    inputs : mapping
        Settings that it was made with, as `BakeSettings.inputs` has them.
    hashes : mapping of str to str
        From `of_movers` and `of_soles`, as they were when they were read.
    """
    stamp = {VERSION: SERIES, **_of_settings(inputs), **_of_bake(ground, inputs["painted"]), **hashes}
    ground_mesh.mesh_of(display_mesh_of(ground))[BUILD_STAMP] = json.dumps(stamp)


def stamp_of(ground: bpy.types.Object) -> str:
    """Stamp stored with a ground's bake: hashes of its inputs; empty if there is none."""
    return str(ground_mesh.mesh_of(display_mesh_of(ground)).get(BUILD_STAMP, ""))


def store_again(ground: bpy.types.Object, stamp: str, painted: Sequence[str], soles: Mapping[str, str]) -> None:
    """Note with a ground's bake what an earlier one of the same inputs was made from, from `stamp_of`.

    `soles` are of the meshes whose soles press steps now, from `of_soles`.
    """
    if stamp:
        noted: dict[str, str] = json.loads(stamp)
        others = {key: value for key, value in noted.items() if not key.startswith(f"{SOLE}:")}
        renewed = others | dict(soles) | _of_bake(ground, painted)
        ground_mesh.mesh_of(display_mesh_of(ground))[BUILD_STAMP] = json.dumps(renewed)


def reasons(ground: bpy.types.Object | None, objects: settings.Objects, wanted: BakeSettings) -> tuple[str, ...]:
    """Changes since the bake on a ground, as texts for the user; none without a bake.

    Parameters
    ----------
    objects : iterable of bpy.types.Object
        Those of the scene.
    wanted : BakeSettings
        What a bake would be made with now.
    """
    deletion = _deletion_of(ground)
    if deletion or wanted.ground is None:
        return deletion
    ground = settings.resolve(wanted.ground)
    display_mesh = display_mesh_of(ground)
    if not ground_mesh.is_baked(display_mesh):
        return ()
    if edited := next((obj for obj in (ground, display_mesh, *bodies_of(objects, wanted)) if obj.mode == "EDIT"), None):
        return (translated("'{name}' is in Edit Mode", name=edited.name),)
    if playback.modifier_of(display_mesh) is None:
        text = "'{name}' has lost its playback modifier, and its prints no longer move"
        return (translated(text, name=display_mesh.name),)
    try:
        then: dict[str, str] = json.loads(ground_mesh.mesh_of(display_mesh)[BUILD_STAMP])
        of_settings = _of_settings(wanted.inputs(Acts.WRITING))
        now = {**of_settings, **_of_bake(ground, wanted.painted), **of_movers(objects, wanted)}
        soles = {key: value for key, value in then.items() if key.startswith(f"{SOLE}:")}
        now |= soles | of_soles(objects, [key.removeprefix(f"{SOLE}:") for key in soles])  # those that are gone last
        left_out = () if then.pop(VERSION, "") == SERIES else _OF_VERSION
        changed = [(kind, name) for kind, name in _changes(then, now) if kind not in left_out]
    except (KeyError, TypeError, ValueError, AttributeError, RecursionError):
        return (translated(_UNKNOWN),)
    named = {GROUND: ground.name, SURFACE: ground.name, BESIDE: ground.name, PRINTS: display_mesh.name}
    texts = [translated(CHANGED.get(kind, _UNKNOWN), name=named.get(kind, name)) for kind, name in changed]
    return tuple(dict.fromkeys(texts))


def _changes(then: Mapping[str, str], now: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Kind and present name of each hash that is another now, of those that were noted."""
    current = _in_order(now)
    for place, (name, value) in _in_order(then).items():
        new_name, new_value = current.get(place, (name, None))
        if value != new_value:
            yield place[0], new_name


def _in_order(hashes: Mapping[str, str]) -> dict[tuple[str, str], tuple[str, str]]:
    """Hashes with the names that they are under: by kind, and by place among those of the kind, as movers may have been
    renamed; else by name."""
    ordered: dict[tuple[str, str], tuple[str, str]] = {}
    count = Counter[str]()
    for key, value in hashes.items():
        kind, _, name = key.partition(":")
        ordered[kind, str(count[kind]) if kind in _OF_MOVERS else name] = name, value
        count[kind] += 1
    return ordered


def _deletion_of(ground: bpy.types.Object | None) -> tuple[str, ...]:
    if ground is None or not baked_ground.is_deleted(ground):
        return ()
    text = (
        "The copy of '{name}' that shows the prints was deleted" if settings.exists(ground) else "'{name}' was deleted"
    )
    return (translated(text, name=ground.name),)


def of_movers(objects: settings.Objects, wanted: BakeSettings) -> dict[str, str]:
    """Hashes of what the motions of a shot are read from: keys, rigs, what they follow, the meshes that print, and what
    bears them beside the ground."""
    ground = settings.resolve(wanted.ground) if wanted.ground else None
    movers, shared = [obj for character in wanted.characters for obj in movers_of(character)], input_hashes.Shared()
    return {
        **{f"{ANIMATION}:{mover.name}": input_hashes.of_keys(mover, shared) for mover in movers},
        **{f"{PLACE}:{mover.name}": input_hashes.of_place([mover, *ancestors(mover)]) for mover in movers},
        **{f"{MOVEMENT}:{mover.name}": _of_movement(mover, ground, shared) for mover in movers},
        **{f"{BODY}:{character.name}": _of_body(objects, character, shared) for character in wanted.characters},
        **{f"{HARD}:{name.name}": _of_hard(settings.resolve(name)) for name in wanted.hard_grounds},
        **({BESIDE: _of_others(wanted)} if wanted.grounds else {}),
    }


def _of_others(wanted: BakeSettings) -> str:
    """Hash of the further grounds, whichever of all is the first now."""
    others = [(settings.resolve(further.ground), further.painted) for further in wanted.grounds]
    return input_hashes.joined(sorted(f"{_of_ground(obj)}{_of_surface(obj, painted)}" for obj, painted in others))


def _of_hard(obj: bpy.types.Object) -> str:
    modifiers = (text for modifier in obj.modifiers for text in input_hashes.of_settings(modifier))
    return input_hashes.joined([_of_ground(obj), *modifiers])


def of_soles(objects: settings.Objects, names: Iterable[str]) -> dict[str, str]:
    """Hashes of the meshes whose soles press edited steps, of those that are there; where they stand does not count."""
    wanted = set(names)
    named = [obj for obj in objects if obj.name_full in wanted and obj.type == "MESH"] if wanted else []
    return {f"{SOLE}:{obj.name_full}": _of_sole(obj) for obj in named}


def _of_sole(obj: bpy.types.Object) -> str:
    matrix = ground_surface.placed_by_parents(obj)
    turned = np.round(np.array(obj.matrix_world if matrix is None else matrix)[:3, :3], 5) + 0.0
    modifiers = (text for modifier in obj.modifiers for text in input_hashes.of_settings(modifier))
    return input_hashes.joined([_of_mesh(obj), *modifiers, f"{zlib.crc32(turned.tobytes()):08x}"])


def of_ground(wanted: BakeSettings) -> dict[str, str]:
    """Hashes of what the ground of a shot is read from, the same with and without a bake on it; none without ground."""
    if wanted.ground is None:
        return {}
    ground = settings.resolve(wanted.ground)
    return {GROUND: _of_ground(ground), SURFACE: _of_surface(ground, wanted.painted)}


def _of_settings(inputs: Mapping[str, Any]) -> dict[str, str]:
    """A hash of each setting; what has only been renamed is the same."""
    nameless = [
        {**character, "name": "", "armature": bool(character["armature"])}
        | {"soles": [{**sole, "object": bool(sole["object"])} for sole in character["soles"]]}
        | ({"body": True} if "body" in character else {})
        for character in inputs["characters"]
    ]
    unsaid = {
        "marks": True,
        "carried": (1.0, 1.0),
        "carve": True,
        "hard_grounds": (),
        "wet_grounds": (),
        "regions": (),
        "gravity_direction": DOWN,
        "under": "AUTO",
        "grounds": (),
    }
    whole: dict[str, Any] = unsaid | dict(inputs)
    further = sorted(report.hash_inputs({**ground, "ground": ""}) for ground in whole["grounds"])
    compared = whole | {"ground": "", "characters": nameless, "hard_grounds": len(whole["hard_grounds"])}
    compared["grounds"] = further
    return {f"{SETTINGS}:{name}": report.hash_inputs(value) for name, value in compared.items()}


def _of_bake(ground: bpy.types.Object, painted: Sequence[str]) -> dict[str, str]:
    """Hashes of a ground with a bake on it."""
    return {
        GROUND: f"{_of_ground(ground)}-{_modifiers_of(ground)}",
        SURFACE: _of_surface(ground, painted),
        PRINTS: input_hashes.of_topology(ground_mesh.mesh_of(display_mesh_of(ground))),
    }


def _of_ground(ground: bpy.types.Object) -> str:
    mesh = ground_mesh.mesh_of(ground)
    return f"{input_hashes.of_topology(mesh)}-{input_hashes.of_positions(mesh)}-{_of_standing(ground)}"


def _of_standing(ground: bpy.types.Object) -> str:
    """Hash of the place of the ground, without evaluating the scene: that calls the handlers, which ask this."""
    matrix = ground_surface.placed_by_parents(ground)
    if matrix is None or mover_of(ground):
        return f"{input_hashes.of_place([ground, *ancestors(ground)])}{_of_movement(ground, None)}"
    place = np.round(np.array(matrix, dtype=np.float64), 6) + 0.0  # no negative zeros
    return f"{zlib.crc32(place.tobytes()):08x}"


def _modifiers_of(ground: bpy.types.Object) -> list[str]:
    """The kinds of the ground's modifiers; the playback's counts whether or not it is shown, what follows it never."""
    played, weather = playback.modifier_of(ground), weather_modifier.modifier_of(ground)
    after = (weather, trampling_table.modifier_of(ground))
    return [
        modifier.type
        for modifier in ground.modifiers
        if modifier == played or (modifier.show_viewport and modifier not in after)
    ]


def _of_surface(ground: bpy.types.Object, painted: Sequence[str]) -> str:
    """Hash of the ground's modifiers, and of the variation of its material."""
    keyed = input_hashes.animated_paths_of(ground)
    parts = [
        text for modifier in ground_mesh.users_modifiers(ground) for text in input_hashes.of_settings(modifier, keyed)
    ]
    parts += filter(None, [input_hashes.of_keys(ground)])
    try:
        names = [name for name in painted_ground.names_of(ground, painted) if name]
    except InputError as error:
        return str(error)
    parts += [input_hashes.of_attribute(ground_mesh.mesh_of(ground), name) for name in names]
    if any(ground_slots.naming(ground)):
        parts += [f"{zlib.crc32(ground_slots.of_faces(ground_mesh.mesh_of(ground)).data):08x}"]
    return input_hashes.joined([*parts, input_hashes.of_weights(ground, names)])


def _of_movement(
    mover: bpy.types.Object, ground: bpy.types.Object | None, shared: input_hashes.Shared | None = None
) -> str:
    """Hash of what moves an object besides its keys and its parents: its rig, and all that it follows."""
    parents = ancestors(mover)
    known = {mover, *((ground, display_mesh_of(ground)) if ground else ())}
    # All of these are compared by themselves: here it counts only which is followed.
    blocks: input_hashes.Known = {obj: str(n) for n, obj in enumerate((mover, *parents, *([ground] if ground else ())))}
    parts = [input_hashes.of_animation(mover, blocks, shared)]
    waiting = [*parents, *leaders(mover)]
    while waiting:
        obj = waiting.pop()
        if obj in known:
            continue
        known.add(obj)
        parts += [input_hashes.of_keys(obj, shared), input_hashes.of_animation(obj, blocks, shared)]
        if obj not in parents:
            parts.append(input_hashes.of_place([obj]))
        waiting += [*([obj.parent] if obj.parent else []), *leaders(obj)]
    return input_hashes.joined(sorted(parts))


def movers_of(character: CharacterSettings) -> list[bpy.types.Object]:
    """The armature, or the body with its meshes, and the objects of a character."""
    owner = character.armature or character.body
    owners = [settings.resolve(owner)] if owner else []
    parts = [part for part in _worn_by_body(character) if part not in owners]
    return [*owners, *parts, *_props_of(character)]


def _props_of(character: CharacterSettings) -> list[bpy.types.Object]:
    """The objects that print as soles of a character."""
    return [object_named(sole.object) for sole in character.soles if sole.object]


def _worn_by(objects: settings.Objects, character: CharacterSettings) -> list[bpy.types.Object]:
    return meshes_on(objects, settings.resolve(character.armature)) if character.armature else _worn_by_body(character)


def _worn_by_body(character: CharacterSettings) -> list[bpy.types.Object]:
    return meshes_of(settings.resolve(character.body)) if character.body else []


def bodies_of(objects: settings.Objects, wanted: BakeSettings) -> list[bpy.types.Object]:
    """The meshes whose undersides print."""
    return [obj for character in wanted.characters for obj in (*_worn_by(objects, character), *_props_of(character))]


def _of_body(objects: settings.Objects, character: CharacterSettings, shared: input_hashes.Shared | None = None) -> str:
    """The meshes whose undersides print."""
    bones = {bone for sole in character.soles for bone in (sole.bone, sole.toe_bone) if bone}
    parts = []
    for obj in _props_of(character):
        modifiers = (text for modifier in obj.modifiers for text in input_hashes.of_settings(modifier))
        parts.append(f"{_of_mesh(obj)} {input_hashes.joined(modifiers)}")
    body = settings.resolve(character.armature) if character.armature else None
    rigs = [body, *worn_rigs(objects, body)] if body else []
    for worn in _worn_by(objects, character):
        nodes = next(filter(None, (held_with(worn, rig) for rig in rigs)), [worn])
        known: input_hashes.Known = dict.fromkeys(rigs[:1], "")  # it is compared by itself
        held = (each for node in nodes if rigs for each in node.constraints)
        texts = [text for each in held for text in input_hashes.of_settings(each, (), dict(known))]
        texts += [input_hashes.of_envelope(bone) for rig in rigs for bone in enveloping(worn, rig)]
        parts.append(
            f"{_of_mesh(worn)} {nodes[-1].parent_bone} {input_hashes.of_weights(worn, bones, shared)} "
            f"{input_hashes.of_place(nodes)}{input_hashes.of_shapes(worn)}{' '.join(texts)}"
        )
    for rig in rigs[1:]:
        nodes = held_with(rig, rigs[0]) or [rig]
        parts.append(f"{input_hashes.of_animation(rig, {}, shared)} {input_hashes.of_place(nodes)}")
    return input_hashes.joined(sorted(parts))


def _of_mesh(obj: bpy.types.Object) -> str:
    mesh = ground_mesh.mesh_of(obj)
    return f"{input_hashes.of_topology(mesh)} {input_hashes.of_positions(mesh)}"
