"""A long walk is baked: its first prints are seen long before its last, while one turns the view, and can be left."""

from __future__ import annotations

import time

import bpy

from tests.blender import fingerprints
from tests.gui.hand import Hand, Steps, module
from tests.gui.shot import open_walk

FRAMES = 400


def tell(hand: Hand, facts: dict) -> Steps:
    bpy.context.preferences.system.viewport_aa = "OFF"  # which has the viewport drawn time and again
    yield from hand.open_sidebar()
    open_walk(FRAMES)
    with bpy.context.temp_override(window=hand.window, area=hand.area(), region=hand.region("WINDOW")):
        bpy.ops.softground.add_character()
        bpy.ops.mesh.primitive_plane_add(size=80.0)
    scene = hand.window.scene
    scene.softground.ground = bpy.context.view_layer.objects.active
    yield from hand.look_at_walk()

    yield from begin(hand)
    started = time.perf_counter()
    yield from hand.wait_for(lambda: len(shown()) > 0, 20)
    facts["seconds to the first print"] = time.perf_counter() - started
    facts["first: baking"], facts["first: prints"] = session().is_baking, len(shown())
    yield from hand.wait_for(lambda: len(shown()) > 3 or not session().is_baking, 20)
    yield from hand.picture("pressed", in_docs=False)
    before = view(hand)
    yield from hand.move(*hand.middle())
    for _ in range(3):
        hand.event("WHEELUPMOUSE", "PRESS")
        yield 0.1
    facts["turned"] = view(hand) != before
    yield from hand.wait_for(lambda: not session().is_baking, 120)
    facts["seconds in all"] = time.perf_counter() - started
    facts["last: shown"] = len(shown())
    facts["steps"] = len(module("ground.baked_steps").of(scene.softground.ground))

    content = fingerprints.of_file()
    module("reuse").forget()
    yield from begin(hand)
    yield from hand.wait_for(lambda: len(shown()) > 0, 20)
    yield from hand.key("ESC")
    yield from hand.wait_for(lambda: not session().is_baking, 5)
    facts["left: shown"], facts["left: as before"] = len(shown()), fingerprints.of_file() == content


def begin(hand: Hand) -> Steps:
    with bpy.context.temp_override(window=hand.window, area=hand.area(), region=hand.region("WINDOW")):
        bpy.ops.softground.bake("INVOKE_DEFAULT", True)
    yield 0.0


def view(hand: Hand) -> list:
    return [list(row) for row in hand.area().spaces.active.region_3d.view_matrix]


def session() -> object:
    return bpy.context.window_manager.softground


def shown() -> list:
    """What the viewport draws of the bake that goes on."""
    pressing = module("state").state.pressing
    return pressing.shapes if pressing else []
