"""Keys of a layer: what is added to the channels of an object, and the action that holds them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..compat import new_channels, new_curve

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LayerCurve:
    """Keys of one channel on top of what animates it.

    Attributes
    ----------
    path : str
        Data path from the object.
    index : int
    group : str
        What the user sees the channel under: the bone.
    frames, values : (K,) float arrays
        Added to the channel; a quaternion is multiplied.
    """

    path: str
    index: int
    group: str
    frames: Array
    values: Array


_LINEAR = bpy.types.Keyframe.bl_rna.properties["interpolation"].enum_items["LINEAR"].value


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


def value_of(obj: bpy.types.Object, path: str, index: int) -> float:
    """What a channel stands at now."""
    return float(obj.path_resolve(path)[index])


def set_value(obj: bpy.types.Object, path: str, index: int, value: float) -> None:
    """Set a channel."""
    obj.path_resolve(path)[index] = value
