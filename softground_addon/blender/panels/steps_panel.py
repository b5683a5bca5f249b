"""The sidebar's list of steps, with what can be done to the one that is chosen."""

from __future__ import annotations

from typing import Any

import bpy

from .. import settings
from ..ground import baked_ground, baked_steps
from ..live import live
from ..operators.panel_base import SidebarPanel
from ..translation import translated

SHOWN = 9
"""Steps in the list, around the one that is chosen."""


class SOFTGROUND_PT_steps(SidebarPanel, bpy.types.Panel):
    """Single steps of the bake"""

    bl_label = "Steps"
    bl_order = 4
    bl_options: Any = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """True if there is a bake that is not about to change."""
        ground = settings.options_of(context).ground
        return ground is not None and not live.is_on() and baked_ground.is_baked(ground)

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.fields()
        layout.use_property_split = False
        scene = context.scene
        steps, chosen = baked_steps.of(scene.softground.ground), baked_steps.chosen(scene.softground.ground)
        _list(layout, steps, chosen)
        if len(chosen) > 1:
            layout.label(text=translated("{count} steps selected", count=len(chosen)), translate=False)
        layout.operator("softground.drag_step", icon="VIEW_PAN")
        if chosen:
            _buttons(layout, chosen)
        if any(step.is_edited for step in steps):
            layout.operator("softground.reset_steps", icon="LOOP_BACK")


def _list(layout: Any, steps: Any, chosen: list[baked_steps.BakedStep]) -> None:
    """Some of the steps, those around the first chosen one; with a way to those before and after."""
    at = chosen[0].number - 1 if chosen else 0
    first = max(0, min(at - SHOWN // 2, len(steps) - SHOWN))
    box = layout.box().column(align=True)
    box.label(text="Step   Frames   Depth   Force", icon="BLANK1")
    for step in steps[first : first + SHOWN]:
        _row(box, step, is_chosen=step in chosen)
    row = layout.row(align=True)
    for text, icon, other in (("Previous", "TRIA_LEFT", at - 1), ("Next", "TRIA_RIGHT", at + 1)):
        part = row.row(align=True)
        part.enabled = 0 <= other < len(steps)
        name = steps[other].name if part.enabled else ""
        part.operator("softground.choose_step", text=text, icon=icon).step = name


def _row(layout: Any, step: baked_steps.BakedStep, *, is_chosen: bool) -> None:
    """A step as one button: number, side, frames, depth, force."""
    first, last = step.frames
    nothing = translated("muted") if step.edit.mute else "" if step.footprint else translated("nothing left")
    depth = nothing or f"{step.depth_cm:.1f} cm"
    text = f"{step.number} {step.side or step.baked.sole}   {first}-{last}   {depth}   {step.baked.peak_force_n:,.0f} N"
    icon = "DUPLICATE" if step.is_copy else "MODIFIER" if step.is_edited else "BLANK1"
    icon = "HIDE_ON" if step.edit.mute else icon
    row = layout.row(align=True)
    row.alignment = "LEFT"
    row.operator(
        "softground.choose_step", text=text, icon=icon, depress=is_chosen, emboss=is_chosen, translate=False
    ).step = step.name


def _buttons(layout: Any, chosen: list[baked_steps.BakedStep]) -> None:
    """What can be done to the chosen steps."""
    row = layout.row(align=True)
    is_muted = chosen[0].edit.mute
    row.operator("softground.mute_step", depress=is_muted, icon="HIDE_ON" if is_muted else "HIDE_OFF").step = ""
    row.operator("softground.change_step", text="Change...", icon="MODIFIER").step = ""
    part = row.row(align=True)
    part.enabled = any(step.is_edited for step in chosen)
    icon = "TRASH" if any(step.is_copy for step in chosen) else "LOOP_BACK"
    part.operator("softground.reset_step", text="", icon=icon).step = ""
    row = layout.row(align=True)
    row.operator("softground.duplicate_step", icon="DUPLICATE").step = ""
    row.operator("softground.add_step", icon="CURSOR").step = ""


CLASSES = (SOFTGROUND_PT_steps,)
