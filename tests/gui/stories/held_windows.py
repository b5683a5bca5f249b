"""What an artist does beside a bake, in the sidebar of another add-on and in a second window."""

from __future__ import annotations

from typing import Any

import bpy

from tests.gui.hand import SHORT, Hand, Steps
from tests.gui.shot import open_walk

SLOW_CELLS = 0.002
"""Cells of a bake that lasts until it is cancelled [m]."""

DOWN = 40
"""How far below the top of the sidebar the first row of Location is, in its own heights of about half a row [px]."""


def tell(hand: Hand, facts: dict) -> Steps:
    walker = open_walk(250)
    with_viewport(hand, bpy.ops.softground.add_character)
    scene().softground.cell_size = SLOW_CELLS
    yield from hand.open_sidebar("Item")
    second = yield from open_second(hand)

    yield from begin(hand)
    before = walker.location.copy()
    yield from drag_over_fields(hand)
    facts["Item while it bakes: moved"] = walker.location != before
    yield from key(second, "A")
    facts["second window while it bakes: selected"] = bpy.data.objects["Walker Figure"].select_get()
    facts["still bakes"] = session().is_baking
    yield from key(second, "ESC")
    yield from hand.wait_for(lambda: not session().is_baking, 10)
    facts["cancelled from the second window"] = True

    yield from drag_over_fields(hand)
    facts["Item after it: moved"] = walker.location != before
    yield from key(second, "A")
    facts["second window after it: selected"] = bpy.data.objects["Walker Figure"].select_get()


def open_second(hand: Hand) -> Steps:
    with_viewport(hand, bpy.ops.wm.window_new)
    yield 1.0
    return next(window for window in bpy.context.window_manager.windows if window != hand.window)


def begin(hand: Hand) -> Steps:
    with_viewport(hand, bpy.ops.softground.bake, "INVOKE_DEFAULT")
    yield from hand.wait_for(lambda: session().progress > 0, 60)


def drag_over_fields(hand: Hand) -> Steps:
    """Drag from each of the upper places in the sidebar to its right, so that a field that is there changes."""
    region = hand.region()
    x, top = region.x + region.width // 2, region.y + region.height
    for y in range(top - DOWN, top - 4 * DOWN, -DOWN // 4):
        yield from hand.move(x, y)
        hand.event("LEFTMOUSE", "PRESS")
        yield SHORT
        for step in range(1, 5):
            yield from hand.move(x + 8 * step, y)
        hand.event("LEFTMOUSE", "RELEASE")
        yield SHORT


def key(window: Any, kind: str) -> Steps:
    area = max(window.screen.areas, key=lambda area: area.width * area.height)
    place = {"x": area.x + area.width // 2, "y": area.y + area.height // 2}
    for event, value in (("MOUSEMOVE", "NOTHING"), (kind, "PRESS"), (kind, "RELEASE")):
        window.event_simulate(event, value, **place)
        yield 0.1


def with_viewport(hand: Hand, operator: Any, *arguments: str) -> Any:
    with bpy.context.temp_override(window=hand.window, area=hand.area(), region=hand.region("WINDOW")):
        return operator(*arguments)


def scene() -> Any:
    return bpy.context.window_manager.windows[0].scene


def session() -> Any:
    return bpy.context.window_manager.softground
