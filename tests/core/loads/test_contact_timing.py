"""Contacts that agree with the forces on the whole body, on bodies whose forces are known."""

from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.dynamics.body_dynamics import body_dynamics
from softground_addon.core.loads.contact_timing import Transition, refine_contacts, transitions
from softground_addon.core.loads.contacts import Contacts
from softground_addon.core.numerics.intervals import runs
from tests.core.character import character, flat_sole

RATE = 120.0
GRAVITY = 9.81


def contacts(touching, clearance=None):
    touching = np.asarray(touching, dtype=bool)
    normals = np.broadcast_to((0.0, 0.0, 1.0), (*touching.shape, 3))
    return Contacts(
        touching, np.zeros(touching.shape[1]), normals, np.zeros(touching.shape) if clearance is None else clearance
    )


def step_from_foot_to_foot(strike, leave, *, count=240):
    """A point mass over two feet 0.6 m apart whose load passes over a cosine ramp; its path follows from that.

    With the centre of mass at height h, x'' = g/h·(x - p) for the point of action p: solved as two boundary values.
    """
    time = np.arange(count) / RATE
    phase = np.clip((np.arange(count) - strike) / (leave - strike), 0.0, 1.0)
    point = 0.6 * (0.5 - 0.5 * np.cos(np.pi * phase))
    stiffness = GRAVITY / 0.9
    second = (np.eye(count, k=1) - 2 * np.eye(count) + np.eye(count, k=-1)) * RATE**2
    system = second - stiffness * np.eye(count)
    right = -stiffness * point
    system[[0, -1]] = 0.0
    system[0, 0] = system[-1, -1] = 1.0
    right[[0, -1]] = -0.1, 0.7
    x = np.linalg.solve(system, right)
    hips = np.stack([x, 0 * time, np.full(count, 0.9)], axis=1)
    back = flat_sole(np.zeros((count, 3)), landmarks=((0, 0, 0),))
    front = flat_sole(np.tile((0.6, 0.0, 0.0), (count, 1)), landmarks=((0, 0, 0),))
    return character([back, front], hips=hips, rate=RATE)


@pytest.mark.parametrize("error", [(9, -9), (9, 9), (-9, -9), (-9, 9)])
def test_the_point_of_action_corrects_heel_strike_and_toe_off(error):
    strike, leave = 110, 134
    motion = step_from_foot_to_foot(strike, leave)
    step = np.arange(240)
    seen = contacts(np.stack([step < leave + error[1], step >= strike + error[0]], axis=1))
    refined = refine_contacts(motion, seen, body_dynamics(motion)).touching
    # 75 ms wrong each, where heights and speeds are trusted to 30 ms: at least a third of it is taken back.
    assert runs(refined[:, 1])[0][0] == pytest.approx(strike, abs=6)
    assert runs(refined[:, 0])[1][0] == pytest.approx(leave, abs=6)


def test_a_body_moved_without_regard_to_its_feet_leaves_them_as_they_were_seen():
    """Animated by eye, hips glide evenly from one foot to the next: that tells nothing of when the load passes."""
    step = np.arange(240)
    hips = np.stack([0.3 + 1.2 * (step - 122) / RATE, 0 * step, np.full(240, 0.9)], axis=1)
    back = flat_sole(np.zeros((240, 3)), landmarks=((0, 0, 0),))
    front = flat_sole(np.tile((0.6, 0.0, 0.0), (240, 1)), landmarks=((0, 0, 0),))
    motion = character([back, front], hips=hips, rate=RATE)
    seen = np.stack([step < 134, step >= 110], axis=1)
    refined = refine_contacts(motion, contacts(seen), body_dynamics(motion)).touching
    assert runs(refined[:, 1])[0][0] == pytest.approx(110, abs=2)
    assert runs(refined[:, 0])[1][0] == pytest.approx(134, abs=2)


def test_a_body_that_is_held_up_stands_on_its_lowest_foot_however_it_floats():
    motion = character([flat_sole(np.zeros((120, 3)), name=side) for side in "lr"], hips=(0, 0, 0.9), rate=RATE)
    clearance = np.tile((0.12, 0.5), (120, 1))
    refined = refine_contacts(motion, contacts(np.zeros((120, 2)), clearance), body_dynamics(motion)).touching
    assert refined[:, 0].all()
    assert not refined[:, 1].any()


