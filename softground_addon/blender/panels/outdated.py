"""Outdated bakes, as the panel shows them; computed after `draw`, never in it."""

from __future__ import annotations

import bpy

from .. import session, settings
from ..baking import bake_report
from ..operators import prediction
from ..operators.prediction import SOON
from ..state import state
from ..weather import ground_weather as weather

WAIT = 0.3
"""Time until it is looked at again where a bake is running, or a step is dragged [s]."""


def watch(scene: bpy.types.Scene) -> None:
    """Have the bake compared soon if the settings are others now: operators that set some tell nobody."""
    is_another = state.compared.get(scene.session_uid) != weather.felt(prediction.look(scene)[0])
    if is_another and not bpy.app.timers.is_registered(compare_bake):
        bpy.app.timers.register(compare_bake, first_interval=SOON)


def compare_bake() -> float | None:
    """Tell whether the bake on the ground still fits; for a timer, as it may take a while."""
    panel = session.current()
    if panel.is_live:
        return None  # there is no bake; it is looked again when the prints are kept
    if panel.is_baking or session.is_previewing():
        return WAIT
    windows = bpy.context.window_manager.windows
    if windows:
        scene = windows[0].scene
        state.compared[scene.session_uid] = weather.felt(settings.snapshot(scene))
        reasons = "\n".join(bake_report.stale_reasons(scene))
        if panel.stale != reasons:
            panel.stale = reasons
            session.redraw()
    return None
