"""Bases of operators: what they need before they can be used, and what becomes of their errors."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any, Literal, TypeVar

import bpy

from ..core.errors import SoftGroundError
from . import settings
from .characters import character_setup
from .ground import baked_ground
from .remedies import said
from .translation import translated

Operator = TypeVar("Operator", bound=bpy.types.Operator)
OperatorResult = set[Literal["RUNNING_MODAL", "CANCELLED", "FINISHED", "PASS_THROUGH", "INTERFACE"]]


def reports_errors(execute: Callable[[Operator, bpy.types.Context], OperatorResult]) -> Callable[..., OperatorResult]:
    """Turn a `SoftGroundError` into a report and CANCELLED; nothing else is caught."""

    @wraps(execute)
    def guarded(self: Operator, context: bpy.types.Context) -> OperatorResult:
        try:
            return execute(self, context)
        except SoftGroundError as error:
            self.report({"ERROR"}, said(error))
            return {"CANCELLED"}

    return guarded


class Needs:
    """Needs of an operator; those of several bases add up, from the left."""

    @classmethod
    def missing(cls, _context: bpy.types.Context) -> str:
        """What is missing before the operator can be used, empty if nothing; Blender says so at its button."""
        return ""


class OnShot(Needs):
    """Operators that need somebody who leaves prints."""

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        if not character_setup.characters_of(settings.options_of(context)):
            return "Add a character first"
        return super().missing(context)


class OnGround(Needs):
    """Operators that need a ground."""

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        if not settings.exists(settings.options_of(context).ground):
            return "Choose a ground first, or bake one"
        return super().missing(context)


class OnBake(Needs):
    """Operators that need a bake on the ground."""

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        ground = settings.options_of(context).ground
        if ground is None or not baked_ground.is_baked(ground):
            return "Bake the footprints first"
        return super().missing(context)


class Checked(Needs, bpy.types.Operator):
    """Operators that can be used when nothing is missing."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """True if nothing is missing."""
        if reason := cls.missing(context):
            cls.poll_message_set(translated(reason))
        return not reason

    def say(self, text: str, **values: Any) -> None:
        """Report a text in the language of the interface, with values in the place of its `{names}`."""
        self.report({"INFO"}, translated(text, **values))


class Act(Checked):
    """Operators that do one thing at once, which Undo takes back."""

    bl_options: Any = {"REGISTER", "UNDO"}

    @reports_errors
    def execute(self, context: bpy.types.Context) -> OperatorResult:
        self.act(context)
        return {"FINISHED"}

    def act(self, context: bpy.types.Context) -> None:
        """Do it; what is raised becomes a report."""
        raise NotImplementedError


def beside_file(what: str) -> Path:
    """A path beside the open file that begins with its name; one that was not saved yet is called as Blender does."""
    blend = Path(bpy.data.filepath or "untitled.blend")
    return blend.with_name(f"{blend.stem}_{what}")
