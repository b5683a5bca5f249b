"""What is shown over the viewport, and what is written to files."""

from __future__ import annotations

import bpy

from .. import session
from ..operators.panel_base import AdvancedPanel


class SOFTGROUND_PT_overlay(AdvancedPanel, bpy.types.Panel):
    """What to show in the viewport"""

    bl_label = "Overlay"

    def draw_header(self, _context: bpy.types.Context) -> None:
        shown = session.current().show_overlay
        icon = "HIDE_OFF" if shown else "HIDE_ON"
        self.layout.operator("softground.overlay", text="", icon=icon, depress=shown, emboss=False)

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.fields()
        state = session.current()
        layout.active = state.show_overlay
        column = layout.column(align=True, heading="Show")
        for part in ("show_footfalls", "show_soles", "show_forces", "show_cells"):
            column.prop(state, part)


class SOFTGROUND_PT_output(AdvancedPanel, bpy.types.Panel):
    """Use the bake elsewhere"""

    bl_label = "Output"

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.fields()
        column = layout.column(align=True)
        column.operator("softground.export", icon="EXPORT")
        column.operator("softground.final_mesh", icon="MESH_DATA")
        column = layout.column(align=True)
        column.operator("softground.force_curves", icon="GRAPH")
        column.operator("softground.export_forces", icon="EXPORT")
        column = layout.column(align=True)
        column.operator("softground.event_markers", icon="MARKER_HLT")
        column.operator("softground.event_points", icon="POINTCLOUD_DATA")
        column.operator("softground.make_sound", icon="SOUND")
        layout.operator_menu_enum("softground.give_way", "kind", icon="STRANDS")
        layout.operator("softground.copy_bake_command", icon="COPYDOWN")


CLASSES = (SOFTGROUND_PT_overlay, SOFTGROUND_PT_output)
