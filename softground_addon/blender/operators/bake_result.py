"""The sidebar's part on what the bake that is on the ground came to."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

import bpy

from ...core.composers.responses import NOTICEABLE_GAP_MM
from .. import session, settings
from ..baking import bake_report
from ..ground import baked_ground, ground_mesh
from ..operator_base import OnBake
from ..translation import translated
from . import remedies


def draw(layout: Any, options: Any, summary: Any) -> None:
    """Show the summary of a bake, its warnings with remedies, and floating feet."""
    _result(layout, summary)
    warnings = ground_mesh.warnings_of(baked_ground.display_mesh_of(options.ground))
    _warnings(layout, warnings)
    remedies.draw(layout.column(align=True), options, warnings, session.current().stale)
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
    if floating < NOTICEABLE_GAP_MM or options.grounding.use or options.sink_feet:
        return
    box = layout.box().column(align=True)
    box.label(text=translated("Feet float up to {gap} mm", gap=f"{floating:.0f}"), icon="INFO", translate=False)
    box.label(text="above their prints", icon="BLANK1")
    box.operator("softground.sink_feet", text="Sink Feet Now", icon="TRIA_DOWN_BAR")


class SOFTGROUND_OT_show_warnings(OnBake, bpy.types.Operator):
    """Show what the bake found, and what to do about it"""

    bl_idname = "softground.show_warnings"
    bl_label = "Bake Warnings"
    bl_options = {"INTERNAL"}

    @classmethod
    def description(cls, context: bpy.types.Context, _properties: Any) -> str:
        """The warnings themselves."""
        return "\n".join(warnings_of(settings.scene_of(context).softground.ground))

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        context.window_manager.popup_menu(_draw_warnings, title=translated(self.bl_label), icon="ERROR")
        return {"FINISHED"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        for warning in warnings_of(settings.scene_of(context).softground.ground):
            self.report({"WARNING"}, warning)
        return {"FINISHED"}


def _draw_warnings(menu: Any, context: bpy.types.Context) -> None:
    """One after the other, in lines that fit on a screen."""
    for warning in warnings_of(settings.scene_of(context).softground.ground):
        column = menu.layout.column()
        for line in textwrap.wrap(warning, _WARNING_WIDTH):
            column.label(text=line, translate=False)
        remedies.draw(column, settings.scene_of(context).softground, [warning])


_WARNING_WIDTH = 90
"""Letters in a line of a warning."""


def warnings_of(ground: bpy.types.Object | None) -> list[str]:
    """Findings on the bake on the scene's ground."""
    return ground_mesh.warnings_of(baked_ground.display_mesh_of(ground)) if ground else []


CLASSES = (SOFTGROUND_OT_show_warnings,)
