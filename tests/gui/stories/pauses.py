"""The same bake a few times, and how long Blender leaves its user waiting each time."""

from __future__ import annotations

import bpy

from tests.gui import meter
from tests.gui.hand import Hand, Steps
from tests.gui.shot import open_walk

FRAMES = 250

BAKES = 4
"""What the add-on makes Blender's user wait for comes back in each of them; what else the machine does does not."""

DRAWINGS = 5
"""Of the whole window, before each bake."""


def tell(hand: Hand, facts: dict) -> Steps:
    bpy.utils.register_class(meter.TEST_OT_pauses)
    open_walk(FRAMES)
    draw_little()
    yield from hand.open_sidebar()
    yield from hand.frame_all()
    run(hand, bpy.ops.softground.add_character)
    yield 1.0
    yield from hand.wait_for(lambda: not bpy.context.window_manager.softground.is_baking, 60)
    facts["window"] = (hand.window.width, hand.window.height)
    facts["drawing the window"], facts["bakes"] = [], []
    for _ in range(BAKES):
        facts["drawing the window"] += yield from drawings(hand)
        facts["bakes"].append((yield from bake(hand)))
        clear()
        yield 1.0


def draw_little() -> None:
    """Have a window drawn in a fraction of the time, as some graphics card would, where only the processor draws it."""
    system = bpy.context.preferences.system
    system.viewport_aa = "OFF"
    system.use_region_overlap = False  # no panels blended over the viewport
    bpy.data.objects["Walker Figure"].display_type = "BOUNDS"


def drawings(hand: Hand) -> Steps:
    """The pauses in which nothing happens but that the whole window is drawn [s]."""
    run(hand, bpy.ops.test.pauses)
    yield 0.5
    for _ in range(DRAWINGS):
        for area in hand.window.screen.areas:
            area.tag_redraw()
        yield 0.4
    meter.TEST_OT_pauses.running = False
    yield 0.3
    return [pause for pause, _ in meter.longest_pauses(during_bake=False, count=DRAWINGS)]


def bake(hand: Hand) -> Steps:
    """The longest pauses of a bake and the longest ticks in it [s], each with how far it was; numbers of both."""
    run(hand, bpy.ops.test.pauses)
    yield 0.5
    with meter.ticks_timed() as ticks, meter.drawings_counted() as drawn:
        run(hand, bpy.ops.softground.bake)
        yield from hand.wait_for(lambda: not bpy.context.window_manager.softground.is_baking, 120)
        yield 0.5
    meter.TEST_OT_pauses.running = False
    yield 0.3
    return {
        "longest pauses": meter.longest_pauses(during_bake=True),
        "longest ticks": sorted(ticks, reverse=True)[:8],
        "ticks": len(ticks),
        "drawings": len(drawn),
    }


def clear() -> None:
    """Take the bake away, and the ground that it made."""
    bpy.ops.softground.clear_bake()
    options = bpy.context.window_manager.windows[0].scene.softground
    ground, options.ground = options.ground, None
    mesh = ground.data
    bpy.data.objects.remove(ground)
    bpy.data.meshes.remove(mesh)


def run(hand: Hand, operator) -> None:
    with bpy.context.temp_override(window=hand.window, area=hand.area(), region=hand.region("UI")):
        operator("INVOKE_DEFAULT")
