"""A walk on the spot is told from a walk, and from a ride."""

from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.checks.uneven_slides import uneven_slides
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.loads.contacts import detect_contacts
from softground_addon.core.loads.sliding import treadmill_speed
from tests.core.walkers import walk

BELT = np.array([-1.1, 0.4, 0.0])


def carried(motion, velocity, *, hips=None):
    """The motion with every sample carried along at a velocity [m/s], the hips at one of their own."""
    way = motion.times[:, None] * velocity
    soles = []
    for sole in motion.soles:
        poses = sole.transforms.copy()
        poses[..., :3, 3] += way[:, None]
        soles.append(replace(sole, transforms=poses))
    joints = {
        name: path + (way if hips is None else motion.times[:, None] * hips) for name, path in motion.joints.items()
    }
    return replace(motion, soles=tuple(soles), joints=joints)


def speed_of(motion):
    return treadmill_speed(motion, detect_contacts(motion, FlatTerrain()))


def on_the_spot(motion):
    first, last = (np.mean([sole.transforms[place, 0, :3, 3] for sole in motion.soles], axis=0) for place in (0, -1))
    return carried(motion, (first - last) * (1, 1, 0) / motion.times[-1])


def test_a_walk_and_somebody_who_stands_are_on_no_belt():
    motion = walk(steps=6).motion
    assert speed_of(motion) == 0.0
    assert treadmill_speed(motion.first(1), detect_contacts(motion.first(1), FlatTerrain())) == 0.0


def test_a_walk_on_the_spot_has_the_speed_of_the_walk():
    motion = walk(steps=6).motion
    soles = [np.ptp(sole.transforms[:, 0, 0, 3]) for sole in motion.soles]
    assert speed_of(on_the_spot(motion)) == pytest.approx(np.mean(soles) / motion.times[-1], rel=0.15)


def test_feet_that_slide_forward_under_a_body_that_runs_ahead_are_on_no_belt():
    motion = walk(steps=1).motion
    soles = tuple(replace(s, transforms=np.repeat(s.transforms[:1], len(motion.frames), axis=0)) for s in motion.soles)
    still = replace(motion, soles=soles, joints={"hips": np.tile((0.0, 0.0, 0.9), (len(motion.frames), 1))})
    slide = np.array([1.2, 0.0, 0.0])
    assert speed_of(carried(still, slide, hips=3.0 * slide)) == 0.0
    assert speed_of(carried(still, slide, hips=0.0 * slide)) == pytest.approx(1.2, rel=1e-6)


def test_feet_that_slip_under_a_body_that_travels_are_on_no_belt():
    motion = on_the_spot(walk(steps=6).motion)
    speed = speed_of(motion)
    ways = np.array([1.0, 0.0, 0.0]) * speed * np.array([0.7, 0.95, 1.2])[:, None]
    assert [speed_of(carried(motion, way)) for way in ways] == [0.0] * 3
    assert speed_of(carried(motion, ways[0] / 4)) == pytest.approx(speed - ways[0, 0] / 4, rel=0.05)


def test_skates_that_take_the_body_along_are_no_belt():
    motion = walk(steps=1).motion
    still = replace(
        motion,
        soles=tuple(
            replace(s, transforms=np.repeat(s.transforms[:1], len(motion.frames), axis=0)) for s in motion.soles
        ),
        joints={name: np.repeat(path[:1], len(motion.frames), axis=0) for name, path in motion.joints.items()},
    )
    assert speed_of(still) == 0.0
    assert speed_of(carried(still, BELT)) == 0.0


@pytest.mark.parametrize("travels", [False, True])
@pytest.mark.parametrize(("share", "is_said"), [(1.0, False), (0.8, False), (0.4, True), (0.0, False)])
def test_feet_of_a_cycle_that_slide_at_different_speeds_are_said_with_both(share, is_said, travels):
    """Forefeet that slide as fast as the hind ones, or less, under a body on the spot or with some travel of its own;
    and a tail that goes along with it."""
    motion = on_the_spot(walk(steps=8).motion)
    contacts = detect_contacts(walk(steps=8).motion, FlatTerrain())
    soles = list(motion.soles)
    for sole in motion.soles:
        poses = sole.transforms.copy()
        poses[..., 0, 3] *= share
        soles.append(replace(sole, transforms=poses, sole=replace(sole.sole, name=f"fore{sole.sole.name}")))
    cycle = replace(motion, soles=tuple(soles))
    cycle = carried(cycle, (0.4, 0.0, 0.0)) if travels else cycle
    said = uneven_slides(cycle, replace(contacts, touching=np.tile(contacts.touching, 2)))
    assert (said is not None) == is_said
    if said:
        speeds = {("fore" in name): speed for name, speed in said.facts["speeds"].items()}
        belt = 0.4 if travels else 0.0
        assert speeds[False] == pytest.approx(1.3 - belt, abs=0.15)
        assert speeds[True] == pytest.approx(abs(0.52 - belt), abs=0.15)
        assert f"{said.facts['speeds'][max(said.facts['speeds'], key=said.facts['speeds'].get)]:.2g} m/s" in said.text


def test_sound_walks_skates_and_a_foot_that_drags_are_not_uneven():
    sound = walk(steps=8).motion
    contacts = detect_contacts(sound, FlatTerrain())
    assert uneven_slides(sound, contacts) is None
    time = sound.times[:, None]
    skates = carried(sound, (0.0, 0.0, 0.0))
    for sole, side in zip(skates.soles, (-2.0, 2.0), strict=True):
        sole.transforms[..., :3, 3] = (time * (7.0, side, 0.0))[:, None]
    skates = replace(skates, joints={"hips": time * (7.0, 0.0, 0.0) + (0.0, 0.0, 0.9)})
    assert uneven_slides(skates, contacts) is None
    drags = on_the_spot(sound)
    touching = contacts.touching.copy()
    touching[:, 1] = True
    assert uneven_slides(drags, replace(contacts, touching=touching)) is None
