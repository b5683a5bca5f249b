"""The motion that crosses from Blender into the core, and its resampling to the internal time grid."""

import dataclasses

import numpy as np
import pytest

from softground_addon.core.motion import motion, sole_motion


def rolling_sole(frames: int, rate: float) -> motion.CharacterMotion:
    """A sole that pitches and moves smoothly, sampled at `rate`."""
    times = np.arange(frames) / rate
    angle = 0.6 * np.sin(3 * times)
    transforms = np.tile(np.eye(4), (frames, 1, 1, 1))
    transforms[:, 0, 0, 0] = transforms[:, 0, 2, 2] = np.cos(angle)
    transforms[:, 0, 0, 2] = np.sin(angle)
    transforms[:, 0, 2, 0] = -np.sin(angle)
    transforms[:, 0, 0, 3] = times
    sole = sole_motion.Sole("foot", "", (), np.array([[0.1, 0.0, 0.0]]), np.array([0]), np.zeros((0, 2)))
    return motion.CharacterMotion(
        "walker",
        70.0,
        0.9,
        np.arange(frames) + 1.0,
        rate,
        (sole_motion.SoleMotion(sole, transforms),),
        {"hips": transforms[:, 0, :3, 3]},
    )


def test_resampling_keeps_the_given_samples():
    given = rolling_sole(30, 30.0)
    fine = given.resampled(4)
    assert np.allclose(fine.soles[0].transforms[::4], given.soles[0].transforms, atol=1e-12)
    assert np.array_equal(fine.frames[::4], given.frames)


def test_resampled_poses_are_rigid_and_on_the_true_path():
    fine = rolling_sole(30, 30.0).resampled(4)
    true = rolling_sole(29 * 4 + 1, 120.0)
    rotation = fine.soles[0].transforms[..., :3, :3]
    assert np.allclose(rotation @ np.swapaxes(rotation, -1, -2), np.eye(3), atol=1e-6)
    assert np.abs(fine.soles[0].landmark_positions() - true.soles[0].landmark_positions()).max() < 2e-4


@pytest.mark.parametrize(
    ("rate", "steps"), [(24, 5), (25, 5), (29.97, 5), (30, 4), (60, 2), (100, 2), (120, 1), (240, 1)]
)
def test_a_step_is_at_most_a_120th_of_a_second(rate, steps):
    assert motion.steps_per_frame(rate) == steps


def test_somebody_who_only_nods_does_not_stand_still():
    walking = rolling_sole(30, 30.0)
    assert not walking.stands_still
    path = np.ones((30, 3))
    standing = walking.soles[0].transforms[:1].repeat(30, axis=0)
    still = dataclasses.replace(
        walking,
        soles=(sole_motion.SoleMotion(walking.soles[0].sole, standing),),
        joints={"hips": path, "head": path.copy()},
    )
    assert still.stands_still
    still.joints["head"][7, 2] += 0.01
    assert not still.stands_still


def test_the_hips_are_between_the_hip_joints_where_they_are_not_mapped():
    path = np.array([(0.0, 0.0, 0.9), (1.0, 0.0, 0.9)])
    aside = np.array((0.0, 0.1, 0.0))
    joints = {"hips": path + 5, "hip_l": path + aside, "hip_r": path - aside}
    body = motion.CharacterMotion("body", 70.0, 0.9, np.arange(2.0), 24.0, (), joints)
    np.testing.assert_allclose(body.hips, path + 5)
    del joints["hips"]
    np.testing.assert_allclose(body.hips, path)
