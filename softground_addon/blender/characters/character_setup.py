"""Setting up characters: from an armature to an entry of `scene.softground.characters`, and back."""

from __future__ import annotations

from collections.abc import Generator
from math import ceil, floor, isclose
from typing import Any

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.motion.motion import CharacterMotion
from ...core.motion.sole_motion import shortest_length
from ...core.motion.units import scale_to_metres
from ...core.rig.bare_body import body_motion
from ...core.rig.mapping import RigMapping
from ...core.rig.recording import Timeline
from .. import jobs
from ..ground_presets import fit_cells, take_defaults
from ..properties import SoftGroundCharacter
from ..reuse import reused
from ..rigs.frame_ranges import animated_frames
from ..rigs.rig_mapping import CHOOSE_CONTACTS, only_parts, parts_of, require_armature, rest_bones
from ..sampling.body_sampling import body_frames
from ..sampling.rig_sampling import recorded_motion, sample_character
from ..sampling.skin_sampling import Weights
from ..sampling.take import Take
from ..settings import SIDE_TO_CODE, is_set_up, name_of, resolve, timeline_of
from .import_fixes import extent_of, is_captured, mass_of, put_under, sizes_of
from .recognition import SHARE, Recognised, recognise, recognise_body

_SIDE_TO_ENUM = {code: side for side, code in SIDE_TO_CODE.items()}


def add_character(scene: bpy.types.Scene, armature: bpy.types.Object | None) -> SoftGroundCharacter:
    """Add an armature, or an empty above rigid parts, to the scene's characters, with joints and feet as recognised.

    The first character sets the bake's frame range to its animation; further ones widen it.

    Raises
    ------
    InputError
        If there is no armature, or it is a character already.
    """
    return jobs.run(adding_character(scene, armature))


def adding_character(
    scene: bpy.types.Scene, armature: bpy.types.Object | None, weights: dict[str, Weights] | None = None
) -> jobs.Job[SoftGroundCharacter]:
    """Job of `add_character`; nothing is changed before the last. `weights` are as for `read_skin`.

    Where no feet are found its list of soles is empty, for the user to fill.
    """
    if armature is not None and parts_of(armature):
        body = yield from adding_body(scene, armature)
        assert body, "an empty is no prop"
        return body
    require_armature(armature)
    assert armature is not None
    settings = scene.softground
    if any(character.armature == armature for character in settings.characters):
        raise InputError(
            f"'{armature.name}' is already a character: correct its bones in Properties > Physics, or remove it first."
        )
    rig = name_of(armature)
    recognised = yield from recognise(scene, armature, animated_frames(timeline_of(scene), armature), weights)
    length = yield from _shortest_sole(scene, resolve(rig), recognised)
    armature, mapping = resolve(rig), recognised.mapping
    known = free_name(settings.characters, armature.name)
    character = settings.characters.add()
    character.name, character.armature = known, armature
    _fill(scene.unit_settings.scale_length, character, mapping)
    character.mass = mass_of(character) or character.mass
    settings.active_character = len(settings.characters) - 1
    take_frames(settings, timeline_of(scene), animated_frames(timeline_of(scene), armature))
    character.sole_length = length
    fit_ground(settings)
    return character


