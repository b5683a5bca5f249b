"""AMASS archives: poses made by hand, whose joints are known; broken archives are refused in a sentence."""

from __future__ import annotations

import io

import numpy as np
import pytest

from softground_addon.core.capture import amass
from softground_addon.core.errors import InputError
from tests.core.capture.memory import taking_no_more_than

UPRIGHT = (np.pi / 2, 0.0, 0.0)
"""Turns a body with y up to z up, as all AMASS files do."""


def archive(**arrays: object) -> bytes:
    content = io.BytesIO()
    np.savez(content, **arrays)
    return content.getvalue()


def packed(**arrays: object) -> bytes:
    content = io.BytesIO()
    np.savez_compressed(content, **arrays)
    return content.getvalue()


def poses(frames: int = 3) -> np.ndarray:
    values = np.zeros((frames, 156))
    values[:, :3] = UPRIGHT
    return values


def test_a_body_at_rest_stands_upright_and_moves_with_its_way():
    way = np.array([[0, 0, 1.0], [0, 0.1, 1.0], [0, 0.2, 1.0]])
    body = amass.read(archive(poses=poses(), trans=way, mocap_framerate=120.0))
    joints = body.joints
    assert body.rate == 120.0
    assert (
        joints["head"][0, 2]
        > joints["neck"][0, 2]
        > joints["hips"][0, 2]
        > joints["knee_l"][0, 2]
        > joints["heel_l"][0, 2]
    )
    np.testing.assert_allclose(np.diff(joints["ball_r"], axis=0), np.diff(way, axis=0))
    np.testing.assert_allclose(joints["hip_l"][0] - joints["hips"][0], (0.06, 0.015, -0.09), atol=1e-12)


def test_a_knee_bends_by_its_turn():
    bent = poses()
    bent[1, 3 * 4] = np.pi / 2  # the left knee: the shank swings back
    joints = amass.read(archive(poses=bent, trans=np.zeros((3, 3)), mocap_framerate=60.0)).joints
    shank = joints["ankle_l"] - joints["knee_l"]
    np.testing.assert_allclose(np.linalg.norm(shank[1]), np.linalg.norm(shank[0]))
    np.testing.assert_allclose(shank[0] @ shank[1], shank[0, 0] * shank[1, 0], atol=1e-12)  # only across nothing turns
    np.testing.assert_allclose(joints["knee_l"][1], joints["knee_l"][0])


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"no archive", "not an AMASS file"),
        (archive(trans=np.zeros((3, 3))), "not an AMASS file"),
        (archive(poses=poses(), trans=np.zeros((3, 3))), "frame rate"),
        (archive(poses=poses(), trans=np.zeros((2, 3)), mocap_framerate=60), "contradicts"),
        (archive(poses=poses()[:, :30], trans=np.zeros((3, 3)), mocap_framerate=60), "66 or more"),
        (archive(poses=np.array([{}], object), trans=np.zeros((3, 3)), mocap_framerate=60), "not an AMASS file"),
        (archive(poses=poses(), trans=np.zeros((3, 3)), mocap_framerate=60)[:-300], "not an AMASS file"),
        (archive(poses=poses(), trans=np.zeros((3, 3)), mocap_framerate=1e-9), "frame rate of 1e-09 Hz"),
        (archive(poses=poses(), trans=np.zeros((3, 3)), mocap_framerate=1e5), "frame rate of 100000 Hz"),
        (packed(poses=np.zeros((10**6, 66), np.int8), trans=np.zeros((3, 3)), mocap_framerate=60), "1,000,000 frames"),
        (packed(poses=poses(), trans=np.zeros((10**7, 3), np.int8), mocap_framerate=60), "10,000,000 frames"),
        (archive(poses=poses(), trans=np.zeros(3), mocap_framerate=60), "not an AMASS file"),
    ],
    ids=[
        "text", "no poses", "no rate", "lengths", "few joints", "objects", "cut short", "slow", "fast", "long",
        "long way", "no way",
    ],
)  # fmt: skip
def test_a_broken_archive_is_refused_in_a_sentence_before_it_takes_memory(content, words):
    with taking_no_more_than(100e6), pytest.raises(InputError, match=words):
        amass.read(content)
