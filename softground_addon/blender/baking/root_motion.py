"""Cycles on the spot get the travel that their resting feet imply, as a layer of keys on the rig's root."""

from __future__ import annotations

from dataclasses import dataclass, replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.errors import InputError
from ...core.motion.motion import CharacterMotion
from ...core.response.root_motion import lacking_velocity
from ...core.rig.mapping import RigMapping
from ...core.settings import BakeSettings, CharacterSettings, ObjectName
from .. import settings
from ..animation_layer.layer_curves import LayerCurve
from ..animation_layer.nla_layer import (
    TRAVEL,
    add_layer,
    animated_paths,
    check_layerable,
    has_layer,
    notes_of,
    remove_layer,
)
from ..characters.character_setup import characters_of
from ..jobs import Job, Progress, meanwhile
from ..reading.shots import estimate_shot, read_shot, settings_of
from ..response.rig_controls import travelling_bone

Array = NDArray[np.float64]

SPEED = "softground_travel_speed"
"""Note of the speed of the travel [m/s]."""


@dataclass(frozen=True)
class Travel:
    """The travel that a character was given.

    Attributes
    ----------
    character : str
    control : str
        The bone that is keyed, or the armature object.
    speed : float
        [m/s].
    """

    character: str
    control: str
    speed: float

    def as_dict(self) -> dict[str, object]:
        """For JSON."""
        return {"control": self.control, "speed_m_s": round(self.speed, 4)}

    @property
    def summary(self) -> str:
        """In a line."""
        return f"'{self.character}' travels at {self.speed:.2f} m/s, keyed on '{self.control}'"


def root_motion(scene: bpy.types.Scene) -> Job[tuple[Travel, ...]]:
    """Give each character that walks on the spot the travel with which its feet rest, over the frame range.

    Raises
    ------
    SoftGroundError
        If a shot cannot be read, nobody walks on the spot, or a rig cannot take the layer; nothing is changed then.
    """
    if not any(character.armature for character in characters_of(scene)):
        raise InputError("No character here has a rig to move: add a character with an animated armature.")
    wanted = replace(settings_of(scene), response=None)
    for one in wanted.characters:
        if one.armature:
            check_movable(settings.found(one.armature))
    shot = yield from read_shot(scene, wanted)
    loads = yield from estimate_shot(wanted, shot)
    layers: list[tuple[ObjectName, Travel, list[LayerCurve]]] = []
    for one, motion, of_character in zip(wanted.characters, shot.motions, loads, strict=True):
        if not one.armature:
            continue
        work = lacking_velocity.slices(motion, of_character, shot.terrain)
        velocity = yield from meanwhile(Progress("simulate", 1.0), work)
        if velocity is None:
            continue
        travel, curves = _layer(scene, one, motion, wanted, velocity)
        layers.append((one.armature, travel, curves))
    if not layers:
        raise InputError("No character here walks on the spot: the feet already stand still on the ground.")
    start, end = (frame * wanted.time_stretch for frame in wanted.frames)
    for name, travel, curves in layers:
        armature = settings.found(name)
        remove_layer(armature)  # a response to a walk on the spot
        add_layer(armature, curves, (start, end), {SPEED: f"{travel.speed:.4f}"}, TRAVEL)
    yield Progress("write", 1.0)
    return tuple(travel for _, travel, _ in layers)


def check_movable(armature: bpy.types.Object) -> None:
    """Raise InputError, naming the remedy, where an armature can be given no travel."""
    check_layerable(armature)
    if armature.animation_data is not None and not armature.animation_data.use_nla:
        raise InputError(
            f"The NLA of '{armature.name}' is switched off, and travel would not show: switch it on beside the name in "
            "the NLA editor."
        )


def speed_of(armature: bpy.types.Object) -> float:
    """Speed of the travel that an armature was given [m/s]; 0 where it was given none."""
    try:
        return float(notes_of(armature, TRAVEL).get(SPEED, "0"))
    except ValueError:
        return 0.0


def remove_root_motion(scene: bpy.types.Scene) -> None:
    """Take the travel off all armatures of the scene."""
    for armature in _travelling(scene):
        remove_layer(armature, TRAVEL)
    for layer in scene.view_layers:
        layer.update()


def has_root_motion(scene: bpy.types.Scene) -> bool:
    """Whether a character of the scene was given travel; quick enough for `poll`."""
    return any(one.armature and has_layer(one.armature, TRAVEL) for one in scene.softground.characters)


def _travelling(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    return [obj for obj in scene.objects if obj.type == "ARMATURE" and not obj.library and has_layer(obj, TRAVEL)]


def _layer(
    scene: bpy.types.Scene,
    character: CharacterSettings,
    motion: CharacterMotion,
    wanted: BakeSettings,
    velocity: Array,
) -> tuple[Travel, list[LayerCurve]]:
    """The keys of one character: on the bone that moves its whole rig, else on the armature object."""
    assert character.armature
    armature = settings.found(character.armature)
    bone = _bone(scene, armature, RigMapping(character.joints, character.soles, "settings"))
    if bone:
        path = f'pose.bones["{bpy.utils.escape_identifier(bone)}"].location'
        frame = np.array(armature.matrix_world.to_3x3() @ armature.data.bones[bone].matrix_local.to_3x3())
    else:
        path = "location"
        frame = np.array((armature.matrix_world @ armature.matrix_basis.inverted_safe()).to_3x3())
    duration = (motion.frames[-1] - motion.frames[0]) / motion.frame_rate
    way = np.append(duration * velocity, 0.0) / wanted.unit_scale_m
    ends = np.stack([np.zeros(3), np.linalg.solve(frame, way)])
    frames = motion.frames[[0, -1]] * wanted.time_stretch
    curves = [LayerCurve(path, axis, bone or "Object Transforms", frames, ends[:, axis]) for axis in range(3)]
    return Travel(armature.name, bone or armature.name, float(np.linalg.norm(velocity))), curves


def _bone(scene: bpy.types.Scene, armature: bpy.types.Object, mapping: RigMapping) -> str:
    """The bone to key; empty for the object, as where that turns in the animation."""
    if armature.parent or any(not path.startswith("pose.bones") for path, _ in animated_paths(armature)):
        return ""
    depsgraph = scene.view_layers[0].depsgraph
    assert depsgraph is not None
    return travelling_bone(armature, armature.evaluated_get(depsgraph), mapping)
