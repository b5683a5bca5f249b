"""Root Motion: cycles on the spot travel as fast as their feet imply, and everything is given back."""

import json
from dataclasses import replace

import bpy
import numpy as np
import pytest

from sample_scenes.body import Body
from sample_scenes.character import create_character
from sample_scenes.gait import Gait, walk
from sample_scenes.keys import write_action
from sample_scenes.run import Run, run
from softground_addon.blender.animation_layer.constraint_layer import LayerKind, has_layer
from softground_addon.blender.baking import root_motion
from softground_addon.blender.command_line import cli
from softground_addon.blender.compat import action_curves
from softground_addon.blender.reading import analysis
from tests.blender import fingerprints, responders, shots
from tests.tiers import slow_but_one

WITHIN = 0.02
"""Bar: speed, over that of the same cycle with its travel."""
FRAMES = 72


def on_the_spot(scene, travelling, speed, rate, *, hips_held):
    """A character whose motion lacks its mean travel, or all that its hips move level."""
    scene.render.fps, scene.render.fps_base = rate, 1.0
    armature = create_character("Walker", Body(), scene.collection, shots.COARSE)
    hips = travelling.hips
    along = np.arange(len(hips))[:, None] / rate * (speed, 0.0, 0.0)
    lacking = (hips - hips[0]) * (1, 1, 0) if hips_held else along
    write_action(armature, replace(travelling, hips=hips - lacking), "Walk")
    shots.coarse(scene)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.softground.add_character()
    return armature


@pytest.fixture
def treadmill(scene):
    return on_the_spot(scene, walk(Body(), Gait(), FRAMES, 24), Gait().speed, 24, hips_held=False)


def speed_of(scene, armature, bone="hips"):
    """Mean speed of a bone over the walk, in the user's scene [m/s]."""
    start, end = scene.softground.frame_start, scene.softground.frame_end
    path = responders.world_matrices(scene, armature, [bone], (start, end))[:, 0, :2, 3]
    return np.linalg.norm(path[1] - path[0]) * scene.render.fps / (end - start)


@pytest.mark.parametrize("rate", slow_but_one([24, 60]))
@pytest.mark.parametrize("hips_held", slow_but_one([False, True]), ids=["treadmill", "hips held"])
@pytest.mark.parametrize("speed", slow_but_one([0.7, 1.2, 1.7]))
def test_walks_get_the_speed_that_they_have_with_their_travel(scene, speed, hips_held, rate):
    gait = Gait(speed=speed)
    strides = round(2 * gait.stride_time(Body()) * rate) / rate  # whole ones: hips surge within a stride
    travelling = walk(Body(), gait, round(strides * rate) + 1, rate)
    armature = on_the_spot(scene, travelling, speed, rate, hips_held=hips_held)
    assert np.linalg.norm(analysis.read(scene).belts["Walker"]) == pytest.approx(speed, rel=WITHIN), "Walk Ahead"
    assert bpy.ops.softground.root_motion() == {"FINISHED"}
    assert root_motion.speed_of(armature) == pytest.approx(speed, rel=WITHIN)
    assert speed_of(scene, armature) == pytest.approx(speed, rel=WITHIN)


@pytest.mark.parametrize("rate", [24, 60])
def test_a_run_too(scene, rate):
    armature = on_the_spot(scene, run(Body(), Run(), 3 * rate, rate), Run().speed, rate, hips_held=False)
    bpy.ops.softground.root_motion()
    assert root_motion.speed_of(armature) == pytest.approx(Run().speed, rel=WITHIN)


def test_it_travels_the_way_that_the_walk_went(scene, treadmill):
    bpy.ops.softground.root_motion()
    hips = responders.world_matrices(scene, treadmill, ["hips"], range(1, FRAMES + 1))[:, 0, :3, 3]
    bpy.ops.softground.remove_root_motion()
    still = responders.world_matrices(scene, treadmill, ["hips"], range(1, FRAMES + 1))[:, 0, :3, 3]
    way = hips - still
    np.testing.assert_allclose(way, np.linspace(0, 1, FRAMES)[:, None] * way[-1], atol=1e-5)
    assert way[-1] @ (0, -1, 0) > 0.999 * np.linalg.norm(way[-1]), "the walker looks along -Y"


@pytest.mark.slow
def test_it_holds_beyond_the_frame_range(scene, treadmill):
    scene.softground.frame_start, scene.softground.frame_end = 12, 60
    bpy.ops.softground.root_motion()
    hips = responders.world_matrices(scene, treadmill, ["hips"], (60, 61))[:, 0, :2, 3]
    assert np.linalg.norm(hips[1] - hips[0]) < 0.02, "no jump back"


