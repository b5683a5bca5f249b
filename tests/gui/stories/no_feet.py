"""A rig in which nothing is a foot: it is added all the same, and what prints is chosen by hand."""

from __future__ import annotations

import bpy

from tests.gui.hand import Hand, Steps
from tests.gui.shot import open_walk


def tell(hand: Hand, facts: dict) -> Steps:
    open_walk(10)
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    in_viewport(hand, bpy.ops.object.armature_add)
    yield from hand.open_sidebar()
    yield from hand.press_button("softground.add_character")
    yield from hand.wait_for(lambda: bool(characters()), 30)
    yield 0.5
    facts["soles"] = len(characters()[0].soles)
    yield from hand.picture("no_feet", of="UI", in_docs=False)

    yield from hand.press_button("softground.add_sole")
    yield from hand.wait_for(lambda: bool(characters()[0].soles), 5)
    facts["waits for a bone"] = [sole.bone for sole in characters()[0].soles]
    yield from hand.picture("choose_a_bone", of="UI", in_docs=False)
    characters()[0].soles.clear()

    in_viewport(hand, bpy.ops.object.mode_set, mode="POSE")
    in_viewport(hand, bpy.ops.pose.select_all, action="SELECT")
    yield 0.5
    yield from hand.press_button("softground.add_contact")
    yield from hand.wait_for(lambda: bool(characters()[0].soles), 5)
    facts["from the selection"] = [sole.bone for sole in characters()[0].soles]
    yield from hand.picture("from_selection", of="UI", in_docs=False)


def characters():
    return bpy.context.window_manager.windows[0].scene.softground.characters


def in_viewport(hand: Hand, operator, **values):
    with bpy.context.temp_override(window=hand.window, area=hand.area(), region=hand.region("WINDOW")):
        operator(**values)
