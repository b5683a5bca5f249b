"""Steps in the viewport: the chosen ones are outlined with their numbers, and any are picked, boxed and dragged."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import bpy
import numpy as np
from mathutils import Vector

from ...core.errors import SoftGroundError
from ...core.numerics.arrays import Array
from ...core.record.edits import FARTHEST, StepEdit
from .. import jobs, session
from ..baking import step_edits
from ..ground import baked_ground, baked_steps
from ..operator_base import Checked, OperatorResult
from ..placement import from_scene, in_scene
from ..remedies import said
from ..state import state
from ..translation import translated
from . import overlay, step_preview
from .step_editing import EditJob, OnSteps, Wanted, changed, toggle

TURN_STEP = 5.0
"""How far the mouse wheel turns a step that is dragged [deg]."""
REACH = 1.4
"""A click picks a step within so many times the size of its outline."""
_HINT = (
    "Drag: move a print   ·   Shift Click: extend the selection   ·   Drag beside prints: box select   ·   "
    "Wheel: rotate   ·   Shift: precise   ·   Esc: cancel"
)
WHITE = (1.0, 1.0, 1.0, 1.0)
"""Colour of their numbers."""
SLOW = 0.1
"""Of several steps only the outlines follow the mouse, until they are dropped, once pressing them took longer [s]."""
FINE = 0.1
"""How much slower a print follows the mouse while Shift is held."""


@dataclass
class _Drag:
    """A step that is being dragged: those that go with it, what shows it, where it is, if that takes long."""

    step: baked_steps.BakedStep
    steps: Sequence[baked_steps.BakedStep]
    preview: step_preview.StepPreview
    mouse: Array
    edit: StepEdit
    is_slow: bool = False

    def edits(self, edit: StepEdit) -> dict[str, StepEdit]:
        """Those of all steps that are dragged, where the one under the mouse has this, by their ids."""
        first = self.step.edit
        by, turn = np.subtract(edit.move_m, first.move_m), edit.turn_deg - first.turn_deg
        return {step.name: _carried(step.edit, by, turn) for step in self.steps} | {self.step.name: edit}


def _carried(edit: StepEdit, by: Array, turn: float) -> StepEdit:
    """An edit moved by so much [m] and turned by so much [deg]."""
    x, y = np.clip(np.round(np.array(edit.move_m) + by, 6), -FARTHEST, FARTHEST).tolist()
    return replace(
        edit, move_m=(x, y), turn_deg=(edit.turn_deg + turn + 180.0) % 360.0 - 180.0 if turn else edit.turn_deg
    )


class SOFTGROUND_OT_drag_step(OnSteps, Checked):
    """Pick a print in the viewport and drag it elsewhere; the wheel turns it, Esc cancels"""

    bl_idname = "softground.drag_step"
    bl_label = "Drag in Viewport"

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> OperatorResult:
        if context.area is None or context.area.type != "VIEW_3D":
            self.report({"ERROR"}, "Use Drag in Viewport in a 3D viewport")
            return {"CANCELLED"}
        self._drag: _Drag | None = None
        state.picking = True
        context.window_manager.modal_handler_add(self)
        if context.workspace:
            context.workspace.status_text_set(translated(_HINT))
        _redraw()
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> OperatorResult:
        try:
            return self._handle(context, event)
        except SoftGroundError as error:
            self.report({"ERROR"}, said(error))
            return self._leave(context, {"CANCELLED"})
        except BaseException:
            self._leave(context, {"CANCELLED"})
            raise

    def cancel(self, context: bpy.types.Context) -> None:
        self._leave(context, {"CANCELLED"})

    def _handle(self, context: bpy.types.Context, event: bpy.types.Event) -> OperatorResult:
        if event.type in ("ESC", "RIGHTMOUSE"):
            return self._leave(context, {"CANCELLED"})
        region, view = _viewport(context, None if state.box else event)
        if self._drag is None:
            return self._pick(context, event, region, view)
        if event.type == "MOUSEMOVE" and region is not None:
            self._follow(context, _on_plane(region, view, event, self._drag.step.height), fine=event.shift)
        elif event.type in ("WHEELUPMOUSE", "WHEELDOWNMOUSE"):
            turn = TURN_STEP * (1 if event.type == "WHEELUPMOUSE" else -1)
            self._change(context, _carried(self._drag.edit, np.zeros(2), turn))
        elif event.type == "LEFTMOUSE" and event.value == "RELEASE":
            return self._drop(context)
        return {"RUNNING_MODAL"}

    def _pick(self, context: bpy.types.Context, event: bpy.types.Event, region: Any, view: Any) -> OperatorResult:
        """Outline the print under the mouse, and take hold of it at a click."""
        scene = context.scene
        if state.box:
            return self._box(scene.softground.ground, event, region, view)
        step = _under(baked_steps.of(scene.softground.ground), region, view, event) if region is not None else None
        if event.type == "MOUSEMOVE":
            name = step.name if step else ""
            if name != state.under:
                state.under = name
                _redraw()
            return {"PASS_THROUGH"}
        if event.type == "LEFTMOUSE" and event.value == "PRESS" and region is not None:
            if step is None:
                state.box = [(event.mouse_x - region.x, event.mouse_y - region.y)] * 2
            elif event.shift:
                toggle(step.name)
            else:
                if step.name not in session.chosen_steps():
                    session.choose_steps(step.name)
                preview = step_preview.StepPreview(scene.softground.ground, jobs.run(step_edits.reading(scene)))
                mouse = _on_plane(region, view, event, step.height)
                mouse = step.baked.position[:2] if mouse is None else mouse
                self._drag = _Drag(step, baked_steps.chosen(scene.softground.ground), preview, mouse, step.edit)
            session.redraw()
            _redraw()
            return {"RUNNING_MODAL"}
        return {"PASS_THROUGH"}

    def _box(self, ground: bpy.types.Object, event: bpy.types.Event, region: Any, view: Any) -> OperatorResult:
        """Follow the mouse with a box, and choose the steps whose middles are in it as the button is let go."""
        x, y = event.mouse_x - region.x, event.mouse_y - region.y
        state.box = [state.box[0], (min(max(x, 0), region.width), min(max(y, 0), region.height))]
        if event.type == "LEFTMOUSE" and event.value == "RELEASE":
            inside = _within(state.box, baked_steps.of(ground), region, view)
            names = [*(session.chosen_steps() if event.shift else ()), *inside]
            session.choose_steps(names[0] if names else "", names)
            state.box = ()
            session.redraw()
        _redraw()
        return {"RUNNING_MODAL"}

    def _follow(self, context: bpy.types.Context, mouse: Array | None, *, fine: bool) -> None:
        drag = self._drag
        if drag is None or mouse is None:
            return
        by = (mouse - drag.mouse) * (FINE if fine else 1.0)
        drag.mouse = mouse
        self._change(context, _carried(drag.edit, by, 0.0))

    def _change(self, context: bpy.types.Context, edit: StepEdit) -> None:
        drag, scene = self._drag, context.scene
        if drag is not None and edit != drag.edit:
            drag.edit, state.edits = edit, (edits := drag.edits(edit))
            if not drag.is_slow:
                start = time.thread_time()  # whatever else the machine does
                drag.preview.show(changed(scene.softground.ground, [(step, edits[step.name]) for step in drag.steps]))
                drag.is_slow = len(drag.steps) > 1 and time.thread_time() - start > SLOW
            _redraw()

    def _drop(self, context: bpy.types.Context) -> OperatorResult:
        assert self._drag is not None
        edits = self._drag.edits(self._drag.edit) if self._drag.edit != self._drag.step.edit else {}
        self._leave(context, set())
        if edits:
            state.edits = edits
            bpy.ops.softground.drop_steps("INVOKE_DEFAULT")  # type: ignore[attr-defined]
        return {"FINISHED" if edits else "CANCELLED"}

    def _leave(self, context: bpy.types.Context, result: OperatorResult) -> OperatorResult:
        """Show the ground as it was, and nothing of ours."""
        if self._drag is not None:
            self._drag.preview.end()
            self._drag = None
        state.picking, state.under, state.edits, state.box = False, "", {}, ()
        if context.workspace:
            context.workspace.status_text_set(None)
        _redraw()
        return result


class SOFTGROUND_OT_drop_steps(OnSteps, EditJob):
    """Press the steps that were dragged where they were dropped. Esc cancels"""

    bl_idname = "softground.drop_steps"
    bl_label = "Drag in Viewport"
    bl_options = {"INTERNAL", "UNDO"}

    def wanted(self, ground: bpy.types.Object) -> Wanted:
        edits = state.edits
        return changed(ground, [(step, edits[step.name]) for step in baked_steps.of(ground) if step.name in edits]), []

    def _job_of(self) -> jobs.Job[list[str]]:
        try:
            return (yield from super()._job_of())
        finally:
            state.edits = {}  # until now their outlines are where they were dropped


def _redraw() -> None:
    session.redraw(region_type="WINDOW")


def _viewport(context: bpy.types.Context, event: bpy.types.Event | None) -> tuple[Any, Any]:
    """The viewport's region, and how it looks at the scene; None where the mouse of an event is over another region."""
    area: Any = context.area
    for region in area.regions if area else ():
        over = event and 0 <= event.mouse_x - region.x < region.width and 0 <= event.mouse_y - region.y < region.height
        if region.type != "WINDOW" and over:
            return None, None
    region = next((item for item in area.regions if item.type == "WINDOW"), None) if area else None
    return (region, area.spaces.active.region_3d) if region else (None, None)