@pytest.mark.slow
def test_remove_gives_the_bytes_back_also_under_a_response(scene, treadmill):
    before = fingerprints.of_file()
    bpy.ops.softground.root_motion()
    travelling = fingerprints.of_file()
    assert travelling != before
    bpy.ops.softground.clean_feet()
    bpy.ops.softground.clear_bake()
    assert fingerprints.of_file() == travelling, "Clear Bake leaves the travel"
    bpy.ops.softground.clean_feet()
    bpy.ops.softground.remove_root_motion()
    scene.softground.has_layers = False
    assert fingerprints.of_file() == before


def test_what_is_cancelled_leaves_everything_as_it_was(scene, treadmill):
    before = fingerprints.of_file()
    job = root_motion.root_motion(scene)
    for _ in range(3):
        next(job)
    job.close()
    assert fingerprints.of_file() == before


def test_clean_feet_takes_what_travels(scene, treadmill):
    with pytest.raises(RuntimeError, match="press Root Motion"):
        bpy.ops.softground.clean_feet()
    bpy.ops.softground.root_motion()
    assert bpy.ops.softground.clean_feet() == {"FINISHED"}
    assert has_layer(treadmill, LayerKind.CLEAN_FEET)
    assert has_layer(treadmill, LayerKind.ROOT_MOTION)
    assert treadmill.animation_data.action.name == "Walk"


def test_a_rig_whose_controls_hang_on_a_root_is_keyed_there(scene):
    puppet = responders.with_ik()
    bpy.ops.object.mode_set(mode="EDIT")
    bones = puppet.data.edit_bones
    root = bones.new("root")
    root.head, root.tail = (0, 0, 0), (0.1, 0.3, 0.1)  # whichever way it points
    for bone in bones:
        if bone.parent is None and bone != root:
            bone.parent = root
    bpy.ops.object.mode_set(mode="OBJECT")
    check_on_the_spot(scene, puppet, control="root")


def test_a_rig_without_one_travels_as_an_object(scene):
    puppet = responders.with_ik()
    puppet.rotation_euler.z = 0.7
    check_on_the_spot(scene, puppet, control="Puppet")


def check_on_the_spot(scene, puppet, control):
    """Take the walk's travel out of the controls, and have it back."""
    bpy.context.view_layer.update()
    bpy.context.view_layer.objects.active = puppet
    bpy.ops.softground.add_character()
    hips = responders.mapping_of(scene.softground.characters[0]).joints["hips"][0]
    speed = 0.5  # a stride of 0.5 m in 24 frames, in m/s
    assert speed_of(scene, puppet, hips) == pytest.approx(speed, rel=0.01)
    per_frame = np.array((0.0, 0.5 / 24, 0.0))
    for name in {curve.data_path.split('"')[1] for curve in action_curves(puppet.animation_data.action)}:
        rest = np.array(puppet.data.bones[name].matrix_local)[:3, :3]
        for curve in action_curves(puppet.animation_data.action):
            if curve.data_path == f'pose.bones["{name}"].location':
                responders.scale_keys(curve, 1.0, add=float((rest.T @ per_frame)[curve.array_index]))
    scene.frame_set(1)
    assert speed_of(scene, puppet, hips) < 0.01
    bpy.ops.softground.root_motion()
    assert speed_of(scene, puppet, hips) == pytest.approx(speed, rel=WITHIN)
    action = bpy.data.objects[LayerKind.ROOT_MOTION.value].animation_data.action
    keyed = {curve.data_path for curve in action_curves(action)}
    assert keyed == {"location" if control == puppet.name else f'pose.bones["{control}"].location'}


def test_a_walk_that_travels_is_refused(scene):
    shots.walker(scene, frames=48)
    bpy.ops.softground.add_character()
    before = fingerprints.of_file()
    with pytest.raises(RuntimeError, match="No character here walks on the spot"):
        bpy.ops.softground.root_motion()
    assert fingerprints.of_file() == before


def test_an_nla_that_is_switched_off_does_not_matter(scene, treadmill):
    treadmill.animation_data.use_nla = False
    bpy.ops.softground.root_motion()
    assert root_motion.speed_of(treadmill) == pytest.approx(speed_of(scene, treadmill), rel=WITHIN)


def test_the_command_line_reports_the_speed(scene, treadmill, tmp_path):
    shot, report, cleaned = tmp_path / "shot.blend", tmp_path / "feet.json", tmp_path / "clean.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(shot))
    asked = ["clean", str(shot), "--root-motion", "--save", str(cleaned), "--report", str(report)]
    assert cli.run_standalone(asked) == 0
    travel = json.loads(report.read_text(encoding="utf-8"))["root_motion"]["Walker"]
    assert travel == {"control": "hips", "speed_m_s": pytest.approx(Gait().speed, rel=WITHIN)}
    bpy.ops.wm.open_mainfile(filepath=str(cleaned))
    armature = bpy.context.scene.softground.characters[0].armature
    assert root_motion.speed_of(armature) == pytest.approx(Gait().speed, rel=WITHIN)
