"""A step of a bake is chosen in the list, muted, dragged in the viewport, undone, redone, saved, and baked again."""

from __future__ import annotations

import time
from typing import Any

import bpy
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Euler, Vector

from tests.blender import fingerprints
from tests.gui.hand import Hand, Steps, module
from tests.gui.shot import open_walk
from tests.gui.stories.interrupted_bake import differences, reopen, scene, session, with_viewport

MOVES, FEW = 15, 8
"""Moves of the mouse while a print is dragged: where what each takes is measured, and elsewhere."""


def tell(hand: Hand, facts: dict) -> Steps:  # noqa: PLR0915  (a story is one after the other)
    open_walk(60)
    yield from hand.open_sidebar()
    scene().softground.sink_feet = False
    with_viewport(hand, bpy.ops.softground.add_character)
    yield from hand.press_button("softground.bake")
    yield from hand.wait_for(lambda: session().is_baking, 10)
    yield from hand.wait_for(lambda: not session().is_baking, 120)
    yield 0.5
    bpy.ops.ed.undo_push(message="Baked")
    baked = state()

    show_alone(bpy.types.SOFTGROUND_PT_steps)
    for _ in range(6):
        yield from hand.key("WHEELDOWNMOUSE")
    yield from hand.press_button("softground.choose_step", offset=0.3)
    yield 0.3
    facts["chosen"] = session().step
    facts["frame"] = scene().frame_current, steps()[0].there_from
    middle = steps()[0].outline().mean(axis=0)
    facts["off centre"] = (hand.area().spaces.active.region_3d.view_location - Vector(middle)).length
    yield from look_from_above(hand)
    yield from hand.picture("panel_steps", of="UI")

    yield from hand.press_button("softground.mute_step", offset=0.25)
    yield 0.5
    yield from hand.wait_for(lambda: not session().is_baking, 60)
    yield 0.3
    facts["muted"] = edits()
    yield from hand.move(*hand.middle())
    yield from hand.key("Z", ctrl=True)
    yield 0.5
    facts["undone"] = edits(), differences(baked, state())
    yield from hand.key("Z", ctrl=True, shift=True)
    yield 0.5
    facts["redone"] = edits()
    yield from hand.key("Z", ctrl=True)
    yield 0.5

    # a print is dragged and left as it was
    yield from hand.press_button("softground.drag_step")
    yield from drag(hand, facts, dy=0.3, picture="steps_dragged")
    yield from hand.key("ESC")
    yield 0.5
    facts["escaped"] = edits(), differences(baked, state())

    # and dragged for good
    yield from hand.press_button("softground.drag_step")
    yield from drag(hand, facts, dy=0.3, moves=FEW)
    hand.event("LEFTMOUSE", "RELEASE")
    yield from pressed(hand)
    facts["dragged"] = edits()
    dragged = prints()
    yield from hand.picture("steps_moved", in_docs=False)
    yield from hand.move(*hand.middle())
    yield from hand.key("Z", ctrl=True)
    yield 0.5
    facts["dragged undone"] = edits(), differences(baked, state())
    yield from hand.key("Z", ctrl=True, shift=True)
    yield 0.5
    facts["dragged redone"] = edits(), prints() == dragged

    path = hand.pictures / "edited.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    yield from reopen(hand, path)
    facts["reloaded"] = edits(), prints() == dragged
    with_viewport(hand, bpy.ops.softground.bake, "INVOKE_DEFAULT")
    yield from hand.wait_for(lambda: session().is_baking, 10)
    yield from hand.wait_for(lambda: not session().is_baking, 120)
    yield 0.5
    facts["baked again"] = edits()

    # a box chooses, and what is chosen is dragged together
    yield from look_from_above(hand)
    with_viewport(hand, bpy.ops.softground.drag_step, "INVOKE_DEFAULT")
    wanted = steps()[1:3]
    places = [on_screen(hand, step.outline().mean(axis=0)) for step in wanted]
    yield from hand.move(min(x for x, _ in places) - 40, min(y for _, y in places) - 40)
    hand.event("LEFTMOUSE", "PRESS")
    yield 0.2
    yield from hand.move(max(x for x, _ in places) + 40, max(y for _, y in places) + 40)
    yield from hand.picture("steps_boxed", in_docs=False)
    hand.event("LEFTMOUSE", "RELEASE")
    yield 0.3
    facts["boxed"] = sorted(module("session").chosen_steps()), sorted(step.name for step in wanted)
    before = edits()
    yield from drag(hand, {}, dy=0.2, moves=FEW)
    hand.event("LEFTMOUSE", "RELEASE")
    yield from pressed(hand)
    after = edits()
    facts["dragged together"] = [after[step.name][2] - before.get(step.name, [0, 0, 0])[2] for step in wanted]

    # a mesh presses a step, which is one undo step
    yield from hand.move(*hand.middle())
    shoe = bpy.data.objects.new("Shoe", bpy.data.meshes.new("Shoe"))
    shoe.data.from_pydata([(-0.1, -0.2, 0), (0.1, -0.2, 0), (0.1, 0.2, 0), (-0.1, 0.2, 0)], [], [(0, 1, 2, 3)])
    scene().collection.objects.link(shoe)
    name = wanted[0].name
    module("session").choose_steps(name)
    bpy.ops.ed.undo_push(message="Shoe")
    before = area_of(name)
    with_viewport(hand, bpy.ops.softground.change_step, "EXEC_DEFAULT", True, sole="Shoe")
    yield 1.0
    facts["in a shoe"] = before, area_of(name)
    yield from hand.picture("steps_in_a_shoe", in_docs=False)
    yield from hand.press_button("softground.change_step")
    yield 1.0
    yield from hand.picture("steps_change", in_docs=False)
    yield from hand.key("ESC")
    yield 0.5
    facts["chosen in a dialog"] = strength_of(name)
    with_viewport(hand, bpy.ops.softground.change_step, "INVOKE_DEFAULT", True, step=name)
    yield 1.0
    x, y = hand.place
    for higher in range(0, 240, 20):  # past all numbers of the dialog
        yield from hand.move(x, y + higher)
        yield from hand.key("WHEELUPMOUSE", ctrl=True)
    yield from hand.picture("steps_changed", in_docs=False)
    yield from hand.key("RET")
    yield from pressed(hand)
    facts["changed in a dialog"] = strength_of(name)
    yield from hand.move(*hand.middle())
    for _ in ("changed", "in a shoe"):
        yield from hand.key("Z", ctrl=True)
        yield 1.0
    facts["without the shoe"] = area_of(name)


