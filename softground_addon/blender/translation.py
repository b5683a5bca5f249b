"""The interface in other languages: catalogues of `languages/`, for Blender's own translation.

A catalogue is read once Blender's interface is in its language; in English none is.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import bpy

from .state import state

FOLDER = Path(__file__).parents[1] / "languages"
"""Catalogues: `{locale}.json`, each English text with its translation."""

CONTEXT = "SoftGround"
"""Where texts are looked up that Blender has in another sense: a print's rim, a character's step."""

_MODULE = __package__
_CONTEXTS = ("*", "Operator", CONTEXT)
"""Where Blender looks texts up: names, labels and tooltips; buttons; and what says so."""
_OWNER = object()
"""Owner of the subscription to the language of the preferences."""


def translated(text: str, /, **values: Any) -> str:
    """A text in the language of the interface, with values in the place of its `{names}`."""
    ours = str(bpy.app.translations.pgettext_iface(text, CONTEXT))  # type: ignore[func-returns-value]
    return ours.format(**values) if values else ours


def catalogue(language: str) -> dict[str, str]:
    """Translations by their English texts; none where there is no catalogue of the language."""
    path = FOLDER / f"{language}.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


def follow() -> None:
    """Hand Blender the catalogue of its language, unless it has it."""
    language = bpy.app.translations.locale
    if language in state.catalogues or not (texts := catalogue(language)):
        return
    if state.catalogues:
        bpy.app.translations.unregister(_MODULE)
    state.catalogues[language] = {
        (context, text): translation for text, translation in texts.items() for context in _CONTEXTS
    }
    catalogues: Any = state.catalogues
    bpy.app.translations.register(_MODULE, catalogues)


def watch() -> None:
    """Follow the language, and what is chosen in the preferences until another file is opened."""
    follow()
    if not bpy.app.background:  # where nothing would call, and the subscription would keep Python from ending
        bpy.msgbus.clear_by_owner(_OWNER)
        language: Any = (bpy.types.PreferencesView, "language")
        bpy.msgbus.subscribe_rna(key=language, owner=_OWNER, args=(), notify=follow)


def unregister() -> None:
    """Take the catalogues back."""
    bpy.msgbus.clear_by_owner(_OWNER)
    if state.catalogues:
        bpy.app.translations.unregister(_MODULE)
        state.catalogues.clear()
