"""Frame handlers, put aside while a character is read; those of others that may move it have their turn to act."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import bpy

from ...core.findings import Finding

_CHANNELS = re.compile("location|rotation|scale|matrix|pose|bone|influence|value|foreach_set|frame_set")
"""What the code names of a handler that moves something."""


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


def moving_handlers() -> list[Callable[..., None]]:
    """Frame handlers of other add-ons and scripts that may move what is read, by what their code names."""
    package = (__package__ or "").rpartition(".blender.")[0]
    handlers = (*bpy.app.handlers.frame_change_pre, *bpy.app.handlers.frame_change_post)
    theirs = [handler for handler in handlers if not str(handler.__module__).startswith(f"{package}.")]
    return [handler for handler in theirs if any(map(_CHANNELS.match, _names_in(handler)))]


def _names_in(function: Any) -> set[str]:
    """The names in the code of a function, and of those of its module that it calls."""
    waiting, known, names = [function], set(), set()
    while waiting:
        function = inspect.unwrap(waiting.pop())
        code = getattr(function, "__code__", None)
        if code is None or code in known:
            continue
        known.add(code)
        names.update(code.co_names)
        waiting += [function.__globals__[name] for name in code.co_names if callable(function.__globals__.get(name))]
    return names


def handled_finding(name: str) -> Finding:
    modules = dict.fromkeys(str(handler.__module__) for handler in moving_handlers())
    return Finding(
        "frame_handler",
        "note",
        f"'{name}' is moved by a frame handler of {' or '.join(map(repr, modules))}, and was read with it.",
        "Bake again when it moves otherwise: that does not show as outdated.",
    )


def let_handlers_act(scene: bpy.types.Scene, frame: int, subframe: float = 0.0) -> None:
    """Let the handlers of others that may move what is read act at a frame, with a scene as the current one.

    What Blender then updates has the keys of the user's frame: the scene is yet to be set to the frame once more.
    """
    with handlers_silent(moving_handlers()), bpy.context.temp_override(scene=scene, view_layer=scene.view_layers[0]):
        scene.frame_set(frame, subframe=subframe)
