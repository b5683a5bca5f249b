"""Soft grounds beside the first, as a scene holds them: added, made of something else, chosen as the first."""

from __future__ import annotations

from typing import Any

import bpy


def add(options: Any, obj: bpy.types.Object) -> Any:
    """Add a soft ground beside the first, made of the same; its item."""
    item = options.grounds.add()
    item.object = obj
    options.active_ground = len(options.grounds) - 1
    return item


def own_material(options: Any, item: Any) -> Any:
    """The material of a further ground, which no longer follows that of the first."""
    if not item.material.is_property_set("preset"):
        _assign(item.material, _values(options.material))
    return item.material


def choose(options: Any, item: Any) -> None:
    """Make a further ground the first, with what is set for it; the first takes its place."""
    material, before = own_material(options, item), options.ground
    options.ground, item.object = item.object, before
    for first, other in ((options.material, material), (options.painted, item.painted)):
        of_first, of_other = _values(first), _values(other)
        _assign(first, of_other)
        _assign(other, of_first)
    options.under, item.under = item.under, options.under


def _values(group: Any) -> dict[str, Any]:
    """Values of a group of settings that are saved."""
    saved = [each for each in group.bl_rna.properties if not (each.is_readonly or each.is_skip_save)]
    return {each.identifier: getattr(group, each.identifier) for each in saved if each.identifier != "name"}


def _assign(group: Any, values: dict[str, Any]) -> None:
    for name, value in values.items():
        setattr(group, name, value)
