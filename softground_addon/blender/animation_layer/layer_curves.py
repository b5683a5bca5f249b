"""Actions made of keys: curves of single channels, straight between their keys, and the object that plays them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

import bpy
import numpy as np

from ...core.numerics.arrays import Array
from ..compat import action_curves, new_channels, new_curve, set_slot, slot_of


@dataclass(frozen=True)
class LayerCurve:
    """Keys of one channel.

    Attributes
    ----------
    path : str
        Data path from the object.
    group : str
        Name under which the user sees the channel: the bone.
    frames, values : (K,) float arrays
    """

    path: str
    index: int
    group: str
    frames: Array
    values: Array


_LINEAR = cast("Any", bpy.types.Keyframe.bl_rna.properties["interpolation"]).enum_items["LINEAR"].value


def new_action(name: str, obj: bpy.types.Object, curves: Sequence[LayerCurve]) -> bpy.types.Action:
    """An action of such curves, with one slot for the object where there are slots."""
    action = bpy.data.actions.new(name)
    _, channels = new_channels(action, obj.name)
    for curve in curves:
        add_curve(channels, curve)
    return action


def add_curve(channels: Any, curve: LayerCurve) -> None:
    """Write a curve, straight between its keys, into a collection of an action's curves."""
    written = new_curve(channels, curve.path, curve.index, curve.group)
    keys = written.keyframe_points
    keys.add(len(curve.frames))
    keys.foreach_set("co", np.stack([curve.frames, curve.values], axis=1).astype(np.float32).ravel())
    keys.foreach_set("interpolation", np.full(len(curve.frames), _LINEAR, dtype=np.int32))
    written.update()


def assign_action(obj: bpy.types.Object, action: bpy.types.Action) -> None:
    """Let an object play an action from `new_action`."""
    animation = obj.animation_data or obj.animation_data_create()
    animation.action = action
    set_slot(animation, next(iter(getattr(action, "slots", ())), None))


def path_of_bone(bone: str, channel: str) -> str:
    """Data path of a channel of a bone, from its armature."""
    return f'pose.bones["{bpy.utils.escape_identifier(bone)}"].{channel}'


def animated_paths(obj: Any) -> set[tuple[str, int]]:
    """Data paths and indices that the action, strips (muted ones too) and drivers set."""
    animation = obj.animation_data
    if animation is None:
        return set()
    strips = [strip for track in animation.nla_tracks for strip in track.strips]
    played = [(owner.action, slot_of(owner)) for owner in (animation, *strips) if owner.action]
    curves = [curve for action, slot in played for curve in action_curves(action, slot)]
    return {(curve.data_path, curve.array_index) for curve in (*curves, *animation.drivers)}
