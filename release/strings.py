"""Texts of the interface, for its translators: `python -m release.strings` names what catalogues lack or need no more.

What classes register is asked of Blender; what code shows is read from the code. Texts that code composes go through
`translated`, as templates.
"""

from __future__ import annotations

import ast
import inspect
import re
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import bpy

import softground_addon
from softground_addon.blender import registration, translation
from softground_addon.blender.carried import marks_nodes
from softground_addon.blender.operators import modal_job
from softground_addon.blender.panels import ground_options_panel
from softground_addon.blender.playback import weather_inputs
from softground_addon.blender.reading import staleness
from softground_addon.core.ground import presets
from softground_addon.core.ground.surfaces import SURFACES
from softground_addon.core.motion.motion import JOINTS
from softground_addon.core.motion.units import UNITS

LANGUAGES = ("de_DE", "ja_JP", "zh_HANS")

_SOURCES = Path(softground_addon.__file__).parent / "blender"
_KEYWORDS = ("text", "heading", "title")
"""Arguments of layouts that are shown."""
_CALLS = {"translated": 0, "say": 0, "report": 1, "InputError": 0, "status_text_set": 0}
"""Functions that are given a text, and the place of it."""
_REASONS = ("why_no_start", "missing")
"""Functions that return a text to show."""
AS_IT_IS = ("SoftGround", "m/s", "[Esc]")
"""Texts that are the same in all languages."""


@cache
def shown() -> frozenset[str]:
    """All texts of the interface, in English; the add-on is registered."""
    texts = {text.strip() for text in (*_registered(), *_in_code(), *_in_tables())}
    return frozenset(text for text in texts if re.search("[a-z]{2}", text) and text not in AS_IT_IS)


def _registered() -> Iterator[str]:
    """Names and tooltips of classes and their properties."""
    for cls in registration.CLASSES:
        yield getattr(cls, "bl_label", "")
        if issubclass(cls, bpy.types.Operator):
            yield cls.bl_description if "description" not in vars(cls) or cls.bl_idname.endswith("again") else ""
            yield getattr(cls, "cancelled", "")
            yield from getattr(cls, "stage_names", {}).values()
        elif issubclass(cls, bpy.types.Menu):
            yield cls.__doc__ or ""
        for prop in _rna_of(cls).properties:
            if prop.identifier in _annotated(cls) and not prop.is_hidden and prop.type != "COLLECTION":
                yield from (prop.name if prop.name != prop.identifier else "", prop.description)
                for item in getattr(prop, "enum_items_static", ()):
                    yield from (item.name, item.description)


def _annotated(cls: type) -> set[str]:
    """Names of a class's properties."""
    annotations = (inspect.get_annotations(base).items() for base in cls.__mro__)
    return {name for of_base in annotations for name, annotation in of_base if annotation != "Any"}


def _rna_of(cls: Any) -> Any:
    """What Blender knows of a class and its properties."""
    if not issubclass(cls, bpy.types.Operator):
        return cls.bl_rna
    group, name = cls.bl_idname.split(".")
    return getattr(getattr(bpy.ops, group), name).get_rna_type()


def _in_tables() -> Iterator[str]:
    """Texts that the interface takes from tables."""
    yield from (preset.name for preset in map(presets.load, presets.FOLDER.glob("*.json")))
    yield from presets.SECTIONS.values()
    yield from ground_options_panel.DURATIONS.values()
    yield from modal_job.STAGE_NAMES.values()
    yield from staleness.CHANGED.values()
    yield from (surface.label.lower() for surface in SURFACES.values())
    yield from (joint.partition("_")[0].capitalize() for joint in JOINTS)
    yield from (*UNITS, "metres", "another unit")
    yield from (text for each in (*weather_inputs.INPUTS, *marks_nodes.INPUTS) for text in (each.name, each.meaning))


def _in_code() -> Iterator[str]:
    """Texts that code shows."""
    for path in _SOURCES.rglob("*.py"):
        if path.parent.name != "command_line":
            yield from shown_by(ast.parse(path.read_text(encoding="utf-8")))


def shown_by(tree: ast.Module) -> Iterator[str]:
    """Texts that the code of a module shows."""
    for scope in (tree, *(node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef))):
        for node in ast.walk(scope):
            for argument in _arguments(node):
                yield from _constants(argument, (scope, tree))
            if isinstance(node, ast.Return) and node.value and getattr(scope, "name", "") in _REASONS:
                yield from _constants(node.value, (scope, tree))


def _arguments(node: ast.AST) -> Iterator[ast.expr]:
    """Arguments of a call that are shown."""
    if isinstance(node, ast.Call):
        yield from (keyword.value for keyword in node.keywords if keyword.arg in _KEYWORDS)
        name = getattr(node.func, "id", getattr(node.func, "attr", ""))
        if len(node.args) > _CALLS.get(name, len(node.args)):
            yield node.args[_CALLS[name]]


def _constants(node: ast.expr, scopes: tuple[ast.AST, ...]) -> Iterator[str]:
    """Texts that an expression may be; a name is what is assigned to it."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    elif isinstance(node, ast.IfExp | ast.BoolOp):
        for part in (node.body, node.orelse) if isinstance(node, ast.IfExp) else node.values:
            yield from _constants(part, scopes)
    elif isinstance(node, ast.Name):
        for made in (made for scope in scopes for made in ast.walk(scope)):
            if isinstance(made, ast.Assign) and node.id in map(_name, made.targets) and not _name(made.value):
                yield from _constants(made.value, scopes)
            elif isinstance(made, ast.For) and isinstance(made.iter, ast.Tuple):
                yield from (text for part in made.iter.elts for text in _looped(node.id, made.target, part))


def _looped(name: str, target: ast.expr, part: ast.expr) -> Iterator[str]:
    """Text that a loop gives to a name."""
    if isinstance(target, ast.Tuple) and isinstance(part, ast.Tuple):
        for each, value in zip(target.elts, part.elts, strict=True):
            yield from _looped(name, each, value)
    elif _name(target) == name and isinstance(part, ast.Constant):
        yield str(part.value)


def _name(node: ast.expr) -> str:
    return node.id if isinstance(node, ast.Name) else ""


def faults(language: str) -> dict[str, list[str]]:
    """What a catalogue lacks, what it needs no more, and whose `{names}` are others than in English."""
    wanted, texts = shown(), translation.catalogue(language)

    def names(text: str) -> list[str]:
        return sorted(re.findall(r"\{\w*\}", text))

    return {
        "missing": sorted(wanted - texts.keys()),
        "superfluous": sorted(texts.keys() - wanted),
        "other names": sorted(text for text, translated in texts.items() if names(text) != names(translated)),
    }


if __name__ == "__main__":
    softground_addon.register()
    all_faults = [
        (language, what, text) for language in LANGUAGES for what, of in faults(language).items() for text in of
    ]
    sys.stdout.writelines(f"{language}: {what}: {text}\n" for language, what, text in all_faults)
    softground_addon.unregister()
    sys.exit(bool(all_faults))
