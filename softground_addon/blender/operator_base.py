"""Base of operators: when they can be used, and what becomes of their errors."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar, cast

import bpy

from ..core.errors import SoftGroundError
from . import settings
from .characters import character_setup
from .ground import baked_ground
from .remedies import said
from .translation import translated

Operator = TypeVar("Operator", bound=bpy.types.Operator)


def reports_errors(execute: Callable[[Operator, bpy.types.Context], set[str]]) -> Callable[..., set[str]]:
    """Turn a `SoftGroundError` into a report and CANCELLED; nothing else is caught."""

    @wraps(execute)
    def guarded(self: Operator, context: bpy.types.Context) -> set[str]:
        try:
            return execute(self, context)
        except SoftGroundError as error:
            self.report({"ERROR"}, said(error))
            return {"CANCELLED"}

    return guarded


class OnShot:
    """Operators that need somebody who leaves prints."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """True if there is any character in the scene."""
        cast("Any", cls).poll_message_set(translated("Add a character first"))
        return bool(character_setup.characters_of(settings.options_of(context)))


class OnGround:
    """Operators that need a ground."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """True if the scene has a ground."""
        cast("Any", cls).poll_message_set(translated("Choose a ground first, or bake one"))
        return settings.exists(settings.options_of(context).ground)


class OnBake:
    """Operators that need a bake on the ground."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """True if there is a bake on the scene's ground."""
        ground = settings.options_of(context).ground
        cast("Any", cls).poll_message_set(translated("Bake the footprints first"))
        return ground is not None and baked_ground.is_baked(ground)


def beside_file(what: str) -> Path:
    """A path beside the open file that begins with its name; one that was not saved yet is called as Blender does."""
    blend = Path(bpy.data.filepath or "untitled.blend")
    return blend.with_name(f"{blend.stem}_{what}")
