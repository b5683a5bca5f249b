"""Live mode while its rig and ground are renamed, duplicated and deleted, and while the add-on comes and goes."""

from __future__ import annotations

import bpy
import numpy as np

from tests.gui.hand import Hand, Steps, module
from tests.gui.shot import open_walk
from tests.gui.stories.interrupted_bake import ADD_ON, reopen, scene, session, with_viewport

FRAME = 40
"""A frame by which several prints were left."""


def tell(hand: Hand, facts: dict) -> Steps:  # noqa: PLR0915  (a story is one after the other)
    shot = hand.pictures / "shot.blend"
    open_walk(96)
    with_viewport(hand, bpy.ops.softground.add_character)
    bpy.data.objects["Walker"].select_set(False)
    with_viewport(hand, bpy.ops.softground.create_ground)
    bpy.data.scenes.new("Other")
    with_viewport(hand, bpy.ops.wm.save_as_mainfile, filepath=str(shot))
    flat = heights()
    yield from go_live(hand)
    pressed = heights()
    facts["pressed: deepest"] = float(pressed.min())

    # renamed and duplicated: all goes on
    bpy.data.objects["Walker"].name = "It's me"
    scene().softground.ground.name = 'Snow "field"'
    copy = scene().softground.ground.copy()
    copy.data = copy.data.copy()
    scene().collection.objects.link(copy)
    yield from hand.wait_for(lambda: not answering(), 20)  # names are among what was read, which is read again
    facts["renamed: goes on"] = yield from back_and_forth(pressed)
    facts["renamed: live"] = session().is_live

    # another scene is played
    hand.window.scene = bpy.data.scenes["Other"]
    for frame in (1, 20):
        hand.window.scene.frame_set(frame)
        yield 0.1
    hand.window.scene = bpy.data.scenes["Scene"]
    yield 0.1
    facts["other scene: as it was"] = bool((heights() == pressed).all())

    # an edit is undone and done again
    with_viewport(hand, bpy.ops.ed.undo_push, message="Before")
    with_viewport(hand, bpy.ops.object.empty_add)
    with_viewport(hand, bpy.ops.ed.undo_push, message="Add")
    yield from hand.move(*hand.middle())
    yield from hand.key("Z", ctrl=True)
    yield 0.5
    facts["undone: live"] = session().is_live
    facts["undone: goes on"] = yield from back_and_forth(pressed)
    yield from hand.key("Z", ctrl=True, shift=True)
    yield 0.5
    facts["redone: goes on"] = yield from back_and_forth(pressed)

    # the rig is deleted: nothing moves any more, and the ground can be had back
    bpy.data.objects.remove(scene().softground.characters[0].armature)
    for frame in (FRAME + 5, FRAME):
        scene().frame_set(frame)
        yield 0.5
    if session().is_live:
        with_viewport(hand, bpy.ops.softground.live)
    yield 0.3
    facts["deleted rig: live"] = session().is_live

    # the ground is deleted
    yield from reopen(hand, shot)
    yield from go_live(hand)
    bpy.data.objects.remove(scene().softground.ground)
    scene().frame_set(FRAME + 5)
    yield 0.5
    facts["deleted ground: live"] = session().is_live

    # the add-on is disabled and enabled
    yield from reopen(hand, shot)
    yield from go_live(hand)
    bpy.ops.preferences.addon_disable(module=ADD_ON)
    yield from hand.move(*hand.middle())
    yield 0.3
    ground = bpy.data.objects["SoftGround"]
    facts["disabled: flat"] = bool((heights_of(ground) == flat).all())
    facts["disabled: shape keys"] = str(ground.data.shape_keys)
    bpy.ops.preferences.addon_enable(module=ADD_ON)
    yield 0.5
    scene().frame_set(FRAME + 5)
    facts["enabled: flat"] = bool((heights() == flat).all())
    facts["enabled: live"] = session().is_live
    yield from go_live(hand)
    facts["live again: as before"] = bool((heights() == pressed).all())
    with_viewport(hand, bpy.ops.softground.live)
    facts["discarded: flat"] = bool((heights() == flat).all())


def go_live(hand: Hand) -> Steps:
    with_viewport(hand, bpy.ops.softground.live)
    scene().frame_set(1)
    yield 0.1
    scene().frame_set(FRAME)
    yield 0.3


def back_and_forth(expected: np.ndarray) -> Steps:
    """True if the ground is as expected after the playhead went away and came back (a generator like the others)."""
    for frame in (FRAME - 20, FRAME + 10, FRAME):
        scene().frame_set(frame)
        yield 0.2
    return bool((heights() == expected).all())


def answering() -> bool:
    return module("live.live").is_answering()


def heights() -> np.ndarray:
    return heights_of(scene().softground.ground)


def heights_of(ground: bpy.types.Object) -> np.ndarray:
    layer = bpy.context.window_manager.windows[0].view_layer
    mesh = ground.evaluated_get(layer.depsgraph).data
    positions = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.attributes["position"].data.foreach_get("vector", positions)
    return positions.reshape(-1, 3)[:, 2].copy()
