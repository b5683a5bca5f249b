"""The forces of both models, against numbers worked out by hand."""

import dataclasses

import numpy as np
import pytest

from softground_addon.core.loads.contacts import Contacts
from softground_addon.core.loads.forces import RESTING_FRACTION, impulse_forces, whole_body_forces
from tests.core.character import character, flat_sole, standing

MASS, GRAVITY = 77.5, 9.81
WEIGHT = MASS * GRAVITY


def contacts(touching, normal=(0.0, 0.0, 1.0)):
    touching = np.asarray(touching, dtype=bool)
    normals = np.tile(normal, (*touching.shape, 1)).astype(float)
    return Contacts(touching, np.zeros(touching.shape[1]), normals, np.zeros(touching.shape))


def landing(rate=120.0, speed=2.0):
    """A body on one sole that falls at a constant speed [m/s] and stands from 0.5 s on."""
    time = np.arange(int(1.5 * rate)) / rate
    height = np.maximum(0.5 - time, 0.0) * speed
    path = np.stack([0 * time, 0 * time, height], axis=1)
    motion = character([flat_sole(path)], hips=path[0] + (0, 0, 0.9), rate=rate, mass=MASS)
    return motion, contacts((time >= 0.5)[:, None])


def test_standing_on_two_feet_each_bears_half_the_weight():
    motion = standing(10, mass=MASS)
    forces = impulse_forces(motion, contacts(np.ones((10, 2))), 0.2)
    assert forces.forces[..., 2] == pytest.approx(np.full((10, 2), WEIGHT / 2))
    assert np.all(forces.forces[..., :2] == 0)


def test_the_weight_moves_to_the_foot_under_the_centre_of_mass():
    """Correction 1: at three quarters of the way to the right foot it bears three quarters."""
    motion = standing(3, hips=(0.0, -0.05, 0.9), mass=MASS)
    forces = impulse_forces(motion, contacts(np.ones((3, 2))), 0.2)
    assert forces.forces[0, :, 2] == pytest.approx([0.25 * WEIGHT, 0.75 * WEIGHT], rel=1e-4)


def test_a_foot_that_rests_bears_its_own_mass_though_the_body_stands_on_the_others():
    places = ((0.0, 0.1, 0.0), (0.0, -0.1, 0.0), (0.6, 0.0, 0.0))
    motion = standing(2, at=places, hips=(-0.1, 0.0, 0.9), mass=MASS)
    on_all = impulse_forces(motion, contacts(np.ones((2, 3))), 0.2)
    assert on_all.forces[0, :, 2].min() == pytest.approx(RESTING_FRACTION * WEIGHT, rel=0.02)
    assert on_all.forces[0, :, 2].sum() == pytest.approx(WEIGHT)
    lifted = impulse_forces(motion, contacts(np.array([[1, 1, 0]] * 2)), 0.2)
    assert lifted.forces[0, :, 2] == pytest.approx([WEIGHT / 2, WEIGHT / 2, 0.0])


def test_an_anatomical_sole_presses_a_standing_body_centimetres_into_snow_and_not_the_paper_s_91():
    """Correction 4: weight/area·L0/E with 10 cm² is 91 cm; with this sole of 200 cm² it is 4.6 cm."""
    motion = standing(2, at=((0.0, 0.0, 0.0),), mass=MASS)
    pressed = impulse_forces(motion, contacts(np.ones((2, 1))), 0.2).forces[0, 0, 2] * 0.3 / 0.25e6
    assert pressed / 10e-4 == pytest.approx(0.912, abs=1e-3)
    assert pressed / motion.soles[0].sole.area == pytest.approx(0.0456, abs=1e-4)


def test_a_landing_adds_its_momentum_over_tau_and_no_more_than_a_walk_shows():
    """Correction 5: 0.3 m/s stopped in 0.15 s adds 2 N/kg: a peak of 1.20 body weights, not of 2.5-3."""
    motion, touching = landing(speed=0.3)
    forces = impulse_forces(motion, touching, 0.15)
    assert forces.forces[..., 2].max() / WEIGHT == pytest.approx(1 + 2.0 / GRAVITY)


