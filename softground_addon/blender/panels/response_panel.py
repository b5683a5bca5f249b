"""Panels on how characters move on the ground, and their small operators."""

from __future__ import annotations

from math import isclose
from typing import Any

import bpy
from bpy.props import EnumProperty, FloatProperty

from ...core.composers import responses
from ...core.response.tilt import AUTHORS_TORQUES, PAPER_TORQUES, TiltGains, body_gains
from .. import session, settings
from ..animation_layer.constraint_layer import LayerKind, has_layer, notes_of
from ..baking import root_motion
from ..characters import import_fixes
from ..operator_base import Act
from ..operators.modal_job import BUSY
from ..operators.panel_base import CharacterPanel, SidebarPanel, active_character
from ..response import response_job
from ..translation import translated

CENTRE_HEIGHT = 0.62
"""Height of a standing body's centre of mass over that of its joints at rest, by the masses of de Leva (1996)."""
WADING_ARMS, WADING_TILT = 0.5, 0.1
"""Arms Out and Tilt's Strength of who wades: by eye; with more tilt knees bend further than without."""
_SHOWN = 5
"""Frames with gaps that the panel lists."""


class SOFTGROUND_OT_tilt_preset(Act):
    """Choose a set of values for how the body sways"""

    bl_idname = "softground.tilt_preset"
    bl_label = "Tilt Preset"

    source: EnumProperty(
        name="Values",
        items=[
            ("DEFAULT", "Human Balance", "0.6 Hz, damping 0.85"),
            ("AUTHORS", "Paper's Scene", "The gains of the scene that comes with the paper: 1300 and 600"),
            ("PAPER", "Paper as Printed", "The gains in the paper's text, 30 and 6: swings of many seconds"),
        ],
    )

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        scene = context.scene
        character, scale = active_character(scene.softground), scene.unit_settings.scale_length
        has_body = character and character.armature and character.mass > 0
        is_sized = has_body and import_fixes.sizes_of(scale, character)[0] > 0
        return "" if is_sized else "Choose a character with an armature and a mass first"

    def act(self, context: bpy.types.Context) -> None:
        scene = context.scene
        character = active_character(scene.softground)
        body = {
            "mass": character.mass,
            "arm": CENTRE_HEIGHT * import_fixes.sizes_of(scene.unit_settings.scale_length, character)[0],
        }
        gains = {
            "DEFAULT": TiltGains(),
            "AUTHORS": body_gains(*AUTHORS_TORQUES, **body),
            "PAPER": body_gains(*PAPER_TORQUES, **body),
        }[self.source]
        scene.softground.tilt.frequency, scene.softground.tilt.damping = gains.frequency, gains.damping


class SOFTGROUND_OT_response_preset(Act):
    """Choose how arms, trunk and speed respond to deep ground. Bake again afterwards"""

    bl_idname = "softground.response_preset"
    bl_label = "Response Preset"

    preset: EnumProperty(
        name="Preset",
        items=[
            (
                "AS_ANIMATED",
                "As Animated",
                "Sets Lift Knees, Hold Feet, Bend Knees and Arms Out to 0 and switches Tilt off. After Wading, gives "
                "back Tilt's Strength and the scene's time",
            ),
            (
                "WADING",
                "Wading",
                "Holds the arms out and lets the body sway: sets Arms Out to 0.5, Tilt on with a Strength of 0.1, and "
                "Lift Knees, Hold Feet and Bend Knees to 0. After a bake with Sink Feet or Grounding, stretches the "
                "scene's time to the Suggested Speed",
            ),
        ],
    )

    def act(self, context: bpy.types.Context) -> None:
        scene = context.scene
        options, wades = scene.softground, self.preset == "WADING"
        for part in settings.PERFORMANCE:
            setattr(options.grounding, part, 0.0)
        options.grounding.arms, options.tilt.use = WADING_ARMS * wades, wades
        if wades:
            _lend(options.tilt, WADING_TILT)
        else:
            _give_back(options.tilt, WADING_TILT)
        character = active_character(options)
        if wades and character and character.armature and has_layer(character.armature):
            settings.slow_down(scene, response_job.speed_in(notes_of(character.armature)))
        elif (scene.render.frame_map_old, scene.render.frame_map_new) == tuple(options.slowed_time):
            settings.slow_down(scene, 1.0)