def _on_plane(region: Any, view: Any, event: bpy.types.Event, height: float) -> Array | None:
    """Place on a level plane that the mouse points at, (2,) [m]; None where it points past it."""
    from bpy_extras import view3d_utils  # noqa: PLC0415

    scene: Any = bpy.context.scene
    frame = baked_steps.frame_of(scene.softground.ground)
    at = (event.mouse_x - region.x, event.mouse_y - region.y)
    eye = np.array(view3d_utils.region_2d_to_origin_3d(region, view, at))
    origin = from_scene(eye, scene, frame)
    toward = from_scene(eye + view3d_utils.region_2d_to_vector_3d(region, view, at), scene, frame) - origin
    if abs(toward[2]) < 1e-4:
        return None
    along = (height - origin[2]) / toward[2]
    place: Array = (origin + along * toward)[:2]
    return place if along > 0 or not view.is_perspective else None


def _under(
    steps: Sequence[baked_steps.BakedStep], region: Any, view: Any, event: bpy.types.Event
) -> baked_steps.BakedStep | None:
    """The step whose outline is under the mouse, or near it."""
    best, nearest = None, 1.0
    for step in steps:
        mouse = _on_plane(region, view, event, step.height)
        if mouse is None:
            continue
        outline = step.outline()[:, :2]
        middle = outline.mean(axis=0)
        size = REACH * float(np.linalg.norm(outline - middle, axis=1).max())
        distance = float(np.linalg.norm(mouse - middle)) / max(size, 1e-6)
        if distance < nearest:
            best, nearest = step, distance
    return best


