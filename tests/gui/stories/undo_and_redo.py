"""Random sessions of an artist, each undone step by step to its beginning and done again."""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

import bpy

from tests.blender import fingerprints
from tests.gui.hand import Hand, Steps
from tests.gui.shot import open_walk
from tests.gui.stories.interrupted_bake import differences, scene, session, with_viewport

SESSIONS, STEPS = 2, 5

Deed = Callable[[], object]
"""Something that an artist does; what it gives back tells whether it was done."""


def tell(hand: Hand, facts: dict) -> Steps:
    hand.show_wires()
    facts["sessions"] = []
    for seed in range(SESSIONS):
        noted: dict[str, Any] = {"deeds": [], "undone": {}, "redone": {}}
        facts["sessions"].append(noted)
        begin(hand)
        states = [state()]
        chance = random.Random(seed)
        while len(states) <= STEPS:
            name, deed = chance.choice(list(deeds(hand, chance).items()))
            yield from hand.move(*hand.middle())
            if not deed():
                continue
            yield 0.3
            yield from hand.wait_for(lambda: not session().is_baking, 120)
            noted["deeds"].append(name)
            states.append(state())
        for step in reversed(range(STEPS)):
            yield from hand.key("Z", ctrl=True)
            yield 0.3
            noted["undone"][step] = differences(states[step], state())
        for step in range(1, STEPS + 1):
            yield from hand.key("Z", ctrl=True, shift=True)
            yield 0.3
            noted["redone"][step] = differences(states[step], state())


def begin(hand: Hand) -> None:
    open_walk(24)
    scene().softground.characters.clear()
    scene().softground.ground = None
    scene().softground.cell_size = 0.02
    for kind in ("meshes", "hair_curves", "node_groups", "actions", "armatures", "materials"):
        blocks = getattr(bpy.data, kind)
        for block in list(blocks):
            if not block.users:
                blocks.remove(block)
    with_viewport(hand, bpy.ops.mesh.primitive_plane_add, size=8.0)
    bpy.context.window_manager.windows[0].view_layer.objects.active = bpy.data.objects["Walker"]
    with_viewport(hand, bpy.ops.ed.undo_push, message="Shot")


def deeds(hand: Hand, chance: random.Random) -> dict[str, Deed]:
    """What may be done next, by name."""
    options = scene().softground

    def press(name: str, *how: Any, **values: Any) -> Deed:
        operator = getattr(bpy.ops.softground, name)

        def deed() -> bool:
            if not with_viewport(hand, operator.poll):
                return False
            try:
                return with_viewport(hand, operator, *(how or ("EXEC_DEFAULT", True)), **values) != {"CANCELLED"}
            except RuntimeError:
                return False

        return deed

    def change(what: Any, name: str, *values: Any) -> Deed:
        def deed() -> bool:
            value = chance.choice(values)
            if getattr(what, name) == value:
                return False
            setattr(what, name, value)
            with_viewport(hand, bpy.ops.ed.undo_push, message=name)
            return True

        return deed

    return {
        "add": press("add_character"),
        "remove": press("remove_character"),
        "create ground": press("create_ground"),
        "bake": press("bake"),
        "bake by button": press("bake", "INVOKE_DEFAULT", True),
        "bake again": press("bake", "INVOKE_DEFAULT", True),
        "clear": press("clear_bake"),
        "cell size": change(options, "cell_size", 0.02, 0.03),
        "material": change(options.material, "youngs_modulus", 1e5, 4e5),
        "detail": change(options, "detail", "AUTO", "ALWAYS"),
        "ground": change(options, "ground", bpy.data.objects["Plane"], None),
        "sink": change(options.grounding, "use", True, False),
    }


def state() -> dict[str, Any]:
    """The file, and what is set of the scene."""
    scene().frame_set(1)
    options = scene().softground
    return fingerprints.of_file() | {
        "settings": {
            "ground": options.ground.name if options.ground else None,
            "characters": [character.name for character in options.characters],
            "cell_size": options.cell_size,
            "stiffness": options.material.youngs_modulus,
        }
    }
