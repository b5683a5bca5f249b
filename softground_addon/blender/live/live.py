"""Live mode: the ground gives way while the timeline plays, is stepped or is scrubbed, and as sliders are moved.

While it is on no operator is at work: a handler follows the frame, and a timer the settings once the panel is drawn or
something is edited, so that autosave, undo and every other tool go on working, and nothing runs where nothing changes.
While live mode is on, the ground carries the prints that a bake would make.
"""

from __future__ import annotations

import time
from typing import Any

import bpy

from ...core.errors import InputError
from .. import session, settings
from ..ground import baked_ground
from ..remedies import said
from ..state import state
from ..translation import translated
from .live_mode import PART, Contact, LiveMode

LOOK = 0.1
"""Time between two looks at the settings [s]."""
SOON = 0.05
"""Time from a possible change to the first look [s]."""
PAUSE = 0.005
"""Time for everything else between two parts of an answer [s]."""
LONGEST_PART = 0.05
"""Largest processor time of a part, if drawing between two parts takes as long [s]."""


def is_on() -> bool:
    """True if live mode is on."""
    return state.live is not None


def follow(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None) -> None:
    """Handle a change of the frame; never during a render."""
    if state.live is None or state.live.rendering or scene.session_uid != state.live.scene:
        return
    if depsgraph is not None and depsgraph.mode == "RENDER":
        return
    if not state.live.follow():
        _lose_grounds()


def in_contact(uid: int) -> Contact | None:
    """Cells in contact at the frame that is shown; None if live mode is not on in the scene of that session uid."""
    if state.live is None or state.live.scene != uid:
        return None
    return state.live.in_contact()


def rendering(active: bool) -> None:
    """Handle the begin or the end of a render."""
    if state.live is not None:
        state.live.rendering = active


def after_undo() -> None:
    """Handle an undo or redo: the mesh is replaced; live mode goes on if the new one is its own."""
    scene = _scene()
    if state.live is not None and (scene is None or not state.live.show_anew()):
        grounds = settings.listed_grounds(scene.softground) if scene else []
        if any(map(baked_ground.has_remains, grounds)):
            _lose_grounds()
        else:
            forget()


def answer(seconds: float | None = None) -> float | None:
    """Press again with the present settings, for a little while; for a timer.

    A part takes as long as the work since the last, such as drawing, within `PART` and `LONGEST_PART`: where a picture
    takes a second the answer would take a minute otherwise.
    """
    scene = _scene()
    if state.live is None or scene is None:
        return None
    if state.live.rendering or session.current().is_baking:
        return LOOK
    try:
        waited = time.perf_counter() - state.live.answered_at
        part = min(max(waited, PART), LONGEST_PART) if seconds is None else seconds
        if state.live.answer(part):
            return PAUSE
        return LOOK if state.live.has_more() else None
    except InputError as error:
        forget(said(error))
    return None


def watch() -> None:
    """Check soon if the ground is to be pressed again, as the panel is drawn or something was edited."""
    # In background a timer that waits would keep the bpy module from ending; there the next frame looks.
    if state.live is not None and not bpy.app.background and not bpy.app.timers.is_registered(answer):
        bpy.app.timers.register(answer, first_interval=SOON)


def is_answering() -> bool:
    """True if live mode is on and does not show the present settings yet."""
    scene = _scene()
    return state.live is not None and scene is not None and state.live.has_more()


def refusal() -> str:
    """Reason why live mode does not press with the present settings, or why it has ended; empty if it does."""
    scene = _scene()
    return state.live_ended if state.live is None or scene is None else state.live.refusal()


def begin(mode: LiveMode) -> None:
    """Follow timeline and settings from now on."""
    state.live, state.live_ended = mode, ""
    session.current().is_live = True
    bpy.types.STATUSBAR_HT_header.prepend(_draw_in_status_bar)
    if settings.scene_with(mode.scene):
        mode.follow()  # the frame may have changed meanwhile
    watch()


def _lose_grounds() -> None:
    """End live mode, as what it shows is gone in part."""
    forget(translated("a ground or its prints are gone: clear what is left, and start it again"))


def forget(reason: str = "") -> None:
    """End live mode as it stands, because its scene or its ground went away, or for a reason that the panel shows until
    the next bake."""
    state.live, state.live_ended = None, translated("Live mode has ended: {reason}", reason=reason) if reason else ""
    if bpy.app.timers.is_registered(answer):
        bpy.app.timers.unregister(answer)
    session.current().is_live = False
    bpy.types.STATUSBAR_HT_header.remove(_draw_in_status_bar)
    session.redraw()


def _draw_in_status_bar(header: Any, _context: bpy.types.Context) -> None:
    """Show that live mode is on, and how it ends; in every workspace, unlike `WorkSpace.status_text_set`."""
    header.layout.label(text="Live Footprints  |  End with Keep or Discard in the sidebar")


def discard() -> None:
    """End live mode and take its prints off the ground, as the file or the add-on is about to go."""
    if state.live is not None:
        state.live.discard()
    forget()


def _scene() -> bpy.types.Scene | None:
    return settings.scene_with(state.live.scene) if state.live else None