def test_momentum_lasts_from_contact_for_tau():
    """Correction 6: 77.5 kg · (9.81 + 2/0.1) N/kg on [t0, t0 + tau], the weight alone after it."""
    motion, touching = landing()
    vertical = impulse_forces(motion, touching, 0.1).forces[:, 0, 2]
    assert vertical[:60] == pytest.approx(0)
    assert vertical[60:72] == pytest.approx(np.full(12, 77.5 * 29.81))
    assert vertical[72:] == pytest.approx(np.full(108, WEIGHT))


def test_only_velocity_into_the_ground_counts():
    motion, touching = landing()
    slope = contacts(touching.touching, normal=(0.6, 0.0, 0.8))
    assert impulse_forces(motion, slope, 0.1).momentum.max() == pytest.approx(77.5 * 0.8 * 2 / 0.1)
    rising, touching = landing(speed=-2.0)
    assert impulse_forces(rising, touching, 0.1).momentum.max() == 0


@pytest.mark.parametrize("rate", [24.0, 30.0, 100.0, 120.0])
def test_the_impulse_of_a_landing_does_not_depend_on_the_frame_rate(rate):
    motion, touching = landing(rate)
    impulse = impulse_forces(motion, touching, 0.13).momentum.sum() / rate
    assert impulse == pytest.approx(77.5 * 2.0)


def jump(rate=120.0, *, crouch=0.25, rise=0.3, drop=0.0, scale=1.0):
    """A body that stands, pushes off, flies a parabola of height `rise` [m] and lands, its legs giving way alike."""
    g = 9.81
    speed = np.sqrt(2 * g * rise)
    push, flight = 2 * crouch / speed, 2 * speed / g
    time = np.arange(int((2.0 + push * 2 + flight) * rate)) / rate
    start, takeoff = 1.0, 1.0 + push
    landing = takeoff + flight
    into = np.clip(time - start, 0, push) / push
    after = np.clip(time - landing, 0, push) / push
    height = 0.9 - crouch + crouch * (into**2)
    air = (time > takeoff) & (time < landing)
    height = np.where(air, 0.9 + speed * (time - takeoff) - g / 2 * (time - takeoff) ** 2, height)
    height = np.where(time >= landing, 0.9 - crouch + crouch * (1 - after) ** 2, height)
    lift = np.where(air, np.minimum(height - 0.9, 0.2), 0.0)
    feet = [flat_sole(np.stack([0 * time, 0 * time + side, lift], axis=1)) for side in (0.1, -0.1)]
    hips = np.stack([0 * time, 0 * time, height], axis=1)
    return (
        character(feet, hips=hips, rate=rate, mass=MASS),
        contacts(np.stack([~air, ~air], axis=1)),
        (takeoff, landing),
    )


@pytest.mark.parametrize("rate", [24.0, 30.0, 60.0, 120.0, 240.0])
def test_a_jump_has_no_force_in_flight_two_feet_alike_and_the_weight_on_average(rate):
    motion, touching, (takeoff, landing) = jump(rate)
    forces = whole_body_forces(motion, touching)
    air = (motion.times > takeoff) & (motion.times < landing)
    assert np.all(forces.total[air] == 0)
    assert forces.forces[:, 0] == pytest.approx(forces.forces[:, 1] * (1.0, -1.0, 1.0), abs=1e-6 * WEIGHT)
    assert forces.total[:, 2].mean() == pytest.approx(WEIGHT, rel=0.02)
    # Uniform deceleration from sqrt(2·g·0.3) over 0.25 m: 1 + 0.3/0.25 = 2.2 body weights.
    assert forces.total[:, 2].max() / WEIGHT == pytest.approx(2.2, abs=0.15)


@pytest.mark.parametrize(("rise", "crouch"), [(0.3, 0.3), (0.4, 0.2), (0.5, 0.15), (0.6, 0.15)])
def test_a_jump_lands_with_the_force_that_stops_it(rise, crouch):
    """1 + rise/crouch body weights: 2 for a soft landing, 5 for a stiff one from 60 cm."""
    motion, touching, (_, landing) = jump(rise=rise, crouch=crouch)
    vertical = whole_body_forces(motion, touching).total[:, 2] / WEIGHT
    assert vertical[motion.times > landing].max() == pytest.approx(1 + rise / crouch, rel=0.08)
    assert np.median(vertical[(motion.times > landing + 0.02) & (vertical > 1.5)]) == pytest.approx(
        1 + rise / crouch, rel=0.02
    )


