"""Ranges of frames in which an object is animated: keys, strips, and curves that go on beyond them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import ceil, floor, inf
from typing import Any, cast

import bpy

from ...core.rig.recording import Timeline
from ..animation_layer.constraint_layer import is_response
from ..compat import action_curves, slot_of

Range = tuple[float, float]

LEVEL = 1e-6
"""A curve that goes straight on by less than this in a frame stays where it is: rounding."""


def animated_frames(timeline: Timeline, obj: bpy.types.Object, *, alone: bool = False) -> tuple[int, int] | None:
    """First and last frame of the animation of an object, as `animated_range` has it."""
    animated = animated_range(timeline, obj, alone=alone)
    return animated and (floor(animated[0]), ceil(animated[1]))


def animated_range(timeline: Timeline, obj: bpy.types.Object, *, alone: bool = False) -> Range | None:
    """Times of the first key and the last of an object, and unless alone of those that it is parented to, in frames.

    Without any, of the leaders of its constraints. Curves that go on, by a modifier or by extrapolation, last as
    long as the scene.
    """
    ranges = list(_of_data(obj.animation_data)) if alone and obj.animation_data else []
    ranges = ranges or list(_ranges(obj, frozenset()))
    if not ranges:
        return None
    starts, ends = zip(*ranges, strict=True)
    keyed = min(start for start in starts if start > -inf), max(end for end in ends if end < inf)
    start, end = timeline.start * timeline.stretch, timeline.end * timeline.stretch
    first = min(starts) if -inf not in starts else start if start < keyed[1] or inf in ends else keyed[0]
    last = max(ends) if inf not in ends else end if end > first else keyed[1]
    return first, last


def held_range(timeline: Timeline, obj: bpy.types.Object) -> Range | None:
    """The same, but infinite where strips hold no pose beyond it: the rig is at rest there."""
    animated = animated_range(timeline, obj)
    if animated is None:
        return None
    datas = [node.animation_data for node in (obj, *ancestors(obj)) if node.animation_data]
    strips = [strip for data in datas for track in playing_tracks(data) for strip in track.strips if not strip.mute]
    first, last = animated
    opens = any(strip.frame_start == first and strip.extrapolation != "HOLD" for strip in strips)
    closes = any(strip.frame_end == last and strip.extrapolation == "NOTHING" for strip in strips)
    return -inf if opens else first, inf if closes else last


def frames_with_shapes(timeline: Timeline, objects: Iterable[bpy.types.Object]) -> tuple[int, int]:
    """First and last frame of the scene in which objects or their shape keys are animated; all of it without keys."""
    ranges = [each for obj in objects for each in (animated_frames(timeline, obj), _of_shape_keys(obj)) if each]
    if not ranges:
        return timeline.start, timeline.end
    first, last = min(first for first, _ in ranges), max(last for _, last in ranges)
    return floor(first / timeline.stretch), ceil(last / timeline.stretch)


def _of_shape_keys(obj: bpy.types.Object) -> Range | None:
    keys = getattr(obj.data, "shape_keys", None)
    ranges = list(_of_data(keys.animation_data)) if keys and keys.animation_data else []
    finite = [end for each in ranges for end in each if abs(end) < inf]
    return (min(finite), max(finite)) if finite else None


def _ranges(obj: bpy.types.Object, followers: frozenset[bpy.types.Object]) -> Iterator[Range]:
    """Ranges of an object's animation; `followers` are those whose leaders are being searched."""
    ranges = [each for node in (obj, *ancestors(obj)) if node.animation_data for each in _of_data(node.animation_data)]
    if not ranges:
        followers |= {obj}
        ranges = [each for leader in leaders(obj) - followers for each in _ranges(leader, followers)]
    yield from ranges


def playing_tracks(animation: bpy.types.AnimData) -> list[bpy.types.NlaTrack]:
    """The tracks that play: those that are solo, or all that are not muted."""
    tracks = animation.nla_tracks
    return [track for track in tracks if track.is_solo] or [track for track in tracks if not track.mute]


def _of_data(animation: bpy.types.AnimData) -> Iterator[Range]:
    for track in playing_tracks(animation):
        yield from ((strip.frame_start, strip.frame_end) for strip in track.strips if not strip.mute)
    if animation.action is not None:
        yield from _of_action(animation.action, slot_of(animation))


def holds_a_pose(obj: bpy.types.Object) -> bool:
    """True if an object or its parents have keys, and all of them the same value: it is meant to stand still."""
    curves = [
        curve
        for node in (obj, *ancestors(obj))
        if (animation := node.animation_data)
        for owner in cast("Any", (animation, *(strip for track in animation.nla_tracks for strip in track.strips)))
        if owner.action
        for curve in action_curves(owner.action, slot_of(owner))
    ]
    return bool(curves) and all(len({key.co[1] for key in curve.keyframe_points}) == 1 for curve in curves)


def _of_action(action: bpy.types.Action, slot: Any) -> Iterator[Range]:
    keyed: Any = action.frame_range
    yield float(keyed[0]), float(keyed[1])
    for curve in action_curves(action, slot):
        if curve.is_valid and not (curve.mute or curve.is_empty):
            yield from _beyond(curve)


def _beyond(curve: bpy.types.FCurve) -> Iterator[Range]:
    """Ranges in which a curve goes on beyond its keys, before or after them."""
    keys: Any = curve.range()
    first, last = float(keys[0]), float(keys[1])
    cycles = next((modifier for modifier in curve.modifiers if modifier.type == "CYCLES" and not modifier.mute), None)
    for modifier in curve.modifiers:
        if modifier.mute or modifier.type not in ("CYCLES", "NOISE", "FNGENERATOR", "GENERATOR"):
            continue
        start, end = -inf, inf
        if isinstance(modifier, bpy.types.FModifierCycles):
            start, end = _of_cycles(modifier, first, last)
        if modifier.use_restricted_range:
            start, end = max(start, modifier.frame_start), min(end, modifier.frame_end)
        if start < end:
            yield start, end
    if curve.extrapolation == "LINEAR" and cycles is None:
        before, after = (curve.evaluate(end + step) - curve.evaluate(end) for end, step in ((first, -1), (last, 1)))
        yield -inf if abs(before) > LEVEL else first, inf if abs(after) > LEVEL else last


def _of_cycles(cycles: bpy.types.FModifierCycles, first: float, last: float) -> Range:
    """Cycles with a count of 0 have no end."""
    lengths: list[Any] = []
    for mode, count in ((cycles.mode_before, cycles.cycles_before), (cycles.mode_after, cycles.cycles_after)):
        lengths.append(0.0 if mode == "NONE" or first == last else (last - first) * count if count else inf)
    return first - lengths[0], last + lengths[1]


def ancestors(obj: bpy.types.Object) -> list[bpy.types.Object]:
    """An object's parents, nearest first."""
    parents, parent = [], obj.parent
    while parent is not None:
        parents.append(parent)
        parent = parent.parent
    return parents


def leaders(obj: bpy.types.Object) -> set[bpy.types.Object]:
    """Objects that the constraints of an object and of its bones follow, but for the ground's response."""
    bones = obj.pose.bones if obj.pose else ()
    active = (each for owner in (obj, *bones) for each in owner.constraints if not each.mute)
    constraints: list[Any] = [each for each in active if not is_response(each)]
    followed = [getattr(each, "target", None) for each in constraints]
    followed += [weighted.target for each in constraints if each.type == "ARMATURE" for weighted in each.targets]
    return {leader for leader in followed if leader is not None} - {obj}