def adding_body(scene: bpy.types.Scene, body: bpy.types.Object) -> jobs.Job[SoftGroundCharacter | None]:
    """Add a body that no armature moves, in steps: an empty above rigid parts, or a mesh that moves its own.

    Nothing is changed before the last step. None where a mesh is rigid or nothing of it rests: it may be a prop.

    Raises
    ------
    InputError
        If it is a character already, if its meshes cannot be read, or if parts below an empty are no figure.
    """
    settings = scene.softground
    if any(character.body == body for character in settings.characters):
        raise InputError(f"'{body.name}' is already a character: remove it first to recognise it again.")
    name, timeline = name_of(body), timeline_of(scene)
    frames = body_frames(timeline, body)
    recognised = yield from recognise_body(scene, name)
    assert recognised.body is not None
    if not recognised.mapping.soles:
        if resolve(name).type == "MESH":
            return None
        nowhere = f"none of them rests on the ground in frames {frames[0]}-{frames[1]}"
        raise InputError(only_parts(resolve(name), "they keep one pose" if recognised.body.is_rigid else nowhere))
    length = yield from _shortest_sole(scene, resolve(name), recognised)
    character = settings.characters.add()
    character.name, character.body = name.name, resolve(name)
    _fill(scene.unit_settings.scale_length, character, recognised.mapping)
    character.mass = mass_of(character) or character.mass
    settings.active_character = len(settings.characters) - 1
    take_frames(settings, timeline, (round(frames[0] * timeline.stretch), round(frames[1] * timeline.stretch)))
    character.sole_length = length
    fit_ground(settings)
    return character


LONGEST_OF_LIMBS = 0.55
"""Length from which a limb or an object counts as no longer, since it prints with a part of itself [m]: cells of 1 cm
along a preset's 55. Limbs of giants count as their shortest foot: what shows that shows them."""

_POSES = 16
"""Poses of an animation from which soles are measured."""


