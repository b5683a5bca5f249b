"""Steps without ground under them are noticed, and only those."""

from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.loads.contacts import Contacts, detect_contacts
from softground_addon.core.loads.missed_steps import advice, missed_steps
from softground_addon.core.loads.sliding import treadmill_speed
from tests.core.character import Slope, character, flat_sole
from tests.core.walkers import walk

RATE = 120.0
STEPS = 8


def steps_of(touching):
    return int((np.diff(touching.astype(int), axis=0, prepend=0) > 0).sum())


def walked(rise=lambda x: 0 * x):
    """A walk along x of `STEPS` steps whose ground rises with x."""
    motion = walk(steps=STEPS).motion
    soles = []
    for sole in motion.soles:
        poses = sole.transforms.copy()
        poses[..., 2, 3] += rise(poses[:, :1, 0, 3])
        soles.append(replace(sole, transforms=poses))
    return replace(motion, soles=tuple(soles))


def missed_in(motion, terrain):
    return missed_steps(motion, detect_contacts(motion, terrain))


def test_a_walk_on_its_ground_misses_nothing():
    assert not missed_in(walked(), FlatTerrain())


def test_steps_beyond_the_edge_of_the_ground_are_counted():
    motion = walked()
    whole = steps_of(detect_contacts(motion, FlatTerrain()).touching)
    ground = Slope(edge=3.0)
    contacts = detect_contacts(motion, ground)
    missed = missed_steps(motion, contacts)
    assert len(missed) == whole - steps_of(contacts.touching) > 2
    assert all(np.isinf(step.clearance) for step in missed)


def test_steps_of_a_climb_on_level_ground_are_counted():
    motion = walked(lambda x: 0.3 * np.maximum(x - 3.0, 0.0))
    missed = missed_in(motion, FlatTerrain())
    assert len(missed) >= 2
    assert max(step.clearance for step in missed) > 0.2


def test_jumps_and_raised_feet_are_no_steps():
    time = np.arange(0, 3, 1 / RATE)
    jump = np.maximum(0.0, 3.0 * (time - 1.0) - 4.905 * (time - 1.0) ** 2)
    lifted = np.where((time > 1.0) & (time < 2.5), 0.4, 0.0)
    both = [flat_sole(np.stack([0 * time, 0 * time + y, jump], -1)) for y in (-0.1, 0.1)]
    feet = [flat_sole(np.stack([0 * time, 0 * time + y, z], -1)) for y, z in ((-0.1, lifted), (0.1, 0 * time))]
    for soles in (both, feet):
        assert not missed_in(character(soles, rate=RATE), FlatTerrain())


@pytest.mark.parametrize(("speed", "steps"), [(0.0, 0), (-2.0, 4)])
def test_in_a_run_on_the_spot_a_foot_rests_that_moves_with_the_belt_and_none_that_hangs(speed, steps):
    """One foot stands on the belt for a third of the time; the other one is level in the air once it has left."""
    time = np.arange(0, 2.5, 1 / RATE)
    phase = (time / 0.6 + 0.9) % 1.0
    stands = phase < 1 / 3
    forth = np.where(stands, -1.2 * phase, -0.4 + 0.6 * (phase - 1 / 3))
    up = 0.3 * np.sin(np.pi * np.clip((phase - 1 / 3) * 1.5, 0, 1))
    hangs = (phase > 0.45) & (phase < 0.9)
    other = np.cumsum(np.where(hangs, speed, 3.0)) / RATE
    feet = np.stack([forth, 0 * time + 0.1, up], axis=-1), np.stack([other, 0 * time - 0.1, 0 * time + 0.2], axis=-1)
    motion = character([flat_sole(feet[0]), flat_sole(feet[1], name="away")], hips=(0, 0, 0.9), rate=RATE)
    touching = np.stack([stands, np.zeros_like(stands)], axis=-1)
    clearance = np.stack([path[:, 2] for path in feet], axis=-1)
    contacts = Contacts(touching, np.zeros(2), np.broadcast_to((0.0, 0.0, 1.0), (*touching.shape, 3)), clearance)
    assert treadmill_speed(motion, contacts) == pytest.approx(2.0)
    assert [step.sole for step in missed_steps(motion, contacts)] == ["away"] * steps


@pytest.mark.parametrize("lands", [True, False])
def test_a_foot_of_a_walk_on_the_spot_that_treads_the_ground_elsewhile_misses_none_when_it_lifts(lands):
    """It goes on with the belt for a while after toe-off, when nothing else carries the body."""
    time = np.arange(0, 2.4, 1 / RATE)
    phase = (time / 0.8 + (0.0 if lands else 0.6)) % 1.0
    forth = np.where(phase < 0.6, -phase, -0.6 + 1.5 * (phase - 0.6))
    up = np.where((phase > 0.3) & (phase < 0.6), 0.06, np.where(phase < 0.6, 0.0, 0.2))
    motion = character([flat_sole(np.stack([forth, 0 * time, up], axis=-1))], hips=(0, 0, 0.9), rate=RATE)
    touching = (lands & (phase < 0.3))[:, None]
    belt = np.stack([-1.25 * time, 0 * time - 0.2, 0 * time], axis=-1)  # of a foot that is down all the time
    motion = replace(motion, soles=(*motion.soles, flat_sole(belt, name="belt")))
    touching = np.concatenate([touching, (phase < 0.05)[:, None]], axis=1)
    clearance = np.stack([up, 0 * up], axis=-1)
    contacts = Contacts(touching, np.zeros(2), np.broadcast_to((0.0, 0.0, 1.0), (*touching.shape, 3)), clearance)
    assert treadmill_speed(motion, contacts) == pytest.approx(1.25, rel=0.05)
    missed = [step.sole for step in missed_steps(motion, contacts) if step.sole != "belt"]
    assert bool(missed) == (not lands)


def test_the_advice_names_how_many_since_when_and_what_to_do():
    missed = missed_in(walked(), Slope(edge=3.0))
    text = advice("Walker", missed, "'Field'").text
    assert f"{len(missed)} steps of 'Walker'" in text
    assert "'Field'" in text
    assert f"from frame {missed[0].frame:.0f}" in text
    assert "extend or move the ground" in text
    once = "1 step of 'Walker' meets no ground on 'Field' and leaves no print"
    assert advice("Walker", missed[:1], "'Field'").text.startswith(once)
