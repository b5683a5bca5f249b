"""Images of soles as maps: read once, and again when one is edited."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ..core.errors import InputError
from ..core.relief import tread_map
from .state import state

LARGEST = 4096
"""Pixels along the longer side of an image that is read: 16 million take 0.6 GB and a second or two."""


def forget() -> None:
    """Read images anew from now on."""
    state.tread_maps.clear()


def map_of(image: bpy.types.Image | None) -> str:
    """The map of a sole from an image, as text; empty where there is none, or it cannot be read."""
    if image is None:
        return ""
    key = image.session_uid, image.filepath
    if key not in state.tread_maps:
        state.tread_maps[key] = _read(image)
    return state.tread_maps[key]


def check(image: bpy.types.Image | None) -> None:
    """True if the pattern of soles can be taken from an image.

    Raises
    ------
    InputError
        If it cannot.
    """
    if image is None:
        raise InputError("Tread Pattern is 'Image', and none is chosen: choose one below it, or another pattern.")
    if max(image.size) > LARGEST:
        raise InputError(
            f"The tread image '{image.name}' is {image.size[0]:,} x {image.size[1]:,} pixels: scale it to {LARGEST:,} "
            "or fewer along its longer side."
        )
    if not map_of(image):
        raise InputError(
            f"The tread image '{image.name}' has no pixels that can be read: check that its file is there "
            f"('{image.filepath}') and reload it, choose another image, or another Tread Pattern."
        )


def _read(image: bpy.types.Image) -> str:
    width, height = image.size
    if max(width, height) > LARGEST:
        return ""
    stored: Any = image.pixels
    pixels = np.empty(width * height * image.channels, np.float32)
    if not len(pixels) or len(stored) != len(pixels):
        return ""
    stored.foreach_get(pixels)
    parts = pixels.reshape(height, width, image.channels)
    has_alpha = image.channels in (2, 4)
    colours = parts[..., :-1] if has_alpha else parts
    brightness = colours.mean(axis=-1) * (parts[..., -1] if has_alpha else 1.0)
    return tread_map.as_text(tread_map.from_picture(brightness))
