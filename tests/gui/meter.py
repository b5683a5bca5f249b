"""How long Blender leaves its user waiting, and how much of that is the add-on's. Runs inside Blender."""

from __future__ import annotations

import sys
import time
from contextlib import contextmanager
from itertools import pairwise

import bpy


class TEST_OT_pauses(bpy.types.Operator):  # noqa: N801
    """Notes the time of every event during a bake, and how far the bake is, until it is told to stop."""

    bl_idname = "test.pauses"
    bl_label = "Measure Pauses"

    events: list[tuple[float, float]] = []  # noqa: RUF012
    running = False
    only_bakes = True

    def invoke(self, context, _event):
        type(self).events.clear()
        type(self).running = True
        self.timer = context.window_manager.event_timer_add(0.005, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, _event):
        if not type(self).running:
            context.window_manager.event_timer_remove(self.timer)
            return {"FINISHED"}
        state = context.window_manager.softground
        if state.is_baking or not type(self).only_bakes:
            type(self).events.append((time.perf_counter(), state.progress))
        return {"PASS_THROUGH"}


def longest_pauses(count: int = 8) -> list[tuple[float, float, float]]:
    """The longest pauses between two events [s], how long after the start they came, and how far the bake was."""
    events = TEST_OT_pauses.events
    first = events[0][0]
    gaps = [(after - before, before - first, progress) for (before, progress), (after, _) in pairwise(events)]
    return sorted(gaps, reverse=True)[:count]


@contextmanager
def ticks_timed():
    """What the ticks of a bake take of the processor [s], each with how far it was: the add-on's own in the pauses."""
    module = next(m for name, m in sys.modules.items() if name.endswith("softground_addon.blender.modal_bake"))
    tick, ticks = module._Bake._tick, []

    def timed(operator):
        started = time.thread_time()
        try:
            return tick(operator)
        finally:
            ticks.append((time.thread_time() - started, bpy.context.window_manager.softground.progress))

    module._Bake._tick = timed
    try:
        yield ticks
    finally:
        module._Bake._tick = tick
