"""Every panel, open and alone in a sidebar of Blender's own width; then those of objects where Blender has them."""

from __future__ import annotations

import bpy

from tests.gui.hand import Hand, Steps
from tests.gui.shot import open_walk
from tests.gui.stories.edit_steps import show_alone, steps
from tests.gui.stories.interrupted_bake import scene, session, with_viewport

OF_CHARACTER = ("soles", "joints", "response", "foot_locks")
OF_GROUND = ("material", "layers", "painted", "mesh")
IN_SIDEBAR = ("prints", "hard_ground", "feet", "weather", "steps")


def tell(hand: Hand, facts: dict) -> Steps:
    open_walk(60)
    yield from hand.open_sidebar()
    with_viewport(hand, bpy.ops.softground.add_character)
    scene().softground.relief = "CLOSE_UP"
    with_viewport(hand, bpy.ops.softground.bake)
    with_viewport(hand, bpy.ops.softground.add_weather, preset="NONE")
    yield from hand.wait_for(lambda: not session().is_baking, 120)
    with_viewport(hand, bpy.ops.softground.choose_step, step=steps()[1].name)
    with_viewport(hand, bpy.ops.softground.add_foot_lock)
    facts["panels"] = []
    for name in IN_SIDEBAR:
        panel = getattr(bpy.types, f"SOFTGROUND_PT_{name}")
        show_alone(panel, tab=panel.bl_label)
        yield from hand.open_sidebar(panel.bl_label)
        yield from hand.picture(name, of="UI", in_docs=False)
        facts["panels"].append(name)

    editor = hand.area("PROPERTIES")
    facts["opened"] = []
    for part, names in (("feet", OF_CHARACTER), ("prints", OF_GROUND)):
        editor.spaces.active.context = "OBJECT"
        yield from hand.open_sidebar(getattr(bpy.types, f"SOFTGROUND_PT_{part}").bl_label)
        yield from hand.press_button("softground.open_settings")
        yield 0.5
        active = hand.window.view_layer.objects.active
        facts["opened"].append([part, editor.spaces.active.context, active.name])
        for name in names:
            panel = getattr(bpy.types, f"SOFTGROUND_PT_{name}")
            yield from only_open(hand, panel)
            facts["panels"].append(name)
            yield from hand.picture(f"physics_{name}", in_docs=False)


def only_open(hand: Hand, panel: type) -> Steps:
    """Open a panel of an object, in the search of the properties editor, where all that fit are open."""
    editor = hand.area("PROPERTIES")
    editor.spaces.active.search_filter = panel.bl_label
    editor.tag_redraw()
    yield 0.5