def pressed(hand: Hand) -> Steps:
    """Wait until steps that were changed are pressed."""
    yield from hand.wait_for(lambda: session().is_baking, 10)
    yield from hand.wait_for(lambda: not session().is_baking, 60)
    yield 0.5


def show_alone(panel: type, tab: str = "") -> None:
    """Show a panel once more, open and beside the others or in a tab: what a region has closed stays closed."""
    parts = ("bl_label", "bl_category", "draw", "draw_header")
    values = {name: getattr(panel, name) for name in parts if hasattr(panel, name)}
    shown = {"bl_idname": f"TEST_PT_alone_{tab.replace(' ', '_')}", "bl_options": set(), "bl_parent_id": ""}
    shown |= {"bl_space_type": "VIEW_3D", "bl_region_type": "UI", "bl_context": ""}
    shown |= values | ({"bl_category": tab} if tab else {})
    bpy.utils.register_class(type(shown["bl_idname"], panel.__bases__, shown))


def strength_of(name: str) -> float:
    """Depth of a step relative to its baked print."""
    return module("ground.baked_ground").edits_of(scene().softground.ground)[name].strength


def steps() -> Any:
    return module("ground.baked_steps").of(scene().softground.ground)


def edits() -> dict:
    ground = scene().softground.ground
    edits = module("ground.baked_ground").edits_of(ground)
    return {name: [edit.mute, *edit.move_m] for name, edit in edits.items()}


def area_of(name: str) -> float:
    """Area of a step's print [m²]."""
    return next(float(step.footprint.area_m2) for step in steps() if step.name == name)


def prints() -> str:
    ground = module("ground.baked_ground").display_mesh_of(scene().softground.ground)
    return str(fingerprints.of_mesh(ground.data))


def state() -> dict:
    return {"prints": {"ground": prints()}, "edits": edits()}


def look_from_above(hand: Hand) -> Steps:
    space = hand.area().spaces.active
    step = steps()[2].baked.position
    space.region_3d.view_perspective = "PERSP"
    space.region_3d.view_location = (step[0], step[1], 0.0)
    space.region_3d.view_distance = 2.5
    space.region_3d.view_rotation = Euler((0.5, 0.0, 0.0)).to_quaternion()
    yield 0.7


def on_screen(hand: Hand, place: Any) -> tuple[int, int]:
    region = hand.region("WINDOW")
    view = hand.area().spaces.active.region_3d
    point = location_3d_to_region_2d(region, view, Vector(place))
    return region.x + int(point.x), region.y + int(point.y)


def timed(owner: Any, name: str) -> list[float]:
    """Seconds of computing that each call of a method takes from now on: not of drawing, nor of what else runs."""
    took: list[float] = []
    method = getattr(owner, name)

    def measured(*arguments: Any) -> Any:
        start = time.thread_time()
        try:
            return method(*arguments)
        finally:
            took.append(time.thread_time() - start)

    setattr(owner, name, measured)
    return took


def drag(hand: Hand, facts: dict, *, dy: float, moves: int = MOVES, picture: str = "") -> Steps:
    """Take hold of the third print and move it, without letting go."""
    middle = steps()[2].outline().mean(axis=0)
    yield from hand.move(*on_screen(hand, middle))
    yield 0.3
    facts["under the mouse"] = module("state").state.under == steps()[2].name
    hand.event("LEFTMOUSE", "PRESS")
    yield 0.5
    took = timed(module("viewport.step_preview").StepPreview, "show")
    for number in range(1, moves + 1):
        place = (middle[0], middle[1] + dy * number / moves, middle[2])
        hand.place = on_screen(hand, place)
        hand.event("MOUSEMOVE", "NOTHING")
        yield 0.0
    facts.setdefault("seconds an update", sorted(took))
    yield 0.3
    if picture:
        yield from hand.picture(picture)
