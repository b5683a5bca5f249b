"""What exists, and what is kept quiet, only while a character is read."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import bpy

from ..compat import remove_scene

TEMPORARY = "SoftGround Sampling"
"""Name of what exists only while a rig is read."""

IS_TEMPORARY = "softground_is_temporary"
"""Property of the scenes in which rigs are read, by which those that were left over are told from the user's."""

_SILENT_HANDLERS = ("frame_change_pre", "frame_change_post", "depsgraph_update_pre", "depsgraph_update_post")
"""Handlers that must not take the temporary scene for a change of the user's frame."""


@contextmanager
def handlers_silent(acting: Sequence[Callable[..., None]] = ()) -> Iterator[None]:
    """Frame and update handlers put aside, but for those that are `acting`, and put back as they were."""
    lists: list[Any] = [getattr(bpy.app.handlers, name) for name in _SILENT_HANDLERS]
    saved = [list(handlers) for handlers in lists]
    for handlers in lists:
        handlers[:] = [handler for handler in handlers if handler in acting]
    try:
        yield
    finally:
        for handlers, functions in zip(lists, saved, strict=True):
            handlers[:] = functions


@contextmanager
def temporary_scene() -> Iterator[bpy.types.Scene]:
    """A new scene, marked as ours and gone afterwards, unless an undo or a new file has taken it away before."""
    scene = bpy.data.scenes.new(TEMPORARY)
    name = scene.name
    scene[IS_TEMPORARY] = True
    try:
        yield scene
    finally:
        if (remaining := bpy.data.scenes.get(name)) is not None:
            with handlers_silent():
                remove_scene(remaining)
