"""The library's border: bodies from every kind of file are one body, forces and prints obey their laws."""

from __future__ import annotations

import csv
import doctest
import inspect
import json
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest

from library import softground
from library.softground import prints as prints_module
from library.softground import storage
from library.softground.body import placed
from library.softground.cli import main
from library.softground.plates import free_moment
from softground_addon.core.capture.joint_centres import UPWARD, CapturedBody
from softground_addon.core.capture.skeleton import skeleton_of
from softground_addon.core.ground.field_tests import snow as snow_of_core
from softground_addon.core.ground.heightfield import SlopingTerrain
from softground_addon.core.loads import estimate
from tests.core.capture.c3d_files import c3d_file
from tests.core.capture.test_amass import archive, poses
from tests.core.capture.test_joint_centres import centres, joints, trc_file
from tests.core.rig.test_bare_body import FACES, walk
from tests.validation.test_forces_of_gait import DATA

RATE, MASS = 100.0, 70.0
WEIGHT = MASS * 9.81
SNOW = softground.snow("pencil")


def standing(height: float = 0.0, frames: int = 60) -> dict[str, np.ndarray]:
    """The body of the marker tests, at one place."""
    return {name: np.tile(path[0] + (0, 0, height), (frames, 1)) for name, path in joints().items()}


@pytest.fixture(scope="module")
def loads():
    return softground.estimate_loads(softground.Body.from_joints(standing(), RATE, mass=MASS))


@pytest.fixture(scope="module")
def prints(loads):
    return softground.press(loads, softground.Ground(SNOW), cell_size=0.01)


def test_a_body_that_stands_presses_its_weight_between_heels_and_toes_and_does_not_twist(loads):
    np.testing.assert_allclose(sum(sole.force for sole in loads.soles), np.tile((0, 0, WEIGHT), (60, 1)), atol=1e-6)
    for sole in loads.soles:
        np.testing.assert_allclose(sole.contacts, [[0.0, loads.times[-1]]])
        assert (np.abs(sole.force[:, 2] - WEIGHT / 2) < 1e-6).all()
        assert (sole.centre_of_pressure[:, 1] > -0.06).all()
        assert (sole.centre_of_pressure[:, 1] < 0.19).all()
        np.testing.assert_allclose(sole.centre_of_pressure[:, 2], 0.0, atol=1e-9)
        np.testing.assert_allclose(sole.free_moment, 0.0, atol=1e-6)
        assert (sole.deviation > 0).all()


def test_forces_are_those_of_the_core_to_the_last_bit(loads):
    motion = loads.body.motion
    material = snow_of_core(3.0)  # forces of a body with joints depend on none
    core = estimate.estimate_loads(
        motion, SlopingTerrain(0.0, np.zeros(2)), force_model="WHOLE_BODY", material=material
    )
    assert np.array_equal(core.forces.forces[core.motion.on_frames], np.stack([s.force for s in loads.soles], axis=1))


def test_the_same_walk_gives_the_same_body_from_every_file_of_markers(tmp_path):
    markers = centres()
    (tmp_path / "anna.trc").write_bytes(trc_file(markers))
    points = np.stack(list(markers.values()), axis=1) * 1e3
    (tmp_path / "anna.c3d").write_bytes(
        c3d_file(points, RATE, labels=list(markers), more={"SUBJECTS": {"MASS": np.array([61.5])}})
    )
    marked = softground.read_c3d(tmp_path / "anna.c3d")
    assert (marked.name, marked.mass, marked.rate) == ("anna", 61.5, RATE)
    plain = softground.Body.from_joints(joints(), RATE, mass=61.5)
    others = [softground.read_trc(tmp_path / "anna.trc", mass=61.5), plain]
    for other in others:
        for name, path in marked.motion.joints.items():
            np.testing.assert_allclose(other.motion.joints[name], path, atol=1e-6, err_msg=name)
        for sole, two in zip(marked.shape.soles, other.shape.soles, strict=True):
            np.testing.assert_allclose(sole.landmark_positions(), two.landmark_positions(), atol=1e-4)