def _shortest_sole(scene: bpy.types.Scene, armature: bpy.types.Object, recognised: Recognised) -> jobs.Job[float]:
    """Length of a rig's shortest sole [m]; 0 if it is unknown."""
    mapping, recording = recognised.mapping, recognised.recording
    if not mapping.soles:
        return 0.0
    if recording is not None:
        poses = recording.of(np.arange(0, len(recording.frames), max(1, len(recording.frames) // _POSES)))
        if recognised.body:
            reading = body_motion(armature.name, recognised.body, mapping, poses, mass=1.0)
        else:
            reading = recorded_motion(scene.view_layers[0], armature, mapping, poses, recognised.skin, mass=1.0)
        source = recognised.body or rest_bones(armature)
        measured = source, mapping, poses, recognised.skin
        measuring = _length_of(reading, mapping, len(poses.frames))
        return (yield from reused(jobs.Progress("sample", SHARE), "sole length", measured, measuring, of=None))
    timeline = timeline_of(scene)
    first, last = _frames_of_scene(timeline, animated_frames(timeline, armature))
    frames = range(first, max(last, first + 1) + 1, max(1, (last - first) // _POSES))
    reading = sample_character(Take.about(armature, scene, frames), armature, mapping, mass=1.0)
    return (yield from _length_of(reading, mapping, len(frames)))


def _length_of(
    reading: Generator[int | None, None, CharacterMotion], mapping: RigMapping, count: int
) -> jobs.Job[float]:
    """Length of the shortest sole of a motion that is read from so many poses [m]; 0 if it cannot be."""
    try:
        motion = yield from jobs.counted(reading, "sample", count, share=SHARE)
    except InputError:  # it says so when the user bakes
        return 0.0
    limbs = {sole.name for sole in mapping.soles if sole.limb}
    lengths = [(sole.sole.name in limbs, sole.sole.length) for sole in motion.soles]
    longest = max(LONGEST_OF_LIMBS, min((length for is_limb, length in lengths if not is_limb), default=0.0))
    return shortest_length(min(length, longest) if is_limb else length for is_limb, length in lengths)


def _frames_of_scene(timeline: Timeline, frames: tuple[int, int] | None) -> tuple[int, int]:
    """The frames of the scene at which an animation plays; all of them without one.

    A pose of one frame is held: its own, or that of an NLA strip, which lasts a frame at least.
    """
    if not frames:
        return timeline.start, timeline.end
    first, last = floor(frames[0] / timeline.stretch), ceil(frames[1] / timeline.stretch)
    if frames[1] - frames[0] <= 1:
        last = first + ceil(POSE_TIME * timeline.frame_rate)
    return first, last


POSE_TIME = 1.0
"""How long a pose of one frame is held [s]: by then all grounds of the presets have yielded."""


def fit_ground(options: Any) -> None:
    """Let the ground fit a character that was just added: by the default preset if it is the first."""
    if len(characters_of(options)) == 1:
        take_defaults(options)
    fit_cells(options)


def take_frames(options: Any, timeline: Timeline, frames: tuple[int, int] | None) -> None:
    """Bake the frames of the first character; widen the range for further ones."""
    is_first = len(characters_of(options)) == 1
    if not frames:
        if is_first:
            options.frame_start, options.frame_end = timeline.start, timeline.end
        return
    start, end = _frames_of_scene(timeline, frames)
    if not is_first:
        start, end = min(options.frame_start, start), max(options.frame_end, end)
    options.frame_start, options.frame_end = start, end
    options.animated_frames = start, end


def fix_scale(scene: bpy.types.Scene, character: SoftGroundCharacter) -> float:
    """Scale a character whose file is in other units to metres, by an empty above it; the factor.

    Raises
    ------
    InputError
        If its size needs no change, or it is linked.
    """
    armature = character.armature
    size, _ = sizes_of(scene.unit_settings.scale_length, character)
    factor = scale_to_metres(size, captured=is_captured(character))
    if armature is None or factor == 1.0:
        raise InputError(f"'{title_of(character)}' is {size:.2g} m in size: its scale needs no fix.")
    empty = put_under(scene.collection, armature, "Scale")
    empty.scale = empty.scale * factor
    is_typed = not isclose(character.mass, mass_of(character), rel_tol=1e-6)
    character.size, character.sole_length = character.size * factor, character.sole_length * factor
    character.skin_mass = float(f"{character.skin_mass * factor**3:.2g}")
    if not is_typed:
        character.mass = mass_of(character)
    fit_cells(scene.softground)
    return factor


def detecting_bones(scene: bpy.types.Scene, number: int) -> jobs.Job[list[str]]:
    """Set the joints and feet of a scene's character as they are recognised; its other soles stay.

    Returns the names of those that were found.

    Raises
    ------
    InputError
        If it has no armature, or its feet are not found.
    """
    armature = scene.softground.characters[number].armature
    require_armature(armature)
    mapping = (yield from recognise(scene, armature, animated_frames(timeline_of(scene), armature))).mapping
    if not mapping.soles:
        raise InputError(f"No feet found in '{armature.name}': {CHOOSE_CONTACTS}.")
    _fill(scene.unit_settings.scale_length, scene.softground.characters[number], mapping)
    return [source.name for source in mapping.soles]


def _fill(unit_scale: float, character: SoftGroundCharacter, mapping: RigMapping) -> None:
    character.skin_mass = mapping.mass
    character.joints.clear()
    for number in reversed(range(len(character.soles))):
        if character.soles[number].kind == "FOOT" and not character.soles[number].object:
            character.soles.remove(number)
    character.active_sole = 0
    for joint, (bone, end) in mapping.joints.items():
        entry = character.joints.add()
        entry.name, entry.bone, entry.end = joint, bone, end.upper()
    for source in mapping.soles:
        sole = character.soles.add()
        sole.name, sole.bone, sole.toe_bone = source.name, source.bone, source.toe_bone
        sole.side = _SIDE_TO_ENUM[source.side]
        sole.kind = "LIMB" if source.limb else "FOOT"
        for bone in source.parts:
            sole.parts.add().name = bone
    character.size = extent_of(unit_scale, character.armature) if character.armature else 0.0


def free_name(characters: Any, name: str) -> str:
    """A name for another character, which none of the list was added by; rigs may have been renamed since."""
    taken = {each.name for each in characters}
    return next(each for n in range(len(taken) + 1) if (each := f"{name}.{n:03d}" if n else name) not in taken)


def title_of(character: SoftGroundCharacter) -> str:
    """Name of a character in the interface: its armature's name, or that of the prop."""
    return character.armature.name if character.armature else character.name


def characters_of(options: Any) -> list[SoftGroundCharacter]:
    """The scene's characters whose armature or objects are still there."""
    return [character for character in options.characters if is_set_up(character)]
