"""How long Blender leaves its user waiting, and how much of that is the add-on's. Runs inside Blender."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise

import bpy

from tests.gui.hand import module


class TEST_OT_pauses(bpy.types.Operator):  # noqa: N801
    """Notes the time of every event, whether a bake runs, and how far it is, until it is told to stop."""

    bl_idname = "test.pauses"
    bl_label = "Measure Pauses"

    events: list[tuple[float, bool, float]] = []  # noqa: RUF012
    running = False

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
        type(self).events.append((time.perf_counter(), state.is_baking, state.progress))
        return {"PASS_THROUGH"}


def longest_pauses(*, during_bake: bool, count: int = 8) -> list[tuple[float, float]]:
    """The longest pauses between two events [s] and how far the bake was, the one in which it ends among them."""
    areas = [
        (after - before, progress)
        for (before, baking, progress), (after, _, _) in pairwise(TEST_OT_pauses.events)
        if baking or not during_bake
    ]
    return sorted(areas, reverse=True)[:count]


@contextmanager
def ticks_timed() -> Iterator[list[tuple[float, float]]]:
    """What the ticks of a bake take of the processor [s], each with how far it was: the add-on's own in the pauses."""
    bakes = module("operators.modal_job")
    tick, ticks = bakes.ModalJob._tick, []

    def timed(operator):
        started = time.thread_time()
        try:
            return tick(operator)
        finally:
            ticks.append((time.thread_time() - started, bpy.context.window_manager.softground.progress))

    bakes.ModalJob._tick = timed
    try:
        yield ticks
    finally:
        bakes.ModalJob._tick = tick


@contextmanager
def drawings_counted() -> Iterator[list[float]]:
    """When the scene was drawn in a viewport [s], which takes the longest of all that a window shows."""
    drawings: list[float] = []
    handle = bpy.types.SpaceView3D.draw_handler_add(
        lambda: drawings.append(time.perf_counter()), (), "WINDOW", "PRE_VIEW"
    )
    try:
        yield drawings
    finally:
        bpy.types.SpaceView3D.draw_handler_remove(handle, "WINDOW")