def test_a_mass_that_nobody_tells_is_that_of_a_person_of_this_size():
    body = softground.Body.from_joints(standing(), RATE)
    assert "two legs" in body.mass_from
    assert 55 < body.mass < 90


def test_an_amass_archive_is_a_body_on_two_feet(tmp_path):
    way = np.tile((0.0, 0.0, 1.2), (60, 1))
    (tmp_path / "pose.npz").write_bytes(archive(poses=poses(60), trans=way, mocap_framerate=120.0))
    body = softground.read_amass(tmp_path / "pose.npz", mass=MASS)
    assert [sole.sole.side for sole in body.shape.soles] == ["L", "R"]
    assert body.rate == 120.0


BVH = """HIERARCHY
ROOT Hips
{
 OFFSET 0 0 0
 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
 %s
 JOINT Spine
 {
  OFFSET 0 10 0
  CHANNELS 3 Zrotation Xrotation Yrotation
  JOINT LeftArm
  {
   OFFSET 20 40 0
   CHANNELS 3 Zrotation Xrotation Yrotation
   JOINT LeftForeArm
   {
    OFFSET 30 0 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
     OFFSET 25 0 0
    }
   }
  }
 }
}
MOTION
Frames: %d
Frame Time: 0.0333333
%s
"""
LEG = """ JOINT {side}UpLeg
 {{
  OFFSET {x} 0 0
  CHANNELS 3 Zrotation Xrotation Yrotation
  JOINT {side}Leg
  {{
   OFFSET 0 -42 0
   CHANNELS 3 Zrotation Xrotation Yrotation
   JOINT {side}Foot
   {{
    OFFSET 0 -42 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {{
     OFFSET 0 -8 15
    }}
   }}
  }}
 }}"""


def bvh(tmp_path, stands=1, **turns):
    """A figure in centimetres, Y up, that stands and turns some joints in its last frame; Z, X, Y [degrees]."""
    legs = "\n".join(LEG.format(side=side, x=x) for side, x in (("Left", 10), ("Right", -10)))
    names = ["Hips", "LeftUpLeg", "LeftLeg", "LeftFoot", "RightUpLeg", "RightLeg", "RightFoot"]
    names += ["Spine", "LeftArm", "LeftForeArm"]
    rows = [[0, 92, 0], [100, 92, 0]]
    for name in names:
        rows[0] += [0, 0, 0]
        rows[1] += turns.get(name, [0, 0, 0])
    path = tmp_path / "figure.bvh"
    rows = [*[rows[0]] * stands, rows[1]]
    path.write_text(BVH % (legs, len(rows), "\n".join(" ".join(map(str, row)) for row in rows)))
    return path


def test_bones_of_a_bvh_go_where_its_turns_take_them(tmp_path):
    """By hand: an arm that is turned by 90° about z points up, and its forearm, about y as well, to -z of the file."""
    body = softground.read_bvh(bvh(tmp_path, LeftArm=[90, 0, 0], LeftForeArm=[0, 0, 90]), mass=MASS, scale=0.01)
    # Y up becomes Z up, and what points to -z of the file then points to y.
    first, second = ({name: path[frame] for name, path in body.motion.joints.items()} for frame in (0, 1))
    np.testing.assert_allclose(first["shoulder_l"], (0.2, 0, 1.42), atol=1e-6)
    np.testing.assert_allclose(first["elbow_l"], (0.5, 0, 1.42), atol=1e-6)
    np.testing.assert_allclose(second["elbow_l"], (1.2, 0, 1.72), atol=1e-6)
    np.testing.assert_allclose(second["wrist_l"], (1.2, 0.25, 1.72), atol=1e-6)
    np.testing.assert_allclose(second["hips"], (1.0, 0, 0.92), atol=1e-6)
    assert body.rate == pytest.approx(30.0, abs=1e-3)


