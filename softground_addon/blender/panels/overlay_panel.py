"""What SoftGround shows over the viewport, among Blender's own overlays."""

from __future__ import annotations

from typing import Any

import bpy

from .. import session


class SOFTGROUND_PT_overlay(bpy.types.Panel):
    """What SoftGround shows in the viewport"""

    bl_label = "SoftGround"
    bl_space_type = "VIEW_3D"
    bl_region_type = "HEADER"
    bl_parent_id = "VIEW3D_PT_overlay"

    def draw(self, _context: bpy.types.Context) -> None:
        layout: Any = self.layout
        state = session.current()
        icon = "HIDE_OFF" if state.show_overlay else "HIDE_ON"
        layout.operator("softground.overlay", icon=icon, depress=state.show_overlay)
        parts = layout.grid_flow(columns=2)
        parts.active = state.show_overlay
        for part in ("show_footfalls", "show_soles", "show_forces", "show_cells"):
            parts.prop(state, part)


CLASSES = (SOFTGROUND_PT_overlay,)
