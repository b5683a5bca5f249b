"""Differences between Blender versions, each behind one name. The only reader of `bpy.app.version`."""

from __future__ import annotations

from typing import Any

import bpy

HAS_SLOTS = bpy.app.version >= (4, 4, 0)
"""Actions keep their curves in the channelbag of a slot instead of one list."""


def action_curves(action: bpy.types.Action, slot: Any = None) -> list[bpy.types.FCurve]:
    """The action's curves: those of one slot, of all slots if none is given, or the whole action before slots."""
    if not HAS_SLOTS:
        return list(action.fcurves)
    return [
        curve
        for layer in action.layers
        for strip in layer.strips
        for bag in strip.channelbags
        if slot is None or bag.slot_handle == slot.handle
        for curve in bag.fcurves
    ]
