"""*Add Weather*: snow, thaw, wind, rain and sun over what is baked, as a modifier whose sliders act at once."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty

from ...core.errors import InputError
from .. import session, settings
from ..ground import baked_ground, ground_checks, weather, weather_modifier
from ..operator_base import OnBake, reports_errors

NONE = "NONE"
_CHOICES = [
    (NONE, "None", "No weather yet: set the sliders yourself. Weather that is there already keeps its values"),
    *((key, title, f"Set the sliders to {title}") for key, (title, _) in weather.PRESETS.items()),
]


class SOFTGROUND_OT_add_weather(OnBake, bpy.types.Operator):
    """Let weather act on the baked prints: snow covers and rounds them, warmth melts them, wind fills them, rain
    stands in them. A modifier after the playback, whose sliders act at once, with no new bake"""

    bl_idname = "softground.add_weather"
    bl_label = "Add Weather"
    bl_options = {"REGISTER", "UNDO"}

    preset: EnumProperty(name="Preset", description="Weather to start with", items=_CHOICES, default=NONE)

    @reports_errors
    def execute(self, context: bpy.types.Context) -> set[str]:
        if session.current().is_live:
            raise InputError("Live mode is on, and weather acts on prints that stay: press Keep, then add weather.")
        ground = settings.scene_of(context).softground.ground
        display_mesh = baked_ground.display_mesh_of(ground)
        ground_checks.check_playable(display_mesh)
        modifier = weather.add(ground)
        if self.preset != NONE:
            weather.set_preset(modifier, self.preset)
        return {"FINISHED"}


class SOFTGROUND_OT_remove_weather(bpy.types.Operator):
    """Remove the weather from the ground; the bake stays as it is"""

    bl_idname = "softground.remove_weather"
    bl_label = "Remove Weather"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is weather on the scene's ground."""
        ground = settings.scene_of(context).softground.ground
        cls.poll_message_set("There is no weather on the ground")
        return ground is not None and weather_modifier.modifier_of(baked_ground.display_mesh_of(ground)) is not None

    @reports_errors
    def execute(self, context: bpy.types.Context) -> set[str]:
        display_mesh = baked_ground.display_mesh_of(settings.scene_of(context).softground.ground)
        ground_checks.check_playable(display_mesh)
        weather_modifier.remove(display_mesh)
        return {"FINISHED"}


CLASSES = (SOFTGROUND_OT_add_weather, SOFTGROUND_OT_remove_weather)
