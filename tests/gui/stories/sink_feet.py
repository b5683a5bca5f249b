"""Prints by one click, feet let down into them by another; the response by its panel; the file on another day."""

from __future__ import annotations

import bpy

from tests.gui.hand import Hand, Steps
from tests.gui.shot import open_walk
from tests.gui.stories.first_minutes import layers
from tests.gui.stories.interrupted_bake import scene, session, with_viewport


def tell(hand: Hand, facts: dict) -> Steps:
    armature = open_walk(60)
    yield from hand.open_sidebar()
    with_viewport(hand, bpy.ops.softground.add_character)
    facts["on by default"] = scene().softground.sink_feet
    bake = yield from hand.find_button("softground.bake")
    switch = yield from hand.find_field("sink_feet", offset=0.85)
    facts["below Bake"] = bake[1] - switch[1]
    yield from hand.click(*switch)
    facts["switched off"] = not scene().softground.sink_feet
    yield from hand.click(*bake)
    yield from hand.wait_for(lambda: session().is_baking, 10)
    yield from hand.wait_for(lambda: not session().is_baking, 120)
    yield 0.5
    facts["floating"] = floating()
    yield from hand.frame_all()
    yield from hand.look_at_walk()
    button = yield from hand.find_button("softground.sink_feet")
    yield from hand.picture("panel_floating", of="UI")

    yield from hand.click(*button)
    yield from hand.wait_for(lambda: session().is_baking, 10)
    yield from hand.wait_for(lambda: not session().is_baking, 120)
    yield 0.5
    for _ in range(20):  # it is compared once the edits have settled
        if session().stale:
            yield 0.25
    facts["left"] = floating()
    facts["grounding"] = scene().softground.grounding.use
    facts["layers"] = layers(armature)
    facts["stale"] = session().stale

    show_open(bpy.types.SOFTGROUND_PT_feet)
    for _ in range(24):
        yield from hand.key("WHEELUPMOUSE")
    yield from hand.picture("panel_feet", in_docs=False)

    yield from hand.move(*hand.middle())
    yield from hand.key("Z", ctrl=True)
    yield 0.5
    facts["undone"] = floating(), scene().softground.grounding.use

    yield from hand.key("Z", ctrl=True, shift=True)
    yield 0.5
    yield from another_day(hand, facts)


def another_day(hand: Hand, facts: dict) -> Steps:
    shot = str(hand.pictures / "sunk.blend")
    with_viewport(hand, bpy.ops.wm.save_as_mainfile, filepath=shot)
    with_viewport(hand, bpy.ops.wm.open_mainfile, filepath=shot)
    yield 1.0
    yield from hand.open_sidebar()
    yield from hand.press_button("softground.predict_depth")
    yield 1.0
    yield from hand.wait_for(lambda: not session().is_baking, 60)
    with_viewport(hand, bpy.ops.softground.overlay)
    yield 1.0
    summary = dict(scene().softground.ground.data["softground_summary"])
    facts["reopened"] = scene().softground.depth_cm, 100 * summary["typical_depth_m"], session().stale
    yield from hand.find_field("depth_cm")  # which is there while the animation that was read still holds
    yield from hand.picture("overlay_after_reopening", in_docs=False)


def floating() -> float:
    return float(dict(scene().softground.ground.data["softground_summary"])["floating_mm"])


def show_open(panel: type) -> None:
    """Show once more, open, a panel that is closed until one opens it: what a region has closed stays closed."""
    shown = {"bl_idname": "TEST_PT_open", "bl_options": set(), "draw": panel.draw}
    values = {name: getattr(panel, name) for name in _PLACE}
    bpy.utils.register_class(type("TEST_PT_open", panel.__bases__, shown | values))


_PLACE = ("bl_label", "bl_space_type", "bl_region_type", "bl_category")
