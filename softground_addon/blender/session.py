"""State of the moment: `window_manager.softground`. Never saved with a file and no part of undo."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import bpy
from bpy.props import BoolProperty, FloatProperty, StringProperty

from ..core.ground.heightfield import Terrain
from ..core.motion.ground_frame import GroundFrame
from ..core.record.footprints import Footprint
from .state import state
from .translation import CONTEXT

PANELS = {"VIEW_3D": "UI", "PROPERTIES": "WINDOW"}
"""Editors that show the add-on's panels, each with the region that has them."""


def _is_baking(_session: SoftGroundSession) -> bool:
    return state.is_baking


def _progress_of(_session: SoftGroundSession) -> float:
    return state.progress


def _status_of(_session: SoftGroundSession) -> str:
    return state.status


class SoftGroundSession(bpy.types.PropertyGroup):
    """Progress of the bake, and whether live mode is on."""

    is_baking: BoolProperty(name="Baking", description="A bake is under way", get=_is_baking)
    cancel_requested: BoolProperty(name="Cancel Requested", description="Stop the bake at its next step")
    progress: FloatProperty(
        name="Progress", description="How much of the bake is done", min=0.0, max=1.0, get=_progress_of
    )
    status: StringProperty(name="Status", description="What the bake is doing, and the time left", get=_status_of)
    stale: StringProperty(name="Outdated", description="What has changed since the bake, one change per line")
    show_overlay: BoolProperty(
        name="Overlay", description="Show predicted footfalls, soles, forces and cells in the viewport"
    )
    show_footfalls: BoolProperty(
        name="Footfalls", description="Where the soles will land, numbered in order", default=True
    )
    show_soles: BoolProperty(name="Soles", description="Outlines of the soles at the current frame", default=True)
    show_forces: BoolProperty(
        name="Forces",
        translation_context=CONTEXT,
        description="Forces on the soles at the current frame: weight (green), momentum (yellow) and total (red)",
        default=True,
    )
    show_cells: BoolProperty(
        name="Cells",
        description="Cells in contact (red) and those around them that take up the rim (blue) at the "
        "current frame, from live mode or the bake",
        default=True,
    )
    step: StringProperty(name="Step", description="Id of the selected step of the bake")
    is_live: BoolProperty(name="Live", description="The ground gives way while the timeline plays")


CLASSES = (SoftGroundSession,)


def current() -> Any:
    """The session's state."""
    return bpy.context.window_manager.softground


def show_bake(progress: float, status: str) -> None:
    """Let the panel say how far the bake is, 0 to 1, and what it is doing; at times the viewport shows its prints."""
    state.is_baking, state.progress, state.status, state.live_ended = True, progress, status, ""
    redraw()
    pressing = state.pressing
    if pressing and len(pressing.footprints) > RARER * pressing.announced:
        pressing.announced = len(pressing.footprints)
        redraw(region_type="WINDOW")


RARER = 4
"""Growth in number after which the viewport is asked to draw early prints again: to draw a heavy scene may take longer
than to press a step."""


@dataclass
class Pressing:
    """Prints that a bake has pressed so far.

    Attributes
    ----------
    of : int
        Session uid of the scene that is baked: windows may show others.
    terrain : Terrain
        The undisturbed ground.
    frame : GroundFrame or None
        That terrain and prints are in, instead of the world.
    footprints : list of Footprint
    announced : int
        Number of them when the viewport was last asked to draw.
    shapes : list
        Triangles of the first of them, as the viewport has drawn them.
    """

    of: int
    terrain: Terrain
    frame: GroundFrame | None
    footprints: list[Footprint] = field(default_factory=list)
    announced: int = 0
    shapes: list[Any] = field(default_factory=list)


def show_pressing(of: int, terrain: Terrain, frame: GroundFrame | None) -> list[Footprint] | None:
    """The list whose prints the viewport shows until the bake ends; None where no window shows the bake."""
    state.pressing = Pressing(of, terrain, frame) if state.is_baking else None
    return state.pressing and state.pressing.footprints


def show_no_bake() -> None:
    """Let the panel show that no bake runs."""
    state.is_baking, state.progress, state.status, state.pressing = False, 0.0, "", None
    redraw()
    redraw(region_type="WINDOW")


def show_preview(is_shown: bool) -> None:
    """Note whether the ground shows for a moment what it does not hold."""
    state.is_previewing = is_shown


def is_previewing() -> bool:
    """True if the ground shows for a moment what it does not hold, as while a step is dragged."""
    return state.is_previewing


def choose_steps(step: str, also: Iterable[str] = ()) -> None:
    """Choose a step of the bake by its id, and others with it."""
    current().step = step
    state.also_chosen = tuple(name for name in also if name != step)


def chosen_steps() -> tuple[str, ...]:
    """Ids of the steps that are chosen: first the one that the panel shows."""
    step = current().step
    return (step, *(name for name in state.also_chosen if name != step)) if step else ()


def is_rendering() -> bool:
    """True if Blender renders beside what its user does."""
    return bool(bpy.app.is_job_running("RENDER"))  # type: ignore[func-returns-value]


def redraw(*, region_type: str = "UI") -> None:
    """Have all panels drawn again, or with "WINDOW" the viewports."""
    shown = PANELS if region_type == "UI" else {"VIEW_3D": region_type}
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions:
                if region.type == shown.get(area.type):
                    region.tag_redraw()
