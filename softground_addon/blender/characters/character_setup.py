"""Setting up characters: from an armature to an entry of `scene.softground.characters`, and back."""

from __future__ import annotations

from collections.abc import Iterable
from math import ceil, floor, log10
from typing import Any

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.motion.props import mass_properties
from ...core.motion.sole_motion import shortest_length
from ...core.motion.units import scale_to_metres
from ...core.numerics.components import components
from ...core.rig.bare_body import body_motion
from ...core.rig.mapping import RigMapping
from .. import jobs
from ..properties import SoftGroundCharacter
from ..rigs.frame_ranges import ancestors, animated_frames
from ..rigs.libraries import check_libraries
from ..rigs.rig_mapping import CHOOSE_CONTACTS, only_parts, parts_of, require_armature
from ..sampling.body_sampling import body_frames
from ..sampling.prop_extraction import surface_of
from ..sampling.rig_recording import is_simulated
from ..sampling.rig_sampling import recorded_motion, sample_character
from ..settings import SIDE_TO_CODE, fit_cells, found, is_set_up, name_of, take_defaults, time_stretch_of
from .import_fixes import is_captured, put_under, size_of, stature_of
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


def adding_character(scene: bpy.types.Scene, armature: bpy.types.Object | None) -> jobs.Job[SoftGroundCharacter]:
    """What `add_character` does, in steps; nothing is changed before the last.

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
            f"'{armature.name}' is already a character: correct its bones in Advanced, or remove it first."
        )
    rig = name_of(armature)
    recognised = yield from recognise(scene, armature, animated_frames(scene, armature))
    length = yield from _shortest_sole(scene, found(rig), recognised)
    armature, mapping = found(rig), recognised.mapping
    character = settings.characters.add()
    character.name = armature.name
    character.armature = armature
    _fill(scene, character, mapping)
    if mapping.mass:
        character.mass = mapping.mass
    settings.active_character = len(settings.characters) - 1
    _take_frames(scene, animated_frames(scene, armature))
    character.sole_length = length
    _fit_ground(scene)
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
    name, frames = name_of(body), body_frames(scene, body)
    recognised = yield from recognise_body(scene, name)
    assert recognised.body is not None
    if not recognised.mapping.soles:
        if found(name).type == "MESH":
            return None
        nowhere = f"none of them rests on the ground in frames {frames[0]}-{frames[1]}"
        raise InputError(only_parts(found(name), "they keep one pose" if recognised.body.is_rigid else nowhere))
    length = yield from _shortest_sole(scene, found(name), recognised)
    character = settings.characters.add()
    character.name, character.body = name.name, found(name)
    _fill(scene, character, recognised.mapping)
    character.mass = recognised.mapping.mass or character.mass
    settings.active_character = len(settings.characters) - 1
    stretch = time_stretch_of(scene)
    _take_frames(scene, (round(frames[0] * stretch), round(frames[1] * stretch)))
    character.sole_length = length
    _fit_ground(scene)
    return character


LONGEST_OF_LIMBS = 0.55
"""Length from which a limb or an object counts as no longer, since it prints with a part of itself [m]: cells of 1 cm
along a preset's 55."""

_POSES = 16
"""Poses of an animation from which soles are measured."""


