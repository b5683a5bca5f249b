"""What cannot be baked is named with its remedy, and stays as it was."""

import bpy
import pytest

from tests.blender import fingerprints
from tests.blender.grounds import plane


def unset(scene):
    scene.softground.characters.clear()


def no_animation(scene):
    scene.softground.characters[0].armature.animation_data_clear()


def no_feet(scene):
    scene.softground.characters[0].soles.clear()


def wrong_bone(scene):
    scene.softground.characters[0].soles[0].bone = "Nonexistent"


def stretched(scene):
    scene.softground.characters[0].armature.scale = (1.0, 1.0, 2.0)


def massless(scene):
    scene.softground.characters[0].mass = 0.0


def nan_key(scene):
    from softground_addon.blender.compat import action_curves

    curve = action_curves(scene.softground.characters[0].armature.animation_data.action)[0]
    for point in curve.keyframe_points:
        point.co[1] = float("nan")


def empty_range(scene):
    scene.softground.frame_start, scene.softground.frame_end = 10, 5


def too_coarse(scene):
    scene.softground.detail = "NEVER"
    scene.softground.ground = plane(scene, vertices=40)


def far_below(scene):
    ground = scene.softground.ground = plane(scene)
    ground.location.z = -5.0


def far_away(scene):
    ground = scene.softground.ground = plane(scene)
    ground.location.x = 500.0


def bridge(scene):
    ground = scene.softground.ground = plane(scene, vertices=200)
    ground.modifiers.new("twice", "ARRAY").relative_offset_displace = (0, 0, 0)
    ground.modifiers["twice"].use_constant_offset = True
    ground.modifiers["twice"].constant_offset_displace = (0, 0, -1.0)


def growing_ground(scene):
    ground = scene.softground.ground = plane(scene)
    for frame, size in ((1, 1.0), (20, 1.5)):
        ground.scale = (size, size, size)
        ground.keyframe_insert("scale", frame=frame)


def edited_body(scene):
    armature = scene.softground.characters[0].armature
    bpy.context.view_layer.objects.active = next(thing for thing in armature.children if thing.type == "MESH")
    bpy.ops.object.mode_set(mode="EDIT")


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (unset, "Add Character"),
        (no_animation, "'Walker'"),
        (no_feet, "'Walker'.*[Ff]oot|'Walker'.*[Ff]eet|'Walker'.*sole"),
        (wrong_bone, "'Walker'.*Nonexistent"),
        (stretched, "'Walker'.*scale"),
        (massless, "mass"),
        (nan_key, "'Walker'"),
        (empty_range, "10-5 is empty"),
        (too_coarse, "'Field' is too coarse.*Subdivide"),
        (far_below, "'Walker'.*touches 'Field'.*move"),
        (far_away, "'Field' has no face under.*move it under the feet"),
        (bridge, "'Field' has several layers.*separate"),
        (growing_ground, "Ground 'Field' changes its size"),
        (edited_body, "'Walker Figure'.*Edit Mode: leave it"),
    ],
)
def test_bad_input_is_named_with_its_remedy_and_changes_nothing(walk, spoil, message):
    spoil(walk)
    bpy.context.view_layer.update()
    before = fingerprints.of_file()
    with pytest.raises(RuntimeError, match=message):
        bpy.ops.softground.bake()
    assert repr(fingerprints.of_file()) == repr(before)
