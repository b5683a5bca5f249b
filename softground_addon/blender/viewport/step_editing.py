"""Operators on single steps of the bake: choose some, mute, change and copy them, take the changes back."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from math import degrees, radians
from typing import Any, ClassVar

import bpy
import numpy as np
from bpy.props import BoolProperty, FloatProperty, FloatVectorProperty, IntProperty, StringProperty

from ...core.errors import InputError
from ...core.record.edits import (
    FARTHEST,
    LARGEST,
    LONGEST_SHIFT,
    SMALLEST,
    STRONGEST,
    StepEdit,
    mesh_soles,
    new_copy,
    with_edit,
    with_meshes,
)
from ...core.record.mesh_sole import MeshSole
from .. import jobs, session, settings
from ..baking import step_edits, step_soles
from ..ground import baked_ground, baked_steps
from ..live import live
from ..operator_base import Checked, OnBake, OperatorResult
from ..operators import show_prints
from ..operators.modal_job import STAGE_NAMES, ModalJob
from ..placement import from_scene
from ..remedies import said

Wanted = tuple[Mapping[str, StepEdit], list[str]]
"""Edits, and steps."""


class OnSteps(OnBake):
    """Operators that change steps of the bake on the ground."""

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        if session.current().is_baking or live.is_on():
            return "A bake is running, or live mode is on: wait, or press Keep or Discard first"
        return super().missing(context)


class OnStep(OnSteps):
    """Operators that change the steps that are named, or chosen."""

    step: StringProperty(
        name="Steps", description="Ids of the steps, one per line; the selected ones if empty", options={"HIDDEN"}
    )

    def chosen(self, ground: bpy.types.Object) -> list[baked_steps.BakedStep]:
        """The steps that are meant, first the one that the panel shows."""
        if not self.step:
            self.step = "\n".join(step.name for step in baked_steps.chosen(ground))
        if not self.step:
            raise InputError("Select a step first, in the list of steps.")
        steps = {step.name: step for step in baked_steps.of(ground)}
        for name in self.step.split("\n"):
            if name not in steps:
                raise InputError(f"The bake has no step '{name}': select one in the list of steps.")
        return [steps[name] for name in self.step.split("\n")]


def redraw() -> None:
    """Draw the panels and the steps in the viewport again."""
    session.redraw()
    session.redraw(region_type="WINDOW")


class EditJob(ModalJob):
    """Operators that press steps again and write the ground."""

    stage_names: ClassVar[dict[str, str]] = STAGE_NAMES | {"sample": "Reading the bake"}

    def _job_of(self) -> jobs.Job[list[str]]:
        ground = self.scene.softground.ground
        edits, chosen = self.wanted(ground)
        if edits != baked_ground.record_of(ground).edits:
            bake = yield from step_edits.reading(self.scene)
            yield from step_edits.editing(bake, edits)
        return chosen

    def wanted(self, ground: bpy.types.Object) -> Wanted:
        """All edits that the bake is to have, and the steps that are chosen then, none for the same."""
        raise NotImplementedError

    def _show(self, result: list[str]) -> None:
        if result:
            session.choose_steps(result[0], result)
        redraw()


def changed(
    ground: bpy.types.Object, changes: Iterable[tuple[baked_steps.BakedStep, StepEdit | None]]
) -> dict[str, StepEdit]:
    """All edits of the bake, with others of some steps; see `edits.with_edit`."""
    edits = dict(baked_ground.edits_of(ground))
    for step, edit in changes:
        edits = with_edit(edits, step.baked, step.name, edit)
    return edits


def copied(
    ground: bpy.types.Object, copies: Iterable[tuple[baked_steps.BakedStep, StepEdit]]
) -> tuple[dict[str, StepEdit], list[str]]:
    """All edits of the bake with copies of some steps, and their names."""
    edits, names = dict(baked_ground.edits_of(ground)), []
    for step, edit in copies:
        names.append(new_copy(edits, step.baked))
        edits[names[-1]] = edit
        if edit.mesh is not None:
            edits = with_meshes(edits, {edit.sole: edit.mesh})
    return edits, names


def toggle(name: str) -> None:
    """Choose a step with those that are chosen, or no more."""
    names = [chosen for chosen in session.chosen_steps() if chosen != name]
    if len(names) == len(session.chosen_steps()):
        names.insert(0, name)
    session.choose_steps(names[0] if names else "", names)


class SOFTGROUND_OT_choose_step(OnBake, Checked):
    """Select this step, go to the frame where its foot has left the print, and centre the view on it.
    Shift: add it to the selection, or remove it"""

    bl_idname = "softground.choose_step"
    bl_label = "Select Step"
    bl_options = {"INTERNAL"}

    step: StringProperty(name="Step", description="Id of the step", options={"HIDDEN"})
    extend: BoolProperty(name="Extend", description="Add it to the selection, or remove it", options={"HIDDEN"})

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> OperatorResult:
        self.extend = event.shift
        return self.execute(context)

    def execute(self, context: bpy.types.Context) -> OperatorResult:
        scene = context.scene
        step = next((item for item in baked_steps.of(scene.softground.ground) if item.name == self.step), None)
        if step is None:
            return {"CANCELLED"}
        if self.extend:
            toggle(step.name)
        else:
            session.choose_steps(step.name)
        if step.name in session.chosen_steps():
            scene.frame_set(step.there_from)
            show_prints.centre(context.area, step)
        redraw()
        return {"FINISHED"}


class SOFTGROUND_OT_mute_step(OnStep, EditJob):
    """Take the print of this step out of the ground, or put it back. Esc cancels"""

    bl_idname = "softground.mute_step"
    bl_label = "Mute Step"

    def wanted(self, ground: bpy.types.Object) -> Wanted:
        steps = self.chosen(ground)
        mute = not steps[0].edit.mute
        return changed(ground, [(step, replace(step.edit, mute=mute)) for step in steps]), []


def _soles(_: object, context: bpy.types.Context, text: str) -> list[str]:
    """Names of soles in the bake, and below them of meshes in the scene, as far as they contain a text."""
    scene = context.scene
    ground = scene.softground.ground
    steps = baked_steps.of(ground)
    meshes = {
        *step_soles.names(scene.objects, ground),
        *mesh_soles({step.name: step.edit for step in steps}),
    }
    names = [*sorted(steps[0].feet if steps else ()), *sorted(meshes)]
    return [name for name in names if text.lower() in name.lower()]


def _sole_property() -> Any:
    return StringProperty(
        name="Sole",
        description="What presses the step: a foot of this bake, also of another character, or a mesh as it stands in "
        "the scene, with its toes along -Y. Its own sole if empty",
        search=_soles,
    )


class SOFTGROUND_OT_change_step(OnStep, EditJob):
    """Change depth, place, angle, size, sole and time of this step. Esc cancels"""

    bl_idname = "softground.change_step"
    bl_label = "Change Step"
    _in_dialog = False

    strength: FloatProperty(
        name="Depth", description="Depth relative to the baked print", default=1.0, min=0.0, max=STRONGEST, soft_max=3.0
    )
    move: FloatVectorProperty(
        name="Move",
        description="Distance along the scene's X and Y, in metres",
        size=2,
        min=-FARTHEST,
        max=FARTHEST,
        step=1,
        precision=3,
    )
    turn: FloatProperty(
        name="Rotate",
        description="Angle by which the print is turned counter-clockwise",
        subtype="ANGLE",
        min=radians(-360),
        max=radians(360),
    )
    scale: FloatProperty(
        name="Size",
        description="Size relative to the baked sole; the pressure stays the same",
        default=1.0,
        min=SMALLEST,
        max=LARGEST,
    )
    sole: _sole_property()
    shift: IntProperty(
        name="Delay",
        description="Frames by which the step is later; negative is earlier",
        min=-LONGEST_SHIFT,
        max=LONGEST_SHIFT,
    )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Any:
        try:
            edit = self.chosen(settings.options_of(context).ground)[0].edit
        except InputError as error:
            self.report({"ERROR"}, said(error))
            return {"CANCELLED"}
        self.strength, self.move, self.turn = edit.strength, edit.move_m, radians(edit.turn_deg)
        self.scale, self.shift, self.sole = edit.scale, edit.shift_frames, edit.sole
        self._in_dialog = True
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context: bpy.types.Context) -> OperatorResult:
        run = self._start if self._in_dialog else super().execute  # which Adjust Last Operation calls
        self._in_dialog = False
        result: OperatorResult = run(context)
        return result

    def wanted(self, ground: bpy.types.Object) -> Wanted:
        steps = self.chosen(ground)
        wanted = {
            "strength": settings.typed(self.strength),
            "move_m": (settings.typed(self.move[0]), settings.typed(self.move[1])),
            "turn_deg": settings.typed(degrees(self.turn)),
            "scale": settings.typed(self.scale),
            "shift_frames": self.shift,
            "sole": self.sole,
        }
        # of several steps, only what was changed of the first
        new = {key: value for key, value in wanted.items() if value != getattr(steps[0].edit, key)}
        mesh = None
        if "sole" in new:
            new["mesh"] = mesh = _mesh(ground, steps, self.sole)
        edits = changed(ground, [(step, replace(step.edit, **new)) for step in steps])
        return with_meshes(edits, {self.sole: mesh}) if mesh else edits, []


def _mesh(ground: bpy.types.Object, steps: Sequence[baked_steps.BakedStep], sole: str) -> MeshSole | None:
    """The sole of the mesh that is to press some steps; None for a foot of the bake, and for their own.

    Raises
    ------
    InputError
        If it cannot press them.
    """
    if not sole:
        return None
    for step in steps:
        if not step.has_foot:
            raise InputError(
                f"Step '{step.name}' was not made by a foot, so it keeps its sole: select only steps of feet."
            )
    if sole in steps[0].feet:
        return None
    scene = bpy.context.scene
    obj = step_soles.object_of(scene.objects, sole)
    soles = mesh_soles(baked_ground.edits_of(ground))
    if obj is None and sole not in soles:
        feet = ", ".join(sorted(steps[0].feet)) or "none"
        raise InputError(f"The bake has no sole '{sole}': choose one of {feet}, or a mesh object in this scene.")
    if obj is None:
        return soles[sole]
    return step_soles.read(obj, ground, scene.unit_settings.scale_length)


class SOFTGROUND_OT_duplicate_step(OnStep, EditJob):
    """Press a copy of this step just ahead of it; the copy can be moved, changed and deleted. Esc cancels"""

    bl_idname = "softground.duplicate_step"
    bl_label = "Duplicate"

    def wanted(self, ground: bpy.types.Object) -> Wanted:
        return copied(ground, [(step, _moved(step, step.ahead())) for step in self.chosen(ground)])


class SOFTGROUND_OT_add_step(OnStep, EditJob):
    """Press this step at the 3D cursor too, starting at the current frame. Choose its sole in Adjust Last Operation"""

    bl_idname = "softground.add_step"
    bl_label = "Add at Cursor"

    sole: _sole_property()

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> OperatorResult:
        self.sole = ""  # that of the step, and not what was chosen for the one before
        return super().invoke(context, event)

    def wanted(self, ground: bpy.types.Object) -> Wanted:
        scene, step = bpy.context.scene, self.chosen(ground)[0]
        cursor = from_scene(np.array(scene.cursor.location), scene, baked_steps.frame_of(ground))[:2]
        edit = _moved(step, (cursor - step.baked.position[:2]).tolist())
        shift = scene.frame_current - int(np.ceil(step.baked.start_frame))
        if abs(shift) > LONGEST_SHIFT:
            raise InputError(
                f"Step '{step.name}' is {abs(shift)} frames away; a copy can be at most {LONGEST_SHIFT} earlier or "
                "later: go to a nearer frame, or choose another step."
            )
        if self.sole:
            edit = replace(edit, sole=self.sole, mesh=_mesh(ground, [step], self.sole))
        return copied(ground, [(step, replace(edit, mute=False, shift_frames=shift))])


def _moved(step: baked_steps.BakedStep, move: Sequence[float]) -> StepEdit:
    """The edit of a step, with another move [m]."""
    if max(map(abs, move)) > FARTHEST:
        raise InputError(
            f"That is more than {FARTHEST:g} m from step '{step.name}': place it nearer, or choose another step."
        )
    return replace(step.edit, move_m=(settings.typed(move[0]), settings.typed(move[1])))


class SOFTGROUND_OT_reset_step(OnStep, EditJob):
    """Restore the baked print of this step; a copy is deleted. Esc cancels"""

    bl_idname = "softground.reset_step"
    bl_label = "Reset Step"

    def wanted(self, ground: bpy.types.Object) -> Wanted:
        return changed(ground, [(step, None) for step in self.chosen(ground)]), []


class SOFTGROUND_OT_reset_steps(OnSteps, EditJob):
    """Restore all baked prints, and delete all copies. Esc cancels"""

    bl_idname = "softground.reset_steps"
    bl_label = "Reset All Steps"

    def wanted(self, ground: bpy.types.Object) -> Wanted:
        return {}, []


CLASSES = (
    SOFTGROUND_OT_choose_step,
    SOFTGROUND_OT_mute_step,
    SOFTGROUND_OT_change_step,
    SOFTGROUND_OT_duplicate_step,
    SOFTGROUND_OT_add_step,
    SOFTGROUND_OT_reset_step,
    SOFTGROUND_OT_reset_steps,
)
