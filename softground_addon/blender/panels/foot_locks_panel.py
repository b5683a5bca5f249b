"""The list of contacts that Clean Feet holds in a way of their own."""

from __future__ import annotations

from typing import Any

import bpy

from ...core.errors import InputError
from .. import settings
from ..operator_base import Act
from ..operators.panel_base import CharacterPanel, Listed, RemovesChosen, active_character, chosen_of, draw_list
from ..translation import CONTEXT


class SOFTGROUND_OT_add_foot_lock(Act):
    """Lock the contact at the current frame: of the selected bone's foot, or else of the foot that is lowest"""

    bl_idname = "softground.add_foot_lock"
    bl_label = "Add Foot Lock"

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        character = active_character(settings.options_of(context))
        has_rig = character and settings.exists(character.armature)
        return "" if has_rig else "Choose a character with an armature first"

    def act(self, context: bpy.types.Context) -> None:
        scene = context.scene
        character = active_character(scene.softground)
        assert character is not None
        foot = _foot_at_hand(character, context.active_pose_bone)
        hold = character.holds.add()
        hold.foot, hold.frame = foot, scene.frame_current
        character.active_hold = len(character.holds) - 1


def _foot_at_hand(character: Any, chosen: bpy.types.PoseBone | None) -> str:
    """The name of the foot that a bone belongs to, or else of the one that is lowest now."""
    armature = character.armature
    bones = armature.pose.bones
    feet = [sole for sole in character.soles if not sole.object and sole.bone in bones]
    if not feet:
        raise InputError(
            f"'{armature.name}' has no foot with a bone: choose its bones in Properties > Physics > Contacts."
        )
    names = {name: sole.name for sole in feet for name in (sole.bone, sole.toe_bone)}
    if chosen is not None and chosen.id_data == armature and chosen.name in names:
        return names[chosen.name]

    def height(sole: Any) -> float:
        bone = bones[sole.bone]
        return float(min((armature.matrix_world @ end).z for end in (bone.head, bone.tail)))

    return str(min(feet, key=height).name)


class SOFTGROUND_OT_remove_foot_lock(RemovesChosen):
    """Take the chosen foot lock out of the list: its contact is locked like all others"""

    bl_idname = "softground.remove_foot_lock"
    bl_label = "Remove Foot Lock"
    of_list = ("holds", "active_hold")
    owner = staticmethod(active_character)


class SOFTGROUND_UL_foot_locks(Listed):
    """Foot locks by frame, each with its foot and what it locks."""

    def draw_row(self, layout: Any, item: Any) -> None:
        row = layout.row()
        row.label(text=f"{item.foot}  {item.frame}", icon="LOCKED", translate=False)
        row.prop(item, "mode", text="", emboss=False)


class SOFTGROUND_PT_foot_locks(CharacterPanel, bpy.types.Panel):
    """Contacts that Clean Feet locks in another way than the rest; press Clean Feet again after a change"""

    bl_label = "Foot Locks"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.fields()
        character = active_character(settings.options_of(context))
        draw_list(layout, character, "holds", "active_hold", "foot_lock")
        hold = chosen_of(character, "holds", "active_hold")
        if hold is None:
            return
        column = layout.column()
        column.prop_search(hold, "foot", character, "soles")
        column.prop(hold, "frame")
        column.prop(hold, "mode")
        column.prop(hold, "strength", slider=True)
        ease = layout.column(align=True)
        ease.prop(hold, "ease_in")
        ease.prop(hold, "ease_out", text="Out", text_ctxt=CONTEXT)


CLASSES = (
    SOFTGROUND_OT_add_foot_lock,
    SOFTGROUND_OT_remove_foot_lock,
    SOFTGROUND_UL_foot_locks,
    SOFTGROUND_PT_foot_locks,
)
