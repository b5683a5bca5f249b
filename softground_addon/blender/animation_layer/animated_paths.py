"""Animation of an object: its action, its strips and its drivers."""

from __future__ import annotations

import bpy

from ..compat import action_curves, slot_of


def animated_paths(obj: bpy.types.Object | bpy.types.Key) -> set[tuple[str, int]]:
    """Data paths and indices that the object's action, strips (muted ones too) and drivers set."""
    animation = obj.animation_data
    if animation is None:
        return set()
    strips = [strip for track in animation.nla_tracks for strip in track.strips]
    played = [(owner.action, slot_of(owner)) for owner in (animation, *strips) if owner.action]
    curves = [curve for action, slot in played for curve in action_curves(action, slot)]
    return {(curve.data_path, curve.array_index) for curve in (*curves, *animation.drivers)}
