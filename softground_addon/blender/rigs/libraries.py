"""Objects that need another file which is not here: Blender then shows them without data, bones or keys."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, cast

import bpy

from ...core.errors import InputError
from .frame_ranges import ancestors


def check_libraries(obj: bpy.types.Object) -> None:
    """Raise InputError, naming the library, where an object or a parent needs one that was not found."""
    for node in (obj, *ancestors(obj)):
        lacking: Any = next((part for part in _parts_of(node) if part.is_missing), None)
        if lacking is None:
            continue
        part = "" if lacking.name == node.name else f" with its {lacking.bl_rna.name.lower()} '{lacking.name}'"
        raise InputError(
            f"'{node.name}'{part} is not in this file, and its library '{lacking.library.filepath}' was not found: put "
            "the library back, or relocate it (File > External Data > Find Missing Files)."
        )


def _parts_of(obj: bpy.types.Object) -> Iterator[bpy.types.ID]:
    """An object, its library original, its data and its actions."""
    yield obj
    if obj.override_library and obj.override_library.reference:
        yield obj.override_library.reference
    if obj.data:
        yield obj.data
    if obj.animation_data:
        strips = (strip for track in obj.animation_data.nla_tracks for strip in track.strips)
        yield from filter(None, (owner.action for owner in cast("Any", (obj.animation_data, *strips))))
