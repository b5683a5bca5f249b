"""The sidebar's part on what the ground does beyond the paper, and on what is painted on it."""

from __future__ import annotations

from typing import Any

import bpy

from .. import settings
from ..ground import painted_ground
from .panel_base import SidebarPanel


class SOFTGROUND_PT_behaviour(SidebarPanel, bpy.types.Panel):
    """Rims that lean, sand that slides, snow that hardens: each is off at 0"""

    bl_label = "Behavior"
    bl_parent_id = "SOFTGROUND_PT_material"
    bl_options: Any = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        column = self.fields().column()
        options = settings.scene_of(context).softground
        column.prop(options, "pressure")
        for field in ("rim_bias", "repose_angle", "shortest_time", "hardening", "crust_stress_kpa", "firm_depth_cm"):
            column.prop(options.material, field)
        column.prop(options, "tread_mm")


class SOFTGROUND_PT_painted(SidebarPanel, bpy.types.Panel):
    """Vertex groups or float attributes of the ground by which its material is multiplied"""

    bl_label = "Painted"
    bl_parent_id = "SOFTGROUND_PT_ground"
    bl_options: Any = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return settings.scene_of(context).softground.ground is not None

    def draw(self, context: bpy.types.Context) -> None:
        column = self.fields().column()
        options = settings.scene_of(context).softground
        for field in ("stiffness", "layer_depth", "rim"):
            row = column.row()
            row.active = painted_ground.is_there(options.ground, getattr(options.painted, field))
            row.prop(options.painted, field, icon="GROUP_VERTEX")


CLASSES = (SOFTGROUND_PT_behaviour, SOFTGROUND_PT_painted)
