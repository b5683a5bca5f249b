"""Operators on the list of soft grounds beside the first."""

from __future__ import annotations

import bpy
from bpy.props import StringProperty

from ...core.errors import InputError
from .. import further_grounds, settings
from ..ground import ground_checks, trail_detail
from ..operator_base import OnGround, reports_errors
from ..reading import analysis
from ..translation import translated
from .panel_base import OnMeshes, RemovesChosen, chosen_of


class SOFTGROUND_OT_add_ground(OnMeshes, OnGround, bpy.types.Operator):
    """Let the selected meshes take prints too, each by itself: crates, stairs, rocks beside the ground"""

    bl_idname = "softground.add_ground"
    bl_label = "Add Another Ground"
    bl_options = {"REGISTER", "UNDO"}

    @reports_errors
    def execute(self, context: bpy.types.Context) -> set[str]:
        options = settings.options_of(context)
        meshes = dict.fromkeys(map(trail_detail.ground_of, self.meshes(context)))
        chosen = [obj for obj in meshes if obj not in settings.grounds_of(options)]
        if not chosen:
            raise InputError("Select meshes to walk on, other than those that are grounds already.")
        for obj in chosen:
            ground_checks.check_usable(obj)
            if fault := ground_checks.hard_fault(obj, options.ground, "beside the ground"):
                raise InputError(fault)
        for obj in chosen:
            further_grounds.add(options, obj)
        names = ", ".join(repr(obj.name) for obj in chosen)
        self.report({"INFO"}, translated("Soles print in {names} too", names=names))
        return {"FINISHED"}


class SOFTGROUND_OT_remove_ground(RemovesChosen):
    """Take the ground out of the list; it stays in the scene as it is"""

    bl_idname = "softground.remove_ground"
    bl_label = "Remove Ground"
    of_list = ("grounds", "active_ground")


class SOFTGROUND_OT_choose_ground(bpy.types.Operator):
    """Show this ground in the panels: its preset, steps, weather and warnings. The one shown before takes its place"""

    bl_idname = "softground.choose_ground"
    bl_label = "Show This Ground"
    bl_options = {"REGISTER", "UNDO"}

    object: StringProperty(
        name="Object", description="Name of the ground; the one chosen in the list if empty", options={"SKIP_SAVE"}
    )

    @reports_errors
    def execute(self, context: bpy.types.Context) -> set[str]:
        options = settings.options_of(context)
        named = next((item for item in options.grounds if item.object and item.object.name == self.object), None)
        item = named if self.object else chosen_of(options, "grounds", "active_ground")
        if item is None or not settings.exists(item.object):
            raise InputError("Choose a ground in the list.")
        with analysis.own_changes(settings.scene_of(context)):
            further_grounds.choose(options, item)
        return {"FINISHED"}


CLASSES = (SOFTGROUND_OT_add_ground, SOFTGROUND_OT_remove_ground, SOFTGROUND_OT_choose_ground)
