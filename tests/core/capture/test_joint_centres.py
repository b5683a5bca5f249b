"""Joint centres from markers: a body whose joints are known carries the markers of several conventions."""

from __future__ import annotations

import numpy as np
import pytest

from library.softground.plates import free_moment
from softground_addon.core.capture import trc
from softground_addon.core.capture.captured import Capture, Plate
from softground_addon.core.capture.joint_centres import UPWARD, captured_body
from softground_addon.core.errors import InputError
from tests.core.capture.memory import taking_no_more_than

FRAMES = 30
JOINTS = {
    "hip": (0.09, 0, 0.95), "knee": (0.09, 0.02, 0.53), "ankle": (0.09, -0.02, 0.11),
    "heel": (0.09, -0.06, 0.03), "ball": (0.09, 0.12, 0.03), "toe": (0.09, 0.19, 0.03),
    "shoulder": (0.18, 0, 1.42), "elbow": (0.22, 0, 1.13), "wrist": (0.24, 0.05, 0.88),
}  # fmt: skip
"""Of the right side of a body that looks along y [m]."""
TRUNK = {"neck": (0.0, -0.02, 1.5), "head": (0.0, 0.05, 1.68)}
OPENSIM = {
    "hip": "HJC", "knee": "KJC", "ankle": "AJC", "heel": "Heel", "ball": "MT5", "toe": "Toe.Tip",
    "shoulder": "SJC", "elbow": "EJC", "wrist": "WJC",
}  # fmt: skip


def joints() -> dict[str, np.ndarray]:
    """All joints over time: the body walks along y without moving its limbs."""
    way = np.linspace(0, 2, FRAMES)[:, None] * (0, 1, 0)
    both = {f"{joint}_r": np.array(where) + way for joint, where in JOINTS.items()}
    both |= {f"{joint}_l": np.array(where) * (-1, 1, 1) + way for joint, where in JOINTS.items()}
    return both | {joint: np.array(where) + way for joint, where in TRUNK.items()}


def capture(markers: dict[str, np.ndarray], plates: tuple[Plate, ...] = ()) -> Capture:
    return Capture(tuple(markers), np.stack(list(markers.values()), axis=1), 100.0, plates=plates)


def centres() -> dict[str, np.ndarray]:
    """Joint centres as an OpenSim user names them."""
    body = joints()
    markers = {f"{s.upper()}{word}": body[f"{joint}_{s}"] for joint, word in OPENSIM.items() for s in "lr"}
    return markers | {"Neck": body["neck"], "Head": body["head"]}


def skin() -> dict[str, np.ndarray]:
    """Plug-in Gait, with the width of each joint as the model has it, and inner markers on request."""
    body, markers = joints(), {}
    for s, out in (("L", -1.0), ("R", 1.0)):
        for joint, word, width in (
            ("knee", "KNE", 0.055),
            ("ankle", "ANK", 0.039),
            ("elbow", "ELB", 0.04),
            ("wrist", "WRA", 0.03),
        ):
            markers[f"Anna:{s}{word}"] = body[f"{joint}_{s.lower()}"] + np.array((out * width, 0, 0))
        markers |= {f"Anna:{s}HEE": body[f"heel_{s.lower()}"], f"Anna:{s}TOE": body[f"ball_{s.lower()}"]}
        markers[f"Anna:{s}SHO"] = body[f"shoulder_{s.lower()}"] + np.array((0, 0, 0.03))
    width, depth = 0.24, 0.15
    hips = (body["hip_l"] + body["hip_r"]) / 2
    front = hips + np.array((0, 0.24 * depth + 0.0099, 0.30 * width + 0.0109))
    for s, out in (("L", -1.0), ("R", 1.0)):
        markers[f"Anna:{s}ASI"] = front + np.array((out * width / 2, 0, 0))
        markers[f"Anna:{s}PSI"] = front + np.array((out * 0.05, -depth, 0))
    return markers | {
        "Anna:C7": body["neck"],
        "Anna:CLAV": body["neck"],
        "Anna:LFHD": body["head"],
        "Anna:RFHD": body["head"],
    }


@pytest.mark.parametrize("up", UPWARD)
def test_joint_centres_are_brought_upright_from_any_axes(up):
    lying = {name: path @ UPWARD[up] for name, path in centres().items()}
    body = captured_body(capture(lying))
    for name, path in joints().items():
        np.testing.assert_allclose(body.joints[name], path, atol=1e-12, err_msg=name)


def test_a_lost_marker_is_bridged():
    markers = centres()
    markers["RKJC"] = markers["RKJC"].copy()
    markers["RKJC"][10:14] = np.nan
    np.testing.assert_allclose(captured_body(capture(markers)).joints["knee_r"], joints()["knee_r"], atol=1e-12)


def test_hips_and_outer_markers_give_the_centres_to_a_centimetre():
    body = captured_body(capture(skin()))
    for name in ("knee_l", "ankle_r", "elbow_l", "wrist_r", "shoulder_l", "neck", "heel_r", "ball_l"):
        assert np.abs(body.joints[name] - joints()[name]).max() < 0.012, name
    np.testing.assert_allclose(body.joints["hip_r"][0, 0], 0.33 * 0.24 + 0.0073, atol=1e-9)  # Harrington by hand
    np.testing.assert_allclose(body.joints["hip_r"][:, 1:], joints()["hip_r"][:, 1:], atol=1e-9)


