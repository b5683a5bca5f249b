"""The buttons that start and end live mode."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from typing import Any

import bpy
from bpy.props import BoolProperty

from .. import jobs, session, settings
from ..live import live, live_mode, live_start
from ..reading import analysis
from ..state import state
from ..translation import translated
from .modal_job import BUSY, ModalJob, why_no_start


class SOFTGROUND_OT_live(ModalJob):
    """Let the ground give way while the timeline plays, or end live mode. Esc cancels"""

    bl_idname = "softground.live"
    bl_label = "Live Footprints"

    keep: BoolProperty(
        name="Keep",
        description="When live mode ends, keep the prints as a bake instead of removing them",
        default=False,
        options={"SKIP_SAVE"},
    )

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        if live.is_on():
            return BUSY if session.current().is_baking else ""
        return why_no_start(context) or live_start.bake_in_the_way(settings.options_of(context))

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: Any) -> str:
        """Effect of the button at the moment."""
        if not live.is_on():
            return translated(
                "Press prints while the timeline plays. Move a slider, and the prints follow. Esc cancels"
            )
        if properties.keep:
            return translated(
                "End live mode and leave the prints on the ground, as a bake up to the current frame. Esc cancels"
            )
        return translated("End live mode and leave the ground as it was before")

    def _job_of(self) -> jobs.Job[live_mode.LiveMode | None]:
        if state.live is None:
            return (yield from live_start.starting(self.scene))
        if self.keep:
            yield from state.live.keeping()
            live.forget()
        else:
            live.discard()
        return None

    def _changing(self) -> AbstractContextManager[None]:
        if state.live is None:
            return nullcontext()
        return analysis.own_changes(settings.scene_with(state.live.scene) or self.scene)

    def _show(self, result: live_mode.LiveMode | None) -> None:
        if result is not None:
            live.begin(result)
        session.redraw()


CLASSES = (SOFTGROUND_OT_live,)
