"""*Snow and Mud on Legs*: a button for what a body waded in and that clings to it."""

from __future__ import annotations

import bpy

from .. import settings
from ..baking import waded_steps
from ..carried import clinging
from ..operator_base import Act, OnBake
from .panel_base import active_character


class SOFTGROUND_OT_cling(OnBake, Act):
    """Give the character's meshes an attribute for your shaders, softground_clung: how far below the edge of clinging
    snow or mud a vertex is [m], less than 0 above it. One modifier before yours, which follows each bake; remove it,
    and all is as it was"""

    bl_idname = "softground.cling"
    bl_label = "Snow and Mud on Legs"

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        character = active_character(settings.options_of(context))
        return super().missing(context) if character and character.armature else "Add a character first"

    def act(self, context: bpy.types.Context) -> None:
        scene, character = context.scene, active_character(settings.options_of(context))
        count = waded_steps.cling(scene, character)
        self.say("{count} meshes have '{name}'", count=count, name=clinging.CLUNG)


CLASSES = (SOFTGROUND_OT_cling,)
