"""Blender as it starts, the sample figure, two clicks; then another ground, a typed depth, and all taken back."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d

from tests.gui.hand import Hand, Steps, module
from tests.gui.stories.interrupted_bake import ADD_ON, scene, session

TYPED = 9.0
"""Depth that is asked for [cm]."""


def tell(hand: Hand, facts: dict) -> Steps:  # noqa: PLR0915  (a story is one after the other)
    facts["to begin with"] = sorted(obj.name for obj in scene().objects), names(hand, "selected_objects")
    with bpy.context.temp_override(window=hand.window):
        bpy.ops.preferences.addon_disable(module=ADD_ON)
        bpy.ops.preferences.addon_enable(module=ADD_ON)
    yield 1.5
    yield from hand.move(*hand.middle())
    yield from hand.picture("enabled", in_docs=False)
    ours = bpy.context.preferences.addons[ADD_ON].preferences
    waits = [operator.bl_idname for operator in hand.window.modal_operators]
    facts["told where it is"] = ours.was_told and "SOFTGROUND_OT_tell_where" not in waits
    ours.default_preset = "Mud"
    facts["preferred"] = title()
    ours.default_preset = "Snow"
    yield from hand.open_sidebar()
    yield from hand.picture("first_screen_empty", of="UI", in_docs=False)
    yield from hand.press_button("softground.add_sample_scene")
    yield 0.5
    facts["sample"] = names(hand, "selected_objects")
    figure = hand.window.view_layer.objects.active

    yield from hand.press_button("softground.add_character")
    yield from ended(hand)
    bake = yield from hand.find_button("softground.bake")
    yield from hand.click(*bake)
    yield from ended(hand)
    facts["prints"] = summary()
    facts["frame"] = scene().frame_current, scene().frame_start, scene().frame_end
    facts["deepest in view"] = deepest()
    yield from hand.picture("first_bake", in_docs=False)
    facts["prints in view"], facts["shading"] = prints_in_view(hand), shading(hand)
    facts["debris"] = any(obj.name.startswith("SoftGround Debris") for obj in scene().objects)
    ground = scene().softground.ground
    facts["ground"] = [*ground.dimensions[:2]], names(hand, "selected_objects"), names(hand, "collection")
    facts["layers"] = layers(figure)
    facts["up to date"] = yield from operator_at(hand, bake)

    yield from hand.move(*hand.middle())
    yield 2.0  # panels glide to their places
    yield from hand.picture("first_screen", of="UI")
    before = top_of(hand)
    for _ in range(6):
        yield from hand.move(*bake)
        yield from hand.key("WHEELDOWNMOUSE")
    yield 0.5
    facts["height"], facts["scrolled by"] = hand.region().height, top_of(hand) - before

    # another ground
    add = yield from hand.find_button("softground.save_preset", offset=0.83)
    facts["snow"] = looks(ground), title()
    yield from hand.choose_in_menu((add[0] - 120, add[1]), "M")
    yield from hand.wait_for(lambda: bool(session().stale), 10)
    facts["mud"] = looks(ground), title()
    facts["outdated"] = yield from operator_at(hand, bake)
    yield from hand.picture("first_screen_outdated", of="UI", in_docs=False)
    yield from hand.click(*bake)
    yield from ended(hand)
    facts["mud prints"] = summary()
    facts["up to date again"] = yield from operator_at(hand, bake)

    # a depth
    field = yield from hand.find_field("depth_cm")
    yield from hand.click(field[0] - 50, field[1])  # beside the arrow at its end
    yield 0.3
    yield from hand.key("A", ctrl=True)
    yield from hand.type(f"{TYPED:g}")
    yield from hand.key("RET")
    yield from hand.wait_for(lambda: bool(session().stale), 10)
    facts["typed"] = scene().softground.depth_cm, title()
    yield from hand.click(*bake)
    yield from ended(hand)
    facts["typed prints"] = summary()

    yield from hand.press_button("softground.clear_bake", offset=0.75)
    yield 0.5
    facts["cleared"] = {
        "deepest": deepest(),
        "layers": layers(figure),
        "action": figure.animation_data.action is not None,
        "grounding": scene().softground.grounding.use,
    }


def prints_in_view(hand: Hand) -> list[tuple[float, float, float]]:
    """Place in the viewport, 0 to 1 across and up, and width of each print that is there [px]."""
    window, view = hand.region("WINDOW"), hand.area().spaces.active.region_3d
    steps = module("ground.baked_steps")
    places = []
    for step in steps.of(scene().softground.ground):
        corners = [location_3d_to_region_2d(window, view, point) for point in step.outline().tolist()]
        if step.there_from <= scene().frame_current and all(corners):
            across, up = (np.array(side) for side in zip(*corners, strict=True))
            places.append((across.mean() / window.width, up.mean() / window.height, float(np.ptp(across))))
    return places


def shading(hand: Hand) -> list:
    space = hand.area().spaces.active
    return [space.shading.studio_light, space.shading.show_cavity, space.shading.show_object_outline]


def ended(hand: Hand) -> Steps:
    """Until a job that was begun has ended, and what follows of it is seen."""
    yield from hand.wait_for(lambda: session().is_baking, 10)
    yield from hand.wait_for(lambda: not session().is_baking, 240)
    yield 1.5


def operator_at(hand: Hand, place: tuple[int, int]) -> Any:
    """What the button at a place runs, as Ctrl-C copies it."""
    bpy.context.window_manager.clipboard = ""
    yield from hand.move(*place)
    yield from hand.key("C", ctrl=True)
    return bpy.context.window_manager.clipboard


def top_of(hand: Hand) -> float:
    """Where the sidebar is scrolled to [px]."""
    region = hand.region()
    return float(region.view2d.region_to_view(0, region.height)[1])


def names(hand: Hand, member: str) -> list[str]:
    """Names of what the context of the viewport has, as one or several."""
    with bpy.context.temp_override(window=hand.window, area=hand.area(), region=hand.region("WINDOW")):
        value = getattr(bpy.context, member)
    return sorted(each.name for each in value) if isinstance(value, list) else [*value.objects.keys()]


def title() -> str:
    """What the preset menu shows."""
    menu = module("panels.preset_menu")
    return menu.title_of_ground(scene().softground)


def looks(ground: bpy.types.Object) -> list[str]:
    return [slot.material.name for slot in ground.material_slots]


def layers(figure: bpy.types.Object) -> list[str]:
    """Names of the constraints on the figure and its bones, each once."""
    return sorted({constraint.name for owner in (figure, *figure.pose.bones) for constraint in owner.constraints})


def summary() -> dict:
    return dict(scene().softground.ground.data["softground_summary"])


def deepest() -> float:
    ground = scene().softground.ground.evaluated_get(bpy.context.window_manager.windows[0].view_layer.depsgraph)
    positions = np.empty(3 * len(ground.data.vertices), dtype=np.float32)
    ground.data.attributes["position"].data.foreach_get("vector", positions)
    return float(positions[2::3].min())
