"""A bake, a key on top of it by the keyboard, Bake Again, save and open, Clear: the keys are where they were set."""

from __future__ import annotations

from typing import Any

import bpy

from tests.gui.hand import Hand, Steps, module
from tests.gui.shot import open_walk
from tests.gui.stories.first_minutes import layers
from tests.gui.stories.interrupted_bake import scene, session, with_viewport

KEYED, FEET = "upper_arm.L", ("foot.L", "foot.R")


def tell(hand: Hand, facts: dict) -> Steps:
    armature = open_walk(60)
    facts["before"] = actions()
    yield from hand.open_sidebar()
    with_viewport(hand, bpy.ops.softground.add_character)
    yield from press_bake(hand, "softground.bake")
    facts["layers"] = layers(armature)
    facts["active action"] = armature.animation_data.action.name

    scene().frame_set(20)
    bpy.context.window_manager.windows[0].view_layer.objects.active = armature
    with_viewport(hand, bpy.ops.object.mode_set, mode="POSE")
    for bone in armature.pose.bones:
        (bone if hasattr(bone, "select") else bone.bone).select = bone.name == KEYED  # from 5.0 on of the pose
    armature.data.bones.active = armature.data.bones[KEYED]
    yield 0.5
    poses = [pose(armature)]
    yield from hand.move(*hand.middle())
    yield from hand.key("R")
    yield from hand.key("X")
    yield from hand.type("40")
    yield from hand.key("RET")
    yield from hand.key("I")
    yield 1.0
    scene().frame_set(21)
    scene().frame_set(20)
    poses.append(pose(armature))
    facts["poses"] = poses
    yield from hand.wait_for(lambda: bool(session().stale), 10)
    facts["stale"] = session().stale
    yield from hand.picture("keyed_after_bake", in_docs=False)
    yield from press_bake(hand, "softground.bake_again")
    facts["stale after"], facts["mode"] = session().stale, armature.mode

    shot = str(hand.pictures / "keyed.blend")
    with_viewport(hand, bpy.ops.wm.save_as_mainfile, filepath=shot)
    with_viewport(hand, bpy.ops.wm.open_mainfile, filepath=shot)
    yield 1.0
    facts["reopened"] = actions()
    yield from hand.open_sidebar()
    yield from hand.press_button("softground.clear_bake")
    yield 1.0
    facts["cleared"] = actions()
    facts["layers after"] = layers(bpy.data.objects["Walker"])


def press_bake(hand: Hand, operator: str) -> Steps:
    yield from hand.press_button(operator)
    yield from hand.wait_for(lambda: session().is_baking, 10)
    yield from hand.wait_for(lambda: not session().is_baking, 180)
    yield 0.5


def actions() -> dict[str, list[Any]]:
    """Curves of each action of the walker, as lists that JSON keeps."""
    curves_of = module("compat").action_curves
    return {
        action.name: [
            [curve.data_path, curve.array_index, [list(key.co) for key in curve.keyframe_points]]
            for curve in curves_of(action)
        ]
        for action in bpy.data.actions
    }


def pose(armature: Any) -> dict[str, list[float]]:
    """Where the keyed bone and the feet are."""
    layer = bpy.context.window_manager.windows[0].view_layer
    layer.update()
    evaluated = armature.evaluated_get(layer.depsgraph)
    return {bone: list(evaluated.pose.bones[bone].tail) for bone in (KEYED, *FEET)}
