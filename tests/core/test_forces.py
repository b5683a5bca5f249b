"""The forces of both models, against numbers worked out by hand."""

import numpy as np
import pytest

from softground_addon.core.contacts import Contacts
from softground_addon.core.forces import impulse_forces
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
