"""Presets of the material slots of a ground."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import bpy
from bpy.props import EnumProperty, IntProperty

from ...core.ground import presets
from .. import ground_slots, settings
from ..ground_slots import HARD
from ..operator_base import Act
from ..preset_files import listed, user_folder
from ..state import state

AS_GROUND = "AS_GROUND"
"""In place of a preset: what the rest of the ground is made of."""


def _choices(_operator: Any, _context: bpy.types.Context | None) -> list[tuple[str, str, str]]:
    """The presets by the names of their files; Blender keeps no copy of these texts, so that the state has to."""
    ours = {preset: path.stem for path, preset in listed(presets.FOLDER)[0]}
    yours = {preset: path.stem for path, preset in listed(user_folder())[0]}
    items = [
        (AS_GROUND, "As the Ground", "The preset of the ground"),
        (HARD, "Hard Floor", "It bears and takes no print: stone, concrete, a deck"),
    ]
    for section, title in presets.SECTIONS.items():
        items += _rows(title, ours, presets.soft_to_firm(each for each in ours if each.section == section))
    state.preset_choices = items + (_rows("Your Own", yours, yours) if yours else [])
    return state.preset_choices


def _rows(title: str, files: dict[presets.Preset, str], shown: Iterable[presets.Preset]) -> list[tuple[str, str, str]]:
    return [("", title, ""), *((files[preset], preset.name, preset.source) for preset in shown)]


class SOFTGROUND_OT_region_preset(Act):
    """Choose what the ground is made of where it has this material"""

    bl_idname = "softground.region_preset"
    bl_label = "Ground of Material"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    slot: IntProperty(name="Slot", description="Number of the material slot", min=0, options={"SKIP_SAVE"})
    preset: EnumProperty(name="Preset", description="What the ground is made of there", items=_choices)

    def act(self, context: bpy.types.Context) -> None:
        ground = settings.options_of(context).ground
        ground_slots.choose(
            ground if settings.exists(ground) else None, self.slot, "" if self.preset == AS_GROUND else self.preset
        )


CLASSES = (SOFTGROUND_OT_region_preset,)
