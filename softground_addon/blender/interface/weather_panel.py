"""The panel of weather over a bake: its sliders where the modifier has them."""

from __future__ import annotations

import bpy

from .. import compat, settings
from ..ground import baked_ground, weather, weather_modifier
from .panel_base import ADVANCED, SidebarPanel


class SOFTGROUND_MT_weather(bpy.types.Menu):
    """Weather to start with"""

    bl_label = "Weather Presets"

    def draw(self, _context: bpy.types.Context) -> None:
        for key, (title, _) in weather.PRESETS.items():
            self.layout.operator("softground.add_weather", text=title).preset = key


class SOFTGROUND_PT_weather(SidebarPanel, bpy.types.Panel):
    """Snow, rain, wind and thaw over the baked prints"""

    bl_label = "Weather"
    bl_parent_id = ADVANCED
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.fields()
        ground = settings.scene_of(context).softground.ground
        modifier = weather_modifier.modifier_of(baked_ground.display_mesh_of(ground)) if ground else None
        row = layout.row(align=True)
        if modifier is None:
            row.operator("softground.add_weather", icon="OUTLINER_OB_FORCE_FIELD").preset = "NONE"
            row.menu("SOFTGROUND_MT_weather", text="", icon="DOWNARROW_HLT")
            return
        row.menu("SOFTGROUND_MT_weather", text="Presets")
        row.operator("softground.remove_weather", text="", icon="X")
        column = layout.column(align=True)
        for name, identifier in weather_modifier.inputs_of(modifier).items():
            holder, path = compat.input_field(modifier, identifier)
            column.prop(holder, path, text=name)
        options = settings.scene_of(context).softground
        layout.prop(options, "steps_feel_weather")
        if not options.steps_feel_weather:
            note = layout.column()
            note.active = False
            note.label(text="Weather only covers the prints", icon="INFO")


CLASSES = (SOFTGROUND_MT_weather, SOFTGROUND_PT_weather)
