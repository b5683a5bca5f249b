"""A layer where NLA is no way: a copy of the user's action with the response in it, the original kept as it is.

The copy remembers the original, the layer's own keys and how much of them shows, so that it can be composed anew at
another strength without a bake, and taken away without a trace.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import groupby
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.numerics.orientation import quaternion_power, quaternion_product
from ..compat import action_curves, channels_of, new_channels, set_slot, slot_of
from .layer_curves import LayerCurve, add_curve, new_action, set_value, value_of

Array = NDArray[np.float64]

_ORIGINAL, _SLOT, _LAYER = "softground_original", "softground_slot", "softground_layer"
_STRENGTH, _SPAN, _STANDING = "softground_strength", "softground_span", "softground_standing"


def is_on(obj: bpy.types.Object) -> bool:
    """Whether the object is animated by such a copy."""
    return _copy_on(obj) is not None


def put(
    obj: bpy.types.Object,
    curves: Sequence[LayerCurve],
    frames: tuple[float, float],
    notes: Mapping[str, str],
    strength: float,
) -> None:
    """Animate the object by a copy of its action with the curves in it; see `nla_layer.add_layer`."""
    layer = new_action(f"{obj.name} Response Keys", obj, curves)
    for key, text in notes.items():
        layer[key] = text
    animation = obj.animation_data or obj.animation_data_create()
    original, slot = animation.action, slot_of(animation)
    if original is None:
        copy = bpy.data.actions.new(f"{obj.name} Response")
        copied_slot, _ = new_channels(copy, obj.name)
    else:
        copy = original.copy()
        copy.use_fake_user = False
        copy.name = f"{original.name} Response"
        copied_slot = next((one for one in getattr(copy, "slots", ()) if one.handle == slot.handle), None)
        copy[_ORIGINAL] = original
        copy[_SLOT] = slot.identifier if slot else ""
    copy[_LAYER], copy[_SPAN] = layer, [float(frame) for frame in frames]
    animated = {(curve.data_path, curve.array_index) for curve in _original_curves(copy)}
    copy[_STANDING] = json.dumps(
        [
            (curve.path, curve.index, value_of(obj, curve.path, curve.index))
            for curve in curves
            if (curve.path, curve.index) not in animated
        ]
    )
    _assign(animation, copy, copied_slot)
    set_strength(obj, strength)


def remove(obj: bpy.types.Object) -> None:
    """Animate the object by the original again, and remove the copy."""
    copy = _copy_on(obj)
    if copy is None:
        return
    layer = copy[_LAYER]
    _set_aside(obj, copy)
    for action in (copy, layer):
        if action.users == 0:
            bpy.data.actions.remove(action)
    animation = obj.animation_data
    if animation and animation.action is None and not animation.nla_tracks and not animation.drivers:
        obj.animation_data_clear()
    obj.update_tag(refresh={"TIME", "OBJECT", "DATA"})


def notes_of(obj: bpy.types.Object) -> dict[str, str]:
    """What was noted with the layer."""
    layer = _copy_on(obj)[_LAYER]
    return {key: str(layer[key]) for key in layer.keys()}  # noqa: SIM118  (an ID is no mapping)


def strength_of(obj: bpy.types.Object) -> float:
    """How much of the layer shows, 0 to 2."""
    return float(_copy_on(obj)[_STRENGTH])


def original_of(obj: bpy.types.Object) -> tuple[bpy.types.Action | None, Any]:
    """The user's own action and slot under the copy."""
    return _original(_copy_on(obj))


def set_strength(obj: bpy.types.Object, strength: float) -> None:
    """Compose the copy anew, with so much of the layer in it."""
    copy = _copy_on(obj)
    channels = channels_of(copy, slot_of(obj.animation_data))
    layer = list(action_curves(copy[_LAYER]))
    source = {(curve.data_path, curve.array_index): curve for curve in _original_curves(copy)}
    standing = {(path, index): value for path, index, value in json.loads(copy[_STANDING])}
    first, last = copy[_SPAN]
    frames = _frames(copy, first, last)
    acts = (frames >= first - 1e-4) & (frames <= last + 1e-4)
    changed = {(curve.data_path, curve.array_index) for curve in layer}
    for curve in [one for one in channels if (one.data_path, one.array_index) in changed]:
        channels.remove(curve)
    for path, of_path in groupby(layer, key=lambda curve: curve.data_path):
        curves = list(of_path)
        below = np.stack([_sampled(source, standing, path, curve.array_index, frames) for curve in curves], axis=1)
        added = np.stack([[curve.evaluate(frame) for frame in frames] for curve in curves], axis=1)
        with_layer = _combined(path, below, added, strength)
        values = np.where(acts[:, None], with_layer, below)
        for curve, column in zip(curves, values.T, strict=True):
            group = curve.group.name if curve.group else ""
            add_curve(channels, LayerCurve(path, curve.array_index, group, frames, column))
    copy[_STRENGTH] = strength
    obj.update_tag(refresh={"TIME", "OBJECT", "DATA"})


@contextmanager
def without(obj: bpy.types.Object) -> Iterator[None]:
    """The object as animated by the original alone."""
    copy, animation = _copy_on(obj), obj.animation_data
    slot = slot_of(animation)
    _set_aside(obj, copy)
    try:
        yield
    finally:
        _assign(animation, copy, slot)


def _copy_on(obj: bpy.types.Object) -> Any:
    action: Any = obj.animation_data.action if obj.animation_data else None
    return action if action is not None and _LAYER in action else None


def _original(copy: Any) -> tuple[bpy.types.Action | None, Any]:
    original = copy.get(_ORIGINAL)
    slots = getattr(original, "slots", ())
    return original, next((slot for slot in slots if slot.identifier == copy[_SLOT]), None)


def _original_curves(copy: Any) -> list[bpy.types.FCurve]:
    original, slot = _original(copy)
    return action_curves(original, slot) if original else []


def _assign(animation: Any, action: bpy.types.Action | None, slot: Any) -> None:
    animation.action = action
    if action is not None:
        set_slot(animation, slot)


def _set_aside(obj: bpy.types.Object, copy: Any) -> None:
    """Put the original in the copy's place, and what nothing animated to where it stood."""
    _assign(obj.animation_data, *_original(copy))
    for path, index, value in json.loads(copy[_STANDING]):
        set_value(obj, path, index, value)


def _frames(copy: Any, first: float, last: float) -> Array:
    """Every frame at which the shot may be played."""
    starts, ends = [first - 1], [last + 1]
    original = copy.get(_ORIGINAL)
    if original is not None:
        starts.append(original.frame_range[0])
        ends.append(original.frame_range[1])
    for scene in bpy.data.scenes:
        starts += [scene.frame_start, scene.frame_preview_start]
        ends += [scene.frame_end, scene.frame_preview_end]
    return np.arange(np.floor(min(starts)), np.ceil(max(ends)) + 1)


def _sampled(
    source: Mapping[tuple[str, int], bpy.types.FCurve],
    standing: Mapping[tuple[str, int], float],
    path: str,
    index: int,
    frames: Array,
) -> Array:
    curve = source.get((path, index))
    if curve is None:
        return np.full(len(frames), standing[path, index])
    return np.array([curve.evaluate(frame) for frame in frames])


def _combined(path: str, below: Array, added: Array, strength: float) -> Array:
    """Values with the layer on top, as NLA combines them."""
    if not path.endswith("rotation_quaternion"):
        return below + strength * added
    return quaternion_product(below, quaternion_power(added, strength))
