"""The sidebar: what to set for a shot, in the order of work; and a character's own settings, in Properties > Physics.

Panels read and show; nothing is computed or changed in `draw`.
"""

from __future__ import annotations

import textwrap
from typing import Any

import bpy

from ...core.ground.surfaces import SURFACES
from ...core.motion import motion
from ...core.motion.units import scale_to_metres, wrong_unit
from .. import session, settings
from ..baking import bake_report
from ..characters import character_setup, import_fixes, selection
from ..ground import baked_ground, ground_mesh, still_ground
from ..live import live
from ..operators import bake_result, prediction
from ..operators.panel_base import (
    CharacterPanel,
    Listed,
    SidebarPanel,
    active_character,
    active_sole,
    belongs_to,
    chosen_of,
    draw_list,
)
from ..setup.character_editing import suggested_mass
from ..translation import translated
from . import outdated, preset_menu

_LARGE = 1.4
"""Height of the buttons of the two clicks, and of the progress in the place of the second, in rows."""


class SOFTGROUND_UL_characters(Listed):
    """Characters by name, each with its armature."""

    def draw_row(self, layout: Any, item: Any) -> None:
        icon = "MESH_UVSPHERE" if settings.is_prop(item) else "OUTLINER_OB_MESH" if item.body else "ERROR"
        icon = "ARMATURE_DATA" if item.armature else icon
        layout.prop(item.armature or item, "name", text="", emboss=False, icon=icon)


class SOFTGROUND_UL_soles(Listed):
    """Soles by name, each with its side."""

    def draw_row(self, layout: Any, item: Any) -> None:
        icon = "MESH_CUBE" if item.object else "BONE_DATA" if item.kind == "LIMB" else "MOD_DYNAMICPAINT"
        layout.prop(item, "name", text="", emboss=False, icon=icon)
        layout.label(text=item.bone or (item.object.name if item.object else ""), translate=False)


class SOFTGROUND_UL_joints(Listed):
    """Joints of a body, each with its bone; those that have none stand out."""

    def draw_row(self, layout: Any, item: Any) -> None:
        split = layout.split(factor=0.45)
        split.label(text=_joint_label(item.name), icon="BONE_DATA" if item.bone else "ERROR", translate=False)
        split.label(text=item.bone, translate=False)

    def filter_items(self, _context: Any, data: Any, name: Any) -> Any:
        """Sort them from the hips outward."""
        place = {joint: number for number, joint in enumerate(motion.JOINTS)}
        joints = [place.get(joint.name, len(place)) for joint in getattr(data, name)]
        order = sorted(range(len(joints)), key=joints.__getitem__)
        return [], [order.index(number) for number in range(len(joints))]


class SOFTGROUND_PT_character(SidebarPanel, bpy.types.Panel):
    """Characters that leave footprints"""

    bl_label = "Character"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.fields()
        options = settings.options_of(context)
        if not options.characters:
            nobody = selection.shows_nobody(context.selected_objects)
            if nobody:
                layout.label(text="Select an animated character", icon="INFO")
            column = layout.column()
            column.scale_y = _LARGE
            column.operator("softground.add_character", icon="ARMATURE_DATA")
            if nobody:
                layout.operator("softground.add_sample_scene", icon="OUTLINER_OB_ARMATURE")
            return
        draw_list(layout, options, "characters", "active_character", "character", rows=1, most=5)
        character = active_character(options)
        if character:
            if not settings.is_set_up(character):
                layout.label(text="Its rig was deleted: undo, or remove the character with -", icon="ERROR")
            elif not any(sole.bone or sole.object for sole in character.soles):
                _no_contacts(layout, character)
            _scale(layout, context.scene.unit_settings.scale_length, character)
            _on_the_spot(layout, prediction.look(context.scene)[1], character)
            layout.prop(character, "mass")
            if mass := suggested_mass(character):
                by_volume = mass == character.skin_mass
                _, size = import_fixes.sizes_of(context.scene.unit_settings.scale_length, character)
                text = translated("{mass} kg by Volume" if by_volume else "{mass} kg by Height", mass=f"{mass:g}")
                if by_volume and size > 0:  # one that is larger in its file than in life weighs tons
                    text = translated("{mass} kg by Volume ({size} m)", mass=f"{mass:g}", size=f"{size:.2g}")
                layout.operator("softground.mass_by_volume", text=text, icon="INFO", translate=False)


