"""The remedies that warnings name, as buttons and fields."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from ..characters.character_setup import title_of
from ..translation import translated

_OF_CHARACTER = {"Walk Ahead": "softground.walk_ahead", r"Scale by ([\d.]*\d)": "softground.fix_scale"}
"""Operators on the character that a warning names, by what it calls their buttons."""

_OPERATORS = {
    "Use Selected": "softground.use_as_ground",
    "Add Contact": "softground.add_contact",
    "Reset All Steps": "softground.reset_steps",
    "[Cc]lear the [Bb]ake": "softground.clear_bake",
    "[Cc]reate the [Gg]round": "softground.create_ground",
}

_FIELDS = {"cell size": "cell_size", "set Detail": "detail", "switch Sink Feet off": "sink_feet"}
"""Settings of the scene, by the words for them."""


def draw(layout: Any, options: Any, warnings: Sequence[str], changed: str = "") -> None:
    """Show each remedy once, but for those of characters that are named among what has `changed` since the bake."""
    layout.operator_context = "INVOKE_DEFAULT"  # which is another one in a popup
    for character in options.characters:
        name = f"'{title_of(character)}'"
        text = "" if name in changed else "\n".join(warning for warning in warnings if name in warning)
        for words, operator in _OF_CHARACTER.items():
            if match := re.search(words, text):
                layout.operator(operator, text=_button(match), translate=False).character = title_of(character)
        if "Set Mass" in text:
            layout.prop(character, "mass")
    text = "\n".join(warnings)
    listed = {item.object.name for item in options.hard_grounds if item.object}
    for name in dict.fromkeys(re.findall(r"Press Add '([^']+)'", text)):
        if name not in listed:
            layout.operator(
                "softground.add_hard_ground", text=translated("Add '{name}'", name=name), translate=False
            ).object = name
    for words, operator in _OPERATORS.items():
        if re.search(words, text):
            button = layout.operator(operator)
            if operator == "softground.create_ground":
                button.use_selected = False
    for words, field in _FIELDS.items():
        if words in text:
            layout.prop(options, field)


def _button(match: re.Match[str]) -> str:
    """What a warning calls a button, in the language of the interface."""
    return translated("Scale by {factor}", factor=match[1]) if match.lastindex else translated(match[0])