def _within(
    box: Sequence[tuple[int, int]], steps: Sequence[baked_steps.BakedStep], region: Any, view: Any
) -> list[str]:
    """Ids of the steps whose middles are seen within a box, two of its corners being given [px]."""
    from bpy_extras.view3d_utils import location_3d_to_region_2d  # noqa: PLC0415

    scene: Any = bpy.context.scene
    low, high = np.min(box, axis=0), np.max(box, axis=0)
    names = []
    for step in steps:
        middle = in_scene(step.outline().mean(axis=0), scene, baked_steps.frame_of(scene.softground.ground))
        place: Any = location_3d_to_region_2d(region, view, Vector(middle.tolist()))
        if place is not None and (low <= place[:]).all() and (place[:] <= high).all():
            names.append(step.name)
    return names


def draw_outlines() -> None:
    """Outline the chosen steps, and the one that could be picked; for the viewport's draw handler."""
    context: Any = bpy.context
    if context.scene is None or not (state.picking or session.current().step):
        return
    place = partial(in_scene, scene=context.scene, frame=baked_steps.frame_of(context.scene.softground.ground))
    with overlay.blending():
        for step, edit, is_chosen in _outlined(context.scene.softground.ground):
            width = overlay.BOLD_LINE if is_chosen else overlay.LINE
            colour = overlay.SIDES.get(step.side, overlay.SIDES[""])
            overlay.draw_line(place(overlay.closed(step.outline(edit))), colour, width)


def draw_numbers() -> None:
    """The numbers of the outlined steps, and the box that chooses; for the viewport's draw handler in pixels."""
    context: Any = bpy.context
    if context.scene is None or not (state.picking or session.current().step):
        return
    ground = context.scene.softground.ground
    for step, edit, _ in _outlined(ground):
        middle = in_scene(step.outline(edit).mean(axis=0), context.scene, baked_steps.frame_of(ground))
        overlay.draw_number(step.number, middle, WHITE)
    if state.box:
        (x, y), (other_x, other_y) = state.box
        corners = np.array([(x, y, 0), (other_x, y, 0), (other_x, other_y, 0), (x, other_y, 0)], float)
        overlay.draw_line(overlay.closed(corners), overlay.SIDES[""], overlay.LINE)


def _outlined(ground: bpy.types.Object | None) -> list[tuple[baked_steps.BakedStep, StepEdit, bool]]:
    """Which steps are outlined, where, and which of them is chosen: while one is picked, all of them."""
    if ground is None or not baked_ground.is_baked(ground):
        return []
    chosen = session.chosen_steps()
    return [
        (step, state.edits.get(step.name, step.edit), step.name in (*chosen, state.under))
        for step in baked_steps.of(ground)
        if state.picking or step.name in chosen
    ]


DRAWN = ((draw_outlines, "POST_VIEW"), (draw_numbers, "POST_PIXEL"))
"""What is drawn over viewports, and when."""

CLASSES = (SOFTGROUND_OT_drag_step, SOFTGROUND_OT_drop_steps)