def _scale(layout: Any, unit_scale: float, character: Any) -> None:
    """What size a character has whose file is in other units, and a button that puts it right."""
    size, _ = import_fixes.sizes_of(unit_scale, character)
    captured = import_fixes.is_captured(character)
    factor = scale_to_metres(size, captured=captured)
    if factor == 1.0:
        return
    box = layout.box().column(align=True)
    shown = f"{size:.0f} m" if factor < 1 else f"{size * 100:.2g} cm"
    unit = wrong_unit(size, captured=captured).partition(",")[0]
    text = translated("{size} in size: made in {unit}", size=shown, unit=translated(unit))
    box.label(text=text, icon="ERROR", translate=False)
    box.operator("softground.fix_scale", text=translated("Scale by {factor}", factor=f"{factor:g}"), translate=False)


def _on_the_spot(layout: Any, predicted: prediction.DepthPrediction | None, character: Any) -> None:
    """That a character walks in place, and a button that lets it travel."""
    title = character_setup.title_of(character)
    if settings.is_prop(character) or predicted is None or title not in predicted.analysis.belts:
        return
    box = layout.box().column(align=True)
    box.label(text="Walks on the spot", icon="INFO")
    box.operator("softground.walk_ahead", icon="FORWARD")


def _no_contacts(layout: Any, character: Any) -> None:
    """What prints, where nothing was found: from a selection, or a bone by name or eyedropper."""
    box = layout.box().column(align=True)
    box.label(text="No feet found: choose what prints", icon="ERROR")
    box.operator("softground.add_contact", text="Add from Selected Bones / Vertices", icon="PLUS")
    if not character.soles:
        box.operator("softground.add_sole", text="Choose a Bone", icon="EYEDROPPER")
    elif character.armature:
        box.prop_search(character.soles[0], "bone", character.armature.data, "bones")
        box.prop(character.soles[0], "object")


class SOFTGROUND_PT_of_character(CharacterPanel, bpy.types.Panel):
    """Settings of a character"""

    bl_label = "SoftGround Character"
    bl_parent_id = ""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """True if the active object belongs to any character."""
        characters = settings.options_of(context).characters
        return any(belongs_to(character, context.object) for character in characters)

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.fields()
        options, obj = settings.options_of(context), context.object
        character = active_character(options)
        if belongs_to(character, obj):
            dirt = ("dirty_with",) if character.dirty_soles else ()
            for field in ("mass", "dirty_soles", *dirt, "force_model"):
                layout.prop(character, field)
            return
        number, other = next(pair for pair in enumerate(options.characters) if belongs_to(pair[1], obj))
        text = translated("Choose '{name}'", name=character_setup.title_of(other))
        button = layout.operator("wm.context_set_int", text=text, icon="ARMATURE_DATA", translate=False)
        button.data_path, button.value = "scene.softground.active_character", number


class SOFTGROUND_PT_soles(CharacterPanel, bpy.types.Panel):
    """Parts that touch the ground and print"""

    bl_label = "Contacts"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.fields()
        scene = context.scene
        character = active_character(scene.softground)
        draw_list(layout, character, "soles", "active_sole", "sole", rows=3)
        layout.operator("softground.add_contact", icon="PLUS")
        sole = active_sole(scene.softground)
        if not sole:
            return
        if character.body:
            layout.prop(sole, "side")
            layout.prop(sole, "kind")
            return
        if character.armature:
            bones = character.armature.data
            layout.prop(sole, "side")
            column = layout.column(align=True)
            column.active = sole.object is None
            column.prop(sole, "kind")
            column.prop_search(sole, "bone", bones, "bones")
            if sole.kind == "FOOT":
                column.prop_search(sole, "toe_bone", bones, "bones")
        layout.prop(sole, "object")


