"""Layers of keys above an object's own animation, as NLA tracks; taking one away restores everything as it was.

The user's active action moves, as it is, onto a track of its own below the layer, since Blender evaluates an active
action above all tracks. Channels that the layer changes but nothing animates get their standing value on a third track
at the bottom: NLA would otherwise take them for their defaults, and the value would be lost. Where the user has
switched the object's NLA off, a copy of the action takes the layer's place (`copied_action`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Literal

import bpy
import numpy as np

from ...core.errors import InputError
from ..compat import action_curves, set_slot, slot_of
from . import copied_action
from .layer_curves import LayerCurve, new_action, set_value, value_of

RESPONSE = "SoftGround Response"
EXTRA = "SoftGround Response +"
SOURCE = "SoftGround Source"
STANDING = "SoftGround Standing Pose"


@dataclass(frozen=True)
class LayerKind:
    """What a layer is for: a kind lies on an object once, above those that were put on before.

    Attributes
    ----------
    name : str
        Of its action.
    tracks : tuple of str
        Of its keys; with two its strength goes to 2.
    source, standing : str
        Tracks of the user's action, and of the standing values.
    extrapolation : 'NOTHING' or 'HOLD'
        What it does before its first frame and after its last.
    """

    name: str
    tracks: tuple[str, ...]
    source: str
    standing: str
    extrapolation: Literal["NOTHING", "HOLD"]

    @property
    def all_tracks(self) -> tuple[str, ...]:
        """All that it may have."""
        return (*self.tracks, self.source, self.standing)


ANSWER = LayerKind("Response", (RESPONSE, EXTRA), SOURCE, STANDING, "NOTHING")
"""What the ground does to a character, as it is baked, above all else."""
TRAVEL = LayerKind(
    "Root Motion", ("SoftGround Root Motion",), "SoftGround Root Source", "SoftGround Root Standing", "HOLD"
)
"""Root motion: a part of the animation, for bakes."""
OWN_TRACKS = (*ANSWER.all_tracks, *TRAVEL.all_tracks)
SOURCES = (ANSWER.source, TRAVEL.source)


def has_layer(obj: bpy.types.Object, kind: LayerKind = ANSWER) -> bool:
    """Whether a layer lies on the object's animation."""
    return _track(obj, kind.tracks[0]) is not None or (kind is ANSWER and copied_action.is_on(obj))


def check_layerable(obj: bpy.types.Object) -> None:
    """Raise InputError, naming the remedy, where no layer can be put on the object."""
    if obj.library is not None:
        raise InputError(
            f"'{obj.name}' is linked and cannot be given keys: make a library override of it (Object > Library "
            "Override > Make)."
        )
    animation = obj.animation_data
    if animation is None:
        return
    if animation.use_tweak_mode:
        raise InputError(f"An NLA strip of '{obj.name}' is being tweaked: leave tweak mode (Tab in the NLA editor).")
    solo = next((track for track in animation.nla_tracks if track.is_solo and track.name not in OWN_TRACKS), None)
    if solo is not None:
        raise InputError(f"NLA track '{solo.name}' of '{obj.name}' is solo, which mutes any layer: end its solo.")


def add_layer(
    obj: bpy.types.Object,
    curves: Sequence[LayerCurve],
    frames: tuple[float, float],
    notes: Mapping[str, str] | None = None,
    kind: LayerKind = ANSWER,
) -> None:
    """Put curves above the object's animation; a layer of the kind that is there already goes first.

    Where the object's NLA is switched off, the object gets a copy of its action with the response in it.

    Parameters
    ----------
    obj : bpy.types.Object
        Local or overridden.
    curves : sequence of LayerCurve
    frames : (float, float)
        First and last frame, as the animation counts them; the layer acts between them only.
    notes : mapping of str to str, optional
        Kept with the layer's action, for `notes_of`.
    kind : LayerKind
        All but the response wants the object's NLA switched on.

    Raises
    ------
    InputError
        If the object can take no layer.
    """
    check_layerable(obj)
    strength = strength_of(obj) if kind is ANSWER else 1.0
    remove_layer(obj, kind)
    if kind is ANSWER and obj.animation_data is not None and not obj.animation_data.use_nla:
        copied_action.put(obj, curves, frames, notes or {}, 1.0 if strength is None else strength)
        return
    standing = _standing_values(obj, curves)
    action = new_action(f"{obj.name} {kind.name}", obj, curves)
    for key, text in (notes or {}).items():
        action[key] = text
    animation = obj.animation_data or obj.animation_data_create()
    span = _whole_span(obj, frames)
    own = animation.action
    if own is not None:
        settings = (animation.action_blend_type, animation.action_extrapolation, animation.action_influence)
        slot = slot_of(animation)
        animation.action = None
        strip = _add_strip(animation, kind.source, own, slot, span)
        strip.blend_type, strip.extrapolation = settings[:2]
        if settings[2] != 1.0:
            _set_influence(strip, settings[2])
    if standing:
        below = new_action(f"{obj.name} Standing Pose", obj, standing)
        strip = _add_strip(animation, kind.standing, below, slot_of_action(below), span, bottom=True)
        strip.blend_type, strip.extrapolation = "REPLACE", "HOLD"
    for name in kind.tracks:
        strip = _add_strip(animation, name, action, slot_of_action(action), frames)
        strip.blend_type, strip.extrapolation = "COMBINE", kind.extrapolation
    if kind is ANSWER:
        set_strength(obj, 1.0 if strength is None else strength)


