"""Whether the bake on the ground still fits, as the panel shows it; worked out after `draw`, never in it."""

from __future__ import annotations

import bpy

from ...core.settings import BakeSettings
from .. import session, settings
from ..baking import bake_report
from ..ground import weather
from . import prediction
from .prediction import SOON

WAIT = 0.3
"""Time until it is looked at again where a bake is running, or a step is dragged [s]."""

_compared: dict[int, BakeSettings] = {}
"""The settings that each scene's bake was compared with last, by session uid."""


def watch(scene: bpy.types.Scene) -> None:
    """Have the bake compared soon if the settings are others now: operators that set some tell nobody."""
    is_another = _compared.get(scene.session_uid) != weather.felt(prediction.asked(scene))
    if is_another and not bpy.app.timers.is_registered(compare_bake):
        bpy.app.timers.register(compare_bake, first_interval=SOON)


def compare_bake() -> float | None:
    """Tell whether the bake on the ground still fits; for a timer, as it may take a while."""
    state = session.current()
    if state.is_live:
        return None  # there is no bake; it is looked again when the prints are kept
    if state.is_baking or session.is_previewing():
        return WAIT
    windows = bpy.context.window_manager.windows
    if windows:
        scene = windows[0].scene
        _compared[scene.session_uid] = weather.felt(settings.snapshot(scene))
        reasons = "\n".join(bake_report.stale_reasons(scene))
        if state.stale != reasons:
            state.stale = reasons
            session.redraw()
    return None


def forget() -> None:
    """Compare anew from now on."""
    _compared.clear()
