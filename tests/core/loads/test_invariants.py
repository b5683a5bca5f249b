"""What mechanics ask of the forces of any animation, however it was made.

The mean over a cycle is the weight, nothing is negative, nothing acts in flight, and the impulse is the change of
momentum.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softground_addon.core.dynamics.body_dynamics import body_dynamics, with_flight
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.loads.estimate import estimate_loads
from softground_addon.core.motion.motion import LowSkin
from softground_addon.core.numerics.intervals import runs
from tests.core import spring_mass
from tests.core.character import standing
from tests.core.spring_mass import motion_and_forces

SNOW = GroundMaterial(0.25e6, 0.05, 0.2)
GAITS = {
    "walk": spring_mass.walk(),
    "jog": spring_mass.run(2.5, flight=0.05, stiffness=20.0),
    "run": spring_mass.run(3.5),
}


def loads_of(motion):
    return estimate_loads(motion, FlatTerrain(), force_model="WHOLE_BODY", material=SNOW)


def vertical(loads):
    """Total vertical force [body weights]."""
    return loads.forces.total[:, 2] / (loads.motion.mass * loads.motion.gravity)


def mean_over_cycles(loads, period):
    """Over whole cycles of `period` [s], the first and the last left out."""
    steps = period / loads.motion.time_step
    cycles = int((len(loads.motion.frames) - 1) / steps - 2)
    return vertical(loads)[round(steps) : round((cycles + 1) * steps)].mean()


def assert_sound(loads):
    forces = loads.forces.forces
    assert forces[..., 2].min() >= 0
    assert (forces[~loads.contacts.touching] == 0).all()
    assert forces.sum(axis=1) == pytest.approx(loads.forces.total, abs=1e-9)


def bobbing(height, period, cycles, rate):
    """Feet on the ground, hips up and down by ±`height` [m] in `period` frames."""
    phase = 2 * np.pi * np.arange(cycles * period + 1) / period
    hips = np.stack([0 * phase, 0 * phase, 0.9 + height * np.sin(phase)], axis=1)
    return standing(len(phase), hips=hips, rate=rate)


def at_pace(name, slowed, *, rate=60.0):
    """A gait in slow motion."""
    motion, forces = motion_and_forces(GAITS[name], rate=rate * slowed, seconds=5.0)
    return replace(motion, frame_rate=rate), forces


def stride(name):
    return 2 * GAITS[name].times[-1]


def in_units(motion, factor):
    """The motion of a skinned body as a file with units of another size has it."""

    def scaled(sole):
        transforms = sole.transforms.copy()
        transforms[..., :3, 3] *= factor
        return replace(sole, sole=replace(sole.sole, landmarks=sole.sole.landmarks * factor), transforms=transforms)

    far_up = np.full((len(motion.frames), 1, 3), 2.0 * factor)
    return replace(
        motion,
        leg_length=motion.leg_length * factor,
        joints={name: path * factor for name, path in motion.joints.items()},
        soles=tuple(scaled(sole) for sole in motion.soles),
        skin=LowSkin(motion.frames, far_up, far_up[..., 2], 0.3 * factor, 1.78 * factor),
        stature=1.6 * factor,
    )


@pytest.mark.parametrize("factor", [100.0, 0.01])
@pytest.mark.parametrize("gait", GAITS)
@pytest.mark.parametrize("force_model", ["WHOLE_BODY", "IMPULSE"])
def test_a_file_in_other_units_touches_and_weighs_as_in_metres(factor, gait, force_model):
    motion, _ = motion_and_forces(GAITS[gait], rate=30.0, seconds=4.0)
    expected, forces = (
        estimate_loads(in_units(motion, size), FlatTerrain(), force_model=force_model, material=SNOW)
        for size in (1.0, factor)
    )
    assert (forces.contacts.touching == expected.contacts.touching).all()
    assert vertical(forces) == pytest.approx(vertical(expected), abs=1e-3)
    assert forces.forces.forces == pytest.approx(expected.forces.forces, rel=1e-3, abs=1e-3 * 77.5 * 9.81)


@given(
    height=st.floats(0.0, 0.1), period=st.integers(8, 40), cycles=st.integers(6, 9), rate=st.sampled_from((24, 30, 60))
)
@settings(max_examples=40, deadline=None)
def test_a_bob_by_hand_weighs_what_the_body_weighs(height, period, cycles, rate):
    """Also where the hips come down faster than they could fall."""
    loads = loads_of(bobbing(height, period, cycles, float(rate)))
    assert mean_over_cycles(loads, period / rate) == pytest.approx(1.0, abs=0.005)
    assert_sound(loads)


@pytest.mark.parametrize("height", [0.04, 0.06, 0.08])
def test_feet_that_stand_under_a_body_bobbing_by_hand_bear_it_most_of_the_time(height):
    """Some animators let a body come down several times as fast as it could fall."""
    loads = loads_of(bobbing(height, 8, 8, 24.0))
    force = loads.forces.total[:, 2] / (loads.motion.mass * loads.motion.gravity)
    assert (force > 0.01).mean() > 0.75
    assert force.max() < 6.0


@given(height=st.floats(0.0, 0.1), period=st.integers(8, 40), window=st.tuples(st.floats(0, 1), st.floats(0, 1)))
@settings(max_examples=40, deadline=None)
def test_the_impulse_is_the_change_of_momentum_over_any_window(height, period, window):
    motion = bobbing(height, period, 8, 60.0).resampled(2)
    body = with_flight(motion, body_dynamics(motion), np.zeros(len(motion.frames), dtype=bool))
    first, last = sorted(1 + round(part * (len(motion.frames) - 4)) for part in window)
    impulse = (np.maximum(body.force[first : last + 1, 2], 0.0) - 1).sum() * motion.gravity * motion.time_step
    velocity = np.diff(body.centre[:, 2]) / motion.time_step
    scale = motion.gravity * motion.time_step * len(motion.frames)
    assert impulse == pytest.approx(velocity[last] - velocity[first - 1], abs=1e-3 * scale)


@pytest.mark.parametrize(("rate", "held"), [(24.0, 1), (24.0, 2), (24.0, 3), (30.0, 2), (30.0, 4)])
def test_a_walk_on_twos_and_fours_weighs_what_the_body_weighs(rate, held):
    motion, _ = motion_and_forces(GAITS["walk"], rate=rate, seconds=6.0)
    samples = np.arange(len(motion.frames)) // held * held
    stepped = replace(
        motion,
        joints={name: path[samples] for name, path in motion.joints.items()},
        soles=tuple(replace(sole, transforms=sole.transforms[samples]) for sole in motion.soles),
    )
    loads = loads_of(stepped)
    assert mean_over_cycles(loads, stride("walk")) == pytest.approx(1.0, abs=0.005)
    assert loads.contacts.touching.any(axis=1).all()
    assert_sound(loads)


@pytest.mark.parametrize("slowed", [1.0, 1.5, 2.0, 3.0, 4.0])
@pytest.mark.parametrize("name", GAITS)
def test_slow_motion_weighs_what_the_body_weighs(name, slowed):
    loads = loads_of(at_pace(name, slowed)[0])
    assert mean_over_cycles(loads, slowed * stride(name)) == pytest.approx(1.0, abs=0.005)
    assert_sound(loads)


@pytest.mark.parametrize("float_height", [0.03, 0.06])
@pytest.mark.parametrize("rate", [30.0, 60.0, 120.0])
def test_a_walk_over_a_foot_that_floats_for_a_step_does_not_fly(rate, float_height):
    """Over its foot a walking body falls slowly and evenly, as in a flight in slow motion."""
    motion, forces = motion_and_forces(GAITS["walk"], rate=rate, seconds=4.0)
    first, last = (ends[1] for ends in runs(forces[:, 0, 2] > 0))
    reach = round(0.05 * rate)
    poses = motion.soles[0].transforms.copy()
    poses[first - reach : last + reach, :, 2, 3] += float_height
    loads = loads_of(replace(motion, soles=(replace(motion.soles[0], transforms=poses), motion.soles[1])))
    step = (len(loads.motion.frames) - 1) // (len(motion.frames) - 1)
    error = (loads.forces.total[::step] - forces.sum(axis=1))[:, 2] / spring_mass.WEIGHT
    assert np.sqrt((error**2).mean()) < 0.05
    assert_sound(loads)


@pytest.mark.parametrize("slowed", [1.0, 1.5, 2.0, 3.0, 4.0])
def test_flights_stay_flights_in_slow_motion_and_forces_what_they_were(slowed):
    motion, forces = at_pace("run", slowed)
    loads = loads_of(motion)
    flights, _ = runs(~loads.contacts.touching.any(axis=1))
    true_flights, _ = runs((forces[..., 2] == 0).all(axis=1))
    assert len(flights) == pytest.approx(len(true_flights), abs=1)
    step = (len(loads.motion.frames) - 1) // (len(motion.frames) - 1)
    error = (loads.forces.total[::step] - forces.sum(axis=1))[:, 2] / spring_mass.WEIGHT
    assert np.sqrt((error**2).mean()) < 0.06


@pytest.mark.parametrize(("name", "noise"), [(name, noise) for name in GAITS for noise in (0.001, 0.003)])
def test_jitter_and_sliding_feet_change_no_weight(name, noise):
    random = np.random.default_rng(4)
    motion, _ = motion_and_forces(GAITS[name], rate=60.0, seconds=5.0)

    def moved(sole):
        poses = sole.transforms.copy()
        poses[..., :3, 3] += noise * random.normal(size=poses[..., :3, 3].shape)
        poses[..., 0, 3] += 0.03 * np.sin(4.8 * motion.times)[:, None]
        return replace(sole, transforms=poses)

    joints = {joint: path + noise * random.normal(size=path.shape) for joint, path in motion.joints.items()}
    loads = loads_of(replace(motion, joints=joints, soles=tuple(moved(sole) for sole in motion.soles)))
    assert mean_over_cycles(loads, stride(name)) == pytest.approx(1.0, abs=0.005)
    assert_sound(loads)
