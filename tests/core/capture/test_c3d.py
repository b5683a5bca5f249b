"""C3D files against ezc3d, an independent reader, and what was written; broken ones are refused in a sentence."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from library.softground.plates import free_moment
from library.softground.readers import c3d_mass
from softground_addon.core.capture import c3d
from softground_addon.core.errors import InputError
from tests.core.capture.c3d_files import DEC, INTEL, SGI, c3d_file
from tests.core.capture.memory import taking_no_more_than

FRAMES, SAMPLES = 20, 10
CORNERS = np.array([[600.0, 400, 0], [0, 400, 0], [0, 0, 0], [600, 0, 0]])


def points(*, seed: int = 0) -> np.ndarray:
    where = np.random.default_rng(seed).normal(size=(FRAMES, 5, 3)) * 500
    where[5, 2] = np.nan  # a marker that was lost
    return where


def plate(kind: int) -> dict[str, np.ndarray]:
    origin = [120.0, 200.0, -41.0] if kind == 3 else [3.0, -2.0, -41.0]
    channels = 8 if kind == 3 else 6
    header = {
        "USED": np.array([1]),
        "TYPE": np.array([kind]),
        "ZERO": np.array([1, 0]),
        "CORNERS": CORNERS.T[:, :, None],
        "ORIGIN": np.array(origin)[:, None],
        "CHANNEL": np.arange(1, channels + 1)[:, None],
    }
    if kind == 4:
        header["CAL_MATRIX"] = (2 * np.eye(6) + 0.05 * np.random.default_rng(1).normal(size=(6, 6)))[:, :, None]
    return header


def signals(kind: int) -> np.ndarray:
    values = np.random.default_rng(kind).normal(size=(FRAMES * SAMPLES, 8 if kind == 3 else 6)) * 50
    values[:, 4:] += 150 * (kind == 3)
    values[:, 2] += 600 * (kind != 3)
    return values


@pytest.mark.parametrize("processor", [INTEL, DEC])
@pytest.mark.parametrize("scale", [-1.0, 0.1], ids=["reals", "whole"])
@pytest.mark.parametrize("kind", [2, 3, 4])
def test_markers_and_plates_are_those_of_ezc3d(tmp_path, processor, scale, kind):
    ezc3d = pytest.importorskip("ezc3d")
    content = c3d_file(
        points(), 100.0, analog=signals(kind), samples=SAMPLES, plates=plate(kind), processor=processor, scale=scale
    )
    (tmp_path / "trial.c3d").write_bytes(content)
    theirs = ezc3d.c3d(str(tmp_path / "trial.c3d"), extract_forceplat_data=True)["data"]
    capture = c3d.read(content)
    np.testing.assert_allclose(capture.points * 1e3, theirs["points"][:3].transpose(2, 1, 0), atol=1e-9)
    (ours,), platform = capture.plates, theirs["platform"][0]
    np.testing.assert_allclose(ours.force, platform["force"].T, atol=1e-9)
    np.testing.assert_allclose(ours.moment * 1e3, platform["moment"].T, atol=1e-6)
    np.testing.assert_allclose(ours.centre_of_pressure() * 1e3, platform["center_of_pressure"].T, atol=1e-6)
    np.testing.assert_allclose(free_moment(ours) * 1e3, platform["Tz"].T[:, 2], atol=1e-6)


def test_a_file_that_ezc3d_wrote_holds_its_markers_and_the_force_of_two_plates(tmp_path):
    """Bodies of 700 and 300 N on plates whose z points down, at (0.1, 0.2) m of the first and in the middle of both."""
    ezc3d = pytest.importorskip("ezc3d")
    file, where = ezc3d.c3d(), points()[:, [0, 1, 3, 4]]
    about = file["parameters"]
    about["POINT"]["RATE"]["value"], about["POINT"]["UNITS"]["value"] = [100.0], ["mm"]
    about["POINT"]["LABELS"]["value"] = ["LASI", "RASI", "LHEE", "RHEE"]
    about["ANALOG"]["RATE"]["value"] = [100.0 * SAMPLES]
    about["ANALOG"]["LABELS"]["value"] = [
        f"{axis}{number}" for number in (1, 2) for axis in ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
    ]
    about["ANALOG"]["UNITS"]["value"] = ["N", "N", "N", "Nmm", "Nmm", "Nmm"] * 2
    file["data"]["points"] = np.append(where.transpose(2, 1, 0), np.ones((1, 4, FRAMES)), axis=0)
    middle = CORNERS.mean(axis=0)[:2]
    x, y = np.array((100.0, 200.0)) - middle
    channels = np.array([0, 0, -700, 700 * y, 700 * x, 0, 5, 0, -300, 0, 0, 0])  # y of the plates is -y here
    file["data"]["analogs"] = np.tile(channels[None, :, None], (1, 1, FRAMES * SAMPLES)).astype(float)
    corners = np.stack([CORNERS, CORNERS + np.array([700, 0, 0])], axis=-1).transpose(1, 0, 2)[:, [3, 2, 1, 0]]
    plates = {"USED": [2], "TYPE": [2, 2], "ZERO": [1, 0], "CORNERS": corners, "ORIGIN": np.zeros((3, 2))}
    for name, value in (plates | {"CHANNEL": np.arange(1.0, 13.0).reshape(2, 6).T}).items():
        file.add_parameter("FORCE_PLATFORM", name, value)
    file.add_parameter("SUBJECTS", "MASS", [70.5])
    file.write(str(tmp_path / "trial.c3d"))
    content = (tmp_path / "trial.c3d").read_bytes()
    capture = c3d.read(content)
    assert (capture.labels, capture.rate) == (("LASI", "RASI", "LHEE", "RHEE"), 100.0)
    assert c3d_mass(content) == pytest.approx(70.5)
    np.testing.assert_allclose(capture.points * 1e3, where, atol=1e-4)
    assert [float(ours.force[0, 2]) for ours in capture.plates] == pytest.approx([700.0, 300.0])
    np.testing.assert_allclose(capture.plates[0].centre_of_pressure()[0], (0.1, 0.2, 0.0), atol=1e-6)


@pytest.mark.parametrize("processor", [INTEL, DEC, SGI])
@pytest.mark.parametrize("scale", [-1.0, 0.1], ids=["reals", "whole"])
def test_what_was_written_is_read(processor, scale):
    content = c3d_file(points(), 120.0, processor=processor, scale=scale, first=7)
    capture = c3d.read(content)
    np.testing.assert_allclose(capture.points, points() * 1e-3, atol=6e-5 if scale > 0 else 1e-6)
    assert capture.labels == ("m0", "m1", "m2", "m3", "m4")
    assert (capture.rate, capture.first_frame, capture.plates) == (120.0, 7, ())


def test_a_plate_that_sends_its_centre_of_pressure_has_it():
    values = np.tile([10.0, -20, 700, 30, 40, 500], (FRAMES * SAMPLES, 1))  # N, mm, Nmm
    capture = c3d.read(c3d_file(points(), 100.0, analog=values, samples=SAMPLES, plates=plate(1)))
    (ours,) = capture.plates
    np.testing.assert_allclose(ours.centre_of_pressure()[0], [0.33, 0.24, 0], atol=1e-9)
    np.testing.assert_allclose(free_moment(ours)[0], 0.5, atol=1e-9)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "not a C3D file"),
        (b"BVH" * 500, "not a C3D file"),
        (c3d_file(points(), 100.0)[:-600], "cut short"),
        (c3d_file(points(), 100.0).replace(b"mm", b"ft"), "unit of length"),
        (c3d_file(points(), 0.0), "frame rate"),
        (c3d_file(points(), 1e-9), "frame rate"),
        (c3d_file(np.zeros((0, 3, 3)), 100.0), "cut short|no markers"),
    ],
    ids=["empty", "another format", "cut short", "feet", "no rate", "low rate", "no frames"],
)
def test_what_cannot_be_read_is_refused_in_a_sentence(content, words):
    with pytest.raises(InputError, match=words):
        c3d.read(content)


def test_more_frames_than_a_rig_takes_are_refused_before_they_take_memory():
    field = {"ACTUAL_START_FIELD": np.array([1, 0]), "ACTUAL_END_FIELD": np.array([150_001 % 65536, 150_001 // 65536])}
    content = c3d_file(np.zeros((150_001, 1, 3)), 100.0, scale=0.1, more={"TRIAL": field})
    with taking_no_more_than(5e6), pytest.raises(InputError, match="150,001 frames, over 100,000"):
        c3d.read(content)


def test_plates_that_claim_the_same_channels_take_no_more_memory_than_the_channels():
    claimed = {name: np.repeat(value, 200, axis=-1) for name, value in plate(2).items() if name not in ("USED", "ZERO")}
    content = c3d_file(points(), 100.0, analog=signals(2), samples=SAMPLES, plates=claimed | {"USED": np.array([200])})
    assert len(c3d.read(content).plates) == 1


@given(seed=st.integers(0, 2**32 - 1), where=st.integers(0, 5000), length=st.integers(1, 40))
def test_a_damaged_file_is_read_or_refused(seed, where, length):
    content = bytearray(c3d_file(points(), 100.0, analog=signals(2), samples=SAMPLES, plates=plate(2)))
    start = where % len(content)
    noise = np.random.default_rng(seed).integers(0, 256, length, dtype=np.uint8).tobytes()
    content[start : start + length] = noise[: len(content) - start]
    try:
        capture = c3d.read(bytes(content))
    except InputError:
        return
    assert capture.points.shape[1:] == (len(capture.labels), 3)
