"""The panel of weather over a bake: its sliders where the modifier has them."""

from __future__ import annotations

import bpy

from .. import compat, settings
from ..ground import baked_ground
from ..live import live
from ..operators.panel_base import SidebarPanel
from ..playback import weather_modifier
from ..translation import translated
from ..weather import ground_weather as weather
from ..weather import weather_keys


class SOFTGROUND_MT_weather(bpy.types.Menu):
    """Weather to start with"""

    bl_label = "Weather Presets"

    def draw(self, _context: bpy.types.Context) -> None:
        for key, (title, _) in weather.PRESETS.items():
            self.layout.operator("softground.add_weather", text=title).preset = key


_UNITS = {"Snowfall": "cm/h", "Temperature": "°C", "Wind": "m/s", "Rain": "mm/h", "Drying": "mm/h", "Water Table": "cm"}


class SOFTGROUND_PT_weather(SidebarPanel, bpy.types.Panel):
    """Snow, rain, wind and thaw over the baked prints"""

    bl_label = "Weather"
    bl_order = 4
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """True if there is a bake that is not about to change."""
        ground = context.scene.softground.ground
        return ground is not None and not live.is_on() and baked_ground.is_baked(ground)

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.fields()
        ground = settings.options_of(context).ground
        modifier = weather_modifier.modifier_of(baked_ground.display_mesh_of(ground)) if ground else None
        row = layout.row(align=True)
        if modifier is None:
            row.operator("softground.add_weather", icon="OUTLINER_OB_FORCE_FIELD").preset = "NONE"
            row.menu("SOFTGROUND_MT_weather", text="", icon="DOWNARROW_HLT")
            return
        row.menu("SOFTGROUND_MT_weather", text="Presets")
        row.operator("softground.remove_weather", text="", icon="X")
        options = context.scene.softground
        layout.use_property_split = False  # names with units are long
        column = layout.column(align=True)
        column.active = not weather_keys.is_keyed(modifier, "Snowfall", "Time Scale")
        column.prop(options, "snow_cm", text="Snow Depth at the End (cm)", slider=True)
        column.prop(options, "weather_hours", slider=True)
        column = layout.column(align=True)
        for name, identifier in weather_modifier.inputs_of(modifier).items():
            if name == "Time Scale" and not weather_keys.is_keyed(modifier, name):
                continue  # Shot Lasts sets it
            holder, path = compat.input_field(modifier, identifier)
            text = f"{translated(name)} ({_UNITS[name]})" if name in _UNITS else translated(name)
            column.prop(holder, path, text=text, slider=name == "Halo", translate=False)
        options = settings.options_of(context)
        layout.prop(options, "steps_feel_weather")
        if not options.steps_feel_weather:
            note = layout.column(align=True)
            note.active = False
            note.label(text="Steps are pressed as without weather", icon="INFO")
            note.label(text="Tick the box above, and bake again", icon="BLANK1")


CLASSES = (SOFTGROUND_MT_weather, SOFTGROUND_PT_weather)
