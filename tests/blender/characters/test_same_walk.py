"""One walk as files bring it, at other rates, in the NLA, with more in the rig: its steps and loads stay the same."""

from collections.abc import Callable

import bpy
import numpy as np
import pytest

from softground_addon.blender.characters.character_setup import add_character
from softground_addon.blender.compat import action_curves
from softground_addon.blender.jobs import run
from softground_addon.blender.reading.shots import estimate_shot, read_shot, settings_of
from softground_addon.core.numerics.intervals import runs


def as_strip(armature, scene, scale):
    """Its action as a strip so many times as long, at as many times the frame rate."""
    data, rate = armature.animation_data, scene.render.fps * scale
    strip = data.nla_tracks.new().strips.new("walk", 1, data.action)
    strip.scale, data.action = scale, None
    scene.render.fps = round(rate)
    return strip


def cut(armature, first, last):
    """A take without the keys before one frame and after another, at which it eases in and out now."""
    for curve in action_curves(armature.animation_data.action):
        for key in reversed(list(curve.keyframe_points)):
            if not first <= key.co.x <= last:
                curve.keyframe_points.remove(key, fast=True)
        curve.update()


def remapped(armature, scene):
    scene.render.frame_map_new, scene.render.fps = 200, 48


def at_rate(rate):
    def change(armature, scene):
        for curve in action_curves(armature.animation_data.action):
            for key in curve.keyframe_points:
                for point in (key.co, key.handle_left, key.handle_right):
                    point.x = 1 + (point.x - 1) * rate / 24
        scene.render.fps = rate

    return change


def with_copy(armature, scene):
    """Another level of detail in the place of the first."""
    body = bpy.data.objects["Walking Figure Body"]
    copy = body.copy()
    copy.data = body.data.copy()
    scene.collection.objects.link(copy)


CHANGES: dict[str, Callable] = {
    "strip": lambda armature, scene: as_strip(armature, scene, 1),
    "strip twice as long": lambda armature, scene: as_strip(armature, scene, 2),
    "remapped": remapped,
    "60 Hz": at_rate(60),
    "240 Hz": at_rate(240),
    "copy": with_copy,
}


def steps_of(change=None):
    """First and last time [s] and largest load [N] of each step, in their order."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    bpy.ops.softground.add_sample_scene()
    armature = bpy.data.objects["Walking Figure"]
    if change:
        change(armature, scene)
    character = add_character(scene, armature)
    scene.softground.sink_feet = False
    wanted = settings_of(scene)
    loads = run(estimate_shot(wanted, run(read_shot(wanted))))[0]
    time = (loads.motion.frames - loads.motion.frames[0]) / loads.motion.frame_rate
    steps = [
        (time[first], time[last - 1], loads.forces.forces[first:last, sole, 2].max())
        for sole, on in enumerate(loads.contacts.touching.T)
        for first, last in zip(*runs(on), strict=True)
    ]
    return np.array(sorted(steps)), character.mass


@pytest.mark.parametrize("change", CHANGES)
def test_a_walk_keeps_its_steps_and_its_loads(addon, change):
    steps, mass = steps_of()
    others, other_mass = steps_of(CHANGES[change])
    assert other_mass == pytest.approx(mass, rel=0.02)
    assert others[:, :2] == pytest.approx(steps[:, :2], abs=0.045)
    whole = slice(2, -1)  # what a shot cuts off is bridged from its other strides, which depends on its samples
    assert others[whole, 2] == pytest.approx(steps[whole, 2], rel=0.03)


@pytest.mark.parametrize("rate", [48, 60, 120])
@pytest.mark.parametrize(("first", "error"), [(17, 0.06), (32, 0.06), (38, 0.2)])  # the last begins at a foot's end
def test_the_ends_of_a_cut_take_bear_alike_at_all_frame_rates(addon, first, error, rate):
    def at(rate):
        def change(armature, scene):
            cut(armature, first, first + 36)
            at_rate(rate)(armature, scene)

        steps, _ = steps_of(change)
        return steps[steps[:, 1] - steps[:, 0] > 0.07]  # what has just landed bears by chance

    error = max(error, 0.16) if rate % 24 else error  # keys lie between frames there, and the last pose is held
    assert at(rate) == pytest.approx(at(24), rel=error, abs=0.03)