class SOFTGROUND_PT_joints(CharacterPanel, bpy.types.Panel):
    """Bones that carry the body's mass"""

    bl_label = "Body Bones"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """True if that character has an armature."""
        return super().poll(context) and active_character(settings.options_of(context)).armature is not None

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.fields()
        character = active_character(settings.options_of(context))
        layout.prop(character, "armature")
        layout.operator("softground.detect_bones", icon="FILE_REFRESH")
        most, joints = len(motion.JOINTS), (character, "joints", character, "active_joint")
        layout.template_list("SOFTGROUND_UL_joints", "", *joints, rows=5, maxrows=most)
        if joint := chosen_of(character, "joints", "active_joint"):
            layout.prop_search(joint, "bone", character.armature.data, "bones")
            layout.prop(joint, "end")


def _joint_label(joint: str) -> str:
    """`ankle_l` as people write it."""
    name, _, side = joint.partition("_")
    return f"{translated(name.capitalize())} {side.upper()}".rstrip()


class SOFTGROUND_UL_grounds(Listed):
    """Further grounds by name, each with a button that shows it in the panels."""

    def draw_row(self, layout: Any, item: Any) -> None:
        layout.prop(item, "object", text="", emboss=False, icon="MESH_GRID")
        if item.object:
            layout.operator("softground.choose_ground", text="", icon="EYEDROPPER").object = item.object.name


class SOFTGROUND_PT_ground(SidebarPanel, bpy.types.Panel):
    """Ground that takes the prints"""

    bl_label = "Ground"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.fields()
        scene = context.scene
        options = scene.softground
        layout.prop(options, "ground", text="")
        if options.grounds:
            draw_list(layout, options, "grounds", "active_ground", "ground", rows=1, most=5)
        for ground in bake_report.unlisted(options):
            row = layout.row(align=True)
            row.label(text=translated("'{name}' keeps its prints", name=ground.name), icon="INFO", translate=False)
            row.operator("softground.add_ground", text="", icon="ADD").object = ground.name
            row.operator("softground.clear_unlisted", text="", icon="TRASH").object = ground.name
        row = layout.row(align=True)
        row.operator("softground.create_ground", icon="MESH_GRID").use_selected = False
        row.operator("softground.use_as_ground", text="Use Selected", icon="EYEDROPPER")
        draw_preset(layout, scene)
        if options.ground is not None:
            _changing_ground(layout, options)


def draw_preset(layout: Any, scene: Any) -> None:
    """The preset, what people know it by, and how deep it lets feet sink."""
    options = scene.softground
    row = layout.row(align=True)
    title, picture = preset_menu.title_of_ground(options) or "Presets", preset_menu.picture_of_ground(options)
    row.menu("SOFTGROUND_MT_presets", text=title, icon_value=picture, translate=False)
    row.operator("softground.save_preset", text="", icon="ADD")
    surface = SURFACES.get(options.material.surface)  # none where what is stored is broken
    felt = surface and surface.control
    layout.prop(*((options, felt) if felt else (options.material, "stiffness_mpa")))  # nothing moves between grounds
    wanted, predicted = prediction.look(scene)
    row = layout.row(align=True)
    if predicted is None:
        row.operator("softground.predict_depth", icon="DRIVER_DISTANCE")
        return
    field = row.row(align=True)
    field.active = predicted.is_current
    field.prop(options, "depth_cm")
    row.operator("softground.predict_depth", text="", icon="FILE_REFRESH")
    deepest = wanted.material.deepest
    if predicted.depth and predicted.depth > NEARLY_AT_BOTTOM * deepest:
        text = translated("Pressed to the bottom, {depth} cm", depth=f"{deepest * 100:.3g}")
        layout.label(text=text, icon="ERROR", translate=False)


NEARLY_AT_BOTTOM = 0.95
"""Typical depth over the deepest, beyond which the panel warns that floors come out flat."""
_REFUSAL_WIDTH = 40
"""Letters in a line of what live mode does not do."""