def test_no_force_pulls_and_the_parts_sum_to_the_total():
    motion, touching, _ = jump(rise=0.6, crouch=0.15)
    forces = whole_body_forces(motion, touching)
    assert forces.forces[..., 2].min() >= 0
    assert forces.forces.sum(axis=1) == pytest.approx(forces.total, abs=1e-9)
    assert forces.weight + forces.momentum == pytest.approx(forces.forces[..., 2], abs=1e-9)


def test_standing_still_bears_the_weight_under_the_centre_of_mass():
    motion = standing(120, hips=(0.0, -0.05, 0.9), mass=MASS)
    forces = whole_body_forces(motion, contacts(np.ones((120, 2))))
    assert forces.forces[:, :, 2] == pytest.approx(np.tile([0.25, 0.75], (120, 1)) * WEIGHT, rel=0.05)


def test_a_single_foot_presses_under_the_centre_of_mass():
    for forward in (-0.06, 0.0, 0.05):
        motion = standing(60, at=((0.0, 0.0, 0.0),), hips=(forward, 0.0, 0.9), mass=MASS)
        forces = whole_body_forces(motion, contacts(np.ones((60, 1))))
        assert forces.centre_of_pressure[30, 0] == pytest.approx([forward, 0, 0], abs=1e-6)


def test_the_centre_of_pressure_stays_on_the_sole():
    motion = standing(60, at=((0.0, 0.0, 0.0),), hips=(0.4, 0.0, 0.9), mass=MASS)
    forces = whole_body_forces(motion, contacts(np.ones((60, 1))))
    assert forces.centre_of_pressure[:, 0, 0] == pytest.approx(np.full(60, 0.12))


def test_four_feet_share_the_weight_of_a_quadruped():
    corners = ((0.4, 0.1, 0.0), (0.4, -0.1, 0.0), (-0.4, 0.1, 0.0), (-0.4, -0.1, 0.0))
    motion = standing(60, at=corners, hips=(0.0267, 0.0, 0.6), mass=MASS, leg_length=0.6)
    forces = whole_body_forces(motion, contacts(np.ones((60, 4))))
    assert forces.forces[30, :, 2] == pytest.approx(np.full(4, WEIGHT / 4), rel=1e-3)


def test_a_jump_that_hangs_in_the_air_has_the_forces_of_the_same_jump_at_its_own_time():
    """Played at half speed, a jump falls with a quarter of g; its forces in body weights are those of the jump."""
    motion, touching, _ = jump()
    slow = character(list(motion.soles), hips=motion.joints["hips"], rate=motion.frame_rate / 2, mass=MASS)
    fast_forces, slow_forces = (whole_body_forces(m, touching).total[:, 2] for m in (motion, slow))
    assert slow_forces.mean() == pytest.approx(WEIGHT, rel=0.25)
    assert np.all(slow_forces[fast_forces == 0] == 0)


def test_feet_apart_push_against_each_other_along_their_legs():
    """Each foot of a body at rest presses along the line from its hip; together they press straight down."""
    count, places = 60, {"hips": (0.0, 0.0, 0.9), "hip_l": (0.0, 0.1, 0.9), "hip_r": (0.0, -0.1, 0.9)}
    feet = [flat_sole(np.tile((0.0, y, 0.0), (count, 1))) for y in (0.3, -0.3)]
    feet = [
        dataclasses.replace(foot, sole=dataclasses.replace(foot.sole, side=side))
        for foot, side in zip(feet, "LR", strict=True)
    ]
    joints = {name: np.tile(place, (count, 1)) for name, place in places.items()}
    forces = whole_body_forces(character(feet, mass=MASS, **joints), contacts(np.ones((count, 2), dtype=bool)))
    lean = (0.3 - 0.1) / 0.9
    assert forces.forces[30] == pytest.approx(WEIGHT / 2 * np.array([[0, -lean, 1], [0, lean, 1]]), abs=0.1)
    assert forces.total[30] == pytest.approx((0.0, 0.0, WEIGHT), abs=1e-3)
