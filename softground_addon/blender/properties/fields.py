"""Fields that property groups share."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import FloatProperty


def is_mesh(_group: bpy.types.PropertyGroup, candidate: bpy.types.Object) -> bool:
    """True if an object can be chosen where a mesh is asked for."""
    return candidate.type == "MESH"


def in_unit(field: str, unit: float, name: str, description: str, **limits: Any) -> Any:
    """A property that shows a field in another unit, given in the field's own: the same number, kept once.

    Blender's own units would not do: they multiply what is shown by the scene's unit scale, and lengths here are metres
    whatever that is.
    """

    def shown(group: Any) -> float:
        return float(getattr(group, field)) / unit

    def set_to(group: Any, value: float) -> None:
        setattr(group, field, value * unit)

    return FloatProperty(name=name, description=description, get=shown, set=set_to, options={"SKIP_SAVE"}, **limits)


def share(name: str, description: str, default: float = 0.0, most: float = 1.0) -> Any:
    """A property that says how much of something is wanted: none at 0, all of it at 1."""
    return FloatProperty(name=name, description=description, default=default, min=0.0, max=most, subtype="FACTOR")
