"""Presets by the menu, a matched depth, the overlay, and live mode: played, stepped, scrubbed, tuned."""

from __future__ import annotations

from math import pi

import bpy
import numpy as np

from tests.blender import fingerprints
from tests.gui.hand import Hand, Steps, module
from tests.gui.shot import open_walk
from tests.gui.stories.interrupted_bake import with_viewport
from tests.gui.stories.live_answers import on_new_ground, press_live

TURN = 2.55
"""Of the view about z [rad]: from behind the walker, and beside."""


def tell(hand: Hand, facts: dict) -> Steps:  # noqa: PLR0915  (a story is one after the other)
    open_walk(96)
    yield from on_new_ground(hand)
    yield 0.3
    facts["ground"] = scene().softground.ground.name

    place = yield from hand.find_button("softground.save_preset", offset=0.83)
    menu = (place[0] - 120, place[1])
    yield from hand.click(*menu)
    yield 0.5
    yield from hand.move(menu[0], menu[1] - 110)
    yield 1.5
    yield from hand.picture("presets", of="UI", is_high=True)
    yield from hand.key("ESC")
    yield from hand.choose_in_menu(menu, "MUD"[0])
    facts["preset"] = scene().softground.material.preset
    bpy.ops.softground.load_preset(name="Snow")
    yield 0.3

    yield from press_live(hand)
    facts["live"] = bpy.context.window_manager.softground.is_live
    before = heights()
    yield from hand.move(*hand.middle())
    yield from hand.key("SPACE")
    yield from hand.wait_for(lambda: scene().frame_current > 40, 60)
    yield from hand.key("SPACE")
    yield 0.3
    facts["played to"] = scene().frame_current
    facts["played: deepest"] = float(heights().min())
    for _ in range(3):
        yield from hand.key("RIGHT_ARROW")
    yield 0.7
    stopped = scene().frame_current
    here = heights()
    facts["scrubbed back"] = []
    for frame in (10, 25, 1):
        scene().frame_set(frame)
        yield 0.2
        facts["scrubbed back"].append(float(heights().min()))
    facts["first frame: as before"] = bool((heights() == before).all())
    scene().frame_set(stopped)
    yield 0.2
    facts["forth again: as before"] = bool((heights() == here).all())

    with_viewport(hand, bpy.ops.softground.overlay)
    facts["overlay"] = bpy.context.window_manager.softground.show_overlay
    yield from picture_of_steps(hand, 58, "live")
    scene().frame_set(96)
    yield 0.5
    yield from press_live(hand, offset=0.75)
    facts["kept"] = "softground_record" in scene().softground.ground.data
    facts["no longer live"] = not bpy.context.window_manager.softground.is_live
    yield 1.0  # the overlay has the animation read as it is drawn
    yield from hand.wait_for(lambda: not bpy.context.window_manager.softground.is_baking, 60)
    yield 1.5  # panels glide to their places
    yield from picture_of_steps(hand, 59, "overlay")
    bpy.ops.softground.clear_bake()
    facts["cleared: as before"] = bool((heights() == before).all())

    saved = fingerprints.of_file()
    yield from press_live(hand)
    scene().frame_set(80)
    yield 0.3
    yield from press_live(hand, offset=0.3)
    scene().frame_set(59)
    yield 0.3
    facts["discarded: as before"] = fingerprints.of_file() == saved

    yield from press_live(hand)
    path = str(hand.pictures / "live.blend")
    scene().frame_set(80)
    with bpy.context.temp_override(window=hand.window):
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
    yield 1.0
    facts["reloaded: not live"] = not bpy.context.window_manager.softground.is_live
    yield from hand.move(*hand.middle())
    yield from hand.key("F3")
    yield from hand.type("soft")
    yield 0.8
    yield from hand.picture("search", in_docs=False)
    yield from hand.key("ESC")
    bpy.ops.preferences.addon_disable(module="bl_ext.user_default.softground")
    yield 0.3
    facts["disabled: no handlers"] = not [
        handler for handler in bpy.app.handlers.frame_change_post if "softground" in handler.__module__
    ]


def picture_of_steps(hand: Hand, frame: int, name: str) -> Steps:
    """The viewport at a frame, in the light of *Show Prints*: prints behind the walker, footfalls ahead."""
    scene().frame_set(frame)
    place = scene().objects["Walker"].pose.bones["hips"].matrix.translation
    yield from hand.look_at_prints((place.x - 0.05, place.y + 0.65, 0.15), TURN, 2.5)
    module("operators.show_prints").light(hand.area().spaces.active.shading, TURN + pi / 2)
    yield from hand.picture(name, of="WINDOW")


def scene():
    return bpy.context.window_manager.windows[0].scene


def heights():
    layer = bpy.context.window_manager.windows[0].view_layer
    ground = scene().softground.ground.evaluated_get(layer.depsgraph)
    positions = np.empty(3 * len(ground.data.vertices), dtype=np.float32)
    ground.data.attributes["position"].data.foreach_get("vector", positions)
    return positions.reshape(-1, 3)[:, 2].copy()
