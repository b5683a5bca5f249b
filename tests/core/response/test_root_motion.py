"""The travel that resting feet imply, against belts whose speed is known."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.loads.contacts import detect_contacts
from softground_addon.core.numerics.intervals import runs
from softground_addon.core.response import root_motion
from softground_addon.core.response.root_motion import travel_velocity
from tests.core.walkers import walk

BELT = np.array([-1.1, 0.4])


def on_a_belt(motion, velocity):
    way = np.concatenate([motion.times[:, None] * velocity, np.zeros((len(motion.frames), 1))], axis=1)
    soles = []
    for sole in motion.soles:
        poses = sole.transforms.copy()
        poses[..., :3, 3] += way[:, None]
        soles.append(replace(sole, transforms=poses))
    return replace(motion, soles=tuple(soles))


def test_feet_that_roll_over_heel_and_toes_have_the_velocity_of_the_belt_that_they_roll_on():
    motion = walk(steps=8).motion
    touching = detect_contacts(motion, FlatTerrain()).touching
    rolling = travel_velocity(motion, touching, FlatTerrain())
    assert np.linalg.norm(rolling) < 0.02
    np.testing.assert_allclose(
        travel_velocity(on_a_belt(motion, BELT), touching, FlatTerrain()), -BELT, atol=0.01 * np.linalg.norm(BELT)
    )


def test_feet_that_slip_while_they_land_and_leave_are_outvoted():
    motion = walk(steps=1).motion
    still = replace(
        motion, soles=tuple(replace(s, transforms=np.repeat(s.transforms[:1], 40, axis=0)) for s in motion.soles)
    )
    still = replace(still, frames=np.arange(40.0) + 1, joints={})
    moving = on_a_belt(still, BELT)
    for sole in moving.soles:
        sole.transforms[:8, :, 0, 3] += np.linspace(-0.1, 0.0, 8)[:, None]
    touching = np.ones((40, len(still.soles)), bool)
    np.testing.assert_allclose(travel_velocity(moving, touching, FlatTerrain()), -BELT, rtol=1e-6, atol=1e-6)


def test_where_no_two_frames_agree_as_in_a_turn_on_the_spot_the_nearest_to_the_median_tell():
    motion = walk(steps=1).motion
    still = replace(
        motion, soles=tuple(replace(s, transforms=np.repeat(s.transforms[:1], 3, axis=0)) for s in motion.soles[:1])
    )
    still = replace(still, frames=np.arange(3.0) + 1, joints={})
    speeds = np.array([0.5, 3.0])
    still.soles[0].transforms[:, :, 0, 3] -= np.concatenate([[0.0], np.cumsum(speeds * still.time_step)])[:, None]
    velocity = travel_velocity(still, np.ones((3, 1), bool), FlatTerrain())
    np.testing.assert_allclose(velocity, (1.75, 0.0), atol=1e-6)


def test_what_never_touches_has_no_travel():
    motion = walk(steps=2).motion
    nothing = np.zeros((len(motion.frames), len(motion.soles)), bool)
    assert travel_velocity(motion, nothing, FlatTerrain()) == pytest.approx(np.zeros(2))


def test_contacts_that_last_a_single_scene_frame_have_the_velocity_that_they_have_between_frames(monkeypatch):
    fine = on_a_belt(walk(steps=8).motion, BELT)
    touching = detect_contacts(walk(steps=8).motion, FlatTerrain()).touching
    longest = max(int((ends - starts).max()) for starts, ends in (runs(side) for side in touching.T))
    coarse = fine.of(np.arange(len(fine.frames)) % (longest + 1) == 0)
    loads = SimpleNamespace(motion=fine, contacts=SimpleNamespace(touching=touching))
    monkeypatch.setattr(root_motion, "treadmill_speed", lambda *_: 1.0)
    velocity = root_motion.lacking_velocity(coarse, loads, FlatTerrain())
    np.testing.assert_allclose(velocity, -BELT, atol=0.01 * np.linalg.norm(BELT))
