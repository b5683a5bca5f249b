"""A character added, with Esc and without; then what an artist does, and after each deed a look at what still runs."""

from __future__ import annotations

import sys
from collections import Counter

import bpy

from tests.gui.hand import Hand, Steps
from tests.gui.shot import open_walk

LONG, SHORT = 6000, 72
"""Frames of an animation whose reading can be left, and of the one that is baked."""

SETTLING, QUIET, WATCHED = 2.0, 1.0, 10.0
"""Time in which all settles, longer by what Blender's own drawing takes; without a call, by which it is seen to have
settled; and for which nothing is to run after that [s]."""

SLOW = 20
"""Times `QUIET` that a machine may need which draws on its processor and does other things too."""


def tell(hand: Hand, facts: dict) -> Steps:
    bpy.context.preferences.system.viewport_aa = "OFF"  # which has the viewport drawn time and again
    yield from hand.open_sidebar()
    open_walk(LONG)
    yield from hand.move(*hand.middle())
    yield from add(hand)
    facts["reading"] = session().is_baking
    yield from hand.key("ESC")
    yield from hand.wait_for(lambda: not session().is_baking, 5)
    facts["left: characters"] = len(scene().softground.characters)
    facts["left: scenes"] = len(bpy.data.scenes)

    open_walk(SHORT)
    yield from add(hand)
    yield from hand.wait_for(lambda: not session().is_baking, 60)
    facts["characters"] = [character.name for character in scene().softground.characters]
    scene().softground.sink_feet = False
    facts["running"] = {}

    def look(after: str) -> Steps:
        facts["running"][after] = yield from watched()

    yield from look("add")
    bpy.ops.mesh.primitive_plane_add(size=40.0)
    scene().softground.ground = bpy.context.view_layer.objects.active
    with_viewport(hand, bpy.ops.softground.bake, "INVOKE_DEFAULT", True)
    yield from hand.wait_for(lambda: not session().is_baking, 120)
    facts["copies"] = [thing.name for thing in bpy.data.objects if "softground_detail_of" in thing]
    yield from look("bake")
    scene().softground.ground.location.x += 0.1
    with_viewport(hand, bpy.ops.ed.undo_push, message="Move")
    yield from look("edit")
    facts["outdated"] = session().stale
    with_viewport(hand, bpy.ops.ed.undo)
    yield from look("undo")
    with_viewport(hand, bpy.ops.softground.overlay)
    key_again()
    yield from look("overlay and key")
    path = str(hand.pictures / "shot.blend")
    with bpy.context.temp_override(window=hand.window):
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
    yield from look("open")
    facts["outdated as opened"] = session().stale
    with_viewport(hand, bpy.ops.softground.clear_bake)
    with_viewport(hand, bpy.ops.softground.live)
    scene().frame_set(30)
    yield from look("live")


def add(hand: Hand) -> Steps:
    with_viewport(hand, bpy.ops.softground.add_character, "INVOKE_DEFAULT", True)
    yield 0.2


def key_again() -> None:
    """Move a key of the walk by a hair."""
    action = bpy.data.objects["Walker"].animation_data.action
    curves = action.fcurves if hasattr(action, "fcurves") else action.layers[0].strips[0].channelbags[0].fcurves
    curve = curves[0]
    curve.keyframe_points[0].co.y += 1e-4
    curve.update()
    action.update_tag()


def watched() -> Steps:
    """How often functions of the add-on are called, by name, once all has settled."""
    calls: Counter[str] = Counter()

    def note(frame, event, _argument) -> None:
        if event == "call" and "softground_addon" in frame.f_code.co_filename:
            calls[frame.f_code.co_name] += 1

    sys.setprofile(note)
    try:
        yield SETTLING
        for _ in range(SLOW):
            calls.clear()
            yield QUIET
            if not calls:
                break
        yield WATCHED
    finally:
        sys.setprofile(None)
    return dict(calls)


def with_viewport(hand: Hand, operator, *how, **values):
    with bpy.context.temp_override(window=hand.window, area=hand.area(), region=hand.region("WINDOW")):
        return operator(*how, **values)


def scene():
    return bpy.context.window_manager.windows[0].scene


def session():
    return bpy.context.window_manager.softground
