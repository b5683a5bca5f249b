"""How long Blender leaves its user waiting. Runs inside Blender."""

from __future__ import annotations

import time
from itertools import pairwise

import bpy


class TEST_OT_pauses(bpy.types.Operator):  # noqa: N801
    """Notes the time of every event during a bake, until it is told to stop."""

    bl_idname = "test.pauses"
    bl_label = "Measure Pauses"

    times: list[float] = []  # noqa: RUF012
    running = False

    def invoke(self, context, _event):
        type(self).times.clear()
        type(self).running = True
        self.timer = context.window_manager.event_timer_add(0.005, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, _event):
        if not type(self).running:
            context.window_manager.event_timer_remove(self.timer)
            return {"FINISHED"}
        if context.window_manager.softground.is_baking:
            type(self).times.append(time.perf_counter())
        return {"PASS_THROUGH"}


def longest() -> tuple[float, float]:
    """The longest pause between two events [s], and how long after the start it came."""
    times = TEST_OT_pauses.times
    gaps = [(after - before, before - times[0]) for before, after in pairwise(times)]
    return max(gaps)