def test_between_two_sides_the_centre_is_in_the_middle():
    markers = skin()
    for s, out in (("L", -1.0), ("R", 1.0)):
        markers[f"Anna:{s}KNM"] = markers[f"Anna:{s}KNE"] - (out * 0.11, 0, 0)
    np.testing.assert_allclose(captured_body(capture(markers)).joints["knee_r"], joints()["knee_r"], atol=1e-12)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_plates_push_up_whatever_sign_their_maker_writes(sign):
    corners = np.array([[0.6, 0.4, 0], [0, 0.4, 0], [0, 0, 0], [0.6, 0, 0]])
    force = np.tile([20.0, -30, 700], (FRAMES, 1))
    moment = np.cross([0.1, -0.05, 0.0], force) + np.array((0, 0, 3.0))
    (plate,) = captured_body(capture(centres(), (Plate(corners, 100.0, sign * force, sign * moment),))).plates
    np.testing.assert_allclose(plate.force, force)
    np.testing.assert_allclose(plate.centre_of_pressure()[0], (0.4, 0.15, 0), atol=1e-12)
    np.testing.assert_allclose(free_moment(plate), 3.0, atol=1e-12)


def test_without_legs_it_says_which_markers_are_missing():
    markers = {name: path for name, path in centres().items() if "KJC" not in name}
    with pytest.raises(InputError, match="knee_l, knee_r"):
        captured_body(capture(markers))


def trc_file(markers: dict[str, np.ndarray], *, frames: int = FRAMES) -> bytes:
    names = "\t\t\t".join(markers)
    table = np.concatenate(list(markers.values()), axis=1) * 1e3
    rows = [
        "\t".join([str(i + 1), f"{i / 100:.2f}", *("" if np.isnan(x) else f"{x:.5f}" for x in row)])
        for i, row in enumerate(table)
    ]
    head = ["PathFileType\t4\t(X/Y/Z)\twalk.trc", "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits"]
    head += [f"100.00\t100.00\t{frames}\t{len(markers)}\tmm", f"Frame#\tTime\t{names}", "\t\tX1\tY1\tZ1"]
    return "\n".join([*head, "", *rows, ""]).encode()


def test_a_trc_file_holds_the_same_body():
    markers = centres()
    markers["Head"] = np.where(np.arange(FRAMES)[:, None] == 4, np.nan, markers["Head"])
    read = trc.read(trc_file(markers))
    assert (read.labels, read.rate, read.first_frame) == (tuple(markers), 100.0, 1)
    assert np.isnan(read.points[4, -1]).all()
    np.testing.assert_allclose(captured_body(read).joints["toe_l"], joints()["toe_l"], atol=1e-8)


@pytest.mark.parametrize(
    ("ours", "theirs"),
    [
        (b"PathFileType\t4\t", b"PathFileType  4\t"),  # Motion Analysis, which also pads its numbers
        (b"100.00\t100.00\t30\t20\tmm", b"  100.0 \t  100.0 \t     30 \t     20 \tmm \t  100.0 \t      1 \t    30"),
        (b"\nFrame#", b"\t100.00\t1\t30\t\t\nFrame#"),  # OpenSim's own
        (b"\n", b"\r\n"),
        (b"\tZ1\n\n", b"\tZ1\n"),  # without an empty line before the first frame, or with several
        (b"\tZ1\n\n", b"\tZ1\n\n\n"),
    ],
    ids=["spaces", "padded", "trailing tabs", "Windows", "no empty line", "empty lines"],
)
def test_trc_files_are_read_as_programs_write_them(ours, theirs):
    content = trc_file(centres())
    assert ours in content
    read = trc.read(content.replace(ours, theirs))
    assert (read.labels, read.rate, len(read.points)) == (tuple(centres()), 100.0, FRAMES)
    np.testing.assert_array_equal(read.points, trc.read(content).points)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "no TRC file"),
        (b"HIERARCHY\n" * 9, "no TRC file"),
        (trc_file(centres(), frames=99), "30 of 99 frames"),
        (trc_file(centres()).replace(b"DataRate", b"Rate"), "frame rate"),
        (trc_file(centres()).replace(b"100.00\t100", b"1e-300\t100"), "frame rate of 1e-300 Hz"),
        (trc_file(centres()) + b"1\n" * 100_000, "100,030 frames, over 100,000"),
        (trc_file({f"m{index}": np.zeros((1, 3)) for index in range(20_000)}, frames=1) + b"1\n" * 20_000, "far fewer"),
        (trc_file(centres()).replace(b"\tmm", b"\tfeet"), "unit of length"),
    ],
    ids=["empty", "another format", "cut short", "no rate", "low rate", "long", "sparse", "feet"],
)
def test_a_broken_trc_file_is_refused_in_a_sentence_before_it_takes_memory(content, words):
    with taking_no_more_than(20e6), pytest.raises(InputError, match=words):
        trc.read(content)


@pytest.mark.parametrize("count", ["²", "9" * 5000, "many"])
def test_a_count_of_frames_that_is_none_is_passed_over(count):
    content = trc_file(centres()).replace(b"\t30\t", f"\t{count}\t".encode())
    assert len(trc.read(content).points) == FRAMES