def _lend(tilt: Any, strength: float) -> None:
    """Set the strength of Tilt, and note the user's own."""
    if tilt.own_strength < 0.0:
        tilt.own_strength = tilt.strength
    tilt.strength = strength


def _give_back(tilt: Any, lent: float) -> None:
    """Set the strength of Tilt to the user's own again, unless it was changed since; nothing where none was lent."""
    default = tilt.bl_rna.properties["strength"].default
    if tilt.own_strength >= 0.0 and isclose(tilt.strength, lent, rel_tol=1e-6):
        tilt.strength = tilt.own_strength
        if tilt.strength == default:
            tilt.property_unset("strength")
    tilt.property_unset("own_strength")


class SOFTGROUND_OT_show_frame(Act):
    """Go to this frame"""

    bl_idname = "softground.show_frame"
    bl_label = "Show Frame"
    bl_options = {"INTERNAL"}

    frame: FloatProperty(name="Frame", options={"HIDDEN"})

    def act(self, context: bpy.types.Context) -> None:
        context.scene.frame_set(int(self.frame), subframe=self.frame % 1.0)


class SOFTGROUND_OT_slow_down(Act):
    """Stretch the scene's time (Output > Frame Range > Time Stretching) to the speed at which people would walk on
    this ground. Bake again afterwards"""

    bl_idname = "softground.slow_down"
    bl_label = "Slow Down"

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        character = active_character(settings.options_of(context))
        is_known = character and character.armature and has_layer(character.armature)
        return "" if is_known else "Bake with Sink Feet or Grounding on first: the bake suggests a speed"

    def act(self, context: bpy.types.Context) -> None:
        scene = context.scene
        character = active_character(scene.softground)
        assert character is not None
        settings.slow_down(scene, response_job.speed_in(notes_of(character.armature)))


class _RemoveLayer(Act):
    """Base of the operators that remove layers of some kinds from all characters."""

    kinds = tuple(LayerKind)  # without an annotation: Blender would keep what it names, and hang as Python exits

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        characters = settings.options_of(context).characters
        if not any(character.armature and has_layer(character.armature, cls.kinds[0]) for character in characters):
            return "No character has this layer"
        return BUSY if session.current().is_baking else ""

    def act(self, context: bpy.types.Context) -> None:
        response_job.remove_layers(context.scene, *self.kinds)


class SOFTGROUND_OT_remove_root_motion(_RemoveLayer):
    """Remove the travel, and the layers that were made with it: the animation is as it was before"""

    bl_idname = "softground.remove_root_motion"
    bl_label = "Remove Root Motion"


class SOFTGROUND_OT_remove_clean_feet(_RemoveLayer):
    """Remove the cleaning: feet slide again as they are animated"""

    bl_idname = "softground.remove_clean_feet"
    bl_label = "Remove Clean Feet"
    kinds = (LayerKind.CLEAN_FEET,)


class SOFTGROUND_OT_remove_response(_RemoveLayer):
    """Remove the response to the ground; the footprints stay"""

    bl_idname = "softground.remove_response"
    bl_label = "Remove Response"
    kinds = (LayerKind.RESPONSE,)


_REMOVE: dict[LayerKind, Any] = {
    LayerKind.ROOT_MOTION: SOFTGROUND_OT_remove_root_motion,
    LayerKind.CLEAN_FEET: SOFTGROUND_OT_remove_clean_feet,
    LayerKind.RESPONSE: SOFTGROUND_OT_remove_response,
}