def notes_of(obj: bpy.types.Object, kind: LayerKind = ANSWER) -> dict[str, str]:
    """What was noted with the layer; nothing where there is none."""
    if kind is ANSWER and copied_action.is_on(obj):
        return copied_action.notes_of(obj)
    strip = _strip(obj, kind.tracks[0])
    action = strip.action if strip else None
    return {key: str(action[key]) for key in action.keys()} if action else {}  # noqa: SIM118


def remove_layer(obj: bpy.types.Object, kind: LayerKind = ANSWER) -> None:
    """Take the layer off, and a response that lies on it; the object is animated as before. Nothing happens where there
    is none."""
    copied_action.remove(obj)
    if kind is not ANSWER:
        remove_layer(obj)
    if not has_layer(obj, kind):
        return
    animation = obj.animation_data
    assert animation is not None
    source, standing = _strip(obj, kind.source), _strip(obj, kind.standing)
    values = _constants(standing) if standing else []
    restored = None
    if source is not None and source.action is not None:
        restored = (source.action, slot_of(source), source.blend_type, source.extrapolation, _influence(source))
    left_over = {
        strip.action for name in (kind.tracks[0], kind.standing) if (strip := _strip(obj, name)) and strip.action
    }
    for name in kind.all_tracks:
        track = _track(obj, name)
        if track is not None:
            animation.nla_tracks.remove(track)
    if restored is not None:
        animation.action, slot = restored[:2]
        set_slot(animation, slot)
        animation.action_blend_type, animation.action_extrapolation, animation.action_influence = restored[2:]
    for path, index, value in values:
        set_value(obj, path, index, value)
    for action in left_over:
        if action.users == 0:
            bpy.data.actions.remove(action)
    if animation.action is None and not animation.nla_tracks and not animation.drivers:
        obj.animation_data_clear()
    obj.update_tag(refresh={"TIME", "OBJECT", "DATA"})


def strength_of(obj: bpy.types.Object) -> float | None:
    """How much of the layer shows, 0 to 2; None where there is none."""
    if copied_action.is_on(obj):
        return copied_action.strength_of(obj)
    strips = [_strip(obj, name) for name in (RESPONSE, EXTRA)]
    return sum(_influence(strip) for strip in strips if strip) if strips[0] else None


def set_strength(obj: bpy.types.Object, strength: float) -> None:
    """Scale the layer, 0 to 2: its keys count once through one strip and once more through another."""
    if copied_action.is_on(obj):
        copied_action.set_strength(obj, strength)
        return
    for name, influence in ((RESPONSE, min(strength, 1.0)), (EXTRA, max(strength - 1.0, 0.0))):
        strip, track = _strip(obj, name), _track(obj, name)
        if strip is not None and track is not None:
            _set_influence(strip, influence)
            track.mute = influence == 0.0


@contextmanager
def without_layer(obj: bpy.types.Object) -> Iterator[None]:
    """The object as animated by the user alone."""
    if copied_action.is_on(obj):
        with copied_action.without(obj):
            yield
        return
    tracks = [track for name in (RESPONSE, EXTRA) if (track := _track(obj, name)) and not track.mute]
    names = [track.name for track in tracks]
    for track in tracks:
        track.mute = True
    try:
        yield
    finally:
        for name in names:
            track = _track(obj, name)
            if track is not None:
                track.mute = False


def moved_action(obj: bpy.types.Object) -> bpy.types.Action | None:
    """The user's action where it waits on a track below a layer; None where it is still the active one."""
    strip = next((strip for name in SOURCES if (strip := _strip(obj, name))), None)
    return strip.action if strip else None


def own_action(obj: bpy.types.Object) -> tuple[bpy.types.Action | None, Any]:
    """The user's active action and its slot, also where a copy of it is at work."""
    if copied_action.is_on(obj):
        return copied_action.original_of(obj)
    animation = obj.animation_data
    return (animation.action, slot_of(animation)) if animation else (None, None)


