"""Rigs and objects that print, from what a user has selected, or from all of a scene."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from typing import Any

import bpy

from ...core.errors import InputError
from .. import jobs
from ..rigs.frame_ranges import ancestors, leaders
from ..rigs.rig_mapping import instances_armature, parts_of, require_armature
from ..rigs.worn_rigs import is_worn
from ..sampling.body_sampling import deforms
from ..sampling.instances import crowd_finding, instancers
from ..sampling.rig_checks import is_animated
from ..sampling.rig_recording import is_simulated
from ..sampling.skin_sampling import has_skin
from ..settings import Objects
from .character_setup import add_character, adding_body


def chosen(
    scene: bpy.types.Scene, active: bpy.types.Object | None, selected: Iterable[bpy.types.Object]
) -> tuple[list[bpy.types.Object], list[bpy.types.Object]]:
    """Armatures, or empties above figures without one, and other objects that are to be added to a scene's characters.

    Where what is selected neither is a rig nor moves, such as a camera or Blender's first cube, the one rig of the
    scene that does is meant.

    Raises
    ------
    InputError
        If there is nothing to add.
    """
    picked = list(dict.fromkeys(obj for obj in (active, *selected) if obj is not None))
    known = {character.armature for character in scene.softground.characters}
    rigs = _skin_rigs(scene.objects, [rig for obj in picked for rig in _rigs_of(obj, known)])
    if not rigs:
        _check_no_crowd(scene, picked)
    fresh = [rig for rig in rigs if rig not in known]
    props = [obj for obj in picked if obj.type == "MESH" and not _rigs_of(obj, known)]
    moving = [obj for obj in props if moves(obj)]
    if rigs and (not moving or (active is not None and _rigs_of(active, known))):
        return fresh or rigs[:1], []
    if fresh or moving:
        return fresh, moving if fresh else props
    walkers = [rig for rig in walkers_of(scene.objects) if rig not in known]
    if bodies := [obj for obj in picked if is_body(obj)]:
        return bodies, []
    if len(walkers) == 1:
        return walkers, []
    if not props:
        if len(walkers) > 1:
            raise InputError(f"Several rigs move here ({_names(walkers)}): select those that walk.")
        require_armature(active)
    return [], props


def is_body(obj: bpy.types.Object) -> bool:
    """True of an empty above mesh objects that move without an armature: they may be a figure."""
    return any(moves(part) and not is_simulated(part) for part in parts_of(obj))


def _check_no_crowd(scene: bpy.types.Scene, picked: Sequence[bpy.types.Object]) -> None:
    """Raise InputError where an object shows figures that have no rig of their own."""
    bodies = [obj for obj in scene.objects if obj.type == "MESH" and obj not in picked and obj.find_armature()]
    showing = instancers(scene, bodies)
    for obj in picked:
        if obj.name in showing:
            raise InputError(crowd_finding([obj.name], showing[obj.name]).text)


def shows_nobody(selected: Sequence[bpy.types.Object]) -> bool:
    """True if the selection names no character to add: nothing, a camera, or Blender's first cube alone."""
    if len(selected) != 1:
        return not selected
    obj = selected[0]
    return obj.type not in ("ARMATURE", "EMPTY") and not (
        obj.type == "MESH" and (obj.parent or obj.find_armature() or moves(obj))
    )


def moves(obj: bpy.types.Object) -> bool:
    """True if keys, drivers, constraints, a parent or a simulation could move a mesh, or its vertices."""
    return is_animated(obj) or is_simulated(obj) or deforms(obj)


def _rigs_of(obj: bpy.types.Object, known: Iterable[bpy.types.Object]) -> list[bpy.types.Object]:
    """The armature that an object is or wears, or hangs on if it is not `known` yet; those below an empty."""
    if obj.type == "ARMATURE" or instances_armature(obj):
        return [obj]
    if obj.type == "MESH":
        above = [parent for parent in ancestors(obj) if parent.type == "ARMATURE" and parent not in known]
        wears = obj.find_armature()
        return [wears] if wears else above[:1]
    return [below for below in obj.children_recursive if below.type == "ARMATURE"]


def _skin_rigs(objects: Objects, armatures: Iterable[bpy.types.Object]) -> list[bpy.types.Object]:
    """The armatures that move the skin where others control it, or the bodies that wear it; each itself if it does, or
    none is found."""
    bodies = [obj for obj in objects if obj.type == "ARMATURE" and has_skin(objects, obj)]
    leaders_of = cache(all_leaders)

    def skin_rig(armature: bpy.types.Object) -> bpy.types.Object:
        if armature.type != "ARMATURE":
            return armature
        moving = [armature] if armature in bodies else [obj for obj in bodies if armature in leaders_of(obj)]
        wearers = {next((body for body in bodies if is_worn(body, rig)), rig) for rig in moving}
        return wearers.pop() if len(wearers) == 1 else armature

    return list(dict.fromkeys(map(skin_rig, armatures)))


def all_leaders(obj: bpy.types.Object) -> set[bpy.types.Object]:
    """Objects that an object follows by constraints and parents, and those that they follow."""
    reached: set[bpy.types.Object] = set()
    waiting = [obj]
    while waiting:
        follower = waiting.pop()
        further = (leaders(follower) | set(ancestors(follower))) - reached
        reached |= further
        waiting += further
    return reached - {obj}


def walkers_of(objects: Objects) -> list[bpy.types.Object]:
    """The armatures that move; where some of them move a skin, those."""
    moving = [obj for obj in objects if obj.type == "ARMATURE" and is_animated(obj)]
    rigs = _skin_rigs(objects, moving)
    return [rig for rig in rigs if has_skin(objects, rig)] or rigs


def set_up_automatically(scene: bpy.types.Scene) -> None:
    """Make the scene's only rig that moves a skin, or moves at all, a character where none is set up yet.

    Without any rig, its only body of parts that move.

    Raises
    ------
    InputError
        If there is no armature, or more than one that could be meant.
    """
    if scene.softground.characters:
        return
    armatures = [obj for obj in scene.objects if obj.type == "ARMATURE"]
    if not armatures:
        inside = next(filter(instances_armature, scene.objects), None)
        if inside:
            require_armature(inside)
        bodies = [obj for obj in scene.objects if not obj.parent and (is_body(obj) or deforms(obj))]
        if len(bodies) == 1:
            _leave_as_it_is(scene.softground)
            if jobs.run(adding_body(scene, bodies[0])):
                return
        raise InputError(
            f"Scene '{scene.name}' has no armature: open a shot with an animated character, or add what falls or rolls "
            "with Add Character in the SoftGround panel."
        )
    rigs = walkers_of(scene.objects) or armatures
    if len(rigs) > 1:
        raise InputError(
            f"Scene '{scene.name}' has several armatures ({_names(rigs)}): select those that walk, press Add "
            "Character in the SoftGround panel, and save the file."
        )
    _leave_as_it_is(scene.softground)
    add_character(scene, rigs[0])


def _leave_as_it_is(options: Any) -> None:
    """Settings where nobody looks on."""
    if not options.is_property_set("sink_feet"):
        options.sink_feet = False  # an animation is changed where that was asked for
    if not options.is_property_set("relief"):
        options.relief = "OFF"  # and farms bake what they have baked so far


def _names(props: Sequence[bpy.types.Object]) -> str:
    return ", ".join(f"'{obj.name}'" for obj in props)