PAW = """ JOINT {side}{upper}
 {{
  OFFSET {x} -2 {z}
  CHANNELS 3 Zrotation Xrotation Yrotation
  JOINT {side}{lower}
  {{
   OFFSET 0 -18 2
   CHANNELS 3 Zrotation Xrotation Yrotation
   JOINT {side}{paw}
   {{
    OFFSET 0 -18 -2
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {{
     OFFSET 0 -6 2
    }}
   }}
  }}
 }}"""


def test_an_animal_of_a_bvh_stands_on_four_paws_and_wants_its_mass(tmp_path):
    """Its weight is between them, and the paws nearer to its centre of mass, in front, bear more of it."""
    legs = [("Left", 6), ("Right", -6)]
    parts = [PAW.format(side=side, x=x, z=0, upper="UpLeg", lower="Leg", paw="Foot") for side, x in legs]
    parts += [PAW.format(side=side, x=x, z=45, upper="Arm", lower="ForeArm", paw="Hand") for side, x in legs]
    neck = " JOINT Neck\n {\n OFFSET 0 5 50\n CHANNELS 3 Zrotation Xrotation Yrotation\n"
    neck += " End Site\n {\n OFFSET 0 12 10\n }\n }"
    head, _, _ = (BVH % ("\n".join([*parts, neck]), 60, "")).partition(" JOINT Spine")
    rows = "\n".join("0 44 0 " + "0 " * 42 for _ in range(60))
    path = tmp_path / "dog.bvh"
    path.write_text(f"{head}}}\nMOTION\nFrames: 60\nFrame Time: 0.0333333\n{rows}\n")
    with pytest.raises(softground.InputError, match="nothing tells what 'dog' weighs"):
        softground.read_bvh(path)
    loads = softground.estimate_loads(softground.read_bvh(path, mass=25.0, scale=0.01))
    bears = {sole.name: float(sole.force[30, 2]) for sole in loads.soles}
    assert sum(bears.values()) == pytest.approx(25.0 * 9.81, rel=1e-6)
    assert min(bears.values()) > 0.1 * 25.0 * 9.81
    assert bears["hand.L"] + bears["hand.R"] > bears["foot.L"] + bears["foot.R"]


def test_turns_of_a_bvh_follow_each_other_in_the_order_of_its_channels(tmp_path):
    """Z then X, of which X turns first: what points along x stays under X, and Z takes it to y (up)."""
    turned = softground.read_bvh(bvh(tmp_path, LeftArm=[90, 90, 0]), mass=MASS, scale=0.01).motion.joints
    np.testing.assert_allclose(turned["elbow_l"][1] - turned["shoulder_l"][1], (0, 0, 0.3), atol=1e-6)
    turned = softground.read_bvh(bvh(tmp_path, LeftArm=[0, 90, 90]), mass=MASS, scale=0.01).motion.joints
    # Y takes x to -z (of the file), which X takes to y: up
    np.testing.assert_allclose(turned["elbow_l"][1] - turned["shoulder_l"][1], (0, 0, 0.3), atol=1e-6)


def test_boxes_that_walk_are_a_body_with_their_volume_and_two_soles():
    positions, _ = walk()
    triangles = np.concatenate([FACES + 8 * number for number in range(3)])
    body = softground.Body.from_mesh_sequence(positions, triangles, 24.0, name="robot")
    assert body.mass_from == "the volume of its skin"
    assert body.mass == pytest.approx(1000 * (0.4 * 0.25 * 0.8 + 2 * 0.12 * 0.25 * 0.95), rel=0.05)
    loads = softground.estimate_loads(body)
    assert len(loads.soles) == 2
    assert all(len(sole.contacts) >= 3 and np.isnan(sole.deviation).all() for sole in loads.soles)
    mean = sum(sole.force[:, 2] for sole in loads.soles)[24:72].mean()
    assert mean == pytest.approx(body.mass * 9.81, rel=0.1)


def test_heights_hold_the_volumes_of_the_prints(prints):
    x, y, heights = prints.grid()
    compressed, raised = prints.volumes
    assert heights.shape == (len(y), len(x))
    assert heights.sum() * prints.cell_size**2 == pytest.approx(raised - compressed, rel=1e-6)
    assert raised == pytest.approx(2 * SNOW.poisson_ratio * compressed, rel=1e-6)
    assert -heights.min() == pytest.approx(max(each.depth for each in prints.prints), rel=1e-6)


