"""Steps in the viewport: the chosen one is outlined with its number, and any of them is picked and dragged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from ...core.errors import SoftGroundError
from ...core.record.edits import FARTHEST, StepEdit
from .. import session, settings
from ..baking import step_edits
from ..baking.step_preview import StepPreview
from ..ground import baked_ground
from . import baked_steps, overlay
from .baked_steps import BakedStep
from .step_editing import OnSteps, changed, show

Array = NDArray[np.float64]

TURN_STEP = 5.0
"""How far the mouse wheel turns a step that is dragged [deg]."""
REACH = 1.4
"""A click picks a step within so many times the size of its outline."""
_HINT = "Drag a print   ·   Wheel: turn it   ·   Shift: move it finely   ·   Esc: leave it"
FINE = 0.1
"""How much slower a print follows the mouse while Shift is held."""


@dataclass
class _Drag:
    """A step that is being dragged: the bake that it is of, what shows it, and where it is."""

    step: BakedStep
    bake: step_edits.EditableBake
    preview: StepPreview
    mouse: Array
    edit: StepEdit


@dataclass
class _Shown:
    """What the viewport outlines beside the chosen step."""

    picking: bool = False
    under: str = ""
    edit: StepEdit | None = None


_shown = _Shown()


class SOFTGROUND_OT_drag_step(OnSteps, bpy.types.Operator):
    """Pick a print in the viewport and drag it to another place; the wheel turns it, Esc leaves it as it was"""

    bl_idname = "softground.drag_step"
    bl_label = "Drag in Viewport"
    bl_options = {"REGISTER", "UNDO"}

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if context.area is None or context.area.type != "VIEW_3D":
            self.report({"ERROR"}, "Prints are dragged in a 3D viewport")
            return {"CANCELLED"}
        self._drag: _Drag | None = None
        _shown.picking = True
        manager: Any = context.window_manager
        manager.modal_handler_add(self)
        context.workspace.status_text_set(_HINT)
        _redraw()
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        try:
            return self._handle(context, event)
        except SoftGroundError as error:
            self.report({"ERROR"}, str(error))
            return self._leave(context, {"CANCELLED"})
        except BaseException:
            self._leave(context, {"CANCELLED"})
            raise

    def cancel(self, context: bpy.types.Context) -> None:
        self._leave(context, {"CANCELLED"})

    def _handle(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type in ("ESC", "RIGHTMOUSE"):
            return self._leave(context, {"CANCELLED"})
        region, view = _viewport(context, event)
        if self._drag is None:
            return self._pick(context, event, region, view)
        if event.type == "MOUSEMOVE" and region is not None:
            self._follow(context, _on_plane(region, view, event, self._drag.step.height), fine=event.shift)
        elif event.type in ("WHEELUPMOUSE", "WHEELDOWNMOUSE"):
            turn = self._drag.edit.turn_deg + TURN_STEP * (1 if event.type == "WHEELUPMOUSE" else -1)
            self._change(context, replace(self._drag.edit, turn_deg=(turn + 180.0) % 360.0 - 180.0))
        elif event.type == "LEFTMOUSE" and event.value == "RELEASE":
            return self._drop(context)
        return {"RUNNING_MODAL"}

    def _pick(self, context: bpy.types.Context, event: bpy.types.Event, region: Any, view: Any) -> set[str]:
        """Outline the print under the mouse, and take hold of it at a click."""
        scene = settings.scene_of(context)
        step = _under(baked_steps.of(scene), region, view, event) if region is not None else None
        if event.type == "MOUSEMOVE":
            name = step.name if step else ""
            if name != _shown.under:
                _shown.under = name
                _redraw()
            return {"PASS_THROUGH"}
        if event.type == "LEFTMOUSE" and event.value == "PRESS" and region is not None:
            if step is not None:
                session.current().step = step.name
                bake = step_edits.editable(scene)
                preview = StepPreview(scene.softground.ground, bake)
                mouse = _on_plane(region, view, event, step.height)
                self._drag = _Drag(step, bake, preview, step.baked.position[:2] if mouse is None else mouse, step.edit)
                session.redraw()
            return {"RUNNING_MODAL"}
        return {"PASS_THROUGH"}

    def _follow(self, context: bpy.types.Context, mouse: Array | None, *, fine: bool) -> None:
        drag = self._drag
        if drag is None or mouse is None:
            return
        by = (mouse - drag.mouse) * (FINE if fine else 1.0)
        drag.mouse = mouse
        move = np.clip(np.round(np.array(drag.edit.move_m) + by, 6), -FARTHEST, FARTHEST)
        self._change(context, replace(drag.edit, move_m=(float(move[0]), float(move[1]))))

    def _change(self, context: bpy.types.Context, edit: StepEdit) -> None:
        drag, scene = self._drag, settings.scene_of(context)
        if drag is not None and edit != drag.edit:
            drag.preview.show(changed(scene, [(drag.step, edit)]))
            drag.edit = _shown.edit = edit
            _redraw()

    def _drop(self, context: bpy.types.Context) -> set[str]:
        drag, scene = self._drag, settings.scene_of(context)
        assert drag is not None
        edits, is_moved = changed(scene, [(drag.step, drag.edit)]), drag.edit != drag.step.edit
        self._leave(context, set())
        if is_moved:
            show(scene, edits, drag.bake)
        return {"FINISHED" if is_moved else "CANCELLED"}

    def _leave(self, context: bpy.types.Context, result: set[str]) -> set[str]:
        """Show the ground as it was, and nothing of ours."""
        if self._drag is not None:
            self._drag.preview.end()
            self._drag = None
        _shown.picking, _shown.under, _shown.edit = False, "", None
        context.workspace.status_text_set(None)
        _redraw()
        return result


def _redraw() -> None:
    session.redraw(region_type="WINDOW")


def _viewport(context: bpy.types.Context, event: bpy.types.Event) -> tuple[Any, Any]:
    """The viewport's region under the mouse, and how it looks at the scene; None beside it."""
    area: Any = context.area
    for region in area.regions if area else ():
        inside = 0 <= event.mouse_x - region.x < region.width and 0 <= event.mouse_y - region.y < region.height
        if region.type != "WINDOW" and inside:
            return None, None
    region = next((one for one in area.regions if one.type == "WINDOW"), None) if area else None
    return (region, area.spaces.active.region_3d) if region else (None, None)


