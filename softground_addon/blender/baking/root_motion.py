"""Cycles on the spot get the travel that their resting feet imply, as a layer of keys on the rig's root."""

from __future__ import annotations

from dataclasses import dataclass, replace

import bpy
import numpy as np

from ...core.checks.uneven_slides import uneven_slides
from ...core.errors import InputError
from ...core.motion.motion import CharacterMotion
from ...core.numerics.arrays import Array
from ...core.response.root_motion import lacking_velocity
from ...core.rig.mapping import RigMapping
from ...core.settings import BakeSettings, CharacterSettings, ObjectName
from .. import settings
from ..animation_layer.constraint_layer import LayerKind, check_layerable, notes_of, remove_layer
from ..animation_layer.layer_curves import LayerCurve, animated_paths, path_of_bone
from ..characters.character_setup import characters_of
from ..jobs import Job, Progress, meanwhile
from ..reading.shots import estimate_shot, read_shot, settings_of
from ..response.response_job import Layer, show_layer
from ..response.rig_controls import travelling_bone
from ..translation import translated

SPEED = "softground_travel_speed"
"""Note of the speed of the travel [m/s]."""


@dataclass(frozen=True)
class Travel:
    """The travel that a character was given.

    Attributes
    ----------
    control : str
        The bone that is keyed, or the armature object.
    speed : float
        [m/s].
    caveat : str
        What it cannot do: let feet rest that slide at different speeds.
    """

    character: str
    control: str
    speed: float
    caveat: str = ""

    def as_dict(self) -> dict[str, object]:
        """For JSON."""
        return {"control": self.control, "speed_m_s": round(self.speed, 4)}

    @property
    def summary(self) -> str:
        """In a line."""
        return translated(
            "'{name}' travels at {speed} m/s, keyed on '{control}'",
            name=self.character,
            speed=f"{self.speed:.2f}",
            control=self.control,
        )


def root_motion(scene: bpy.types.Scene) -> Job[tuple[Travel, ...]]:
    """Give each character that walks on the spot the travel with which its feet rest, over the frame range.

    Raises
    ------
    SoftGroundError
        If a shot cannot be read, nobody walks on the spot, or a rig cannot take the layer; nothing is changed then.
    """
    if not any(character.armature for character in characters_of(scene.softground)):
        raise InputError("No character here has a rig to move: add a character with an animated armature.")
    wanted = replace(settings_of(scene), response=None)
    for moving in wanted.characters:
        if moving.armature:
            check_layerable(settings.resolve(moving.armature))
    shot = yield from read_shot(wanted, LayerKind.ROOT_MOTION)
    loads = yield from estimate_shot(wanted, shot)
    layers: list[tuple[ObjectName, Travel, list[LayerCurve]]] = []
    caveat = ""
    for moving, motion, of_character in zip(wanted.characters, shot.motions, loads, strict=True):
        if not moving.armature:
            continue
        work = lacking_velocity.slices(motion, of_character, shot.terrain)
        velocity = yield from meanwhile(Progress("simulate", 1.0), work)
        uneven = uneven_slides(of_character.motion, of_character.contacts)
        caveat = uneven.text if uneven else ""
        if velocity is None:
            continue
        travel, curves = _layer(scene.view_layers[0], moving, motion, wanted, velocity)
        layers.append((moving.armature, replace(travel, caveat=caveat), curves))
    if not layers:
        raise InputError(
            caveat or "No character here walks on the spot: its feet rest, or no speed lets all of them rest."
        )
    for name, travel, curves in layers:
        armature = settings.resolve(name)
        for kind in LayerKind:  # the others were made for a walk on the spot
            remove_layer(armature, kind)
        layer = Layer(curves, {SPEED: f"{travel.speed:.4f}"})
        show_layer(scene.softground, armature, LayerKind.ROOT_MOTION, layer)
    yield Progress("write", 1.0)
    return tuple(travel for _, travel, _ in layers)


def speed_of(armature: bpy.types.Object) -> float:
    """Speed of the travel that an armature was given [m/s]; 0 where it was given none."""
    try:
        return float(notes_of(armature, LayerKind.ROOT_MOTION).get(SPEED, "0"))
    except ValueError:
        return 0.0


def _layer(
    view_layer: bpy.types.ViewLayer,
    character: CharacterSettings,
    motion: CharacterMotion,
    wanted: BakeSettings,
    velocity: Array,
) -> tuple[Travel, list[LayerCurve]]:
    """The keys of one character: on the bone that moves its whole rig, else on the armature object."""
    assert character.armature
    armature = settings.resolve(character.armature)
    bone = _bone(view_layer, armature, RigMapping(character.joints, character.soles, "settings"))
    path = path_of_bone(bone, "location") if bone else "location"
    duration = (motion.frames[-1] - motion.frames[0]) / motion.frame_rate
    way = np.append(duration * velocity, 0.0) / wanted.unit_scale_m
    if wanted.frame and not wanted.frame.moves:
        way = np.linalg.inv(np.array(wanted.frame.matrix))[:3, :3] @ way
    ends = np.stack([np.zeros(3), way])
    frames = motion.frames[[0, -1]] * wanted.time_stretch
    curves = [LayerCurve(path, axis, bone or "Object Transforms", frames, ends[:, axis]) for axis in range(3)]
    return Travel(armature.name, bone or armature.name, float(np.linalg.norm(velocity))), curves


def _bone(view_layer: bpy.types.ViewLayer, armature: bpy.types.Object, mapping: RigMapping) -> str:
    """The bone to key; empty for the object, as where that turns in the animation."""
    if armature.parent or any(not path.startswith("pose.bones") for path, _ in animated_paths(armature)):
        return ""
    depsgraph = view_layer.depsgraph
    assert depsgraph is not None
    return travelling_bone(armature, armature.evaluated_get(depsgraph), mapping)