def _shortest_sole(scene: bpy.types.Scene, armature: bpy.types.Object, recognised: Recognised) -> jobs.Job[float]:
    """Length of a rig's shortest sole [m]; 0 where it cannot be told."""
    mapping, recording = recognised.mapping, recognised.recording
    if not mapping.soles:
        return 0.0
    if recording is not None:
        poses = recording.of(np.arange(0, len(recording.frames), max(1, len(recording.frames) // _POSES)))
        count = len(poses.frames)
        if recognised.body:
            reading = body_motion(armature.name, recognised.body, mapping, poses, mass=1.0)
        else:
            reading = recorded_motion(scene, armature, mapping, poses, recognised.skin, mass=1.0)
    else:
        first, last = _frames_of_scene(scene, animated_frames(scene, armature))
        frames = range(first, max(last, first + 1) + 1, max(1, (last - first) // _POSES))
        reading, count = sample_character(scene, armature, mapping, mass=1.0, frames=frames), len(frames)
    try:
        motion = yield from jobs.counted(reading, "sample", count, share=SHARE)
    except InputError:  # it says so when the user bakes
        return 0.0
    limbs = {sole.name for sole in mapping.soles if sole.limb}
    lengths = ((sole.sole.name in limbs, sole.sole.length) for sole in motion.soles)
    return shortest_length(min(length, LONGEST_OF_LIMBS) if is_limb else length for is_limb, length in lengths)


def _frames_of_scene(scene: bpy.types.Scene, frames: tuple[int, int] | None) -> tuple[int, int]:
    """The scene's frames at which an animation plays; all of them without one.

    A pose of one frame is held: its own, or that of an NLA strip, which lasts a frame at least.
    """
    if not frames:
        return scene.frame_start, scene.frame_end
    stretch = time_stretch_of(scene)
    first, last = floor(frames[0] / stretch), ceil(frames[1] / stretch)
    if frames[1] - frames[0] <= 1:
        last = first + ceil(POSE_TIME * scene.render.fps / scene.render.fps_base)
    return first, last


POSE_TIME = 1.0
"""How long a pose of one frame is held [s]: by then all grounds of the presets have yielded."""


def _fit_ground(scene: bpy.types.Scene) -> None:
    """Let the ground fit a character that was just added: by the default preset if it is the first."""
    if len(characters_of(scene.softground)) == 1:
        take_defaults(scene.softground)
    fit_cells(scene.softground)


DENSITY = 500.0
"""Density from which a prop's first mass is guessed [kg/m³]: wood's, between a tyre's and a stone's."""


def add_props(scene: bpy.types.Scene, props: Iterable[bpy.types.Object]) -> list[SoftGroundCharacter]:
    """Add mesh objects to the scene's characters, as props without a rig that fall, roll and slide.

    Objects that hang on one parent, such as the wheels of a bicycle, are one prop. Its mass is that of its rigid
    bodies, or guessed from its volume.

    Raises
    ------
    InputError
        If there is no object, or one is no mesh, the ground, or printing already.
    """
    props = list(props)
    if not props:
        raise InputError("No object is selected: select an animated armature, or mesh objects that fall or roll.")
    for obj in props:
        _check_printable(scene, obj)
        for character in scene.softground.characters:
            if character.armature and character.armature in ancestors(obj):
                raise InputError(
                    f"'{obj.name}' is attached to the character '{character.armature.name}': let it print with Add "
                    "Contact."
                )
    groups: dict[bpy.types.Object, list[bpy.types.Object]] = {}
    for obj in props:
        groups.setdefault(_root(obj), []).append(obj)
    added = []
    for root, members in groups.items():
        character = scene.softground.characters.add()
        character.name = (members[0] if len(members) == 1 else root).name
        character.mass = _guessed_mass(scene, members)
        size = min(float(np.array(obj.dimensions).max()) for obj in members) * scene.unit_settings.scale_length
        character.sole_length = min(size, LONGEST_OF_LIMBS)
        for obj in members:
            sole = character.soles.add()
            sole.name, sole.object = obj.name, obj
        added.append(character)
        for obj in members:
            _take_frames(scene, _moving_frames(scene, obj))
        _fit_ground(scene)
    scene.softground.active_character = len(scene.softground.characters) - 1
    return added


def _check_printable(scene: bpy.types.Scene, obj: bpy.types.Object) -> None:
    check_libraries(obj)
    if obj.type != "MESH":
        raise InputError(
            f"'{obj.name}' is not a mesh but of type {obj.type.title()}: select an animated armature, or mesh "
            "objects that fall or roll."
        )
    if obj == scene.softground.ground:
        raise InputError(f"'{obj.name}' is the ground: select what moves on it.")
    if not obj.data.polygons and not obj.modifiers:
        raise InputError(f"'{obj.name}' has no faces to print with: give its mesh faces, or select another object.")
    for character in scene.softground.characters:
        if any(sole.object == obj for sole in character.soles):
            raise InputError(
                f"'{obj.name}' already prints, as a sole of '{title_of(character)}': select another object."
            )


def _root(obj: bpy.types.Object) -> bpy.types.Object:
    return ([obj, *ancestors(obj)])[-1]


def _guessed_mass(scene: bpy.types.Scene, props: Iterable[bpy.types.Object]) -> float:
    """Mass of some objects [kg]: that of their rigid bodies, or from their volume, to two digits."""
    total = 0.0
    for obj in props:
        if obj.rigid_body:
            total += obj.rigid_body.mass
            continue
        vertices, triangles = surface_of(scene, obj)
        to_world = np.array(obj.matrix_world)[:3, :3] * scene.unit_settings.scale_length
        total += mass_properties(vertices @ to_world.T, triangles).volume * DENSITY
    if not total > 0:
        return 1.0
    return round(total, 1 - floor(log10(total)))


def _moving_frames(scene: bpy.types.Scene, obj: bpy.types.Object) -> tuple[int, int] | None:
    if is_simulated(obj) and scene.rigidbody_world:
        cache = scene.rigidbody_world.point_cache
        return max(cache.frame_start, scene.frame_start), min(cache.frame_end, scene.frame_end)
    return animated_frames(scene, obj)


def _take_frames(scene: bpy.types.Scene, frames: tuple[int, int] | None) -> None:
    """Bake the frames of the first character; widen the range for further ones."""
    if not frames:
        if len(characters_of(scene.softground)) == 1:
            scene.softground.frame_start, scene.softground.frame_end = scene.frame_start, scene.frame_end
        return
    settings = scene.softground
    start, end = _frames_of_scene(scene, frames)
    if len(characters_of(scene.softground)) > 1:
        start, end = min(settings.frame_start, start), max(settings.frame_end, end)
    settings.frame_start, settings.frame_end = start, end
    settings.animated_frames = start, end


def fix_scale(scene: bpy.types.Scene, character: SoftGroundCharacter) -> float:
    """Scale a character whose file is in other units to metres, by an empty above it; the factor.

    Raises
    ------
    InputError
        If its size needs no change, or it is linked.
    """
    armature = character.armature
    size = stature_of(scene, armature) if armature else 0.0
    factor = scale_to_metres(size, captured=is_captured(character))
    if armature is None or factor == 1.0:
        raise InputError(f"'{title_of(character)}' is {size:.2g} m in size: its scale needs no fix.")
    put_under(scene, armature, f"{armature.name} Scale").scale = (factor,) * 3
    by_volume = character.mass == character.skin_mass
    character.size, character.sole_length = character.size * factor, character.sole_length * factor
    character.skin_mass = float(f"{character.skin_mass * factor**3:.2g}")
    if by_volume:
        character.mass = character.skin_mass
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
    mapping = (yield from recognise(scene, armature, animated_frames(scene, armature))).mapping
    if not mapping.soles:
        raise InputError(f"No feet found in '{armature.name}': {CHOOSE_CONTACTS}.")
    _fill(scene, scene.softground.characters[number], mapping)
    return [source.name for source in mapping.soles]


def _fill(scene: bpy.types.Scene, character: SoftGroundCharacter, mapping: RigMapping) -> None:
    character.skin_mass = mapping.mass
    character.size = size_of(scene, character.armature) if character.armature else 0.0
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


def add_bone_contacts(character: SoftGroundCharacter, bones: Iterable[str]) -> list[str]:
    """Let limbs of a character print, by whatever side of them faces down; names of the soles that were added.

    Raises
    ------
    InputError
        If there is none, or all print already.
    """
    taken = {bone for sole in character.soles for bone in (sole.bone, sole.toe_bone)}
    fresh = [bone for bone in bones if bone not in taken]
    if not fresh:
        raise InputError(
            f"No further bone of '{title_of(character)}' is selected: select the bones that touch the ground, in Pose "
            "Mode."
        )
    for bone in fresh:
        sole = character.soles.add()
        sole.name, sole.bone, sole.kind = bone, bone, "LIMB"
        sole.side = _side_of(bone)
    character.active_sole = len(character.soles) - 1
    return fresh


LEAST_SHARE = 0.05
"""Share of the weights on some vertices from which a bone carries them."""


def add_vertex_contacts(character: SoftGroundCharacter, skin: bpy.types.Object) -> list[str]:
    """Let what carries the selected vertices of a character's mesh print, a contact for each patch of them; its names.

    Raises
    ------
    InputError
        If none is selected, or no bone carries them.
    """
    skin.update_from_editmode()
    mesh = skin.data
    assert isinstance(mesh, bpy.types.Mesh)
    chosen = np.zeros(len(mesh.vertices), dtype=bool)
    mesh.vertices.foreach_get("select", chosen)
    edges = np.zeros(2 * len(mesh.edges), dtype=np.int32)
    mesh.edges.foreach_get("vertices", edges)
    start, other = edges.reshape(-1, 2)[chosen[edges.reshape(-1, 2)].all(axis=1)].T
    patch, bones = components(len(chosen), start, other), character.armature.data.bones
    carried: dict[str, set[str]] = {}
    for number in np.unique(patch[chosen]):
        weights: dict[str, float] = {}
        for vertex in np.flatnonzero(chosen & (patch == number)).tolist():
            for element in mesh.vertices[vertex].groups:
                name = skin.vertex_groups[element.group].name
                if name in bones and bones[name].use_deform:
                    weights[name] = weights.get(name, 0.0) + element.weight
        least = LEAST_SHARE * sum(weights.values())
        if least > 0:
            main = max(weights, key=weights.__getitem__)
            carried.setdefault(main, set()).update(name for name, weight in weights.items() if weight >= least)
    if not carried:
        raise InputError(
            f"No vertex of '{skin.name}' is selected that a bone of '{title_of(character)}' carries: select those that "
            "touch the ground."
        )
    added = add_bone_contacts(character, carried)
    for name in added:
        for bone in sorted(carried[name]):
            character.soles[name].parts.add().name = bone
    return added


def add_object_contacts(
    scene: bpy.types.Scene, character: SoftGroundCharacter, props: Iterable[bpy.types.Object]
) -> list[str]:
    """Let objects print as soles of a character: canes, snowshoes, wheels; names of those that were added.

    Raises
    ------
    InputError
        If there is none, or one is no mesh, the ground, or printing already.
    """
    props = list(props)
    if not props:
        raise InputError(
            "No object is selected: select the meshes that touch the ground, such as a cane or a snowshoe."
        )
    if character.body:
        raise InputError(f"'{character.name}' has no armature, and prints with its own parts: add a prop by itself.")
    for obj in props:
        _check_printable(scene, obj)
    for obj in props:
        sole = character.soles.add()
        sole.name, sole.object = obj.name, obj
        sole.side = _side_of(obj.name)
    character.active_sole = len(character.soles) - 1
    return [obj.name for obj in props]


def _side_of(name: str) -> str:
    """Side that a name tells by its end, as Blender's own mirror names do."""
    return next((side for end, side in ((".L", "LEFT"), (".R", "RIGHT")) if name.upper().endswith(end)), "NONE")


def title_of(character: SoftGroundCharacter) -> str:
    """What the user calls a character: its armature's name, or that of the prop."""
    return character.armature.name if character.armature else character.name


def characters_of(options: Any) -> list[SoftGroundCharacter]:
    """The scene's characters whose armature or objects are still there."""
    return [character for character in options.characters if is_set_up(character)]