def _on_plane(region: Any, view: Any, event: bpy.types.Event, height: float) -> Array | None:
    """Where the mouse points at on a level plane, (2,) [m]; None where it points past it."""
    from bpy_extras import view3d_utils  # noqa: PLC0415

    metre = float(bpy.context.scene.unit_settings.scale_length)
    at = (event.mouse_x - region.x, event.mouse_y - region.y)
    origin = np.array(view3d_utils.region_2d_to_origin_3d(region, view, at)) * metre
    toward = np.array(view3d_utils.region_2d_to_vector_3d(region, view, at))
    if abs(toward[2]) < 1e-4:
        return None
    along = (height - origin[2]) / toward[2]
    place: Array = (origin + along * toward)[:2]
    return place if along > 0 or not view.is_perspective else None


def _under(steps: Sequence[BakedStep], region: Any, view: Any, event: bpy.types.Event) -> BakedStep | None:
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


def draw_outlines() -> None:
    """Outline the chosen step, and the one that could be picked; for the viewport's draw handler."""
    context: Any = bpy.context
    if context.scene is None or not (_shown.picking or session.current().step):
        return
    metre = 1.0 / context.scene.unit_settings.scale_length
    import gpu  # noqa: PLC0415  (not there in background)

    gpu.state.blend_set("ALPHA")
    try:
        for step, edit, is_chosen in _outlined(context.scene):
            width = overlay.BOLD_LINE if is_chosen else overlay.LINE
            colour = overlay.SIDES.get(step.side, overlay.SIDES[""])
            overlay.draw_line(overlay.closed(step.outline(edit)) * metre, colour, width)
    finally:
        gpu.state.blend_set("NONE")


def draw_numbers() -> None:
    """The numbers of the outlined steps; for the viewport's draw handler in pixels."""
    context: Any = bpy.context
    if context.scene is None or not (_shown.picking or session.current().step):
        return
    import blf  # noqa: PLC0415
    from bpy_extras.view3d_utils import location_3d_to_region_2d  # noqa: PLC0415

    metre = 1.0 / context.scene.unit_settings.scale_length
    blf.size(0, overlay.TEXT_SIZE * context.preferences.system.ui_scale)
    for step, edit, _ in _outlined(context.scene):
        middle = step.outline(edit).mean(axis=0) * metre
        place = location_3d_to_region_2d(context.region, context.region_data, Vector(middle.tolist()))
        if place is not None:
            blf.position(0, place.x, place.y, 0)
            blf.color(0, 1.0, 1.0, 1.0, 1.0)
            blf.draw(0, f"{step.number}")


def _outlined(scene: bpy.types.Scene) -> list[tuple[BakedStep, StepEdit, bool]]:
    """Which steps are outlined, where, and which of them is chosen: while one is picked, all of them."""
    ground = scene.softground.ground
    if ground is None or not baked_ground.is_baked(ground):
        return []
    chosen = session.current().step
    return [
        (step, (_shown.edit or step.edit) if step.name == chosen else step.edit, step.name in (chosen, _shown.under))
        for step in baked_steps.of(scene)
        if _shown.picking or step.name == chosen
    ]


_handles: list[Any] = []
"""What Blender wants back to take the draw handlers away."""


def register() -> None:
    """Add the draw handlers, where there is anything to draw on."""
    if not bpy.app.background:
        for draw, when in ((draw_outlines, "POST_VIEW"), (draw_numbers, "POST_PIXEL")):
            _handles.append(bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", when))


def unregister() -> None:
    """Take the draw handlers away, and forget the steps that were shown."""
    while _handles:
        bpy.types.SpaceView3D.draw_handler_remove(_handles.pop(), "WINDOW")
    baked_steps.forget()


CLASSES = (SOFTGROUND_OT_drag_step,)