def slot_of_action(action: bpy.types.Action) -> Any:
    """The only slot of one of our own actions; None before slots."""
    return next(iter(getattr(action, "slots", ())), None)


def animated_paths(obj: bpy.types.Object, *, muted: bool = True) -> set[tuple[str, int]]:
    """Data paths and indices that the object's action, strips (those that are muted, too) and drivers set."""
    animation = obj.animation_data
    if animation is None:
        return set()
    tracks = [track for track in animation.nla_tracks if muted or not track.mute]
    strips = [strip for track in tracks for strip in track.strips if muted or not strip.mute]
    owned = [own_action(obj), *((strip.action, slot_of(strip)) for strip in strips)]
    curves = [curve for action, slot in owned if action for curve in action_curves(action, slot)]
    return {(curve.data_path, curve.array_index) for curve in (*curves, *animation.drivers)}


def _track(obj: bpy.types.Object, name: str) -> bpy.types.NlaTrack | None:
    animation = obj.animation_data
    return next((track for track in animation.nla_tracks if track.name == name), None) if animation else None


def _strip(obj: bpy.types.Object, name: str) -> bpy.types.NlaStrip | None:
    track = _track(obj, name)
    return track.strips[0] if track is not None and track.strips else None


def _add_strip(
    animation: bpy.types.AnimData,
    name: str,
    action: bpy.types.Action,
    slot: Any,
    span: tuple[float, float],
    *,
    bottom: bool = False,
) -> bpy.types.NlaStrip:
    """A strip on a new track that plays the action at its own frames throughout the span."""
    track = animation.nla_tracks.new(prev=None) if bottom else _new_top_track(animation)
    track.name = name
    strip = track.strips.new(name, int(span[0]), action)
    set_slot(strip, slot)
    strip.use_sync_length = False
    start, end = float(span[0]), float(max(span[1], span[0] + 1))
    strip.action_frame_end, strip.action_frame_start = end, start
    strip.frame_start, strip.frame_end = start, end
    strip.scale = 1.0
    return strip


def _influence(strip: bpy.types.NlaStrip) -> float:
    """A strip's influence: 1 unless it is animated, else its key."""
    if not strip.use_animated_influence or not strip.fcurves or not strip.fcurves[0].keyframe_points:
        return 1.0
    return float(strip.fcurves[0].keyframe_points[0].co[1])


def _set_influence(strip: bpy.types.NlaStrip, influence: float) -> None:
    """One key on the strip's influence, which is what its slider shows."""
    strip.use_animated_influence = True
    keys = strip.fcurves[0].keyframe_points
    if not keys:
        keys.insert(strip.frame_start, influence)
    for key in keys:
        key.co[1] = influence
    strip.fcurves[0].update()
    strip.influence = influence


def _new_top_track(animation: bpy.types.AnimData) -> bpy.types.NlaTrack:
    tracks = animation.nla_tracks
    return tracks.new(prev=tracks[-1]) if len(tracks) else tracks.new()


def _whole_span(obj: bpy.types.Object, frames: tuple[float, float]) -> tuple[int, int]:
    """Every frame at which the shot may be played, so that the user's action goes on as before beyond its keys."""
    starts, ends = [float(frames[0])], [float(frames[1])]
    animation = obj.animation_data
    if animation and animation.action:
        starts.append(animation.action.frame_range[0])
        ends.append(animation.action.frame_range[1])
    for scene in bpy.data.scenes:
        starts += [scene.frame_start, scene.frame_preview_start, scene.frame_current]
        ends += [scene.frame_end, scene.frame_preview_end, scene.frame_current]
    return int(np.floor(min(starts))) - _MARGIN, int(np.ceil(max(ends))) + _MARGIN


_MARGIN = 1000
"""Frames before and after a shot in which the user's action still plays as it would alone."""


def _standing_values(obj: bpy.types.Object, curves: Sequence[LayerCurve]) -> list[LayerCurve]:
    """One key each for the channels that the layer changes and nothing animates."""
    animated = animated_paths(obj, muted=False)
    return [
        LayerCurve(
            curve.path, curve.index, curve.group, np.array([0.0]), np.array([value_of(obj, curve.path, curve.index)])
        )
        for curve in curves
        if (curve.path, curve.index) not in animated
    ]


def _constants(strip: bpy.types.NlaStrip) -> list[tuple[str, int, float]]:
    """The values of a strip's constant curves."""
    if strip.action is None:
        return []
    return [
        (curve.data_path, curve.array_index, curve.keyframe_points[0].co[1])
        for curve in action_curves(strip.action, slot_of(strip))
    ]
