"""Characters of files in other units, and the button that puts them right."""

import bpy
import numpy as np
import pytest

from softground_addon.blender.characters.import_fixes import scale_to_metres, size_of
from tests.blender import shots
from tests.blender.grounds import bake
from tests.blender.test_self_check import codes


def imported(scene, factor, *, loose=False):
    """A walker as a file in other units has it: bones, mesh and keys of the root, without a scale of its own."""
    armature = shots.walker(scene, frames=40)
    figure = armature.children[0]
    if loose:
        figure.parent = None
    armature.data.transform(np.diag([factor, factor, factor, 1.0]).tolist())
    figure.data.transform(np.diag([factor, factor, factor, 1.0]).tolist())
    for curve in armature.animation_data.action.fcurves:
        if curve.data_path.endswith("location"):
            for key in curve.keyframe_points:
                key.co.y *= factor
            curve.update()
    bpy.context.view_layer.update()
    return armature


@pytest.fixture
def metres(scene):
    armature = shots.walker(scene, frames=40)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.02
    steps = bake(scene).report["steps"]
    bpy.ops.softground.clear_bake()
    mass = scene.softground.characters[0].mass
    scene.softground.characters.clear()
    bpy.data.objects.remove(armature.children[0])
    bpy.data.objects.remove(armature)
    return steps, mass


@pytest.mark.parametrize("loose", [False, True])
@pytest.mark.parametrize("factor", [100.0, 0.01])
def test_one_button_makes_the_same_prints_of_a_file_in_other_units(scene, metres, factor, loose):
    steps, mass = metres
    armature = imported(scene, factor, loose=loose)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.softground.add_character()
    character = scene.softground.characters[0]
    assert scale_to_metres(character.size) == pytest.approx(1 / factor)
    keys = [tuple(key.co) for curve in armature.animation_data.action.fcurves for key in curve.keyframe_points]
    bpy.ops.softground.fix_scale()
    bpy.context.view_layer.update()
    assert armature.parent.name == "Walker Scale"
    assert tuple(armature.parent.scale) == pytest.approx([1 / factor] * 3)
    assert keys == [tuple(key.co) for curve in armature.animation_data.action.fcurves for key in curve.keyframe_points]
    assert size_of(scene, armature) == pytest.approx(character.size, rel=1e-4)
    assert 1.0 < character.size < 2.0
    assert character.mass == pytest.approx(mass, rel=0.05)
    scene.softground.cell_size = 0.02
    report = bake(scene).report
    assert not codes(report) & {"unit_scale", "mass_of_size"}
    assert len(report["steps"]) == len(steps)
    for one, other in zip(report["steps"], steps, strict=True):
        assert one["position"] == pytest.approx(other["position"], abs=0.02)
        assert one["max_depth_m"] == pytest.approx(other["max_depth_m"], rel=0.1)
    with pytest.raises(RuntimeError, match="its scale is as it should be"):
        bpy.ops.softground.fix_scale()
    bpy.data.objects.remove(armature.parent)
