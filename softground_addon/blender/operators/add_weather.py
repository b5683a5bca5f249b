"""*Add Weather*: snow, thaw, wind, rain and sun over what is baked, as a modifier whose sliders act at once."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty

from ...core.errors import InputError
from .. import jobs, session, settings
from ..ground import baked_ground, ground_checks
from ..operator_base import Act, OnBake
from ..playback import weather_inputs, weather_modifier
from ..weather import ground_weather as weather
from ..weather import weather_result
from .modal_job import Reading, Reports

NONE = "NONE"
_CHOICES = [
    (NONE, "None", "A shot of eight hours: set the sliders. Weather that is there already keeps its values"),
    *((key, title, f"Set the sliders to {title}") for key, (title, _) in weather_inputs.PRESETS.items()),
]


class SOFTGROUND_OT_add_weather(OnBake, Reading):
    """Let weather act on the baked prints: snow covers and rounds them, warmth melts them, wind fills them, rain
    stands in them. A modifier after the playback, whose sliders act at once, with no new bake. Esc cancels"""

    bl_idname = "softground.add_weather"
    bl_label = "Add Weather"

    preset: EnumProperty(name="Preset", description="Weather to start with", items=_CHOICES, default=NONE)

    def _job_of(self) -> jobs.Job[Reports]:
        if session.current().is_live:
            raise InputError("Live mode is on, and weather acts on prints that stay: press Keep, then add weather.")
        ground = self.scene.softground.ground
        ground_checks.check_playable(baked_ground.display_mesh_of(ground))
        is_new, preset = weather_result.modifier_of(ground) is None, "" if self.preset == NONE else self.preset
        yield from weather.adding(ground, preset=preset)
        if is_new and not preset:
            weather_result.set_hours(self.scene.softground, weather_result.NIGHT)
        return []


class SOFTGROUND_OT_remove_weather(Act):
    """Remove the weather from the ground; the bake stays as it is"""

    bl_idname = "softground.remove_weather"
    bl_label = "Remove Weather"

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        ground = settings.options_of(context).ground
        has_weather = ground is not None and weather_modifier.modifier_of(baked_ground.display_mesh_of(ground))
        return "" if has_weather else "There is no weather on the ground"

    def act(self, context: bpy.types.Context) -> None:
        ground = settings.options_of(context).ground
        ground_checks.check_playable(baked_ground.display_mesh_of(ground))
        weather.remove(ground)


CLASSES = (SOFTGROUND_OT_add_weather, SOFTGROUND_OT_remove_weather)
