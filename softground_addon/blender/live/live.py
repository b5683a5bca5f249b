"""Live mode: the ground gives way while the timeline plays, is stepped or is scrubbed, and as sliders are moved.

No modal operator is needed for it: a handler follows the frame, and a timer the settings once the panel is drawn or
something is edited, so that autosave, undo and every other tool go on working, and nothing runs where nothing changes.
While live mode is on, the ground carries what a bake would leave on it.
"""

from __future__ import annotations

import time
from typing import Any

import bpy
from bpy.props import BoolProperty

from ...core.errors import InputError
from .. import session, settings
from ..characters.character_setup import characters_of
from ..ground import baked_ground
from ..operator_base import reports_errors
from ..reading import analysis
from .live_mode import Contact, LiveMode

LOOK = 0.1
"""Time after which it is looked again whether the settings are others [s]."""
SOON = 0.05
"""Time from what may have changed something to the first look [s]."""
PAUSE = 0.005
"""Time that is left to everything else between two parts of an answer [s]."""
PART = 0.025
"""What a part of an answer takes of the processor, beside the frame that is being pressed when it is over [s]."""
LONGEST_PART = 0.05
"""What it may take where drawing between two parts takes as long [s]."""

_mode: LiveMode | None = None
"""Live mode if it is on: Blender's handlers are functions, so that what they follow lives here."""


def is_on() -> bool:
    """Whether live mode is on."""
    return _mode is not None


def follow(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None) -> None:
    """Handle a change of the frame; never during a render."""
    if _mode is None or _mode.rendering or scene.session_uid != _mode.scene:
        return
    if depsgraph is not None and depsgraph.mode == "RENDER":
        return
    if not _mode.follow(scene):
        forget()


def in_contact(scene: bpy.types.Scene) -> Contact | None:
    """Cells in contact at the frame that is shown; None if live mode is not on there."""
    if _mode is None or _mode.scene != scene.session_uid:
        return None
    return _mode.in_contact()


def rendering(active: bool) -> None:
    """Handle the begin or the end of a render."""
    if _mode is not None:
        _mode.rendering = active


def after_undo() -> None:
    """Handle an undo or redo: the mesh is another one now, live mode goes on if it still is live mode's."""
    scene = _scene()
    if _mode is not None and (scene is None or not _mode.show_anew(scene)):
        forget()


def answer(seconds: float | None = None) -> float | None:
    """Press again what the settings of the moment ask for, for a little while; for a timer.

    As long as what else was done since, such as drawing, within `PART` and `LONGEST_PART`: where a picture takes a
    second the answer would take a minute otherwise.
    """
    scene = _scene()
    if _mode is None or scene is None:
        return None
    if _mode.rendering or session.current().is_baking:
        return LOOK
    try:
        part = min(max(time.perf_counter() - _mode.answered_at, PART), LONGEST_PART) if seconds is None else seconds
        if _mode.answer(scene, part):
            return PAUSE
        return LOOK if _mode.has_more(scene) else None
    except InputError:
        forget()
    return None


def watch() -> None:
    """Look soon whether there is something to press again, as the panel is drawn or something was edited."""
    # In background a timer that waits would keep the bpy module from ending; there the next frame looks.
    if _mode is not None and not bpy.app.background and not bpy.app.timers.is_registered(answer):
        bpy.app.timers.register(answer, first_interval=SOON)


def is_answering() -> bool:
    """Whether live mode is on and has not shown yet what the settings of the moment ask for."""
    scene = _scene()
    return _mode is not None and scene is not None and _mode.has_more(scene)


def refusal() -> str:
    """Why live mode does not press with the settings of the moment; empty where it does."""
    scene = _scene()
    if _mode is None or scene is None or not _mode.has_refused:
        return ""
    return _mode.refusal(settings.snapshot(scene))


def forget() -> None:
    """End live mode as it stands, because its scene or its ground went away."""
    global _mode  # noqa: PLW0603
    _mode = None
    if bpy.app.timers.is_registered(answer):
        bpy.app.timers.unregister(answer)
    session.current().is_live = False
    bpy.types.STATUSBAR_HT_header.remove(_draw_in_status_bar)
    session.redraw()


def _draw_in_status_bar(header: Any, _context: bpy.types.Context) -> None:
    """Say that live mode is on, and how it ends; in every workspace, unlike `WorkSpace.status_text_set`."""
    header.layout.label(text="Live Footprints  |  End with Keep or Discard in the sidebar")


def discard() -> None:
    """End live mode and take its prints off the ground, as the file or the add-on is about to go."""
    if _mode is not None:
        _mode.discard()
        forget()


def _scene() -> bpy.types.Scene | None:
    return _mode.current_scene() if _mode else None


class SOFTGROUND_OT_live(bpy.types.Operator):
    """Let the ground give way while the timeline plays, or end live mode"""

    bl_idname = "softground.live"
    bl_label = "Live Footprints"
    bl_options = {"REGISTER", "UNDO"}

    keep: BoolProperty(
        name="Keep",
        description="When live mode ends, keep the prints as a bake instead of removing them",
        default=False,
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether live mode can start or end; otherwise the button says what is missing."""
        if is_on():
            return True
        reason = _why_not(context)
        if reason:
            cls.poll_message_set(reason)
        return not reason

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: Any) -> str:
        """What the button does at the moment."""
        if not is_on():
            return "Press prints while the timeline plays. Move a slider, and the prints follow"
        if properties.keep:
            return "End live mode and leave the prints on the ground, as a bake up to the current frame"
        return "End live mode and leave the ground as it was before"

    @reports_errors
    def execute(self, context: bpy.types.Context) -> set[str]:
        global _mode  # noqa: PLW0603
        scene = _scene() or settings.scene_of(context)
        if _mode is None:
            _mode = LiveMode(scene)
            session.current().is_live = True
            bpy.types.STATUSBAR_HT_header.prepend(_draw_in_status_bar)
            _mode.follow(scene)
            watch()
        elif self.keep:
            with analysis.own_changes(scene):
                _mode.keep(scene)
            forget()
        else:
            discard()
        session.redraw()
        return {"FINISHED"}


def _why_not(context: bpy.types.Context) -> str:
    """What keeps live mode from starting, or an empty text."""
    options = settings.scene_of(context).softground
    if session.current().is_baking:
        return "A bake is running"
    if session.is_rendering():
        return "A render is running: wait until it has ended"
    if not characters_of(settings.scene_of(context)):
        return "Add a character first: select its armature and press Add Character"
    if options.ground and baked_ground.is_baked(options.ground):
        return "There is a bake on the ground: clear it first"
    return ""


CLASSES = (SOFTGROUND_OT_live,)
