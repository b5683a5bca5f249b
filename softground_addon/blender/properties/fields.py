"""What property groups share."""

from __future__ import annotations

from typing import Any

import bpy


def is_mesh(_group: bpy.types.PropertyGroup, candidate: bpy.types.Object) -> bool:
    """Whether an object can be chosen where a mesh is asked for."""
    return candidate.type == "MESH"


def in_unit(field: str, unit: float) -> dict[str, Any]:
    """What shows a field in another unit, given in the field's own: the same number, kept once."""

    def shown(group: Any) -> float:
        return float(getattr(group, field)) / unit

    def set_to(group: Any, value: float) -> None:
        setattr(group, field, value * unit)

    return {"get": shown, "set": set_to, "options": {"SKIP_SAVE"}}
