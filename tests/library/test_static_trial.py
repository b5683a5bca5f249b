"""Trials with clusters alone, whose anatomical markers a static trial has: the joints are where they were."""

from __future__ import annotations

import json

import numpy as np
import pytest

from library import softground
from library.softground.cli import main
from softground_addon.core.capture.joint_centres import UPWARD
from softground_addon.core.numerics.rigid import rotation
from tests.core.capture.c3d_files import c3d_file
from tests.core.capture.test_joint_centres import JOINTS, OPENSIM, trc_file
from tests.library.test_border import MASS, RATE

FRAMES = 50
SEGMENTS = {"hip": ("knee", "ankle", "heel", "ball", "toe"), "knee": ("ankle", "heel", "ball", "toe")}
SEGMENTS |= {"ankle": ("heel", "ball", "toe")}
"""What turns about each joint."""
PLATES = {"thigh": ("hip", "knee", 0.5), "shank": ("knee", "ankle", 0.5), "foot": ("ankle", "ball", 0.6)}
"""Joints between which each cluster sits, and where."""
CORNERS = np.array([(0.05, 0.02, 0.03), (0.06, -0.02, 0.03), (0.05, 0.03, -0.04), (0.04, -0.03, -0.03)])


def anatomy() -> dict[str, np.ndarray]:
    """Joints of a body that stands, (3,)."""
    sides = (("r", (1, 1, 1)), ("l", (-1, 1, 1)))
    return {f"{joint}_{side}": np.multiply(where, mirror) for side, mirror in sides for joint, where in JOINTS.items()}


def clusters() -> dict[str, np.ndarray]:
    """Four markers for each segment of a body that stands, (3,)."""
    joints, markers = anatomy(), {}
    for side in "lr":
        for plate, (start, end, part) in PLATES.items():
            middle = joints[f"{start}_{side}"] * (1 - part) + joints[f"{end}_{side}"] * part
            markers |= {f"{side.upper()}{plate}{n}": middle + corner for n, corner in enumerate(CORNERS)}
    middle = (joints["hip_l"] + joints["hip_r"]) / 2
    return markers | {f"Pelvis{n}": middle + 2 * corner for n, corner in enumerate(CORNERS)}


def walking(points: dict[str, np.ndarray], carrier) -> dict[str, np.ndarray]:
    """Points (3,) of segments while hips, knees and ankles bend and the body goes on, (F, 3)."""
    time = np.arange(FRAMES) / RATE
    bends = {"hip": 0.5 * np.sin(6 * time), "knee": 0.4 + 0.4 * np.sin(6 * time + 1), "ankle": 0.2 * np.sin(9 * time)}
    rest, moved = anatomy(), {}
    for name, point in points.items():
        path = np.tile(point, (FRAMES, 1))
        joints, side = carrier(name)
        for joint in joints:  # outermost first
            turn = rotation(bends[joint][:, None] * np.array((1.0 if side == "r" else -1.0, 0.0, 0.0)))
            centre = rest[f"{joint}_{side}"]
            path = (turn @ (path - centre)[..., None])[..., 0] + centre
        moved[name] = path + time[:, None] * (0, 1.2, 0)
    return moved


def of_joint(name):
    joint, side = name.split("_")
    return [each for each in ("ankle", "knee", "hip") if joint in SEGMENTS[each]], side


def of_cluster(name):
    plates = {"thigh": ["hip"], "shank": ["knee", "hip"], "foot": ["ankle", "knee", "hip"]}
    return next((joints for plate, joints in plates.items() if plate in name), []), name[0].lower()


def c3d(path, markers, **more):
    points = np.stack(list(markers.values()), axis=1) * 1e3
    path.write_bytes(c3d_file(points, RATE, labels=list(markers), **more))
    return path


def standing(*, lost=lambda _name: False) -> dict[str, np.ndarray]:
    """All markers of a body that stands, (20, 3); some are lost while it steps into place."""
    named = {f"{name[-1].upper()}{OPENSIM[name[:-2]]}": point for name, point in anatomy().items()}
    stepping = np.clip(np.arange(20) - 10.0, None, 0.0)
    paths, turn = {}, rotation(stepping[:, None] * np.array((0.0, 0.0, 0.05)))
    for name, point in (named | clusters()).items():
        paths[name] = np.tile(point, (20, 1))
        if any(map(lost, named | clusters())):
            paths[name] = turn @ point + stepping[:, None] * (0.0, 0.05, 0.0)
            paths[name][(stepping < 0) & lost(name)] = np.nan
    return paths


