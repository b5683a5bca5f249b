"""Every panel below Advanced, open and alone in a sidebar of Blender's own width."""

from __future__ import annotations

import bpy

from tests.gui.hand import Hand, Steps
from tests.gui.shot import open_walk
from tests.gui.stories.edit_steps import show_alone, steps
from tests.gui.stories.interrupted_bake import scene, session, with_viewport

PANELS = (
    *("soles", "joints", "prints", "material", "layers", "painted", "mesh", "overlay"),
    *("response", "foot_locks", "output", "weather", "steps"),
)


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
    for name in PANELS:
        panel = getattr(bpy.types, f"SOFTGROUND_PT_{name}")
        show_alone(panel, tab=panel.bl_label)
        yield from hand.open_sidebar(panel.bl_label)
        yield from hand.picture(name, of="UI", in_docs=False)
    facts["panels"] = PANELS
