"""A walk on the spot gets its travel, and feet that neither slide nor float, by clicks; one contact is locked flat."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np

from sample_scenes.body import Body
from sample_scenes.gait import Gait, walk
from sample_scenes.keys import write_action
from tests.gui.hand import Hand, Steps, module
from tests.gui.shot import open_walk
from tests.gui.stories.edit_steps import show_alone
from tests.gui.stories.first_minutes import layers
from tests.gui.stories.interrupted_bake import scene, session, with_viewport

FRAMES, RATE, FRAME = 60, 24, 20


def tell(hand: Hand, facts: dict) -> Steps:
    armature = open_walk(FRAMES, RATE)
    write_action(armature, on_the_spot(), "On the Spot")
    with_viewport(hand, bpy.ops.softground.add_character)
    facts["travel"] = [travel(armature)]
    panel = bpy.types.SOFTGROUND_PT_feet
    show_alone(panel, tab=panel.bl_label)
    yield from hand.open_sidebar(panel.bl_label)
    yield from hand.press_button("softground.root_motion", offset=0.75)
    yield from done(hand)
    facts["travel"].append(travel(armature))
    facts["said"] = module("baking.root_motion").speed_of(armature)

    yield from hand.press_button("softground.clean_feet", offset=0.25)
    yield from done(hand)
    facts["layers"] = layers(armature)
    facts["pitch"] = [pitch(armature)]

    scene().frame_set(FRAME)
    panel = bpy.types.SOFTGROUND_PT_foot_locks
    show_alone(panel, tab=panel.bl_label)
    yield from hand.open_sidebar(panel.bl_label)
    yield from hand.press_button("softground.add_foot_lock", offset=0.85)
    yield 0.3
    hold = scene().softground.characters[0].holds[0]
    facts["lock"] = [hold.foot, hold.frame, hold.mode]
    yield from hand.picture("foot_locks", of="UI", in_docs=False)
    yield from hand.move(*hand.middle())
    yield from hand.key("Z", ctrl=True)
    yield 0.5
    facts["undone"] = len(scene().softground.characters[0].holds)
    yield from hand.key("Z", ctrl=True, shift=True)
    yield 0.5

    yield from hand.open_sidebar("Feet")
    yield from hand.press_button("softground.clean_feet", offset=0.25)
    yield from done(hand)
    armature = scene().softground.characters[0].armature
    facts["pitch"].append(pitch(armature))
    yield from hand.frame_all()
    yield from hand.look_at_walk()
    yield from hand.picture("clean_feet", in_docs=False)


def on_the_spot():
    """The walk without its mean travel."""
    gait = Gait()
    moving = walk(Body(), gait, FRAMES, RATE)
    along = np.arange(FRAMES)[:, None] / RATE * (gait.speed, 0.0, 0.0)
    return replace(moving, hips=moving.hips - along)


def done(hand: Hand) -> Steps:
    yield from hand.wait_for(lambda: session().is_baking, 10)
    yield from hand.wait_for(lambda: not session().is_baking, 120)
    yield 0.5


def travel(armature: bpy.types.Object) -> float:
    """How far the hips go [m]."""
    ends = [place(armature, "hips", frame) for frame in (1, FRAMES)]
    return float(np.linalg.norm((ends[1] - ends[0])[:2]))


def pitch(armature: bpy.types.Object) -> float:
    """How much the foot that is locked pitches in the five frames around [degrees]."""
    character = next(each for each in scene().softground.characters if each.armature == armature)
    scene().frame_set(FRAME)
    slopes = {sole.bone: [] for sole in character.soles}
    lowest = min(slopes, key=lambda bone: place(armature, bone, FRAME)[2])
    for frame in range(FRAME - 2, FRAME + 3):
        scene().frame_set(frame)
        along = armature.matrix_world.to_3x3() @ armature.pose.bones[lowest].vector
        slopes[lowest].append(np.degrees(np.arcsin(along.normalized().z)))
    return float(np.ptp(slopes[lowest]))


def place(armature: bpy.types.Object, bone: str, frame: int) -> np.ndarray:
    scene().frame_set(frame)
    return np.array(armature.matrix_world @ armature.pose.bones[bone].head)
