"""Setting up characters: from an armature to an entry of `scene.softground.characters`, and back."""

from __future__ import annotations

from math import ceil, floor

import bpy

from ..core.errors import InputError
from .properties import SoftGroundCharacter
from .rig_mapping import RigMapping, SoleSource, map_rig, require_armature

_SIDE_TO_CODE = {"LEFT": "L", "RIGHT": "R", "NONE": ""}
_SIDE_TO_ENUM = {code: side for side, code in _SIDE_TO_CODE.items()}


def add_character(scene: bpy.types.Scene, armature: bpy.types.Object | None) -> SoftGroundCharacter:
    """Add an armature to the scene's characters, with its joints and feet as they were recognised.

    The first character sets the bake's frame range to its animation; further ones widen it.

    Raises
    ------
    InputError
        If there is no armature, it is a character already, or its feet are not found.
    """
    require_armature(armature)
    assert armature is not None
    settings = scene.softground
    if any(character.armature == armature for character in settings.characters):
        raise InputError(
            f"'{armature.name}' is a character already: correct its bones in the list, or remove it first."
        )
    mapping = map_rig(armature)
    character = settings.characters.add()
    character.name = armature.name
    character.armature = armature
    _fill(character, mapping)
    settings.active_character = len(settings.characters) - 1
    frames = animated_frames(armature)
    if frames and len(settings.characters) == 1:
        settings.frame_start, settings.frame_end = frames
    elif frames:
        settings.frame_start = min(settings.frame_start, frames[0])
        settings.frame_end = max(settings.frame_end, frames[1])
    return character


def detect_bones(character: SoftGroundCharacter) -> None:
    """Set a character's joints and soles as they are recognised, in place of those in the list.

    Raises
    ------
    InputError
        If it has no armature, or its feet are not found.
    """
    require_armature(character.armature)
    _fill(character, map_rig(character.armature))


def _fill(character: SoftGroundCharacter, mapping: RigMapping) -> None:
    character.joints.clear()
    character.soles.clear()
    character.active_sole = 0
    for joint, (bone, end) in mapping.joints.items():
        entry = character.joints.add()
        entry.name, entry.bone, entry.end = joint, bone, end.upper()
    for source in mapping.soles:
        sole = character.soles.add()
        sole.name, sole.bone, sole.toe_bone = source.name, source.bone, source.toe_bone
        sole.side = _SIDE_TO_ENUM[source.side]


def characters_of(scene: bpy.types.Scene) -> list[SoftGroundCharacter]:
    """The scene's characters whose armature is still there."""
    return [character for character in scene.softground.characters if character.armature]


def mapping_of(character: SoftGroundCharacter) -> RigMapping:
    """The joints and soles of a character as the user left them."""
    joints = {entry.name: (entry.bone, entry.end.lower()) for entry in character.joints if entry.bone}
    soles = tuple(
        SoleSource(
            sole.name, _SIDE_TO_CODE[sole.side], sole.bone, sole.toe_bone, sole.object.name_full if sole.object else ""
        )
        for sole in character.soles
        if sole.bone or sole.object
    )
    return RigMapping(joints, soles, "settings")


def animated_frames(armature: bpy.types.Object) -> tuple[int, int] | None:
    """First and last frame of the object's action and NLA strips, and of those that it is parented to."""
    ranges: list[tuple[float, float]] = []
    node: bpy.types.Object | None = armature
    while node:
        animation = node.animation_data
        if animation:
            strips = [
                strip for track in animation.nla_tracks if not track.mute for strip in track.strips if not strip.mute
            ]
            ranges += [(strip.frame_start, strip.frame_end) for strip in strips]
            if animation.action:
                frames = animation.action.frame_range
                ranges.append((frames[0], frames[1]))
        node = node.parent
    if not ranges:
        return None
    return floor(min(start for start, _ in ranges)), ceil(max(end for _, end in ranges))


def set_up_automatically(scene: bpy.types.Scene) -> None:
    """Make the scene's only armature a character where no character is set up yet.

    Raises
    ------
    InputError
        If there is no armature or more than one, or its feet are not found.
    """
    if scene.softground.characters:
        return
    armatures = [thing for thing in scene.objects if thing.type == "ARMATURE"]
    if not armatures:
        inside = next((thing for thing in scene.objects if _instances_armature(thing)), None)
        if inside:
            raise InputError(
                f"The armature of '{inside.name}' is in a collection instance and cannot be read there: make it real "
                "(Object > Library Override > Make, or Object > Apply > Make Instances Real)."
            )
        raise InputError(f"Scene '{scene.name}' has no armature: open a shot with an animated character.")
    if len(armatures) > 1:
        names = ", ".join(f"'{armature.name}'" for armature in armatures)
        raise InputError(
            f"Scene '{scene.name}' has several armatures ({names}): add those that walk with Add Character in the "
            "SoftGround panel and save the file."
        )
    add_character(scene, armatures[0])


def _instances_armature(thing: bpy.types.Object) -> bool:
    collection = thing.instance_collection
    return collection is not None and any(part.type == "ARMATURE" for part in collection.all_objects)
