"""Whether a bake still fits what it was made from: the settings, the ground's mesh, the animation. By hash."""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.files import report
from ..characters.character_setup import ancestors, characters_of, leaders, movers_of, title_of
from ..characters.sole_extraction import meshes_on
from ..compat import SERIES
from ..ground import ground_mesh, painted_ground, playback
from ..ground.baked_ground import carrier_of
from ..properties import SoftGroundCharacter
from . import input_hashes

FINGERPRINTS = "softground_fingerprints"
"""Property of the mesh that carries a bake: what it was made from, as JSON."""

SETTINGS, WRITING, GROUND, SURFACE, PRINTS = "settings", "writing", "ground", "surface", "prints"
ANIMATION, PLACE, MOVEMENT, BODY = "animation", "place", "movement", "body"
VERSION = "version"
_OF_VERSION = (VERSION, SURFACE, MOVEMENT, BODY)
"""What depends on the settings that a version of Blender has: only that version can compare it."""

_NOT_INPUTS = ("file", "scene")
"""Entries of a bake's inputs that may change without the bake changing."""


def store(inputs: Mapping[str, object], scene: bpy.types.Scene, movers: Mapping[str, str] | None = None) -> None:
    """Note with the bake that was just written to the scene's ground what it was made from.

    Parameters
    ----------
    inputs : mapping
        What it was made with.
    scene : bpy.types.Scene
    movers : mapping of str to str, optional
        From `of_movers`, as they were when they were read; without, as they are now.
    """
    mesh = ground_mesh.mesh_of(carrier_of(scene.softground.ground))
    mesh[FINGERPRINTS] = json.dumps(_fingerprints(inputs, scene, of_movers(scene) if movers is None else movers))


def reasons(inputs: Mapping[str, object], scene: bpy.types.Scene) -> tuple[str, ...]:
    """What has changed since the bake on the scene's ground, for the user to read; nothing where there is none.

    Parameters
    ----------
    inputs : mapping
        What a bake would be made with now.
    scene : bpy.types.Scene
        Has a ground.
    """
    ground = scene.softground.ground
    carrier = carrier_of(ground)
    if not ground_mesh.is_baked(carrier):
        return ()
    if edited := next((thing for thing in (ground, carrier, *_bodies_of(scene)) if thing.mode == "EDIT"), None):
        return (f"'{edited.name}' is in Edit Mode",)
    if playback.modifier_of(carrier) is None:
        return (f"'{carrier.name}' has lost its playback, and shows one moment only",)
    try:
        then: dict[str, str] = json.loads(ground_mesh.mesh_of(carrier)[FINGERPRINTS])
        now = _fingerprints(inputs, scene, of_movers(scene))
        left_out = () if then.get(VERSION) == now[VERSION] else _OF_VERSION
        told = (key for key in then if key.partition(":")[0] not in left_out)  # earlier bakes tell of less
        changed = [key for key in told if then[key] != now.get(key)]
    except (KeyError, TypeError, ValueError, AttributeError):
        return ("The bake does not say what it was made from",)
    texts = {
        SETTINGS: "The settings have changed",
        WRITING: "The settings have changed",
        GROUND: f"The mesh or the place of '{ground.name}' has changed",
        SURFACE: f"The modifiers of '{ground.name}', or what is painted on it, have changed",
        PRINTS: f"The mesh of '{carrier.name}' has been edited",
    }
    of_things = {
        ANIMATION: "The animation of '{}' has changed",
        PLACE: "'{}' or a parent of it was moved",
        MOVEMENT: "The rig of '{}', or what it follows, has changed",
        BODY: "The mesh of '{}' that prints has changed",
    }
    kinds = (key.partition(":") for key in changed)
    return tuple(
        dict.fromkeys(texts[kind] if kind in texts else of_things[kind].format(name) for kind, _, name in kinds)
    )


def of_movers(scene: bpy.types.Scene) -> dict[str, str]:
    """Hashes of what the motions of a shot are read from: keys, rigs, what they follow, and the meshes that print."""
    ground, movers = scene.softground.ground, movers_of(scene)
    return {
        **{f"{ANIMATION}:{mover.name}": input_hashes.of_keys(mover) for mover in movers},
        **{f"{PLACE}:{mover.name}": input_hashes.of_place([mover, *ancestors(mover)]) for mover in movers},
        **{f"{MOVEMENT}:{mover.name}": _of_movement(mover, ground) for mover in movers},
        **{f"{BODY}:{title_of(one)}": _of_body(scene, one) for one in characters_of(scene)},
    }