@pytest.fixture
def trials(tmp_path):
    """Files of a static trial with all markers and of a walk with the clusters alone, and the joints while it walks."""
    static = c3d(tmp_path / "static.c3d", {f"Anna:{name}": path for name, path in standing().items()})
    walk = c3d(tmp_path / "walk.c3d", walking(clusters(), of_cluster))
    legs = {name: point for name, point in anatomy().items() if name[:-2] not in ("shoulder", "elbow", "wrist")}
    return static, walk, walking(legs, of_joint)


def test_joints_follow_the_clusters_of_a_static_trial(trials):
    static, walk, joints = trials
    body = softground.read_c3d(walk, mass=MASS, static=static)
    for name, path in joints.items():
        if name in body.motion.joints:
            np.testing.assert_allclose(body.motion.joints[name], path, atol=1e-4, err_msg=name)
    assert {"hip_l", "knee_r", "ankle_l", "ball_r", "toe_l", "elbow_r"} <= body.motion.joints.keys()


@pytest.mark.parametrize(
    "lost",
    [
        lambda name: name not in clusters(),
        lambda name: name[-1] == "0",
        lambda name: name not in clusters() or name[-1] == "1",
        lambda name: "foot" in name,
    ],
    ids=["anatomy", "one of each cluster", "both", "the feet"],
)
def test_markers_that_are_lost_in_the_first_frames_of_the_static_trial_are_placed_as_well(trials, tmp_path, lost):
    _, walk, joints = trials
    static = c3d(tmp_path / "late.c3d", standing(lost=lost))
    body = softground.read_c3d(walk, mass=MASS, static=static)
    for name in joints.keys() & body.motion.joints.keys():
        np.testing.assert_allclose(body.motion.joints[name], joints[name], atol=1e-4, err_msg=name)
    assert {"hip_l", "knee_r", "ankle_l", "ball_r", "toe_l", "elbow_r"} <= body.motion.joints.keys()


def test_a_trial_of_clusters_alone_says_what_to_give(trials):
    _, walk, _ = trials
    with pytest.raises(softground.InputError, match=r"no markers for hip_l.*static trial that has them") as lacking:
        softground.read_c3d(walk)
    assert lacking.value.code == "missing_markers"
    assert "hip_l" in lacking.value.facts["missing"]


def test_a_static_trial_that_shares_no_cluster_is_no_help(trials, tmp_path):
    static, walk, _ = trials
    other = c3d(tmp_path / "other.c3d", {f"M{n}": np.tile(point, (9, 1)) for n, point in enumerate(CORNERS)})
    with pytest.raises(softground.InputError, match="no markers for hip_l"):
        softground.read_c3d(walk, static=other)
    assert softground.read_c3d(static, mass=MASS, static=other).mass == MASS  # nor is it missed


def test_a_folder_is_validated_with_a_static_trial_that_may_lie_in_it(trials, tmp_path, capsys):
    static, walk, _ = trials
    loads = softground.estimate_loads(softground.read_c3d(walk, mass=MASS, static=static))
    folder = tmp_path / "trials"
    folder.mkdir()
    markers = {name: path @ UPWARD["Y"] for name, path in walking(clusters(), of_cluster).items()}
    (folder / "anna_walk.trc").write_bytes(trc_file(markers, frames=FRAMES))
    (folder / "anna_walk.json").write_text(f'{{"mass_kg": {MASS}}}')
    softground.to_opensim(loads, folder / "anna_walk_grf.mot")
    assert main(["validate", str(folder)]) == 2
    assert "static trial that has them" in capsys.readouterr().err
    report = tmp_path / "scores.json"
    assert main(["validate", str(folder), "--static", str(static)]) == 0
    beside = folder / "standing.c3d"
    beside.write_bytes(static.read_bytes())
    assert main(["validate", str(folder), "--static", str(beside), "--report", str(report)]) == 0
    (row,) = json.loads(report.read_text())
    assert row["trial"] == "anna_walk"
    assert row["rms_bw_foot"] < 0.01


def test_the_command_takes_a_static_trial_for_files_of_markers(trials, tmp_path, capsys):
    static, walk, _ = trials
    assert main(["forces", str(walk), "--mass", "70", "--static", str(static)]) == 0
    assert "foot.L" in capsys.readouterr().out
    (tmp_path / "walk.bvh").write_text("HIERARCHY")
    assert main(["forces", str(tmp_path / "walk.bvh"), "--static", str(static)]) == 2
    assert "--static" in capsys.readouterr().err