def test_a_ground_is_untouched_before_the_first_step_and_far_from_all(prints):
    np.testing.assert_array_equal(prints.grid(-1.0)[2], 0.0)
    np.testing.assert_array_equal(prints.heights([50.0, -50.0], 50.0), 0.0)


def test_a_ground_a_metre_higher_has_the_same_prints_a_metre_higher(prints):
    loads = softground.estimate_loads(softground.Body.from_joints(standing(1.0), RATE, mass=MASS), 1.0)
    higher = softground.press(loads, softground.Ground(SNOW, 1.0), cell_size=0.01)
    np.testing.assert_allclose(higher.grid()[2], prints.grid()[2] + 1.0, atol=1e-6)


def test_the_softer_the_snow_the_deeper_a_boot(loads):
    depths = []
    for hardness in softground.prints.HARDNESSES:
        ground = softground.Ground(softground.snow(hardness))
        depths.append(max(each.depth for each in softground.press(loads, ground, cell_size=0.02).prints))
    assert depths == sorted(depths, reverse=True)
    assert depths[0] > 5 * depths[-1]


@pytest.mark.parametrize("height", [1, np.float32(1.0), np.int64(1), np.array(1.0)])
def test_the_height_of_a_level_ground_is_any_number(height):
    body = softground.Body.from_joints(standing(1.0, frames=3), RATE, mass=MASS)
    assert softground.estimate_loads(body, height).soles[0].force[0, 2] == pytest.approx(WEIGHT / 2)


def test_the_command_compares_with_plates_where_they_show_all_that_bears(loads, tmp_path, capsys, monkeypatch):
    """On one plate of two that a body stands on, half of it is no error of the estimate."""
    force = np.stack([sole.force for sole in loads.soles], axis=1)
    shown = force.copy()
    shown[30:, 1] = 0.0
    monkeypatch.setattr(
        "library.softground.cli._loads", lambda _: replace(loads, body=replace(loads.body, plates=(1,)))
    )
    monkeypatch.setattr("library.softground.cli.plates_on_feet", lambda _: SimpleNamespace(force=shown))
    assert main(["forces", "anna.c3d"]) == 0
    assert "bears: 0.000 body weights" in capsys.readouterr().out


def test_progress_goes_from_nothing_to_all(loads):
    parts: list[float] = []
    softground.press(loads, softground.Ground(SNOW), cell_size=0.02, progress=parts.append)
    assert parts == sorted(parts)
    assert (parts[0], parts[-1]) == (0.0, 1.0)