def of_ground(scene: bpy.types.Scene) -> dict[str, str]:
    """Hashes of what the ground of a shot is read from, the same with and without a bake on it; none without ground."""
    ground = scene.softground.ground
    return {GROUND: _of_ground(ground), SURFACE: _of_surface(scene)} if ground else {}


def _fingerprints(inputs: Mapping[str, object], scene: bpy.types.Scene, movers: Mapping[str, str]) -> dict[str, str]:
    options, ground = scene.softground, scene.softground.ground
    return {
        VERSION: SERIES,
        SETTINGS: report.hash_inputs({key: value for key, value in inputs.items() if key not in _NOT_INPUTS}),
        WRITING: f"{options.detail} {options.shape_keys}",
        GROUND: f"{_of_ground(ground)}-{_modifiers_of(ground)}",
        SURFACE: _of_surface(scene),
        PRINTS: input_hashes.of_topology(ground_mesh.mesh_of(carrier_of(ground))),
        **movers,
    }


def _of_ground(ground: bpy.types.Object) -> str:
    mesh = ground_mesh.mesh_of(ground)
    place = np.round(ground_mesh.to_world_of(ground, 1.0), 6) + 0.0  # no negative zeros
    return f"{input_hashes.of_topology(mesh)}-{input_hashes.of_positions(mesh)}-{zlib.crc32(place.tobytes()):08x}"


def _modifiers_of(ground: bpy.types.Object) -> list[str]:
    """The kinds of the ground's modifiers; the playback's counts whether or not it is shown, as a cache may play."""
    own, played = ground_mesh.own_modifiers(ground), playback.modifier_of(ground)
    return [item.type for item in ground.modifiers if item == played or (item.show_viewport and item not in own)]


def _of_surface(scene: bpy.types.Scene) -> str:
    """What the ground's modifiers do, and how its material varies."""
    ground = scene.softground.ground
    keyed = input_hashes.animated_paths_of(ground)
    told = [
        text for modifier in ground_mesh.users_modifiers(ground) for text in input_hashes.of_settings(modifier, keyed)
    ]
    told += filter(None, [input_hashes.of_keys(ground)])
    try:
        painted = [name for name in painted_ground.names_of(scene) if name]
    except InputError as error:
        return str(error)
    told += [input_hashes.of_attribute(ground_mesh.mesh_of(ground), name) for name in painted]
    return input_hashes.joined([*told, input_hashes.of_weights(ground, painted)])


def _of_movement(mover: bpy.types.Object, ground: bpy.types.Object | None) -> str:
    """What moves an object beside its own keys and the places of its parents: its rig, and all that it follows."""
    told = [input_hashes.of_animation(mover)]
    parents = ancestors(mover)
    known = {mover, *((ground, carrier_of(ground)) if ground else ())}
    waiting = [*parents, *leaders(mover)]
    while waiting:
        one = waiting.pop()
        if one in known:
            continue
        known.add(one)
        told += [input_hashes.of_keys(one), input_hashes.of_animation(one)]
        if one not in parents:
            told.append(input_hashes.of_place([one]))
        waiting += [*([one.parent] if one.parent else []), *leaders(one)]
    return input_hashes.joined(sorted(told))


def _bodies_of(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The meshes whose undersides print."""
    characters = characters_of(scene)
    worn = [mesh for one in characters if one.armature for mesh in meshes_on(scene, one.armature)]
    return [*worn, *(sole.object for one in characters for sole in one.soles if sole.object)]


def _of_body(scene: bpy.types.Scene, character: SoftGroundCharacter) -> str:
    """The meshes whose undersides print."""
    bones = {bone for sole in character.soles for bone in (sole.bone, sole.toe_bone) if bone}
    told = []
    for thing in (sole.object for sole in character.soles if sole.object):
        modifiers = (text for modifier in thing.modifiers for text in input_hashes.of_settings(modifier))
        told.append(f"{_of_mesh(thing)} {input_hashes.joined(modifiers)}")
    if character.armature:
        told += [
            f"{_of_mesh(worn)} {worn.parent_bone} {input_hashes.of_weights(worn, bones)} "
            f"{input_hashes.of_place([worn])}"
            for worn in meshes_on(scene, character.armature)
        ]
    return input_hashes.joined(sorted(told))


def _of_mesh(thing: bpy.types.Object) -> str:
    mesh = ground_mesh.mesh_of(thing)
    return f"{input_hashes.of_topology(mesh)} {input_hashes.of_positions(mesh)}"
