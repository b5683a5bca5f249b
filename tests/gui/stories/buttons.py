"""Each button that starts a job, pressed in a window, and those that read the shot once more where it is known."""

from __future__ import annotations

import traceback

import bpy

from sample_scenes.keys import write_action
from tests.gui.hand import Hand, Steps, module
from tests.gui.shot import open_walk
from tests.gui.stories.clean_feet import on_the_spot, travel
from tests.gui.stories.interrupted_bake import scene, session, with_viewport

ON_THE_SPOT = ("add_character", "walk_ahead")
"""A click on the second comes right after the first, which has read the shot."""
READING = ("detect_bones", "predict_depth", "overlay", "read_again", "create_ground", "use_as_ground")
BAKING = ("bake", "bake_again", "sink_feet", "clean_feet")
EDITING = (
    "mute_step",
    "duplicate_step",
    "reset_step",
    "reset_steps",
    "add_weather",
    "make_keys",
    "add_sample_meadow",
    "give_way",
)


def tell(hand: Hand, facts: dict) -> Steps:
    facts["all"] = sorted(with_a_job(module("operators.modal_job").ModalJob))
    facts["pressed"] = {}
    hand.show_wires()
    armature = open_walk(60, 24)
    write_action(armature, on_the_spot(), "On the Spot")
    options = scene().softground
    options.cell_size, options.relief, options.debris = 0.02, "OFF", False  # soon baked and soon drawn
    yield from hand.open_sidebar()
    yield from hand.press_button("softground.add_character")
    yield from done(hand)
    facts["travel"] = [travel(armature)]
    yield from hand.press_button("softground.walk_ahead")
    yield from done(hand)
    facts["travel"].append(travel(armature))
    for name in (*READING, *BAKING):
        facts["pressed"][name] = []
        for _ in range(2):
            yield from press(hand, name, facts["pressed"][name])
    steps = module("ground.baked_steps")
    for name in EDITING:
        if name == "give_way":
            select_meadow()
        session().step = steps.of(scene().softground.ground)[0].name
        facts["pressed"][name] = []
        yield from press(hand, name, facts["pressed"][name])
    facts["edited"] = len(module("ground.baked_ground").edits_of(scene().softground.ground))
    scene().softground.characters.clear()
    armature = open_walk(60, 24)
    write_action(armature, on_the_spot(), "On the Spot")
    for name in ("add_character", "root_motion"):
        facts["pressed"][name] = []
        yield from press(hand, name, facts["pressed"][name])
    facts["travel"].append(travel(armature))


def select_meadow() -> None:
    """Select the plants that were added, alone."""
    grass = next(obj for obj in scene().objects if obj.type == "CURVES")
    for obj in scene().objects:
        obj.select_set(obj == grass)
    bpy.context.view_layer.objects.active = grass


def with_a_job(kind: type) -> set[str]:
    """Names of the registered operators of a kind."""
    names = {
        subclasse.bl_idname.partition(".")[2] for subclasse in kind.__subclasses__() if "bl_idname" in vars(subclasse)
    }
    return names.union(*map(with_a_job, kind.__subclasses__()))


def press(hand: Hand, name: str, ends: list[str]) -> Steps:
    """Start a job as its button does, wait for its end, and note down what it said."""
    values = {"use_selected": False} if name == "create_ground" else {}
    try:
        with_viewport(hand, getattr(bpy.ops.softground, name), "INVOKE_DEFAULT", True, **values)
    except RuntimeError:
        ends.append(traceback.format_exc())
        return
    ends.append("")
    yield from done(hand)


def done(hand: Hand) -> Steps:
    yield 0.3
    yield from hand.wait_for(lambda: not session().is_baking, 120)
    yield 0.3
