"""Checks of a rig before it is read, and of the poses that were read: errors with their remedies."""

from __future__ import annotations

from itertools import chain

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.rig.mapping import RigMapping, bones_of
from ...core.rig.recording import Recording
from ..animation_layer.constraint_layer import is_own
from ..rigs.object_data import armature_of
from ..rigs.rig_mapping import CHOOSE_CONTACTS, require_armature
from ..settings import Objects
from .prop_extraction import check_props

_SCALE_TOLERANCE = 1e-3
"""Relative difference of scale between axes, and cosine between them, that still counts as uniform."""

_FARTHEST = 1e6
"""Largest coordinate that a pose may have [m]: single precision knows no centimetres beyond."""

_ON_EARTH = 1e8
"""Poses that are all within this are a place far away, as of maps; others are broken [m]."""


def check_frames(frames: range) -> None:
    """Raise InputError where there are no frames."""
    if not frames or frames.step < 0:
        raise InputError(f"The frame range {frames.start} to {frames.stop - 1} is empty: set a start before the end.")


def check_mass(name: str, mass: float) -> None:
    """Raise InputError where a mass is none."""
    if not (np.isfinite(mass) and mass > 0):
        raise InputError(f"The mass of '{name}' is {mass} kg: give it a positive mass.")


def check_rig(objects: Objects, armature: bpy.types.Object, mapping: RigMapping, mass: float) -> None:
    """Raise InputError, with the armature and the remedy, where a character cannot be read."""
    require_armature(armature)
    name = armature.name
    check_mass(name, mass)
    if not mapping.soles:
        raise InputError(
            f"'{name}' has no feet, and nothing else to print with: {CHOOSE_CONTACTS}. Remove it from the characters "
            "if nothing of it touches the ground, as of what swims or flies."
        )
    for source in mapping.soles:
        if not source.bone and not source.object:
            raise InputError(f"Sole '{source.name}' of '{name}' has neither a bone nor an object: choose one.")
    check_props(objects, name, mapping.soles)
    check_bones(armature, mapping)
    if armature.mode == "EDIT":
        raise InputError(f"Armature '{name}' is in Edit Mode and stands still: leave it with Tab first.")
    if armature_of(armature).pose_position == "REST":
        raise InputError(f"Armature '{name}' shows its rest position: set it to Pose Position in its data properties.")
    if not is_animated(armature):
        raise InputError(f"Armature '{name}' has no animation: give it an action, or choose the armature that has one.")


def check_bones(armature: bpy.types.Object, mapping: RigMapping) -> None:
    """Raise InputError where an armature has no bone of a name that its mapping has."""
    missing = [bone for bone in bones_of(mapping) if bone not in armature_of(armature).bones]
    if missing:
        raise InputError(
            f"Armature '{armature.name}' has no bone '{missing[0]}': choose the bones of the character again."
        )


def is_animated(armature: bpy.types.Object) -> bool:
    """True if anything could move the rig: keys, NLA, drivers or constraints, its own or its parents'."""
    obj: bpy.types.Object | None = armature
    while obj is not None:
        animation = obj.animation_data
        if animation and (animation.action or animation.drivers or any(track.strips for track in animation.nla_tracks)):
            return True
        owners = (obj, *(obj.pose.bones if obj.pose else ()))
        if any(not is_own(constraint) for owner in owners for constraint in owner.constraints):
            return True
        obj = obj.parent
    return bool(armature.data and armature.data.animation_data)


def check_finite(name: str, recording: Recording) -> None:
    of_rig = [recording.armature] if recording.bones else []
    for matrices in chain(of_rig, map(recording.bone, recording.bones), recording.props.values()):
        furthest = np.abs(matrices).max(axis=(1, 2))
        bad = ~(furthest <= _FARTHEST)
        if not bad.any():
            continue
        first = int(bad.argmax())
        if bad.all() and furthest.max() < _ON_EARTH:
            rounding = float(np.spacing(np.float32(furthest[first])))
            raise InputError(
                f"'{name}' is {furthest[first] / 1e3:,.0f} km from the world's origin, where Blender rounds positions "
                f"to {rounding * 100:.2g} cm: move it and its ground to the origin."
            )
        raise InputError(
            f"'{name}' has no finite pose at frame {int(recording.frames[first])}: "
            "look for broken keys (NaN, infinite or huge values) in its action and delete them."
        )


def check_recording(name: str, recording: Recording) -> None:
    axes = recording.armature[:, :3, :3]
    gram = np.swapaxes(axes, -1, -2) @ axes
    size = np.sqrt(np.diagonal(gram, axis1=-2, axis2=-1))
    if (size < 1e-9).any():
        raise InputError(f"'{name}' has a scale of zero: set its scale, or apply it (Object > Apply > Scale).")
    spread = np.ptp(size, axis=-1) > _SCALE_TOLERANCE * size.max(axis=-1)
    cosines = gram / (size[:, :, None] * size[:, None, :])
    sheared = np.abs(cosines - np.eye(3)).max(axis=(1, 2)) > _SCALE_TOLERANCE
    if spread.any() or sheared.any():
        values = ", ".join(f"{value:.4g}" for value in size[spread | sheared][0])
        raise InputError(
            f"'{name}' is stretched or sheared (scale {values}): "
            "make its scale the same along all axes, or apply it (Object > Apply > Scale), also on its parents."
        )
