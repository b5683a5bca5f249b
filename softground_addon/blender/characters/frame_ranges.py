"""From when to when an object is animated, as the scene shows it: keys, strips, and curves that go on beyond them."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil, floor, inf
from typing import Any

import bpy

from ..animation_layer import nla_layer
from ..compat import action_curves, slot_of
from ..settings import time_stretch_of

Range = tuple[float, float]

LEVEL = 1e-6
"""A curve that goes straight on by less than this in a frame stays where it is: rounding."""


def animated_frames(scene: bpy.types.Scene, obj: bpy.types.Object) -> tuple[int, int] | None:
    """First and last frame of the animation of an object, and of those that it is parented to.

    Where there is none, of what its constraints follow. Curves that go on, by a modifier or by extrapolation, last as
    long as the scene.
    """
    ranges = list(_ranges(obj, frozenset()))
    if not ranges:
        return None
    starts, ends = zip(*ranges, strict=True)
    keyed = min(start for start in starts if start > -inf), max(end for end in ends if end < inf)
    start, end = (frame * time_stretch_of(scene) for frame in (scene.frame_start, scene.frame_end))
    first = min(starts) if -inf not in starts else start if start < keyed[1] or inf in ends else keyed[0]
    last = max(ends) if inf not in ends else end if end > first else keyed[1]
    return floor(first), ceil(last)


def _ranges(obj: bpy.types.Object, followers: frozenset[bpy.types.Object]) -> Iterator[Range]:
    """Ranges of what animates an object; `followers` are those that are asked about already."""
    found = [one for node in (obj, *ancestors(obj)) if node.animation_data for one in _of_data(node.animation_data)]
    if not found:
        followers |= {obj}
        found = [one for leader in leaders(obj) - followers for one in _ranges(leader, followers)]
    yield from found


def _of_data(animation: bpy.types.AnimData) -> Iterator[Range]:
    tracks = [track for track in animation.nla_tracks if track.is_solo] or [
        track for track in animation.nla_tracks if not track.mute
    ]
    for track in tracks:
        strips = [strip for strip in track.strips if not strip.mute]
        if track.name in nla_layer.SOURCES:  # the user's action under our layer, held on beyond its keys
            yield from (one for strip in strips if strip.action for one in _of_action(strip.action, slot_of(strip)))
        elif track.name not in nla_layer.OWN_TRACKS:
            yield from ((strip.frame_start, strip.frame_end) for strip in strips)
    if animation.action is not None:
        yield from _of_action(animation.action, slot_of(animation))


def _of_action(action: bpy.types.Action, slot: Any) -> Iterator[Range]:
    keyed: Any = action.frame_range
    yield float(keyed[0]), float(keyed[1])
    for curve in action_curves(action, slot):
        if curve.is_valid and not (curve.mute or curve.is_empty):
            yield from _beyond(curve)


def _beyond(curve: bpy.types.FCurve) -> Iterator[Range]:
    """For how long a curve goes on beyond its keys, on the side or sides on which it does."""
    keys: Any = curve.range()
    first, last = float(keys[0]), float(keys[1])
    cycles = next((one for one in curve.modifiers if one.type == "CYCLES" and not one.mute), None)
    for one in curve.modifiers:
        if one.mute or one.type not in ("CYCLES", "NOISE", "FNGENERATOR", "GENERATOR"):
            continue
        start, end = -inf, inf
        if isinstance(one, bpy.types.FModifierCycles):
            start, end = _of_cycles(one, first, last)
        if one.use_restricted_range:
            start, end = max(start, one.frame_start), min(end, one.frame_end)
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
    found, parent = [], obj.parent
    while parent is not None:
        found.append(parent)
        parent = parent.parent
    return found


def leaders(obj: bpy.types.Object) -> set[bpy.types.Object]:
    """Objects that the constraints of an object and of its bones follow."""
    bones = obj.pose.bones if obj.pose else ()
    constraints: list[Any] = [one for owner in (obj, *bones) for one in owner.constraints if not one.mute]
    followed = [getattr(one, "target", None) for one in constraints]
    followed += [weighted.target for one in constraints if one.type == "ARMATURE" for weighted in one.targets]
    return {leader for leader in followed if leader is not None} - {obj}
