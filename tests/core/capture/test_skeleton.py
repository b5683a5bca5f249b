"""Skeletons of captured bodies: what Blender keys on the rest pose gives the captured joints back."""

from __future__ import annotations

import numpy as np

from softground_addon.core.capture.joint_centres import CapturedBody
from softground_addon.core.capture.skeleton import skeleton_of, standing
from tests.core.capture.test_joint_centres import joints


def body(turn: float = 0.7) -> CapturedBody:
    """The body of the marker tests, turned about z and with a knee that bends."""
    c, s = np.cos(turn), np.sin(turn)
    turned = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    moved = joints()
    moved["knee_l"] = moved["knee_l"] + np.linspace(0, 0.2, len(moved["knee_l"]))[:, None] * (0, 1, 0.2)
    moved["hips"] = (moved["hip_l"] + moved["hip_r"]) / 2
    return CapturedBody({name: path @ turned.T for name, path in moved.items()}, 100.0)


def test_rest_and_keys_together_are_the_captured_joints():
    captured = body()
    skeleton = skeleton_of(captured)
    rest, channels = skeleton.rest(), skeleton.channels()
    index = {bone.name: place for place, bone in enumerate(skeleton.bones)}
    world: list[np.ndarray] = []
    for place, bone in enumerate(skeleton.bones):  # as Blender puts a pose together
        parent = index.get(bone.parent, -1)
        local = rest[place] if parent < 0 else world[parent] @ np.linalg.inv(rest[parent]) @ rest[place]
        world.append(local @ channels[:, place])
    for name, joint in {
        "LeftFoot": "ankle_l",
        "RightToeBase": "ball_r",
        "LeftForeArm": "elbow_l",
        "Head": "head",
    }.items():
        np.testing.assert_allclose(world[index[name]][:, :3, 3], captured.joints[joint], atol=1e-12, err_msg=name)
    np.testing.assert_allclose(np.linalg.det(channels[..., :3, :3]), 1.0)
    toward_knee = captured.joints["knee_l"] - captured.joints["hip_l"]
    np.testing.assert_allclose(np.cross(world[index["LeftUpLeg"]][:, :3, 1], toward_knee), 0.0, atol=1e-12)


def test_at_rest_it_stands_on_the_floor_and_looks_along_minus_y():
    captured = body()
    rest = standing(captured)
    assert rest["toe_l"][1] < rest["ankle_l"][1] < rest["heel_l"][1]
    assert rest["hip_l"][0] > 0 > rest["hip_r"][0]
    np.testing.assert_allclose(
        [rest["heel_l"][2], rest["ball_r"][2], rest["ankle_r"][2]], [0.03, 0.03, 0.11], atol=2e-3
    )
    thighs = [
        np.median(np.linalg.norm(captured.joints[f"hip_{s}"] - captured.joints[f"knee_{s}"], axis=1)) for s in "lr"
    ]
    np.testing.assert_allclose(rest["hip_r"][2] - rest["knee_r"][2], np.mean(thighs))
