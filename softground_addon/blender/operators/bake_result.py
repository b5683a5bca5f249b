"""The sidebar's part on what the bake that is on the ground came to."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from typing import Any

import bpy

from ...core.composers import responses
from .. import session
from ..baking import bake_report
from ..characters import character_setup
from ..ground import baked_ground, ground_mesh
from ..operator_base import Act, OnBake, OperatorResult
from ..translation import translated
from .panel_base import active_character


def draw(layout: Any, options: Any, summary: Any) -> None:
    """Show the summary of a bake, its warnings with remedies, and floating feet."""
    _result(layout, summary)
    warnings = ground_mesh.warnings_of(baked_ground.display_mesh_of(options.ground))
    _warnings(layout, warnings)
    draw_remedies(layout.column(align=True), options, warnings, session.current().stale, in_panel=True)
    _floating_feet(layout, options, summary)


def _result(layout: Any, summary: Any) -> None:
    """Result of the bake that is on the ground."""
    typical, most = (f"{depth * 100:.1f} cm" for depth in (summary[bake_report.TYPICAL], summary["max_depth_m"]))
    depth = typical if typical == most else translated("{typical}, up to {most}", typical=typical, most=most)
    layout.label(
        text=translated("{count} steps, {depth}", count=f"{summary['steps']:.0f}", depth=depth),
        icon="CHECKMARK",
        translate=False,
    )


def _warnings(layout: Any, warnings: Sequence[str]) -> None:
    """Count of a bake's warnings, which are long, and shown when asked for."""
    if warnings:
        text = translated("{count} Warnings", count=len(warnings)) if len(warnings) > 1 else translated("1 Warning")
        layout.operator("softground.show_warnings", text=text, icon="ERROR", translate=False)


def _floating_feet(layout: Any, options: Any, summary: Any) -> None:
    """Height of the feet above the prints that they made, and a button that lets them down."""
    floating = summary.get(bake_report.FLOATING, 0.0)
    if floating < responses.NOTICEABLE_GAP_MM or options.grounding.use or options.sink_feet:
        return
    box = layout.box().column(align=True)
    box.label(text=translated("Feet float up to {gap} mm", gap=f"{floating:.0f}"), icon="INFO", translate=False)
    box.label(text="above their prints", icon="BLANK1")
    box.operator("softground.sink_feet", text="Sink Feet Now", icon="TRIA_DOWN_BAR")


class SOFTGROUND_OT_show_warnings(OnBake, Act):
    """Show what the bake found, and what to do about it"""

    bl_idname = "softground.show_warnings"
    bl_label = "Bake Warnings"
    bl_options = {"INTERNAL"}

    @classmethod
    def description(cls, context: bpy.types.Context, _properties: Any) -> str:
        """The warnings themselves."""
        return "\n".join(warnings_of(context.scene.softground.ground))

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> OperatorResult:
        context.window_manager.popup_menu(_draw_warnings, title=translated(self.bl_label), icon="ERROR")
        return {"FINISHED"}

    def act(self, context: bpy.types.Context) -> None:
        for warning in warnings_of(context.scene.softground.ground):
            self.report({"WARNING"}, warning)


def _draw_warnings(menu: Any, context: bpy.types.Context) -> None:
    """One after the other, in lines that fit on a screen."""
    for warning in warnings_of(context.scene.softground.ground):
        column = menu.layout.column()
        for line in textwrap.wrap(warning, _WARNING_WIDTH):
            column.label(text=line, translate=False)
        draw_remedies(column, context.scene.softground, [warning])


_WARNING_WIDTH = 90
"""Letters in a line of a warning."""


def warnings_of(ground: bpy.types.Object | None) -> list[str]:
    """Findings on the bake on the scene's ground."""
    return ground_mesh.warnings_of(baked_ground.display_mesh_of(ground)) if ground else []


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
_BESIDE_BAKE = "sink_feet"
"""Setting that the panel has in any case."""


def draw_remedies(
    layout: Any, options: Any, warnings: Sequence[str], changed: str = "", *, in_panel: bool = False
) -> None:
    """Show each remedy once, but for those of characters that are named among what has `changed` since the bake.

    What the panel has above is not repeated `in_panel`: the mass of the active character, and Sink Feet.
    """
    above = active_character(options) if in_panel else None
    layout.operator_context = "INVOKE_DEFAULT"  # which is another one in a popup
    for character in options.characters:
        name = f"'{character_setup.title_of(character)}'"
        text = "" if name in changed else "\n".join(warning for warning in warnings if name in warning)
        for words, operator in _OF_CHARACTER.items():
            if match := re.search(words, text):
                layout.operator(operator, text=_button(match), translate=False).character = character_setup.title_of(
                    character
                )
        if "Set Mass" in text and character != above:
            layout.prop(character, "mass")
    text = "\n".join(warnings)
    listed = {item.object.name for item in (*options.hard_grounds, *options.grounds) if item.object}
    for name in dict.fromkeys(re.findall(r"Press Add '([^']+)'", text)):
        if name not in listed:
            hard, soft = translated("Add '{name}'", name=name), translated("Add '{name}' as Ground", name=name)
            layout.operator("softground.add_hard_ground", text=hard, translate=False).object = name
            layout.operator("softground.add_ground", text=soft, translate=False).object = name
    for words, operator in _OPERATORS.items():
        if re.search(words, text):
            button = layout.operator(operator)
            if operator == "softground.create_ground":
                button.use_selected = False
    for words, field in _FIELDS.items():
        if words in text and not (in_panel and field == _BESIDE_BAKE):
            layout.prop(options, field)


def _button(match: re.Match[str]) -> str:
    """Name of a button in a warning, in the language of the interface."""
    return translated("Scale by {factor}", factor=match[1]) if match.lastindex else translated(match[0])


CLASSES = (SOFTGROUND_OT_show_warnings,)
