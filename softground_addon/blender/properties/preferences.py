"""Settings for all files, in Blender's own preferences."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import BoolProperty, StringProperty

from ...core.ground import presets
from ..preset_files import user_folder
from ..settings import ADD_ON


def _names(_preferences: bpy.types.AddonPreferences, _context: bpy.types.Context, _typed: str) -> list[str]:
    """The presets that there are, by name; a file that is none is no choice."""
    return presets.names((presets.FOLDER, user_folder()))


class SoftGroundPreferences(bpy.types.AddonPreferences):
    """Preset that new scenes start with."""

    bl_idname = ADD_ON

    default_preset: StringProperty(
        name="Default Preset",
        description="Ground preset of new scenes, built-in or your own. The command line always starts with Snow",
        default=presets.DEFAULT,
        search=_names,
    )

    was_told: BoolProperty(name="Was Told", description="The user has been told where the panel is", options={"HIDDEN"})

    def draw(self, _context: bpy.types.Context) -> None:
        layout: Any = self.layout
        layout.use_property_split = True
        layout.label(text="Press N in the 3D viewport, then choose the SoftGround tab", icon="INFO")
        layout.prop(self, "default_preset")
        doors = layout.row()
        doors.operator("softground.open_manual", text="Manual", icon="HELP")
        doors.operator("softground.report_bug", icon="URL")
