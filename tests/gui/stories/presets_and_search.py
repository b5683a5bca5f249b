"""A preset of one's own, added and removed by clicks; every operator by the search; the bake's command to paste."""

from __future__ import annotations

from pathlib import Path

import bpy

from tests.gui.hand import Hand, Steps
from tests.gui.shot import open_walk
from tests.gui.stories.first_minutes import title
from tests.gui.stories.interrupted_bake import scene, session, with_viewport

SEARCHED = (
    "Predict Depth",
    "Create Ground",
    "Bake Footprints",
    "Show Prints",
    "Apply Look",
    "Add Force Curves",
    "Clear Bake",
)
"""Operators by the words that an artist would type."""


def tell(hand: Hand, facts: dict) -> Steps:
    open_walk(48)
    yield from hand.open_sidebar()
    with_viewport(hand, bpy.ops.softground.add_character)
    bpy.data.objects["Walker"].select_set(False)

    scene().softground.material.stiffness_mpa = 0.123
    yield from hand.press_button("softground.save_preset", offset=0.83)
    yield 0.5
    yield from hand.picture("save_preset", in_docs=False)
    yield from hand.key("RET")
    yield 0.5
    facts["saved"] = presets()
    facts["chosen"] = scene().softground.material.preset
    scene().softground.material.stiffness_mpa = 0.2
    facts["modified"] = title()
    scene().softground.material.stiffness_mpa = 0.123
    facts["as saved"] = title()
    place = yield from hand.find_button("softground.save_preset", offset=0.83)
    yield from hand.click(place[0] - 120, place[1])
    yield 0.7
    yield from hand.picture("own_preset", in_docs=False)
    yield from hand.key("ESC")
    yield 0.3
    with_viewport(hand, bpy.ops.softground.remove_preset)
    yield 0.3
    facts["removed"] = presets()
    facts["kept stiffness"] = scene().softground.material.stiffness_mpa

    facts["unsaved: may copy"] = with_viewport(hand, bpy.ops.softground.copy_bake_command.poll)
    shot = str(hand.pictures / "it's a shot.blend")
    with_viewport(hand, bpy.ops.wm.save_as_mainfile, filepath=shot)
    yield 0.3
    yield from search(hand, "Copy Bake Command")
    facts["copied"] = bpy.context.window_manager.clipboard
    facts["program"], facts["shot"] = bpy.app.binary_path, shot

    facts["found"] = {}
    for words in SEARCHED:
        yield from search(hand, words)
        yield from hand.wait_for(lambda: not session().is_baking, 120)
        yield 0.3
        done = bpy.context.window_manager.operators
        facts["found"][words] = done[-1].name if done else ""
    facts["changed: may copy"] = with_viewport(hand, bpy.ops.softground.copy_bake_command.poll)


def search(hand: Hand, words: str) -> Steps:
    """Do what the search (F3) finds first."""
    yield from hand.move(*hand.middle())
    yield from hand.key("F3")
    yield 0.5
    yield from hand.type(words.lower())
    yield 0.7
    yield from hand.key("RET")
    yield 0.7


def presets() -> list[str]:
    return sorted(path.name for path in Path(bpy.utils.user_resource("SCRIPTS")).glob("presets/softground/*"))
