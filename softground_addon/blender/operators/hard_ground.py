"""Operators on the list of hard objects that soles stand on."""

from __future__ import annotations

import bpy

from ...core.errors import InputError
from .. import settings
from ..ground import ground_checks, trail_detail
from ..operator_base import Act
from .panel_base import OnMeshes, RemovesChosen


class SOFTGROUND_OT_add_hard_ground(OnMeshes, Act):
    """Let soles stand on the selected meshes, which take no prints: crates, stairs, floors, rocks"""

    bl_idname = "softground.add_hard_ground"
    bl_label = "Add Hard Ground"

    def act(self, context: bpy.types.Context) -> None:
        options = settings.options_of(context)
        taken = [*settings.grounds_of(options), *settings.hard_grounds_of(options)]
        chosen = [obj for obj in self.meshes(context) if trail_detail.ground_of(obj) not in taken]
        if not chosen:
            raise InputError("Select meshes to stand on, other than the ground and those that are in Hard Ground.")
        for obj in chosen:
            if fault := ground_checks.hard_fault(obj, options.ground):
                raise InputError(fault)
        for obj in chosen:
            options.hard_grounds.add().object = obj
        options.active_hard_ground = len(options.hard_grounds) - 1
        self.say("Soles stand on {names}", names=", ".join(repr(obj.name) for obj in chosen))


class SOFTGROUND_OT_remove_hard_ground(RemovesChosen):
    """Take the object out of the list; it stays in the scene as it is"""

    bl_idname = "softground.remove_hard_ground"
    bl_label = "Remove Hard Ground"
    of_list = ("hard_grounds", "active_hard_ground")


CLASSES = (SOFTGROUND_OT_add_hard_ground, SOFTGROUND_OT_remove_hard_ground)