def test_tables_hold_the_numbers_to_the_last_bit(loads, prints, tmp_path):
    with softground.to_csv(loads, tmp_path / "forces.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [float(row["foot.L_force_z_n"]) for row in rows] == loads.soles[0].force[:, 2].tolist()
    with softground.to_csv(prints, tmp_path / "prints.csv").open() as file:
        assert [float(row["depth_m"]) for row in csv.DictReader(file)] == [each.depth for each in prints.prints]


def test_opensim_reads_forces_with_y_up_and_the_bodies_that_they_act_on(loads, tmp_path):
    table, external = softground.to_opensim(loads, tmp_path / "walk.mot")
    lines = table.read_text().split("endheader\n")[1].splitlines()
    row = dict(zip(lines[0].split("\t"), map(float, lines[1].split("\t")), strict=True))
    assert row["ground_foot_L_vy"] == pytest.approx(WEIGHT / 2, abs=1e-5)
    assert row["ground_foot_L_py"] == pytest.approx(0.0, abs=1e-6)
    forces = ElementTree.parse(external).iter("ExternalForce")
    assert [force.find("applied_to_body").text for force in forces] == ["calcn_l", "calcn_r"]


def test_trials_as_opensim_users_lay_them_out_are_read(loads, tmp_path, capsys):
    """Forces that the library wrote itself, as those of plates: against them it has no error but of rounding."""
    markers = {name: np.tile(path[:1], (60, 1)) for name, path in centres().items()}
    turned = {name: path @ UPWARD["Y"] for name, path in markers.items()}  # Y up
    (tmp_path / "anna_walk.trc").write_bytes(trc_file(turned, frames=60))
    softground.to_opensim(loads, tmp_path / "anna_walk_grf.mot")
    assert main(["validate", str(tmp_path)]) == 2
    assert "anna_walk.json" in capsys.readouterr().err
    (tmp_path / "anna_walk.json").write_text('{"mass_kg": 70}')
    report = tmp_path / "scores.json"
    assert main(["validate", str(tmp_path), "--report", str(report)]) == 0
    (row,) = json.loads(report.read_text())
    assert (row["trial"], row["path"], row["frames_scored"]) == ("anna_walk", "joints", 60)
    assert row["rms_bw_foot"] < 1e-5
    assert row["rms_bw_foot_anterior_posterior"] < 1e-5
    assert row["rms_centre_mm"] < 0.1
    assert row["rms_free_moment_nm"] < 1e-3


def test_forces_of_plates_by_their_usual_names_are_turned_with_the_markers(tmp_path):
    """By hand: 600 N up and 50 N along x at (0.1, 0, -0.2) with Y up, which is (0.1, 0.2, 0) with Z up."""
    path = tmp_path / "walk_forces.mot"
    labels = ["time", *(f"R_ground_force_{kind}{axis}" for kind in "vp" for axis in "xyz")]
    labels += [f"R_ground_torque_{axis}" for axis in "xyz"]
    row = [50.0, 600.0, 0.0, 0.1, 0.0, -0.2, 0.0, 3.0, 0.0]
    lines = ["forces", "version=1", "endheader", "\t".join(labels)]
    lines += ["\t".join(map(str, [time, *row])) for time in np.arange(0.5, 1.0, 0.001).round(6)]
    path.write_text("\n".join(lines))
    assert storage.forces_beside(tmp_path / "walk.trc") == path
    (plate,) = storage.plates_of(path, 0.6)
    assert plate.rate == pytest.approx(1000.0)
    assert len(plate.force) == 400
    np.testing.assert_allclose(plate.force[7], (50, 0, 600), atol=1e-9)
    np.testing.assert_allclose(plate.centre_of_pressure()[7], (0.1, 0.2, 0.0), atol=1e-9)
    np.testing.assert_allclose(free_moment(plate)[7], 3.0, atol=1e-9)


def scaled(factor):
    return {name: path * factor for name, path in standing().items()}


def on_its_side(axis):
    """The standing body with another axis up."""
    return {name: path @ UPWARD[axis] for name, path in standing().items()}


def skeleton_on_its_side(axis):
    joints = standing()
    joints["hips"] = (joints["hip_l"] + joints["hip_r"]) / 2
    return placed(skeleton_of(CapturedBody(joints, RATE)), UPWARD[axis].T, 1.0)


@pytest.mark.parametrize("axis", ["X", "Y", "-Y", "-Z"])
@pytest.mark.parametrize(
    ("body", "lying"),
    [
        (lambda *given, **options: softground.Body.from_joints(*given, RATE, **options), on_its_side),
        (softground.Body.from_skeleton, skeleton_on_its_side),
    ],
    ids=["joints", "skeleton"],
)
def test_a_body_with_another_axis_up_is_noticed_and_turned_on_request(axis, body, lying):
    with pytest.raises(softground.InputError, match=f"above its feet along {axis}, not Z: give up='{axis}'") as noticed:
        body(lying(axis), mass=MASS)
    assert (noticed.value.code, noticed.value.facts["up"]) == ("wrong_axis", axis)
    turned, upright = body(lying(axis), mass=MASS, up=axis), body(lying("Z"), mass=MASS)
    for sole, other in zip(turned.shape.soles, upright.shape.soles, strict=True):
        np.testing.assert_allclose(sole.landmark_positions(), other.landmark_positions(), atol=1e-9)
    with pytest.raises(softground.InputError, match="must be one of X"):
        body(lying(axis), mass=MASS, up="up")


def test_a_body_that_lies_is_read_if_somebody_says_so_and_one_that_sits_or_bends_forward_in_any_case():
    lying = {name: path + np.array((0.0, 0.0, 0.1)) for name, path in on_its_side("Y").items()}
    assert softground.Body.from_joints(lying, RATE, mass=MASS, up="Z").motion.joints["hip_l"][0, 2] < 0.3
    on_floor, lower = ("ankle", "heel", "ball", "toe"), np.array((0.0, -0.45, -0.4))
    sitting = {name: path if name.startswith(on_floor) else path + lower for name, path in standing().items()}
    softground.Body.from_joints(sitting, RATE, mass=MASS)


def refusals():
    line = {name: path[:, :2] for name, path in standing().items()}
    legless = {name: path for name, path in standing().items() if not name.startswith("knee")}
    body, meshes = softground.Body.from_joints, softground.Body.from_mesh_sequence
    still = np.tile(walk()[0][:1], (9, 1, 1))
    return {
        "the joints knee_l, knee_r are missing": lambda: body(legless, RATE),
        r"not numbers of the shape \(60, 3\)": lambda: body(line, RATE),
        "frame rate of 0 Hz": lambda: body(standing(), 0.0),
        "mass of 'body' is -1 kg": lambda: body(standing(), RATE, mass=-1.0),
        r"positions are of shape \(3, 3\)": lambda: meshes(np.eye(3), [[0, 1, 2]], RATE),
        "1.72e\\+03 m large, as of a file in millimetres": lambda: body(scaled(1e3), RATE, mass=MASS),
        "172 m large, as of a file in centimetres": lambda: body(scaled(1e2), RATE),
        r"not numbers of the shape \(2, 3\)": lambda: body(standing(frames=0), RATE),
        "as one rigid piece": lambda: meshes(still, FACES, RATE),
        "hardness 'hand'": lambda: softground.snow("hand"),
        "from 1": lambda: softground.snow(7),
        "cannot be read": lambda: softground.read_bvh("nobody.bvh"),
    }


@pytest.mark.parametrize("message", refusals())
def test_what_cannot_be_used_is_refused_in_a_sentence(message):
    with pytest.raises(softground.InputError, match=message):
        refusals()[message]()


def test_a_ground_on_another_terrain_than_its_loads_is_refused(loads):
    with pytest.raises(softground.InputError, match="another one"):
        softground.press(loads, softground.Ground(SNOW, 0.5))
    with pytest.raises(softground.InputError, match="cell size"):
        softground.press(loads, softground.Ground(SNOW), cell_size=0.0)


DAMAGES = {
    "cut short": ("MOTION", "MOTION\nFrames: 9\nFrame Time: 0.04\n"),
    "unknown channels": ("Xrotation", "Xturn"),
    "a word among the numbers": ("0.0333333", "0.0333333 x"),
    "channels counted backward": ("CHANNELS 3", "CHANNELS -5"),
    "offsets that are no numbers": ("OFFSET 20 40 0", "OFFSET nan 40 0"),
    "a body at infinity": ("100 92 0", "1e300 92 0"),
    "no time": ("Frame Time", "Frame"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_bvh_is_refused_in_a_sentence(tmp_path, damage):
    path = bvh(tmp_path)
    assert DAMAGES[damage][0] in path.read_text()
    path.write_text(path.read_text().replace(*DAMAGES[damage]))
    with pytest.raises(softground.InputError, match=r"BVH|'figure' has"):
        softground.read_bvh(path)


def test_bones_of_one_name_are_told_apart(tmp_path):
    path = bvh(tmp_path, stands=20)
    path.write_text(path.read_text().replace("Spine", "Hips"))
    body = softground.read_bvh(path, mass=MASS, scale=0.01)
    np.testing.assert_allclose(body.motion.joints["hips"][0], (0, 0, 0.92), atol=1e-6)
    np.testing.assert_allclose(body.motion.joints["elbow_l"][0], (0.5, 0, 1.42), atol=1e-6)


def test_the_command_tells_forces_presses_and_leaves_with_the_extension_s_codes(tmp_path, capsys):
    markers = {name: np.tile(path[:1], (60, 1)) for name, path in centres().items()}
    points = np.stack(list(markers.values()), axis=1) * 1e3
    c3d = tmp_path / "anna.c3d"
    c3d.write_bytes(c3d_file(points, RATE, labels=list(markers), more={"SUBJECTS": {"MASS": np.array([MASS])}}))
    assert main(["forces", str(c3d), "--csv", str(tmp_path / "f.csv"), "--opensim", str(tmp_path / "f.sto")]) == 0
    assert re.search(r"foot\.L +0\.000 +0\.59\d +343", capsys.readouterr().out)
    heights = tmp_path / "heights.npy"
    assert main(["press", str(c3d), "--ground", "snow:pencil", "--cell-size", "0.01", "--heights", str(heights)]) == 0
    assert np.load(heights).shape[-1] == 3
    assert np.load(heights)[..., 2].min() < -0.04
    assert main(["press", str(c3d), "--ground", "snow:pencil", "--level", "-3"]) == 2
    assert "the lowest comes to" in capsys.readouterr().err
    assert main(["press", str(c3d), "--ground", "lava"]) == 2
    assert "There is no preset 'lava'" in capsys.readouterr().err
    assert main(["validate", str(tmp_path / "nothing")]) == 2
    assert main(["forces"]) == 2


def test_a_file_that_nobody_named_is_not_replaced(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("library.softground.cli._loads", lambda _: pytest.fail("it is refused before the work"))
    motion, mine = str(tmp_path / "walk.c3d"), b"mine"
    for name, options in (("walk_forces.png", ["--plot"]), ("walk.xml", ["--opensim", str(tmp_path / "walk.mot")])):
        (tmp_path / name).write_bytes(mine)
        assert main(["forces", motion, *options]) == 2
        assert f"{name}' is there already" in capsys.readouterr().err
        assert (tmp_path / name).read_bytes() == mine


def test_a_check_that_fails_and_an_interruption_have_codes_of_their_own(tmp_path, capsys, monkeypatch):
    for error, code in ((softground.BakeError("broken"), 3), (KeyboardInterrupt(), 130)):

        def fail(*_, error=error):
            raise error

        monkeypatch.setattr("library.softground.cli.read_trials", fail)
        assert main(["validate", str(tmp_path)]) == code
    assert "softground: broken" in capsys.readouterr().err


def test_its_examples_hold(monkeypatch):
    monkeypatch.syspath_prepend(Path(softground.__file__).parents[1])  # as if it were installed
    with np.printoptions(legacy="1.21"):
        for module in (softground, prints_module):
            result = doctest.testmod(module)
            assert result.attempted > 0
            assert result.failed == 0


UNITS = re.compile(r"\[(m|s|N|N·m|kg|Hz|m³|m²|rad)\]|Parameters")


@pytest.mark.parametrize("name", softground.__all__)
def test_every_public_name_says_what_it_is_with_units_and_errors(name):
    public = getattr(softground, name)
    text = inspect.getdoc(public)
    assert text
    if inspect.isfunction(public):
        assert "Raises" in text or name in ("presets", "plates_on_feet"), name
        assert "Parameters" in text or not inspect.signature(public).parameters, name
    elif not issubclass(public, Exception) and name != "Terrain":
        assert UNITS.search(text), name


@pytest.mark.skipif(not DATA.exists(), reason=f"needs the reference data in {DATA}")
def test_a_measured_walk_is_as_near_to_the_plates_as_docs_forces_say(capsys, tmp_path):
    for kind in ("csv", "json", "bvh"):
        (tmp_path / f"walk_subject01.{kind}").symlink_to(DATA / f"walk_subject01.{kind}")
    assert main(["validate", str(tmp_path)]) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()[1:]]
    assert [(row[1], row[3]) for row in rows] == [("joints", "0.035"), ("bvh", "0.035")]
