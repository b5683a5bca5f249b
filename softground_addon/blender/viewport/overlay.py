"""The overlay in the viewport: predicted footfalls, soles, forces, and the cells of the frame."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any

import bpy
import numpy as np
from mathutils import Vector

from ...core.errors import InputError
from ...core.numerics.arrays import Array
from ...core.record.footprints import Footprint
from .. import jobs, session, settings
from ..ground import baked_steps
from ..live import live
from ..operators import prediction
from ..operators.modal_job import Reading, ReadingShot
from ..placement import in_scene
from ..reading import analysis
from ..state import state
from . import overlay_shapes

Colour = tuple[float, float, float, float]

SIDES: dict[str, Colour] = {"L": (0.25, 0.6, 1.0, 1.0), "R": (1.0, 0.35, 0.3, 1.0), "": (0.9, 0.8, 0.3, 1.0)}
FORCES: dict[str, Colour] = {
    "weight": (0.3, 0.85, 0.35, 1.0),
    "momentum": (1.0, 0.75, 0.15, 1.0),
    "total": (0.95, 0.2, 0.2, 1.0),
}
CONTACT: Colour = (0.95, 0.25, 0.2, 0.45)
RIM: Colour = (0.25, 0.75, 0.95, 0.35)
PRESSED: Colour = (0.1, 0.08, 0.06, 0.6)
FADED = 0.8
"""Opacity of footfalls to come."""
LINE, BOLD_LINE = 1.5, 3.0
"""Widths of lines [px, before the interface's scale]."""
HEAD = 0.15
"""Length of an arrow's head, in lengths of the arrow."""
PATIENCE = 0.5
"""Time from when the overlay cannot be read anew, as a bake runs, until it is tried again [s]."""
TEXT_SIZE = 13
"""Size of the numbers [px, before the interface's scale]."""


def _footfalls(known: analysis.Analysis) -> list[overlay_shapes.Outline]:
    """The footfalls of a shot, as long as it is known."""
    if known not in state.outlines:
        state.outlines[known] = overlay_shapes.footfalls(known.loads, known.shot.terrain)
    return state.outlines[known]


def draw_shapes() -> None:
    """Draw lines and faces in world space; for the viewport's draw handler."""
    panel = session.current()
    context: Any = bpy.context
    if not panel.show_overlay or context.scene is None or not context.space_data.overlay.show_overlays:
        return
    _, predicted = prediction.look(context.scene)
    if predicted is None:
        return
    known = predicted.analysis
    scene = context.scene
    frame = float(scene.frame_current)
    place = partial(in_scene, scene=scene, frame=known.shot.frame)
    with blending():
        if panel.show_cells:
            contact, rim, size = _cells(scene)
            for cells, colour in ((contact, CONTACT), (rim, RIM)):
                _fill(place(overlay_shapes.squares(cells, size, known.shot.terrain)), colour)
        if panel.show_footfalls:
            for outline in _footfalls(known):
                draw_line(place(closed(outline.points)), (*SIDES[outline.side][:3], FADED), LINE)
        if panel.show_soles:
            for outline in overlay_shapes.soles(known.loads, frame):
                draw_line(place(closed(outline.points)), SIDES[outline.side], BOLD_LINE)
        if panel.show_forces:
            for arrow in overlay_shapes.arrows(known.loads, frame):
                _arrow(place(arrow.start), place(arrow.end), FORCES[arrow.kind])


@contextmanager
def blending() -> Iterator[None]:
    """What is drawn within lets what is behind it show through."""
    import gpu  # noqa: PLC0415  (not there in background)

    gpu.state.blend_set("ALPHA")
    try:
        yield
    finally:
        gpu.state.blend_set("NONE")


def draw_pressed() -> None:
    """Draw the prints that a bake has pressed so far, until the ground shows them; for the viewport's draw handler."""
    context: Any = bpy.context
    pressing = state.pressing
    if pressing is None or pressing.of != context.scene.session_uid:
        return
    for footprint in pressing.footprints[len(pressing.shapes) :]:
        pressing.shapes.append(_triangles(corners_of(footprint, pressing, context.scene)))
    if context.space_data.overlay.show_overlays:
        with blending():
            for triangles in pressing.shapes:
                _draw(triangles, PRESSED)


def corners_of(footprint: Footprint, pressing: session.Pressing, scene: bpy.types.Scene) -> Array:
    """Triangles over the cells that a print touches, (6·N, 3), where they are in the scene [Blender units].

    They have no gaps, and are raised by a cell: neither these nor the ground stipple them from afar.
    """
    cells, size = overlay_shapes.touched(footprint), footprint.cell_size
    squares = overlay_shapes.squares(cells, size, pressing.terrain, side=1.0)
    squares[:, 2] += size
    return in_scene(squares, scene, pressing.frame)


def draw_numbers() -> None:
    """Number the footfalls; for the viewport's draw handler in pixels."""
    panel = session.current()
    context: Any = bpy.context
    if not (panel.show_overlay and panel.show_footfalls) or not context.space_data.overlay.show_overlays:
        return
    _, predicted = prediction.look(context.scene)
    if predicted is None:
        return
    known = predicted.analysis
    for number, outline in enumerate(_footfalls(known), start=1):
        middle = in_scene(outline.middle, context.scene, known.shot.frame)
        draw_number(number, middle, SIDES[outline.side], centred=True)


def draw_number(number: int, place: Array, colour: Colour, *, centred: bool = False) -> None:
    """A number at a place in the scene (3,); one that is centred has a shadow."""
    import blf  # noqa: PLC0415
    from bpy_extras.view3d_utils import location_3d_to_region_2d  # noqa: PLC0415

    context: Any = bpy.context
    at = location_3d_to_region_2d(context.region, context.region_data, Vector(place.tolist()))
    if at is None:
        return
    blf.size(0, TEXT_SIZE * context.preferences.system.ui_scale)
    if centred:
        blf.enable(0, blf.SHADOW)
        blf.shadow(0, 3, 0.0, 0.0, 0.0, 0.8)
        width, height = blf.dimensions(0, f"{number}")
        at -= Vector((width, height)) / 2
    blf.position(0, at.x, at.y, 0)
    blf.color(0, *colour)
    blf.draw(0, f"{number}")
    blf.disable(0, blf.SHADOW)


def _cells(scene: bpy.types.Scene) -> tuple[overlay_shapes.Cells, overlay_shapes.Cells, float]:
    """The cells in contact and in the rim at the scene's frame, and their size [m], from live mode or from the bake."""
    shown = live.in_contact(scene.session_uid)
    if shown is not None:
        windows, size, reach = shown
        touched = [overlay_shapes.marked(window, mask) for window, mask in windows]
    else:
        bake = baked_steps.bake_on(scene.softground.ground)
        reach, size = bake.rim_reach, bake.footprints[0].cell_size if bake.footprints else 1.0
        touched = list(overlay_shapes.touched_at(bake.footprints, float(scene.frame_current)))
    return *overlay_shapes.contact_and_rim(touched, reach / size), size


def draw_line(points: Array, colour: Colour, width: float) -> None:
    """A line through points (N, 3) in the units of the scene, of a width [px]."""
    import gpu  # noqa: PLC0415
    from gpu_extras.batch import batch_for_shader  # noqa: PLC0415

    shader = gpu.shader.from_builtin("POLYLINE_UNIFORM_COLOR")
    viewport: Any = gpu.state.viewport_get()  # type: ignore[func-returns-value]
    shader.uniform_float("viewportSize", viewport[2:])
    shader.uniform_float("lineWidth", width * bpy.context.preferences.system.ui_scale)
    shader.uniform_float("color", colour)
    content: Any = {"pos": points.astype(np.float32)}
    batch_for_shader(shader, "LINE_STRIP", content).draw(shader)


def _fill(triangles: Array, colour: Colour) -> None:
    if len(triangles):
        _draw(_triangles(triangles), colour)


def _triangles(corners: Array) -> Any:
    """Triangles (3·N, 3) in the units of the scene, as the graphics card holds them."""
    import gpu  # noqa: PLC0415
    from gpu_extras.batch import batch_for_shader  # noqa: PLC0415

    content: Any = {"pos": corners.astype(np.float32)}
    return batch_for_shader(gpu.shader.from_builtin("UNIFORM_COLOR"), "TRIS", content)


def _draw(triangles: Any, colour: Colour) -> None:
    import gpu  # noqa: PLC0415

    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    shader.uniform_float("color", colour)
    triangles.draw(shader)


def _arrow(start: Array, end: Array, colour: Colour) -> None:
    """A line with a head that faces the viewer."""
    context: Any = bpy.context
    view = np.array(context.region_data.view_matrix.inverted().col[2][:3])
    along = end - start
    aside = np.cross(along, view)
    length = float(np.linalg.norm(aside))
    draw_line(np.stack([start, end]), colour, BOLD_LINE)
    if length > 0:
        base = end - HEAD * along
        wing = aside / length * float(np.linalg.norm(along)) * HEAD / 2
        _fill(np.stack([end, base + wing, base - wing]), colour)


def closed(points: Array) -> Array:
    """An outline (N, 3) that ends where it begins."""
    return np.concatenate([points, points[:1]])


class SOFTGROUND_OT_overlay(ReadingShot):
    """Show or hide predicted footfalls, soles, forces and cells in the viewport"""

    bl_idname = "softground.overlay"
    bl_label = "Footfall Overlay"
    cancelled = "The overlay stays hidden"

    def _job_of(self) -> jobs.Job[bool]:
        shown = session.current().show_overlay
        if not shown:
            yield from analysis.reading(self.scene)
        return not shown

    def _show(self, result: bool) -> None:
        session.current().show_overlay = result
        session.redraw()
        session.redraw(region_type="WINDOW")


class SOFTGROUND_OT_read_again(Reading):
    """Read the edited animation again for the overlay. Esc cancels"""

    bl_idname = "softground.read_again"
    bl_label = "Read Animation"
    bl_options = {"INTERNAL"}
    cancelled = "The overlay shows nothing until the next edit"

    def _job_of(self) -> jobs.Job[bool]:
        with suppress(InputError):  # it says so when the user asks for the depth, or bakes
            yield from analysis.reading(self.scene)
        return analysis.known(settings.snapshot(self.scene)) is not None

    def _show(self, _result: bool) -> None:
        session.redraw(region_type="WINDOW")


def read_again() -> float | None:
    """Predict anew after an edit, for a timer."""
    windows = bpy.context.window_manager.windows
    if not session.current().show_overlay or not windows:
        return None
    if not bpy.ops.softground.read_again.poll():  # type: ignore[attr-defined]
        return PATIENCE
    with bpy.context.temp_override(window=windows[0]):
        bpy.ops.softground.read_again("INVOKE_DEFAULT")  # type: ignore[attr-defined]
    return None


DRAWN = ((draw_shapes, "POST_VIEW"), (draw_pressed, "POST_VIEW"), (draw_numbers, "POST_PIXEL"))
"""What is drawn over viewports, and when."""


def unregister() -> None:
    """Read nothing again any more."""
    if bpy.app.timers.is_registered(read_again):
        bpy.app.timers.unregister(read_again)


class SOFTGROUND_PT_overlay(bpy.types.Panel):
    """Parts of the overlay, among Blender's own"""

    bl_label = "SoftGround"
    bl_space_type = "VIEW_3D"
    bl_region_type = "HEADER"
    bl_parent_id = "VIEW3D_PT_overlay"

    def draw(self, _context: bpy.types.Context) -> None:
        layout: Any = self.layout
        panel = session.current()
        icon = "HIDE_OFF" if panel.show_overlay else "HIDE_ON"
        layout.operator("softground.overlay", icon=icon, depress=panel.show_overlay)
        parts = layout.grid_flow(columns=2)
        parts.active = panel.show_overlay
        for part in ("show_footfalls", "show_soles", "show_forces", "show_cells"):
            parts.prop(panel, part)


CLASSES = (SOFTGROUND_OT_overlay, SOFTGROUND_OT_read_again, SOFTGROUND_PT_overlay)
