"""Trials as C3D files: the same motion and forces as in the table that they were made from."""

from __future__ import annotations

import json

import numpy as np
import pytest

from library.softground import InputError
from library.softground.markers import SIDES
from library.softground.trials import motion_of_trial, read_marked
from tests.core.capture.c3d_files import c3d_file
from tests.core.capture.test_joint_centres import OPENSIM, joints
from tests.validation import validate

RATE, SAMPLES, MASS = 100.0, 10, 70.0


def marked() -> dict[str, np.ndarray]:
    """Joint centres by the names of markers [mm]: a body that stands, each foot on a plate of its own."""
    body = {name: np.tile(path[:1], (len(path), 1)) for name, path in joints().items()}
    markers = {f"{s.upper()}{word}": body[f"{joint}_{s}"] for joint, word in OPENSIM.items() for s in SIDES}
    return {name: path * 1e3 for name, path in (markers | {"Neck": body["neck"], "Head": body["head"]}).items()}


@pytest.fixture
def trial(tmp_path):
    markers = marked()
    frames = len(markers["Neck"])
    ramp = np.linspace(200, 500, frames * SAMPLES)
    left, right = np.zeros((2, len(ramp), 6))
    left[:, 2], right[:, 2] = ramp, MASS * 9.81 - ramp
    corners = np.array([[200.0, 300, 0], [0, 300, 0], [0, -300, 0], [200, -300, 0]])  # of the right foot's plate
    plates = {
        "USED": np.array([2]),
        "TYPE": np.array([2, 2]),
        "ZERO": np.array([1, 0]),
        "CORNERS": np.stack([(corners - (200, 0, 0)).T, corners.T], axis=-1),
        "ORIGIN": np.zeros((3, 2)),
        "CHANNEL": np.arange(1, 13).reshape(6, 2, order="F"),
    }
    content = c3d_file(
        np.stack(list(markers.values()), axis=1),
        RATE,
        labels=list(markers),
        analog=np.concatenate([left, right], axis=1),
        samples=SAMPLES,
        plates=plates,
        more={"PROCESSING": {"BODYMASS": np.array([MASS])}},
    )
    path = tmp_path / "anna_walk.c3d"
    path.write_bytes(content)
    return read_marked(path)


def test_each_plate_bears_the_foot_that_stands_on_it(trial):
    assert (trial.mass, trial.rate, trial.subject, trial.kind) == (MASS, RATE, "anna", "walk")
    left, right = trial.forces[..., 2].T
    np.testing.assert_allclose(left + right, MASS * 9.81, rtol=1e-6)
    assert left[0] < 210
    assert left[-1] > 490


def test_each_foot_presses_where_its_plate_says_and_without_a_twist(trial):
    """Plates that send no moments bear the foot in their middle."""
    middles = np.array([(-0.1, 0.0), (0.1, 0.0)])
    np.testing.assert_allclose(trial.centres[..., :2], np.tile(middles, (len(trial.centres), 1, 1)), atol=1e-6)
    np.testing.assert_allclose(trial.free_moments, 0.0, atol=1e-6)


def test_its_motion_is_that_of_the_markers(trial):
    motion = motion_of_trial(trial)
    np.testing.assert_allclose(motion.joints["knee_l"] * 1e3, marked()["LKJC"], atol=1e-2)
    assert {sole.sole.side for sole in motion.soles} == {"L", "R"}


def test_a_folder_of_c3d_files_is_validated(trial, tmp_path, monkeypatch):
    output = tmp_path / "build"
    monkeypatch.setattr("sys.argv", ["validate", str(tmp_path), "--output", str(output)])
    validate.main()
    rows = json.loads((output / "validation.json").read_text())
    row = next(row for row in rows if row["model"] == "WHOLE_BODY")
    assert (row["trial"], row["subject"], row["kind"], row["path"]) == ("anna_walk", "anna", "walk", "joints")
    assert {"rms_bw_foot", "share_rms_bw", "rms_bw_total", "heel_strike_ms", "frames_scored"} <= row.keys()
    assert row["rms_bw_total"] < 0.01
    assert row["rms_centre_mm"] < 60
    assert row["rms_free_moment_nm"] < 1
    assert (output / "anna_walk_joints.png").exists()


def test_a_trial_without_a_mass_says_where_to_write_it(tmp_path):
    path = tmp_path / "nobody.c3d"
    markers = marked()
    path.write_bytes(c3d_file(np.stack(list(markers.values()), axis=1), RATE, labels=list(markers)))
    with pytest.raises(InputError, match=r"nobody\.json"):
        read_marked(path)
    path.with_suffix(".json").write_text('{"mass_kg": 61}')
    assert read_marked(path).mass == 61
