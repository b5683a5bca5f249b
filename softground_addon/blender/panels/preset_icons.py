"""The small pictures in the preset menu: a PNG beside each preset's file, read when the menu first asks for it."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import bpy.utils.previews

from ..state import state


def of(preset: Path) -> int:
    """The number of a preset's picture, as `icon_value` takes it; 0 where there is none, or no window to show it."""
    picture = read(preset)
    return int(picture.icon_id) if picture else 0


def read(preset: Path) -> bpy.types.ImagePreview | None:
    """The picture beside a preset's file; None where there is none."""
    picture, key = preset.with_suffix(".png"), str(preset)
    if state.pictures is None:
        state.pictures = bpy.utils.previews.new()
    if key not in state.pictures:
        with suppress(OSError, KeyError):
            if not picture.is_file():
                return None
            state.pictures.load(key, str(picture), "IMAGE")
    preview: bpy.types.ImagePreview | None = state.pictures.get(key)
    return preview


def unregister() -> None:
    """Free the pictures."""
    if state.pictures is not None:
        bpy.utils.previews.remove(state.pictures)
        state.pictures = None
