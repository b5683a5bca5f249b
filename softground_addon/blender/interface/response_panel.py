"""The sidebar's part on how characters respond to the ground, and its small operators."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import EnumProperty, FloatProperty

from ...core.composers.responses import NOTICEABLE_GAP_MM
from ...core.response.tilt import AUTHORS_TORQUES, PAPER_TORQUES, TiltGains, body_gains
from .. import settings
from ..animation_layer import nla_layer
from ..baking import root_motion
from ..response import response_job
from .character_editing import active_character
from .panel_base import ADVANCED, SidebarPanel

_SHOWN = 5
"""Frames with gaps that the panel lists."""


class SOFTGROUND_OT_tilt_preset(bpy.types.Operator):
    """Choose a set of values for how the body sways"""

    bl_idname = "softground.tilt_preset"
    bl_label = "Tilt Preset"
    bl_options = {"REGISTER", "UNDO"}

    source: EnumProperty(
        name="Values",
        items=[
            ("DEFAULT", "Human Balance", "0.6 Hz, damping 0.85"),
            ("AUTHORS", "Paper's Scene", "The gains of the scene that comes with the paper: 1300 and 600"),
            ("PAPER", "Paper as Printed", "The gains in the paper's text, 30 and 6: swings of many seconds"),
        ],
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        scene = settings.scene_of(context)
        character = active_character(scene)
        mass = character.mass if character else _ADULT_MASS
        gains = {
            "DEFAULT": TiltGains(),
            "AUTHORS": body_gains(*AUTHORS_TORQUES, mass=mass, arm=_ADULT_CENTRE),
            "PAPER": body_gains(*PAPER_TORQUES, mass=mass, arm=_ADULT_CENTRE),
        }[self.source]
        scene.softground.tilt.frequency, scene.softground.tilt.damping = gains.frequency, gains.damping
        return {"FINISHED"}


_ADULT_MASS = 77.5
"""Body mass of the paper's character [kg]."""
_ADULT_CENTRE = 1.0
"""Height of an adult's centre of mass, which the paper's gains are meant for [m]."""


class SOFTGROUND_OT_show_frame(bpy.types.Operator):
    """Go to this frame"""

    bl_idname = "softground.show_frame"
    bl_label = "Show Frame"
    bl_options = {"INTERNAL"}

    frame: FloatProperty(name="Frame", options={"HIDDEN"})

    def execute(self, context: bpy.types.Context) -> set[str]:
        settings.scene_of(context).frame_set(int(self.frame), subframe=self.frame % 1.0)
        return {"FINISHED"}


class SOFTGROUND_OT_slow_down(bpy.types.Operator):
    """Stretch the scene's time (Output > Frame Range > Time Stretching) to the speed at which people would walk on
    this ground. Bake again afterwards"""

    bl_idname = "softground.slow_down"
    bl_label = "Slow Down"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether a bake has told the speed."""
        cls.poll_message_set("Bake with Sink Feet or Grounding on first: the bake suggests a speed")
        character = active_character(settings.scene_of(context))
        return bool(character and character.armature and nla_layer.has_layer(character.armature))

    def execute(self, context: bpy.types.Context) -> set[str]:
        scene = settings.scene_of(context)
        character = active_character(scene)
        assert character is not None
        settings.slow_down(scene, response_job.speed_in(nla_layer.notes_of(character.armature)))
        return {"FINISHED"}


class SOFTGROUND_PT_response(SidebarPanel, bpy.types.Panel):
    """How the character responds to the ground that gives way"""

    bl_label = "Response"
    bl_parent_id = ADVANCED
    bl_options: Any = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether a character is chosen."""
        character = active_character(settings.scene_of(context))
        return bool(character and character.armature)

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.fields()
        scene = settings.scene_of(context)
        options, character = scene.softground, active_character(scene)
        row = layout.row(align=True)
        row.operator("softground.clean_feet", icon="CON_FLOOR")
        row.operator("softground.root_motion", icon="CON_FOLLOWPATH")
        if character and root_motion.speed_of(character.armature):
            row = layout.row()
            row.label(text=f"Travels at {root_motion.speed_of(character.armature):.2f} m/s", translate=False)
            row.operator("softground.remove_root_motion", text="", icon="X")
        layout.prop(options, "output")
        column = _group(layout, options.grounding, ("align", "lock"))
        column.separator()
        for part in settings.PERFORMANCE:
            column.prop(options.grounding, part)
        column = _group(layout, options.tilt, ("strength", "lateral", "frequency", "damping"))
        column.operator_menu_enum("softground.tilt_preset", "source")
        if character and nla_layer.has_layer(character.armature):
            layout.prop(character, "response_strength", slider=True)
            _layer_notes(layout, nla_layer.notes_of(character.armature))


def _group(layout: Any, group: Any, fields: tuple[str, ...]) -> Any:
    """A switch, and the fields that count while it is on."""
    layout.prop(group, "use")
    column = layout.column(align=True)
    column.active = group.use
    for field in fields:
        column.prop(group, field)
    return column


def _layer_notes(layout: Any, notes: dict[str, str]) -> None:
    """Which bone carries the body, and the frames where a gap is left."""
    box = layout.box().column(align=True)
    row = box.row()
    row.label(text="Keyed On", icon="BONE_DATA")
    row.label(text=notes.get(response_job.ROOT_CONTROL, ""), translate=False)
    speed = f"{response_job.speed_in(notes):.0%}"
    row = box.split(factor=0.72)
    row.label(text=f"Suggested Speed {speed}", icon="TIME", translate=False)
    row.operator("softground.slow_down", text="Apply")
    for frame, gap_mm, sole in response_job.worst_gaps_in(notes)[:_SHOWN]:
        if abs(gap_mm) >= NOTICEABLE_GAP_MM:
            shown = f"Frame {frame:g}: {gap_mm:.1f} mm under {sole}"
            box.operator("softground.show_frame", text=shown, icon="TIME", translate=False).frame = frame


CLASSES = (
    SOFTGROUND_OT_tilt_preset,
    SOFTGROUND_OT_show_frame,
    SOFTGROUND_OT_slow_down,
    SOFTGROUND_PT_response,
)