def test_a_sole_that_the_skin_shows_in_the_air_bears_nothing_whatever_holds_the_body_up():
    motion = character([flat_sole(np.zeros((120, 3)), name=side) for side in "lr"], hips=(0, 0, 0.9), rate=RATE)
    body = body_dynamics(motion)

    def touching(*aloft):
        timed = contacts(np.zeros((120, 2)), np.tile((0.05, 0.06), (120, 1)))
        return refine_contacts(motion, replace(timed, aloft=np.tile(aloft, (120, 1))), body).touching

    assert not touching(True, True).any()
    assert touching(False, True).all(axis=0).tolist() == [True, False]


@pytest.mark.parametrize(("belt", "height"), [(0.9, 0.02), (0.9, 0.08), (0.0, 0.02)])
def test_on_a_belt_a_foot_that_rolls_from_its_heel_without_being_lifted_stands_on(belt, height):
    step = np.arange(240)
    path = np.stack([belt * step / RATE, 0 * step, 0 * step], axis=1)
    motion = character([flat_sole(path, name=side) for side in "lr"], hips=(0, 0, 0.9), rate=RATE)
    rolls = (step >= 100) & (step < 112)
    seen = contacts(np.stack([~rolls, step > -1], axis=1), np.stack([height * rolls, 0 * step], axis=1))
    refined = refine_contacts(motion, seen, body_dynamics(motion)).touching
    assert refined[:, 0].all() == (belt > 0 and height < 0.05 * 0.9)


def test_a_body_that_hangs_high_stands_on_nothing():
    motion = character([flat_sole(np.zeros((120, 3)))], hips=(0, 0, 0.9), rate=RATE)
    refined = refine_contacts(motion, contacts(np.zeros((120, 1)), np.full((120, 1), 0.4)), body_dynamics(motion))
    assert not refined.touching.any()


def test_steps_that_float_too_high_to_be_seen_are_told_apart_by_their_swings():
    """Low swings: a foot that bears is told from one that swings by its speed, not by its height."""
    step = np.arange(440)
    places, swinging = [], []
    for phase in (20, 80):
        cycle, moment = np.divmod(step + phase, 120)
        swing = np.clip((moment - 72) / 48, 0.0, 1.0)  # 0.6 s on the ground, 0.4 s in the air
        x = 1.2 * (cycle + swing**2 * (3 - 2 * swing)) - 0.01 * phase
        places.append(np.stack([x, 0 * x, 0.12 + 0.04 * np.sin(np.pi * swing)], axis=1))
        swinging.append((swing > 0.25) & (swing < 0.75))
    hips = np.stack([0.01 * step, 0 * step, np.full(440, 0.9)], axis=1)
    motion = character([flat_sole(path) for path in places], hips=hips, rate=RATE)
    clearance = np.stack([path[:, 2] for path in places], axis=1)
    seen = contacts(np.zeros((440, 2)), clearance)
    refined = refine_contacts(motion, seen, body_dynamics(motion)).touching
    assert refined.any(axis=1).all()
    assert not (refined & np.stack(swinging, axis=1)).any()
    assert [len(runs(foot)[0]) for foot in refined.T] == [4, 4]


def test_a_foot_that_drags_without_load_does_not_touch():
    """The body stands over the first foot; the second slides along half a metre away for a while."""
    places = [np.zeros((240, 3)), np.tile((0.5, 0.0, 0.0), (240, 1))]
    motion = character([flat_sole(path, landmarks=((0, 0, 0),)) for path in places], hips=(0, 0, 0.9), rate=RATE)
    step = np.arange(240)
    seen = contacts(np.stack([step >= 0, (step > 60) & (step < 150)], axis=1))
    refined = refine_contacts(motion, seen, body_dynamics(motion)).touching
    assert refined[:, 0].all()
    assert not refined[:, 1].any()


def test_a_transition_is_between_two_soles_with_no_third_in_it():
    touching = np.zeros((100, 3), dtype=bool)
    touching[:50, 0] = touching[40:, 1] = True
    assert transitions(touching, 5) == [Transition(trailing=0, leading=1, strike=40, leave=50)]
    touching[:, 2] = True
    assert transitions(touching, 5) == []