class SOFTGROUND_PT_bake(SidebarPanel, bpy.types.Panel):
    """Press the prints"""

    bl_label = "Bake"
    bl_order = 3

    def draw_header_preset(self, _context: bpy.types.Context) -> None:
        self.layout.menu("SOFTGROUND_MT_output", icon="EXPORT")

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.fields()
        state = session.current()
        live.watch()
        options = settings.options_of(context)
        summary = ground_mesh.summary_of(baked_ground.display_mesh_of(options.ground)) if options.ground else {}
        if summary:
            outdated.watch(context.scene)
        if state.is_baking:
            layout.enabled = True
            row = layout.row()
            row.scale_y = _LARGE
            row.progress(factor=state.progress, text=state.status)
            layout.operator("softground.cancel_bake", text="Cancel", icon="CANCEL")
        else:
            _bake_buttons(layout, options, state, is_outdated=bool(summary and state.stale))
        row = layout.row(align=True)
        row.use_property_split = False
        row.enabled = not state.is_baking
        row.prop(options, "frame_start")
        row.prop(options, "frame_end")
        row = layout.row(align=True)
        row.enabled = not state.is_baking
        row.operator("softground.show_prints", icon="VIEWZOOM")
        row.operator("softground.clear_bake", icon="TRASH")
        if state.is_baking:
            return
        for line in textwrap.wrap(live.refusal(), _REFUSAL_WIDTH):
            row = layout.row()
            row.alert = True
            row.label(text=line, translate=False)
        column = layout.column(align=True)
        if summary:
            bake_result.draw(column, options, summary)
        outdated_by = "; ".join(state.stale.splitlines()) if summary else ""
        note = outdated_by or _apart_from_scene(context.scene)
        row = column.row()  # which is there without a note too: nothing below it moves as one comes
        row.active = False
        row.label(text=note, icon="INFO" if note else "BLANK1", translate=False)


def _bake_buttons(layout: Any, options: Any, state: Any, *, is_outdated: bool) -> None:
    """The large button, with the feet beside it; below, one that starts live mode, or two that end it."""
    row = layout.split(factor=0.66, align=True)
    row.use_property_split = False
    row.scale_y = _LARGE
    row.operator(f"softground.bake{'_again' if is_outdated else ''}", icon="MOD_DYNAMICPAINT")
    row.prop(options, "sink_feet", toggle=True)
    if not state.is_live:
        layout.operator("softground.live", icon="PLAY")
        return
    row = layout.row(align=True)
    row.alert = True
    row.operator("softground.live", text="Discard", icon="X").keep = False
    row.alert = False
    row.operator("softground.live", text="Keep", icon="CHECKMARK").keep = True


def _apart_from_scene(scene: Any) -> str:
    """Why the bake leaves out frames of the scene, or goes on beyond its end; empty where they agree."""
    options = scene.softground
    start, end = options.frame_start, options.frame_end
    if not options.characters or (scene.frame_start >= start and end == scene.frame_end):
        return ""
    of_animation = (start, end) == tuple(options.animated_frames)
    return translated(
        "Animation {baked}, scene {shown}" if of_animation else "Bake {baked}, scene {shown}",
        baked=f"{start}-{end}",
        shown=f"{scene.frame_start}-{scene.frame_end}",
    )


def _changing_ground(layout: Any, options: Any) -> None:
    """Which frame's shape is taken of a ground that changes over time."""
    modifier = still_ground.changes_with_time(options.ground)
    if modifier:
        box = layout.box().column(align=True)
        box.label(text=translated("'{modifier}' changes its shape", modifier=modifier), icon="INFO", translate=False)
        taken = translated("Taken as it is at frame {frame}", frame=options.frame_start)
        box.label(text=taken, icon="BLANK1", translate=False)


CLASSES = (
    SOFTGROUND_UL_characters,
    SOFTGROUND_UL_soles,
    SOFTGROUND_UL_joints,
    SOFTGROUND_PT_character,
    SOFTGROUND_UL_grounds,
    SOFTGROUND_PT_ground,
    SOFTGROUND_PT_bake,
    SOFTGROUND_PT_of_character,
    SOFTGROUND_PT_soles,
    SOFTGROUND_PT_joints,
)
