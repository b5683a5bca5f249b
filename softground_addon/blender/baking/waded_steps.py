"""The steps by which a character has waded, for what clings to its legs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import bpy

from ...core.errors import InputError
from ...core.settings import ObjectName
from .. import settings
from ..carried import clinging
from ..ground import baked_ground
from ..nodes.node_modifiers import modifier_with
from ..playback.playback import barrier_on
from ..sampling.skin_sampling import meshes_on


def cling(scene: bpy.types.Scene, character: Any) -> int:
    """Let what a character waded in cling to its meshes; their number.

    Raises
    ------
    InputError
        If it deforms none.
    """
    armature = character.armature
    every, soles = meshes_on(scene.objects, armature), _soles_of(character)
    meshes = [obj for obj in every if not (obj.library or obj.parent_type == "BONE" or barrier_on(obj))]
    if not (meshes and soles):
        raise InputError(f"'{armature.name}' deforms no mesh that stands on its bones.")
    clinging.cling(settings.units_of(scene), armature, soles, meshes, _steps(scene.softground, armature, soles))
    return len(meshes)


def follow(name: ObjectName) -> None:
    """Bring what clings to the characters of a scene up to date with the bakes of all grounds."""
    scene = settings.scene_with(name.uid)
    if scene is None or not any(map(clinging.is_clinging, bpy.data.node_groups)):
        return
    for character in scene.softground.characters:
        armature = character.armature
        every = meshes_on(scene.objects, armature) if armature else ()
        meshes = [obj for obj in every if modifier_with(obj, clinging.is_clinging)]
        if meshes and (soles := _soles_of(character)):
            clinging.cling(settings.units_of(scene), armature, soles, meshes, _steps(scene.softground, armature, soles))


def _soles_of(character: Any) -> list[Any]:
    return [sole for sole in character.soles if sole.bone in character.armature.data.bones]


def _steps(options: Any, armature: bpy.types.Object, soles: Sequence[Any]) -> Iterator[clinging.Step]:
    """The steps of some soles of a character on all grounds."""
    names = [sole.name for sole in soles]
    baked = (ground for ground in settings.grounds_of(options) if baked_ground.is_baked(ground))
    for record in map(baked_ground.record_of, baked):
        stretch = baked_ground.units_of(record.about["inputs"]).time_stretch
        for step in record.edited:
            if step.character == armature.name and step.sole in names:
                middle = (step.start_frame + step.end_frame) / 2 * stretch
                yield names.index(step.sole), middle, step.max_depth_m
