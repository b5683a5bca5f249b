"""From an animated rig to prints in two clicks; undo, redo, Esc and Cancel in the middle; save and open again."""

from __future__ import annotations

import bpy

from tests.blender import fingerprints
from tests.gui.hand import Hand, Steps
from tests.gui.shot import open_walk

FRAMES = 250

CELLS = 0.005
SLOW_CELLS = 0.002
"""Cells of a bake that lasts until a hand has found its Cancel button, beside those of the bake that counts [m]."""


def tell(hand: Hand, facts: dict) -> Steps:  # noqa: PLR0915  (a story is one after the other)
    open_walk(FRAMES)
    yield from hand.open_sidebar()
    yield from hand.frame_all()
    yield from hand.picture("panel_start", of="UI", in_docs=False)

    yield from hand.press_button("softground.add_character")
    yield 0.2
    yield from hand.wait_for(lambda: not session().is_baking, 60)
    facts["characters"] = [character.name for character in scene().softground.characters]
    facts["soles"] = [sole.name for sole in scene().softground.characters[0].soles]
    yield from hand.move(*hand.middle())  # the panels move to their places as events come
    hand.region().tag_redraw()
    yield 0.7
    yield from hand.picture("panel_character", of="UI", in_docs=False)

    button = yield from hand.find_button("softground.bake")
    before = fingerprints.of_file()
    scene().softground.cell_size = SLOW_CELLS
    for way_out in ("escape", "cancel"):
        yield from hand.click(*button)
        yield from hand.wait_for(lambda: session().progress > 0.1, 30)
        facts[f"{way_out}: baking"] = session().is_baking
        if way_out == "escape":
            yield from hand.picture("panel_baking")
            yield from hand.key("ESC")
        else:
            yield from hand.click_down_from(button, until=lambda: not session().is_baking)
        yield from hand.wait_for(lambda: not session().is_baking, 5)
        facts[f"{way_out}: as before"] = fingerprints.of_file() == before
    scene().softground.cell_size = CELLS

    yield from hand.click(*button)
    yield from hand.wait_for(lambda: session().is_baking, 5)
    yield from hand.wait_for(lambda: not session().is_baking, 120)
    yield 0.5
    facts["prints"] = summary()
    facts["deepest vertex"] = deepest()
    yield from hand.move(*hand.middle())
    baked = fingerprints.of_file()
    if hand.for_docs:
        place = scene().objects["Walker"].pose.bones["hips"].matrix.translation
        hand.show_materials((0.21, 0.535))
        yield from hand.look_at_prints((place.x - 0.25, place.y + 0.85, 0.2), 2.55, 2.5)
        yield 25.0  # until its shaders are there
        yield from hand.picture("two_clicks")
        hand.area().spaces.active.shading.type = "SOLID"

    yield from hand.move(*hand.middle())
    yield from hand.key("Z", ctrl=True)
    yield 0.5
    facts["undo: as before"] = fingerprints.of_file() == before
    yield from hand.key("Z", ctrl=True, shift=True)
    yield 0.5
    again = fingerprints.of_file()
    facts["redo: differs in"] = [
        (name, key)
        for name, mesh in baked["meshes"].items()
        for key in mesh
        if key != "properties" and again["meshes"].get(name, {}).get(key) != mesh[key]
    ]
    facts["redo: prints"] = summary()

    path = str(hand.pictures / "walk.blend")
    with bpy.context.temp_override(window=hand.window):
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
    yield 1.0
    facts["reload: prints"] = summary()
    facts["reload: deepest vertex"] = deepest()
    yield from hand.open_sidebar()
    yield from hand.press_button("softground.clear_bake")
    facts["cleared: deepest vertex"] = deepest()


def scene():
    return bpy.context.window_manager.windows[0].scene


def session():
    return bpy.context.window_manager.softground


def summary():
    return dict(scene().softground.ground.data["softground_summary"])


def deepest():
    mesh = scene().softground.ground.data
    return min(vertex.co.z for vertex in mesh.vertices)
