"""Operators on single steps of the bake: choose one, mute it, change it, take the change back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import degrees, radians
from typing import Any

import bpy
from bpy.props import FloatProperty, FloatVectorProperty, StringProperty

from ...core.errors import InputError
from ...core.record.edits import FARTHEST, STRONGEST, UNCHANGED, StepEdit
from .. import session, settings
from ..baking import step_edits
from ..ground import baked_ground
from ..live import live
from ..operator_base import OnBake, reports_errors
from ..reading import analysis
from . import baked_steps
from .baked_steps import BakedStep


class OnSteps(OnBake):
    """Operators that change steps of the bake on the ground."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a bake, and neither another one nor live mode is at work."""
        if session.current().is_baking or live.is_on():
            cls.poll_message_set("Wait for the bake, or end live mode")
            return False
        return super().poll(context)


class OnStep(OnSteps):
    """Operators that change the step that is named, or chosen."""

    step: StringProperty(name="Step", description="Id of the step; of the chosen one if empty", options={"HIDDEN"})

    def chosen(self, scene: bpy.types.Scene) -> BakedStep:
        """The step that is meant."""
        if not self.step:
            self.step = session.current().step
        found = next((step for step in baked_steps.of(scene) if step.name == self.step), None)
        if found is None:
            raise InputError(f"The bake has no step '{self.step}': choose one in the list of steps.")
        return found


def show(scene: bpy.types.Scene, edits: Mapping[str, StepEdit], bake: step_edits.EditableBake | None = None) -> None:
    """Show the bake with other edits, as a change of our own."""
    with analysis.own_changes(scene):
        step_edits.edit(scene, bake or step_edits.editable(scene), edits)
    session.redraw()
    session.redraw(region_type="WINDOW")


def changed(scene: bpy.types.Scene, step: BakedStep, edit: StepEdit) -> dict[str, StepEdit]:
    """All edits of the bake, with another one of a step."""
    edits = dict(baked_ground.edits_of(scene.softground.ground))
    for other in [name for name in edits if name != step.name and step_of(scene, name) is step]:
        del edits[other]  # of an earlier bake: it stands under the step's newer id from now on
    return edits | {step.name: edit}


def step_of(scene: bpy.types.Scene, name: str) -> BakedStep | None:
    """The step that an edit's id belongs to."""
    who, _, frame = name.rpartition("@")
    return next(
        (
            step
            for step in baked_steps.of(scene)
            if step.name.rpartition("@")[0] == who and step.baked.start_frame <= float(frame) <= step.baked.end_frame
        ),
        None,
    )


class SOFTGROUND_OT_choose_step(OnBake, bpy.types.Operator):
    """Choose this step, and go to the frame at which its foot comes down"""

    bl_idname = "softground.choose_step"
    bl_label = "Choose Step"
    bl_options = {"INTERNAL"}

    step: StringProperty(name="Step", description="Id of the step", options={"HIDDEN"})

    def execute(self, context: bpy.types.Context) -> set[str]:
        scene = settings.scene_of(context)
        session.current().step = self.step
        step = baked_steps.active(scene)
        if step is None:
            return {"CANCELLED"}
        scene.frame_set(step.frames[0])
        session.redraw(region_type="WINDOW")
        return {"FINISHED"}


class SOFTGROUND_OT_mute_step(OnStep, bpy.types.Operator):
    """Take the print of this step out of the ground, or put it back"""

    bl_idname = "softground.mute_step"
    bl_label = "Mute Step"
    bl_options = {"REGISTER", "UNDO"}

    @reports_errors
    def execute(self, context: bpy.types.Context) -> set[str]:
        scene = settings.scene_of(context)
        step = self.chosen(scene)
        show(scene, changed(scene, step, replace(step.edit, mute=not step.edit.mute)))
        return {"FINISHED"}


class SOFTGROUND_OT_change_step(OnStep, bpy.types.Operator):
    """Make the print of this step deeper or shallower, move it, or turn it"""

    bl_idname = "softground.change_step"
    bl_label = "Change Step"
    bl_options = {"REGISTER", "UNDO"}

    strength: FloatProperty(
        name="Depth", description="Depth over that of the bake", default=1.0, min=0.0, max=STRONGEST, soft_max=3.0
    )
    move: FloatVectorProperty(
        name="Move",
        description="How far the print is moved along the scene's X and Y, in metres",
        size=2,
        min=-FARTHEST,
        max=FARTHEST,
        step=1,
        precision=3,
    )
    turn: FloatProperty(
        name="Turn",
        description="How far the print is turned counter-clockwise",
        subtype="ANGLE",
        min=radians(-360),
        max=radians(360),
    )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Any:
        try:
            edit = self.chosen(settings.scene_of(context)).edit
        except InputError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.strength, self.move, self.turn = edit.strength, edit.move_m, radians(edit.turn_deg)
        return context.window_manager.invoke_props_dialog(self)

    @reports_errors
    def execute(self, context: bpy.types.Context) -> set[str]:
        scene = settings.scene_of(context)
        step = self.chosen(scene)
        move = (settings.typed(self.move[0]), settings.typed(self.move[1]))
        edit = StepEdit(step.edit.mute, settings.typed(self.strength), move, settings.typed(degrees(self.turn)))
        show(scene, changed(scene, step, edit))
        return {"FINISHED"}


class SOFTGROUND_OT_reset_step(OnStep, bpy.types.Operator):
    """Give this step the print that was baked"""

    bl_idname = "softground.reset_step"
    bl_label = "Reset Step"
    bl_options = {"REGISTER", "UNDO"}

    @reports_errors
    def execute(self, context: bpy.types.Context) -> set[str]:
        scene = settings.scene_of(context)
        step = self.chosen(scene)
        show(scene, changed(scene, step, UNCHANGED))
        return {"FINISHED"}


class SOFTGROUND_OT_reset_steps(OnSteps, bpy.types.Operator):
    """Give all steps the prints that were baked"""

    bl_idname = "softground.reset_steps"
    bl_label = "Reset All Steps"
    bl_options = {"REGISTER", "UNDO"}

    @reports_errors
    def execute(self, context: bpy.types.Context) -> set[str]:
        show(settings.scene_of(context), {})
        return {"FINISHED"}


CLASSES = (
    SOFTGROUND_OT_choose_step,
    SOFTGROUND_OT_mute_step,
    SOFTGROUND_OT_change_step,
    SOFTGROUND_OT_reset_step,
    SOFTGROUND_OT_reset_steps,
)