class SOFTGROUND_PT_feet(SidebarPanel, bpy.types.Panel):
    """Feet that neither slide nor float, how they wade, and the layers that move them"""

    bl_label = "Feet"
    bl_order = 2
    bl_options: Any = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.fields()
        options = settings.options_of(context)
        character = active_character(options)
        if character and character.armature:
            _of_rig(layout, options, character)
        column = layout.column(align=True)
        column.operator("softground.add_contact", icon="PLUS")
        column.operator("softground.open_settings", text="More of the Character", icon="PHYSICS").of = "CHARACTER"


def _of_rig(layout: Any, options: Any, character: Any) -> None:
    """What corrects the feet of a rig, how it wades, and its layers."""
    row = layout.row(align=True)
    row.operator("softground.clean_feet", icon="CON_FLOOR")
    row.operator("softground.root_motion", icon="CON_FOLLOWPATH")
    if root_motion.speed_of(character.armature):
        speed = translated("Travels at {speed} m/s", speed=f"{root_motion.speed_of(character.armature):.2f}")
        layout.label(text=speed, translate=False)
    column = layout.column(align=True)
    column.active = options.grounding.use or settings.sinks_feet(options)
    for part in settings.PERFORMANCE:
        column.prop(options.grounding, part)
    _layers(layout, character)


class SOFTGROUND_PT_response(CharacterPanel, bpy.types.Panel):
    """How characters respond to the ground that gives way"""

    bl_label = "Response"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """True if that character has an armature."""
        return super().poll(context) and active_character(settings.options_of(context)).armature is not None

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.fields()
        options = settings.options_of(context)
        layout.prop(options, "output")
        layout.operator_menu_enum("softground.response_preset", "preset")
        column = _group(layout, options.grounding, ("align", "lock"))
        column.active |= settings.sinks_feet(options)
        column = _group(layout, options.tilt, ("strength", "lateral", "frequency", "damping"))
        column.operator_menu_enum("softground.tilt_preset", "source")


def _layers(layout: Any, character: Any) -> None:
    """The layers on a character, each with its strength and a button that removes it; what the response notes."""
    kinds = [kind for kind in LayerKind if has_layer(character.armature, kind)]
    for kind in kinds:
        row = layout.row(align=True)
        row.prop(character, kind.strength, slider=True)
        row.operator(_REMOVE[kind].bl_idname, text="", icon="X")
    if LayerKind.RESPONSE in kinds:
        _layer_notes(layout, notes_of(character.armature))


def _group(layout: Any, group: Any, fields: tuple[str, ...]) -> Any:
    """A switch, and the fields that count while it is on."""
    layout.prop(group, "use")
    column = layout.column(align=True)
    column.active = group.use
    for field in fields:
        column.prop(group, field)
    return column


def _layer_notes(layout: Any, notes: dict[str, str]) -> None:
    """The bone that carries the body, and the frames where a gap remains."""
    box = layout.box().column(align=True)
    row = box.row()
    row.label(text="Keyed On", icon="BONE_DATA")
    row.label(text=notes.get(response_job.ROOT_CONTROL, ""), translate=False)
    speed = f"{response_job.speed_in(notes):.0%}"
    row = box.split(factor=0.72)
    row.label(text=translated("Suggested Speed {speed}", speed=speed), icon="TIME", translate=False)
    row.operator("softground.slow_down", text="Apply")
    for frame, gap_mm, sole in response_job.worst_gaps_in(notes)[:_SHOWN]:
        if abs(gap_mm) >= responses.NOTICEABLE_GAP_MM:
            shown = translated(
                "Frame {frame}: {gap} mm under {sole}", frame=f"{frame:g}", gap=f"{gap_mm:.1f}", sole=sole
            )
            box.operator("softground.show_frame", text=shown, icon="TIME", translate=False).frame = frame


CLASSES = (
    SOFTGROUND_OT_tilt_preset,
    SOFTGROUND_OT_response_preset,
    SOFTGROUND_OT_show_frame,
    SOFTGROUND_OT_slow_down,
    *_REMOVE.values(),
    SOFTGROUND_PT_feet,
    SOFTGROUND_PT_response,
)
