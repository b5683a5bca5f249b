"""Motion capture imported as a user does: the rig is where the markers were, and bakes like any other."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from softground_addon.blender import compat
from softground_addon.core.capture import trc
from softground_addon.core.capture.joint_centres import UPWARD, captured_body
from tests.core.capture.c3d_files import c3d_file
from tests.core.capture.test_amass import archive, poses
from tests.core.capture.test_c3d import plate
from tests.core.capture.test_joint_centres import centres, joints, trc_file

pytestmark = pytest.mark.usefixtures("addon")

RATE, FPS = 100.0, 25


@pytest.fixture
def scene():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = FPS
    return bpy.context.scene


def imported(path, content: bytes, **options) -> bpy.types.Object:
    path.write_bytes(content)
    assert bpy.ops.softground.import_capture(filepath=str(path), **options) == {"FINISHED"}
    return bpy.context.view_layer.objects.active


@pytest.mark.parametrize("unit", [1.0, 0.01], ids=["metres", "centimetres"])
def test_joints_are_where_they_were_recorded(scene, tmp_path, unit):
    scene.unit_settings.scale_length = unit
    lying = {name: path @ UPWARD["Y"] for name, path in centres().items()}  # TRC files have y up
    rig = imported(tmp_path / "walk.trc", trc_file(lying))
    for index in (0, 8, 28):  # a hundred samples a second, four to a frame
        scene.frame_set(scene.frame_start + index // 4, subframe=index % 4 / 4)
        for bone, joint in {
            "LeftFoot": "ankle_l",
            "RightToeBase": "ball_r",
            "RightForeArm": "elbow_r",
            "Neck": "neck",
        }.items():
            head = np.array(rig.matrix_world @ rig.pose.bones[bone].head) * unit
            np.testing.assert_allclose(head, joints()[joint][index], atol=2e-5, err_msg=bone)
    assert scene.frame_end == scene.frame_start + 7  # 29 steps of 10 ms are 7.25 frames


def test_force_plates_come_with_their_forces(scene, tmp_path):
    count, samples = 30, 10
    markers = np.stack(list(centres().values()), axis=1) * 1e3
    signals = np.zeros((count * samples, 6))
    signals[:, 2] = np.linspace(0, -700, count * samples)  # a maker who writes the action
    content = c3d_file(markers, RATE, labels=list(centres()), analog=signals, samples=samples, plates=plate(2))
    imported(tmp_path / "step.c3d", content)
    plate_object = bpy.data.objects["step Plate 1"]
    curves = compat.action_curves(plate_object.animation_data.action)
    (vertical,) = [curve for curve in curves if "force_z" in curve.data_path]
    np.testing.assert_allclose(vertical.evaluate(scene.frame_start + 299 / (RATE * samples) * FPS), 700, rtol=1e-5)
    np.testing.assert_allclose(np.array(plate_object.bound_box).max(axis=0)[:2], (0.6, 0.4), atol=1e-6)


def test_the_rig_takes_prints_like_any_other(scene, tmp_path):
    imported(
        tmp_path / "stand.npz", archive(poses=poses(40), trans=np.tile((0, 0, 1.2), (40, 1)), mocap_framerate=RATE)
    )
    assert bpy.ops.softground.add_character() == {"FINISHED"}
    (character,) = scene.softground.characters
    assert len(character.soles) == 2


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("walk.c3d", b"nothing", "not a C3D file"),
        ("walk.fbx", b"nothing", "is not motion capture that SoftGround can read"),
        ("legless.trc", trc_file({"Head": np.zeros((30, 3))}), "no markers for"),
    ],
)
def test_what_cannot_be_read_changes_nothing(scene, tmp_path, name, content, words):
    (tmp_path / name).write_bytes(content)
    for path in (tmp_path / name, tmp_path / f"missing_{name}"):
        with pytest.raises(RuntimeError, match=words if path.exists() else "cannot be read|is not motion capture"):
            bpy.ops.softground.import_capture(filepath=str(path))
    assert not bpy.data.objects
    assert not bpy.data.actions


def test_one_undo_takes_it_away(scene, tmp_path):
    (tmp_path / "walk.trc").write_bytes(trc_file(centres()))
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.softground.import_capture("EXEC_DEFAULT", True, filepath=str(tmp_path / "walk.trc"))
    assert bpy.data.objects
    bpy.ops.ed.undo()
    assert not bpy.data.objects


def test_a_capture_of_bytes_is_the_body_of_the_file():
    assert captured_body(trc.read(trc_file(centres()))).rate == RATE
