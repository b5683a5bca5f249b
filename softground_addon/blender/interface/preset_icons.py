"""The small pictures in the preset menu: a PNG beside each preset's file, read when the menu first asks for it."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import bpy.utils.previews

_shown: list[bpy.utils.previews.ImagePreviewCollection] = []
"""The pictures that were read, by the path of their preset; empty until the first is."""


def of(preset: Path) -> int:
    """The number of a preset's picture, as `icon_value` takes it; 0 where there is none, or no window to show it."""
    picture = read(preset)
    return int(picture.icon_id) if picture else 0


def read(preset: Path) -> bpy.types.ImagePreview | None:
    """The picture beside a preset's file; None where there is none."""
    picture, key = preset.with_suffix(".png"), str(preset)
    if not _shown:
        _shown.append(bpy.utils.previews.new())
    if key not in _shown[0]:
        with suppress(OSError, KeyError):
            if not picture.is_file():
                return None
            _shown[0].load(key, str(picture), "IMAGE")
    return _shown[0].get(key)


def unregister() -> None:
    """Free the pictures."""
    while _shown:
        bpy.utils.previews.remove(_shown.pop())
